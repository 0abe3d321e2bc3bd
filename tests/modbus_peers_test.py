#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests Modbus RTU against libmodbus and mbpoll."""
import ctypes
import errno
import json
import os
import re
import select
import subprocess
import threading
import tty
import unittest

from command_support import PATIENCE, Case, Emulator, absenc

MODBUS = ctypes.CDLL("libmodbus.so.5", use_errno=True)
MODBUS.modbus_new_rtu.restype = ctypes.c_void_p
MODBUS.modbus_new_rtu.argtypes = [ctypes.c_char_p, ctypes.c_int, ctypes.c_char, ctypes.c_int, ctypes.c_int]
MODBUS.modbus_mapping_new.restype = ctypes.c_void_p
MODBUS.modbus_strerror.restype = ctypes.c_char_p
MODBUS.modbus_set_response_timeout.argtypes = [ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32]
MODBUS.modbus_set_slave.argtypes = [ctypes.c_void_p, ctypes.c_int]
MODBUS.modbus_read_registers.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int, ctypes.c_void_p]
MODBUS.modbus_read_input_registers.argtypes = MODBUS.modbus_read_registers.argtypes
MODBUS.modbus_write_register.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_uint16]
MODBUS.modbus_send_raw_request.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int]
MODBUS.modbus_receive_confirmation.argtypes = [ctypes.c_void_p, ctypes.c_char_p]
MODBUS.modbus_receive.argtypes = [ctypes.c_void_p, ctypes.c_char_p]
MODBUS.modbus_reply.argtypes = [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_int, ctypes.c_void_p]
for function in ("modbus_connect", "modbus_close", "modbus_free", "modbus_mapping_free", "modbus_get_socket"):
    getattr(MODBUS, function).argtypes = [ctypes.c_void_p]


def crc(data):
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ 0xA001 if value & 1 else value >> 1
    return value


class Mapping(ctypes.Structure):
    """The struct modbus_mapping_t of libmodbus 3.1."""
    _fields_ = [(name, ctypes.c_int) for name in (
        "nb_bits", "start_bits", "nb_input_bits", "start_input_bits", "nb_input_registers", "start_input_registers",
        "nb_registers", "start_registers")] + [("tab_bits", ctypes.POINTER(ctypes.c_uint8)),
                                               ("tab_input_bits", ctypes.POINTER(ctypes.c_uint8)),
                                               ("tab_input_registers", ctypes.POINTER(ctypes.c_uint16)),
                                               ("tab_registers", ctypes.POINTER(ctypes.c_uint16))]


class Libmodbus:
    """A libmodbus context at one end of a line."""

    def __init__(self, path, address, baud=19200):
        self.context = MODBUS.modbus_new_rtu(path.encode(), baud, b"N", 8, 1)
        self.check(MODBUS.modbus_set_slave(self.context, address))
        self.check(MODBUS.modbus_connect(self.context))
        self.check(MODBUS.modbus_set_response_timeout(self.context, 5, 0))

    def check(self, result):
        if result < 0:
            number = ctypes.get_errno()
            raise OSError(number, MODBUS.modbus_strerror(number).decode())
        return result

    def read(self, first, count, function=MODBUS.modbus_read_registers):
        registers = (ctypes.c_uint16 * count)()
        self.check(function(self.context, first, count, registers))
        return list(registers)

    def close(self):
        MODBUS.modbus_close(self.context)
        MODBUS.modbus_free(self.context)


class PeerCase(Case):
    def emulator(self, *arguments, name="encoder"):
        emulator = Emulator(self.directory, *arguments, protocol="raa38-modbus", name=name)
        self.addCleanup(emulator.end)
        return emulator

    def client(self, path, address=1, baud=19200):
        client = Libmodbus(path, address, baud)
        self.addCleanup(client.close)
        return client

    def position(self, path, options=""):
        result = absenc("read", f"raa38-modbus:{path}?latency=300{options}", "--json")
        self.assert_good(result)
        return json.loads(result.stdout)["singleturn"]


