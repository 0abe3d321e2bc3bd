# SPDX-License-Identifier: Apache-2.0
"""Machines for which absenc is built and tried, with their cross-compilers, headers, libraries and emulators."""
import gzip
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TREES = ROOT / "build/release-trees"
MIRROR = "http://deb.debian.org/debian"  # Debian's archive of point releases
# The packages whose headers and libraries the cross-compilers need, and whose programs and libraries the emulators run.
SYSROOT_PACKAGES = """libc6-dev libstdc++-12-dev libfmt-dev nlohmann-json3-dev libtomlplusplus-dev libncurses-dev libfuse3-dev
    libftdi1-dev libgpiod-dev libhwy-dev libminizip-dev zlib1g-dev libdeflate-dev libhdf5-dev libmicrohttpd-dev libsqlite3-dev
    libmosquitto-dev libpython3.11-dev pybind11-dev libjs-dygraphs python3-numpy
    libgtest-dev libgmock-dev librapidcheck-dev libzip-dev""".split()


@dataclass
class Architecture:
    """A machine for which programs are built, by Debian's name."""
    name: str
    tuple: str  # prefix of the names of the compiler and its tools
    processor: str
    emulator: str

    @property
    def native(self):
        return self.processor == os.uname().machine

    def sysroot(self):
        """Returns a folder with Debian 12's headers and libraries for this architecture; makes it once."""
        root = TREES / f"sysroot-{self.name}"
        made_of = root / "packages"
        wanted = "\n".join(SYSROOT_PACKAGES) + "\n"
        if not made_of.is_file() or made_of.read_text() != wanted:
            say(f"Debian's headers and libraries for {self.name}")
            shutil.rmtree(root, ignore_errors=True)
            TREES.mkdir(parents=True, exist_ok=True)
            extract = ["mmdebstrap", "--variant=extract", f"--architectures={self.name}",
                       f"--include={','.join(SYSROOT_PACKAGES)}", "bookworm", root]
            failed = attempt(*extract)
            if failed:  # a mirror may lack the lists of Debian's security updates for some architectures
                reason = next((line for line in failed.splitlines() if line.startswith("E: ")), failed[-300:])
                say(f"mmdebstrap failed: {reason}")
                say(f"the packages for {self.name} are those of Debian's last point release, without later security updates")
                shutil.rmtree(root, ignore_errors=True)
                run(*extract, MIRROR)
            relative_links(root)
            shutil.rmtree(root / "dev")  # the emulators would open its devices in place of those of this computer
            made_of.write_text(wanted)
        return root

    def version_of(self, package):
        """Returns the version of the Debian package that programs for this architecture are built with."""
        if self.native:
            return installed_version(package)
        folder = self.sysroot() / "usr/share/doc" / package
        changes = folder / f"changelog.Debian.{self.name}.gz"  # of a package that was rebuilt for this architecture
        with gzip.open(changes if changes.exists() else folder / "changelog.Debian.gz", "rt", encoding="utf-8") as text:
            return re.search(r"\((.+?)\)", text.readline())[1]

    def emulated(self):
        """Returns the words that start a program of this architecture on this computer."""
        return [] if self.native else [self.emulator, "-L", str(self.sysroot())]

    def options(self):
        """Returns the options of CMake with which its compiler is used."""
        if self.native:
            return []
        root = self.sysroot()
        # h5cc of this computer would name its own headers and libraries
        return [f"-DCMAKE_TOOLCHAIN_FILE={ROOT}/cmake/cross.cmake", f"-DABSENC_CROSS_TUPLE={self.tuple}",
                f"-DABSENC_CROSS_PROCESSOR={self.processor}", f"-DABSENC_CROSS_ROOT={root}",
                f"-DABSENC_CROSS_EMULATOR={self.emulator}",
                f"-DCMAKE_INSTALL_LIBDIR=lib/{self.tuple}",  # as CMake itself chooses it for a Debian package of this computer
                f"-DPython3_INCLUDE_DIR={root}/usr/include/python3.11",
                "-DHDF5_C_COMPILER_EXECUTABLE=false",
                f"-DHDF5_C_LIBRARY_hdf5={root}/usr/lib/{self.tuple}/libhdf5_serial.so",
                f"-DHDF5_C_INCLUDE_DIR={root}/usr/include/hdf5/serial"]


PUBLISHED = {one.name: one for one in (
    Architecture("amd64", "x86_64-linux-gnu", "x86_64", "qemu-x86_64-static"),
    Architecture("arm64", "aarch64-linux-gnu", "aarch64", "qemu-aarch64-static"),
    Architecture("armhf", "arm-linux-gnueabihf", "armv7l", "qemu-arm-static"),
)}
# A machine whose numbers begin with their most significant byte. Nothing is published for it.
BIG_ENDIAN = Architecture("s390x", "s390x-linux-gnu", "s390x", "qemu-s390x-static")


def completed(command, settings):
    return subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, check=False, **settings)


def attempt(*command, **settings):
    """Runs a command and returns its output if it fails, otherwise None."""
    done = completed(command, settings)
    return done.stdout if done.returncode != 0 else None


def run(*command, **settings):
    """Runs a command and returns its output; ends this program with that output if it fails."""
    done = completed(command, settings)
    if done.returncode != 0:
        sys.exit(f"{Path(sys.argv[0]).name}: {' '.join(map(str, command))} failed:\n{done.stdout[-6000:]}")
    return done.stdout


def installed_version(package):
    """Returns the version of a Debian package of this computer."""
    return run("dpkg-query", "-W", "-f=${Version}", package)


def say(text):
    print(f"release: {text}", flush=True)


def build_tree(architecture, kind, *options):
    """Configures a build tree for this architecture and returns its path."""
    # this build tree is as deep in the folders as all others, so that a compiler cache sees the same relative paths
    path = ROOT / f"build/tree-{architecture.name}-{kind}"
    run("cmake", "-S", ROOT, "-B", path, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
        "-DCMAKE_CXX_FLAGS_RELEASE=-O2 -DNDEBUG", "-DCMAKE_INSTALL_PREFIX=/usr", "-DABSENC_WERROR=ON",
        "-DPython3_EXECUTABLE=/usr/bin/python3", *options, *architecture.options())
    return path


def relative_links(root):
    """Makes absolute links in a root relative, so that a cross-compiler does not follow them into this computer."""
    for path in root.rglob("*"):
        if path.is_symlink() and os.readlink(path).startswith("/"):
            target = root / os.readlink(path)[1:]
            path.unlink()
            path.symlink_to(os.path.relpath(target, path.parent))
