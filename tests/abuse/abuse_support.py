# SPDX-License-Identifier: Apache-2.0
"""Shared by the abuse tests: the import path of tests/, and the choice between the short and the full test."""
import os
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
ALL = bool(os.environ.get("ABSENC_ABUSE_ALL"))  # set by run.py --all


def often(short, everything):
    """Returns the number of repetitions: `short` as a part of the normal tests, `everything` with --all."""
    return everything if ALL else short


__all__ = ["ALL", "often"]
