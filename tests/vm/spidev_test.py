# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc emulate --spidev` on a CUSE device."""
import ctypes
import errno
import fcntl
import json
import os
import re
import signal
import stat
import struct
import subprocess
import threading
import time
import unittest

from command_support import ABSENC, PATIENCE, absenc, end, read_line
from doctor_test import doctor, ids

MAGIC = ord("k")
CPHA, CPOL, CS_HIGH, LSB_FIRST = 1, 2, 4, 8


def request(read, number, size):
    return (2 if read else 1) << 30 | size << 16 | MAGIC << 8 | number


RD_MODE, WR_MODE = request(True, 1, 1), request(False, 1, 1)
RD_LSB_FIRST, WR_LSB_FIRST = request(True, 2, 1), request(False, 2, 1)
RD_BITS, WR_BITS = request(True, 3, 1), request(False, 3, 1)
RD_SPEED, WR_SPEED = request(True, 4, 4), request(False, 4, 4)
RD_MODE32, WR_MODE32 = request(True, 5, 4), request(False, 5, 4)


def crc8(data):
    """Returns the inverted CRC of the polynomial x^8 + x^7 + x^4 + x^2 + x + 1."""
    register = 0
    for byte in data:
        register ^= byte
        for _ in range(8):
            register = register << 1 ^ (0x197 if register & 0x80 else 0)
    return register ^ 0xFF


class Transfer:
    """One transfer of an SPI message. `out`: bytes to send; `take`: whether to receive."""

    def __init__(self, out=None, size=None, take=True, speed=0, delay=0, bits=0, change=0, wires=0):
        size = len(out) if size is None else size
        self.out = None if out is None else ctypes.create_string_buffer(bytes(out), size)
        self.into = ctypes.create_string_buffer(b"\xA5" * size, size) if take else None
        address = [0 if buffer is None else ctypes.addressof(buffer) for buffer in (self.out, self.into)]
        self.packed = struct.pack("=QQIIHBBBBBB", *address, size, speed, delay, bits, change, wires, 0, 0, 0)

    @property
    def received(self):
        return self.into.raw


class Spi:
    """A client of the ioctl interface of spidev."""

    def __init__(self, path, mode=None, speed=None):
        self.descriptor = os.open(path, os.O_RDWR)
        if mode is not None:
            self.put(WR_MODE, "B", mode)
        if speed is not None:
            self.put(WR_SPEED, "I", speed)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.descriptor)

    def get(self, number, code):
        return struct.unpack(code, fcntl.ioctl(self.descriptor, number, bytes(struct.calcsize(code))))[0]

    def put(self, number, code, value):
        fcntl.ioctl(self.descriptor, number, struct.pack(code, value))

    def message(self, *transfers):
        packed = bytearray(b"".join(transfer.packed for transfer in transfers))
        # The message is passed as a mutable buffer, because fcntl copies at most 1024 bytes of an immutable one.
        return fcntl.ioctl(self.descriptor, request(False, 0, len(packed)), packed, True)

    def exchange(self, out, **settings):
        transfer = Transfer(out, **settings)
        assert self.message(transfer) == len(out)
        return transfer.received


class SpidevCase(unittest.TestCase):
    def serve(self, protocol, *arguments, name="spidev9.0", **settings):
        process = subprocess.Popen([ABSENC, "emulate", protocol, "--spidev", name, *arguments], bufsize=0,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   **settings)
        self.addCleanup(lambda: end(process) if process.returncode is None else None)
        ready = read_line(process.stdout, time.monotonic() + PATIENCE)
        if ready is None:
            self.fail(f"it did not become ready: {end(process)}")
        self.assertEqual(ready, f"ready: /dev/{name}\n")
        return process

    def summary(self, process, number=signal.SIGINT):
        """Ends the emulator and returns its messages, which include its summary."""
        status, out, err = end(process, number)
        self.assertEqual((status, out), (0, ""), err)
        return err

    def good(self, *arguments):
        result = absenc(*arguments)
        self.assertEqual(result.returncode, 0, f"{arguments}\n{result.stdout}\n{result.stderr}")
        return result

    def failed(self, *arguments):
        result = absenc(*arguments)
        self.assertEqual(result.returncode, 1, f"{arguments}\n{result.stdout}\n{result.stderr}")
        return result

    def reading(self, encoder):
        return json.loads(self.good("read", encoder, "--json").stdout)

    def refused(self, error, action):
        with self.assertRaises(OSError) as caught:
            action()
        self.assertEqual(errno.errorcode[caught.exception.errno], errno.errorcode[error])