class LibmodbusClient(PeerCase):
    def test_reads_position(self):
        for bits, position in ((10, 1023), (14, 383), (16, 0xFEDC), (17, 0x1FFFF), (21, 0x1FABCD)):
            with self.subTest(bits):
                emulator = self.emulator("--option", f"bits={bits}", "--singleturn", str(position), name=f"e{bits}")
                client = Libmodbus(emulator.path, 1)
                high, low = client.read(0, 2)
                if bits <= 16:
                    self.assertEqual(client.read(0, 1), [position])
                client.close()
                self.assertEqual(high << 16 | low, position)
                self.assertEqual(self.position(emulator.path, f"&bits={bits}"), position)

    def test_several_encoders_on_one_line(self):
        emulator = self.emulator("--singleturn", "11", "--also", "address=2&singleturn=22", "--also",
                                 "address=247&singleturn=33")
        for address, position in ((1, 11), (2, 22), (247, 33)):
            client = Libmodbus(emulator.path, address)
            self.assertEqual(client.read(0, 1), [position])
            client.close()

    def test_exceptions_have_texts_of_libmodbus(self):
        client = self.client(self.emulator().path)
        write = MODBUS.modbus_write_register
        for words, ask in (("Illegal function", lambda: client.read(0, 1, MODBUS.modbus_read_input_registers)),
                           ("Illegal function", lambda: client.check(write(client.context, 0, 1))),
                           ("Illegal data address", lambda: client.read(1, 1)),
                           ("Illegal data address", lambda: client.read(0, 3))):
            with self.assertRaisesRegex(OSError, words):
                ask()
        # libmodbus refuses to send this invalid request, so the test sends the bytes itself.
        client.check(MODBUS.modbus_send_raw_request(client.context, bytes([1, 3, 0, 0, 0, 0]), 6))
        reply = ctypes.create_string_buffer(260)
        size = client.check(MODBUS.modbus_receive_confirmation(client.context, reply))
        self.assertEqual(reply.raw[:size - 2], bytes([1, 0x83, 3]), "illegal data value")
        self.assertEqual(client.read(0, 1), [0])

    def test_times_out_at_other_rate_or_address(self):
        path = self.emulator().path
        for address, baud in ((1, 9600), (2, 19200)):
            client = Libmodbus(path, address, baud)
            client.check(MODBUS.modbus_set_response_timeout(client.context, 0, 200_000))
            with self.assertRaises(OSError) as raised:
                client.read(0, 1)
            self.assertEqual(raised.exception.errno, errno.ETIMEDOUT)
            client.close()

    def test_uses_address_and_baud_rate_set_by_absenc(self):
        emulator = self.emulator("--singleturn", "500")
        for setting in (("address", "9"), ("baud", "57600")):
            uri = f"raa38-modbus:{emulator.path}?latency=300&address={9 if setting[0] == 'baud' else 1}"
            self.assert_good(absenc("config", "set", uri, *setting, "--yes"))
        client = self.client(emulator.path, 9, 57600)
        self.assertEqual(client.read(0, 1), [500])


class LibmodbusServer:
    """A libmodbus server on a pseudo-terminal, with fixed holding registers."""

    def __init__(self, registers, address=1):
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        # libmodbus opens a path itself, so it gets one end of a second pseudo-terminal.
        self.inner, self.inner_slave = os.openpty()
        tty.setraw(self.inner_slave)
        self.path = os.ttyname(self.slave)
        self.server = Libmodbus(os.ttyname(self.inner_slave), address)
        self.mapping = MODBUS.modbus_mapping_new(0, 0, len(registers), 0)
        self.registers = ctypes.cast(self.mapping, ctypes.POINTER(Mapping)).contents.tab_registers
        for i, register in enumerate(registers):
            self.registers[i] = register
        self.wake, self.waker = os.pipe()
        self.answered = 0
        self.threads = [threading.Thread(target=self.serve), threading.Thread(target=self.pass_on)]

    def serve(self):
        query = ctypes.create_string_buffer(260)
        while True:
            ready, _, _ = select.select([MODBUS.modbus_get_socket(self.server.context), self.wake], [], [])
            if self.wake in ready:
                return
            size = MODBUS.modbus_receive(self.server.context, query)
            if size > 0:
                MODBUS.modbus_reply(self.server.context, query, size, self.mapping)
                self.answered += 1

    def pass_on(self):
        while True:
            ready, _, _ = select.select([self.master, self.inner, self.wake], [], [])
            if self.wake in ready:
                return
            for here, there in ((self.master, self.inner), (self.inner, self.master)):
                if here in ready:
                    os.write(there, os.read(here, 512))

    def __enter__(self):
        for thread in self.threads:
            thread.start()
        return self

    def __exit__(self, *_):
        os.write(self.waker, b"x")
        for thread in self.threads:
            thread.join(PATIENCE)
        self.server.close()
        MODBUS.modbus_mapping_free(self.mapping)
        for descriptor in (self.master, self.slave, self.inner, self.inner_slave, self.wake, self.waker):
            os.close(descriptor)


