#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One quantity has one name: in JSON, CSV, recordings of each format, and samples of Python."""
import csv
import json
import os
import sys
import unittest

from command_support import Case, absenc, json_lines
from python_support import PACKAGE

sys.path.insert(0, str(PACKAGE))
import absenc as library  # noqa: E402 - from the build, not from the system

# Of a row, not of the encoder.
ONLY_IN_ROWS = {"event", "missed"}
# Of the line.
ONLY_IN_JSON = {"protocol", "ok", "event"}


def header(text):
    return next(csv.reader(line for line in text.splitlines() if not line.startswith("#")))


class Keys(Case):
    def everyone(self):
        for line in absenc("list", "--json").stdout.splitlines():
            yield json.loads(line)

    def recorded(self, encoder, suffix):
        path = self.file(f"{len(os.listdir(self.directory))}.{suffix}")
        result = absenc("record", encoder, "--count", "3", "--rate", "200", "--output", path)
        self.assertEqual(result.returncode, 0, result.stderr)
        return path

    def test_words_of_every_protocol(self):
        count = 0
        for one in self.everyone():
            encoder = "sim:" + one["protocol"]
            with self.subTest(encoder):
                self.compare(encoder)
            count += 1
        self.assertGreater(count, 10)

    def compare(self, encoder):
        read = json_lines(absenc("read", encoder, "--count", "3", "--rate", "200", "--json").stdout)
        json_keys = {key for line in read for key in line}
        shown = header(absenc("read", encoder, "--count", "1", "--csv").stdout)
        path = self.recorded(encoder, "csv")
        with open(path, encoding="utf-8") as file:
            columns = header(file.read())
        # A recording has what read shows, in the same order, and speed and losses behind it.
        self.assertEqual([name for name in columns if name in shown], shown)
        with open(self.recorded(encoder, "jsonl"), encoding="utf-8") as file:
            lines = [json.loads(line) for line in file]
        for line in lines:
            if "time_s" in line and "angle_deg" in line:
                self.assertLessEqual(set(line), set(columns) | json_keys)
        for suffix in ("csv", "jsonl", "h5"):
            self.assertEqual(list(library.load(self.recorded(encoder, suffix)).keys()), columns, suffix)

        # Python: what moves with the shaft is of the sample, what was on the wire of its reading.
        with library.open(encoder) as opened:
            sample = next(iter(opened.samples(rate=200)))
        for name in set(columns) - ONLY_IN_ROWS:
            of_channel = name.endswith(("_status", "_alarms"))  # flags and alarms are lists that name their channel
            if not of_channel:
                self.assertTrue(hasattr(sample, name) or hasattr(sample.reading, name), name)
        for name in json_keys - ONLY_IN_JSON:
            if not name.endswith(("_status", "_alarms")):
                self.assertTrue(hasattr(sample, name) or hasattr(sample.reading, name), name)


if __name__ == "__main__":
    unittest.main()
