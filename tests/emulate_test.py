# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc emulate`, mostly for tformat with an independent T-format client."""
import fcntl
import itertools
import json
import os
import pty
import re
import select
import shutil
import signal
import socket
import stat
import struct
import subprocess
import sys
import time
import tty
import unittest

from command_support import ABSENC, PATIENCE, Case, Emulator, absenc, end, read_line

REPLY_LENGTH = {0x0: 6, 0x1: 6, 0x2: 4, 0x3: 11, 0x6: 4, 0x7: 6, 0x8: 6, 0xC: 6, 0xD: 4}
ALARMS = ["over_speed", "full_absolute_status", "counting_error", "counter_overflow", "over_heat", "multiturn_error",
          "battery_error", "battery_alarm"]
# bits of the status field SF of a T-format reply: counting error, and the bit that is set if any alarm is raised
COUNTING_ERROR, ALARM = 0x10, 0x20


def rate_of(terminal):
    """Returns the baud rate of the terminal from struct termios2 (<asm-generic/ioctls.h>)."""
    tcgets2 = 0x802C542A
    return struct.unpack("IIIIB19sII", fcntl.ioctl(terminal, tcgets2, bytes(44)))[-1]


def control_field(data_id):
    parity = bin(data_id).count("1") & 1
    return 0b010 | data_id << 3 | parity << 7


def crc(data):
    """Returns the CRC with the polynomial X^8 + 1, least significant bit first."""
    register = 0
    for byte in data:
        for bit in range(8):
            top = register >> 7
            register = (register << 1 & 0xFF) | (top ^ (byte >> bit & 1))
    return int(f"{register:08b}"[::-1], 2)


class Client:
    """The host's end of a T-format line. `exchange` sends a request and returns the received bytes."""

    def __init__(self, descriptor):
        self.descriptor = descriptor

    @staticmethod
    def open(path):
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(descriptor)
        return Client(descriptor)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self.descriptor)

    def send(self, data):
        os.write(self.descriptor, bytes(data))

    def receive(self, length, patience=PATIENCE):
        data = b""
        deadline = time.monotonic() + patience
        while len(data) < length:
            if not select.select([self.descriptor], [], [], max(0, deadline - time.monotonic()))[0]:
                break
            try:
                part = os.read(self.descriptor, 256)
            except OSError:  # the emulator has ended and closed its end of the line
                break
            if not part:
                break
            data += part
        return data

    def exchange(self, data_id, *body, length=None):
        request = bytes([control_field(data_id), *body])
        if body:
            request += bytes([crc(request)])
        self.send(request)
        return self.receive(length or REPLY_LENGTH[data_id])

    def read_memory(self, address):
        """Returns (busy bit, value) of an EEPROM read."""
        reply = self.exchange(0xD, address)
        assert len(reply) == 4 and crc(reply[:3]) == reply[3] and reply[0] == 0xEA, reply
        assert reply[1] & 0x7F == address, reply
        return bool(reply[1] & 0x80), reply[2]

    def write_memory(self, address, value):
        return self.exchange(0x6, address, value)

    def wait_until_written(self, address):
        """Polls the busy bit until a write has ended. Returns whether it was ever set, and the value."""
        deadline = time.monotonic() + PATIENCE
        was_busy = False
        while time.monotonic() < deadline:
            busy, value = self.read_memory(address)
            if not busy:
                return was_busy, value
            was_busy = True
        raise AssertionError("busy without end")

    def select_page(self, page):
        reply = self.write_memory(127, page)
        assert reply[1:3] == bytes([127, page]), reply
        assert self.wait_until_written(127)[1] == page


class EmulateCase(Case):
    def emulator(self, *arguments, **settings):
        emulator = Emulator(self.directory, *arguments, **settings)
        self.addCleanup(emulator.end)
        return emulator

    def client(self, *arguments):
        client = Client.open(self.emulator(*arguments).path)
        self.addCleanup(client.__exit__)
        return client

    def assert_reply(self, reply, data_id, status, body):
        wanted = bytes([control_field(data_id), status]) + bytes(body)
        self.assertEqual(reply.hex(" "), (wanted + bytes([crc(wanted)])).hex(" "))


class Gap(EmulateCase):
    """Tests of the pause that ends a request (--gap)."""

    def trickle(self, client, request, pause):
        """Sends the request byte by byte and returns the received bytes."""
        for byte in request:
            client.send([byte])
            select.select([], [], [], pause)
        return client.receive(len(request))

    def test_slow_host_needs_longer_gap(self):
        # With the default gap, 5 ms between two bytes turn this request into four incomplete requests.
        page_select = bytes.fromhex("327f004d")
        client = self.client("--gap", "2000")
        self.assertEqual(self.trickle(client, page_select, 0.005), page_select)

    def test_request_to_absent_encoder_does_not_disturb_next(self):
        absent = {"esl": "0bd5", "raa38-modbus": "0903000000018542"}
        present = {"esl": ("0875", 18), "raa38-modbus": ("010300000001840a", 7)}
        for protocol, gap in itertools.product(absent, ("2", "10000")):
            with self.subTest(protocol=protocol, gap=gap):
                # On a busy machine the emulator may receive several requests as one.
                self.assertTrue(any(self.answers(protocol, gap, number, absent[protocol], *present[protocol])
                                    for number in range(10)))

    def answers(self, protocol, gap, number, absent, present, length):
        emulator = self.emulator("--gap", gap, protocol=protocol, name=f"{protocol}-{gap}-{number}")
        with Client.open(emulator.path) as client:
            for _ in range(5):
                client.send(bytes.fromhex(absent))
                select.select([], [], [], 0.005)
            client.send(bytes.fromhex(present))
            return client.receive(length, patience=2)[:1] == bytes.fromhex(present)[:1]

    def test_refused_where_it_has_no_effect(self):
        for arguments in (["tformat", "--port", "/dev/null"], ["raa38-can"], ["encolink", "--spidev", "spidev9.9"]):
            self.assert_wrong_usage(absenc("emulate", *arguments, "--gap", "5"), "--gap", "latency=MS")
        self.assert_wrong_usage(absenc("emulate", "tformat", "--gap", "0"), "--gap")


