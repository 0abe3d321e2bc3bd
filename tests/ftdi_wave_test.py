#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the waveform that an FTDI chip drives: its edges by this file, its bits by `absenc decode` and by sigrok."""
import json
import os
import subprocess
import unittest

from command_support import ABSENC, PATIENCE, Case, absenc

WAVE = os.path.join(os.path.dirname(ABSENC), "../tests/ftdi_wave")
CLOCKS = ((70, 69930), (1000, 1000000), (5000, 5000000), (10000, 10000000))


def changes(path, wire):
    """Returns (time in nanoseconds, level) of each change of a wire."""
    now, found = 0, []
    with open(path, encoding="ascii") as file:
        for line in file:
            if line[0] == "#":
                now = int(line[1:])
            elif line[1:].strip() == wire and line[0] in "01":
                found.append((now, line[0] == "1"))
    return found


class FtdiWave(Case):
    def wave(self, what, *, command="position", count=5):
        path = self.file("wave.vcd")
        result = subprocess.run([WAVE, what, command, str(count), path], capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(result.returncode, 0, result.stderr)
        return path, int(result.stdout)

    def decoded(self, unit, path, *options):
        result = absenc("decode", unit, path, "--json", *(f"--option={one}" for one in options))
        self.assert_good(result)
        return [json.loads(line) for line in result.stdout.splitlines()]

    def bits_by_sigrok(self, path, clocks):
        """Returns each word of `clocks` bits, sampled at the falling edges of a clock that rests high."""
        result = subprocess.run(["sigrok-cli", "-I", "vcd", "-i", path, "-P",
                                 f"spi:clk=clock:miso=data:cpol=1:cpha=0:wordsize={clocks}", "-A", "spi=miso-data"],
                                capture_output=True, text=True, timeout=PATIENCE, check=True)
        return [int(line.split(": ", 1)[1], 16) for line in result.stdout.splitlines()]

    def words(self, path):
        """Returns the falling edges of each word: a pause is longer than three periods."""
        edges = [at for at, level in changes(path, "!") if not level]
        words = [[edges[0]]]
        for before, edge in zip(edges, edges[1:]):
            if edge - before > 3 * (words[0][1] - words[0][0] if len(words[0]) > 1 else edge - before):
                words.append([])
            words[-1].append(edge)
        return words

    def test_biss_at_every_clock(self):
        for khz, rate in CLOCKS:
            with self.subTest(khz=khz):
                path, made = self.wave(f"biss?ma_khz={khz}&singleturn=12345")
                self.assertEqual(made, rate)
                words = self.words(path)
                self.assertEqual(len(words), 5)
                for word in words:
                    period = (word[-1] - word[0]) / (len(word) - 1)
                    self.assertAlmostEqual(period, 1e9 / rate, delta=max(1, 1e-4 * 1e9 / rate))
                for before, after in zip(words, words[1:]):
                    self.assertGreaterEqual(after[0] - before[-1], 40_000)  # the BiSS timeout that is not known
                rows = self.decoded("biss", path, f"ma_khz={khz}")
                self.assertEqual([(row["ok"], row["fields"]["singleturn"]) for row in rows], [(True, 12345)] * 5)
                values = self.bits_by_sigrok(path, len(words[0]))
                self.assertEqual(len(values), 5)
                for row, value in zip(rows, values):
                    self.assertEqual(f"{value:0{len(words[0])}b}"[: len(row["reply"])], row["reply"])

    def test_endat_in_both_directions(self):
        encoder = "endat?model=ECN-1325"
        # the rate of the last exchange
        for command, rate in (("position", 1000000), ("info", 100000), ("status", 100000), ("temperature", 1000000)):
            with self.subTest(command):
                path, made = self.wave(f"{encoder}&singleturn=12345", command=command, count=2)
                self.assertEqual(made, rate)
                rows = self.decoded(encoder, path)
                self.assertEqual([row for row in rows if not row["ok"]], [])
                self.assertGreaterEqual(len(rows), 2)
                positions = [row["fields"]["singleturn"] for row in rows if "singleturn" in row["fields"]]
                self.assertEqual(positions, [12345] * len(positions))
                self.assertEqual(positions == [], command == "info")
                edges = changes(path, "!")
                pauses = [after - before for (before, level), (after, _) in zip(edges, edges[1:])
                          if level and after - before > 10_000]
                exchanges = [row for row in rows if row["reply"]]  # other rows combine several exchanges
                self.assertGreaterEqual(len(pauses), len(exchanges) - 1)
                self.assertGreaterEqual(min(pauses), 30_000)  # the recovery time, README.md of endat

    def test_ssi_at_every_clock(self):
        for khz, rate in CLOCKS:
            with self.subTest(khz=khz):
                path, made = self.wave(f"ssi?clock_khz={khz}&min_clock_khz=1&max_clock_khz=10000&singleturn=2748")
                self.assertEqual(made, rate)
                words = self.words(path)
                self.assertEqual(len(words), 5)
                rows = self.decoded("ssi", path, f"clock_khz={khz}")
                self.assertEqual([(row["ok"], row["fields"]["singleturn"]) for row in rows], [(True, 2748)] * 5)
                values = self.bits_by_sigrok(path, len(words[0]))
                bits = len(words[0]) - 1  # the first sample is of the line at rest
                self.assertEqual([value & ((1 << bits) - 1) for value in values],
                                 [int(row["reply"], 2) for row in rows])

    def test_clock_is_low_in_the_timeout_for_a_control_bit(self):
        for khz, rate in CLOCKS[1:]:
            with self.subTest(khz=khz):
                path, made = self.wave(f"biss?ma_khz={khz}", command="info", count=1)
                self.assertEqual(made, rate)
                clock = changes(path, "!")
                low = [after - before for (before, level), (after, _) in zip(clock, clock[1:]) if not level]
                half = 0.5e9 / rate
                pulses = [one for one in low if one < 2 * half]
                held = [one for one in low if one >= 2 * half]
                self.assertGreater(len(pulses), 20 * len(held))
                self.assertGreater(len(held), 10)
                self.assertGreaterEqual(min(held), 20_000)  # as long as the timeout of the encoder
                # Between the held level and the first clock the line is high for half a period.
                high = [after - before for (before, level), (after, _), (_, next_level) in
                        zip(clock, clock[1:], clock[2:]) if level]
                self.assertGreaterEqual(min(high), half - 1)
                rows = self.decoded("biss", path, f"ma_khz={khz}")
                self.assertTrue(rows and all(row["ok"] for row in rows))


if __name__ == "__main__":
    unittest.main()
