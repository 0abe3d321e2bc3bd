#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests that measured speeds are right within their stated uncertainty, in real time."""
import json
import os
import subprocess
import unittest
from concurrent.futures import ThreadPoolExecutor

from command_support import ABSENC, Busy, Emulator, EncoderCase, absenc

SPEEDS = (1, 12, 60, 3000)  # speeds of the shaft in rpm
# Options of the units that are not tested with their default options only. Each text is one test; "": the defaults.
OPTIONS = {"encolink": ("", "stream_rate=500&resolution=20"), "raa38": ("mode=bus", "mode=timing")}


def serial_units():
    """Returns the names of the units whose emulator runs on a pseudo-terminal."""
    units = [json.loads(line) for line in absenc("list", "--json").stdout.splitlines()]
    return [unit["protocol"] for unit in units if unit["link"] not in ("exchange", "clocked", "clocked_bidirectional")]


class Speed(EncoderCase):
    def rows(self, name, protocol, options, rpm, *more):
        """Returns the header and rows that `record` writes for a virtual encoder turning at `rpm`."""
        settings = [word for option in options.split("&") if option for word in ("--option", option)]
        name = f"{protocol}-{len(options)}-{name}"
        with Emulator(self.directory, "--motion", f"rpm={rpm}", *settings, protocol=protocol, name=name) as emulator:
            place = f"slcan:{emulator.path}" if protocol.endswith("-can") else emulator.path
            address = f"{protocol}:{place}" + (f"?{options}" if options else "")
            path = os.path.join(self.directory, name + ".jsonl")
            result = absenc("record", address, "--output", path, *more)
            self.assertIn(result.returncode, (0, 1), result.stderr)
            with open(path, encoding="utf-8") as file:
                header, *rows = [json.loads(line) for line in file]
        return header, rows

    def assert_within(self, header, rows, rpm):
        """Checks that no speed is wrong by more than its uncertainty. Returns both as pairs."""
        unit = "mm_s" if "speed_mm_s" in header["units"] else "rpm"
        pairs = []
        for row in rows:
            speed, uncertainty = row.get(f"speed_{unit}"), row.get(f"speed_uncertainty_{unit}")
            self.assertEqual(speed is None, uncertainty is None, row)
            if speed is None:
                continue
            # The stated uncertainty is increased slightly, because the printed speed and uncertainty are rounded.
            self.assertLessEqual(abs(speed - rpm), uncertainty * 1.001 + 1e-9, row)
            pairs.append((speed, uncertainty))
        return pairs

    def assert_all(self, busy):
        """Tests each unit in turn, at all speeds at the same time, which also makes the machine busy."""
        for protocol in serial_units():
            for options in OPTIONS.get(protocol, ("",)):
                with Busy(busy), ThreadPoolExecutor() as pool:
                    recorded = [pool.submit(self.rows, f"{rpm}", protocol, options, rpm, "--rate", "100", "--for", "1.5")
                                for rpm in SPEEDS]
                for rpm, one in zip(SPEEDS, recorded):
                    with self.subTest(protocol=protocol, options=options, rpm=rpm):
                        self.assert_within(*one.result(), rpm)

    def test_errors_stay_within_uncertainty_beside_busy_processes(self):
        self.assert_all(4)

    def test_uncertainty_is_useful(self):
        header, rows = self.rows("alone", "tformat", "", 60, "--rate", "200", "--count", "600")
        pairs = self.assert_within(header, rows, 60)
        self.assertGreater(len(pairs), 0, "3 s hold a window of 1 s")
        for speed, uncertainty in pairs:
            self.assertLess(uncertainty, 0.34 * abs(speed), "a fourth of the time to either side is the most")

    def test_history_has_no_spikes(self):
        with Emulator(self.directory, "--motion", "rpm=12") as emulator, Busy(4):
            process = subprocess.Popen([ABSENC, "monitor", f"tformat:{emulator.path}?latency=300", "--json", "--for", "3",
                                        "--interval", "0.05"], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            out, _ = process.communicate(timeout=60)
        lines = [json.loads(line) for line in out.splitlines()]
        for line in lines:
            if line.get("speed_rpm") is not None:
                self.assertLessEqual(abs(line["speed_rpm"] - 12), line["speed_uncertainty_rpm"] * 1.001)


if __name__ == "__main__":
    unittest.main()
