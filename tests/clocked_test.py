#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc` with encoders on clocked links."""
import csv
import json
import os
import unittest

from command_support import Case, absenc, json_lines

BISS = "sim:biss?singleturn_bits=19&multiturn_bits=16&singleturn=275087&multiturn=7"
SSI = "sim:ssi?bits=13&multiturn_bits=12&gray=true&singleturn=4660&multiturn=3"


class VirtualClockedEncoder(Case):
    def run_json(self, verb, *arguments):
        result = absenc(verb, *arguments, "--json")
        self.assert_good(result)
        return json_lines(result.stdout)

    def test_read_reports_position(self):
        for encoder, singleturn, multiturn, bits in [(BISS, 275087, 7, 19), (SSI, 4660, 3, 13)]:
            with self.subTest(encoder):
                readings = self.run_json("read", encoder, "--count", "3")
                self.assertEqual([(one["singleturn"], one["multiturn"]) for one in readings],
                                 [(singleturn, multiturn)] * 3)
                self.assertAlmostEqual(readings[0]["angle_deg"], 360 * singleturn / 2**bits, 4)
                self.assertTrue(readings[0]["singleturn_valid"])

    def test_monitor_shows_position(self):
        live = self.watch(BISS, SSI, until=lambda live: len(live) == 2)
        self.assertEqual({encoder: reading["singleturn"] for encoder, reading in live.items()}, {BISS: 275087, SSI: 4660})

    def test_record_writes_positions(self):
        for encoder, singleturn in [(BISS, 275087), (SSI, 4660)]:
            with self.subTest(encoder):
                file = self.file(f"{singleturn}.csv")
                self.assert_good(absenc("record", encoder, "--output", file, "--count", "5"))
                with open(file, encoding="utf-8") as rows:
                    lines = [line for line in rows if not line.startswith("#")]
                # Rows that mark gaps between readings are left out, because a busy machine may cause gaps.
                taken = [row["singleturn"] for row in csv.DictReader(lines) if row["event"] != "gap"]
                self.assertEqual(taken, [str(singleturn)] * 5)

    def test_info_states_clock(self):
        for encoder, line in [(BISS, "clocked bits, 1 Mbit/s"), (SSI, "clocked bits, 200 kbit/s")]:
            with self.subTest(encoder):
                result = absenc("info", encoder)
                self.assert_good(result)
                self.assertIn(line, result.stdout)
                self.assertIn("12 bits of turns" if encoder == SSI else "16 bits of turns", result.stdout)

    def test_alarms_are_reported(self):
        for encoder in (BISS, SSI + "&error_bit=active_high"):
            with self.subTest(encoder):
                self.assertIn("no alarms", absenc("alarms", encoder).stdout)
                result = absenc("alarms", encoder + "&alarm=error")
                self.assert_good(result)
                self.assertIn("error", result.stdout)
                reading, = self.run_json("read", encoder + "&alarm=error")
                self.assertEqual((reading["alarms"], reading["singleturn_valid"]), (["error"], False))

    def test_long_line_needs_longer_latency(self):
        for delay_ns in (400, 1100, 20_300):
            with self.subTest(delay_ns):
                encoder = f"{BISS}&line_delay_ns={delay_ns}"
                for latency_us in (10, 11 + delay_ns / 1000):
                    reading, = self.run_json("read", f"{encoder}&latency_us={latency_us}")
                    self.assertEqual(reading["singleturn"], 275087)
        self.assert_good(absenc("read", f"{BISS}&latency_us=2"))
        self.assert_good(absenc("read", f"{BISS}&latency_us=10&ready_us=12"))
        self.assert_failed(absenc("read", f"{BISS}&latency_us=10&ready_us=95"), "truncated", "latency_us", "raise it")

    def test_ssi_clock_and_pause_are_options(self):
        reading, = self.run_json("read", f"{SSI}&clock_khz=125&pause_us=2000")
        self.assertEqual(reading["singleturn"], 4660)
        self.assertIn("clocked bits, 125 kbit/s", absenc("info", f"{SSI}&clock_khz=125").stdout)
        readings = self.run_json("read", f"{SSI}&pause_us=20000", "--count", "5")
        self.assertEqual([one["singleturn"] for one in readings], [4660] * 5)
        self.assertGreaterEqual(readings[-1]["time_s"] - readings[0]["time_s"], 4 * 0.02)

    def test_error_shows_received_bits(self):
        result = absenc("read", "sim:biss?singleturn_bits=19&fault=silence=1")
        self.assert_failed(result, "line_stuck", "121 clocks to the virtual encoder; received 1111 1111 1111 1111 ",
                           "check the wiring")
        line, = json_lines(absenc("read", "sim:biss?singleturn_bits=19&fault=silence=1", "--json").stdout)
        self.assertEqual((line["ok"], line["error"], line["sent"]), (False, "line_stuck", ""))
        self.assertEqual(line["received"].replace(" ", ""), "1" * 121)


