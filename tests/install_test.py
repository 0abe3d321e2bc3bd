# SPDX-License-Identifier: Apache-2.0
"""Tests the installation and the packages."""
import gzip
import json
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from command_support import absenc, run_tool

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
BUILD = Path(os.environ["ABSENC"]).parent.parent
VERSION = (SOURCE / "VERSION").read_text().strip()
SERVE_DOCUMENTS = {f"share/doc/absenc-serve/{name}"
                   for name in ("serve.md", "mqtt.md", "mqtt-schema.json", "grafana-dashboard.json")}
# Man pages made from the pages of docs/, one for each page.
GUIDE = {f"share/man/man7/absenc-{page.stem}.7" for page in (SOURCE / "docs").glob("*.md")}

# The installed libraries, each behind those that it needs. A program that reads an encoder needs absenc-client and the
# three libraries before it.
PARTS = ("absenc", "absenc-os", "absenc-search", "absenc-client", "absenc-configuration", "absenc-capture",
         "absenc-captures", "absenc-recording", "absenc-hdf5", "absenc-ftdi", "absenc-gpio")
PKG_CONFIG = ("absenc", "absenc-client", "absenc-configuration", "absenc-captures", "absenc-recording", "absenc-hdf5",
              "absenc-ftdi", "absenc-gpio")
# Shared libraries of a program that links only absenc::client: those of C++ and C.
STANDARD = {"linux-vdso", "libstdc++", "libm", "libgcc_s", "libc", "ld-linux-x86-64", "ld-linux-aarch64"}
# Names that the symbols of a program that links only absenc::client must not contain, because they are from other
# libraries.
FOREIGN = re.compile(r"nlohmann|toml::|\bH5[A-Z]|\bhwy::|\b(zip|unz)[A-Z]|libdeflate|\bftdi_usb_open|\bgpiod_line_find")

BY_NAME = SOURCE / "examples/read_by_name.cpp"
# Expected output of read_by_name: it prints positions, then the speed, as soon as enough positions for an average were
# read.
BY_NAME_SAYS = r"^(0\.0000 degrees\n)+0\.0 rpm, within \d"
# A program that uses the library as firmware does. It reads a virtual encoder whose shaft is at 7.25 turns.
FIRMWARE = """
#include <cstdint>
#include <cstdio>

#include "absenc/host/drive.hpp"
#include "absenc/protocol/tformat/device.hpp"
#include "absenc/protocol/tformat/host.hpp"
#include "absenc/sim/motion.hpp"
#include "absenc/sim/sim_port.hpp"

using namespace absenc;

int main() {
  const sim::Motion shaft = sim::Motion::still(std::int64_t{7} << 32 | 0x4000'0000);
  tformat::VirtualEncoder encoder({}, shaft);
  encoder.power_on(Time{}, Device<std::uint8_t>::PowerOn::skip);
  sim::SimPort<std::uint8_t> port(LinkKind::half_duplex, tformat::line_settings, encoder);
  tformat::ReadPosition read{tformat::Format{.singleturn_bits = 17, .multiturn_bits = 16, .encoder_id = 0x11}};
  host::drive(read, port, [] { return true; });
  if (read.error() != Error::none) return 1;
  const Reading& reading = *read.reading();
  if (!reading.singleturn_valid() || !reading.multiturn_valid) return 1;
  std::printf("%.4f degrees, %d turns\\n", degrees(reading.singleturn, reading.singleturn_bits),
              static_cast<int>(reading.multiturn));
}
"""
FIRMWARE_SAYS = "90.0000 degrees, 7 turns\n"

