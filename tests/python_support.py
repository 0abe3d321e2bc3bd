# SPDX-License-Identifier: Apache-2.0
"""Shared by the tests of the Python package."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
PACKAGE = Path(os.environ["ABSENC"]).parent.parent / "python"
PATIENCE = 600


class PackageCase(unittest.TestCase):
    def run_python(self, *arguments, cwd=None):
        with tempfile.TemporaryDirectory() as home:
            environment = {**os.environ, "PYTHONPATH": str(PACKAGE), "MYPYPATH": str(PACKAGE), "HOME": home,
                           "PYTHONDONTWRITEBYTECODE": "1"}
            done = subprocess.run([sys.executable, *arguments], cwd=cwd or home, env=environment, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=PATIENCE, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout
