# SPDX-License-Identifier: Apache-2.0
"""SocketCAN on a virtual bus."""
import select
import subprocess
import time
import unittest

from command_support import PATIENCE, end, read_line


class Bus(unittest.TestCase):
    def test_frames_cross_a_virtual_bus(self):
        subprocess.run(["ip", "link", "add", "vcan7", "type", "vcan"], check=True)
        self.addCleanup(subprocess.run, ["ip", "link", "del", "vcan7"], check=True)
        subprocess.run(["ip", "link", "set", "vcan7", "up"], check=True)
        listener = subprocess.Popen(["candump", "-L", "-n", "1", "vcan7"], bufsize=0, stdout=subprocess.PIPE,
                                    stderr=subprocess.PIPE)
        self.addCleanup(end, listener)
        deadline = time.monotonic() + PATIENCE
        ready = []
        while not ready and time.monotonic() < deadline:  # candump does not tell when it listens
            subprocess.run(["cansend", "vcan7", "123#DEADBEEF"], check=True)
            ready = select.select([listener.stdout], [], [], 0.1)[0]
        line = read_line(listener.stdout, deadline)
        self.assertIn("vcan7 123#DEADBEEF", line)