# A program that catches errors of the library as std::exception.
ENDINGS = r"""
#include <cstdio>
#include <chrono>
#include <exception>
#include <thread>

#include "absenc/client/emulate.hpp"
#include "absenc/client/encoder.hpp"

using namespace absenc;
using namespace std::chrono_literals;

template <class Work>
void attempt(const char* name, const Work& work) try {
  work();
  std::printf("%s: good\n", name);
} catch (const std::exception& failure) {
  const client::Change* change = client::change_of(failure);
  std::printf("%s: %s%s\n", name, change != nullptr ? client::word_of(change->state).data() : "",
              change != nullptr ? "" : failure.what());
}

int main() try {
  client::Encoder encoder = client::open("sim:tformat");
  encoder.cancel();
  attempt("cancelled", [&] { static_cast<void>(encoder.read()); });
  attempt("a change that was cancelled", [&] { encoder.run("memory-write", {5, 1}); });
  encoder.resume();
  attempt("resumed", [&] { static_cast<void>(encoder.read()); });
  std::thread other([&] {
    std::this_thread::sleep_for(30ms);
    encoder.cancel();
  });
  for (const client::Sample& sample : encoder.samples({.rate_hz = 0.1})) {
    std::printf("%s\n", client::text_of(sample.position_state()).data());
  }
  other.join();
  std::printf("samples ended\n");

  client::Emulation emulation = client::emulate("tformat");
  client::Encoder silent = client::open(emulation.address() + "?latency=60000");
  emulation.power_off();
  const auto soon = [] { return std::chrono::steady_clock::now().time_since_epoch() + 50ms; };
  attempt("silent", [&] { static_cast<void>(silent.read(soon())); });
  for (const client::Sample& sample : silent.samples({.deadline = soon()})) std::printf("%s\n", sample.text().c_str());
  std::printf("samples ended\n");

  client::Encoder starting = client::open("sim:tformat?alarm=counting_error");
  for (const client::Sample& sample : starting.samples({.count = 1})) {
    std::printf("%s\n", client::text_of(sample.position_state()).data());
  }
  attempt("a change that is not possible", [&] { client::open("sim:tformat?motion=rpm=60").run("zero"); });
} catch (const std::exception& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 1;
}
"""
ENDINGS_SAY = """\
cancelled: cancelled
a change that was cancelled: not_sent
resumed: good
the position is good: a second one agreed, and nothing that was reported is against it
samples ended
silent: the deadline passed before there was a reading
samples ended
an alarm or a state that the encoder reports says that the position does not hold: look at its alarms
a change that is not possible: not_sent
"""

# A program that uses all optional libraries which extend absenc::client: captures, recordings, HDF5, absenc.toml, FTDI
# chips and GPIO lines.
EXTENDED = r"""
#include <cstdio>
#include <exception>

#include "absenc/client/configuration.hpp"
#include "absenc/client/decode.hpp"
#include "absenc/client/encoder.hpp"
#include "absenc/client/hdf5.hpp"
#include "absenc/client/recording.hpp"
#include "absenc/os/ftdi.hpp"
#include "absenc/os/gpio.hpp"

using namespace absenc;

int main(int, char** arguments) try {
  client::Encoder encoder = client::open("elbow");
  client::Recording recording({.path = arguments[1], .encoder = "elbow", .count = 3}, encoder);
  std::printf("%d", recording.run());
  for (const client::Row& row : client::decode(arguments[2], "tformat")) {
    std::printf(" %s", client::to_text(row.values[0]).c_str());
    break;
  }
  std::printf("\n");
} catch (const std::exception& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 1;
}
"""
# A program that opens the encoder addresses in its arguments and prints the error of each. The test gives it an address
# for each kind of port, all of which fail.
EACH_PLACE = r"""
#include <cstdio>
#include <exception>

#include "absenc/client/encoder.hpp"

int main(int count, char** places) {
  for (int i = 1; i < count; ++i) {
    try {
      absenc::client::open(places[i]).read();
    } catch (const std::exception& failure) {
      std::printf("%s\n", failure.what());
    }
  }
}
"""

