#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests in real time that `absenc doctor` reports no fault of a healthy encoder; with --all, twenty times beside four
busy processes."""
import concurrent.futures
import json
import sys
import unittest

from command_support import Busy, Case, Emulator, absenc, character_units

ALL = "--all" in sys.argv
RUNS, BUSY = (20, 4) if ALL else (1, 0)
USUAL = {"name": "", "maximum_rpm": None}
# Latency in milliseconds: the emulator may wait for the processor.
PATIENT = "latency=300"


class Healthy(Case):
    def test_each_model_of_each_serial_unit(self):
        cases = [(unit, model, number) for unit, about in character_units().items()
                 for model in [USUAL, *about["models"]] for number in range(RUNS)]
        self.assertGreater(len(cases), 20)
        with Busy(BUSY), concurrent.futures.ThreadPoolExecutor(2) as pool:
            ill = [text for text in pool.map(lambda case: self.examine(*case), cases) if text]
        self.assertEqual(ill, [], "\n".join(ill))

    def examine(self, unit, model, number):
        """Returns doctor's verdict and findings for a healthy encoder; "" if the verdict is good."""
        name = model["name"]
        # a linear encoder has no speed in rpm, so it stands still
        motion = "still" if model["maximum_rpm"] == 0 else "rpm=20"
        with Emulator(self.directory, *(["--model", name] if name else []), "--motion", motion, protocol=unit,
                      name=f"{unit}-{name}-{number}") as emulator:
            address = f"{unit}:{emulator.path}?{PATIENT}" + (f"&model={name}" if name else "")
            # With this latency some units need more than half a second for a reading, and are read again for longer.
            for seconds in "3", "20":
                found = json.loads(absenc("doctor", address, "--json", "--for", seconds).stdout)
                if [finding["id"] for finding in found["findings"]] != ["few_readings"]:
                    break
        print(f"{unit:14} {name or 'usual'}: {found['verdict'][:100]}", flush=True)
        if found["verdict"].startswith("good"):
            return ""
        return f"{unit} {name or 'usual'}: {found['verdict']}: {found['findings']}"


if __name__ == "__main__":
    if ALL:
        sys.argv.remove("--all")
    unittest.main()
