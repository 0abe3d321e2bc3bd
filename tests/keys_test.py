#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests that a quantity has the same name in JSON, CSV, recordings and the Python package."""
import csv
import json
import os
import sys
import unittest

from command_support import Case, absenc, json_lines
from python_support import PACKAGE

sys.path.insert(0, str(PACKAGE))
import absenc as library  # noqa: E402 - the Python module of this build, not an installed one

# Columns of a recording that describe the row, not the encoder's reading.
ONLY_IN_ROWS = {"event", "missed"}
# Keys that describe the line of JSON, not the encoder's reading.
ONLY_IN_JSON = {"protocol", "ok", "event"}


def header(text):
    return next(csv.reader(line for line in text.splitlines() if not line.startswith("#")))


class Keys(Case):
    def recorded(self, encoder, suffix):
        path = self.file(f"{len(os.listdir(self.directory))}.{suffix}")
        result = absenc("record", encoder, "--count", "3", "--rate", "200", "--output", path)
        self.assertEqual(result.returncode, 0, result.stderr)
        return path

    def test_names_agree_for_every_protocol(self):
        protocols = [one["protocol"] for one in json_lines(absenc("list", "--json").stdout)]
        self.assertGreater(len(protocols), 10)
        for protocol in protocols:
            with self.subTest(protocol):
                self.compare(f"sim:{protocol}")

    def compare(self, encoder):
        read = json_lines(absenc("read", encoder, "--count", "3", "--rate", "200", "--json").stdout)
        json_keys = {key for line in read for key in line}
        shown = header(absenc("read", encoder, "--count", "1", "--csv").stdout)
        with open(self.recorded(encoder, "csv"), encoding="utf-8") as file:
            columns = header(file.read())
        # A recording has the columns of `read` in the same order, and further columns.
        self.assertEqual([name for name in columns if name in shown], shown)
        with open(self.recorded(encoder, "jsonl"), encoding="utf-8") as file:
            # A row whose `ok` is missing or false is no reading.
            rows = [row for row in map(json.loads, file) if row.get("ok")]
        self.assertEqual(len(rows), 3)
        computed = set(columns) - set(shown) - ONLY_IN_ROWS
        for row in rows:
            self.assertEqual(set(row) - {"event"}, json_keys - {"event"} | computed)
        for suffix in ("csv", "jsonl", "h5"):
            self.assertEqual(list(library.load(self.recorded(encoder, suffix)).keys()), columns, suffix)

        # A reading in Python has all its flags in the members `status` and `alarms`, so a column with the flags of one
        # channel has no member of its own.
        with library.open(encoder) as opened:
            sample = next(iter(opened.samples(rate=200)))
        for name in set(columns) - ONLY_IN_ROWS | json_keys - ONLY_IN_JSON:
            if not name.endswith(("_status", "_alarms")):
                self.assertTrue(hasattr(sample, name) or hasattr(sample.reading, name), name)


if __name__ == "__main__":
    unittest.main()
