# SPDX-License-Identifier: Apache-2.0
"""The Python package: its own tests, and its types as mypy sees them."""
import os
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
PACKAGE = Path(os.environ["ABSENC"]).parent.parent / "python"
PATIENCE = 600


@unittest.skipUnless((PACKAGE / "absenc").is_dir(), "the package was not built")
class Package(unittest.TestCase):
    def run_python(self, *arguments, cwd=None):
        with tempfile.TemporaryDirectory() as home:
            environment = {**os.environ, "PYTHONPATH": str(PACKAGE), "MYPYPATH": str(PACKAGE), "HOME": home,
                           "PYTHONDONTWRITEBYTECODE": "1"}
            done = subprocess.run([sys.executable, *arguments], cwd=cwd or home, env=environment, text=True,
                                  stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=PATIENCE, check=False)
        self.assertEqual(done.returncode, 0, done.stdout)
        return done.stdout

    def test_its_own_tests(self):
        with tempfile.TemporaryDirectory() as scratch:
            self.run_python("-m", "pytest", "-q", "-p", "no:cacheprovider", f"--basetemp={scratch}/tests",
                            str(SOURCE / "python" / "tests"))

    def test_types(self):
        examples = sorted(map(str, (SOURCE / "python" / "examples").glob("*.py")))
        self.run_python("-m", "mypy", "--strict", "--cache-dir=/dev/null", "-p", "absenc")
        self.assertTrue(examples)
        self.run_python("-m", "mypy", "--strict", "--cache-dir=/dev/null", *examples)

    def test_examples(self):
        self.run_python(str(SOURCE / "python" / "examples" / "read_virtual.py"))

    def test_what_help_says(self):
        text = self.run_python("-c", "import absenc; help(absenc.open); help(absenc)")
        self.assertIn("absenc.emulate", text)
        self.assertIn("Degrees", self.run_python("-c", "import absenc; print(absenc.Reading.angle_deg.__doc__)"))

    def test_a_wheel_in_a_clean_environment(self):
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
            # The plugin is found by its entry point.
            (scratch / "test_drive.py").write_text(
                "def test(absenc_emulate):\n    assert absenc_emulate('tformat').path.startswith('/dev/')\n")
            done = subprocess.run([python, "-m", "pytest", "-q", "-p", "no:cacheprovider", "test_drive.py"], cwd=scratch,
                                  env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False)
            self.assertEqual(done.returncode, 0, done.stdout)


if __name__ == "__main__":
    unittest.main()
