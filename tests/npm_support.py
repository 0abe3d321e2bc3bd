# SPDX-License-Identifier: Apache-2.0
"""Finds the npm tools for the tests of `absenc serve`."""
import os
import pathlib
import unittest

SOURCE = pathlib.Path(os.environ.get("ABSENC_SOURCE_DIR", pathlib.Path(__file__).resolve().parent.parent))
MODULES = SOURCE / "build/npm/node_modules"


def tool(path):
    """Returns the path of a file in node_modules, or skips or fails the test."""
    if (MODULES / path).exists():
        return MODULES / path
    if os.environ.get("ABSENC_NO_NPM"):
        raise unittest.SkipTest("the tools of npm are not here, and its registry cannot be reached")
    raise AssertionError(f"{MODULES / path} is not there: ./dev test --all installs it, or\n"
                         "mkdir -p build/npm && cp tests/npm/package*.json build/npm && npm ci --prefix build/npm")
