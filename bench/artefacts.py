#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: artefacts.py [RELEASE] [--before COMMAND]

Prints a table of the artefacts in the folder RELEASE (build/release-VERSION): size of the file, size of the largest program
or module inside, shared libraries that it loads (ldd) and, for the command, the processor time of `absenc --version`, the
least of 60 runs in turns with those of COMMAND, an absenc of another version.
"""
import argparse
import os
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
RUNS = 60


def unpack(path, folder):
    """Unpacks an artefact to the folder."""
    if path.suffix == ".deb":
        subprocess.run(["dpkg-deb", "-x", path, folder], check=True)
    elif path.suffix in (".whl", ".zip"):
        with zipfile.ZipFile(path) as archive:
            archive.extractall(folder)
    else:
        subprocess.run(["tar", "-xzf", path, "-C", folder], check=True)


def program_of(folder):
    """Returns the largest file in the folder that a system could execute or load, or None."""
    begins = (b"\x7fELF", b"MZ")
    files = [path for path in folder.rglob("*") if path.is_file() and not path.is_symlink()]
    programs = [path for path in files if path.open("rb").read(4).startswith(begins)]
    return max(programs, key=lambda path: path.stat().st_size, default=None)


def machine(program):
    """Returns the part of a program's header that says for which processor it is."""
    return program.read_bytes()[:20][18:]


def libraries_of(program):
    """Returns the number of shared libraries that a program loads, the dynamic linker included; None if this computer cannot
    run it."""
    if machine(program) != machine(Path(sys.executable)):
        return None
    said = subprocess.run(["ldd", program], capture_output=True, text=True, check=False)
    return 0 if "statically" in said.stdout or said.returncode != 0 else len(said.stdout.splitlines())


def seconds_of(command):
    """Returns the processor time of `command --version`."""
    process = subprocess.Popen([command, "--version"], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        raise SystemExit(f"artefacts: {command} --version ends with {process.returncode}")
    return usage.ru_utime + usage.ru_stime


def least_seconds(commands):
    """Returns the least processor time of each command, which run in turns."""
    return [min(times) for times in zip(*([seconds_of(command) for command in commands] for _ in range(RUNS)))]


def megabytes(size):
    return f"{size / 1e6:.2f} MB"


def row(path, folder, before):
    unpack(path, folder)
    program = program_of(folder)
    if program is None:
        return [path.name, megabytes(path.stat().st_size), "", "", ""]
    libraries, start = libraries_of(program), ""
    if program.name == "absenc" and libraries is not None:
        least = least_seconds([program] + ([before] if before else []))
        start = f"{least[0] * 1000:.2f} ms" + (f", {least[0] / least[1]:.2f} of {least[1] * 1000:.2f} ms" if before else "")
    return [path.name, megabytes(path.stat().st_size), megabytes(program.stat().st_size),
            "" if libraries is None else str(libraries), start]


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("release", type=Path, nargs="?", default=ROOT / f"build/release-{(ROOT / 'VERSION').read_text().strip()}")
    parser.add_argument("--before", type=Path)
    chosen = parser.parse_args()
    rows = [["artefact", "download", "program", "shared libraries", "start"], ["---"] * 5]
    for path in sorted(chosen.release.iterdir()):
        if path.suffix in (".deb", ".whl", ".zip", ".gz"):
            with tempfile.TemporaryDirectory() as folder:
                rows.append(row(path, Path(folder), chosen.before))
    print("\n".join(f"| {' | '.join(cells)} |" for cells in rows))


if __name__ == "__main__":
    main()
