# SPDX-License-Identifier: Apache-2.0
"""Helpers of the abuse tests: the import path of tests/, and the short or the full test."""
import os
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
# whether to run the long version of the tests, which run.py --all requests
ALL = bool(os.environ.get("ABSENC_ABUSE_ALL"))


def often(short, everything):
    """Returns `short` in the normal test run, and `everything` with run.py --all."""
    return everything if ALL else short


__all__ = ["ALL", "often"]
