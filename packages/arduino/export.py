#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: export.py FOLDER

Writes absenc as an Arduino library into FOLDER/absenc, which must not exist. An Arduino library has all its sources
below src and compiles all of them, so a checkout cannot be one. To install it, use the sketchbook's `libraries` as FOLDER."""
import re
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
LAYERS = ("core", "link", "protocol", "host")
TEST_FILES = re.compile(r"_(test|fuzz|bench)\.[ch]pp$|^test_|^testing\.hpp$")


def export(folder):
    library = Path(folder) / "absenc"
    library.mkdir(parents=True)
    for name in ("library.properties", "examples"):
        copy = shutil.copytree if (HERE / name).is_dir() else shutil.copy
        copy(HERE / name, library / name)
    shutil.copy(ROOT / "LICENSE", library)
    for layer in LAYERS:
        for path in sorted((ROOT / "absenc" / layer).rglob("*.[ch]pp")):
            if TEST_FILES.search(path.name):
                continue
            to = library / "src" / path.relative_to(ROOT)
            to.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, to)
    shutil.copy(HERE / "absenc.h", library / "src")


if __name__ == "__main__":
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    export(sys.argv[1])
