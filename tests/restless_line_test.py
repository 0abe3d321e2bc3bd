# SPDX-License-Identifier: Apache-2.0
"""A line that is never silent: what is to end after a time ends, and so does what is interrupted."""
import os
import select
import signal
import threading
import time
import tty
import unittest

from command_support import EncoderCase, absenc, end

PROTOCOLS = ["tformat", "esl", "encolink", "e201", "raa38-modbus"]


class RestlessLine:
    """A pseudo-terminal on which a byte comes every few milliseconds, whatever is asked."""

    def __init__(self, byte):
        self.byte = byte
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        os.set_blocking(self.master, False)
        self.path = os.ttyname(self.slave)
        self.wake, self.waker = os.pipe()
        self.thread = threading.Thread(target=self.serve)

    def serve(self):
        while not select.select([self.wake], [], [], 0.005)[0]:
            try:
                os.write(self.master, self.byte)
                os.read(self.master, 4096)
            except BlockingIOError:
                pass

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        os.write(self.waker, b"x")
        self.thread.join()
        for descriptor in (self.master, self.slave, self.wake, self.waker):
            os.close(descriptor)


class AnEndThatHolds(EncoderCase):
    def run_for_a_second(self, *arguments):
        start = time.monotonic()
        result = absenc(*arguments, "--for", "1")
        self.assertLess(time.monotonic() - start, 20, result.stderr)
        return result

    def test_record(self):
        for protocol in PROTOCOLS:
            with self.subTest(protocol), RestlessLine(b"\x1a") as line:
                output = self.file(f"{protocol}.csv")
                result = self.run_for_a_second("record", f"{protocol}:{line.path}", "--output", output)
                self.assertEqual(result.returncode, 1, result.stderr)
                self.assertIn("0 readings and ", result.stderr)
                with open(output, encoding="utf-8") as file:
                    self.assertTrue(file.read().endswith("\n"))

    def test_monitor(self):
        with RestlessLine(b"\x1a") as one, RestlessLine(b"\x55") as other:
            for protocol in PROTOCOLS:
                with self.subTest(protocol):
                    result = self.run_for_a_second("monitor", f"{protocol}:{one.path}", f"{protocol}:{other.path}")
                    self.assertEqual(result.returncode, 1, result.stderr)
                    self.assertEqual(result.stderr.count(" 0 readings; "), 2, result.stderr)

    def test_interrupted(self):
        with RestlessLine(b"\x1a") as line:
            for arguments in (["monitor"], ["record", "--output", self.file("log.csv")]):
                with self.subTest(arguments):
                    process = self.start(*arguments, f"encolink:{line.path}", "--for", "600")
                    while not self.handles_interrupts(process.pid):
                        pass
                    self.assertEqual(end(process, signal.SIGINT)[0], 1)

    @staticmethod
    def handles_interrupts(pid):
        with open(f"/proc/{pid}/status", encoding="ascii") as file:
            mask = next(line for line in file if line.startswith("SigCgt:")).split()[1]
        return bool(int(mask, 16) >> (signal.SIGINT - 1) & 1)


if __name__ == "__main__":
    unittest.main()
