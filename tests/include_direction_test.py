#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the layers of include lines, circles within client, and types in public headers."""

import graphlib
import os
import re
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ.get("ABSENC_SOURCE_DIR", Path(__file__).resolve().parent.parent))

# Maps each layer to the layers that its files may include, besides its own.
BELOW = {
    "core": set(),
    "link": {"core"},
    "protocol": {"core", "link"},
    "host": {"core", "link", "protocol"},
    "sim": {"core", "link", "protocol"},
    "capture": {"core", "link", "protocol"},
    "os": {"core", "link"},
    "client": {"core", "link", "protocol", "host", "sim", "capture", "os"},
    "serve": {"core", "link", "protocol", "host", "sim", "os", "client"},
}
FREESTANDING = {"core", "link", "protocol", "host"}
FREESTANDING_HEADERS = set(
    """algorithm array bit bits/chrono.h cfloat chrono climits compare concepts coroutine cstddef cstdint cstring initializer_list iterator
    limits new numbers numeric optional ratio span string_view tuple type_traits utility version""".split()
)
# Folders of absenc/os for one system each. Only they include headers of that system.
SYSTEMS = ("linux", "windows")
# Layers in which every header is public.
WHOLLY_PUBLIC = {"core", "link", "protocol", "host", "sim"}
PUBLIC_IN_OS = {Path("absenc/os") / name for name in ("error.hpp", "ftdi.hpp", "gpio.hpp")}
# Headers of other libraries that take long to compile.
HEAVY = ("CLI/", "toml++/", "nlohmann/", "microhttpd.h", "sqlite3.h", "mosquitto.h")
LIGHT = {"nlohmann/json_fwd.hpp"}
OS_HEADER = re.compile(
    r"^(sys|linux|asm|asm-generic|net|netinet|arpa|fuse3)/|"
    r"^(unistd|fcntl|termios|poll|pty|utmp|pwd|grp|netdb|dirent|gpiod|spawn|sched|pthread|signal|dlfcn|ifaddrs|"
    r"windows|winsock2|ws2tcpip|io|shellapi|setupapi|devguid)\.h(pp)?$"
)
# A condition that asks on which system the code is compiled. Only files in absenc/os may ask.
ASKS_FOR_SYSTEM = re.compile(
    r"^\s*#\s*(?:if|ifdef|ifndef|elif)\b.*\b(_WIN32|_WIN64|__MINGW32__|__MINGW64__|__linux__|__unix__)\b", re.MULTILINE
)
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.MULTILINE)
# The patterns rely on clang-format, which puts types at namespace scope at the beginning of a line.
NAMESPACE = re.compile(r"^namespace ([\w:]+) \{", re.MULTILINE)
DECLARED = re.compile(r"^(?: +friend )?(?:class|struct|union|enum class|enum) (\w+)(?: : [\w:]+)?;", re.MULTILINE)
DEFINED = re.compile(r"^(?:class|struct|union|enum class|enum) (\w+)[^;{()]*\{", re.MULTILINE)
BUILT_ON = re.compile(r"^Built on: *(.+)$", re.MULTILINE)


def is_test(path):
    return re.search(r"_(test|fuzz|bench)\.[ch]pp$", path.name) or path.name.startswith("test_")


def unit_of(path):
    """Returns the protocol unit of a file, such as "tformat", or None."""
    is_unit = path.parts[:2] == ("absenc", "protocol") and len(path.parts) > 3 and path.parts[2] != "author"
    return path.parts[2] if is_unit else None


def system_of(path):
    """Returns the system to which a file in absenc/os belongs, such as "linux", or None."""
    return path.parts[2] if path.parts[:2] == ("absenc", "os") and path.parts[2] in SYSTEMS else None


def built_on(root, unit):
    readme = root / "absenc" / "protocol" / unit / "README.md"
    match = BUILT_ON.search(readme.read_text(encoding="utf-8")) if readme.exists() else None
    return set(re.findall(r"[a-z0-9_]+", match.group(1))) if match else set()


def is_public(path):
    """Returns whether the header is public, by the same rule as absenc_public in CMakeLists.txt."""
    if path.suffix != ".hpp" or path.parts[0] != "absenc" or is_test(path):
        return False
    in_client = path.parts[1] == "client" and len(path.parts) == 3
    return path.parts[1] in WHOLLY_PUBLIC or in_client or path in PUBLIC_IN_OS


