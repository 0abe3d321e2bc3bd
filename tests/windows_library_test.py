#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compiles the library with one protocol for Windows, and reads an encoder through a COM port under wine. All of
absenc.exe is in windows_test.py, which ./dev windows --test runs."""
import os
import unittest
from pathlib import Path

from command_support import ABSENC, Emulator, EncoderCase, run_tool
from wine_support import WINE, Prefix

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
BUILD = Path(ABSENC).parent.parent / "windows-library"
SETTINGS = {
    "CMAKE_BUILD_TYPE": "Debug", "CMAKE_CXX_FLAGS_DEBUG": "-O0",  # compiles in the shortest time
    "CMAKE_TOOLCHAIN_FILE": SOURCE / "cmake/x86_64-w64-mingw32.cmake",
    "ABSENC_UNITS": "tformat", "ABSENC_CLIENT": "ON", "ABSENC_UNITY": "ON", "ABSENC_WERROR": "ON",
    **{f"ABSENC_{part}": "OFF" for part in ("FTDI", "GPIO", "HDF5", "ZIP")},
}
PROJECT = f"""
cmake_minimum_required(VERSION 3.25)
project(outside LANGUAGES CXX)
add_subdirectory({SOURCE} absenc)
add_executable(outside {SOURCE}/examples/read_by_name.cpp)
target_link_libraries(outside PRIVATE absenc::client)
target_link_options(outside PRIVATE -static)
"""


class WindowsLibrary(EncoderCase):
    def test_program_reads_through_a_com_port(self):
        BUILD.mkdir(parents=True, exist_ok=True)
        (BUILD / "CMakeLists.txt").write_text(PROJECT, encoding="utf-8")
        run_tool("cmake", "-G", "Ninja", "-S", BUILD, "-B", BUILD / "build",
                 *(f"-D{name}={value}" for name, value in SETTINGS.items()))
        run_tool("cmake", "--build", BUILD / "build", "-j", "2", timeout=800)
        with Prefix() as prefix, Emulator(self.directory, "--singleturn", "65536") as emulator:
            prefix.link_port(5, emulator.path)
            output = run_tool(WINE, BUILD / "build/outside.exe", "tformat:COM5?latency=300", env=prefix.environment)
        self.assertRegex(output, r"^(180\.0000 degrees\n)+0\.0 rpm, within \d")


if __name__ == "__main__":
    unittest.main()
