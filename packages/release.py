#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""usage: release.py OUTPUT [--only amd64,arm64,armhf,windows] [--jobs N]

Builds everything that is published into the folder OUTPUT, which must not exist: Debian packages, static tarballs, wheels,
archives for Windows, the sources, packages for firmware, licences, an SPDX list and SHA256SUMS. Build trees are kept in build/tree-*.
The same commit gives the same bits: nothing in an artefact depends on folder, user or time.
"""
import argparse
import contextlib
import hashlib
import io
import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

from archives import write_tar, write_zip
from architectures import PUBLISHED, ROOT, TREES, build_tree, installed_version, run, say

VERSION = (ROOT / "VERSION").read_text().strip()
sys.path.insert(0, str(ROOT / "packages/arduino"))
sys.path.insert(0, str(ROOT / "packages/windows"))
sys.path.insert(0, str(ROOT / "python/backend"))

# Licences of what is inside an artefact, by the Debian package that it comes from.
LICENCES = {
    "libc6-dev": "LGPL-2.1-or-later",
    "libstdc++-12-dev": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "zlib1g-dev": "Zlib",
    "libminizip-dev": "Zlib",
    "libdeflate-dev": "MIT",
    "libncurses-dev": "X11-distribute-modifications-variant",
    "libgpiod-dev": "LGPL-2.1-or-later",
    "libfmt-dev": "MIT",
    "nlohmann-json3-dev": "MIT",
    "libtomlplusplus-dev": "MIT",
    "libhwy-dev": "Apache-2.0",
    "pybind11-dev": "BSD-3-Clause",
    "libjs-dygraphs": "MIT",
    "gcc-mingw-w64-base": "GPL-3.0-or-later WITH GCC-exception-3.1",
    "mingw-w64-x86-64-dev": "ZPL-2.1",
    "libz-mingw-w64-dev": "Zlib",
    # source packages, from which packages/windows/libraries.py builds
    "libdeflate": "MIT",
    "minizip": "Zlib",
    "sqlite3": "blessing",
    "libmicrohttpd": "LGPL-2.1-or-later",
    "mosquitto": "EPL-2.0 OR BSD-3-Clause",
    "hdf5": "BSD-3-Clause",
    "ncurses": "X11-distribute-modifications-variant",
}
# Packages whose headers contain code that is compiled into the command absenc on every architecture.
HEADERS = ["libfmt-dev", "nlohmann-json3-dev", "libtomlplusplus-dev", "libhwy-dev"]
STATIC = ["libstdc++-12-dev", "zlib1g-dev", "libminizip-dev", "libdeflate-dev", "libgpiod-dev"]


# Options of a build tree for packages; they switch off what a test may have switched on there.
PACKAGES = ["-DABSENC_PYTHON=ON", "-DABSENC_TESTS=OFF"]


@dataclass
class Release:
    output: Path
    jobs: int
    commit: str
    epoch: int
    # for each artefact, the Debian packages whose code it contains, each with its version
    inside: dict = field(default_factory=dict)
    sources_of: dict = field(default_factory=dict)  # for each source package in them, its version and its licence's file

    def publish(self, path, packages=(), version_of=installed_version):
        """Copies an artefact, which contains code of these Debian packages, to the output."""
        shutil.copyfile(path, self.output / path.name)
        sources = {name: version for name, (version, _) in self.sources_of.items()}
        self.inside[path.name] = [(name, sources.get(name) or version_of(name)) for name in packages]

    # --- building ---

    def build(self, tree, *targets):
        run("cmake", "--build", tree, "-j", self.jobs, "--target", *targets)

    def debian_packages(self, architecture):
        say(f"Debian packages for {architecture.name}")
        tree = build_tree(architecture, "packages", *PACKAGES, f"-DCPACK_DEBIAN_PACKAGE_ARCHITECTURE={architecture.name}")
        self.build(tree, "all")
        with tempfile.TemporaryDirectory() as scratch:
            path = os.environ["PATH"] if architecture.native else f"{ROOT}/packages/cross:{os.environ['PATH']}"
            run("cpack", "--config", tree / "CPackConfig.cmake", "-B", scratch, env={**os.environ, "PATH": path})
            for package in sorted(Path(scratch).glob("*.deb")):
                inside = HEADERS + {"absenc-serve": ["libjs-dygraphs"], "python3-absenc": ["pybind11-dev"]}.get(
                    package.name.split("_")[0], [])
                self.publish(package, [] if package.name.startswith("libabsenc-dev") else inside, architecture.version_of)

    def static_artefacts(self, architecture):
        say(f"the tarball and the wheel for {architecture.name}")
        tree = build_tree(architecture, "static", *PACKAGES, "-DABSENC_STATIC=ON", "-DABSENC_SERVE=OFF", "-DABSENC_CUSE=OFF",
                         "-DABSENC_FTDI=OFF", "-DABSENC_HDF5=OFF")  # Debian has no static libudev, which libusb needs
        self.build(tree, "absenc-command", "absenc-manual", "absenc-python")
        self.tarball(architecture, tree)
        if architecture.name != "armhf":  # wheels are hardly used on 32-bit ARM, so none is built
            self.wheel(architecture, tree)

    def strip(self, architecture, path):
        """Returns the program or module without its symbols."""
        with tempfile.TemporaryDirectory() as scratch:
            stripped = Path(scratch) / path.name
            tool = "strip" if architecture.native else f"{architecture.tuple}-strip"
            run(tool, "--strip-unneeded", "--remove-section=.comment", "-o", stripped, path)
            return stripped.read_bytes()

    def licences(self, packages):
        """Returns the files of licences for these packages and for absenc itself."""
        files = {"LICENSE": ((ROOT / "LICENSE").read_bytes(), 0o644)}
        for package in packages:
            _, text = self.sources_of.get(package, ("", Path(f"/usr/share/doc/{package}/copyright")))
            files[f"licences/{package}"] = (text.read_bytes(), 0o644)
        return files

    def windows(self):
        import libraries
        import pack
        say("absenc.exe")
        log = TREES / "windows-libraries.log"
        try:
            with log.open("w", encoding="utf-8") as lines, contextlib.redirect_stderr(lines):
                folders = libraries.folders()
        except subprocess.CalledProcessError as failed:
            sys.exit(f"release: {failed}\n{log.read_text(encoding='utf-8')[-6000:]}")
        tree = ROOT / "build/tree-windows"
        run("cmake", "--preset", "windows", "-S", ROOT, "-B", tree, "-D", "ABSENC_TESTS=OFF",
            env={**os.environ, "ABSENC_WINDOWS_LIBRARIES": ";".join(folders)})
        self.build(tree, "absenc-command")
        self.sources_of |= {name: (version, Path(folder) / "copyright")
                            for (name, version, _), folder in zip(libraries.LIBRARIES, folders)}
        for path in pack.pack(tree, [Path(folder) for folder in folders]):
            self.publish(path, [*pack.INSIDE, *self.sources_of])

    def tarball(self, architecture, tree):
        name = f"absenc-{VERSION}-linux-{architecture.processor.replace('armv7l', 'armv7')}"
        inside = HEADERS + STATIC + ["libc6-dev", "libncurses-dev"]
        files = {
            "bin/absenc": (self.strip(architecture, tree / "bin/absenc"), 0o755),
            "share/man/man1/absenc.1": ((tree / "manual/absenc.1").read_bytes(), 0o644),
            "share/bash-completion/completions/absenc": ((tree / "manual/absenc").read_bytes(), 0o644),
            "README": (TARBALL_README.format(version=VERSION, commit=self.commit).encode(), 0o644),
            **self.licences(inside),
        }
        for page in sorted((tree / "manual").glob("*.7")):
            files[f"share/man/man7/{page.name}"] = (page.read_bytes(), 0o644)
        path = TREES / f"{name}.tar.gz"
        write_tar(path, {f"{name}/{file}": content for file, content in files.items()}, self.epoch)
        self.publish(path, inside, architecture.version_of)

    def wheel(self, architecture, tree):
        import absenc_build
        version = self.glibc_version(tree / "python/absenc", architecture)
        tag = f"cp311-cp311-manylinux_2_{version}_{architecture.processor}"
        package = {file.name: file.read_bytes() for file in sorted((tree / "python/absenc").iterdir()) if file.is_file()}
        [module] = [file for file in (tree / "python/absenc").iterdir() if file.suffix == ".so"]
        package[module.name] = self.strip(architecture, module)
        inside = HEADERS + STATIC + ["pybind11-dev"]
        licences = {f"licenses/{file}": content for file, (content, _) in self.licences(inside).items()}
        path = TREES / f"absenc-{VERSION}-{tag}.whl"
        absenc_build.write_wheel(path, package, tag, licences)
        self.publish(path, inside, architecture.version_of)

    def glibc_version(self, folder, architecture):
        """Returns the least N so that glibc 2.N can load the module."""
        [module] = folder.glob("*.so")
        tool = "readelf" if architecture.native else f"{architecture.tuple}-readelf"
        return max(int(minor) for minor in re.findall(r"GLIBC_2\.(\d+)", run(tool, "--version-info", module)))

    # --- sources ---

    def files_of_commit(self):
        """Returns {path: (bytes, mode)} of all files of the commit."""
        archive = subprocess.run(["git", "archive", "--format=tar", "HEAD"], cwd=ROOT, check=True, capture_output=True).stdout
        with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
            return {info.name: (tar.extractfile(info).read(), 0o755 if info.mode & 0o100 else 0o644)
                    for info in tar if info.isfile()}

    def sources(self):
        import absenc_build
        say("the sources, and packages for firmware")
        files = self.files_of_commit()
        files["COMMIT"] = (f"{self.commit}\n".encode(), 0o644)
        sdist = {f"absenc-{VERSION}/{name}": content for name, content in files.items()}
        sdist[f"absenc-{VERSION}/PKG-INFO"] = (absenc_build.metadata().encode(), 0o644)
        path = TREES / f"absenc-{VERSION}.tar.gz"
        write_tar(path, sdist, self.epoch)
        self.publish(path)
        self.firmware(files)

    def firmware(self, files):
        layers = re.compile(r"absenc/(core|link|protocol|host)/")
        tests = re.compile(r"(_test|_fuzz|_bench)\.[ch]pp$|/test_[^/]*$|/testing\.hpp$")
        sources = {name: content for name, content in files.items() if layers.match(name) and not tests.search(name)}
        common = {name: files[name] for name in ("LICENSE", "README.md")}

        path = TREES / f"absenc-{VERSION}-platformio.tar.gz"  # users install it by: pio pkg install --library FILE
        write_tar(path, {**sources, **common, "library.json": files["library.json"]}, self.epoch)
        self.publish(path)

        own = {name: files[name] for name in ("CMakeLists.txt", "cmake/sources.cmake", "packages/esp-idf.cmake", "idf_component.yml")}
        path = TREES / f"absenc-{VERSION}-esp-idf.tar.gz"  # users unpack it into components/ of their project
        write_tar(path, {f"absenc/{name}": content for name, content in {**sources, **common, **own}.items()}, self.epoch)
        self.publish(path)

        own = {name: content for name, content in files.items() if name.startswith(("zephyr/", "packages/zephyr/"))}
        own["cmake/sources.cmake"] = files["cmake/sources.cmake"]
        path = TREES / f"absenc-{VERSION}-zephyr.tar.gz"  # users unpack it and name its folder in ZEPHYR_EXTRA_MODULES
        write_tar(path, {f"absenc/{name}": content for name, content in {**sources, **common, **own}.items()}, self.epoch)
        self.publish(path)

        import export
        with tempfile.TemporaryDirectory() as scratch:
            export.export(scratch)
            arduino = {str(file.relative_to(scratch)): (file.read_bytes(), 0o644)
                       for file in Path(scratch).rglob("*") if file.is_file()}
        path = TREES / f"absenc-{VERSION}-arduino.zip"  # users install it by: arduino-cli lib install --zip-path FILE
        write_zip(path, arduino)
        self.publish(path)

    # --- lists ---

    def lists(self):
        (self.output / "absenc.spdx.json").write_text(json.dumps(self.spdx(), indent=1, sort_keys=True) + "\n")
        used = sorted({name for packages in self.inside.values() for name, _ in packages})
        path = TREES / f"absenc-{VERSION}-licences.tar.gz"
        write_tar(path, self.licences(used), self.epoch)
        shutil.copyfile(path, self.output / path.name)
        sums = "".join(f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in sorted(self.output.iterdir()))
        (self.output / "SHA256SUMS").write_text(sums)

    def spdx(self):
        """Returns the list of all artefacts and of the code of others in them, as SPDX 2.3."""
        packages, relationships = [], []
        for name, version in sorted({package for inside in self.inside.values() for package in inside}):
            packages.append({"SPDXID": identifier(f"{name}-{version}"), "name": name, "versionInfo": version,
                             "supplier": "Organization: Debian",
                             "licenseConcluded": LICENCES[name], "licenseDeclared": LICENCES[name],
                             "copyrightText": "NOASSERTION", "downloadLocation": f"https://packages.debian.org/bookworm/{name}"})
        for artefact, inside in sorted(self.inside.items()):
            digest = hashlib.sha256((self.output / artefact).read_bytes()).hexdigest()
            packages.append({"SPDXID": identifier(artefact), "name": artefact, "versionInfo": VERSION,
                             "licenseConcluded": "Apache-2.0", "licenseDeclared": "Apache-2.0", "copyrightText": "NOASSERTION",
                             "downloadLocation": "NOASSERTION", "packageFileName": artefact,
                             "checksums": [{"algorithm": "SHA256", "checksumValue": digest}]})
            relationships.append({"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES",
                                  "relatedSpdxElement": identifier(artefact)})
            relationships += [{"spdxElementId": identifier(artefact), "relationshipType": "CONTAINS",
                               "relatedSpdxElement": identifier(f"{name}-{version}")} for name, version in inside]
        created = subprocess.run(["date", "-u", "-d", f"@{self.epoch}", "+%Y-%m-%dT%H:%M:%SZ"], check=True,
                                 capture_output=True, text=True).stdout.strip()
        return {"spdxVersion": "SPDX-2.3", "SPDXID": "SPDXRef-DOCUMENT", "dataLicense": "CC0-1.0", "name": f"absenc {VERSION}",
                "documentNamespace": f"urn:absenc:{VERSION}:{self.commit}", "packages": packages, "relationships": relationships,
                "creationInfo": {"created": created, "creators": ["Tool: absenc packages/release.py"]}}


TARBALL_README = """\
absenc {version} (commit {commit})

