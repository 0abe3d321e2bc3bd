#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests the library as a package of firmware build systems."""
import glob
import json
import os
import re
import shlex
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

import kconfiglib
import yaml

ROOT = Path(__file__).resolve().parent.parent
LAYERS = ("core", "link", "protocol", "host")
VERSION = (ROOT / "VERSION").read_text().strip()


def run(*command, **settings):
    done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, text=True, timeout=900, **settings)
    if done.returncode != 0:
        raise AssertionError(f"{shlex.join(map(str, command))}\n{done.stdout}")
    return done.stdout


def sources():
    """Returns the sources that every package must build, as paths relative to the repository."""
    found = [path for layer in LAYERS for path in (ROOT / "absenc" / layer).rglob("*.cpp")]
    return {str(path.relative_to(ROOT)) for path in found if not re.search(r"_(test|fuzz|bench)\.cpp$", path.name)}


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="absenc-packages-"))
        self.addCleanup(shutil.rmtree, self.folder)

    def configured(self, project):
        """Configures a CMake project whose CMakeLists.txt is `project`, and returns CMake's output."""
        (self.folder / "CMakeLists.txt").write_text(project)
        return run("cmake", "-S", self.folder, "-B", self.folder / "build")

    def assert_same_sources(self, paths):
        self.assertEqual({str(Path(path).relative_to(ROOT)) for path in paths}, sources())


class PlatformIO(Case):
    # Keys of library.json, from https://docs.platformio.org/en/latest/manifests/library-json/
    KEYS = {"$schema", "name", "version", "description", "keywords", "license", "frameworks", "platforms", "headers",
            "export", "build"}
    BUILD_KEYS = {"includeDir", "srcDir", "srcFilter", "flags", "unflags", "libArchive"}

    def setUp(self):
        super().setUp()
        self.library = json.loads((ROOT / "library.json").read_text())

    def test_manifest_has_documented_keys(self):
        self.assertEqual(self.library.keys(), self.KEYS)
        self.assertEqual(self.library["build"].keys(), self.BUILD_KEYS)
        self.assertEqual(self.library["version"], VERSION)
        for keyword in self.library["keywords"]:
            self.assertRegex(keyword, r"^[a-z\d\-+. ]{1,50}$")
        for path in self.library["headers"] + self.library["export"]["include"]:
            self.assertTrue((ROOT / path).exists(), path)

    def test_builds_all_sources(self):
        chosen = set()
        for sign, pattern in (re.match(r"([+-])<(.+)>$", one).groups() for one in self.library["build"]["srcFilter"]):
            # A srcFilter that names a folder selects all source files below the folder.
            matched = set()
            for path in glob.glob(str(ROOT / pattern), recursive=True):
                below = Path(path).rglob("*.cpp") if os.path.isdir(path) else [Path(path)]
                matched |= {one for one in below if one.suffix == ".cpp"} if sign == "+" or pattern != "*" else chosen
            chosen = chosen | matched if sign == "+" else chosen - matched
        self.assert_same_sources(chosen)


class Zephyr(Case):
    # The schema in Zephyr's scripts/zephyr_module.py allows these keys.
    def test_module_file(self):
        module = yaml.safe_load((ROOT / "zephyr/module.yml").read_text())
        self.assertEqual(module.keys(), {"name", "build"})
        self.assertEqual(module["build"].keys(), {"cmake", "kconfig"})
        self.assertTrue((ROOT / module["build"]["cmake"] / "CMakeLists.txt").is_file())
        self.assertTrue((ROOT / module["build"]["kconfig"]).is_file())

    def test_kconfig_option(self):
        (self.folder / "Kconfig").write_text(f"""
config CPP
	bool "C++"
choice
	prompt "Standard"
config STD_CPP17
	bool "17"
config STD_CPP20
	bool "20"
config STD_CPP2B
	bool "2b"
endchoice
config REQUIRES_FULL_LIBCPP
	bool "All of it"
source "{ROOT}/packages/zephyr/Kconfig"
""")
        for standard, possible in (("STD_CPP17", "n"), ("STD_CPP20", "y"), ("STD_CPP2B", "y")):
            options = kconfiglib.Kconfig(str(self.folder / "Kconfig"), warn_to_stderr=False)
            self.assertEqual(options.warnings, [])
            for name in ("CPP", standard, "ABSENC"):
                options.syms[name].set_value("y")
            self.assertEqual(options.syms["ABSENC"].str_value, possible)
            self.assertEqual(options.syms["REQUIRES_FULL_LIBCPP"].str_value, possible)

    PROJECT = """
cmake_minimum_required(VERSION 3.20)
project(zephyr LANGUAGES NONE)
foreach(name IN ITEMS zephyr_include_directories zephyr_library_named zephyr_library_sources zephyr_library_compile_options)
  cmake_language(EVAL CODE "function(${name})\n message(STATUS \\"${name}=\\${ARGN}\\")\nendfunction()")
endforeach()
"""

    def test_builds_all_sources(self):
        output = self.configured(f'{self.PROJECT}set(CONFIG_ABSENC y)\nadd_subdirectory({ROOT}/packages/zephyr absenc)')
        called = dict(re.findall(r"^-- (zephyr_\w+)=(.*)$", output, re.MULTILINE))
        self.assertEqual(called["zephyr_include_directories"], str(ROOT))
        self.assertEqual(called["zephyr_library_named"], "absenc")
        self.assertIn("-fdata-sections", called["zephyr_library_compile_options"])
        self.assert_same_sources(called["zephyr_library_sources"].split(";"))

    def test_builds_nothing_without_option(self):
        output = self.configured(f"{self.PROJECT}add_subdirectory({ROOT}/packages/zephyr absenc)")
        self.assertNotIn("zephyr_", output)