PROJECT = f"""
cmake_minimum_required(VERSION 3.25)
project(outside LANGUAGES CXX)
find_package(absenc 99 QUIET)
if(absenc_FOUND)
  message(FATAL_ERROR "version 99 was found")
endif()
find_package(absenc {VERSION} REQUIRED)
add_executable(by_name {BY_NAME})
target_link_libraries(by_name PRIVATE absenc::client)
add_executable(extended extended.cpp)
target_link_libraries(extended PRIVATE absenc::configuration absenc::captures absenc::recording absenc::hdf5 absenc::ftdi
                      absenc::gpio)
add_executable(firmware firmware.cpp)
target_link_libraries(firmware PRIVATE absenc::absenc)
"""
PARENT = f"""
cmake_minimum_required(VERSION 3.25)
project(parent LANGUAGES CXX)
add_subdirectory({SOURCE} absenc)
if(NOT TARGET absenc::absenc OR TARGET absenc-command)
  message(FATAL_ERROR "not what a parent wants")
endif()
if((ABSENC_CLIENT AND NOT TARGET absenc::client) OR (NOT ABSENC_CLIENT AND TARGET absenc::os))
  message(FATAL_ERROR "ABSENC_CLIENT is not what decides")
endif()
"""
# A script that acts as the tab key in bash; it replaces `compopt`, which works only during a completion.
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


def files_below(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if not path.is_dir()}


def pkg_config(root, *arguments):
    """Returns the words that pkg-config prints for the library installed below `root`."""
    [pc] = root.rglob("absenc.pc")
    return run_tool("pkg-config", *arguments, env={**os.environ, "PKG_CONFIG_PATH": str(pc.parent)}).split()


def public_headers():
    """Returns the paths, below the installation folder, of the public headers."""
    patterns = [f"{layer}/**/*.hpp" for layer in ("core", "link", "protocol", "host", "sim")]
    patterns += ["client/*.hpp", "os/error.hpp", "os/ftdi.hpp", "os/gpio.hpp"]
    sources = [path for pattern in patterns for path in (SOURCE / "absenc").glob(pattern)]
    return {f"include/{path.relative_to(SOURCE)}" for path in sources if "test" not in path.name}


def verbs():
    """Returns a dictionary from the name of each verb of absenc to its help text."""
    listed = re.findall(r"^  (\S+(?: \S+)?)  ", absenc("--help").stdout.split("\nVerbs:\n")[1].split("\nAn ")[0],
                        re.MULTILINE)
    return {verb: absenc(*verb.split(), "--help").stdout for verb in listed}


class Case(unittest.TestCase):
    """A test that installs the library and moves the installation to another folder."""

    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="absenc-install-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        run_tool("cmake", "--install", BUILD, "--prefix", cls.folder / "first")
        cls.root = (cls.folder / "first").rename(cls.folder / "moved")


