#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the abuse tests of this folder: run.py [--all] [part of a name...]"""
import os
import pathlib
import subprocess
import sys
import time

HERE = pathlib.Path(__file__).resolve().parent


def main(words):
    names = [word for word in words if word != "--all"]
    environment = {**os.environ, "ABSENC_ABUSE_ALL": "1" if "--all" in words else ""}
    lists = [path for path in sorted(HERE.glob("*_abuse.py")) if not names or any(name in path.name for name in names)]
    if not lists:
        sys.exit(f"run.py: no list of abuse has {' or '.join(names)} in its name")
    failed = []
    for path in lists:
        started = time.monotonic()
        status = subprocess.run([sys.executable, "-B", path], env=environment, check=False).returncode
        print(f"{path.stem}: {'good' if status == 0 else 'FAILED'}, {time.monotonic() - started:.0f} s", flush=True)
        failed += [path.stem] if status else []
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main(sys.argv[1:])
