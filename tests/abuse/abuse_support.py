# SPDX-License-Identifier: Apache-2.0
"""Helpers of the abuse tests: makes the modules of tests/ importable, and selects the short or the full test."""
import os
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
ALL = bool(os.environ.get("ABSENC_ABUSE_ALL"))  # whether to run the full test, which run.py --all requests


def often(short, everything):
    """Returns the number of repetitions of a test: `short` in the normal test run, `everything` with run.py --all."""
    return everything if ALL else short


__all__ = ["ALL", "often"]
