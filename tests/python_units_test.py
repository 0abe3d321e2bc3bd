# SPDX-License-Identifier: Apache-2.0
"""Runs the Python package's own tests, which use every unit's virtual encoder."""
import tempfile
import unittest

from python_support import SOURCE, PackageCase


class Units(PackageCase):
    def test_own_tests_pass(self):
        with tempfile.TemporaryDirectory() as scratch:
            self.run_python("-m", "pytest", "-q", "-p", "no:cacheprovider", f"--basetemp={scratch}/tests",
                            str(SOURCE / "python" / "tests"))


if __name__ == "__main__":
    unittest.main()
