# SPDX-License-Identifier: Apache-2.0
"""Tests two 16550 UARTs, /dev/ttyS1 and /dev/ttyS2, which are the two ends of one line."""
import errno
import fcntl
import json
import os
import random
import select
import signal
import struct
import subprocess
import termios
import threading
import tty

from command_support import Emulator, EncoderCase, absenc, end, json_lines
from tap_support import Relay, TapCase, joined

PORT, OTHER = "/dev/ttyS1", "/dev/ttyS2"
REGISTERS = 0x2F8  # I/O address of the registers of the UART whose device is PORT
CLOCK = 115200  # baud rate of the UART with a divisor of 1
NOBODY = 65534
PARITY = termios.PARENB | termios.PARODD

# Constants and a struct of Linux, from <asm-generic/ioctls.h>, <asm-generic/termbits.h>, <linux/serial.h> and
# <linux/tty_flags.h>
TCGETS2, BOTHER, BAUD_MASK = 0x802C542A, 0o010000, 0o010017
TIOCGSERIAL, TIOCSSERIAL, ASYNC_LOW_LATENCY = 0x541E, 0x541F, 1 << 13
SERIAL_STRUCT = struct.Struct("iiIiiiiiHcciPHIL")
FLAGS = 4  # index of `flags` among the members of struct serial_struct


def settings(path):
    """Returns the members of struct termios2."""
    descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        return struct.unpack("IIIIB19sII", fcntl.ioctl(descriptor, TCGETS2, bytes(44)))
    finally:
        os.close(descriptor)


def serial_struct(path, change=None):
    descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        fields = list(SERIAL_STRUCT.unpack(fcntl.ioctl(descriptor, TIOCGSERIAL, bytes(SERIAL_STRUCT.size))))
        if change is not None:
            change(fields)
            fcntl.ioctl(descriptor, TIOCSSERIAL, SERIAL_STRUCT.pack(*fields))
        return fields
    finally:
        os.close(descriptor)


def divisor():
    """Returns the divisor latch of the UART. It is accessed through the UART's data registers."""
    with open("/dev/port", "r+b", buffering=0) as registers:
        def get(number):
            registers.seek(REGISTERS + number)
            return registers.read(1)[0]

        def put(number, value):
            registers.seek(REGISTERS + number)
            registers.write(bytes([value]))

        line_control = get(3)
        put(3, line_control | 0x80)
        latch = get(0) | get(1) << 8
        put(3, line_control)
        return latch


class EncoderAtOneRate(threading.Thread):
    """A fake encoder that replies correctly only while PORT has the encoder's baud rate."""

    # Reply of a T-format encoder to the request 1A: 17 bits of position and 16 bits of turns, both 0, without an
    # alarm.
    REPLY = bytes.fromhex("1a 00000000 11 000000 00 0b")

    def __init__(self, rate):
        super().__init__()
        self.rate = rate
        self.line = os.open(OTHER, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.line)
        self.wake, self.waker = os.pipe()

    def run(self):
        noise = random.Random(5)
        while self.wake not in select.select([self.line, self.wake], [], [])[0]:
            for _ in os.read(self.line, 64):
                is_heard = settings(PORT)[-1] == self.rate
                os.write(self.line, self.REPLY if is_heard else noise.randbytes(len(self.REPLY)))

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        os.write(self.waker, b"x")
        self.join()
        for descriptor in (self.line, self.wake, self.waker):
            os.close(descriptor)


