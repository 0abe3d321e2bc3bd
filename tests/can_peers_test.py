# SPDX-License-Identifier: Apache-2.0
"""Tests absenc on CAN against python-can, an independent implementation."""
import os
import sys
import threading
import unittest

SYSTEM_PYTHON = "/usr/bin/python3"  # the Python interpreter that has Debian's package python3-can

try:
    import can
    import serial
except ImportError:
    if os.path.realpath(sys.executable) == os.path.realpath(SYSTEM_PYTHON) or not os.path.exists(SYSTEM_PYTHON):
        sys.exit("can_peers_test.py: python-can is not installed: sudo apt install python3-can")
    os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON, "-B", *sys.argv])

import json
import tty

from command_support import Case, Emulator, absenc

PATIENCE = 30.0


def open_bus(path, bitrate=250000):
    return can.Bus(interface="slcan", channel=path, bitrate=bitrate, sleep_after_open=0)


def message(identifier, *data, **settings):
    settings.setdefault("is_extended_id", False)
    return can.Message(arbitration_id=identifier, data=bytes(data).ljust(8, b"\0"), **settings)


class Reader(Case):
    """Tests in which python-can is the host of a virtual node."""

    def setUp(self):
        super().setUp()
        self.emulator = Emulator(self.directory, "--singleturn", "9799", "--option", "cyclic=0", "--also",
                                 "node=0x21&cyclic=20&singleturn=77", protocol="raa38-can")
        self.addCleanup(self.emulator.end)
        self.bus = open_bus(self.emulator.path)
        self.addCleanup(self.close)

    def close(self):
        if self.bus is not None:
            self.bus.shutdown()
            self.bus = None

    def summary(self):
        self.close()
        return self.emulator.end()[2]

    def wait_for(self, identifier):
        while True:
            received = self.bus.recv(PATIENCE)
            self.assertIsNotNone(received)
            if received.arbitration_id == identifier:
                return received

    def test_polls_position(self):
        self.bus.send(message(0x220, 0x80, 0x20))
        answer = self.wait_for(0x120)
        self.assertEqual(bytes(answer.data), bytes([0x47, 0x26, 0, 0, 0, 0, 0, 0]))
        self.assertFalse(answer.is_extended_id or answer.is_remote_frame)

    def test_receives_cyclic_positions(self):
        for _ in range(3):
            self.assertEqual(bytes(self.wait_for(0x121).data), (77).to_bytes(8, "little"))

    def test_configures_node(self):
        self.bus.send(message(0x221, 0x31, 0x21, 0))
        while bytes(self.wait_for(0x121).data) != bytes([0x31]).ljust(8, b"\0"):
            pass
        self.bus.send(message(0x221, 0x20, 0x21))
        self.assertEqual(bytes(self.wait_for(0x121).data), bytes([0x20]).ljust(8, b"\0"))
        self.bus.send(message(0x221, 0x80, 0x21))
        self.assertEqual(bytes(self.wait_for(0x121).data), bytes(8))

    def test_node_ignores_extended_and_remote_frames(self):
        self.bus.send(message(0x220, 0x80, 0x20, is_extended_id=True))
        self.bus.send(can.Message(arbitration_id=0x220, is_remote_frame=True, dlc=8, is_extended_id=False))
        # A reply of node 0x21 to this request shows that node 0x20 has ignored the frames before it.
        self.bus.send(message(0x221, 0x80, 0x21))
        while True:
            received = self.bus.recv(PATIENCE)
            self.assertIsNotNone(received)
            self.assertNotEqual(received.arbitration_id, 0x120)
            if received.arbitration_id == 0x121:
                break
        self.assertIn("a frame without its 8 bytes of data", self.summary())

    def test_adapter_has_version(self):
        version, _ = self.bus.get_version(PATIENCE)
        self.assertEqual(version, 10)

    def test_receives_nothing_at_another_bit_rate(self):
        self.close()
        self.bus = open_bus(self.emulator.path, 500000)
        self.bus.send(message(0x220, 0x80, 0x20))
        self.assertIsNone(self.bus.recv(0.5))
        self.assertIn("at another bit rate", self.summary())


class Node(threading.Thread):
    """A fake RAA38S6, implemented from its manual, behind an emulated slcan adapter."""

    def __init__(self):
        super().__init__()
        self.master, slave = os.openpty()
        self.inner, inner_slave = os.openpty()
        for end in (slave, inner_slave):
            tty.setraw(end)
        self.path = os.ttyname(slave)
        self.bus = open_bus(os.ttyname(inner_slave))
        self.ends = (self.master, slave, self.inner, inner_slave)
        self.ended = threading.Event()
        self.zero = 0
        self.position = 9799
        self.commands = []
        self.crossing = threading.Thread(target=self.cross)

    def cross(self):
        """Forwards frames between absenc and the fake node, and plays the slcan adapter."""
        import select
        rest = {self.master: b"", self.inner: b""}
        while not self.ended.is_set():
            for end in select.select([self.master, self.inner], [], [], 0.05)[0]:
                other = self.inner if end == self.master else self.master
                *lines, rest[end] = (rest[end] + os.read(end, 4096)).split(b"\r")
                for line in lines:
                    if line[:1] in (b"t", b"T", b"r", b"R"):
                        os.write(other, line + b"\r")
                        os.write(end, b"z\r" if line[:1].islower() else b"Z\r")
                    else:
                        self.commands.append(line)
                        os.write(end, b"\r")

    def run(self):
        while not self.ended.is_set():
            received = self.bus.recv(0.05)
            if received is None or received.is_extended_id or received.arbitration_id != 0x220:
                continue
            code = received.data[0]
            if code == 0x20:
                self.zero = self.position
            counts = code if code != 0x80 else (self.position - self.zero) % 16384
            self.bus.send(message(0x120, counts & 255, counts >> 8))

    def __enter__(self):
        self.crossing.start()
        self.start()
        return self

    def __exit__(self, *_):
        self.ended.set()
        self.join()
        self.crossing.join()
        for end in self.ends:
            try:
                os.close(end)
            except OSError:
                pass


class Reads(Case):
    """Tests in which absenc reads a node that python-can plays."""

    def test_reads_node_of_python_can(self):
        with Node() as node:
            address = f"raa38-can:slcan:{node.path}?latency=300"
            result = absenc("read", address, "--count", "3", "--json")
            self.assert_good(result)
            self.assertEqual([json.loads(line)["singleturn"] for line in result.stdout.splitlines()], [9799] * 3)
            self.assertIn(b"S5", node.commands)
            self.assertIn(b"O", node.commands)
            zero = absenc("zero", address, "--yes", "--json")
            self.assert_good(zero)
            self.assertEqual(json.loads(absenc("read", address, "--json").stdout)["singleturn"], 0)
            scan = absenc("scan", address, "--yes", "--json")
            self.assert_good(scan)
            self.assertEqual([one["node"] for one in json.loads(scan.stdout)["encoders"]], [0x20])

    def test_python_can_reads_log(self):
        log = self.file("can.log")
        with Node() as node:
            self.assert_good(absenc("read", f"raa38-can:slcan:{node.path}?latency=300&log={log}"))
        frames = list(can.LogReader(log))
        self.assertGreaterEqual(len(frames), 4)
        self.assertEqual([(frame.arbitration_id, bytes(frame.data)) for frame in frames[:2]],
                         [(0x220, bytes([0x80, 0x20]).ljust(8, b"\0")), (0x120, bytes([0x47, 0x26]).ljust(8, b"\0"))])


if __name__ == "__main__":
    unittest.main()