Nothing needs to be installed: run bin/absenc. To have its man pages and completion,

    export PATH="$PWD/bin:$PATH" MANPATH="$PWD/share/man:"
    source share/bash-completion/completions/absenc

This program is linked statically and runs on any Linux since Debian 11. It has every verb but these, for which the
Debian packages are: serve (absenc-serve), record to HDF5 (absenc-hdf5) and emulate --spidev (absenc). Ports of FTDI
chips (ftdi:) are in the package absenc.
`absenc doctor`, `read`, `scan`, `identify`, `conform`, `decode`, `emulate` and `record` to CSV or JSON lines work.
LICENSE is that of absenc, licences/ has those of the libraries inside. The libraries under the LGPL (glibc, libgpiod)
can be replaced by building absenc from its sources, which are published beside this archive.
"""


def identifier(name):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", name)


def main():
    parser = argparse.ArgumentParser(usage=__doc__)
    parser.add_argument("output", type=Path)
    parser.add_argument("--only", default=",".join([*PUBLISHED, "windows"]))
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    chosen = parser.parse_args()
    changed = run("git", "-C", ROOT, "status", "--porcelain")
    if changed:
        sys.exit(f"release: the files differ from the commit; commit them first:\n{changed}")
    epoch = int(run("git", "-C", ROOT, "log", "-1", "--format=%ct"))
    for name in [name for name in os.environ if name.startswith(("LC_", "LANG"))]:
        del os.environ[name]
    os.environ.update(SOURCE_DATE_EPOCH=str(epoch), TZ="UTC", PYTHONDONTWRITEBYTECODE="1")
    os.umask(0o022)
    output = chosen.output.resolve()
    output.mkdir(parents=True)
    TREES.mkdir(parents=True, exist_ok=True)
    release = Release(output, chosen.jobs, run("git", "-C", ROOT, "rev-parse", "--short=12", "HEAD").strip(), epoch)
    release.sources()
    for name in chosen.only.split(","):
        if name == "windows":
            release.windows()
            continue
        release.debian_packages(PUBLISHED[name])
        release.static_artefacts(PUBLISHED[name])
    release.lists()
    say(f"{len(release.inside)} artefacts are in {output}")


if __name__ == "__main__":
    main()