class Uart(EncoderCase):
    def emulator(self, *arguments, baud, protocol="tformat"):
        emulator = Emulator("/dev", *arguments, protocol=protocol, name=f"{OTHER}?baud={baud}", line="--port")
        self.addCleanup(emulator.end)
        return emulator

    def read(self, more, *arguments):
        return absenc("read", f"tformat:{PORT}?latency=2000&{more}", *arguments)

    def reader(self, more):
        """Starts an endless `read` with a long interval, and waits for its first reading."""
        process = self.start("read", f"tformat:{PORT}?latency=2000&{more}", "--count", "0", "--rate", "0.01")
        self.first_line(process)
        return process

    def test_baud_rates(self):
        """Only the first of the three rates has a name in <termios.h>."""
        for baud, name in ((38400, termios.B38400), (23040, BOTHER), (14400, BOTHER)):
            with self.subTest(baud):
                emulator = self.emulator("--singleturn", "1000", baud=baud)
                reader = self.reader(f"baud={baud}")
                _, _, control, _, _, _, _, rate = settings(PORT)
                self.assertEqual((control & BAUD_MASK, rate), (name, baud))
                self.assertEqual(divisor(), CLOCK // baud)
                self.assertEqual(end(reader, signal.SIGINT)[0], 0)
                emulator.end()

    def test_reports_impossible_rate(self):
        result = self.read("baud=2500000")
        self.assert_failed(result, f"the port {PORT} cannot do 2500000 baud", "nearest rate is 115200")
        result = absenc("emulate", "tformat", "--port", PORT, "--for", "5")
        self.assert_failed(result, "cannot do 2500000 baud")

    def doctor(self, baud):
        found = json.loads(absenc("doctor", f"tformat:{PORT}?latency=300&baud={baud}", "--for", "1", "--json").stdout)
        return found["verdict"]

    def test_doctor_names_rate(self):
        for rate, positions in ((19200, 57600), (57600, 9600)):
            with self.subTest(rate), EncoderAtOneRate(rate):
                self.assertRegex(self.doctor(positions), f"^first: wrong_baud: set baud={rate}$")
                self.assertRegex(self.doctor(rate), "^good: ")

    def test_doctor_reports_impossible_rate(self):
        self.assertRegex(self.doctor(2500000), "^first: port_rate: ")

    def test_reports_port_without_hardware(self):
        self.assert_failed(absenc("read", "tformat:/dev/ttyS3"), "the port /dev/ttyS3 is there", "no hardware")

    def test_settings_are_restored(self):
        subprocess.run(["stty", "-F", PORT, "1200", "parenb", "parodd", "cs7", "echo"], check=True)
        before = settings(PORT)
        self.emulator(baud=57600)
        reader = self.reader("baud=57600")
        self.assertNotEqual(settings(PORT), before)
        self.assertEqual(end(reader, signal.SIGINT)[0], 0)
        self.assertEqual(settings(PORT), before)

    def test_new_baud_rate_keeps_parity(self):
        """A change of the baud rate must keep the parity of host and encoder."""
        emulator = Emulator("/dev", protocol="raa38-modbus", name=f"{OTHER}?parity=odd", line="--port")
        self.addCleanup(emulator.end)
        address = f"raa38-modbus:{PORT}?latency=2000&parity=odd"
        self.assert_good(absenc("config", "set", address, "baud", "9600", "--yes"))
        reader = self.start("read", f"{address}&baud=9600", "--count", "0", "--rate", "10")
        self.first_line(reader)
        for path in (PORT, OTHER):
            _, _, control, _, _, _, _, rate = settings(path)
            self.assertEqual((rate, control & PARITY), (9600, PARITY), path)
        self.assertEqual(end(reader, signal.SIGINT)[0], 0)

    def test_rs485(self):
        """The 16550 has no RS-485 mode. The option rs485=on must fail; the others work, also RTS by absenc itself."""
        self.emulator("--singleturn", "1000", baud=115200)
        for choice in ("auto", "off", "rts"):
            result = self.read(f"baud=115200&rs485={choice}", "--json")
            self.assert_good(result)
            self.assertEqual(json.loads(result.stdout)["singleturn"], 1000)
        result = self.read("baud=115200&rs485=on")
        self.assert_failed(result, f"the driver of the port {PORT} cannot switch the direction")

    def test_low_latency(self):
        def clear(fields):
            fields[FLAGS] &= ~ASYNC_LOW_LATENCY
        serial_struct(PORT, clear)
        self.assertFalse(serial_struct(PORT)[FLAGS] & ASYNC_LOW_LATENCY)
        self.emulator(baud=115200)
        self.assert_good(self.read("baud=115200"))
        self.assertTrue(serial_struct(PORT)[FLAGS] & ASYNC_LOW_LATENCY)

    def test_port_of_another_absenc_is_in_use(self):
        self.emulator(baud=115200)
        reader = self.reader("baud=115200")
        self.assert_failed(self.read("baud=115200"), f"the port {PORT} is in use by absenc", str(reader.pid))
        result = absenc("emulate", "tformat", "--port", f"{PORT}?baud=115200", "--for", "5")
        self.assert_failed(result, "is in use by absenc")
        self.assertEqual(end(reader, signal.SIGINT)[0], 0)
        self.assert_good(self.read("baud=115200"))

    def test_port_is_exclusive(self):
        """While absenc uses the port, other users cannot open it, except root."""
        os.chmod(PORT, 0o666)
        self.addCleanup(os.chmod, PORT, 0o600)
        self.emulator(baud=115200)
        reader = self.reader("baud=115200")
        self.assertEqual(self.error_of_nobody(), errno.EBUSY)
        self.assertEqual(end(reader, signal.SIGINT)[0], 0)
        self.assertEqual(self.error_of_nobody(), 0)

    def error_of_nobody(self):
        child = os.fork()
        if child == 0:
            os.setuid(NOBODY)
            try:
                os.open(PORT, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            except OSError as error:
                os._exit(error.errno)
            os._exit(0)
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])


class TapOnUart(TapCase):
    COUNT = 300
    BAUD = 57600  # a baud rate that both T-format and the Modbus of RAA38 support

    def test_shows_every_exchange(self):
        """tap must show every exchange of the known bytes on the line."""
        for protocol in ("tformat", "raa38-modbus"):
            with self.subTest(protocol):
                emulator = self.emulator(protocol, "--motion", "rpm=60", name=f"e-{protocol}")
                subprocess.run(["stty", "-F", OTHER, str(self.BAUD), "raw", "-echo"], check=True)
                with Relay(emulator.path, copy_to=OTHER) as relay:
                    tap = self.tap(f"{PORT}?baud={self.BAUD}", protocol, "--json")
                    host = absenc("read", f"{protocol}:{relay.host_path}?latency=2000", "--json", "--rate", "0",
                                  "--count", str(self.COUNT), timeout=3600)
                    self.assert_good(host)
                    self.wait_for_all(tap, relay)
                    status, text, messages = self.finish(tap)
                    lines, summary = self.lines(text)
                    self.assertEqual([line for line in lines if line["kind"] != "exchange" or not line["ok"]], [], messages)
                    self.assertEqual(joined(lines), relay.copied.hex())
                    self.assertEqual((status, summary["bytes"]), (0, len(relay.copied)), messages)
                    positions = [line["fields"]["singleturn"] for line in lines if "singleturn" in line["fields"]]
                    for reading in json_lines(host.stdout):
                        self.assertIn(reading["singleturn"], positions)
                emulator.end()