class ReadsLibmodbus(PeerCase):
    def test_reads_one_and_two_registers(self):
        with LibmodbusServer([383]) as server:
            self.assertEqual(self.position(server.path), 383)
            self.assertGreaterEqual(server.answered, 2)
        with LibmodbusServer([0x001F, 0xABCD]) as server:
            self.assertEqual(self.position(server.path, "&bits=21"), 0x1FABCD)
        with LibmodbusServer([0, 383], address=17) as server:
            self.assertEqual(self.position(server.path, "&registers=2&address=17"), 383)

    def test_replies_that_end_with_zero(self):
        """If the CRC ends with 00, the frame without that byte has a valid CRC too."""
        positions = [low for low in range(2048) if crc(bytes([1, 3, 4, 0, 0x10, low >> 8, low & 0xFF])) < 0x100]
        self.assertGreater(len(positions), 3)
        with LibmodbusServer([0x0010, 0]) as server:
            for low in positions[:4]:
                server.registers[1] = low
                self.assertEqual(self.position(server.path, "&bits=21"), 0x100000 + low)

    def test_reports_exception(self):
        with LibmodbusServer([]) as server:
            result = absenc("read", f"raa38-modbus:{server.path}?latency=300")
            self.assert_failed(result, "request_rejected", "exception 02, illegal data address", "01 83 02 C0 F1")

    def test_refuses_position_out_of_range(self):
        with LibmodbusServer([0x4000]) as server:
            self.assert_failed(absenc("read", f"raa38-modbus:{server.path}?latency=300"), "out_of_range", "more bits")


class Mbpoll(PeerCase):
    def mbpoll(self, path, *arguments):
        command = ["mbpoll", "-m", "rtu", "-b", "19200", "-P", "none", "-0", "-1", "-o", "5", *arguments, path]
        return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, stdin=subprocess.DEVNULL)

    def test_polls_position(self):
        emulator = self.emulator("--singleturn", "383", "--also", "address=5&singleturn=12345")
        for address, position in ((1, 383), (5, 12345)):
            polled = self.mbpoll(emulator.path, "-a", str(address), "-t", "4", "-r", "0", "-c", "1")
            self.assertEqual(polled.returncode, 0, polled.stderr)
            self.assertEqual(re.findall(r"^\[0\]:\s+(\d+)", polled.stdout, re.MULTILINE), [str(position)])
            self.assertEqual(self.position(emulator.path, f"&address={address}"), position)

    def test_polls_two_registers(self):
        emulator = self.emulator("--option", "bits=21", "--singleturn", str(0x1FABCD))
        polled = self.mbpoll(emulator.path, "-a", "1", "-t", "4:hex", "-r", "0", "-c", "2")
        self.assertEqual(re.findall(r"^\[\d\]:\s+(0x\w+)", polled.stdout, re.MULTILINE), ["0x001F", "0xABCD"])

    def test_reports_exception(self):
        polled = self.mbpoll(self.emulator().path, "-a", "1", "-t", "3", "-r", "0", "-c", "1")
        self.assertIn("Illegal function", polled.stdout + polled.stderr)


if __name__ == "__main__":
    unittest.main()