class DataIds(EmulateCase):
    def test_positions(self):
        client = self.client("--singleturn", "0x1ABCD", "--multiturn", "0x1234")
        self.assert_reply(client.exchange(0), 0, 0, [0xCD, 0xAB, 0x01])
        self.assert_reply(client.exchange(1), 1, 0, [0x34, 0x12, 0x00])
        self.assert_reply(client.exchange(2), 2, 0, [0x11])
        self.assert_reply(client.exchange(3), 3, 0, [0xCD, 0xAB, 0x01, 0x11, 0x34, 0x12, 0x00, 0x00])

    def test_other_model(self):
        client = self.client("--model", "23-bit", "--singleturn", str(2**23 - 1), "--multiturn", "65535")
        self.assert_reply(client.exchange(2), 2, 0, [0x17])
        self.assert_reply(client.exchange(3), 3, 0, [0xFF, 0xFF, 0x7F, 0x17, 0xFF, 0xFF, 0x00, 0x00])

    def reset(self, client, data_id, times):
        """Sends the request `times` times, at least 100 us apart. Returns the last reply."""
        reply = b""
        for _ in range(times):
            reply = client.exchange(data_id)
            apart = time.monotonic() + 100e-6
            while time.monotonic() < apart:
                pass
        return reply

    def test_nine_resets_have_no_effect(self):
        client = self.client("--alarm", "over_speed", "--multiturn", "7")
        self.reset(client, 0x7, 9)
        # a request with another data ID restarts the count of consecutive reset requests
        self.assertEqual(client.exchange(3)[9], 0x01)
        self.reset(client, 0x7, 9)
        self.assertEqual(client.exchange(3)[9], 0x01)
        self.reset(client, 0xC, 5)
        self.reset(client, 0x7, 5)
        self.assertEqual(client.exchange(3)[6:10], bytes([7, 0, 0, 0x01]))

    def test_clear_alarms(self):
        client = self.client("--alarm", "multiturn_error", "--multiturn", "7")
        # The reply to the tenth reset request still shows the alarm, which that request clears.
        self.assert_reply(self.reset(client, 0x7, 10), 0x7, ALARM, [0, 0, 0])
        self.assert_reply(client.exchange(3), 3, 0, [0, 0, 0, 0x11, 7, 0, 0, 0])

    def test_reset_multiturn(self):
        client = self.client("--alarm", "battery_error", "--singleturn", "5", "--multiturn", "7")
        self.assert_reply(self.reset(client, 0xC, 10), 0xC, ALARM, [5, 0, 0])
        self.assert_reply(client.exchange(3), 3, 0, [5, 0, 0, 0x11, 0, 0, 0, 0])

    def test_zero(self):
        client = self.client("--singleturn", "1000", "--multiturn", "7")
        self.assert_reply(self.reset(client, 0x8, 10), 0x8, 0, [0xE8, 0x03, 0])
        client.wait_until_written(0)
        self.assert_reply(client.exchange(3), 3, 0, [0, 0, 0, 0x11, 7, 0, 0, 0])

    def test_memory(self):
        client = self.client()
        self.assertEqual(client.read_memory(5), (False, 0))
        before = time.monotonic()
        self.assertEqual(client.write_memory(5, 0x5A).hex(" "), "32 05 5a 6d")
        was_busy, value = client.wait_until_written(5)
        took = time.monotonic() - before
        self.assertEqual(value, 0x5A)
        self.assertTrue(was_busy or took > 0.018)
        self.assertGreaterEqual(took, 0.018)
        self.assertEqual(client.read_memory(6), (False, 0))

    def test_busy_encoder_does_not_write(self):
        client = self.client()
        client.write_memory(5, 0x5A)
        reply = client.write_memory(6, 0x77)
        client.wait_until_written(5)
        # the EEPROM is busy and has refused the second write, unless this machine took more than 18 ms between the
        # two
        if reply[1] & 0x80:
            self.assertEqual(reply[2], 0)
            self.assertEqual(client.read_memory(6), (False, 0))

    def test_pages(self):
        client = self.client()
        for page in (0, 3, 5):
            client.select_page(page)
            client.write_memory(126, 0x40 + page)
            client.wait_until_written(126)
        for page in (5, 0, 3):
            client.select_page(page)
            self.assertEqual(client.read_memory(126), (False, 0x40 + page))
            self.assertEqual(client.read_memory(127), (False, page))

    def test_service_page(self):
        client = self.client()
        client.select_page(7)
        self.assertEqual(client.read_memory(5), (False, 35))
        self.assertEqual(client.read_memory(4), (False, 0xDA))
        # The written byte sets the overheat threshold to 20 degC, which is below the encoder's temperature of 35
        # degC.
        client.write_memory(4, 0x80 + 20)
        client.wait_until_written(4)
        self.assertEqual(client.exchange(3)[9], 0x10)

    def test_invalid_requests(self):
        """The encoder answers most invalid requests like a request for ID 3."""
        client = self.client()
        everything = client.exchange(3)
        self.assertEqual(client.exchange(0x4, length=11), everything)  # a request with an unknown data ID
        client.send([0x9A])  # a request with a wrong parity bit
        self.assertEqual(client.receive(11)[:2], bytes([0x1A, 0x40]))
        client.send([0xEA, 5, 0])  # a request with a wrong CRC
        self.assertEqual(client.receive(11), everything)
        self.assertEqual(client.exchange(0x6, 127, 6, length=11), everything)  # a write that selects a closed page
        client.send([0xEA])  # a request that ends after its first byte
        self.assertEqual(client.receive(11), everything)
        client.send([0x19, 0x1A])  # a byte that is no sync code precedes a request
        self.assertEqual(client.receive(12, patience=0.05), everything)


