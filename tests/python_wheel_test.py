# SPDX-License-Identifier: Apache-2.0
"""Builds a wheel of the Python package and installs it into a clean environment."""
import os
import subprocess
import tempfile
import unittest
from pathlib import Path

from python_support import PACKAGE, PATIENCE, SOURCE, PackageCase


class Wheel(PackageCase):
    def test_wheel_works_in_clean_environment(self):
        with tempfile.TemporaryDirectory() as scratch:
            scratch = Path(scratch)
            self.run_python("-m", "pip", "wheel", "--no-build-isolation", "--no-index", "--no-deps", "-w", str(scratch),
                            "--config-settings", f"build-dir={PACKAGE.parent}", str(SOURCE))
            wheels = list(scratch.glob("absenc-*.whl"))
            self.assertEqual(len(wheels), 1)
            self.run_python("-m", "venv", "--system-site-packages", str(scratch / "clean"))
            python = str(scratch / "clean" / "bin" / "python3")
            environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
            subprocess.run([python, "-m", "pip", "install", "--no-index", "--no-deps", str(wheels[0])], check=True,
                           env=environment, capture_output=True, timeout=PATIENCE)
            said = subprocess.run([python, "-c", "import absenc; print(absenc.__file__); absenc.open('sim:esl').read()"],
                                  check=True, env=environment, capture_output=True, text=True, cwd=scratch,
                                  timeout=PATIENCE)
            self.assertTrue(said.stdout.startswith(str(scratch / "clean")))
            # pytest finds the package's plugin by its entry point, so the wheel must declare it.
            (scratch / "test_drive.py").write_text(
                "def test(absenc_emulate):\n    assert absenc_emulate('tformat').path.startswith('/dev/')\n")
            done = subprocess.run([python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_drive.py"], cwd=scratch,
                                  env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False)
            self.assertEqual(done.returncode, 0, done.stdout)


if __name__ == "__main__":
    unittest.main()
