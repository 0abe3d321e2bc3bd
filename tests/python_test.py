# SPDX-License-Identifier: Apache-2.0
"""Tests the Python package: its types with mypy, its examples and its help."""
import unittest

from python_support import SOURCE, PackageCase


class Package(PackageCase):
    def test_types_pass_mypy(self):
        examples = sorted(map(str, (SOURCE / "python" / "examples").glob("*.py")))
        self.run_python("-m", "mypy", "--strict", "--cache-dir=/dev/null", "-p", "absenc")
        self.assertTrue(examples)
        self.run_python("-m", "mypy", "--strict", "--cache-dir=/dev/null", *examples)

    def test_example_runs(self):
        self.run_python(str(SOURCE / "python" / "examples" / "read_virtual.py"))

    def test_help_shows_documentation(self):
        text = self.run_python("-c", "import absenc; help(absenc.open); help(absenc)")
        self.assertIn("absenc.emulate", text)
        self.assertIn("degrees", self.run_python("-c", "import absenc; print(absenc.Reading.angle_deg.__doc__)"))


if __name__ == "__main__":
    unittest.main()
