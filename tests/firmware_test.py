#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The programs of firmware/ on machines that QEMU emulates. ABSENC_FIRMWARE is the folder they were
built in; ABSENC_FIRMWARE_POSITIONS how many the drive reads, ABSENC_FIRMWARE_ALL whether all programs were built (./dev firmware)."""
import os
import re
import subprocess
import sys
import tempfile
import unittest

from command_support import Emulator

FOLDER = os.path.abspath(os.environ.get("ABSENC_FIRMWARE", "build/arm/firmware"))
SOURCES = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
POSITIONS = int(os.environ.get("ABSENC_FIRMWARE_POSITIONS", "1000"))
PATIENCE = 120 + POSITIONS / 20  # seconds
CORES = ("m0plus", "m4f") if os.environ.get("ABSENC_FIRMWARE_ALL") else ("m0plus",)
MACHINES = {"microbit": "microbit", "m0plus": "mps2-an385", "m4f": "mps2-an386"}
SINGLETURN, MULTITURN = 74565, 4660
LATENCY = 250  # ms: a reply that a busy machine delays longer would be a fault that nobody injected


def emulated(program, machine, *arguments, serial="null"):
    """Runs a program to its end; what it says."""
    path = os.path.join(FOLDER, program + ".elf")
    semihosting = ",".join(["enable=on,target=native", f"arg={program}", *(f"arg={one}" for one in arguments)])
    serial = ["-serial", "null"] if serial == "null" else ["-chardev", serial, "-serial", "chardev:line"]
    command = ["qemu-system-arm", "-M", machine, "-display", "none", "-monitor", "none", *serial,
               "-semihosting-config", semihosting, "-kernel", path]
    result = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            timeout=PATIENCE, text=True, check=False)
    return result.returncode, result.stdout


class Vectors(unittest.TestCase):
    def test_all_are_decoded(self):
        for cpu in CORES:
            with self.subTest(cpu):
                status, said = emulated(f"vectors-{cpu}", MACHINES[cpu])
                self.assertEqual(status, 0, said)
                decoded = re.search(r"^decoded (\d+), wrong 0, ", said, re.MULTILINE)
                self.assertTrue(decoded, said)
                self.assertGreaterEqual(int(decoded[1]), 600)


class Drive(unittest.TestCase):
    """Every fault of the line is one that the drive noticed, and no position is wrong."""

    def drive(self, cpu):
        with tempfile.TemporaryDirectory(prefix="absenc-test-") as folder:
            memory = os.path.join(folder, "memory.dump")
            with Emulator(folder, "--tcp", "0", "--memory", memory, "--alarm", "over_heat",
                          "--singleturn", str(SINGLETURN), "--multiturn", str(MULTITURN),
                          "--fault", "corrupt=0.01", "--fault", "drop=0.01") as emulator:
                port = emulator.line().rsplit(":", 1)[1].strip()
                line = f"socket,id=line,host=127.0.0.1,port={port},nodelay=on"
                status, said = emulated(f"drive-{cpu}", MACHINES[cpu], POSITIONS, SINGLETURN, MULTITURN, LATENCY,
                                        serial=line)
                _, _, summary = emulator.end()
            with open(memory, encoding="utf-8") as file:
                return status, said, summary, file.read()

    def check(self, cpu):
        status, said, summary, memory = self.drive(cpu)
        everything = said + summary
        self.assertEqual(status, 0, everything)
        counted = {name: int(number) for name, number in re.findall(r"^([a-z_]+) (\d+)$", said, re.MULTILINE)}
        self.assertGreaterEqual(counted["good"], POSITIONS, everything)
        self.assertEqual(counted["wrong"], 0, everything)
        self.assertEqual(counted["unasked"], 0, everything)
        self.assertEqual(counted["requests"], int(re.search(r"(\d+) requests answered", summary)[1]), everything)
        faults = {kind: int(number) for number, kind in re.findall(r"(\d+) (drop|corrupt)", summary)}
        self.assertEqual(set(faults), {"drop", "corrupt"}, everything)
        # A reply that is struck twice is noticed once: at these rates one in 10 000. One that a busy machine delivers
        # late is a silence without a fault.
        unnoticed = sum(faults.values()) - counted["silences"] - counted["implausible"]
        self.assertLess(unnoticed, 3 + POSITIONS // 4000, everything)
        self.assertNotIn("rules that the host broke", summary)
        page, address, value = 2, 5, "42"
        stored = re.findall(r"^[0-9A-F]{4}: (.*)$", memory, re.MULTILINE)
        self.assertEqual(" ".join(stored).split()[page * 127 + address], value)

    def test_positions_alarms_a_reset_and_a_write(self):
        for cpu in ("microbit", *CORES):
            with self.subTest(cpu):
                self.check(cpu)


class Figures(unittest.TestCase):
    def test_each_is_within_3_percent_of_the_table(self):
        figures = [sys.executable, "-B", os.path.join(SOURCES, "firmware/figures.py"), FOLDER,
                   os.path.join(SOURCES, "docs/firmware-figures.json"), "--check"]
        result = subprocess.run(figures, capture_output=True, timeout=PATIENCE, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)


if __name__ == "__main__":
    unittest.main()
