# SPDX-License-Identifier: Apache-2.0
"""The Python package: its types as mypy sees them, its examples, its help."""
import unittest

from python_support import SOURCE, PackageCase


class Package(PackageCase):
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


if __name__ == "__main__":
    unittest.main()
