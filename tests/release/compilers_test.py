#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compiles programs with an installed tree by each compiler that Debian 12 has: find_package, pkg-config, add_subdirectory."""
import os
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ.get("ABSENC_SOURCE_DIR", Path(__file__).resolve().parents[2]))
BUILD = Path(os.environ["ABSENC"]).parent.parent
BY_NAME = SOURCE / "examples/read_by_name.cpp"
COMPILERS = ("g++-11", "g++-12", "clang++-14", "clang++-15", "clang++-16", "clang++-19")


def run(*command, **settings):
    done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=600, **settings)
    if done.returncode != 0:
        raise AssertionError(f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}")
    return done.stdout


class Compilers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="absenc-compilers-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.root = cls.folder / "installed"
        run("cmake", "--install", BUILD, "--prefix", cls.root)

    def each(self, work):
        """Runs a function for each compiler as a subtest."""
        for compiler in COMPILERS:
            with self.subTest(compiler):
                self.assertIsNotNone(shutil.which(compiler), f"{compiler} is not installed")
                work(compiler)

    def project(self, compiler, lines, *options):
        folder = self.folder / f"{self._testMethodName}-{compiler}"
        folder.mkdir()
        (folder / "CMakeLists.txt").write_text("cmake_minimum_required(VERSION 3.25)\nproject(outside LANGUAGES CXX)\n" + lines)
        run("cmake", "-G", "Ninja", "-S", folder, "-B", folder / "build", f"-DCMAKE_CXX_COMPILER={compiler}", *options)
        run("cmake", "--build", folder / "build")
        return folder / "build/program"

    def assert_reads(self, program):
        self.assertRegex(run(program, "sim:tformat"), r"^(0\.0000 degrees\n)+0\.0 rpm")

    def test_find_package(self):
        self.each(lambda compiler: self.assert_reads(self.project(
            compiler, f"find_package(absenc REQUIRED)\nadd_executable(program {BY_NAME})\n"
            "target_link_libraries(program PRIVATE absenc::client)\n", f"-DCMAKE_PREFIX_PATH={self.root}")))

    def test_pkg_config(self):
        [pc] = self.root.rglob("absenc.pc")

        def build(compiler):
            flags = run("pkg-config", "--cflags", "--libs", "absenc-client", env={**os.environ, "PKG_CONFIG_PATH": str(pc.parent)})
            program = self.folder / f"by-pkg-config-{compiler}"
            run(compiler, "-std=c++20", BY_NAME, *flags.split(), "-o", program)
            self.assert_reads(program)

        self.each(build)

    def test_add_subdirectory(self):
        def build(compiler):
            # g++ 11 cannot allocate the coroutines of the units, so it can compile programs that use the library, but
            # not the library itself
            if compiler == "g++-11":
                with self.assertRaisesRegex(AssertionError, r"absenc\s+needs\s+a\s+compiler\s+for\s+C\+\+20"):
                    self.project(compiler, f"add_subdirectory({SOURCE} absenc)\n")
                return
            self.project(compiler, f"add_subdirectory({SOURCE} absenc)\n"
                         f"add_executable(program {SOURCE}/packages/fetchcontent/main.cpp)\n"
                         "target_link_libraries(program PRIVATE absenc::tformat)\n")

        self.each(build)


if __name__ == "__main__":
    unittest.main()