class Installed(Case):
    def test_installs_all_files_and_no_others(self):
        files = files_below(self.root)
        headers = {path for path in files if path.startswith("include/")}
        package = "lib/python3/dist-packages/absenc/"
        python = {path for path in files if path.startswith(package)}
        [module] = {path for path in python if path.endswith(".so")}
        self.assertRegex(module, package + r"_absenc\.cpython-\d+-.*\.so")
        self.assertEqual(python - {module}, {package + path for path in files_below(SOURCE / "python/absenc")
                                             if "__pycache__" not in path})
        self.assertEqual({re.sub(r"^lib/.*/", "lib/", path) for path in files - headers - python}, {
            "bin/absenc", *(f"lib/lib{name}.a" for name in PARTS), *(f"lib/{name}.pc" for name in PKG_CONFIG),
            "lib/absenc-serve", "lib/hdf5.so",
            "lib/absencConfig.cmake", "lib/absencConfig-release.cmake", "lib/absencConfigVersion.cmake",
            "share/man/man1/absenc.1", "share/bash-completion/completions/absenc", "share/doc/absenc/README.md",
            "share/doc/absenc/LICENSE", *SERVE_DOCUMENTS, "lib/absenc.service", "lib/60-absenc-ftdi.rules", *GUIDE})
        self.assertEqual(headers, public_headers())

    def test_headers_include_only_installed_ones(self):
        for header in (self.root / "include").rglob("*.hpp"):
            text = header.read_text()
            for included in re.findall(r"^#include <(.+)>", text, re.MULTILINE):
                # The installed headers include no header of another library or of the operating system.
                self.assertRegex(included, r"^(\w+|bits/chrono\.h)$", header)
            for included in re.findall(r'^#include "(.+)"', text, re.MULTILINE):
                self.assertTrue((self.root / "include" / included).is_file(), f"{header}: {included}")

    def test_each_header_compiles_alone(self):
        def compile_alone(header):
            include = f'#include "{header.relative_to(self.root / "include")}"\n'
            return subprocess.run(["g++", "-std=c++20", "-fsyntax-only", "-I", self.root / "include", "-x", "c++", "-"],
                                  input=include, capture_output=True, text=True, timeout=300).stderr

        headers = sorted((self.root / "include").rglob("*.hpp"))
        self.assertGreater(len(headers), 100)
        with ThreadPoolExecutor(os.cpu_count()) as workers:
            for header, errors in zip(headers, workers.map(compile_alone, headers)):
                self.assertEqual(errors, "", header)

    def test_no_file_contains_build_paths(self):
        for path in files_below(self.root):
            content = (self.root / path).read_bytes()
            for place in (BUILD, SOURCE, self.folder / "first"):
                self.assertNotIn(str(place).encode() + b"/", content, path)

    def test_command_runs(self):
        self.assertRegex(run_tool(self.root / "bin/absenc", "--version"),
                         rf"\Aabsenc {VERSION}\ncommit \w+\nfor {os.uname().machine}\nbuilt in: .+\n\Z")
        self.assertIn("0 turns", run_tool(self.root / "bin/absenc", "read", "sim:tformat"))

    def test_cmake_project_finds_package(self):
        project = self.folder / "project"
        project.mkdir()
        (project / "CMakeLists.txt").write_text(PROJECT)
        (project / "firmware.cpp").write_text(FIRMWARE)
        (project / "extended.cpp").write_text(EXTENDED)
        run_tool("cmake", "-G", "Ninja", "-S", project, "-B", project / "build", f"-DCMAKE_PREFIX_PATH={self.root}")
        run_tool("cmake", "--build", project / "build")
        self.assertRegex(run_tool(project / "build/by_name", "sim:tformat"), BY_NAME_SAYS)
        self.assertEqual(run_tool(project / "build/firmware"), FIRMWARE_SAYS)
        self.assert_is_small(project / "build/by_name")
        self.assert_is_extended(project / "build/extended", project)

    def assert_is_small(self, program):
        """Asserts that the program loads only libraries of C and C++, and contains no other library either."""
        loaded = {Path(line.split()[0]).name.split(".so")[0] for line in run_tool("ldd", program).splitlines()}
        self.assertIn("libstdc++", loaded)
        self.assertEqual(loaded - STANDARD, set())
        symbols = run_tool("nm", "-C", program)
        self.assertIn("absenc::client::", symbols)
        self.assertEqual({found[0] for found in FOREIGN.finditer(symbols)}, set())

    def assert_is_extended(self, program, folder):
        (folder / "absenc.toml").write_text('[encoder.elbow]\nprotocol = "tformat"\nport = "sim"\n')
        for name in ("log.csv", "log.h5"):
            said = run_tool(program, folder / f"{program.name}-{name}", SOURCE / "examples/tformat.txt",
                            env={**os.environ, "ABSENC_CONFIG": str(folder / "absenc.toml")})
            self.assertRegex(said, r"^1 \S+")
        self.assertEqual((folder / f"{program.name}-log.h5").read_bytes()[:4], b"\x89HDF")

    def test_small_library_opens_each_kind_of_place(self):
        source = self.folder / "each_place.cpp"
        source.write_text(EACH_PLACE)
        program = self.program("each_place", source, "absenc-client")
        self.assert_is_small(program)
        said = run_tool(program, "tformat:/dev/ttyNONE", "tformat:tcp:127.0.0.1:1", "ssi:spi:/dev/spidevNONE",
                        "raa38-can:canNONE", "elbow", "raa38:/dev/null?baud=115200&trigger=gpio:X").splitlines()
        for line, expected in zip(said, ("/dev/ttyNONE", "127.0.0.1 port 1", "/dev/spidevNONE", "can",
                                         "build it with absenc::configuration"), strict=False):
            self.assertIn(expected, line)
        self.assertGreaterEqual(len(said), 6)

    def program(self, name, source, *libraries):
        """Compiles a program, and links it with the flags that pkg-config prints for `libraries`."""
        run_tool("g++", "-std=c++20", "-O0", source, *pkg_config(self.root, "--cflags", "--libs", *libraries), "-o",
                 self.folder / name)
        return self.folder / name

    def test_programs_build_with_pkg_config(self):
        firmware = self.folder / "firmware.cpp"
        firmware.write_text(FIRMWARE)
        self.assertRegex(run_tool(self.program("by_name", BY_NAME, "absenc-client"), "sim:tformat"), BY_NAME_SAYS)
        self.assertEqual(run_tool(self.program("firmware", firmware, "absenc")), FIRMWARE_SAYS)
        endings = self.folder / "endings.cpp"
        endings.write_text(ENDINGS)
        self.assertEqual(run_tool(self.program("endings", endings, "absenc-client")), ENDINGS_SAY)
        extended = self.folder / "extended.cpp"
        extended.write_text(EXTENDED)
        self.assert_is_extended(self.program("extended_by_pkg_config", extended, "absenc-configuration", "absenc-captures",
                                             "absenc-hdf5", "absenc-ftdi", "absenc-gpio"), self.folder)
        for library in PKG_CONFIG:
            self.assertEqual(pkg_config(self.root, "--modversion", library), [VERSION])
        self.assertEqual([flag for flag in pkg_config(self.root, "--libs", "absenc-client") if flag.startswith("-l")],
                         ["-labsenc-client", "-labsenc-search", "-labsenc-os", "-labsenc"])
        self.assertEqual({flag for flag in pkg_config(self.root, "--libs", "absenc") if flag.startswith("-l")},
                         {"-labsenc"})

    def test_parent_project_installs_nothing_of_it(self):
        parent = self.folder / "parent"
        parent.mkdir()
        (parent / "CMakeLists.txt").write_text(PARENT)
        for client in ("OFF", "ON"):
            run_tool("cmake", "-G", "Ninja", "-S", parent, "-B", parent / "build", f"-DABSENC_CLIENT={client}")
        run_tool("cmake", "--install", parent / "build", "--prefix", parent / "installed")
        self.assertEqual(files_below(parent / "installed"), set())
        self.assertFalse((parent / "build/CPackConfig.cmake").exists())

    def test_compiler_without_cpp20_is_refused_in_one_sentence(self):
        old = self.folder / "old-g++"
        old.write_text('#!/bin/sh\nexec g++ "$@" -std=c++17\n')
        old.chmod(0o755)
        done = subprocess.run(["cmake", "-G", "Ninja", "-S", SOURCE, "-B", self.folder / "old",
                               f"-DCMAKE_CXX_COMPILER={old}"], capture_output=True, text=True, timeout=100)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn(f"absenc needs a compiler for C++20 (g++ 12, clang 14 or newer), which {old} is not.",
                      " ".join(done.stderr.split()))
        self.assertLess(len(done.stderr.splitlines()), 12)

    def test_options_stand_in_the_table(self):
        cmake = (SOURCE / "CMakeLists.txt").read_text()
        options = re.findall(r"^(?:option|set)\((ABSENC_\w+) (?:\"|\"\" CACHE)", cmake, re.MULTILINE)
        table = re.findall(r"^\| `(ABSENC_\w+)` \|", (SOURCE / "docs/cpp.md").read_text(), re.MULTILINE)
        self.assertGreater(len(options), 10)
        self.assertEqual(table, options)


