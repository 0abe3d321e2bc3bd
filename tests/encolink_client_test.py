# SPDX-License-Identifier: Apache-2.0
"""Tests the virtual AksIM-2 encoder with an independent EncoLink client."""
import os
import select
import tty
import unittest

from command_support import PATIENCE, Case, Emulator

POSITION, RESET_CHANNELS, IDENTIFY = 0x00, 0xAA, 0xBB
KEYS = bytes([0x00, 0xCD, 0xEF, 0x89, 0xAB])
READ, WRITE = 0x59, 0x58
IDLE, BUSY, READ_READY, WRITE_READY = 0x33, 0x66, 0x88, 0x99
OK, ACCESS_DENIED, LOCKED, BAD_WRITE_CRC, BAD_READ_CRC = 0x09, 0x96, 0xF6, 0xF9, (0xE4, 0xE6)
NO_SUCH_REGISTER, OUT_OF_RANGE = 0x26, 0x56
STATUSES = {OK, 0x26, 0x56, ACCESS_DENIED, 0xEE, LOCKED, BAD_WRITE_CRC, *BAD_READ_CRC}


def inverted_crc(data):
    """Returns the inverted CRC of x^8 + x^7 + x^4 + x^2 + x + 1, most significant bit first."""
    register = 0
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = (register << 1 ^ (0x97 if register & 0x80 else 0)) & 0xFF
    return register ^ 0xFF


class Client:
    """An EncoLink client that sends position frames and decodes channels 2 and 3."""

    def __init__(self, case, path, turns):
        self.case = case
        self.size = 7 if turns else 5
        self.port = os.open(path, os.O_RDWR | os.O_NOCTTY)
        case.addCleanup(os.close, self.port)
        tty.setraw(self.port)
        self.pending = b""  # bytes for channel 3 that are still to be sent
        # Bytes of channel 2 received in the current cycle.
        self.cycle = None
        self.cycles = []  # complete cycles of channel 2: (turns, position, status, byte of channel 3)

    def read(self, size):
        data = b""
        while len(data) < size:
            self.case.assertTrue(select.select([self.port], [], [], PATIENCE)[0], data.hex())
            data += os.read(self.port, 1)
        return data

    def frame(self, config=POSITION):
        """Exchanges one frame. Returns turns (or None), the position of 22 bits, error and warning."""
        out, self.pending = self.pending[:1], self.pending[1:]
        os.write(self.port, bytes([config]) + (out or b"\0"))
        reply = self.read(self.size)
        position, turns = self.decode(reply[:-2], reply[-2])
        if config == RESET_CHANNELS:
            self.cycle = b""  # a new cycle of channel 2 begins with the next frame
        elif self.cycle is not None:
            self.channel2(reply[-1], position, turns)
        return turns, position >> 2, not position & 2, not position & 1

    def decode(self, data, crc):
        self.case.assertEqual(crc, inverted_crc(data))
        turns = int.from_bytes(data[:2], "big") if len(data) == 5 else None
        return int.from_bytes(data[-3:], "big"), turns

    def channel2(self, byte, position, turns):
        if not self.cycle:
            self.begin = (position, turns)
        self.cycle += bytes([byte])
        if len(self.cycle) < self.size + 2:
            return
        data, crc = self.cycle[:-1], self.cycle[-1]
        self.case.assertEqual(crc, inverted_crc(data))
        latched, latched_turns = self.decode(data[:-3], inverted_crc(data[:-3]))
        self.case.assertEqual((latched, latched_turns), self.begin)
        self.cycles.append((latched_turns, latched, int.from_bytes(data[-3:-1], "big"), data[-1]))
        self.cycle = b""

    def next_cycle(self):
        count = len(self.cycles)
        while len(self.cycles) == count:
            self.frame()
        return self.cycles[-1]

    def channel3(self):
        return self.next_cycle()[3]

    def access(self, kind, address, data=b"", size=0, spoil=False):
        """Accesses a register through channel 3. Returns the status and the data."""
        body = (size or len(data)).to_bytes(2, "big") + address.to_bytes(4, "big") + data
        self.pending = KEYS + bytes([kind]) + body + bytes([inverted_crc(body) ^ (1 if spoil else 0)])
        while self.pending:
            self.frame()
        for _ in range(2000):
            answer = self.channel3()
            if answer in (READ_READY, WRITE_READY):
                break
            self.case.assertIn(answer, (IDLE, BUSY))
        self.case.assertEqual(answer, READ_READY if kind == READ else WRITE_READY)
        status = self.channel3()
        self.case.assertIn(status, STATUSES)
        got = bytes(self.channel3() for _ in range(size)) if kind == READ and status == OK else b""
        return status, got

    def identify(self):
        self.frame(IDENTIFY)
        os.write(self.port, bytes([POSITION, 0]))
        reply = self.read(19)
        self.case.assertEqual(reply[-1], inverted_crc(reply[:-1]))
        return reply[:-1]


