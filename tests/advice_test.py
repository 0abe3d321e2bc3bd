# SPDX-License-Identifier: Apache-2.0
"""Checks the commands that strings of the sources name in backquotes."""

import os
import re
import subprocess
import unittest
from pathlib import Path

ROOT = Path(os.environ.get("ABSENC_SOURCE_DIR", Path(__file__).resolve().parent.parent))
ABSENC = os.environ.get("ABSENC", str(ROOT / "build/release/bin/absenc"))
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"')
TWO_WORDS = {"config", "memory", "crc"}


def literals(source):
    """Returns the string literals of a C++ source file, with those of adjacent lines joined."""
    text = source.read_text(encoding="utf-8")
    text = re.sub(r"(?m)^\s*//.*$", "", text)
    text = re.sub(r'"\s*\n\s*"', "", text)
    return [match[1] for match in LITERAL.finditer(text)]


def sources():
    for folder in ("absenc", "tools"):
        for suffix in ("*.cpp", "*.hpp"):
            yield from (path for path in (ROOT / folder).rglob(suffix) if "_test" not in path.name)


def named_commands():
    """Yields (source file, text in backquotes, such as "absenc scan") for each text in backquotes."""
    for source in sources():
        for text in literals(source):
            for quoted in re.findall(r"`([^`]*)`", text):
                yield source.relative_to(ROOT), quoted


class NamedCommands(unittest.TestCase):
    def test_named_commands_exist(self):
        verbs = {}
        for source, quoted in named_commands():
            words = quoted.split()
            if not words or words[0] != "absenc":
                continue
            verb = tuple(words[1:3] if words[1] in TWO_WORDS else words[1:2])
            if not re.fullmatch(r"[a-z-]+", verb[0]) or verb[0].startswith("-"):
                # A quoted command is not run if an option or a placeholder stands behind `absenc` instead of a verb.
                continue
            verbs.setdefault(verb, f"{source}: `{quoted}`")
        self.assertGreater(len(verbs), 15)
        for verb, where in verbs.items():
            with self.subTest(where):
                result = subprocess.run([ABSENC, *verb, "--help"], capture_output=True, text=True, timeout=30, check=False)
                self.assertEqual(result.returncode, 0, result.stderr)

    def test_commands_begin_with_tool_name(self):
        refusal = subprocess.run([ABSENC, "no-verb"], capture_output=True, text=True, timeout=30, check=False).stderr
        verbs = set(re.search(r"known are: (.*)", refusal)[1].split(", "))
        self.assertIn("clear-alarms", verbs)
        for source, quoted in named_commands():
            with self.subTest(f"{source}: `{quoted}`"):
                self.assertNotIn(quoted.split(" ")[0], verbs)

    def test_shell_commands_stand_in_backquotes(self):
        """Commands with `sudo` must stand in backquotes, unless the text begins with one."""
        for source in sources():
            for text in literals(source):
                rest = re.sub(r"`[^`]*(`|$)", "", text)
                if text.startswith("sudo "):
                    continue  # the whole text is an example command, so `sudo` needs no backquotes
                with self.subTest(f"{source.relative_to(ROOT)}: {text}"):
                    self.assertNotRegex(rest, r"\bsudo \w")


if __name__ == "__main__":
    unittest.main()
