# SPDX-License-Identifier: Apache-2.0
"""For the lists of abuse: the modules of tests/, and whether everything is wanted."""
import os
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent))
ALL = bool(os.environ.get("ABSENC_ABUSE_ALL"))  # run.py --all


def often(short, everything):
    """How often something is done: as a part of the tests, and with --all."""
    return everything if ALL else short


__all__ = ["ALL", "often"]
