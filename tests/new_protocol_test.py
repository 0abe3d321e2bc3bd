# SPDX-License-Identifier: Apache-2.0
"""Tests the unit that `./dev new-protocol` creates."""

import os
import shlex
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
BUILD = Path(os.environ["ABSENC"]).parent.parent
COMPILE = ["g++", "-std=c++20", "-O0", "-Wall", "-Wextra", "-Wpedantic", "-Wshadow", "-Wconversion", "-Werror"]
# Tests in Python that look at every unit and take seconds.
LOOK_AT_EVERY_UNIT = ("include_direction", "type_names", "tables", "command", "three_states", "wave")


def run(*command, **settings):
    done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=900, check=False, **settings)
    if done.returncode != 0:
        raise AssertionError(f"{shlex.join(map(str, command))}\n{done.stdout}")
    return done.stdout


class Copy(unittest.TestCase):
    """A test with a copy of the sources in a repository of its own, with a new unit."""

    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.root = Path(folder.name) / "sources"
        shutil.copytree(SOURCE, cls.root, ignore=shutil.ignore_patterns("build", ".git", "__pycache__"))
        cls.git("init", "-q")
        cls.git("add", "-A")
        cls.git("-c", "user.name=test", "-c", "user.email=test@localhost", "commit", "-q", "-m", "all")
        run(cls.root / "dev", "new-protocol", "my_encoder")
        cls.unit = cls.root / "absenc/protocol/my_encoder"

    @classmethod
    def git(cls, *arguments):
        return run("git", "-C", cls.root, *arguments)


class NewProtocol(Copy):
    def refused(self, name):
        return subprocess.run([self.root / "dev", "new-protocol", name], capture_output=True, text=True, check=False).returncode

    def test_changes_one_line_outside_of_folder(self):
        changed = self.git("status", "--porcelain").splitlines()
        self.assertEqual(changed, [" M absenc/protocol/all.cpp", "?? absenc/protocol/my_encoder/"])
        self.assertEqual(self.git("diff", "--numstat").split(), ["1", "0", "absenc/protocol/all.cpp"])
        self.assertNotIn("protocol_name", "".join(file.read_text() for file in self.unit.iterdir()))

    def test_is_formatted(self):
        sources = [self.root / "absenc/protocol/all.cpp", *self.unit.glob("*.[ch]pp")]
        run("clang-format", "--dry-run", "--Werror", *sources)

    def test_compiles_with_optimisation_without_warning(self):
        for source in self.unit.glob("*.cpp"):
            run(*COMPILE, "-O2", "-I", self.root, "-c", source, "-o", self.root / "object.o")

    def test_refuses_invalid_or_existing_names(self):
        self.assertEqual(self.refused("tformat"), 1)
        for name in ("Upper", "1st", "core", "client", "a-b", ""):
            self.assertEqual(self.refused(name), 2, name)


class TestsOfEveryUnit(Copy):
    """Runs the programs of this build with a library that has the new unit, too."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.library = cls.root / "libabsenc.a"
        shutil.copy(BUILD / "libabsenc.a", cls.library)
        run("ar", "d", cls.library, "all.cpp.o")
        for source in (cls.root / "absenc/protocol/all.cpp", cls.unit / "unit.cpp", cls.unit / "clauses.cpp"):
            cls.compile(source)

    @classmethod
    def compile(cls, source):
        target = cls.root / f"my_encoder_{source.name}.o"
        run(*COMPILE, "-fPIC", "-I", cls.root, "-c", source, "-o", target)
        run("ar", "r", cls.library, target)

    def linked(self, target):
        """Links a program of the build with the new library in place of its own."""
        command = run("ninja", "-C", BUILD, "-t", "commands", target).splitlines()[-1]
        program = self.root.parent / target
        program.parent.mkdir(exist_ok=True)
        command = command.replace(f" -o {target} ", f" -o {program} ").replace(" libabsenc.a", f" {self.library}")
        run("sh", "-c", command, cwd=BUILD)
        return program

    def passes(self, program, tests):
        shown = run(program, f"--gtest_filter={tests}", env={**os.environ, "ABSENC_SOURCE_DIR": str(self.root), "ABSENC_CASES_PERCENT": "10"})
        self.assertRegex(shown, r"\[  PASSED  \] [1-9]")

    def test_kit(self):
        self.passes(self.linked("tests/kit_test"), "*my_encoder*")

    def test_kit_computes_open_checksum(self):
        source = self.unit / "unit.cpp"
        text = source.read_text(encoding="utf-8")
        open_text = text.replace('"500151", "01123447"', '"5001..", "011234.."')
        self.assertNotEqual(open_text, text)
        try:
            source.write_text(open_text, encoding="utf-8")
            self.compile(source)
            done = subprocess.run([self.linked("tests/kit_test"), "--gtest_filter=Units/Kit.DecodesVectors/my_encoder"],
                                  capture_output=True, text=True, check=False)
        finally:
            source.write_text(text, encoding="utf-8")
            self.compile(source)
        self.assertEqual(done.returncode, 1)
        self.assertIn('request is not complete: paste "500151"\n', done.stdout)
        self.assertIn('reply is not complete: paste "01123447"\n', done.stdout)

    def test_client(self):
        self.passes(self.linked("tests/client_test"), "Units/*Clauses.*my_encoder*")

    def test_tests_in_python(self):
        command = self.linked("bin/absenc")
        (self.root.parent / "lib").symlink_to(BUILD / "lib")  # the programs and plug-ins that the command starts
        environment = {**os.environ, "ABSENC": str(command), "ABSENC_SOURCE_DIR": str(self.root)}
        self.assertIn("my_encoder", run(command, "list"))
        for name in LOOK_AT_EVERY_UNIT:
            with self.subTest(name):
                run("/usr/bin/python3", "-B", self.root / f"tests/{name}_test.py", env=environment)

    def test_own_test_fails_until_unit_is_written(self):
        program = self.root.parent / "own"
        run(*COMPILE, "-I", self.root, self.unit / "my_encoder_test.cpp", "-o", program, self.library, "-lgtest", "-lgtest_main",
            "-lpthread")
        own = subprocess.run([program], capture_output=True, text=True, check=False,
                             env={**os.environ, "ABSENC_SOURCE_DIR": str(self.root)})
        self.assertEqual(own.returncode, 1)
        for name in ("README.md", "unit.hpp", "unit.cpp", "clauses.cpp"):
            self.assertRegex(own.stdout, rf'{name} still has "[^"]+": replace what the template invents')


if __name__ == "__main__":
    unittest.main()