def layer_fault(root, path, target):
    """Returns why the file must not include the project's header `target`, or None."""
    layer = path.parts[1] if path.parts[0] == "absenc" else path.parts[0]
    if not (root / target).is_file():
        return "is no path from the repository root"
    if target.parts[0] != "absenc":
        return None if target.parts[0] == path.parts[0] or is_test(path) else f"is not for {layer}"
    if is_test(path) or path.parts[0] in ("tests", "bench", "examples"):
        return None
    if is_test(target):
        return "is only for tests"
    if system_of(target) and system_of(target) != system_of(path):
        return f"is only for absenc/os/{system_of(target)}"
    unit, other = unit_of(path), unit_of(target)
    if other and other != unit:
        if unit is None:
            return "names a unit: go through absenc/protocol/all.hpp"
        if other not in built_on(root, unit):
            return f'is another unit: say "Built on: {other}" in the README.md of {unit}'
    if layer in BELOW and target.parts[1] not in BELOW[layer] | {layer}:
        return f"is not below {layer}"
    return "is internal, for no public header" if is_public(path) and not is_public(target) else None


def system_fault(path, header):
    """Returns the reason why the file at `path` must not include <header>, or None."""
    in_absenc = path.parts[0] == "absenc"
    if in_absenc and path.parts[1] in FREESTANDING and not is_test(path):
        return None if header in FREESTANDING_HEADERS else "is not a freestanding header"
    if is_public(path) and re.search(r"[/.]", header):
        return "is no header of C++: not for a public header"
    of_system = system_of(path) or path.parts[0] == "bench" or path.parts[:2] in (("tests", "vm"), ("tests", "emulated"))
    return "belongs into a folder of absenc/os" if OS_HEADER.search(header) and not of_system else None


def client_circles(root):
    """Returns circles of folders of client that include each other."""
    client = Path("absenc/client")
    included = {}
    for file in sorted((root / client).rglob("*.[ch]pp")):
        folder = file.relative_to(root).parent
        if is_test(file) or folder == client:
            continue
        for bracket, name in INCLUDE.findall(file.read_text(encoding="utf-8")):
            other = Path(name).parent
            if bracket == '"' and client in other.parents and other != folder:
                included.setdefault(folder.name, set()).add(other.name)
    try:
        tuple(graphlib.TopologicalSorter(included).static_order())
    except graphlib.CycleError as error:
        return [" -> ".join(reversed(error.args[1])) + ": folders of client that include each other"]
    return []


def names_with_namespace(pattern, text):
    """Yields the qualified names of types, such as "absenc::client::Encoder"."""
    namespaces = [(match.start(), match[1]) for match in NAMESPACE.finditer(text)]
    for match in pattern.finditer(text):
        before = [name for start, name in namespaces if start < match.start()]
        yield "::".join(before[-1:] + [match[1]])


def hidden_types(root):
    """Returns texts about types that public headers declare but do not define."""
    headers = [path for path in sorted((root / "absenc").rglob("*.hpp")) if is_public(path.relative_to(root))]
    texts = {path.relative_to(root): path.read_text(encoding="utf-8") for path in headers}
    defined = {name for text in texts.values() for name in names_with_namespace(DEFINED, text)}
    return [
        f"{path}: {name} is defined in no public header"
        for path, text in texts.items()
        for name in names_with_namespace(DECLARED, text)
        if name not in defined
    ]


def faults(root):
    found = client_circles(root) + hidden_types(root)
    heavy = {}
    for top in ("absenc", "tools", "tests", "bench", "examples"):
        for file in sorted((root / top).rglob("*.[ch]pp")):
            path = file.relative_to(root)
            asks = ASKS_FOR_SYSTEM.search(file.read_text(encoding="utf-8"))
            if asks and path.parts[0] in ("absenc", "tools") and path.parts[:2] != ("absenc", "os"):
                found.append(f"{path}: {asks[1]}: only files in absenc/os may ask for the system")
            for bracket, name in INCLUDE.findall(file.read_text(encoding="utf-8")):
                fault = layer_fault(root, path, Path(name)) if bracket == '"' else system_fault(path, name)
                if bracket == "<" and name.startswith("absenc/"):
                    fault = "is ours: write it in quotes"
                if fault:
                    found.append(f"{path}: {name} {fault}")
                if name.startswith(HEAVY) and name not in LIGHT:
                    heavy.setdefault(name.split("/")[0], set()).add(path)
    for library, paths in heavy.items():
        if len(paths) > 1 or any(path.suffix == ".hpp" for path in paths):
            found.append(f"{library}: to be included by one .cpp only, not by {', '.join(sorted(map(str, paths)))}")
    return found