class Behaviour(EmulateCase):
    def test_each_alarm(self):
        for bit, name in enumerate(ALARMS):
            with self.subTest(name), Emulator(self.directory, "--alarm", name) as emulator:
                with Client.open(emulator.path) as client:
                    reply = client.exchange(3)
                    status = COUNTING_ERROR if bit == 2 else ALARM if bit >= 4 else 0
                    self.assertEqual((reply[1], reply[9]), (status, 1 << bit))
                    self.assertEqual(crc(reply[:-1]), reply[-1])

    def test_several_alarms(self):
        client = self.client("--alarm", "battery_error", "--alarm", "battery_alarm")
        self.assertEqual(client.exchange(3)[9], 0xC0)

    def test_corrupt_fault(self):
        emulator = self.emulator("--fault", "corrupt=1")
        with Client.open(emulator.path) as client:
            replies = [client.exchange(3) for _ in range(20)]
        good = bytes([0x1A, 0, 0, 0, 0, 0x11, 0, 0, 0, 0, 0x0B])
        self.assertTrue(all(len(reply) == 11 and reply != good for reply in replies))
        # The checksum does not detect every fault: it is the XOR of all bytes, so two flipped bits in the same column
        # cancel out.
        self.assertGreater(sum(crc(reply[:-1]) != reply[-1] for reply in replies), 10)
        self.assertIn("faults injected: 20 corrupt\n  replies with faults: 20\n", emulator.end()[2])

    def test_silence_fault(self):
        emulator = self.emulator("--fault", "silence=1")
        with Client.open(emulator.path) as client:
            client.send([0x1A])
            self.assertEqual(client.receive(1, patience=0.1), b"")
        self.assertIn("faults injected: 1 silence", emulator.end()[2])

    def test_delay_fault(self):
        client = self.client("--fault", "delay=1")
        before = time.monotonic()
        self.assert_reply(client.exchange(2), 2, 0, [0x11])
        self.assertGreaterEqual(time.monotonic() - before, 0.05)

    def test_seed_repeats_faults(self):
        series = []
        for seed in ("7", "7", "8"):
            with Emulator(self.directory, "--fault", "corrupt=1", "--seed", seed) as emulator:
                with Client.open(emulator.path) as client:
                    series.append([client.exchange(3) for _ in range(5)])
        self.assertEqual(series[0], series[1])
        self.assertNotEqual(series[0], series[2])

    def test_motion(self):
        client = self.client("--motion", "rpm=60")
        seen = {client.exchange(0)[2:5] for _ in range(50)}
        self.assertGreater(len(seen), 10)

    def test_motion_from_file(self):
        path = self.file("motion.csv", "seconds,degrees\n0,0\n0.01,90\n")
        client = self.client("--motion", f"file={path}")
        deadline = time.monotonic() + PATIENCE
        while client.exchange(0)[2:5] != bytes([0, 0x80, 0]) and time.monotonic() < deadline:
            pass
        self.assertEqual(client.exchange(0)[2:5], bytes([0, 0x80, 0]))

    def test_power_on_takes_real_time(self):
        before = time.monotonic()
        client = self.client("--power-on", "real")
        reply = b""
        while not reply and time.monotonic() < before + PATIENCE:
            client.send([0x92])
            reply = client.receive(4, patience=0.02)
        self.assertEqual(reply, bytes([0x92, 0, 0x11, 0x83]))
        self.assertGreaterEqual(time.monotonic() - before, 1.0)

    def test_tcp(self):
        emulator = self.emulator("--tcp", "0", "--singleturn", "5")
        line = emulator.line()
        self.assertRegex(line, r"^ready: tcp:127\.0\.0\.1:\d+\n$")
        port = int(line.rsplit(":", 1)[1])
        with socket.create_connection(("127.0.0.1", port), timeout=PATIENCE) as connection:
            ends = [Client(connection.fileno()), Client.open(emulator.path)]
            for asking, listening in (ends, ends[::-1]):  # both clients share one line, so both receive the reply
                self.assert_reply(asking.exchange(0), 0, 0, [5, 0, 0])
                self.assert_reply(listening.receive(6), 0, 0, [5, 0, 0])
            ends[1].__exit__()
        in_use = absenc("emulate", "tformat", "--tcp", str(port), "--for", "60")
        self.assert_failed(in_use, f"TCP port {port} is in use")


