# SPDX-License-Identifier: Apache-2.0
"""What is installed and packaged: all is there and nothing else, it works from another place, others can use it."""
import gzip
import os
import re
import shlex
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

from command_support import absenc

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
BUILD = Path(os.environ["ABSENC"]).parent.parent
VERSION = re.search(r"^project\(absenc VERSION ([\d.]+)", (SOURCE / "CMakeLists.txt").read_text(), re.MULTILINE)[1]
PROGRAM = SOURCE / "examples/read_position.cpp"  # reads a virtual encoder with both libraries

PROJECT = f"""
cmake_minimum_required(VERSION 3.25)
project(outside LANGUAGES CXX)
find_package(absenc 99 QUIET)
if(absenc_FOUND)
  message(FATAL_ERROR "version 99 was found")
endif()
find_package(absenc {VERSION} REQUIRED)
add_executable(outside {PROGRAM})
target_link_libraries(outside PRIVATE absenc::absenc absenc::os)
"""
PARENT = f"""
cmake_minimum_required(VERSION 3.25)
project(parent LANGUAGES CXX)
add_subdirectory({SOURCE} absenc)
if(NOT TARGET absenc::os OR TARGET absenc-command)
  message(FATAL_ERROR "not what a parent wants")
endif()
"""
# What bash does at the tab key; `compopt` works only there.
COMPLETE = r"""
source "$1"
shift
compopt() { printf 'compopt %s\n' "$*"; }
COMP_WORDBREAKS=$' \t\n"\'><=;|&(:'
COMP_WORDS=(absenc "$@")
COMP_CWORD=$#
_absenc absenc
((${#COMPREPLY[@]} == 0)) || printf '%s\n' "${COMPREPLY[@]}"
"""


