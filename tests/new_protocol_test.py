# SPDX-License-Identifier: Apache-2.0
"""Tests that `./dev new-protocol` creates a unit that builds, is listed and passes the kit, and whose own test fails
until it is written."""

import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
LIBRARY = Path(os.environ["ABSENC"]).parent.parent / "libabsenc.a"
COMPILE = ["g++", "-std=c++20", "-O0", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror"]

# A test program with two checks of the kit that need no virtual encoder; compiling the whole kit takes too long.
KIT_TEST = """
#include <gtest/gtest.h>
#include "absenc/protocol/all.hpp"
#include "tests/kit/kit.hpp"
using namespace absenc;
void expect_none(const kit::Findings& findings) {
  for (const std::string& text : findings.texts()) ADD_FAILURE() << text;
}
void check(const Unit& unit) {
  expect_none(kit::check_decoding(unit));
  expect_none(kit::check_hosts(unit));
}
TEST(Kit, my_encoder) { check(*all_units().back()); }
TEST(Kit, tformat) { check(*find_unit("tformat")); }
"""


class NewProtocol(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.root = Path(self.folder.name)
        for part in ("absenc", "docs/protocol-template", "tools/new-protocol.py", "tests/kit"):
            (self.root / part).parent.mkdir(parents=True, exist_ok=True)
            if (SOURCE / part).is_dir():
                shutil.copytree(SOURCE / part, self.root / part)
            else:
                shutil.copy(SOURCE / part, self.root / part)

    def new_protocol(self, name):
        return subprocess.run(["python3", "-B", str(self.root / "tools/new-protocol.py"), name, "--root", str(self.root)],
                              capture_output=True, text=True)

    def test_creates_unit_that_builds_and_fails(self):
        made = self.new_protocol("my_encoder")
        self.assertEqual(made.returncode, 0, made.stderr)
        unit = self.root / "absenc/protocol/my_encoder"
        self.assertNotIn("protocol_name", "".join(file.read_text() for file in unit.iterdir()))
        sources = [self.root / "absenc/protocol/all.cpp", unit / "unit.cpp", unit / "my_encoder_test.cpp",
                   self.root / "kit_test.cpp", unit / "clauses.cpp",
                   *(self.root / "tests/kit" / name for name in ("decoding.cpp", "frames.cpp", "hosts.cpp"))]
        sources[3].write_text(KIT_TEST)
        program = self.root / "kit"
        subprocess.run(COMPILE + ["-I", str(self.root)] + [str(source) for source in sources] +
                       ["-o", str(program), str(LIBRARY), "-lgtest", "-lgtest_main", "-lpthread"], check=True)
        kit = subprocess.run([str(program), "--gtest_filter=*my_encoder*:ProtocolName.*:*tformat*"],
                             capture_output=True, text=True)
        self.assertEqual(kit.returncode, 1)
        failed = [line for line in kit.stdout.splitlines() if line.startswith("[  FAILED  ]")]
        self.assertEqual({line.split()[3] for line in failed} - {"1"}, {"ProtocolName.DocumentIsNotTheInventedOne"})

    def test_example_in_contributing_is_from_template(self):
        """The example in CONTRIBUTING.md must be code of the template, because the test above compiles only the
        template."""
        text = (SOURCE / "CONTRIBUTING.md").read_text(encoding="utf-8")
        template = (SOURCE / "docs/protocol-template/unit.cpp").read_text(encoding="utf-8")
        examples = re.findall(r"^( *)```cpp\n(.*?)^ *```", text, re.MULTILINE | re.DOTALL)
        self.assertTrue(examples)
        for indent, example in examples:
            self.assertIn(re.sub(f"^{indent}", "", example, flags=re.MULTILINE), template)

    def test_refuses_invalid_or_existing_names(self):
        self.assertEqual(self.new_protocol("tformat").returncode, 1)
        for name in ("Upper", "1st", "core", "a-b", ""):
            self.assertEqual(self.new_protocol(name).returncode, 2, name)


if __name__ == "__main__":
    unittest.main()
