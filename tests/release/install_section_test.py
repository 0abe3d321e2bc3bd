#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the section "Install" of README.md, each of its ways from top to bottom as it stands there."""
import os
import re
import subprocess
import tempfile
import unittest
import zipfile
from pathlib import Path

from root_support import RELEASE, SOURCE, RootCase, base, debian_12
from wine_support import WINE, Prefix

SECTION = (SOURCE / "README.md").read_text().split("## Install\n")[1].split("\n## ")[0]
BLOCKS = re.findall(r"^```sh\n(.*?)^```", SECTION, re.MULTILINE | re.DOTALL)
# The test of a release is no place for these: they are the tests of a change, and the release itself.
RUN_ELSEWHERE = ("./dev test", "./dev test --all", "./dev release")


def block(command):
    """Returns the commands of the one block that has this command."""
    [found] = [text for text in BLOCKS if command in text]
    return found


class InARoot(RootCase):
    """A root with the files of the release in /srv. Its user is root, who needs no sudo."""

    commands = ""  # the commands that are run

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        for name in re.findall(r"\b\w[\w.-]*\.(?:deb|tar\.gz)", cls.commands):
            cls().put(RELEASE / name)
        sudo = cls.root / "usr/bin/sudo"
        sudo.write_text('#!/bin/sh\nexec "$@"\n')
        sudo.chmod(0o755)

    def run_commands(self):
        return self.shell(f"cd /srv; USER=root\n{self.commands}", timeout=300)


class DebianPackages(InARoot):
    archive = staticmethod(debian_12)
    commands = block("sudo apt install")

    def test_each_command(self):
        self.run_commands()
        for command in ("absenc read sim:tformat", "absenc serve --help", "absenc record sim:tformat --output /srv/a.h5 --count 1",
                        "python3 -c 'import absenc'", "test -f /usr/include/absenc/core/hex.hpp"):
            with self.subTest(command):
                self.shell(command)
        self.assertIn("dialout", self.run_inside("id", "root"))


class Tarball(InARoot):
    archive = staticmethod(lambda: base("bullseye", "bullseye", ["iproute2"]))
    commands = block("tar -xzf")

    def test_each_command(self):
        self.assertIn("tformat", self.run_commands())


class OnThisComputer(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def run_here(self, *command, **settings):
        done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                              timeout=1500, check=False, **settings)
        self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
        return done.stdout

    def test_windows(self):
        [name] = re.findall(r"absenc-[\w.-]*windows[\w.-]*\.zip", SECTION)
        with zipfile.ZipFile(RELEASE / name) as archive:
            archive.extractall(self.folder)
        [program] = self.folder.rglob("absenc.exe")
        with Prefix() as prefix:
            self.assertIn("tformat", self.run_here(WINE, program, "list", env=prefix.environment))

    def test_python(self):
        commands = block("pip install").splitlines()
        self.assertEqual(len(commands), 2)
        for number, command in enumerate(commands):
            with self.subTest(command):
                environment = self.folder / f"environment-{number}"
                self.run_here("/usr/bin/python3", "-m", "venv", "--system-site-packages", environment)
                self.run_here("unshare", "--net", "sh", "-euc", command, cwd=RELEASE,
                              env={**os.environ, "PATH": f"{environment}/bin:{os.environ['PATH']}"})
                said = self.run_here(environment / "bin/python3", "-c",
                                     "import absenc; print(absenc.__file__, absenc.open('sim:esl').read().valid)", cwd=self.folder)
                self.assertTrue(said.startswith(str(environment)) and said.endswith(" True\n"), said)

    def test_sources(self):
        commands = [line.split("#")[0].strip() for line in block("./dev build").splitlines()]
        for command in RUN_ELSEWHERE:
            commands.remove(command)
        self.assertEqual(len(commands), 3)
        clone = self.folder / "absenc"
        self.run_here("git", "clone", "-q", SOURCE, clone)
        script = "\n".join(commands)
        # the installation goes to an empty /usr/local, which ends with the shell
        said = self.run_here("unshare", "--mount", "bash", "-euc",
                             f'mount -t tmpfs none /usr/local\nsudo() {{ "$@"; }}\n{script}\n/usr/local/bin/absenc --version', cwd=clone)
        self.assertIn("deg", said)
        self.assertRegex(said, r"(?m)^absenc \d+\.\d+\.\d+$")


if __name__ == "__main__":
    unittest.main()