class EspIdf(Case):
    # Keys of idf_component.yml, from
    # https://docs.espressif.com/projects/idf-component-manager/en/latest/reference/manifest_file.html
    KEYS = {"version", "description", "license", "tags", "dependencies", "files"}

    def test_manifest_has_documented_keys(self):
        manifest = yaml.safe_load((ROOT / "idf_component.yml").read_text())
        self.assertEqual(manifest.keys(), self.KEYS)
        self.assertEqual(manifest["version"], VERSION)
        self.assertEqual(manifest["files"].keys(), {"include", "exclude"})
        for tag in manifest["tags"]:
            self.assertRegex(tag, r"^[A-Za-z0-9_-]{3,32}$")
        packed = {os.path.relpath(path, ROOT) for pattern in manifest["files"]["include"]
                  for path in glob.glob(str(ROOT / pattern), recursive=True)}
        self.assertGreaterEqual(packed, sources() | {"CMakeLists.txt", "cmake/sources.cmake", "packages/esp-idf.cmake"})
        self.assertFalse([path for path in packed if path.startswith(("absenc/os", "absenc/sim", "tools", "tests"))])

    # This idf_component_register is a fake that creates a library, as the real one does.
    PROJECT = f"""
cmake_minimum_required(VERSION 3.16)
project(esp LANGUAGES CXX)
function(idf_component_register)
  cmake_parse_arguments(one "" "" "SRCS;INCLUDE_DIRS" ${{ARGN}})
  add_library(component STATIC ${{one_SRCS}})
  set(COMPONENT_LIB component PARENT_SCOPE)
  message(STATUS "sources=${{one_SRCS}}")
  message(STATUS "headers=${{one_INCLUDE_DIRS}}")
endfunction()
set(ESP_PLATFORM 1)
add_subdirectory({ROOT} absenc)
"""

    def test_builds_all_sources(self):
        output = self.configured(self.PROJECT)
        self.assert_same_sources(re.search("^-- sources=(.*)$", output, re.MULTILINE)[1].split(";"))
        self.assertEqual(re.search("^-- headers=(.*)$", output, re.MULTILINE)[1], str(ROOT))

    def test_early_script_stops_at_registration(self):
        """In ESP-IDF's early expansion, idf_component_register ends the script."""
        (self.folder / "early.cmake").write_text(f"""
set(ESP_PLATFORM 1)
set(CMAKE_BUILD_EARLY_EXPANSION 1)
macro(idf_component_register)
  message(STATUS "asked")
  return()
endmacro()
include({ROOT}/CMakeLists.txt)
""")
        self.assertIn("asked", run("cmake", "-P", self.folder / "early.cmake"))


