#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs what is built for arm64 and armhf, and the layers from core to capture for a big-endian machine, in emulators."""
import os
import re
import subprocess
import sys
import unittest

from root_support import ISOLATED, PACKAGES, SOURCE, VERSION, RootCase, WholeInstallation, artefact, dependencies

sys.path.insert(0, str(SOURCE / "packages"))
from architectures import BIG_ENDIAN, PUBLISHED, build_tree

# Tests that are left out in an emulator, by their reasons.
LEFT_OUT = {
    "qemu has neither the calls for SPI controllers nor those for rates, which tests/emulated/termios2.cpp replaces within "
    "one process":
        r"os|example\.virtual_encoder|(clocked|e201|raa38|raa38_modbus)\.py",
    "the emulated program starts other programs, or a script of this computer loads it":
        r"(bug_report|first_minutes|keys|mqtt_.*|readme|serve_.*)\.py",
    "they expect times that an emulated program, which starts in half a second, does not keep":
        r"(campaign|doctor|emulate|encolink_command|monitor|nikon|realtime|record|three_states)\.py",
    "they read the sources, as they do on this computer":
        r"(compiled_together|ftdi_wave|include_direction|stability|tables|type_names|unit_declaration|usage|word)\.py",
}


def run_tests(tree, *options):
    """Runs the tests of a build tree and returns their number."""
    environment = {**os.environ, "ABSENC_CASES_PERCENT": "10", "RC_PARAMS": "max_success=20"}
    termios2 = tree / "libemulated_termios2.so"
    if termios2.exists():  # calls that qemu has not, for terminals that a program of the tests opens itself
        environment["QEMU_SET_ENV"] = f"LD_PRELOAD={termios2}"
    done = subprocess.run(["ctest", "--test-dir", tree, "-j", str(os.cpu_count()), "--output-on-failure", "-LE", "long", *options],
                          capture_output=True, text=True, env=environment, check=False)
    (tree / "emulated.log").write_text(done.stdout)
    closing = re.search(r"\d+% tests passed, (\d+) tests? failed out of (\d+)", done.stdout)
    if closing is None or done.returncode != 0:
        raise AssertionError(done.stdout[-6000:] + done.stderr[-1000:])
    print(f"{tree.name}: {closing[0]}")
    return int(closing[2])


def built(architecture, *options):
    """Returns a build tree of this architecture with its tests. These convert numbers of 64 bits to sizes, about which a
    compiler for 32 bits warns; the library itself is built without warnings for the packages."""
    tree = build_tree(architecture, "packages", "-DABSENC_TESTS=ON", *options, "-DABSENC_WERROR=OFF")
    subprocess.run(["cmake", "--build", tree, "-j", str(os.cpu_count())], check=True, capture_output=True)
    return tree


class Emulated:
    """An architecture whose packages are unpacked and run in an emulator, without a network."""

    # /srv and /tmp are those of the test
    isolated = [*ISOLATED[:-2], 'ip link set lo up; mount -t proc proc /proc; mount --bind "$1/srv" /srv; '
                                'mount -t tmpfs none /tmp; shift; exec "$@"', "sh"]
    programs = f"/srv/bin:{RootCase.programs}"
    architecture = None

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        packages = cls.root / "srv/packages"
        for package in ("absenc", "absenc-serve", "absenc-hdf5", "python3-absenc"):
            subprocess.run(["dpkg-deb", "-x", artefact(f"{package}_*_{cls.architecture.name}.deb"), packages], check=True)
        emulator = " ".join(cls.architecture.emulated())
        sysroot = cls.architecture.sysroot()
        libraries = sysroot / "usr/lib" / cls.architecture.tuple  # NumPy's are in folders of their own in it
        (cls.root / "srv/bin").mkdir()
        # the emulator cannot start programs, so the script starts what `absenc serve` would start
        cls.write_program("absenc", f"""program=bin/absenc
            [ "$1" != serve ] || program=lib/absenc/absenc-serve
            exec {emulator} /srv/packages/usr/$program "$@\"""")
        cls.write_program("python3", f"""export PYTHONPATH=/srv/packages/usr/lib/python3/dist-packages
            exec {emulator} -E LD_LIBRARY_PATH={libraries}/blas:{libraries}/lapack {sysroot}/usr/bin/python3.11 "$@\"""")

    @classmethod
    def write_program(cls, name, script):
        path = cls.root / "srv/bin" / name
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)

    def test_tarball(self):
        name = f"absenc-{VERSION}-linux-{self.architecture.processor.replace('armv7l', 'armv7')}"
        subprocess.run(["tar", "-xzf", artefact(f"{name}.tar.gz"), "-C", self.root / "srv"], check=True)
        self.write_program("from-tarball", f'exec {self.architecture.emulator} /srv/{name}/bin/absenc "$@"')
        self.try_the_command("from-tarball")

    def test_packages_need_the_same_as_on_amd64(self):
        for package in PACKAGES:
            with self.subTest(package):
                self.assertEqual(dependencies(package, self.architecture.name), dependencies(package))

    def test_units_and_command(self):
        tree = built(self.architecture, "-DABSENC_PYTHON=ON")
        self.assertGreater(run_tests(tree, "-E", rf"^({'|'.join(LEFT_OUT.values())})$"), 60)


class Arm64(Emulated, WholeInstallation, RootCase):
    architecture = PUBLISHED["arm64"]


class Armhf(Emulated, WholeInstallation, RootCase):
    architecture = PUBLISHED["armhf"]


class BigEndian(unittest.TestCase):
    def test_layers_from_core_to_capture(self):
        tree = built(BIG_ENDIAN, "-DABSENC_COMMAND=OFF", "-DABSENC_CLIENT=OFF", "-DABSENC_INSTALL=OFF")
        self.assertGreater(run_tests(tree), 20)


if __name__ == "__main__":
    unittest.main()