def run(*command, **settings):
    done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=100, **settings)
    if done.returncode != 0:
        raise AssertionError(f"{shlex.join(map(str, command))}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def files_below(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir()}


def verbs():
    """Each verb with its help."""
    listed = re.findall(r"^  (\S+(?: \S+)?)  ", absenc("--help").stdout.split("\nVerbs:\n")[1].split("\nAn ")[0],
                        re.MULTILINE)
    return {verb: absenc(*verb.split(), "--help").stdout for verb in listed}


class Case(unittest.TestCase):
    """The tree as it was installed, in another place than where it was installed to."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="absenc-install-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        run("cmake", "--install", BUILD, "--prefix", cls.folder / "first")
        cls.root = (cls.folder / "first").rename(cls.folder / "moved")


class Installed(Case):
    def test_all_and_nothing_else(self):
        files = files_below(self.root)
        headers = {path for path in files if path.startswith("include/")}
        self.assertEqual({re.sub(r"^lib/.*/", "lib/", path) for path in files - headers}, {
            "bin/absenc", "lib/libabsenc.a", "lib/libabsenc-os.a", "lib/libabsenc-capture.a",
            "lib/absenc.pc", "lib/absenc-os.pc", "lib/absenc-capture.pc",
            "lib/absencConfig.cmake", "lib/absencConfig-release.cmake", "lib/absencConfigVersion.cmake",
            "share/man/man1/absenc.1", "share/bash-completion/completions/absenc", "share/doc/absenc/README.md",
            "share/doc/absenc/LICENSE"})
        sources = {"include/" + str(path.relative_to(SOURCE)) for path in (SOURCE / "absenc").rglob("*.hpp")}
        sources = {path for path in sources if not path.startswith("include/absenc/os/cuse/")}  # only the command's
        self.assertLessEqual(headers, sources)
        left_out = {os.path.basename(path) for path in sources - headers}
        self.assertTrue(left_out)
        self.assertTrue(all("test" in name for name in left_out), left_out)

    def test_headers_need_only_installed_ones(self):
        for header in (self.root / "include").rglob("*.hpp"):
            text = header.read_text()
            self.assertNotIn("gtest", text, header)
            for included in re.findall(r'^#include "(.+)"', text, re.MULTILINE):
                self.assertTrue((self.root / "include" / included).is_file(), f"{header}: {included}")

    def test_no_file_knows_where_it_was_made(self):
        for path in files_below(self.root):
            content = (self.root / path).read_bytes()
            for place in (BUILD, SOURCE, self.folder / "first"):
                self.assertNotIn(str(place).encode() + b"/", content, path)

    def test_the_command(self):
        self.assertEqual(run(self.root / "bin/absenc", "--version"), f"absenc {VERSION}\n")
        self.assertIn("0 turns", run(self.root / "bin/absenc", "read", "sim:tformat"))

    def test_a_project_that_finds_the_package(self):
        project = self.folder / "project"
        project.mkdir()
        (project / "CMakeLists.txt").write_text(PROJECT)
        run("cmake", "-G", "Ninja", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.root}")
        run("cmake", "--build", project / "build")
        self.assertEqual(run(project / "build/outside"), "90.0000 degrees\n7 turns\n")

    def test_a_program_with_pkg_config(self):
        [pc] = self.root.rglob("absenc-os.pc")
        environment = {**os.environ, "PKG_CONFIG_PATH": str(pc.parent)}
        self.assertEqual(run("pkg-config", "--modversion", "absenc", env=environment).strip(), VERSION)
        flags = run("pkg-config", "--cflags", "--libs", "absenc-os", env=environment).split()
        program = self.folder / "program"
        run("g++", "-std=c++20", "-O0", PROGRAM, *flags, "-o", program)
        self.assertEqual(run(program), "90.0000 degrees\n7 turns\n")

    def test_a_parent_project_installs_nothing_of_it(self):
        parent = self.folder / "parent"
        parent.mkdir()
        (parent / "CMakeLists.txt").write_text(PARENT)
        run("cmake", "-G", "Ninja", "-S", parent, "-B", parent / "build")
        run("cmake", "--install", parent / "build", "--prefix", parent / "installed")
        self.assertEqual(files_below(parent / "installed"), set())
        self.assertFalse((parent / "build/CPackConfig.cmake").exists())


class ManPage(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.path = cls.root / "share/man/man1/absenc.1"

    def shown(self, *options):
        """As `man` shows it; its warnings go to standard error."""
        environment = {**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "1000", "MANROFFOPT": "", "MANOPT": ""}
        return subprocess.run(["man", "-l", *options, self.path], stdin=subprocess.DEVNULL, capture_output=True,
                              text=True, timeout=60, check=True, env=environment)

    def test_has_no_warning(self):
        self.assertEqual(self.shown("--warnings=w").stderr, "")
        done = subprocess.run(["groff", "-man", "-ww", "-z", self.path], capture_output=True, text=True, timeout=60)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_can_be_found_by_its_name(self):
        self.assertIn('"absenc - ', run("lexgrog", self.path))

    def test_says_what_help_says(self):
        shown = [line.strip() for line in self.shown().stdout.splitlines()]
        helps = verbs()
        self.assertGreater(len(helps), 20)
        for verb, text in helps.items():
            with self.subTest(verb):
                begin = shown.index(verb, shown.index("VERBS"))
                section = shown[begin:next(i for i in range(begin, len(shown)) if shown[i].startswith("--help "))]
                self.assertIn(re.search(r"^Usage: (.+)$", text, re.MULTILINE)[1], section)
                for option in re.findall(r"^  (--\S+)", text.replace("  --help", ""), re.MULTILINE):
                    self.assertTrue(any(re.match(rf"{option}\b", line) for line in section), option)
                for example in re.findall(r"^  (absenc .+)$", text, re.MULTILINE):
                    self.assertIn(example, shown)

    def test_has_the_usual_sections(self):
        sections = [line for line in self.shown().stdout.splitlines() if re.match(r"[A-Z]", line)][1:]
        self.assertEqual(sections, ["NAME", "SYNOPSIS", "DESCRIPTION", "ENCODERS", "VERBS", "EXAMPLES", "FILES",
                                    "ENVIRONMENT", "EXIT STATUS"])


class Completion(Case):
    def complete(self, *words):
        script = self.root / "share/bash-completion/completions/absenc"
        return run("bash", "-u", "-c", COMPLETE, "bash", script, *words).splitlines()

    def test_is_bound_to_the_command(self):
        script = self.root / "share/bash-completion/completions/absenc"
        self.assertIn("-F _absenc absenc", run("bash", "-c", 'source "$1"; complete -p absenc', "bash", script))

    def test_verbs_and_their_options(self):
        offered = self.complete("")
        for verb, text in verbs().items():
            with self.subTest(verb):
                self.assertIn(verb.split()[0], offered)
                options = set(re.findall(r"^  (--[a-z0-9-]+)", text, re.MULTILINE))
                self.assertEqual(set(self.complete(*verb.split(), "--")), options)
        self.assertEqual(self.complete("temp"), ["temperature"])

    def test_values_of_an_option(self):
        self.assertEqual(self.complete("emulate", "tformat", "--power-on", ""), ["real", "skip"])
        self.assertEqual(self.complete("emulate", "--power-on", "=", "s"), ["skip"])
        self.assertEqual(self.complete("emulate", "--seed", ""), [])
        self.assertEqual(self.complete("emulate", "--seed", "5", "tf"), ["tformat"])

    def test_protocols(self):
        listed = set(re.findall(r"^([a-z]\S+) ", absenc("list").stdout, re.MULTILINE))
        self.assertEqual(set(self.complete("list", "")), listed)
        self.assertEqual(set(self.complete("read", "")), {f"{id}:" for id in listed} | {f"sim:{id}" for id in listed})
        self.assertEqual(set(self.complete("read", "sim", ":")), listed)

    def test_encoders(self):
        self.assertEqual(self.complete("read", "--json", "tf"), ["compopt -o nospace", "tformat:"])
        self.assertEqual(self.complete("read", "sim", ":", "tf"), ["tformat"])
        self.assertEqual(self.complete("read", '"sim:tf'), ["sim:tformat"])
        self.assertEqual(self.complete("read", "tformat", ":"), ["compopt -o nospace", "/", "slcan:", "spi:", "tcp:"])
        (self.folder / "tty one").touch()
        for path in ("tty", "tty o"):
            with self.subTest(path):
                self.assertEqual(self.complete("zero", "tformat", ":", f"{self.folder}/{path}"),
                                 ["compopt -o filenames", f"{self.folder}/tty one"])
        self.assertEqual(self.complete("zero", f"'tformat:{self.folder}/tt")[-1], f"tformat:{self.folder}/tty one")
        self.assertEqual(self.complete("zero", "tformat", ":", f"{self.folder}/tty", "tf"), [])

    def test_files(self):
        (self.folder / "memory.txt").touch()
        self.assertEqual(self.complete("emulate", "tformat", "--memory", f"{self.folder}/mem"),
                         ["compopt -o filenames", f"{self.folder}/memory.txt"])


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="absenc-package-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        run("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", cls.folder, umask=0o077)
        [cls.package] = cls.folder.glob("absenc_*.deb")
        cls.root = cls.folder / "root"
        run("dpkg-deb", "-x", cls.package, cls.root)

    def field(self, name):
        return run("dpkg-deb", "-f", self.package, name).strip()

    def test_says_what_it_is(self):
        self.assertEqual(self.field("Package"), "absenc")
        self.assertEqual(self.field("Version"), VERSION)
        self.assertEqual(self.field("Architecture"), run("dpkg", "--print-architecture").strip())
        self.assertRegex(self.field("Maintainer"), r"^absenc developers <\S+@\S+>$")
        self.assertRegex(self.field("Description"), r"\A[A-Z].+[^.]\n .+")
        for library in ("libc6", "libstdc++6", "libfmt"):
            self.assertIn(library, self.field("Depends"))

    def test_holds_what_is_installed(self):
        run("cmake", "--install", BUILD, "--prefix", self.folder / "installed")
        installed = files_below(self.folder / "installed") - {"share/doc/absenc/LICENSE", "share/man/man1/absenc.1"}
        added = {"share/doc/absenc/copyright", "share/man/man1/absenc.1.gz"}
        self.assertEqual(files_below(self.root), {"usr/" + path for path in installed | added})

    def test_belongs_to_root_and_may_be_read_by_all(self):
        for line in run("dpkg-deb", "-c", self.package).splitlines():
            mode = "drwxr-xr-x" if line.endswith("/") else "-rwxr-xr-x" if line.endswith("bin/absenc") else "-rw-r--r--"
            self.assertTrue(line.startswith(f"{mode} root/root "), line)

    def test_the_unpacked_command(self):
        self.assertIn("turns", run(self.root / "usr/bin/absenc", "read", "sim:tformat"))

    def test_the_unpacked_documents(self):
        made = self.root / "usr/share"
        self.assertEqual(gzip.decompress((made / "man/man1/absenc.1.gz").read_bytes()),
                         (BUILD / "manual/absenc.1").read_bytes())
        self.assertEqual((made / "bash-completion/completions/absenc").read_bytes(),
                         (BUILD / "manual/absenc").read_bytes())
        self.assertIn("Apache-2.0", (made / "doc/absenc/copyright").read_text())


if __name__ == "__main__":
    unittest.main()
