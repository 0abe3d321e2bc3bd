#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: pack.py TREE FOLDER...

Packs absenc.exe and the C++ library of the build tree TREE into two archives in TREE. FOLDER...: the folders that
libraries.py prints, whose code absenc.exe contains."""
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT / "packages"))
from archives import write_zip

VERSION = (ROOT / "VERSION").read_text().strip()
TOOLS = "x86_64-w64-mingw32"
# The libraries of Windows that absenc.exe may need.
WINDOWS = {"advapi32.dll", "kernel32.dll", "msvcrt.dll", "setupapi.dll", "shell32.dll", "user32.dll", "ws2_32.dll"}
# Packages of Debian whose code absenc.exe contains, besides the libraries that are built for it.
INSIDE = ["libfmt-dev", "nlohmann-json3-dev", "libtomlplusplus-dev", "libhwy-dev", "libz-mingw-w64-dev", "libjs-dygraphs",
          "gcc-mingw-w64-base", "mingw-w64-x86-64-dev"]
# Source packages of the libraries that absenc::captures and absenc::hdf5 link.
LINKED_BY_THE_LIBRARY = ["hdf5", "libdeflate", "minizip"]


def name_of(folder):
    """Returns the name of the source package in a folder of libraries.py: NAME-VERSION-DIGEST."""
    return re.match(r"(.+?)-\d", folder.name)[1]


def licences(folders):
    files = {"LICENSE": ((ROOT / "LICENSE").read_bytes(), 0o644)}
    for package in INSIDE:
        files[f"licences/{package}.txt"] = (Path(f"/usr/share/doc/{package}/copyright").read_bytes(), 0o644)
    for folder in folders:
        files[f"licences/{name_of(folder)}.txt"] = ((folder / "copyright").read_bytes(), 0o644)
    return files


def command(tree):
    """Returns absenc.exe without its symbols. Ends this program if it needs libraries besides those of Windows."""
    listed = subprocess.run([f"{TOOLS}-objdump", "-p", tree / "bin/absenc.exe"], check=True, capture_output=True, text=True)
    needed = {name.lower() for name in re.findall(r"DLL Name: (\S+)", listed.stdout)}
    if not needed or needed - WINDOWS:
        sys.exit(f"absenc.exe needs libraries that Windows does not have: {', '.join(sorted(needed - WINDOWS)) or 'none found'}")
    with tempfile.TemporaryDirectory() as scratch:
        stripped = Path(scratch) / "absenc.exe"
        subprocess.run([f"{TOOLS}-strip", "-o", stripped, tree / "bin/absenc.exe"], check=True)
        return stripped.read_bytes()


def library(tree, folders):
    """Returns the files of the C++ library, with those libraries that it links and that are built for it."""
    with tempfile.TemporaryDirectory() as scratch:
        subprocess.run(["cmake", "--install", tree, "--component", "libabsenc-dev", "--prefix", scratch], check=True,
                       capture_output=True)
        for folder in folders:
            if name_of(folder) in LINKED_BY_THE_LIBRARY:
                for archive in (folder / "lib").glob("*.a"):
                    shutil.copy(archive, Path(scratch) / "lib")
        return {path.relative_to(scratch).as_posix(): (path.read_bytes(), 0o644)
                for path in Path(scratch).rglob("*") if path.is_file()}


def pack(tree, folders):
    """Writes both archives and returns their paths."""
    common = licences(folders)
    name = f"absenc-{VERSION}-windows-x64"
    program = {
        "absenc.exe": (command(tree), 0o755),
        "absenc.toml": ((ROOT / "packages/windows/absenc.toml").read_bytes(), 0o644),
        "README.md": ((ROOT / "docs/windows.md").read_bytes(), 0o644),
    }
    paths = []
    for name, files in ((name, program), (f"{name}-dev", library(tree, folders))):
        paths.append(tree / f"{name}.zip")
        write_zip(paths[-1], {f"{name}/{file}": content for file, content in {**files, **common}.items()})
    return paths


if __name__ == "__main__":
    for path in pack(Path(sys.argv[1]).resolve(), [Path(folder) for folder in sys.argv[2:]]):
        print(f"packed {path.relative_to(ROOT)}, {path.stat().st_size} bytes")