class Console(EmulateCase):
    """Tests of commands for a running emulator, which it reads as lines from its standard input."""

    def console(self, *arguments, **settings):
        """Returns an emulator, and a function that sends it a line and returns the answer."""
        emulator = self.emulator(*arguments, stdin=subprocess.PIPE, **settings)

        def send_line(line):
            emulator.process.stdin.write(f"{line}\n".encode())
            return emulator.line().rstrip("\n")
        return emulator, send_line

    def run_json(self, *arguments):
        result = absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)

    def temperature(self, place):
        return self.run_json("run", place, "temperature")["fields"]["temperature_c"]

    def test_sets_condition(self):
        emulator, send_line = self.console()
        place = f"tformat:{emulator.path}?latency=300"
        self.assertEqual(send_line("temperature"), "ok: temperature is 35 degC")
        self.assertEqual(send_line("  temperature = 85 "), "ok: temperature is 85 degC")
        self.assertEqual(self.temperature(place), 85)
        self.assertEqual(send_line("temperature=-20"), "ok: temperature is -20 degC")
        self.assertEqual(self.temperature(place), -20)

    def test_refuses_alarm_that_nothing_reports(self):
        _, send_line = self.console("--option", "carries=ssi", "--option", "singleturn_bits=13", protocol="e201")
        self.assertIn("the alarm error cannot be shown", send_line("alarm error"))
        self.assertEqual(send_line("clear error"), "ok: lowered error")

    def test_power_cycle_without_battery_loses_turns(self):
        emulator, send_line = self.console("--multiturn", "7")
        place = f"tformat:{emulator.path}?latency=300"
        self.assertEqual(self.run_json("read", place)["multiturn"], 7)
        self.assertEqual(send_line("battery=0"), "ok: battery is 0 mV")
        self.assertEqual(send_line("power on"), "ok: power is on already")
        self.assertEqual(send_line("power off"), "ok: power is off")
        self.assertEqual(absenc("read", place).returncode, 1)
        self.assertEqual(send_line("power off"), "ok: power is off already")
        before = time.monotonic()
        self.assertEqual(send_line("power on"), "ok: power is on; it takes its time to start")
        result = absenc("alarms", place, "--json")
        while result.returncode != 0 and time.monotonic() < before + PATIENCE:
            result = absenc("alarms", place, "--json")
        self.assertGreaterEqual(time.monotonic() - before, 1.5)
        self.assertIn("battery_error", result.stdout)
        self.assertEqual(self.run_json("read", place)["multiturn"], 0)

    def test_raises_and_clears_alarms(self):
        emulator, send_line = self.console()
        with Client.open(emulator.path) as client:
            self.assertEqual(send_line("alarm over_heat battery_alarm"), "ok: raised over_heat, battery_alarm")
            self.assertEqual(client.exchange(3)[9], 0x90)
            self.assertEqual(send_line("clear over_heat"), "ok: lowered over_heat")
            self.assertEqual(client.exchange(3)[9], 0x80)

    def test_sets_faults(self):
        emulator, send_line = self.console()
        with Client.open(emulator.path) as client:
            self.assertEqual(send_line("fault"), "ok: no faults")
            self.assertEqual(len(client.exchange(3)), 11)
            self.assertEqual(send_line("fault drop=1"), "ok: faults: drop=1")
            self.assertEqual(len(client.exchange(3)), 10)
            self.assertEqual(send_line("fault drop=0 repeat=1 corrupt=0.01"), "ok: faults: corrupt=0.01, repeat=1")
            self.assertGreater(len(client.exchange(3)), 11)
            self.assertEqual(send_line("fault"), "ok: faults: corrupt=0.01, repeat=1")
            self.assertEqual(send_line("fault none"), "ok: no faults")
            reply = client.exchange(3)
            self.assertEqual((len(reply), client.receive(1, patience=0.02)), (11, b""))
        self.assertRegex(emulator.end()[2], r"faults injected: 1 drop,.* 1 repeat\n")

    def test_faults_of_command_line_can_be_cleared(self):
        emulator, send_line = self.console("--fault", "silence=1", protocol="raa38-can")
        place = f"raa38-can:slcan:{emulator.path}?latency=300"
        self.assertEqual(absenc("read", place).returncode, 1)
        self.assertEqual(send_line("fault none"), "ok: no faults")
        self.assert_good(absenc("read", place))

    def test_summary_lists_only_encoders_with_faults(self):
        emulator, send_line = self.console("--also", "address=3", protocol="esl")
        self.assertEqual(send_line("2: fault silence=1"), "ok: 2: faults: silence=1")
        err = emulator.end()[2]
        self.assertEqual(err.count("faults injected"), 1, err)

    def test_streaming_encoder_resumes_after_power_on(self):
        emulator, send_line = self.console("--motion", "rpm=60", "--option", "refresh_hz=200", protocol="raa38")
        with Client.open(emulator.path) as client:
            self.assertTrue(client.receive(20))
            self.assertEqual(send_line("power off"), "ok: power is off")
            deadline = time.monotonic() + PATIENCE
            while client.receive(20, patience=0.1) and time.monotonic() < deadline:
                pass
            self.assertLess(time.monotonic(), deadline)
            self.assertEqual(send_line("power on"), "ok: power is on; it takes its time to start")
            self.assertGreaterEqual(len(client.receive(20)), 20)

    def test_addresses_one_of_several_encoders(self):
        emulator, send_line = self.console("--also", "address=3", protocol="esl")

        def answers():
            places = [f"esl:{emulator.path}?latency=300&address={address}" for address in (0, 3)]
            return [absenc("read", place).returncode == 0 for place in places]
        self.assertEqual(answers(), [True, True])
        self.assertEqual(send_line("2: power off"), "ok: 2: power is off")
        self.assertEqual(answers(), [True, False])
        self.assertEqual(send_line("power off"), "ok: 1: power is off; 2: power is off already")
        self.assertEqual(answers(), [False, False])
        self.assertEqual(send_line("3: help"), 'error: "3" is no encoder of this line: they are 1 to 2')

    def test_can_node(self):
        emulator, send_line = self.console(protocol="raa38-can")
        place = f"raa38-can:slcan:{emulator.path}?latency=300"
        self.assert_good(absenc("read", place))
        self.assertEqual(send_line("power off"), "ok: power is off")
        self.assertEqual(absenc("read", place).returncode, 1)

    def test_reports_unknown_commands(self):
        _, send_line = self.console()
        for line, words in [("temprature=85", ['"temprature"', "did you mean temperature?", "power, alarm, clear, fault, help"]),
                            ("x", ['"x"', "battery, temperature, power"]),
                            ("temperature=hot", ["-20 to 127 degC"]), ("temperature=128", ["-20 to 127 degC"]),
                            ("battery=", ["0 to 4750 mV"]), ("battery=1 2", ["0 to 4750 mV"]),
                            ("power", ["power on", "power off"]), ("power of", ["power off"]),
                            ("fault none corrupt=2", ["from 0 to 1"]), ("fault noise", ["unknown kind", "drop, corrupt"]),
                            ("alarm", ["which alarm?", "over_heat"]), ("alarm overheat", ["did you mean over_heat?"])]:
            with self.subTest(line):
                answer = send_line(line)
                self.assertTrue(answer.startswith("error: "), answer)
                for word in words:
                    self.assertIn(word, answer)

    def test_help(self):
        _, send_line = self.console()
        for words in ("battery=0 to 4750 mV", "power off", "alarm NAME", "over_heat", "fault KIND=RATE, of drop corrupt"):
            self.assertIn(words, send_line("help"))

    def test_end_of_input_does_not_end_emulator(self):
        emulator, send_line = self.console()
        self.assertEqual(send_line("temperature=50"), "ok: temperature is 50 degC")
        emulator.process.stdin.write(b"\n\nbattery=100")
        emulator.process.stdin.close()
        self.assertEqual(emulator.line(), "ok: battery is 100 mV\n")
        self.assertEqual(self.temperature(f"tformat:{emulator.path}?latency=300"), 50)
        emulator.process.stdin = None
        self.assertEqual(emulator.end()[0], 0)

    def test_closed_output_does_not_end_emulator(self):
        emulator, _ = self.console()
        emulator.process.stdout.close()
        # Emulator.end reads /dev/null instead of the closed standard output.
        emulator.process.stdout = open(os.devnull, "rb")
        emulator.process.stdin.write(b"temperature=50\ntemperature=60\n")
        place = f"tformat:{emulator.path}?latency=300"
        deadline = time.monotonic() + PATIENCE
        while self.temperature(place) == 35 and time.monotonic() < deadline:
            pass
        self.assertIn(self.temperature(place), (50, 60))

    def test_ignores_terminal_of_foreground_program(self):
        path = self.file("encoder")
        child, master = pty.fork()
        if child == 0:  # the child process acts as a shell that runs the emulator in the background
            program = ("import os, signal, subprocess, sys\n"
                       "emulator = subprocess.Popen(sys.argv[1:], preexec_fn=os.setpgrp)\n"
                       "print('pid', emulator.pid, flush=True)\n"
                       "signal.pause()")
            os.execv(sys.executable, [sys.executable, "-c", program, ABSENC, "emulate", "tformat", "--pty", path])
        shown = b""
        try:
            deadline = time.monotonic() + PATIENCE
            while not (b"ready" in shown and re.search(rb"pid \d+\r", shown)):
                self.assertTrue(select.select([master], [], [], max(0, deadline - time.monotonic()))[0], shown)
                shown += os.read(master, 4096)
            os.write(master, b"power off\n")
            for _ in range(5):
                self.assert_good(absenc("read", f"tformat:{path}?latency=300"))
        finally:
            os.kill(int(re.search(rb"pid (\d+)", shown)[1]), signal.SIGKILL)
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            os.close(master)

    def test_initial_conditions(self):
        emulator = self.emulator("--condition", "temperature=90", "--condition", "battery=0", "--multiturn", "7")
        place = f"tformat:{emulator.path}?latency=300"
        self.assertEqual(self.temperature(place), 90)
        self.assertEqual(self.run_json("read", place)["multiturn"], 0)
        self.assertEqual(self.temperature("sim:tformat?condition=temperature=90"), 90)

    def test_refuses_wrong_conditions(self):
        for condition, words in [("temprature=1", ["did you mean temperature?"]), ("battery", ["NAME=VALUE"]),
                                 ("temperature=200", ["-20 to 127 degC"])]:
            with self.subTest(condition):
                self.assert_wrong_usage(absenc("emulate", "tformat", "--condition", condition), *words)
                self.assert_wrong_usage(absenc("read", f"sim:tformat?condition={condition}"), *words)
        self.assert_wrong_usage(absenc("emulate", "raa38", "--condition", "battery=0"), "has no conditions")

    def test_list_shows_conditions(self):
        listed = self.run_json("list", "tformat")["conditions"]
        self.assertIn({"name": "temperature", "unit": "degC", "meaning": "of the board", "minimum": -20,
                       "maximum": 127, "normal": 35}, listed)
        self.assertIn("0 to 4750 mV", absenc("list", "tformat").stdout)


