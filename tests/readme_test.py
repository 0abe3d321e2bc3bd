# SPDX-License-Identifier: Apache-2.0
"""What the README shows is what happens: its table, its commands, its program."""

import os
import re
import shlex
import subprocess
import tempfile
import textwrap
import unittest
from pathlib import Path

ABSENC = os.environ["ABSENC"]
SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
README = (SOURCE / "README.md").read_text()


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```$", README, re.MULTILINE | re.DOTALL)


def absenc(*arguments, **options):
    return subprocess.run([ABSENC, *arguments], capture_output=True, text=True, timeout=60, stdin=subprocess.DEVNULL,
                          **options)


class Readme(unittest.TestCase):
    def test_the_table_is_what_list_prints(self):
        listed = absenc("list").stdout.split("\n\n")[0].strip()
        self.assertIn("PROTOCOL", listed)
        self.assertIn(listed, README)

    def test_every_command_works(self):
        commands = [line[2:] for block in blocks("console") for line in block.splitlines() if line.startswith("$ ")]
        self.assertGreater(len(commands), 6)
        with tempfile.TemporaryDirectory() as folder:
            config = Path(folder, "absenc.toml")
            config.write_text("".join(blocks("toml")))
            for command in commands:
                words = shlex.split(command.replace("/tmp/", folder + "/"))
                self.assertEqual(words.pop(0), "absenc", command)
                if words[0] == "emulate":
                    words += ["--for", "0.2"]
                done = absenc(*words, env={**os.environ, "ABSENC_CONFIG": str(config)})
                self.assertEqual(done.returncode, 0, f"{command}\n{done.stderr}")
                self.assertTrue(done.stdout, command)

    def test_the_programs_are_the_examples(self):
        examples = ["read_by_name.cpp", "read_position.cpp"]
        self.assertEqual(len(blocks("cpp")), len(examples))
        for name, block in zip(examples, blocks("cpp")):
            example = (SOURCE / "examples" / name).read_text()
            shown = textwrap.dedent(example.split("// [readme]\n")[1].rsplit("\n", 1)[0]).strip()
            self.assertEqual(shown, block.strip())

    def test_files_it_points_to_are_there(self):
        links = re.findall(r"\]\(([^)#]+)\)", README)
        self.assertTrue(links)
        for link in links:
            self.assertTrue((SOURCE / link).exists(), link)


if __name__ == "__main__":
    unittest.main()