class SpiAddress(Case):
    def test_refuses_wrong_link(self):
        for encoder, words in [("ssi:/dev/ttyUSB0", ["does not go over a serial port", "write ssi:ftdi, ssi:spi:/dev/spidev"]),
                               ("biss:tcp:host:4001", ["does not go over TCP", "write biss:ftdi, biss:spi:/dev/spidev"]),
                               ("tformat:spi:/dev/spidev0.0", ["does not go over an SPI controller", "write tformat:/"]),
                               ("e201:spi:/dev/spidev0.0", ["does not go over an SPI controller", "write e201:/"]),
                               ("ssi:spi:", ["does not say which SPI device", "write ssi:ftdi, ssi:spi:/dev/spidev"]),
                               ("ssi", ["does not say where", "write ssi:ftdi, ssi:spi:/dev/spidev", "or sim:ssi"]),
                               ("ssi:spi:/dev/spidev0.0?baud=9600", ["baud", "it is for: serial"]),
                               ("ssi:spi:/dev/spidev0.0?echo=on", ["echo", "it is for: serial, tcp, sim"]),
                               ("ssi:spi:/dev/spidev0.0?speed=fast", ["speed", '"fast"']),
                               ("ssi:spi:/dev/spidev0.0?spi_mode=4", ["spi_mode", "0 to 3"]),
                               ("ssi:spi:/dev/spidev0.0?sped=3", ["did you mean speed?"]),
                               ("tformat:/dev/ttyUSB0?speed=3", ["speed", "it is for: spi"]),
                               ("sim:ssi?spi_mode=3", ["spi_mode", "it is for: spi"])]:
            with self.subTest(encoder):
                self.assert_wrong_usage(absenc("read", encoder), *words)

    def test_refuses_file_that_is_no_spi_device(self):
        self.assert_failed(absenc("read", "ssi:spi:/dev/spidev255.255?speed=100000&spi_mode=2"),
                           "there is no SPI device /dev/spidev255.255")
        self.assert_failed(absenc("read", "encolink:spi:/dev/spidev255.255"), "there is no SPI device")
        self.assert_failed(absenc("read", "biss:spi:/dev/null"), "/dev/null is not an SPI device", "/dev/spidevB.C")

    def test_emulate_refuses_wrong_link(self):
        for arguments, words in [(["ssi"], ["does not go over a serial line: use --spidev NAME, or sim:ssi"]),
                                 (["encolink-spi"], ["use --spidev NAME, or sim:encolink-spi"]),
                                 (["tformat", "--spidev", "spidev9.0"], ["does not go over an SPI controller: use --pty"]),
                                 (["ssi", "--spidev", "spidev9.0", "--tcp", "0"], ["does not go over a serial line"]),
                                 (["encolink", "--spidev", "spidev9.0", "--pty", "x"], ["does not go over a serial line"]),
                                 (["biss", "--spidev", "spidev9.0", "--also", "seed=2"], ["one encoder on a line"])]:
            with self.subTest(arguments):
                self.assert_wrong_usage(absenc("emulate", *arguments), *words)
        self.assert_failed(absenc("emulate", "ssi", "--spidev", "a/b", "--for", "1"), "is no name for a device")
        self.assert_failed(absenc("emulate", "ssi", "--spidev", "null", "--for", "1"), "/dev/null exists")

    def test_device_in_absenc_toml(self):
        config = self.file("absenc.toml", '[encoder.drum]\nprotocol = "ssi"\nport = "spi:/dev/spidev255.255"\n'
                                          'speed = 150000\nspi_mode = 2\nbits = 13\n')
        environment = {**os.environ, "ABSENC_CONFIG": config}
        names = absenc("list", "--names", "--json", env=environment)
        self.assert_good(names)
        self.assertEqual(json.loads(names.stdout)["encoder"], "ssi:spi:/dev/spidev255.255")
        self.assert_failed(absenc("read", "drum", env=environment), "there is no SPI device /dev/spidev255.255")

    def test_monitor_refuses_same_device_twice(self):
        self.assert_wrong_usage(absenc("monitor", "ssi:spi:/dev/spidev0.0", "biss:spi:/dev/spidev0.0", "--json"),
                                "are the same SPI device")

    def test_help_names_options(self):
        self.assertIn("ssi:spi:/dev/spidev0.0", absenc("--help").stdout)
        listed = absenc("list", "ssi").stdout
        self.assertRegex(listed, r"speed=HZ +spi, ftdi ")
        self.assertRegex(listed, r"spi_mode=0\.\.3 +spi, ftdi ")



class Messages(Case):
    def test_refuses_alarm_that_word_cannot_carry(self):
        refused = absenc("read", "sim:ssi?alarm=error")
        self.assertEqual(refused.returncode, 2)
        self.assertIn("the alarm error cannot be shown", refused.stderr)
        shown = absenc("read", "sim:ssi?alarm=error&error_bit=active_high", "--json")
        self.assertEqual(json.loads(shown.stdout)["alarms"], ["error"])
        self.assertEqual(absenc("read", "sim:ssi?alarm=warning&error_bit=active_high").returncode, 2)

    def test_reports_too_many_clocks(self):
        refused = absenc("decode", "ssi", "--hex", "000111101111000000")
        self.assertIn("more clocks than the word has bits", refused.stderr)
        self.assertNotIn("bits that must be zero", refused.stderr)

    def test_range_states_step(self):
        refused = absenc("read", "sim:amt21?address=85")
        self.assertIn("must be 0 to 252 in steps of 4", refused.stderr)
        self.assertIn("must be 12 to 14 in steps of 2", absenc("read", "sim:amt21?singleturn_bits=13").stderr)
        self.assertIn("0 to 252 in steps of 4", absenc("list", "amt21").stdout)

    def test_reads_long_line_without_option(self):
        for slow in ("line_delay_ns=39500", "ma_khz=10000&latency_us=1&line_delay_ns=5050"):
            reading, = json_lines(absenc("read", f"sim:biss?singleturn=275087&{slow}", "--json").stdout)
            self.assertEqual((reading["singleturn"], reading["singleturn_valid"]), (275087, True))

    def test_manufacturer_is_two_letters(self):
        self.assertRegex(absenc("run", "sim:biss", "manufacturer").stdout, r"manufacturer +ve ")


if __name__ == "__main__":
    unittest.main()