class ManPage(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.path = cls.root / "share/man/man1/absenc.1"

    def shown(self, *options, path=None):
        """Returns the man page as `man` shows it, and its warnings on standard error."""
        environment = {**os.environ, "LC_ALL": "C.UTF-8", "MANWIDTH": "1000", "MANROFFOPT": "", "MANOPT": ""}
        return subprocess.run(["man", "-l", *options, path or self.path], stdin=subprocess.DEVNULL, capture_output=True,
                              text=True, timeout=60, check=True, env=environment)

    def test_has_no_warnings(self):
        self.assertEqual(self.shown("--warnings=w").stderr, "")
        done = subprocess.run(["groff", "-man", "-ww", "-z", self.path], capture_output=True, text=True, timeout=60)
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))

    def test_is_found_by_name(self):
        self.assertIn('"absenc - ', run_tool("lexgrog", self.path))

    def test_guide_has_no_warnings(self):
        self.assertGreater(len(GUIDE), 15)
        for page in sorted(GUIDE):
            path = self.root / page
            with self.subTest(path.name):
                self.assertEqual(self.shown("--warnings=w", path=path).stderr, "")
                done = subprocess.run(["groff", "-t", "-man", "-ww", "-z", "-Tutf8", path], capture_output=True, text=True, timeout=60)
                self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
                self.assertIn(f'"{path.stem} - ', run_tool("lexgrog", path))

    def test_guide_shows_headings_code_and_tables(self):
        text = self.shown(path=self.root / "share/man/man7/absenc-read.7").stdout
        self.assertIn("$ absenc read sim:tformat --count 3 --json", text)
        self.assertRegex(text, r"│ *sim:tformat *│")
        self.assertNotRegex(text, r"```|\]\(|\*\*|<!--")

    def test_pages_that_it_names_exist(self):
        named = set(re.findall(r"(absenc-[\w-]+)\(7\)", self.shown().stdout))
        self.assertGreater(len(named), 8)
        self.assertLessEqual({f"share/man/man7/{name}.7" for name in named}, GUIDE)

    def test_agrees_with_help(self):
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

    def test_has_standard_sections(self):
        sections = [line for line in self.shown().stdout.splitlines() if re.match(r"[A-Z]", line)][1:]
        self.assertEqual(sections, ["NAME", "SYNOPSIS", "DESCRIPTION", "ENCODERS", "VERBS", "EXAMPLES", "FILES",
                                    "ENVIRONMENT", "EXIT STATUS", "SEE ALSO"])