class Encolink(Case):
    def client(self, *arguments, turns=True):
        emulator = Emulator(self.directory, *arguments, protocol="encolink", name=f"turns-{turns}")
        self.addCleanup(emulator.end)
        return Client(self, emulator.path, turns)

    def options(self, turns):
        return ["--option", "resolution=22", "--option", f"multiturn_bits={16 if turns else 0}"]

    def test_positions(self):
        for turns in (True, False):
            with self.subTest(turns=turns):
                client = self.client(*self.options(turns), "--singleturn", "123456", *(["--multiturn", "77"] if turns else []),
                                     turns=turns)
                for _ in range(20):
                    self.assertEqual(client.frame(), (77 if turns else None, 123456, False, False))

    def test_channel_2(self):
        client = self.client(*self.options(True), "--singleturn", "5", "--motion", "rpm=10", "--alarm", "signal_lost")
        client.frame(RESET_CHANNELS)
        cycles = [client.next_cycle() for _ in range(5)]
        self.assertEqual({status >> 5 & 1 for _, _, status, _ in cycles}, {1})
        self.assertEqual({answer for *_, answer in cycles}, {IDLE})
        self.assertGreater(len({position for _, position, _, _ in cycles}), 1)

    def test_identity(self):
        client = self.client(*self.options(True))
        identity = client.identify()
        self.assertIn(identity[0], (2, 4))
        self.assertEqual((identity[1], identity[10:12]), (7, b"22"))
        self.assertEqual(client.frame()[1], 0)

    def test_registers(self):
        client = self.client(*self.options(True))
        client.frame(RESET_CHANNELS)
        status, temperature = client.access(READ, 0x4C, size=2)
        self.assertEqual((status, len(temperature)), (OK, 2))
        status, serial = client.access(READ, 0x5C, size=8)
        self.assertEqual((status, len(serial)), (OK, 8))
        self.assertEqual(client.access(READ, 0x00, size=4), (OK, bytes(4)))
        self.assertEqual(client.access(WRITE, 0x00, bytes([0, 0x10, 0, 0]))[0], OK)
        self.assertEqual(client.access(READ, 0x00, size=4), (OK, bytes([0, 0x10, 0, 0])))
        self.assertEqual(client.frame()[1], 2**20)

    def test_every_register_of_vendor_map(self):
        client = self.client(*self.options(True))
        client.frame(RESET_CHANNELS)
        sizes = {0x00: 4, 0x04: 4, 0x08: 4, 0x0C: 4, 0x10: 4, 0x14: 4, 0x19: 2, 0x1B: 2, 0x1D: 2, 0x1F: 2, 0x2E: 1, 0x2F: 2,
                 0x31: 2, 0x33: 4, 0x35: 4, 0x4C: 2, 0x50: 4, 0x52: 1, 0x5C: 8, 0x64: 20, 0x100: 16, 0x120C: 4, 0x1210: 4,
                 0x1214: 4, 0x1218: 4}
        for address, size in sizes.items():
            with self.subTest(address):
                status, data = client.access(READ, address, size=size)
                self.assertEqual((status, len(data)), (OK, size))

    def test_vendor_example_of_value_out_of_range(self):
        client = self.client(*self.options(True))
        client.frame(RESET_CHANNELS)
        self.assertEqual(client.access(WRITE, 0x00, b"\xff\xff\xff\xff")[0], OUT_OF_RANGE)
        self.assertEqual(client.access(READ, 0x00, size=4), (OK, bytes(4)))

    def test_identity_as_vendor_library_reads_it(self):
        """The vendor's library reads twenty bytes in reply to the identify frame."""
        client = self.client(*self.options(True), "--option", "identity_bytes=20")
        for config in (IDENTIFY, POSITION):
            os.write(client.port, bytes([config, 0]))
            reply = client.read(20)
        self.assertEqual((reply[18], reply[1], reply[10:12]), (inverted_crc(reply[:18]), 7, b"22"))
        self.assertEqual(client.frame()[1], 0)

    def test_version_4(self):
        client = self.client(*self.options(True), "--option", "protocol_version=4", "--singleturn", "77")
        self.assertEqual(client.identify()[0], 4)
        self.assertEqual(client.frame()[1], 77)
        client.frame(RESET_CHANNELS)
        self.assertEqual(client.access(WRITE, 0x49, b"\x63")[0], NO_SUCH_REGISTER)

    def test_refuses_bad_access(self):
        client = self.client(*self.options(True))
        client.frame(RESET_CHANNELS)
        self.assertEqual(client.access(WRITE, 0x5C, bytes(8))[0], ACCESS_DENIED)
        self.assertIn(client.access(READ, 0x4C, size=2, spoil=True)[0], BAD_READ_CRC)
        self.assertEqual(client.access(WRITE, 0x00, bytes(4), spoil=True)[0], BAD_WRITE_CRC)
        self.assertEqual(client.access(WRITE, 0x2E, b"\x01")[0], OK)
        self.assertEqual(client.access(WRITE, 0x00, bytes([1, 0, 0, 0]))[0], LOCKED)
        self.assertEqual(client.access(READ, 0x00, size=4), (OK, bytes(4)))

    def test_incomplete_key_has_no_effect(self):
        client = self.client(*self.options(True))
        client.frame(RESET_CHANNELS)
        client.pending = bytes([0x00, 0xCD, 0xEF, 0x88, 0xAB, READ, 0, 2])
        while client.pending:
            client.frame()
        self.assertEqual({client.channel3() for _ in range(5)}, {IDLE})
        self.assertEqual(client.access(READ, 0x4C, size=2)[0], OK)


if __name__ == "__main__":
    unittest.main()
