# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc conform-host --spidev` on a CUSE device."""
import json
import signal
import subprocess
import time
import unittest

from command_support import ABSENC, PATIENCE, end, read_line
from spidev_test import Spi

NAME = "spidev9.1"


class ConformHost(unittest.TestCase):
    def judge(self, protocol, *arguments):
        process = subprocess.Popen([ABSENC, "conform-host", protocol, "--spidev", NAME, "--json", *arguments],
                                   bufsize=0, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(lambda: end(process) if process.returncode is None else None)
        self.assertIn(f"ready: /dev/{NAME}", read_line(process.stderr, time.monotonic() + PATIENCE))
        return process

    def verdicts(self, process):
        out, err = process.communicate(timeout=PATIENCE)
        answer = json.loads(out)
        self.assertEqual(process.returncode, 0 if answer["ok"] else 1, err)
        return {one["id"]: one["verdict"] for one in answer["clauses"]}

    def ours(self, protocol, encoder):
        process = self.judge(protocol, "--answers", "20", "--patience", "60")
        host = subprocess.Popen([ABSENC, "monitor", encoder, "--json"], stdin=subprocess.DEVNULL,
                                stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            return self.verdicts(process)
        finally:
            host.terminate()
            host.wait(PATIENCE)

    def test_own_hosts_keep_all_clauses(self):
        for protocol in ("biss", "ssi", "encolink"):
            with self.subTest(protocol):
                verdicts = self.ours(protocol, f"{protocol}:spi:/dev/{NAME}")
                self.assertEqual(verdicts, {name: "untested" if name == "access" else "kept" for name in verdicts})
                self.assertEqual(len(verdicts), {"biss": 7, "ssi": 5, "encolink": 8}[protocol])

    def test_reports_mistakes_of_host(self):
        """The host clocks too fast, uses mode 0, leaves no pause, and stops after a lost reply."""
        process = self.judge("encolink", "--answers", "4", "--patience", "1")
        with Spi(f"/dev/{NAME}", mode=0, speed=8_000_000) as spi:
            for _ in range(2):
                spi.exchange(bytes(7))
        verdicts = self.verdicts(process)
        broken = {name for name, verdict in verdicts.items() if verdict == "broken"}
        self.assertTrue({"speed", "mode", "lead"} <= broken, verdicts)
        self.assertNotEqual(verdicts["silence"], "kept")
        self.assertEqual(verdicts["asks"], "kept")

    def test_ends_by_interrupt(self):
        process = self.judge("ssi")
        self.assertEqual(end(process, signal.SIGINT)[:2], (1, ""))


if __name__ == "__main__":
    unittest.main()
