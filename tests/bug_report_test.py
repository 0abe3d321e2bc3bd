#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests the report of `absenc doctor --report`, and `absenc decode` of it."""
import json
import subprocess
import tempfile
import unittest
import zipfile
from pathlib import Path

from command_support import ABSENC, absenc


class BugReport(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.path = Path(scratch.name) / "bug.zip"

    def report(self, encoder, *options):
        done = absenc("doctor", encoder, "--readings", "60", "--report", str(self.path), "--force", *options)
        self.assertTrue(self.path.is_file(), done.stderr)
        with zipfile.ZipFile(self.path) as archive:
            return done, {name: archive.read(name).decode() for name in archive.namelist()}

    def test_holds_version_settings_findings_and_exchanges(self):
        done, files = self.report("sim:tformat?fault=corrupt=0.2&seed=1")
        self.assertEqual(set(files), {"report.txt", "doctor.json", "exchanges.txt"})
        summary = files["report.txt"]
        self.assertTrue(summary.startswith("absenc report 1\n"))
        self.assertIn(absenc("--version").stdout, summary)
        self.assertIn("encoder_id = 0x11", summary)
        self.assertIn("damaged_bits", summary)
        self.assertEqual(json.loads(files["doctor.json"])["findings"][0]["id"], "damaged_bits")
        lines = [line for line in files["exchanges.txt"].splitlines() if line[0].isdigit()]
        self.assertEqual(len(lines), 60)
        for line in lines:
            time, request, reply, after = line.split()
            self.assertEqual((request, len(reply)), ("1a", 22))
            self.assertGreaterEqual(float(time), 0)
            self.assertGreater(float(after), 0)

    def test_what_it_holds_is_shown(self):
        done, files = self.report("sim:esl")
        self.assertIn(files["report.txt"], done.stderr)
        self.assertIn("is written", done.stderr)

    def test_keeps_the_last_thousand_exchanges(self):
        absenc("doctor", "sim:tformat", "--readings", "1500", "--report", str(self.path))
        with zipfile.ZipFile(self.path) as archive:
            lines = archive.read("exchanges.txt").decode().splitlines()
        self.assertEqual(sum(line[0].isdigit() for line in lines), 1000)

    def test_decode_shows_it(self):
        _, files = self.report("sim:tformat?motion=rpm=60")
        done = absenc("decode", str(self.path))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertTrue(done.stdout.startswith(files["report.txt"]))
        self.assertEqual(done.stdout.count("no alarms"), 60)

    def test_decode_refuses_a_newer_or_damaged_one(self):
        self.report("sim:tformat")
        whole = self.path.read_bytes()
        with zipfile.ZipFile(self.path, "w") as archive:
            archive.writestr("report.txt", "absenc report 2\n")
        done = absenc("decode", str(self.path))
        self.assertEqual(done.returncode, 1)
        self.assertIn("use a newer absenc", done.stderr)
        damaged = bytearray(whole)
        at = whole.index(b"report.txt") + 40
        damaged[at] ^= 0xFF
        self.path.write_bytes(damaged)
        done = absenc("decode", str(self.path))
        self.assertEqual(done.returncode, 1)
        self.assertIn("is damaged", done.stderr)

    def test_serial_number_of_an_adapter_is_masked(self):
        for encoder in ("tformat:/dev/serial/by-id/usb-FTDI_A50285BI-if00-port0", "biss:ftdi:A50285BI/B"):
            for options, is_shown in (((), False), (("--serial-numbers",), True)):
                with self.subTest(encoder, options=options):
                    _, files = self.report(encoder, *options)
                    for name, text in files.items():
                        self.assertEqual("A50285BI" in text, is_shown and name != "exchanges.txt", name)

    def test_holds_the_settings_as_they_were_given(self):
        _, files = self.report("sim:tformat?fault=corrupt=0.2&seed=1&max_rpm=3000")
        self.assertIn("given as: sim:tformat?fault=corrupt=0.2&seed=1&max_rpm=3000\n", files["report.txt"])
        for setting in ("fault=corrupt=0.2", "seed=1", "max_rpm=3000"):
            self.assertIn(f"\n  {setting}\n", files["report.txt"])

    def test_settings_of_a_named_encoder(self):
        folder = self.path.parent
        (folder / "absenc.toml").write_text('[encoder.elbow]\nprotocol = "tformat"\nport = "sim"\nmax_rpm = 3000\n')
        absenc("doctor", "elbow", "--readings", "60", "--report", str(self.path), cwd=folder).check_returncode()
        with zipfile.ZipFile(self.path) as archive:
            summary = archive.read("report.txt").decode()
        self.assertIn("encoder: sim:tformat\ngiven as: elbow\n", summary)
        self.assertIn("\n  max_rpm=3000\n", summary)

    def test_replaces_an_existing_file_only_with_force(self):
        self.path.write_text("a recording")
        done = absenc("doctor", "sim:tformat", "--readings", "60", "--report", str(self.path))
        self.assertEqual(done.returncode, 2)
        self.assertIn("exists: give another name, or --force to replace it", done.stderr)
        self.assertEqual(self.path.read_text(), "a recording")

    def test_requests_on_a_line_that_turns_are_shown(self):
        """EnDat: the first requests read the resolution, the others a position."""
        self.report("sim:endat")
        shown = absenc("decode", str(self.path))
        self.assertEqual(shown.returncode, 0)
        self.assertNotIn("bad_checksum", shown.stdout)
        self.assertIn("  00111000  ", shown.stdout)

    def test_is_no_table_for_programs(self):
        self.report("sim:tformat")
        for option in ("--json", "--csv", "--stats", "--bits"):
            done = absenc("decode", str(self.path), option)
            self.assertEqual(done.returncode, 2, option)
            self.assertIn("is a report", done.stderr)

    def test_a_file_that_cannot_be_written_is_an_error(self):
        done = subprocess.run([ABSENC, "doctor", "sim:tformat", "--readings", "20", "--report", "/nowhere/bug.zip"],
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 1)
        self.assertIn("/nowhere/bug.zip cannot be written", done.stderr)


if __name__ == "__main__":
    unittest.main()