class SerialPort(EmulateCase):
    """Tests of `emulate` on an existing serial port, here one end of a pseudo-terminal."""

    def port(self, settings="", *arguments):
        ours, terminal = os.openpty()
        self.addCleanup(os.close, ours)
        tty.setraw(terminal)
        path = os.ttyname(terminal)
        emulator = self.emulator(*arguments, name=path + settings, line="--port")
        os.close(terminal)
        self.assertEqual(emulator.ready, f"ready: {path}\n")
        return emulator, Client(ours), path

    def test_emulates_on_port(self):
        emulator, client, path = self.port("?baud=115200", "--singleturn", "1000", "--multiturn", "7")
        self.assert_reply(client.exchange(3), 3, 0, [0xE8, 0x03, 0, 0x11, 7, 0, 0, 0])
        result = absenc("emulate", "tformat", "--port", path, "--for", "60")
        self.assert_failed(result, f"the port {path} is in use by absenc")
        status, out, err = emulator.end()
        self.assertEqual((status, out), (0, ""))
        self.assertRegex(err, r"^absenc: 1 requests answered in ")

    def test_several_encoders_on_port(self):
        ours, terminal = os.openpty()
        self.addCleanup(os.close, ours)
        emulator = Emulator("/dev", "--also", "address=3&singleturn=1000", protocol="esl", name=os.ttyname(terminal),
                            line="--port")
        os.close(terminal)
        _, _, err = emulator.end()
        self.assertIn("address=3&singleturn=1000: 0 requests", err)

    def test_adapter_with_echo(self):
        emulator, client, _ = self.port("?echo=on", "--singleturn", "1000")
        for _ in range(4):
            reply = client.exchange(0)
            self.assert_reply(reply, 0, 0, [0xE8, 0x03, 0])
            client.send(reply)  # sends the encoder its own reply, whose first byte is also that of a request
        _, _, err = emulator.end()
        self.assertIn("4 requests answered", err)
        self.assertNotIn("rules", err)

    def test_ends_after_given_time(self):
        ours, terminal = os.openpty()
        self.addCleanup(os.close, ours)
        self.addCleanup(os.close, terminal)
        result = absenc("emulate", "tformat", "--port", os.ttyname(terminal), "--for", "0.1")
        self.assert_good(result)

    def test_waits_for_unplugged_port(self):
        link = os.path.join(self.directory, "port")
        ours, terminal = os.openpty()
        os.symlink(os.ttyname(terminal), link)
        # The encoder's reply is delayed, so that the port disappears before the reply is sent.
        emulator = self.emulator("--fault", "delay=1", "--singleturn", "1000", name=link, line="--port")
        os.close(terminal)
        client = Client(ours)
        client.send([control_field(0)])
        self.assertEqual(client.receive(1, patience=0.02), b"")
        os.close(ours)
        deadline = time.monotonic() + PATIENCE
        self.assertRegex(read_line(emulator.process.stderr, deadline), f"the port {link} went away: unplugged")
        self.assertIn("Waiting for it to come back", read_line(emulator.process.stderr, deadline))
        ours, terminal = os.openpty()
        self.addCleanup(os.close, ours)
        self.addCleanup(os.close, terminal)
        os.symlink(os.ttyname(terminal), link + "-new")
        os.replace(link + "-new", link)
        self.assertIn(f"the port {link} is back", read_line(emulator.process.stderr, deadline))
        self.assert_reply(Client(ours).exchange(0), 0, 0, [0xE8, 0x03, 0])
        self.assertEqual(emulator.end()[0], 0)

    def test_replugged_port_keeps_changed_baud_rate(self):
        link = os.path.join(self.directory, "port")
        ours, terminal = os.openpty()
        os.symlink(os.ttyname(terminal), link)
        emulator = self.emulator(protocol="raa38-modbus", name=link, line="--port")
        os.close(terminal)
        client = Client(ours)
        set_baud = bytes.fromhex("01cc96f56e")
        client.send(set_baud)
        self.assertEqual(client.receive(len(set_baud)), set_baud)
        os.close(ours)
        deadline = time.monotonic() + PATIENCE
        self.assertRegex(read_line(emulator.process.stderr, deadline), f"the port {link} went away: unplugged")
        ours, terminal = os.openpty()
        self.addCleanup(os.close, ours)
        self.addCleanup(os.close, terminal)
        os.symlink(os.ttyname(terminal), link + "-new")
        os.replace(link + "-new", link)
        read_line(emulator.process.stderr, deadline)
        self.assertIn(f"the port {link} is back", read_line(emulator.process.stderr, deadline))
        self.assertEqual(rate_of(ours), 9600)
        self.assertEqual(emulator.end()[0], 0)

    def test_refuses_wrong_usage(self):
        for more, words in (
            (["--pty", "/tmp/x"], "--pty is a line of its own: not with --port"),
            (["--tcp", "0"], "--tcp is a line of its own: not with --port"),
        ):
            self.assert_wrong_usage(absenc("emulate", "tformat", "--port", "/dev/x", *more), words)
        for port, words in (
            ("tcp:localhost:1", "must be a serial port"),
            ("/dev/x?model=23-bit", "model is no setting of a port"),
            ("/dev/x?baud=115200&singleturn_bits=23", "singleturn_bits is no setting of a port"),
            ("/dev/x?baud=fast", "baud"),
        ):
            self.assert_wrong_usage(absenc("emulate", "tformat", "--port", port), words)
        self.assert_failed(absenc("emulate", "tformat", "--port", "/dev/nothing"), "there is no port /dev/nothing")


