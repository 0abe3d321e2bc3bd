#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Conversations of virtual encoders as waveforms, and what sigrok's decoders read of them."""
import json
import os
import subprocess
import unittest

from command_support import Case, absenc

UNITS = [json.loads(line) for line in absenc("list", "--json").stdout.splitlines()]
WIRES = {"half_duplex": {"line"}, "full_duplex": {"host", "device"}, "exchange": {"cs", "sck", "mosi", "miso"},
         "clocked": {"clock", "data"}, "can": {"can"}}


class Wave(Case):
    def wave(self, *arguments):
        result = absenc("wave", *arguments)
        self.assert_good(result)
        return result.stdout

    @staticmethod
    def sigrok(*arguments):
        result = subprocess.run(["sigrok-cli", *arguments], capture_output=True, text=True, timeout=60, check=True)
        return [line.split(": ", 1)[1] for line in result.stdout.splitlines()]

    def test_every_unit_in_every_format(self):
        for unit, link in ((one["protocol"], one["link"]) for one in UNITS):
            for ending in ("vcd", "sr", "csv"):
                with self.subTest(unit=unit, ending=ending):
                    path = self.file(f"{unit}.{ending}")
                    told = self.wave(unit, path, "--count", "5")
                    self.assertIn("5 results", told)
                    self.assertIn("0 of them an error", told)
                    wires = set(told.strip().rsplit("wires: ", 1)[1].split(", "))
                    self.assertLessEqual(WIRES[link], wires)
                    self.assertLessEqual(wires - WIRES[link], {"trigger", "clear"})
                    self.assertGreater(os.path.getsize(path), 100)

    def test_sigrok_reads_the_bytes(self):
        for ending in ("vcd", "sr"):
            path = self.file(f"tformat.{ending}")
            self.wave("tformat?singleturn=4660", path, "--count", "2")
            input_format = ["-I", "vcd"] if ending == "vcd" else []
            read = self.sigrok(*input_format, "-i", path, "-P", "uart:rx=line:baudrate=2500000", "-A", "uart=rx-data")
            self.assertEqual(read, "1A 1A 00 34 12 00 11 00 00 00 00 2D".split() * 2)

    def decoded(self, unit, path):
        result = absenc("decode", unit, path, "--json")
        self.assert_good(result)
        return [json.loads(line) for line in result.stdout.splitlines()]

    def test_sigrok_reads_modbus(self):
        path = self.file("modbus.sr")
        self.wave("raa38-modbus?motion=rpm=60", path, "--count", "20")
        read = self.sigrok("-i", path, "-P", "uart:rx=line:baudrate=19200,modbus:scchannel=RX:cschannel=RX", "-A",
                           "modbus=sc-data")
        positions = [one["fields"]["singleturn"] for one in self.decoded("raa38-modbus", path)]
        self.assertEqual(len(set(positions)), 20)
        self.assertEqual(read, [f"0x{position:04X} / {position}" for position in positions])

    def test_sigrok_reads_an_spi_bus(self):
        path = self.file("spi.sr")
        self.wave("encolink-spi?motion=rpm=60", path, "--count", "20")
        read = self.sigrok("-i", path, "-P", "spi:clk=sck:miso=miso:mosi=mosi:cs=cs:cpol=0:cpha=1", "-A",
                           "spi=miso-data")
        # What is clocked behind a reply belongs to none.
        replies = [one["reply"] for one in self.decoded("encolink-spi", path)]
        self.assertGreater(len(set(replies)), 20)
        self.assertRegex("".join(read).lower(), "^" + "(ff)*".join(replies) + "(ff)*$")

    def test_decode_reads_what_wave_wrote(self):
        for unit in (one["protocol"] for one in UNITS):
            lines = {}
            for ending in ("vcd", "sr", "csv"):
                path = self.file(f"{unit}.{ending}")
                self.wave(f"{unit}?motion=rpm=60", path, "--count", "20")
                lines[ending] = [{name: one[name] for name in ("request", "reply", "ok", "fields", "angle_deg")
                                  if name in one} for one in self.decoded(unit, path)]
            with self.subTest(unit):
                self.assertGreaterEqual(len(lines["vcd"]), 20)
                self.assertTrue(all(one["ok"] for one in lines["vcd"]))
                self.assertGreaterEqual(len({one.get("angle_deg", one.get("position_um")) for one in lines["vcd"]}), 15)
                self.assertEqual(lines["vcd"], lines["sr"])
                self.assertEqual(lines["vcd"], lines["csv"])

    def test_commands_with_arguments(self):
        path = self.file("memory.vcd")
        self.wave("tformat", path, "--command", "memory-write 5 0x42", "--command", "memory-read 5")
        with open(path, encoding="ascii") as file:
            comments = [line.split(maxsplit=2)[2].removesuffix(" $end\n") for line in file
                        if line.startswith("$comment")]
        self.assertIn("host 32 host 05 host 42 host 75", " ".join(comments))
        self.assertTrue(" ".join(comments).endswith("device EA device 05 device 42 device AD"))

    def test_faults_show(self):
        told = self.wave("tformat?fault=corrupt=1", self.file("bad.vcd"), "--count", "20")
        self.assertIn("20 of them an error", told)

    def test_the_same_twice(self):
        for name in ("a.vcd", "b.vcd"):
            self.wave("esl?motion=rpm=600&fault=drop=0.2", self.file(name), "--count", "30")
        with open(self.file("a.vcd"), "rb") as a, open(self.file("b.vcd"), "rb") as b:
            self.assertEqual(a.read(), b.read())

    def test_an_existing_file_is_kept(self):
        path = self.file("mine.vcd")
        with open(path, "w", encoding="ascii") as file:
            file.write("mine")
        result = absenc("wave", "tformat", path)
        self.assertEqual(result.returncode, 2)
        self.assertIn("--force", result.stderr)
        with open(path, encoding="ascii") as file:
            self.assertEqual(file.read(), "mine")
        self.wave("tformat", path, "--force")

    def test_wrong_usage(self):
        for arguments, words in [(["tformat", "x.txt"], ".vcd"), (["tformat:/dev/null", "x.vcd"], "no virtual encoder"),
                                 (["tformat", "x.vcd", "--command", "nothing"], "nothing"),
                                 (["tformat", "x.vcd", "--samplerate", "1000"], "for .sr"),
                                 (["tformatt", "x.vcd"], "tformat")]:
            with self.subTest(arguments):
                result = absenc("wave", *arguments)
                self.assertEqual(result.returncode, 2)
                self.assertIn(words, result.stderr)
        result = absenc("wave", "tformat", self.file("missing/x.vcd"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("cannot be written", result.stderr)


if __name__ == "__main__":
    unittest.main()
