# SPDX-License-Identifier: Apache-2.0
"""Build backend of the Python package (PEP 517), for which CMake builds the module.

    pip install --no-build-isolation --no-index --no-deps .
    pip install ... --config-settings build-dir=build/release .     # uses a configured build tree
"""
import base64
import hashlib
import re
import subprocess
import sys
import sysconfig
import tarfile
import tempfile
import tomllib
import zipfile
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2]
PROJECT = tomllib.loads((SOURCE / "pyproject.toml").read_text())["project"]
VERSION = re.search(r"^project\(absenc VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
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


def build(tree, configured):
    """Builds the package in `tree` and returns its folder."""
    if not configured:
        subprocess.run(
            ["cmake", "-S", SOURCE, "-B", tree, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DABSENC_PYTHON=ON",
             "-DABSENC_CLIENT=ON", "-DABSENC_COMMAND=OFF", "-DABSENC_INSTALL=OFF",
             f"-DPython3_EXECUTABLE={sys.executable}"],
            check=True,
        )
    subprocess.run(["cmake", "--build", tree, "--target", "absenc-python"], check=True)
    return Path(tree) / "python" / "absenc"


def write_wheel(path, package):
    info = f"absenc-{VERSION}.dist-info"
    contents = {f"absenc/{file.name}": file.read_bytes() for file in sorted(package.iterdir()) if file.is_file()}
    contents[f"{info}/METADATA"] = metadata().encode()
    contents[f"{info}/WHEEL"] = f"Wheel-Version: 1.0\nGenerator: absenc_build\nRoot-Is-Purelib: false\nTag: {TAG}\n".encode()
    contents[f"{info}/entry_points.txt"] = entry_points().encode()
    contents[f"{info}/LICENSE"] = (SOURCE / "LICENSE").read_bytes()
    record = ""
    for name, data in contents.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(data)}\n"
    contents[f"{info}/RECORD"] = (record + f"{info}/RECORD,,\n").encode()
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as wheel:
        for name, data in contents.items():
            wheel.writestr(name, data)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    tree = (config_settings or {}).get("build-dir")
    name = f"absenc-{VERSION}-{TAG}.whl"
    with tempfile.TemporaryDirectory() as scratch:
        package = build(tree or scratch, configured=tree is not None)
        write_wheel(Path(wheel_directory) / name, package)
    return name


def build_sdist(sdist_directory, config_settings=None):
    name = f"absenc-{VERSION}"
    files = subprocess.run(["git", "ls-files", "-z"], cwd=SOURCE, check=True, capture_output=True).stdout
    with tarfile.open(Path(sdist_directory) / f"{name}.tar.gz", "w:gz") as archive:
        for file in filter(None, files.decode().split("\0")):
            archive.add(SOURCE / file, f"{name}/{file}")
        with tempfile.NamedTemporaryFile("w") as file_info:
            file_info.write(metadata())
            file_info.flush()
            archive.add(file_info.name, f"{name}/PKG-INFO")
    return f"{name}.tar.gz"
