#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes the C++ source that holds files of the page: embed_page.py OUTPUT FILE..."""
import sys
from pathlib import Path

TYPES = {".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".json": "application/json",
         ".svg": "image/svg+xml"}


def main(output, *files):
    arrays, entries = [], []
    for number, file in enumerate(map(Path, files)):
        numbers = ",".join(map(str, file.read_bytes()))
        arrays.append(f"constexpr unsigned char content_{number}[] = {{{numbers}}};")
        path = "/" if file.name == "index.html" else "/" + file.name
        entries.append(f'    {{"{path}", "{TYPES[file.suffix]}; charset=utf-8", '
                       f"{{reinterpret_cast<const char*>(content_{number}), sizeof content_{number}}}}},")
    text = "\n".join([
        "// Made by cmake/embed_page.py.", '#include "absenc/serve/assets.hpp"', "", "namespace absenc::serve {", "",
        "namespace {", "", *arrays, "", "}  // namespace", "", "std::span<const Asset> assets() {",
        "  static const Asset all[] = {", *entries, "  };", "  return all;", "}", "", "}  // namespace absenc::serve", ""])
    Path(output).write_text(text, encoding="ascii")


if __name__ == "__main__":
    main(*sys.argv[1:])
