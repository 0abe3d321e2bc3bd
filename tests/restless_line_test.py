# SPDX-License-Identifier: Apache-2.0
"""Tests that `record` and `monitor` end on a line that is never silent."""
import signal
import time
import unittest

from command_support import BabblingLine, EncoderCase, absenc, end, wait_for_handler

PROTOCOLS = ["tformat", "esl", "encolink", "e201", "raa38-modbus"]


class EndOfRun(EncoderCase):
    def run_for_a_second(self, *arguments):
        start = time.monotonic()
        result = absenc(*arguments, "--for", "1")
        self.assertLess(time.monotonic() - start, 20, result.stderr)
        return result

    def test_record_ends_after_its_time(self):
        for protocol in PROTOCOLS:
            with self.subTest(protocol), BabblingLine(pieces=[b"\x1a"]) as line:
                output = self.file(f"{protocol}.csv")
                result = self.run_for_a_second("record", f"{protocol}:{line.path}", "--output", output)
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertIn("0 readings and ", result.stderr)
                with open(output, encoding="utf-8") as file:
                    self.assertTrue(file.read().endswith("\n"))

    def test_monitor_ends_after_its_time(self):
        with BabblingLine(pieces=[b"\x1a"]) as one, BabblingLine(pieces=[b"\x55"]) as other:
            for protocol in PROTOCOLS:
                with self.subTest(protocol):
                    result = self.run_for_a_second("monitor", f"{protocol}:{one.path}", f"{protocol}:{other.path}")
                    self.assertEqual(result.returncode, 1, result.stderr)
                    self.assertEqual(result.stderr.count(" 0 readings; "), 2, result.stderr)

    def test_interrupt_ends_both(self):
        with BabblingLine(pieces=[b"\x1a"]) as line:
            for arguments in (["monitor"], ["record", "--output", self.file("log.csv")]):
                with self.subTest(arguments):
                    process = self.start(*arguments, f"encolink:{line.path}", "--for", "600")
                    wait_for_handler(process)
                    self.assertEqual(end(process, signal.SIGINT)[0], 1)


if __name__ == "__main__":
    unittest.main()