class Completion(Case):
    def complete(self, *words):
        script = self.root / "share/bash-completion/completions/absenc"
        return run_tool("bash", "-u", "-c", COMPLETE, "bash", script, *words).splitlines()

    def test_is_bound_to_command(self):
        script = self.root / "share/bash-completion/completions/absenc"
        self.assertIn("-F _absenc absenc", run_tool("bash", "-c", 'source "$1"; complete -p absenc', "bash", script))

    def test_completes_verbs_and_options(self):
        offered = self.complete("")
        for verb, text in verbs().items():
            with self.subTest(verb):
                self.assertIn(verb.split()[0], offered)
                options = set(re.findall(r"^  (--[a-z0-9-]+)", text, re.MULTILINE))
                self.assertEqual(set(self.complete(*verb.split(), "--")), options)
        self.assertEqual(self.complete("temp"), ["temperature"])

    def test_completes_values_of_options(self):
        self.assertEqual(self.complete("emulate", "tformat", "--power-on", ""), ["real", "skip"])
        self.assertEqual(self.complete("emulate", "--power-on", "=", "s"), ["skip"])
        self.assertEqual(self.complete("emulate", "--seed", ""), [])
        self.assertEqual(self.complete("emulate", "--seed", "5", "tf"), ["tformat"])

    def test_completes_protocols(self):
        listed = set(re.findall(r"^([a-z]\S+) ", absenc("list").stdout, re.MULTILINE))
        units = [json.loads(line) for line in absenc("list", "--json").stdout.splitlines()]
        known = {name for unit in units for name in [*unit["known_as"], *(model["name"] for model in unit["models"])]}
        self.assertIn("Tamagawa", known)
        self.assertEqual(set(self.complete("list", "")), listed | {name for name in known if " " not in name})
        self.assertEqual(set(self.complete("emulate", "")), listed)
        self.assertEqual(set(self.complete("read", "")), {f"{id}:" for id in listed} | {f"sim:{id}" for id in listed})
        self.assertEqual(set(self.complete("read", "sim", ":")), listed)

    def test_completes_encoders(self):
        self.assertEqual(self.complete("read", "--json", "tf"), ["compopt -o nospace", "tformat:"])
        self.assertEqual(self.complete("read", "sim", ":", "tf"), ["tformat"])
        self.assertEqual(self.complete("read", '"sim:tf'), ["sim:tformat"])
        self.assertEqual(self.complete("read", "tformat", ":"), ["compopt -o nospace", "/", "ftdi", "slcan:", "spi:", "tcp:"])
        (self.folder / "tty one").touch()
        for path in ("tty", "tty o"):
            with self.subTest(path):
                self.assertEqual(self.complete("zero", "tformat", ":", f"{self.folder}/{path}"),
                                 ["compopt -o filenames", f"{self.folder}/tty one"])
        self.assertEqual(self.complete("zero", f"'tformat:{self.folder}/tt")[-1], f"tformat:{self.folder}/tty one")
        self.assertEqual(self.complete("zero", "tformat", ":", f"{self.folder}/tty", "tf"), [])

    def test_completes_files(self):
        (self.folder / "memory.txt").touch()
        self.assertEqual(self.complete("emulate", "tformat", "--memory", f"{self.folder}/mem"),
                         ["compopt -o filenames", f"{self.folder}/memory.txt"])


