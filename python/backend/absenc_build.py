# SPDX-License-Identifier: Apache-2.0
"""Build backend of the Python package (PEP 517), for which CMake builds the module.

    pip install --no-build-isolation --no-index --no-deps .
    pip install ... --config-settings build-dir=build/release .     # uses a configured build tree
"""
import base64
import hashlib
import io
import re
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import time
import tomllib
import zipfile
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((SOURCE / "pyproject.toml").read_text())["project"]
VERSION = (SOURCE / "VERSION").read_text().strip()
TAG = "cp{0}{1}-cp{0}{1}-{2}".format(*sys.version_info[:2], re.sub(r"[-.]", "_", sysconfig.get_platform()))


def metadata():
    lines = [
        "Metadata-Version: 2.1",
        f"Name: {PROJECT['name']}",
        f"Version: {VERSION}",
        f"Summary: {PROJECT['description']}",
        f"License: {PROJECT['license']['text']}",
        f"Requires-Python: {PROJECT['requires-python']}",
        *(f"Requires-Dist: {one}" for one in PROJECT["dependencies"]),
        "Description-Content-Type: text/markdown",
        "",
        (SOURCE / PROJECT["readme"]).read_text(),
    ]
    return "\n".join(lines)


def entry_points():
    text = ""
    for group, entries in PROJECT["entry-points"].items():
        text += f"[{group}]\n" + "".join(f"{name} = {value}\n" for name, value in entries.items())
    return text


def show_build(tree):
    """Builds the module, and shows how far it is and how long it takes on the terminal, which pip otherwise keeps silent."""
    try:
        terminal = open("/dev/tty", "w")
    except OSError:
        terminal = sys.stderr
    start = time.monotonic()
    print("absenc: compiling the module, some minutes on two cores", file=terminal, flush=True)
    last = 0
    with subprocess.Popen(["cmake", "--build", tree, "--target", "absenc-python"], stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True) as process:
        for line in process.stdout:
            step = re.match(r"\[(\d+)/(\d+)\]", line)
            if step is None:
                print(line, end="")
                continue
            done, steps = map(int, step.groups())
            passed = time.monotonic() - start
            if done == steps or passed - last >= 5:
                last = passed
                left = passed / done * (steps - done)
                print(f"absenc: step {done} of {steps} after {passed:.0f} s, about {left:.0f} s are left", file=terminal, flush=True)
    if process.returncode != 0:
        sys.exit("absenc: the module cannot be compiled; the reason is above")


def build(tree, configured):
    """Builds the package in `tree` and returns its folder."""
    if not configured:
        subprocess.run(
            ["cmake", "-S", SOURCE, "-B", tree, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DABSENC_PYTHON=ON",
             "-DABSENC_CLIENT=ON", "-DABSENC_UNITY=ON", "-DABSENC_COMMAND=OFF", "-DABSENC_INSTALL=OFF",
             f"-DPython3_EXECUTABLE={sys.executable}"],
            check=True,
        )
    show_build(tree)
    return Path(tree) / "python" / "absenc"


def write_wheel(path, package, tag, licences):
    """Writes a wheel of the files {name: bytes} in `package`, and of more files with licences."""
    info = f"absenc-{VERSION}.dist-info"
    contents = {f"absenc/{name}": data for name, data in package.items()}
    contents[f"{info}/METADATA"] = metadata().encode()
    contents[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: absenc_build\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    contents[f"{info}/entry_points.txt"] = entry_points().encode()
    contents.update({f"{info}/{name}": data for name, data in licences.items()})
    record = ""
    for name, data in contents.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(data)}\n"
    contents[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
    with zipfile.ZipFile(path, "w") as wheel:
        for name, data in contents.items():
            entry = zipfile.ZipInfo(name)  # ZipInfo dates it 1980-01-01, so that the same files give the same bits
            entry.external_attr = 0o100644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            wheel.writestr(entry, data)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    tree = (config_settings or {}).get("build-dir")
    name = f"absenc-{VERSION}-{TAG}.whl"
    with tempfile.TemporaryDirectory() as scratch:
        package = build(tree or scratch, configured=tree is not None)
        files = {file.name: file.read_bytes() for file in sorted(package.iterdir()) if file.is_file()}
        write_wheel(Path(wheel_directory) / name, files, TAG, {"LICENSE": (SOURCE / "LICENSE").read_bytes()})
    return name


def build_sdist(sdist_directory, config_settings=None):
    name = f"absenc-{VERSION}"
    commit = subprocess.run(["git", "rev-parse", "--short=12", "HEAD"], cwd=SOURCE, check=True, capture_output=True).stdout
    files = subprocess.run(["git", "ls-files", "-z"], cwd=SOURCE, check=True, capture_output=True).stdout
    with tarfile.open(Path(sdist_directory) / f"{name}.tar.gz", "w:gz") as archive:
        for file in filter(None, files.decode().split("\0")):
            archive.add(SOURCE / file, f"{name}/{file}")
        for file, content in (("PKG-INFO", metadata().encode()), ("COMMIT", commit)):
            info = tarfile.TarInfo(f"{name}/{file}")
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
    return f"{name}.tar.gz"