class Command(SpidevCase):
    def test_encolink(self):
        process = self.serve("encolink", "--singleturn", "12345", "--multiturn", "7")
        reading = self.reading("encolink:spi:/dev/spidev9.0")
        self.assertEqual((reading["singleturn"], reading["multiturn"]), (12345, 7))
        info = self.good("info", "encolink:spi:/dev/spidev9.0").stdout
        for words in ("MB080SLA20MENT00", "AK2A0001", "35 degC"):
            self.assertIn(words, info)
        summary = self.summary(process)
        self.assertRegex(summary, r"^absenc: \d+ requests answered in ")
        self.assertNotIn("rules", summary)
        self.assertNotIn("mode", summary)
        self.assertFalse(os.path.lexists("/dev/spidev9.0"))

    def test_registers_of_encolink(self):
        self.serve("encolink")
        encoder = "encolink:spi:/dev/spidev9.0"
        self.good("run", encoder, "set-position-offset", "262144", "--yes")
        self.assertIn("262144", self.good("run", encoder, "position-offset").stdout)
        self.assertEqual(self.reading(encoder)["singleturn"], 1 << 18)

    def test_ssi(self):
        process = self.serve("ssi", "--singleturn", "2748")
        for _ in range(3):
            self.assertEqual(self.reading("ssi:spi:/dev/spidev9.0")["singleturn"], 2748)
        self.assertEqual(self.reading("ssi:spi:/dev/spidev9.0?spi_mode=2")["singleturn"], 2748)
        self.assertNotIn("rules", self.summary(process))

    def test_biss(self):
        process = self.serve("biss", "--model", "rotary-19-16", "--singleturn", "0x5A5A5", "--multiturn", "4660")
        for speed in (200, 1000, 4000):
            reading = self.reading(f"biss:spi:/dev/spidev9.0?model=rotary-19-16&ma_khz={speed}")
            self.assertEqual((reading["singleturn"], reading["multiturn"]), (0x5A5A5, 4660))
        self.assertNotIn("rules", self.summary(process))

    def test_registers_of_biss(self):
        """A control bit of 1 needs a clock that idles low, so the host changes the SPI mode."""
        process = self.serve("biss", "--motion", "rpm=60")
        encoder = "biss:spi:/dev/spidev9.0"
        info = json.loads(self.good("info", encoder, "--json").stdout)["answers"]["info"]["fields"]
        self.assertEqual((info["slaves"], info["serial_number"], bytes.fromhex(info["device_id"])), (1, 1, b"Absenc"))
        self.good("memory", "write", encoder, "5", "0xA5", "--yes")
        self.assertIn("a5", self.good("memory", "read", encoder, "5", "--json").stdout)
        self.assertNotIn("rules", self.summary(process))

    def test_identify(self):
        """identify must find an unknown BiSS encoder and read its serial number. A busy machine takes longer than the
        usual limit."""
        self.serve("biss", "--motion", "rpm=60")
        result = json.loads(self.good("identify", "spi:/dev/spidev9.0", "--for", "600", "--json").stdout)
        found = result["candidates"][0]
        self.assertEqual((found["protocol"], found["options"].get("singleturn_bits")), ("biss", 19), result)
        self.assertEqual((found["identity"].get("serial_number"), result["complete"]), (1, True), result["notes"])
        self.assertEqual(bytes.fromhex(found["identity"]["device_id"]), b"Absenc")

    def test_turns_in_real_time(self):
        self.serve("encolink", "--motion", "rpm=60")
        lines = self.good("read", "encolink:spi:/dev/spidev9.0", "--count", "20", "--rate", "20", "--json").stdout
        seen = [json.loads(line) for line in lines.splitlines()]
        turned = [(one["multiturn"] + one["singleturn"] / (1 << 20), one["time_s"]) for one in seen]
        self.assertAlmostEqual((turned[-1][0] - turned[0][0]) / (turned[-1][1] - turned[0][1]), 1, delta=0.05)

    def test_wrong_mode_is_detected(self):
        """A read in a wrong SPI mode must fail by the CRC, because bits arrive shifted."""
        for mode in (0, 2, 3):
            with self.subTest(mode):
                process = self.serve("encolink", "--singleturn", "12345")
                result = self.failed("read", f"encolink:spi:/dev/spidev9.0?spi_mode={mode}&resolution=20&multiturn_bits=16")
                self.assertIn("bad_checksum", result.stderr)
                self.assertRegex(self.summary(process), r"messages in another SPI mode than the encoder's, which is 1: \d+\n")

    def test_wrong_mode_of_ssi_is_in_summary(self):
        """In mode 0 each bit of SSI arrives one clock late, and SSI has no check."""
        process = self.serve("ssi", "--singleturn", "2748")
        self.assertEqual(self.reading("ssi:spi:/dev/spidev9.0?spi_mode=0")["singleturn"], (0x1000 | 2748) >> 1)
        self.assertRegex(self.summary(process), r"another SPI mode than the encoder's, which is 3: \d+\n")

    def test_read_refuses_too_high_speed(self):
        process = self.serve("encolink")
        result = absenc("read", "encolink:spi:/dev/spidev9.0?speed=8000000")
        self.assertEqual(result.returncode, 2, result.stdout)
        self.assertIn("allows 4000000 Hz at most", result.stderr)
        self.assertNotIn("clock faster than 4 MHz", self.summary(process))

    def test_emulator_counts_too_high_speed(self):
        process = self.serve("encolink")
        with Spi("/dev/spidev9.0", mode=1, speed=8_000_000) as spi:
            spi.exchange(bytes(8))
        self.assertIn("clock faster than 4 MHz", self.summary(process))
        process = self.serve("ssi")
        self.good("read", "ssi:spi:/dev/spidev9.0?speed=500000")
        self.assertIn("clock outside min_clock_khz to max_clock_khz", self.summary(process))

    def test_faults(self):
        process = self.serve("encolink", "--fault", "corrupt=1")
        self.failed("read", "encolink:spi:/dev/spidev9.0?resolution=20&multiturn_bits=16")
        self.assertRegex(self.summary(process), r"faults injected: \d+ corrupt")

    def test_memory_survives_restart(self):
        for arguments in (["zero", "encolink:spi:/dev/spidev9.0", "--yes"], None):
            process = self.serve("encolink", "--singleturn", "5000", "--memory", "/tmp/spidev-memory")
            if arguments:
                self.good(*arguments)
                with open("/tmp/spidev-memory", encoding="utf-8") as file:
                    before = file.read()
                self.good("run", "encolink:spi:/dev/spidev9.0", "preset-multiturn", "9", "1", "--yes")
                deadline = time.monotonic() + PATIENCE
                now = before
                while now == before and time.monotonic() < deadline:
                    with open("/tmp/spidev-memory", encoding="utf-8") as file:
                        now = file.read()
                self.assertNotEqual(now, before)  # the emulator saves a changed memory to the file while it runs
            reading = self.reading("encolink:spi:/dev/spidev9.0")
            self.assertEqual((reading["singleturn"], reading["multiturn"]), (0, 9))
            self.summary(process, signal.SIGTERM)

    def test_device_in_use(self):
        self.serve("encolink", "--motion", "rpm=6")
        first = subprocess.Popen([ABSENC, "read", "encolink:spi:/dev/spidev9.0", "--count", "0", "--rate", "50"], bufsize=0,
                                 stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(end, first)
        self.assertIsNotNone(read_line(first.stdout, time.monotonic() + PATIENCE))
        self.assertIn("in use", self.failed("read", "encolink:spi:/dev/spidev9.0").stderr)


class Doctor(SpidevCase):
    """Tests findings of `absenc doctor` for a kernel device, which follows every clock."""

    def assert_found(self, encoder, *wanted):
        result, found = doctor(encoder)
        self.assertEqual(result.returncode, 1 if wanted else 0, f"{result.stdout}{result.stderr}")
        self.assertEqual(ids(found), list(wanted), result.stdout)
        return found["findings"]

    def test_good(self):
        self.serve("encolink")
        self.assert_found("encolink:spi:/dev/spidev9.0")

    def test_wrong_mode(self):
        self.serve("encolink", "--singleturn", "12345")
        found = self.assert_found("encolink:spi:/dev/spidev9.0?spi_mode=0&resolution=20&multiturn_bits=16", "wrong_spi_mode")
        self.assertEqual(found[0]["action"], "set spi_mode=1")

    def test_stuck_data_line(self):
        self.serve("encolink", "--fault", "silence=1")
        self.assert_found("encolink:spi:/dev/spidev9.0?resolution=20&multiturn_bits=16", "miso_stuck")


class Lifecycle(SpidevCase):
    def test_creates_character_device(self):
        self.serve("ssi")
        self.assertTrue(stat.S_ISCHR(os.stat("/dev/spidev9.0").st_mode))

    def test_refuses_existing_name(self):
        self.assertIn("/dev/null exists: choose another name", self.failed("emulate", "ssi", "--spidev", "null").stderr)
        self.serve("ssi")
        self.assertIn("exists", self.failed("emulate", "ssi", "--spidev", "spidev9.0").stderr)

    def test_reports_refusal_by_kernel(self):
        """The device still exists without its node, so the kernel makes no other of that name."""
        self.serve("ssi")
        os.remove("/dev/spidev9.0")
        self.assertIn("the kernel did not make /dev/spidev9.0", self.failed("emulate", "ssi", "--spidev", "spidev9.0").stderr)

    def test_refuses_invalid_name(self):
        self.assertIn("no name for a device", self.failed("emulate", "ssi", "--spidev", "../x").stderr)

    def test_reports_missing_permission(self):
        result = subprocess.run([ABSENC, "emulate", "ssi", "--spidev", "spidev9.0"], capture_output=True, text=True,
                                timeout=PATIENCE, stdin=subprocess.DEVNULL, user=65534)
        self.assertEqual(result.returncode, 1)
        self.assertIn("no permission to open /dev/cuse", result.stderr)

    def test_runs_as_ordinary_user(self):
        """The kernel creates the node of the device for root only."""
        os.chmod("/dev/cuse", 0o666)
        self.addCleanup(os.chmod, "/dev/cuse", 0o600)
        self.serve("ssi", "--singleturn", "77", user=65534)
        encoder = "ssi:spi:/dev/spidev9.0"
        result = absenc("read", encoder, user=65534)
        self.assertEqual(result.returncode, 1)
        self.assertIn("no permission to open /dev/spidev9.0", result.stderr)
        os.chmod("/dev/spidev9.0", 0o666)
        self.assertIn("77 counts", absenc("read", encoder, user=65534).stdout)

    def test_reports_missing_cuse_module(self):
        os.rename("/dev/cuse", "/dev/cuse.away")
        self.addCleanup(os.rename, "/dev/cuse.away", "/dev/cuse")
        result = self.failed("emulate", "ssi", "--spidev", "spidev9.0")
        self.assertIn("there is no /dev/cuse: load the kernel's module (`sudo modprobe cuse`)", result.stderr)

    def test_ends_after_given_time(self):
        result = self.good("emulate", "ssi", "--spidev", "spidev9.0", "--for", "0.2")
        self.assertIn("0 requests answered", result.stderr)
        self.assertFalse(os.path.lexists("/dev/spidev9.0"))

    def test_reader_waits_for_device(self):
        """The encoder disappears and returns while a long `read` is running."""
        process = self.serve("encolink", "--singleturn", "1")
        reader = subprocess.Popen([ABSENC, "read", "encolink:spi:/dev/spidev9.0", "--count", "0", "--rate", "50", "--json"],
                                  bufsize=0, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(lambda: end(reader) if reader.returncode is None else None)
        deadline = time.monotonic() + PATIENCE
        self.assertIn('"singleturn":1,', read_line(reader.stdout, deadline))
        self.summary(process)
        self.serve("encolink", "--singleturn", "2")
        line = ""
        while '"singleturn":2,' not in line:
            line = read_line(reader.stdout, deadline)
            self.assertIsNotNone(line)

    def test_ends_during_a_message(self):
        process = self.serve("encolink")
        with Spi("/dev/spidev9.0", mode=1) as spi:
            errors = []

            def slow():
                try:
                    spi.exchange(bytes(1000), speed=100)  # at 100 Hz this transfer takes 80 s
                except OSError as error:
                    errors.append(error.errno)

            thread = threading.Thread(target=slow)
            before = time.monotonic()
            thread.start()
            waiting = "0"
            while waiting == "0" and time.monotonic() < before + PATIENCE:
                with open("/sys/class/cuse/spidev9.0/waiting", encoding="ascii") as file:
                    waiting = file.read().strip()
            self.summary(process)
            thread.join(PATIENCE)
            self.assertEqual(len(errors), 1)
            self.assertIn(errno.errorcode[errors[0]], ("ESHUTDOWN", "ECONNABORTED"))
            self.assertLess(time.monotonic() - before, PATIENCE)
            self.refused(errno.ENOTCONN, lambda: spi.exchange(bytes(2)))


class SpidevInterface(SpidevCase):
    """Tests of the ioctl interface of spidev, used without absenc's host."""

    def setUp(self):
        self.process = self.serve("encolink", "--singleturn", "0x12345", "--multiturn", "0xABC")
        self.spi = Spi("/dev/spidev9.0", mode=1)
        self.addCleanup(self.spi.__exit__)

    FRAME = bytes([0x0A, 0xBC, 0x12, 0x34, 0x50 | 3])  # in the last byte, the bits error and warning are active low

    def check_frame(self, frame):
        self.assertEqual(frame[:5].hex(" "), self.FRAME.hex(" "))
        self.assertEqual(frame[5], crc8(frame[:5]))

    def check_identity(self, frame):
        self.assertEqual(frame, b"\x02\x07MB080SLA20MENT00" + bytes([crc8(frame[:18])]))

    def test_settings(self):
        with Spi("/dev/spidev9.0") as spi:
            self.assertEqual(spi.get(RD_BITS, "B"), 8)
            for mode in (0, 3, 2, 1):
                spi.put(WR_MODE, "B", mode)
                self.assertEqual((spi.get(RD_MODE, "B"), spi.get(RD_MODE32, "I")), (mode, mode))
            spi.put(WR_MODE32, "I", CPOL | LSB_FIRST)
            self.assertEqual((spi.get(RD_MODE, "B"), spi.get(RD_LSB_FIRST, "B")), (CPOL | LSB_FIRST, 1))
            spi.put(WR_LSB_FIRST, "B", 0)
            self.assertEqual(spi.get(RD_MODE32, "I"), CPOL)
            spi.put(WR_SPEED, "I", 123456)
            self.assertEqual(spi.get(RD_SPEED, "I"), 123456)
            spi.put(WR_BITS, "B", 8)

    def test_refuses_unsupported_settings(self):
        self.refused(errno.EINVAL, lambda: self.spi.put(WR_MODE, "B", CS_HIGH))
        self.refused(errno.EINVAL, lambda: self.spi.put(WR_MODE32, "I", 1 << 20))
        self.refused(errno.EINVAL, lambda: self.spi.put(WR_BITS, "B", 16))
        self.refused(errno.EINVAL, lambda: self.spi.put(WR_SPEED, "I", 0))
        self.assertEqual(self.spi.get(RD_MODE, "B"), 1)
        for number in (request(True, 9, 4), request(False, 6, 4), request(True, 0, 32), 0x5401, request(False, 5, 1)):
            self.refused(errno.ENOTTY, lambda number=number: fcntl.ioctl(self.spi.descriptor, number, bytes(64)))
        self.refused(errno.EINVAL, lambda: fcntl.ioctl(self.spi.descriptor, request(False, 0, 33), bytes(33)))
        self.refused(errno.EINVAL, lambda: self.spi.exchange(bytes(2), bits=9))
        self.refused(errno.EINVAL, lambda: self.spi.exchange(bytes(2), wires=4))
        self.refused(errno.EFAULT, lambda: fcntl.ioctl(self.spi.descriptor, request(False, 0, 32),
                                                       struct.pack("=QQIIHBBBBBB", 16, 16, 4, *[0] * 8)))
        self.check_frame(self.spi.exchange(bytes(7)))

    def test_one_transfer(self):
        self.check_frame(self.spi.exchange(bytes(7)))
        self.assertEqual(self.spi.exchange(bytes(9))[7:], b"\xFF\xFF")  # nothing drives the line after the frame

    def test_without_buffers(self):
        into = Transfer(size=7)
        self.assertEqual(self.spi.message(into), 7)
        self.check_frame(into.received)
        self.assertEqual(self.spi.message(Transfer(bytes(7), take=False)), 7)
        self.assertEqual(self.spi.message(Transfer(size=0, take=False)), 0)
        self.assertEqual(self.spi.message(Transfer(size=5, take=False)), 5)
        self.assertEqual(fcntl.ioctl(self.spi.descriptor, request(False, 0, 0), 0), 0)

    def test_sent_bytes_arrive(self):
        """The first byte requests the identity, which follows in the next message."""
        self.spi.message(Transfer(b"\xBB", take=False), Transfer(b"\x00", take=False), Transfer(size=5))
        self.check_identity(self.spi.exchange(bytes(19)))

    def test_several_transfers_are_one_frame(self):
        parts = [Transfer(bytes(2)), Transfer(size=1, delay=20), Transfer(size=0, delay=5), Transfer(bytes(4))]
        self.assertEqual(self.spi.message(*parts), 7)
        self.check_frame(b"".join(part.received for part in parts))

    def test_deselected_between_transfers(self):
        first, second = Transfer(bytes(7), change=1), Transfer(bytes(7))
        self.spi.message(first, second)
        self.check_frame(first.received)
        self.check_frame(second.received)

    def test_left_selected_after_message(self):
        first = self.spi.exchange(bytes(3), change=1)
        self.check_frame(first + self.spi.exchange(bytes(4)))

    def test_many_transfers(self):
        parts = [Transfer(bytes(1)) for _ in range(127)]
        self.assertEqual(self.spi.message(*parts), 127)
        self.check_frame(b"".join(part.received for part in parts[:7]))
        self.refused(errno.EMSGSIZE, lambda: self.spi.message(*[Transfer(bytes(1)) for _ in range(128)]))

    def test_size_limit_of_message(self):
        self.assertEqual(len(self.spi.exchange(bytes(4096), speed=4_000_000)), 4096)
        self.refused(errno.EMSGSIZE, lambda: self.spi.exchange(bytes(4097)))
        self.refused(errno.EMSGSIZE, lambda: self.spi.message(Transfer(bytes(4000)), Transfer(bytes(97))))
        self.refused(errno.EMSGSIZE, lambda: os.read(self.spi.descriptor, 4097))
        self.refused(errno.EMSGSIZE, lambda: os.write(self.spi.descriptor, bytes(4097)))

    def test_read_and_write(self):
        self.check_frame(os.read(self.spi.descriptor, 7))
        self.assertEqual(os.write(self.spi.descriptor, b"\xBB\0\0\0\0\0\0"), 7)
        self.check_identity(os.read(self.spi.descriptor, 19))

    def test_lsb_first(self):
        turned = bytes(int(f"{byte:08b}"[::-1], 2) for byte in self.FRAME)
        self.spi.put(WR_LSB_FIRST, "B", 1)
        self.assertEqual(self.spi.exchange(bytes(7))[:5], turned)

    def test_message_takes_its_time(self):
        before = time.monotonic()
        self.spi.exchange(bytes(500), speed=10_000)
        took = time.monotonic() - before
        self.assertGreaterEqual(took, 0.4)
        self.assertLess(took, 30)

    def test_wrong_mode_shifts_received_bits(self):
        good = int.from_bytes(self.FRAME, "big")
        for mode in (0, 2, 3):
            self.spi.put(WR_MODE, "B", mode)
            self.assertEqual(int.from_bytes(self.spi.exchange(bytes(7))[:5], "big"), 1 << 39 | good >> 1, mode)

    def test_wrong_mode_of_sent_bytes(self):
        for mode, arrives in ((0, True), (2, True), (3, False)):
            self.spi.put(WR_MODE, "B", mode)
            self.spi.exchange(b"\xBB" + bytes(6))
            self.spi.put(WR_MODE, "B", 1)
            if arrives:
                self.check_identity(self.spi.exchange(bytes(19)))
            else:
                self.check_frame(self.spi.exchange(bytes(7)))

    def test_several_openers(self):
        with Spi("/dev/spidev9.0") as other:
            other.put(WR_SPEED, "I", 250_000)
            self.check_frame(other.exchange(bytes(7)))
            self.check_frame(self.spi.exchange(bytes(7)))
        self.assertEqual(self.spi.get(RD_SPEED, "I"), 250_000)
        os.close(self.spi.descriptor)
        self.spi.descriptor = os.open("/dev/spidev9.0", os.O_RDWR)
        # The speed is the default again: when the only descriptor was closed, the driver reset it.
        self.assertEqual(self.spi.get(RD_SPEED, "I"), 1_000_000)
        self.assertEqual(self.spi.get(RD_MODE, "B"), 1)

    def test_spi_tools(self):
        """The independent programs spi-config and spi-pipe must be able to use the device."""
        device = ["-d", "/dev/spidev9.0"]
        subprocess.run(["spi-config", *device, "-m", "1"], check=True)
        settings = subprocess.run(["spi-config", *device, "-q"], check=True, capture_output=True, text=True).stdout
        self.assertRegex(settings, r"mode=1, lsb=0, bits=8, speed=1000000")
        received = subprocess.run(["spi-pipe", *device, "-s", "2000000", "-b", "7", "-n", "3"], check=True, capture_output=True,
                              input=bytes(21)).stdout
        self.assertEqual(len(received), 21)
        for i in range(3):
            self.check_frame(received[7 * i:7 * i + 7])