class Arduino(Case):
    # Keys of library.properties, from https://arduino.github.io/arduino-cli/latest/library-specification/
    REQUIRED = {"name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url", "architectures"}
    OPTIONAL = {"includes", "dot_a_linkage"}

    def setUp(self):
        super().setUp()
        run(ROOT / "packages/arduino/export.py", self.folder)
        self.library = self.folder / "absenc"

    def test_properties_are_documented(self):
        lines = (self.library / "library.properties").read_text().splitlines()
        properties = dict(line.split("=", 1) for line in lines)
        self.assertEqual(properties.keys(), self.REQUIRED | self.OPTIONAL)
        self.assertEqual(properties["version"], VERSION)
        self.assertEqual(properties["category"], "Device Control")
        self.assertTrue((self.library / "src" / properties["includes"]).is_file())

    def test_exports_all_sources(self):
        exported = self.library / "src"
        self.assert_same_sources(ROOT / path.relative_to(exported) for path in exported.rglob("*.cpp"))

    def test_sketch_reads_positions(self):
        sketch = self.library / "examples/ReadTFormat/ReadTFormat.ino"
        program = self.folder / "sketch.cpp"
        # Makes a C++ program of the sketch, as the Arduino tools do.
        program.write_text(f'#include <Arduino.h>\n#include "{sketch}"\n'
                           "int main() { setup(); for (int i = 0; i < 20000; ++i) loop(); }\n")
        exported = self.library / "src"
        run("c++", "-std=gnu++20", "-Wall", "-Werror", "-I", ROOT / "tests/arduino", "-I", exported, "-o",
            self.folder / "sketch", program, exported / "absenc/protocol/host_rules.cpp",
            *sorted((exported / "absenc/protocol/author").rglob("*.cpp")))
        output = run(self.folder / "sketch").splitlines()
        # Every third reply is damaged (tests/arduino/Arduino.h), and the reply after a damaged one prints no
        # position, so positions and errors alternate in the output.
        self.assertEqual(output[:6], ["4660 74565", "bad_checksum"] * 3)


class FetchContent(Case):
    # Folders of absenc/protocol that the unit tformat does not need.
    OTHERS = {path.name for path in (ROOT / "absenc/protocol").iterdir() if path.is_dir()} - {"author", "tformat"}

    def built(self, library, *options):
        """Builds the example with another library in place of its own, if `library` is another."""
        example = (ROOT / "packages/fetchcontent/CMakeLists.txt").read_text()
        self.assertIn(" absenc::tformat)", example)
        (self.folder / "CMakeLists.txt").write_text(example.replace(" absenc::tformat)", f" {library})"))
        shutil.copy(ROOT / "packages/fetchcontent/main.cpp", self.folder)
        run("cmake", "-G", "Ninja", "-S", self.folder, "-B", self.folder / "build",
            f"-DFETCHCONTENT_SOURCE_DIR_ABSENC={ROOT}", *options)
        run("cmake", "--build", self.folder / "build")
        return self.folder / "build/position"

    def test_compiles_only_one_protocol(self):
        run(self.built("absenc::tformat", "-DCMAKE_BUILD_TYPE=Debug"))
        objects = {path.relative_to(self.folder / "build/_deps/absenc-build/CMakeFiles") for path in self.folder.rglob("*.cpp.o")
                   if "_deps" in path.parts}
        self.assertTrue(objects)
        for path in objects:
            self.assertIn(path.parts[0], ("absenc-base.dir", "absenc-tformat.dir"))
            self.assertIn(path.parts[2], LAYERS)
            self.assertFalse(self.OTHERS & set(path.parts), path)

    @unittest.skipUnless(os.environ.get("ABSENC_FIRMWARE_ALL"), "compiles all of it: ./dev firmware")
    def test_unused_units_take_no_space(self):
        program = self.built("absenc::absenc", "--toolchain", ROOT / "cmake/arm-none-eabi.cmake",
                             "-DCMAKE_BUILD_TYPE=MinSizeRel",
                             "-DCMAKE_EXE_LINKER_FLAGS=--specs=nano.specs --specs=nosys.specs")
        symbols = run("arm-none-eabi-nm", "-C", program)
        self.assertIn("absenc::tformat::", symbols)
        for unit in self.OTHERS:
            self.assertNotIn(f"absenc::{unit}::", symbols)
        # A program linked only with the sources it needs must have the same size, so nothing superfluous was linked.
        alone = self.folder / "alone"
        flags = "-mcpu=cortex-m0plus -mthumb -std=c++20 -Os -DNDEBUG -ffreestanding -ffunction-sections -fdata-sections"
        run("arm-none-eabi-g++", *flags.split(), "-fno-exceptions", "-fno-rtti", "-fno-threadsafe-statics",
            "--specs=nano.specs", "--specs=nosys.specs", "-Wl,--gc-sections", "-I", ROOT, "-o", alone,
            ROOT / "packages/fetchcontent/main.cpp", *(ROOT / "absenc/protocol/author").glob("engine.cpp"))
        self.assertEqual(self.sizes(program), self.sizes(alone))

    @staticmethod
    def sizes(program):
        return run("arm-none-eabi-size", program).splitlines()[1].split()[:3]


if __name__ == "__main__":
    unittest.main()
