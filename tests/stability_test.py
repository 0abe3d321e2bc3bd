#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares what other programs rely on with the lists in tests/golden: docs/stability.md has the promises.

A test that fails after an intended change: run it with ABSENC_UPDATE_GOLDEN=1, look at the difference of tests/golden,
and write it into CHANGELOG.md. Text that goes away or changes its meaning is only for the next major version.
"""
import ast
import csv
import io
import json
import os
import re
import tempfile
import unittest
from pathlib import Path

from command_support import absenc

SOURCE = Path(os.environ.get("ABSENC_SOURCE_DIR", Path(__file__).resolve().parent.parent))
GOLDEN = SOURCE / "tests/golden"
CAPTURE = str(SOURCE / "examples/tformat.txt")

# A command line for each verb that prints JSON and ends by itself. The verbs `ports` and `changes` are left out,
# because their output depends on the computer.
JSON_VERBS = {
    "list": ["list", "tformat"],
    "read": ["read", "sim:tformat", "--count", "2"],
    "read, an invalid position": ["read", "sim:tformat?alarm=counting_error", "--count", "1"],
    "read, a failure": ["read", "tformat:tcp:127.0.0.1:1"],
    "info": ["info", "sim:tformat"],
    "alarms": ["alarms", "sim:tformat?alarm=over_heat"],
    "temperature": ["temperature", "sim:esl"],
    "zero": ["zero", "sim:tformat", "--yes"],
    "reset-multiturn": ["reset-multiturn", "sim:tformat", "--yes"],
    "clear-alarms": ["clear-alarms", "sim:tformat", "--yes"],
    "memory read": ["memory", "read", "sim:tformat", "5"],
    "memory write": ["memory", "write", "sim:tformat", "5", "1", "--yes"],
    "config get": ["config", "get", "sim:encolink"],
    "run": ["run", "sim:tformat", "memory-read", "5"],
    "scan": ["scan", "sim:raa38-modbus"],
    "decode": ["decode", "tformat", CAPTURE],
    "encode": ["encode", "tformat", "position"],
    "identify": ["identify", CAPTURE],
    "doctor": ["doctor", "sim:tformat", "--readings", "50"],
    "doctor, a fault": ["doctor", "sim:tformat?fault=corrupt=0.2&seed=1", "--readings", "100"],
    "conform": ["conform", "sim:tformat"],
    "vectors": ["vectors", "tformat"],
}


def shape(value):
    """Returns the types of a JSON value in place of its values; a list has the shapes of its elements, each once."""
    if isinstance(value, dict):
        return {name: shape(one) for name, one in value.items()}
    if isinstance(value, list):
        shapes = []
        for one in map(shape, value):
            if one not in shapes:
                shapes.append(one)
        return shapes
    return {bool: "true or false", int: "number", float: "number", str: "text", type(None): "null"}[type(value)]


def verbs():
    text = absenc("--help").stdout.split("\nVerbs:\n")[1].split("\nAn ")[0]
    return re.findall(r"^  (\S+(?: \S+)?)  ", text, re.MULTILINE)


def declarations(text):
    """Returns the declarations of a C++ header, one a line, without comments and without the bodies of functions."""
    text = re.sub(r'//[^\n]*|/\*.*?\*/|^\s*#[^\n]*', "", text, flags=re.DOTALL | re.MULTILINE)
    lines, statement, skipped = [], "", 0
    private = False
    i = 0
    while i < len(text):
        char = text[i]
        if skipped:
            skipped += {"{": 1, "}": -1}.get(char, 0)
            if not skipped:
                lines.append(statement)
                statement = ""
        elif char == "{":
            words = " ".join(statement.split())
            is_scope = re.match(r"(template\s*<.*>\s*)?(inline )?(namespace|struct|class|union|enum|extern \"C\")\b", words)
            is_function = re.search(r"\)[^()]*$", words) and not is_scope
            if is_function or re.search(r"\[\]|operator", words) and ")" in words:
                skipped = 1
            elif is_scope and not words.startswith("enum"):
                lines.append(words)
                statement = ""
            else:  # the braces are part of a declaration: those of an initializer or an enumeration
                depth, start = 1, i
                while depth:
                    i += 1
                    depth += {"{": 1, "}": -1}.get(text[i], 0)
                statement += text[start:i + 1]
        elif char == "}":
            lines.append("}")
            statement = ""
        elif char == ";":
            lines.append(statement)
            statement = ""
        else:
            statement += char
        i += 1
    result = []
    for line in lines:
        words = " ".join(line.split())
        if re.search(r"\b(private|protected):", words):
            private = True
            words = re.split(r"\b(?:private|protected):", words)[0].strip()
        elif words.startswith("public:"):
            private = False
            words = words.removeprefix("public:").strip()
        elif words == "}" or re.match(r"(template\s*<.*>\s*)?(struct|class)\b", words):
            private = False if words != "}" else private
        if words and not private:
            result.append(words)
        if words == "}":
            private = False
    return [line for line in result if line != "}"]


def python_declarations():
    """Returns the public classes and functions of the Python package with their signatures."""
    found = []
    for path in sorted((SOURCE / "python/absenc").glob("*.py*")):
        if path.name == "py.typed" or path.name.startswith("_") and path.name not in ("__init__.py", "_absenc.pyi"):
            continue
        for node in ast.parse(path.read_text()).body:
            found += signatures(node, path.stem)
    return found


def signatures(node, scope):
    name = getattr(node, "name", "")
    if name.startswith("_") and not name.startswith("__"):
        return []
    if isinstance(node, ast.ClassDef):
        bases = ", ".join(map(ast.unparse, node.bases))
        return [f"{scope}.{name}({bases})"] + [one for child in node.body for one in signatures(child, f"{scope}.{name}")]
    if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
        result = f" -> {ast.unparse(node.returns)}" if node.returns else ""
        is_property = "" if not any(ast.unparse(one) == "property" for one in node.decorator_list) else " property"
        return [f"{scope}.{name}({ast.unparse(node.args)}){result}{is_property}"]
    if isinstance(node, ast.AnnAssign) and not ast.unparse(node.target).startswith("_"):
        return [f"{scope}.{ast.unparse(node.target)}: {ast.unparse(node.annotation)}"]
    return []


class Stable(unittest.TestCase):
    maxDiff = 4000

    def compare(self, name, text):
        path = GOLDEN / name
        if os.environ.get("ABSENC_UPDATE_GOLDEN"):
            GOLDEN.mkdir(exist_ok=True)
            path.write_text(text)
        self.assertMultiLineEqual(path.read_text(), text)

    def test_command_line(self):
        lines = []
        for verb in verbs():
            help_text = absenc(*verb.split(), "--help").stdout
            lines.append(re.search(r"^Usage: (.+)$", help_text, re.MULTILINE)[1])
            lines += [f"  {option}" for option in re.findall(r"^  (--\S+(?: [A-Z][A-Z:.]*)?)", help_text.split("\nOptions:\n")[1],
                                                             re.MULTILINE)]
        status = re.search(r"^Exit status: .+(?:\n.+)*", absenc("--help").stdout, re.MULTILINE)[0]
        self.compare("command-line.txt", "\n".join([*lines, status]) + "\n")

    def test_json_of_each_verb(self):
        takes_json = {verb for verb in verbs() if "  --json" in absenc(*verb.split(), "--help").stdout}
        # The verbs monitor, tap and conform-host wait for a line; campaign and bench run long; the output of ports and
        # changes depends on the computer; the other verbs need files, which their own tests make.
        elsewhere = {"monitor", "tap", "conform-host", "campaign", "bench", "ports", "changes", "probe", "crc find",
                     "memory load", "memory verify", "config set"}
        self.assertEqual({name.split(",")[0] for name in JSON_VERBS}, takes_json - elsewhere)
        shapes = {}
        for name, words in JSON_VERBS.items():
            done = absenc(*words, "--json")
            seen = []
            for line in done.stdout.splitlines():
                one = shape(json.loads(line))
                if one not in seen:
                    seen.append(one)
            self.assertTrue(seen, f"{words}: {done.stderr}")
            shapes[name] = seen
        self.compare("verbs.json", json.dumps(shapes, indent=1) + "\n")

    def test_csv_columns(self):
        columns = {}
        with tempfile.TemporaryDirectory() as folder:
            for unit in ("tformat", "esl", "biss"):
                path = f"{folder}/{unit}.csv"
                absenc("record", f"sim:{unit}", "--output", path, "--count", "2")
                lines = Path(path).read_text().splitlines()
                columns[f"record {unit}"] = next(csv.reader([line for line in lines if not line.startswith("#")][:1]))
                columns[f"record {unit}, header"] = [line.split(":")[0].split("=")[0] for line in lines if line.startswith("#")]
        decoded = absenc("decode", "tformat", CAPTURE, "--csv").stdout
        columns["decode tformat"] = next(csv.reader(io.StringIO(decoded)))
        self.compare("csv.json", json.dumps(columns, indent=1) + "\n")

    def test_http_api(self):
        api = json.loads((SOURCE / "absenc/serve/page/openapi.json").read_text())

        def without_words(value):
            if isinstance(value, dict):
                return {name: without_words(one) for name, one in value.items() if name not in ("description", "summary", "example")
                        or not isinstance(one, str)}
            return [without_words(one) for one in value] if isinstance(value, list) else value

        kept = {name: without_words(api[name]) for name in ("paths", "components")}
        self.compare("http.json", json.dumps(kept, indent=1, sort_keys=True) + "\n")

    def test_cpp_declarations(self):
        headers = sorted(path for pattern in ("client/*.hpp", "host/*.hpp", "protocol/*.hpp", "os/error.hpp", "os/ftdi.hpp",
                                                          "os/gpio.hpp")
                         for path in (SOURCE / "absenc").glob(pattern) if "test" not in path.name)
        self.assertGreater(len(headers), 40)
        lines = []
        for path in headers:
            lines += [str(path.relative_to(SOURCE)), *(f"  {line}" for line in declarations(path.read_text()))]
        self.compare("cpp.txt", "\n".join(lines) + "\n")

    def test_python_declarations(self):
        self.compare("python.txt", "\n".join(python_declarations()) + "\n")

    def test_one_version(self):
        version = (SOURCE / "VERSION").read_text().strip()
        self.assertRegex(version, r"^\d+\.\d+\.\d+$")
        self.assertEqual(absenc("--version").stdout.splitlines()[0], f"absenc {version}")
        for path, pattern in (("library.json", r'"version": "(.+)"'), ("idf_component.yml", r'^version: "(.+)"'),
                              ("packages/arduino/library.properties", r"^version=(.+)")):
            self.assertEqual(re.search(pattern, (SOURCE / path).read_text(), re.MULTILINE)[1], version, path)
        self.assertIn(f"## {version}", (SOURCE / "CHANGELOG.md").read_text())


class Declarations(unittest.TestCase):
    def test_a_change_of_a_declaration_shows(self):
        header = """
// a comment
#include <x>
namespace a {
/// Says.
class One {
 public:
  int get(int value = 1) const { return value_ + value; }
  struct Inner { int x = 0; };
 private:
  int value_{};
};
enum class Two { a, b };
inline constexpr int three = 3;
}
"""
        expected = ["namespace a", "class One", "int get(int value = 1) const", "struct Inner", "int x = 0",
                    "enum class Two { a, b }", "inline constexpr int three = 3"]
        self.assertEqual(declarations(header), expected)
        self.assertNotEqual(declarations(header.replace("int get(int value = 1)", "int get(long value = 1)")), expected)
        self.assertEqual(declarations(header.replace("return value_ + value", "return value")), expected)


if __name__ == "__main__":
    unittest.main()
