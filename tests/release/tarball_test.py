#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the tarball in Debian 11 and in a system that has no C library, and the wheel in a clean environment."""
import subprocess
import tempfile
import unittest
from pathlib import Path

from root_support import VERSION, RootCase, artefact, base

NAME = f"absenc-{VERSION}-linux-x86_64"


class InDebian11(RootCase):
    archive = staticmethod(lambda: base("bullseye", "bullseye", ["iproute2"]))

    def test_command(self):
        self.put(artefact(f"{NAME}.tar.gz"))
        self.shell(f"cd /srv; tar -xzf {NAME}.tar.gz")
        self.try_the_command(f"/srv/{NAME}/bin/absenc")

    def test_completion_and_man_page(self):
        self.put(artefact(f"{NAME}.tar.gz"))
        self.shell(f"cd /srv; tar -xzf {NAME}.tar.gz")
        self.run_inside("bash", "-c", f"source /srv/{NAME}/share/bash-completion/completions/absenc; complete -p absenc")
        self.assertIn(".TH", (self.root / f"srv/{NAME}/share/man/man1/absenc.1").read_text())


class WithoutCLibrary(RootCase):
    """A root with a static shell and nothing else."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        (cls.root / "bin").mkdir()
        busybox = cls.root / "bin/busybox"
        busybox.write_bytes(Path("/bin/busybox").read_bytes())
        busybox.chmod(0o755)
        for tool in ("sh", "grep", "sed", "kill", "tar", "gzip"):
            (cls.root / "bin" / tool).symlink_to("busybox")

    def test_command(self):
        subprocess.run(["tar", "-xzf", artefact(f"{NAME}.tar.gz"), "-C", self.root / "srv"], check=True)
        self.assertEqual(list(self.root.rglob("libc.so*")), [])
        self.try_the_command(f"/srv/{NAME}/bin/absenc")
        said = self.run_inside(f"/srv/{NAME}/bin/absenc", "serve", status=1)
        self.assertIn("Install the package absenc-serve", said)


class Wheel(unittest.TestCase):
    def test_installs_offline_in_a_clean_environment(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["/usr/bin/python3", "-m", "venv", "--system-site-packages", folder], check=True)
            python = f"{folder}/bin/python3"
            subprocess.run(["unshare", "--net", python, "-m", "pip", "install", "--no-index", "--no-deps",
                            artefact(f"absenc-{VERSION}-cp311-*_x86_64.whl")], check=True, capture_output=True, timeout=60)
            said = subprocess.run([python, "-c", "import absenc; print(absenc.__file__, absenc.open('sim:esl').read().valid)"],
                                  check=True, capture_output=True, text=True, cwd=folder).stdout
            self.assertTrue(said.startswith(folder) and said.endswith("True\n"), said)


if __name__ == "__main__":
    unittest.main()