class Lifecycle(EmulateCase):
    def test_prints_ready_line(self):
        emulator = self.emulator()
        self.assertEqual(emulator.ready, f"ready: {emulator.path}\n")
        self.assertTrue(stat.S_ISCHR(os.stat(emulator.path).st_mode))

    def test_chooses_terminal_without_path(self):
        process = subprocess.Popen([ABSENC, "emulate", "tformat"], bufsize=0, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
        try:
            ready = read_line(process.stdout, time.monotonic() + PATIENCE)
            self.assertRegex(ready, r"^ready: /dev/pts/\d+\n$")
            with Client.open(ready[7:].strip()) as client:
                self.assertEqual(len(client.exchange(3)), 11)
        finally:
            end(process)

    def test_signal_ends_it_with_summary(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            with self.subTest(number):
                emulator = Emulator(self.directory)
                with Client.open(emulator.path) as client:
                    for _ in range(3):
                        client.exchange(3)
                status, out, err = emulator.end(number)
                self.assertEqual((status, out), (0, ""))
                self.assertRegex(err, r"^absenc: 3 requests answered in ")
                self.assertFalse(os.path.lexists(emulator.path))

    def test_refused_request_counts_once(self):
        """A request for ID D with a wrong parity bit is refused once, after its end."""
        emulator = self.emulator()
        with Client.open(emulator.path) as client:
            client.send([0x6A, 0x05, 0xEF])
            reply = client.receive(11)
            self.assertEqual((len(reply), reply[:2]), (11, bytes([0x1A, 0x40])))
        err = emulator.end()[2]
        self.assertIn("1 requests answered", err)
        self.assertNotIn("rules", err)

    def test_help_states_unit_of_fault_rate(self):
        words = " ".join(absenc("emulate", "--help").stdout.split())
        self.assertIn("request_corrupt: how often a byte (CAN: a frame) of the requests that it hears is", words)
        emulator = self.emulator("--fault", "request_corrupt=1")
        with Client.open(emulator.path) as client:
            client.send([0xEA, 0x05, 0xEF])
            client.receive(11, 0.2)
        # each of the three damaged bytes of the request counts as one fault, as the help of `emulate` states
        self.assertIn("3 request_corrupt", emulator.end()[2])

    def test_reports_violations(self):
        emulator = self.emulator()
        with Client.open(emulator.path) as client:
            client.write_memory(127, 3)
            self.assertTrue(client.read_memory(0)[0])
        err = emulator.end()[2]
        self.assertRegex(err, r"rules that the host broke: 1\n    at \d+\.\d{6} s: memory access before the page is ready")

    def test_reports_every_host_that_does_not_wait(self):
        """The emulator excuses requests before the reply at most twice in a row."""
        emulator = self.emulator()
        with Client.open(emulator.path) as client:
            for _ in range(5):
                client.send([0x1A, 0x1A, 0x1A])
                self.assertEqual(len(client.receive(11)), 11)
        counted = re.search(r"rules that the host broke: (\d+)\n", emulator.end()[2])
        self.assertIsNotNone(counted)
        self.assertGreaterEqual(int(counted[1]), 3)

    def test_ends_after_given_time(self):
        before = time.monotonic()
        result = absenc("emulate", "tformat", "--for", "0.2")
        self.assert_good(result)
        self.assertGreaterEqual(time.monotonic() - before, 0.2)
        self.assertIn("0 requests answered", result.stderr)

    def test_refuses_existing_file_as_path(self):
        path = self.file("precious", "data")
        self.assert_failed(absenc("emulate", "tformat", "--pty", path, "--for", "60"), path, "remove it")
        with open(path, encoding="utf-8") as file:
            self.assertEqual(file.read(), "data")

    def test_refuses_path_of_running_emulator(self):
        with Emulator(self.directory, "--singleturn", "7") as first:
            for protocol in ("tformat", "raa38-can"):
                result = absenc("emulate", protocol, "--pty", first.path, "--for", "60")
                self.assert_failed(result, first.path, "is in use by a virtual encoder that is running")
                self.assertEqual(result.stdout, "")
            address = f"tformat:{first.path}?latency=300"
            self.assertEqual(json.loads(absenc("read", address, "--json").stdout)["singleturn"], 7)
            first.end(signal.SIGKILL)
        self.assertTrue(os.path.islink(first.path))
        with Emulator(self.directory, "--singleturn", "8"):
            self.assertEqual(json.loads(absenc("read", address, "--json").stdout)["singleturn"], 8)
        self.assertFalse(os.path.lexists(first.path))

    def test_two_emulators_run_in_parallel(self):
        with Emulator(self.directory, "--singleturn", "1", name="one") as one, \
                Emulator(self.directory, "--singleturn", "2", name="two") as two:
            with Client.open(one.path) as first, Client.open(two.path) as second:
                self.assertEqual((first.exchange(0)[2], second.exchange(0)[2]), (1, 2))


class MemoryFile(EmulateCase):
    def content(self):
        with open(self.file("memory"), "rb") as file:
            return file.read()

    def write_and_end(self, address, value, *arguments):
        with Emulator(self.directory, "--memory", self.file("memory"), *arguments) as emulator:
            with Client.open(emulator.path) as client:
                client.write_memory(address, value)
                client.wait_until_written(address)
            self.assertEqual(emulator.end()[0], 0)

    def test_survives_restart(self):
        self.write_and_end(5, 0x5A)
        self.write_and_end(6, 0x77)
        client = self.client("--memory", self.file("memory"))
        self.assertEqual([client.read_memory(address)[1] for address in (4, 5, 6)], [0, 0x5A, 0x77])

    def test_is_readable_text(self):
        self.write_and_end(17, 0x5A)
        text = self.content().decode()
        self.assertTrue(text.startswith("absenc memory 1\nprotocol: tformat\nmodel: TS5700N8500\nsize: "), text)
        self.assertIn("\n0010: 00 5A 00", text)

    def test_exists_before_encoder_is_ready(self):
        self.emulator("--memory", self.file("memory"))
        self.assertIn(b"size: ", self.content())

    def test_is_saved_before_reply(self):
        client = self.client("--memory", self.file("memory"))
        for address in range(10):
            client.write_memory(address, 0xA0 + address)
            client.wait_until_written(address)
            self.assertIn(f"{0xA0 + address:02X}".encode(), self.content())

    def test_acknowledged_writes_survive_kill(self):
        values = range(0x41, 0x4B)
        with Emulator(self.directory, "--memory", self.file("memory")) as emulator:
            written = absenc("memory", "write", f"tformat:{emulator.path}?latency=300", "0x10", *map(str, values), "--yes")
            emulator.end(signal.SIGKILL)
        self.assert_good(written)
        self.assertIn("10 bytes written and read back", written.stdout)
        self.assertIn(b"\n0010: 41 42 43 44 45 46 47 48 49 4A", self.content())

    def test_is_locked_by_one_emulator(self):
        os.symlink(self.file("memory"), self.file("another name"))
        self.emulator("--memory", self.file("memory"))
        for name in ("memory", "another name"):
            result = absenc("emulate", "tformat", "--memory", self.file(name), "--for", "60")
            self.assert_failed(result, self.file("memory"), "another emulator keeps its memory")
            self.assertEqual(result.stdout, "")

    def test_lock_survives_save_and_ends_with_emulator(self):
        with Emulator(self.directory, "--memory", self.file("memory")) as emulator:
            with Client.open(emulator.path) as client:
                # The emulator saves its memory in a new file, which replaces the memory file.
                client.write_memory(0, 0xAB)
                client.wait_until_written(0)
            result = absenc("emulate", "tformat", "--memory", self.file("memory"), "--for", "60")
            self.assert_failed(result, "another emulator keeps its memory")
            emulator.end(signal.SIGKILL)
        self.write_and_end(1, 0xCD)
        self.assertIn(b"\n0000: AB CD", self.content())

    def test_must_be_regular_file(self):
        os.mkfifo(self.file("fifo"))
        for path in ("/dev/full", "/dev/zero", "/dev/null", self.directory, self.file("fifo")):
            with self.subTest(path):
                result = absenc("emulate", "tformat", "--memory", path, "--for", "60")
                self.assert_failed(result, path, "no regular file")
                self.assertEqual(result.stdout, "")

    def test_write_that_cannot_be_saved_is_not_acknowledged(self):
        os.mkdir(self.file("sub"))
        emulator = self.emulator("--memory", self.file("sub/memory"))
        with Client.open(emulator.path) as client:
            shutil.rmtree(self.file("sub"))
            client.send(bytes.fromhex("32 05 5a 6d"))
            # there is no reply: the emulator ends, because it cannot save the written byte
            self.assertEqual(client.receive(4), b"")
        self.assertEqual(emulator.process.wait(PATIENCE), 1)
        self.assert_sentence(emulator.end()[2], "memory file", "No such file")

    def test_symbolic_link_is_preserved(self):
        os.symlink(self.file("elsewhere"), self.file("memory"))
        self.write_and_end(0, 1)
        self.assertTrue(os.path.islink(self.file("memory")))
        self.assertIn(b"\n0000: 01", self.content())

    def assert_refused(self, *words, arguments=()):
        before = self.content()
        result = absenc("emulate", "tformat", "--memory", self.file("memory"), "--for", "60", *arguments)
        self.assert_failed(result, self.file("memory"), *words)
        self.assertEqual(result.stdout, "")
        self.assertEqual(self.content(), before)
        self.assertEqual(os.listdir(self.directory), ["memory"])

    def test_refuses_memory_of_other_model(self):
        self.write_and_end(0, 1)
        self.assert_refused("model TS5700N8500", "23-bit", arguments=["--model", "23-bit"])

    def test_refuses_damaged_files(self):
        self.write_and_end(0, 1)
        good = self.content().decode()
        size = re.search(r"size: (\d+)", good).group(1)
        for damaged, words in [(good.replace(f"size: {size}", "size: 3"), [f"size 3, but the virtual encoder has {size}"]),
                               (good[:len(good) // 2], ["line"]),
                               (good[:good.rindex("02F0")], [f"it ends after 752 of {size} bytes"]),
                               (good + "02FF: 00\n", [f"more than {size} bytes"]),
                               (good.replace("0010:", "0011:"), ["line 6", "0010"]),
                               (good.replace("0020: 00", "0020: 0x"), ["line 7", "hexadecimal"]),
                               (good.replace("tformat", "esl"), ["protocol esl"]),
                               ("", ["no memory file"]), ("precious\n", ["no memory file"])]:
            with self.subTest(words):
                self.file("memory", damaged)
                self.assert_refused(*words)

    def test_reports_file_that_cannot_be_created(self):
        path = self.file("nowhere/memory")
        self.assert_failed(absenc("emulate", "tformat", "--memory", path, "--for", "60"), path, "No such file")


if __name__ == "__main__":
    unittest.main()