class Packages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="absenc-package-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        run_tool("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", cls.folder, umask=0o077, timeout=400)
        cls.packages = {path.name.split("_")[0]: path for path in cls.folder.glob("*.deb")}
        for name, package in cls.packages.items():
            run_tool("dpkg-deb", "-x", package, cls.folder / name)
        cls.command = cls.folder / "absenc/usr"
        cls.development = cls.folder / "libabsenc-dev/usr"
        cls.python = cls.folder / "python3-absenc/usr"

    def field(self, package, name):
        return run_tool("dpkg-deb", "-f", self.packages[package], name).strip()

    def depends(self, package):
        return set(re.findall(r"[a-z0-9.+-]+(?= \(|,|$)", self.field(package, "Depends")))

    def test_each_has_its_metadata(self):
        sections = {"absenc": "electronics", "absenc-serve": "electronics", "absenc-hdf5": "electronics",
                    "libabsenc-dev": "libdevel", "python3-absenc": "python"}
        self.assertEqual(set(self.packages), set(sections))
        for name, section in sections.items():
            with self.subTest(name):
                self.assertEqual(self.field(name, "Package"), name)
                self.assertEqual(self.field(name, "Version"), VERSION)
                self.assertEqual(self.field(name, "Section"), section)
                self.assertEqual(self.field(name, "Architecture"), run_tool("dpkg", "--print-architecture").strip())
                self.assertRegex(self.field(name, "Maintainer"), r"^absenc developers <\S+@\S+>$")
                self.assertRegex(self.field(name, "Description"), r"\A[A-Z].+[^.]\n .+")
        self.assertEqual(len({self.field(name, "Description").splitlines()[0] for name in self.packages}), len(sections))

    def test_command_loads_few_libraries(self):
        loaded = [line.split()[0] for line in run_tool("ldd", self.command / "bin/absenc").splitlines()]
        self.assertLessEqual(len(loaded), 20)
        self.assertEqual([name for name in loaded if re.search("hdf5|curl|gnutls|ldap|microhttpd|sqlite|mosquitto", name)], [])

    def test_packages_depend_on_what_they_load(self):
        for package, libraries in {"absenc": ("libc6", "libstdc++6", "libminizip1"),
                                   "absenc-serve": ("libmicrohttpd12", "libmosquitto1", "libsqlite3-0", "absenc"),
                                   "absenc-hdf5": ("libhdf5-103-1", "absenc")}.items():
            for library in libraries:
                self.assertIn(library, self.field(package, "Depends"))
            self.assertEqual({name for name in self.depends(package) if name.endswith("-dev")}, set())
        self.assertNotIn("hdf5", self.field("absenc", "Depends"))

    def test_library_suggests_linked_libraries(self):
        linked = [flag[2:] for name in PKG_CONFIG for flag in pkg_config(self.development, "--libs", name)
                  if flag.startswith("-l") and not flag.startswith("-labsenc")]
        self.assertGreater(len(linked), 3)
        files = [os.path.normpath(run_tool("g++", f"-print-file-name=lib{name}.so").strip()) for name in linked]
        owners = {run_tool("dpkg", "-S", file).split(":")[0] for file in files}
        suggested = set(self.field("libabsenc-dev", "Suggests").split(", "))
        # zlib1g-dev is not suggested, because libminizip-dev depends on it
        self.assertEqual(suggested, owners - {"zlib1g-dev"})
        self.assertEqual(self.field("libabsenc-dev", "Depends"), "")

    def test_each_installed_file_is_in_one_package(self):
        run_tool("cmake", "--install", BUILD, "--prefix", self.folder / "installed")
        installed = files_below(self.folder / "installed") - {"share/doc/absenc/LICENSE", "share/man/man1/absenc.1", *GUIDE}
        own = {f"share/doc/{name}/{file}" for name in self.packages for file in ("copyright", "changelog.gz")}
        overrides = {f"share/lintian/overrides/{path.stem}" for path in (SOURCE / "cmake/debian").glob("*.lintian-overrides")}
        added = {"share/man/man1/absenc.1.gz", *(f"{page}.gz" for page in GUIDE), *own, *overrides}
        held = {name: files_below(self.folder / name / "usr") for name in self.packages}
        self.assertEqual(sum(map(len, held.values())), len(set.union(*held.values())))
        self.assertEqual(set.union(*held.values()), installed | added)
        self.assertIn("lib/python3/dist-packages/absenc/py.typed", held["python3-absenc"])
        files = {name: {path for path in paths if not path.startswith("share/")} for name, paths in held.items()}
        self.assertEqual(files["absenc"], {"bin/absenc", "lib/udev/rules.d/60-absenc-ftdi.rules"})
        self.assertEqual(files["absenc-serve"], {"lib/absenc/absenc-serve", "lib/systemd/system/absenc.service"})
        self.assertEqual(files["absenc-hdf5"], {"lib/absenc/plugins/hdf5.so"})
        self.assertTrue(SERVE_DOCUMENTS < held["absenc-serve"])

    def test_files_belong_to_root_and_are_readable(self):
        for package in self.packages.values():
            for line in run_tool("dpkg-deb", "-c", package).splitlines():
                mode = "-rwxr-xr-x" if line.endswith(("bin/absenc", "/absenc-serve")) else "-rw-r--r--"
                mode = "drwxr-xr-x" if line.endswith("/") else mode
                self.assertTrue(line.startswith(f"{mode} root/root "), line)

    def test_unpacked_command_runs(self):
        self.assertIn("turns", run_tool(self.command / "bin/absenc", "read", "sim:tformat"))

    def test_command_without_its_parts_says_what_to_install(self):
        for arguments, package in ((("serve",), "absenc-serve"),
                                   (("record", "sim:tformat", "--output", self.folder / "x.h5", "--count", "1"), "absenc-hdf5")):
            done = subprocess.run([self.command / "bin/absenc", *arguments], capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn(f"Install the package {package}", done.stderr)
        self.assertIn("--history", run_tool(self.command / "bin/absenc", "serve", "--help"))
        self.assertFalse((self.folder / "x.h5").exists())

    def test_unpacked_module_runs(self):
        for package in ("libc6", "python3", "python3-numpy"):
            self.assertIn(package, self.field("python3-absenc", "Depends"))
        modules = self.python / "lib/python3/dist-packages"
        run_tool("env", f"PYTHONPATH={modules}", "/usr/bin/python3", "-B", "-c",
                 "import absenc; assert absenc.open('sim:tformat').read().valid")

    def test_unpacked_documents_are_complete(self):
        made = self.command / "share"
        self.assertEqual(gzip.decompress((made / "man/man1/absenc.1.gz").read_bytes()),
                         (BUILD / "manual/absenc.1").read_bytes())
        self.assertEqual((made / "bash-completion/completions/absenc").read_bytes(),
                         (BUILD / "manual/absenc").read_bytes())
        for name in self.packages:
            self.assertIn("Apache-2.0", (self.folder / name / f"usr/share/doc/{name}/copyright").read_text())


if __name__ == "__main__":
    unittest.main()
