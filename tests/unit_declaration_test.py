#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests that a misspelt member in a unit's declaration does not compile."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ.get("ABSENC_SOURCE_DIR", Path(__file__).resolve().parent.parent))
TEMPLATE = SOURCE / "docs/protocol-template"
AUTHOR = SOURCE / "absenc/protocol/author"
COMPILE = ["g++", "-std=c++20", "-fsyntax-only", "-Wall", "-Wextra", "-Werror"]


def members(aggregate, header):
    """Returns the names of the members of a struct that the author of a unit fills in."""
    text = (AUTHOR / header).read_text(encoding="utf-8")
    body = re.search(rf"^struct {aggregate} {{\n(.*?)^}};", text, re.MULTILINE | re.DOTALL).group(1)
    return re.findall(r"^  (?!using)(?:\w[\w:<>, *&]* )?\*?\(?\*?(\w+)\)?(?:\([^;]*\))?(?:\{\}| = [\w.]+|);", body, re.MULTILINE)


class UnitDeclaration(unittest.TestCase):
    def compiled(self, change_unit=lambda text: text, change_frames=lambda text: text):
        with tempfile.TemporaryDirectory() as folder:
            unit = Path(folder) / "absenc/protocol/protocol_name"
            shutil.copytree(TEMPLATE, unit)
            for name, change in (("unit.cpp", change_unit), ("unit.hpp", change_frames)):
                text = (unit / name).read_text(encoding="utf-8")
                (unit / name).write_text(change(text), encoding="utf-8")
            return subprocess.run(COMPILE + ["-I", folder, "-I", str(SOURCE), str(unit / "unit.cpp")],
                                  capture_output=True, text=True, env={**os.environ, "LC_ALL": "C"})

    def refused(self, name, **changes):
        result = self.compiled(**changes)
        self.assertNotEqual(result.returncode, 0, f"{name} compiles")
        self.assertRegex(result.stderr, rf"error: .*'{name}'")

    def test_template_compiles(self):
        self.assertEqual(self.compiled().stderr, "")

    def test_misspelt_member_does_not_compile(self):
        for right, wrong in ((".timing", ".timming"), (".put_reply", ".put_replay"), ("found{.put ", "found{.puts ")):
            self.refused(wrong.split(".")[1].strip(), change_unit=lambda text: text.replace(right, wrong))

    def test_misspelt_function_does_not_compile(self):
        names = ("expected", "is_whole", "latched")
        result = self.compiled(change_frames=lambda text: re.sub(rf"\b({'|'.join(names)})\(const", r"\1s(const", text))
        for name in names:
            self.assertIn(f"error: '{name}' is not a member of", result.stderr)

    def test_wrong_times_of_virtual_encoder_do_not_compile(self):
        character = ".character = format.line().character()"
        for times, message in ((f"{character} / 2", "DeviceTimes::character is the duration of one byte"),
                               (f"{character}, .gap = 10us, .frame = 2, .frame_pause = 10us",
                                "it is longer than DeviceTimes::frame_pause")):
            result = self.compiled(change_frames=lambda text: self.replaced(
                text, f"{character}, .answer_time = 10us, .start_time = 100ms", times))
            self.assertNotEqual(result.returncode, 0, times)
            self.assertIn(message, result.stderr)

    def replaced(self, text, old, new):
        self.assertIn(old, text)
        return text.replace(old, new)

    def test_each_member_is_tested(self):
        declared = members("Declaration", "declaration.hpp")
        self.assertGreater(len(declared), 30)
        text = (AUTHOR / "declaration_test.cpp").read_text(encoding="utf-8")
        self.assertEqual([name for name in declared if f".{name} = " not in text], [])
        shown = members("Report", "command.hpp") + members("Finding", "command.hpp")
        self.assertGreater(len(shown), 8)
        text += (AUTHOR / "author_test.cpp").read_text(encoding="utf-8")
        self.assertEqual([name for name in shown if f".{name} = " not in text], [])


if __name__ == "__main__":
    unittest.main()
