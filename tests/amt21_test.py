# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc` with AMT21 encoders: the sign of turns, and a scan."""
import csv
import io
import unittest

from command_support import Case, Emulator, absenc, json_lines

BACKWARDS = "sim:amt21?model=AMT21xD&multiturn=-3"


class Turns(Case):
    def test_read_and_turns_agree(self):
        for address in (BACKWARDS, "sim:amt21?model=AMT21xD&multiturn=16381"):
            with self.subTest(address):
                self.assertRegex(absenc("read", address).stdout, r"\D-3 turns")
                reading, = json_lines(absenc("read", address, "--json").stdout)
                self.assertEqual((reading["multiturn"], reading["multiturn_valid"]), (-3, True))
                row, = csv.DictReader(io.StringIO(absenc("read", address, "--csv").stdout))
                self.assertEqual(row["multiturn"], "-3")
                self.assertIn("-3 revolutions", absenc("run", address, "turns").stdout)

    def test_capture_shows_negative_turns(self):
        file = self.file("wave.vcd")
        absenc("wave", BACKWARDS.removeprefix("sim:"), file, "--command", "turns")
        row, = json_lines(absenc("decode", "amt21", file, "--json", "--option", "multiturn_bits=14").stdout)
        self.assertEqual(row["fields"]["multiturn"], -3)

    def test_recording_has_negative_turns(self):
        file = self.file("turns.csv")
        absenc("record", BACKWARDS, "--output", file, "--count", "2")
        with open(file, encoding="utf-8") as lines:
            rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        # Rows that mark gaps between readings are left out, because a busy machine may cause gaps.
        readings = [row for row in rows if row["event"] != "gap"]
        self.assertEqual([row["multiturn"] for row in readings], ["-3", "-3"])
        self.assertEqual(int(rows[0]["position"]), -3 * 16384 + int(rows[0]["singleturn"]))

    def test_refuses_turns_out_of_range(self):
        for turns in (-8193, 16384):
            refused = absenc("read", f"sim:amt21?model=AMT21xD&multiturn={turns}")
            self.assertEqual(refused.returncode, 2)
            self.assertIn("must be from -8192 to 8191", refused.stderr)
        refused = absenc("read", "sim:tformat?multiturn=-1")
        self.assertIn("must be from 0 to 65535", refused.stderr)


class Scan(Case):
    def test_scan_finds_the_encoder(self):
        for address in ("sim:amt21", "sim:amt21?rate=9600&address=0x10"):
            (found,) = json_lines(absenc("scan", address, "--json").stdout)[0]["encoders"]
            self.assertEqual(found["encoder_address"], 0x10 if "0x10" in address else 0x54)

    def test_scan_finds_eight_consecutive_addresses(self):
        addresses = range(0, 32, 4)
        also = [word for address in addresses[1:] for word in ("--also", f"address={address}")]
        with Emulator(self.directory, "--option", "address=0", *also, protocol="amt21") as line:
            result = absenc("scan", f"amt21:{line.path}?latency=100", "--json")
            self.assert_good(result)
            found = json_lines(result.stdout)[0]["encoders"]
            self.assertEqual([one["encoder_address"] for one in found], list(addresses))

    def test_reserved_request_is_unexpected(self):
        refused = absenc("decode", "amt21", "--request", "57")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("unexpected_reply", refused.stderr)


if __name__ == "__main__":
    unittest.main()
