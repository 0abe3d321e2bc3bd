#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Begins a protocol unit: copies docs/protocol-template, and lists the new unit in all.cpp."""

import argparse
import re
import sys
from pathlib import Path

PLACEHOLDER = "protocol_name"
# Names that a protocol must not have: they belong to other libraries, test programs and namespaces.
RESERVED = {"absenc", "author", "base", "capture", "client", "command", "core", "cuse", "host", "kit", "link", "manual", "os",
            "protocol", "python", "serve", "sim", "test", "unit", "units"}


def list_unit(text, name):
    """Returns the text of all.cpp with a line for the unit `name` at the end of the list."""
    last = [*re.finditer(r"^  one\(\w+, \w+\) \\\n", text, re.MULTILINE)][-1]
    return f"{text[:last.end()]}  one({name}, unit) \\\n{text[last.end():]}"


def main():
    parser = argparse.ArgumentParser(prog="./dev new-protocol", description="Begins a protocol unit from the template.")
    parser.add_argument("name", help="lower case letters, digits and _: the folder and the namespace")
    parser.add_argument("--root", type=Path, default=Path(__file__).resolve().parent.parent, help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    name, root = arguments.name, arguments.root
    template = root / "docs" / "protocol-template"
    folder = root / "absenc" / "protocol" / name
    all_cpp = root / "absenc" / "protocol" / "all.cpp"

    if not re.fullmatch(r"[a-z][a-z0-9]*(_[a-z0-9]+)*", name) or name in RESERVED:
        parser.error(f'"{name}" cannot be a name: lower case letters, digits and single _, beginning with a letter')
    if folder.exists():
        sys.exit(f"new-protocol: absenc/protocol/{name} is already there")
    if not template.is_dir():
        sys.exit("new-protocol: docs/protocol-template is missing")

    listed = list_unit(all_cpp.read_text(encoding="utf-8"), name)
    folder.mkdir()
    for source in sorted(template.iterdir()):
        target = folder / source.name.replace(PLACEHOLDER, name)
        target.write_text(source.read_text(encoding="utf-8").replace(PLACEHOLDER, name), encoding="utf-8")
        print(f"absenc/protocol/{name}/{target.name}")
    all_cpp.write_text(listed, encoding="utf-8")
    print("absenc/protocol/all.cpp: one line more")
    print(f"Next: ./dev unit {name} tries it, and fails until no text of the invented encoder is left; docs/write-a-unit.md "
          "says in which order to write it.")


if __name__ == "__main__":
    main()