class IncludeDirection(unittest.TestCase):
    def test_sources_have_no_fault(self):
        self.assertTrue((SOURCE / "absenc" / "core").is_dir(), SOURCE)
        self.assertEqual(faults(SOURCE), [])


class SelfTest(unittest.TestCase):
    """Tests the checks of this file on small trees."""

    GOOD = {
        "absenc/core/bits.hpp": "#include <cstdint>\n",
        "absenc/link/step.hpp": '#include "absenc/core/bits.hpp"\n',
        "absenc/protocol/unit.hpp": '#include "absenc/link/step.hpp"\n',
        "absenc/protocol/all.hpp": '#include "absenc/protocol/unit.hpp"\n',
        "absenc/protocol/all.cpp": '#include "absenc/protocol/all.hpp"\n',
        "absenc/protocol/one/unit.hpp": '#include "absenc/protocol/unit.hpp"\n',
        "absenc/protocol/one/one_test.cpp": '#include <vector>\n#include "absenc/sim/line.hpp"\n',
        "absenc/protocol/one/test_line.hpp": '#include "absenc/sim/line.hpp"\n',
        "absenc/protocol/two/README.md": "Two.\n\nBuilt on: one\n",
        "absenc/protocol/two/unit.hpp": '#include "absenc/protocol/one/unit.hpp"\n',
        "absenc/host/drive.hpp": '#include "absenc/link/step.hpp"\n',
        "absenc/sim/line.hpp": '#include <vector>\n#include "absenc/link/step.hpp"\n',
        "absenc/os/error.hpp": '#include <string>\n#include "absenc/core/bits.hpp"\n',
        "absenc/os/serial.hpp": '#include "absenc/os/error.hpp"\n',
        "absenc/os/linux/sys_file.hpp": '#include <sys/stat.h>\n#include "absenc/os/error.hpp"\n',
        "absenc/capture/open.hpp": "",
        "absenc/client/encoder.hpp": '#include "absenc/client/row.hpp"\n#include "absenc/sim/line.hpp"\n',
        "absenc/client/row.hpp": '#include "absenc/os/error.hpp"\nnamespace absenc::client {\nclass Row {};\n}\n',
        "absenc/client/memory.hpp": "namespace absenc::client {\nclass Row;\nclass Memory {\n  struct Parts;\n};\n}\n",
        "absenc/client/text/row.cpp": '#include <fmt/core.h>\n#include "absenc/client/text/rows.hpp"\n',
        "absenc/client/text/rows.hpp": '#include "absenc/capture/open.hpp"\n#include "absenc/os/serial.hpp"\n',
        "absenc/client/captures/run.hpp": '#include "absenc/client/text/rows.hpp"\n',
        "absenc/client/tap/run.hpp": '#include "absenc/client/captures/run.hpp"\n',
        "absenc/serve/http.hpp": '#include "absenc/client/text/rows.hpp"\n',
        "absenc/serve/http.cpp": "#include <microhttpd.h>\n",
        "absenc/os/windows/serial.cpp": "#ifdef _WIN32\n#include <windows.h>\n#endif\n",
        "absenc/os/linux/serial.cpp": '#include <sys/ioctl.h>\n#include "absenc/os/linux/sys_file.hpp"\n',
        "tools/absenc/main.cpp": '#include <CLI/CLI.hpp>\n#include "absenc/protocol/all.hpp"\n',
        "tools/absenc/text.hpp": "#include <string>\n",
    }

    def faults_with(self, path, line):
        with tempfile.TemporaryDirectory() as folder:
            for name, text in self.GOOD.items():
                file = Path(folder, name)
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text + (line + "\n" if name == path else ""), encoding="utf-8")
            return faults(Path(folder))

    def test_accepts_correct_tree(self):
        self.assertEqual(self.faults_with(None, ""), [])

    def test_finds_each_wrong_line(self):
        for path, line in (
            ("absenc/core/bits.hpp", '#include "absenc/link/step.hpp"'),
            ("absenc/core/bits.hpp", "#include <string>"),
            ("absenc/client/row.hpp", "#ifdef _WIN32"),
            ("tools/absenc/text.hpp", "#if defined(__linux__) && 1"),
            ("absenc/os/linux/serial.cpp", '#include "absenc/os/windows/handle.hpp"'),
            ("absenc/os/serial.hpp", "#include <windows.h>"),
            ("absenc/core/bits.hpp", "  #  include <vector>"),
            ("absenc/core/bits.hpp", "#include <absenc/core/bits.hpp>"),
            ("absenc/core/bits.hpp", '#include "bits.hpp"'),
            ("absenc/core/bits.hpp", '#include "tools/absenc/text.hpp"'),
            ("absenc/link/step.hpp", '#include "absenc/protocol/unit.hpp"'),
            ("absenc/protocol/unit.hpp", '#include "absenc/protocol/one/unit.hpp"'),
            ("absenc/protocol/all.cpp", '#include "absenc/protocol/one/unit.hpp"'),
            ("absenc/protocol/unit.hpp", '#include "absenc/host/drive.hpp"'),
            ("absenc/protocol/one/unit.hpp", '#include "absenc/protocol/two/unit.hpp"'),
            ("absenc/protocol/one/unit.hpp", '#include "absenc/protocol/one/test_line.hpp"'),
            ("absenc/protocol/one/unit.hpp", '#include "absenc/sim/line.hpp"'),
            ("absenc/protocol/one/one_test.cpp", "#include <termios.h>"),
            ("absenc/host/drive.hpp", "#include <functional>"),
            ("absenc/host/drive.hpp", '#include "absenc/protocol/one/unit.hpp"'),
            ("absenc/sim/line.hpp", '#include "absenc/host/drive.hpp"'),
            ("absenc/sim/line.hpp", '#include "absenc/os/none.hpp"'),
            ("absenc/sim/line.hpp", "#include <unistd.h>"),
            ("absenc/os/linux/serial.cpp", '#include "absenc/protocol/unit.hpp"'),
            ("absenc/os/serial.hpp", "#include <poll.h>"),
            ("absenc/os/serial.hpp", '#include "absenc/os/linux/sys_file.hpp"'),
            ("absenc/client/text/row.cpp", '#include "absenc/os/linux/sys_file.hpp"'),
            ("absenc/os/error.hpp", '#include "absenc/os/serial.hpp"'),
            ("absenc/client/encoder.hpp", '#include "absenc/client/text/rows.hpp"'),
            ("absenc/client/encoder.hpp", '#include "absenc/capture/open.hpp"'),
            ("absenc/client/encoder.hpp", '#include "absenc/os/serial.hpp"'),
            ("absenc/client/encoder.hpp", "#include <fmt/core.h>"),
            ("absenc/client/memory.hpp", "class Connection;"),
            ("absenc/client/memory.hpp", "struct Connection;"),
            ("absenc/client/memory.hpp", "enum class Place : std::uint8_t;"),
            ("absenc/client/memory.hpp", "class Memory {\n  friend struct Connection;\n};"),
            ("absenc/sim/line.hpp", "namespace absenc::sim {\nclass Row;\n}"),
            ("absenc/client/encoder.hpp", "#include <poll.h>"),
            ("absenc/client/text/row.cpp", '#include "absenc/protocol/one/unit.hpp"'),
            ("absenc/client/text/row.cpp", '#include "absenc/serve/http.hpp"'),
            ("absenc/client/captures/run.hpp", '#include "absenc/client/tap/run.hpp"'),
            ("absenc/client/text/rows.hpp", '#include "absenc/client/tap/run.hpp"'),
            ("absenc/serve/http.hpp", '#include "absenc/capture/open.hpp"'),
            ("absenc/serve/http.hpp", "#include <microhttpd.h>"),
            ("tools/absenc/main.cpp", '#include "absenc/protocol/one/unit.hpp"'),
            ("tools/absenc/main.cpp", "#include <linux/spi/spidev.h>"),
            ("tools/absenc/main.cpp", "#include <fuse3/cuse_lowlevel.h>"),
            ("tools/absenc/text.hpp", "#include <CLI/CLI.hpp>"),
            ("tools/absenc/text.hpp", "#include <nlohmann/json.hpp>"),
        ):
            with self.subTest(path=path, line=line):
                self.assertEqual(len(self.faults_with(path, line)), 1, self.faults_with(path, line))


if __name__ == "__main__":
    unittest.main()
