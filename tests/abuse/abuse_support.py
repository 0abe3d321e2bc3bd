# SPDX-License-Identifier: Apache-2.0
"""Helpers of the abuse tests: the import path of tests/, and the short or the full test."""
import os
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
ALL = bool(os.environ.get("ABSENC_ABUSE_ALL"))  # whether to run the full test, which run.py --all requests


def often(short, everything):
    """Returns `short` in the normal test run, and `everything` with run.py --all."""
    return everything if ALL else short


__all__ = ["ALL", "often"]
