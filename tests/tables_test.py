#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests tables of the documents that have rows for protocols; `./dev tables` writes them."""

import json
import os
import re
import subprocess
import unittest
from pathlib import Path

ABSENC = os.environ["ABSENC"]
SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
UPDATE = "ABSENC_UPDATE_DOCS" in os.environ


def absenc(*arguments):
    done = subprocess.run([ABSENC, *arguments], stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=300)
    return done.stdout


def units():
    """Returns what `absenc list --json` says about each protocol."""
    return [json.loads(line) for line in absenc("list", "--json").splitlines()]


def families():
    """Returns the rows of the table of families: folder, title, lines of its protocols."""
    listed = [line for line in absenc("list").split("\n\n")[0].splitlines()[1:]]
    lines = {}
    for line in listed:
        lines.setdefault(line.split()[0], {})[re.split(r"  +", line)[-1]] = None
    folders = {}
    entries = re.findall(r"^  one\((\w+), \w+\)", (SOURCE / "absenc/protocol/all.cpp").read_text(encoding="utf-8"), re.MULTILINE)
    for folder, unit in zip(entries, units(), strict=True):
        folders.setdefault(folder, []).append(unit["protocol"])
    rows = []
    for folder, names in folders.items():
        title = (SOURCE / f"absenc/protocol/{folder}/README.md").read_text(encoding="utf-8").splitlines()[0].partition(": ")[2]
        kinds = dict.fromkeys(kind for name in names for kind in lines[name])
        linked = ", ".join(f"`{name}`" for name in names)
        rows.append(f"| [{linked}](absenc/protocol/{folder}/README.md) | {title} | {'; '.join(kinds)} |")
    return rows


def clauses():
    """Returns the rows of the table of clauses."""
    rows = []
    for unit in units():
        reading, both = (
            len(json.loads(absenc("conform", f"sim:{unit['protocol']}", "--json", "--readings", "1", *more) or '{"clauses": []}')["clauses"])
            for more in ((), ("--changes", "--yes")))
        cells = [unit["protocol"], *(str(number or "") for number in (both, both - reading, len(unit["clauses"]["host"])))]
        rows.append(re.sub(" +", " ", "| " + " | ".join(cells) + " |"))
    return rows


def words(row):
    """Returns the row without the spaces that align its columns."""
    return " ".join(row.split())


class Tables(unittest.TestCase):
    maxDiff = None

    def check(self, page, name, rows):
        """Compares rows of a page with what they should be, or writes them if UPDATE is set."""
        path = SOURCE / page
        text = path.read_text(encoding="utf-8")
        table = re.compile(rf"(<!-- {name} -->\n(?:```\n|\|.*\n\|[-|]+\n))(.*?)((?:```\n)?<!-- end -->)", re.DOTALL)
        shown = table.search(text)
        self.assertTrue(shown, f"{page} has no table {name}")
        if UPDATE:
            path.write_text(table.sub(lambda found: found[1] + "".join(f"{row}\n" for row in rows) + found[3], text), encoding="utf-8")
            return
        true = {words(row) for row in rows}
        false = [row for row in shown[2].splitlines() if words(row) not in true]
        self.assertEqual(false, [], f"{page} says this, which is not so any more: ./dev tables writes its tables anew")
        self.assertTrue(shown[2])

    def test_families_in_readme(self):
        self.check("README.md", "families", families())

    def test_models(self):
        self.check("docs/encoders.md", "models", absenc("list").split("\n\n")[0].splitlines())

    def test_clauses(self):
        self.check("docs/test-a-drive.md", "clauses", clauses())


if __name__ == "__main__":
    unittest.main()
