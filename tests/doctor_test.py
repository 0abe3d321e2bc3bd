# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc doctor` on pseudo-terminals and failing ports."""
import fcntl
import json
import os
import random
import select
import subprocess
import sys
import unittest

from command_support import ABSENC, BabblingLine, Emulator, EncoderCase, FakeEncoder, FakeLine, absenc, json_lines

PATIENT = "latency=300"  # latency in milliseconds, for a machine that is busy with other tests


# Reply of a T-format encoder to the request 1A: 17 bits of position and 16 bits of turns, both 0, without an alarm.
GOOD_REPLY = bytes.fromhex("1a 00000000 11 000000 00 0b")


def doctor(*arguments, **settings):
    result = absenc("doctor", *arguments, "--json", **settings)
    return result, json.loads(result.stdout) if result.stdout else None


def ids(found):
    return [finding["id"] for finding in found["findings"]]


class TurnedRate(FakeLine):
    """A fake encoder that replies correctly at one baud rate, and with random bytes at others."""

    def __init__(self, rate, reply):
        super().__init__()
        self.rate = rate
        self.reply = reply

    def rate_of_port(self):
        """Returns the baud rate of the port from struct termios2, which holds arbitrary rates."""
        tcgets2 = 0x802C542A
        state = fcntl.ioctl(self.slave, tcgets2, bytes(44))
        return int.from_bytes(state[40:44], sys.byteorder)

    def serve(self):
        noise = random.Random(5)
        while True:
            ready, _, _ = select.select([self.master, self.wake], [], [])
            if self.wake in ready:
                return
            os.read(self.master, 64)
            at_rate = self.rate_of_port() == self.rate
            os.write(self.master, self.reply if at_rate else bytes(noise.randrange(256) for _ in self.reply))


class RefusingAdapter(FakeLine):
    """An slcan adapter on a bus where no node acknowledges frames."""

    def serve(self):
        line = b""
        while True:
            ready, _, _ = select.select([self.master, self.wake], [], [])
            if self.wake in ready:
                return
            for byte in os.read(self.master, 256):
                line += bytes([byte])
                if byte == ord("\r"):
                    os.write(self.master, b"\a" if line[:1] in b"tTrR" else b"\r")
                    line = b""


class Named(EncoderCase):
    def assert_found(self, address, *wanted, status=1):
        result, found = doctor(address)
        self.assertEqual(result.returncode, status, f"{result.stdout}{result.stderr}")
        self.assertEqual(ids(found), list(wanted), result.stdout)
        for finding in found["findings"]:
            for part in ("evidence", "cause", "action", "severity"):
                self.assertTrue(finding[part])
        return found

    def test_healthy_encoder_is_good(self):
        emulator = self.emulator()
        found = self.assert_found(f"tformat:{emulator.path}?{PATIENT}", status=0)
        self.assertTrue(found["ok"])
        self.assertRegex(found["verdict"], "^good: ")
        text = absenc("doctor", f"tformat:{emulator.path}?{PATIENT}")
        self.assert_good(text)
        self.assertRegex(text.stdout.splitlines()[-1], r"^good: \d+ of \d+ readings")

    def test_healthy_encoder_of_every_unit_has_no_finding(self):
        units = {unit["protocol"] for unit in json_lines(absenc("list", "--json").stdout)}
        for unit in sorted(units):
            with self.subTest(unit):
                self.assert_found(f"sim:{unit}", status=0)

    def test_last_line_names_first_repair(self):
        result = absenc("doctor", "sim:tformat?fault=corrupt=0.3&alarm=battery_alarm")
        self.assertEqual(result.returncode, 1)
        lines = result.stdout.splitlines()
        self.assertRegex(lines[0], "^warning: damaged_bits: ")
        self.assertRegex(lines[-1], "^first: damaged_bits: ")
        self.assertIn("warning: alarm: the encoder reports battery_alarm", result.stdout)

    def test_missing_port(self):
        self.assert_found(f"tformat:{self.file('nothing')}", "port_missing")

    def test_file_is_no_port(self):
        self.assert_found(f"tformat:{self.file('text', 'hello')}", "port_unsuitable")

    def test_port_in_use(self):
        line = FakeEncoder()
        with line:
            holder = subprocess.Popen(
                [sys.executable, "-c", "import fcntl,os,sys\nfd=os.open(sys.argv[1], os.O_RDWR|os.O_NOCTTY)\n"
                 "fcntl.flock(fd, fcntl.LOCK_EX)\nprint('held', flush=True)\nsys.stdin.read()", line.path],
                stdin=subprocess.PIPE, stdout=subprocess.PIPE)
            try:
                self.assertEqual(holder.stdout.readline(), b"held\n")
                found = self.assert_found(f"tformat:{line.path}", "port_in_use")
                self.assertIn(str(holder.pid), found["findings"][0]["evidence"])
            finally:
                holder.communicate()

    def test_port_without_permission(self):
        line = FakeEncoder()
        with line:
            os.chmod(line.path, 0o000)
            if os.geteuid() != 0:
                self.assert_found(f"tformat:{line.path}", "port_forbidden")
                return
            setpriv = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]
            command = [ABSENC, "doctor", f"tformat:{line.path}", "--json"]
            # The test is skipped if another user cannot run the command, because he has no access to its folder.
            probe = subprocess.run([*setpriv, ABSENC, "list"], capture_output=True, check=False)
            if probe.returncode != 0:
                self.skipTest("another user cannot run the command here")
            result = subprocess.run([*setpriv, *command], capture_output=True, text=True, check=False)
            self.assertEqual(ids(json.loads(result.stdout)), ["port_forbidden"], result.stderr)

    def test_only_echo(self):
        class Echo(FakeEncoder):
            def answer(self, request):
                return request

        with Echo() as line:
            found = self.assert_found(f"tformat:{line.path}", "only_echo")
            self.assertIn("1A", found["findings"][0]["evidence"])

    def test_modem(self):
        class Modem(FakeEncoder):
            def answer(self, request):
                return request + b"\r\nERROR\r\n"

        with Modem() as line:
            self.assert_found(f"tformat:{line.path}", "modem_answers")

    def test_no_reply(self):
        with FakeEncoder() as line:
            self.assert_found(f"tformat:{line.path}", "no_answer")

    def test_inverted_line(self):
        class Inverted(FakeEncoder):
            def answer(self, request):
                return bytes(9)

        with Inverted() as line:
            self.assert_found(f"tformat:{line.path}", "line_inverted")

    def test_line_that_is_never_silent(self):
        with BabblingLine(period=0.002, pieces=(b"\x55\x12",)) as line:
            self.assert_found(f"tformat:{line.path}", "never_silent")

    def test_device_that_takes_no_request(self):
        """Its frames may pass for replies to the requests that it ignores."""
        with BabblingLine(period=0.002, pieces=(GOOD_REPLY,)) as line:
            result, found = doctor(f"tformat:{line.path}?{PATIENT}")
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertIn("never_silent", ids(found))

    def test_few_readings_are_not_good(self):
        # this encoder has 18 readings a second
        result, found = doctor("sim:hiperface", "--for", "0.2")
        self.assertEqual((result.returncode, ids(found)), (1, ["few_readings"]), result.stdout)
        self.assertRegex(found["findings"][0]["evidence"], r"^only [1-9] readings? in ")
        self.assertNotIn("good", found["verdict"])

    def test_verdict_says_what_was_not_looked_at(self):
        result, found = doctor("sim:hiperface?motion=rpm=60")
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertRegex(found["not_looked_at"][0], r"^jumps .*max_rpm")
        self.assertIn(", ".join(found["not_looked_at"]), found["verdict"])
        _, found = doctor("sim:hiperface?max_rpm=60&motion=rpm=50", "--turn", "2")
        self.assertEqual(found["findings"], [])
        self.assertNotIn("jumps", found["verdict"])

    def test_pseudo_terminal_has_no_wrong_baud_rate(self):
        for requested_rate, rate in ((2_000_000, 2_500_000), (2_500_000, 9_600)):
            with self.subTest(rate=rate), TurnedRate(rate, GOOD_REPLY) as line:
                _, found = doctor(f"tformat:{line.path}?baud={requested_rate}&{PATIENT}")
                self.assertNotIn("wrong_baud", ids(found))
                self.assertNotIn("good:", found["verdict"])

    def test_other_model(self):
        emulator = self.emulator("--model", "23-bit", "--motion", "rpm=60")
        found = self.assert_found(f"tformat:{emulator.path}?{PATIENT}", "wrong_settings")
        self.assertEqual(found["findings"][0]["action"], "set model=23-bit")
        with Emulator(self.directory, "--motion", "rpm=60", name="usual") as usual:
            found = self.assert_found(f"tformat:{usual.path}?model=23-bit&{PATIENT}", "wrong_settings")
            self.assertEqual(found["findings"][0]["action"], "set model=TS5700N8500")

    def test_other_address(self):
        with Emulator(self.directory, "--option", "address=3", protocol="esl", name="third") as third:
            found = self.assert_found(f"esl:{third.path}?latency=50", "wrong_address")
            self.assertEqual(found["findings"][0]["action"], "set address=3")

    def test_other_protocol(self):
        emulator = self.emulator("--motion", "rpm=60")
        found = self.assert_found(f"esl:{emulator.path}?latency=50", "other_protocol")
        self.assertIn(f"absenc read \"tformat:{emulator.path}", found["findings"][0]["action"])

    def test_two_encoders_with_same_address(self):
        with Emulator(self.directory, "--option", "address=3", "--also", "address=3&singleturn=1234567",
                      protocol="esl", name="both") as both:
            found = self.assert_found(f"esl:{both.path}?address=3&latency=50", "same_address")
            self.assertIn("3", found["findings"][0]["evidence"])

    def test_can_bus_without_acknowledge(self):
        with RefusingAdapter() as line:
            self.assert_found(f"raa38-can:slcan:{line.path}", "can_errors")

    def test_other_can_bit_rate(self):
        with Emulator(self.directory, "--option", "bitrate=500000", protocol="raa38-can", name="bus") as bus:
            found = self.assert_found(f"raa38-can:slcan:{bus.path}?{PATIENT}", "wrong_baud")
            self.assertEqual(found["findings"][0]["action"], "set bitrate=500000")

    def test_flat_battery_has_advice_of_document(self):
        emulator = self.emulator("--alarm", "battery_alarm")
        found = self.assert_found(f"tformat:{emulator.path}?{PATIENT}", "alarm")
        self.assertIn("replace the battery", found["findings"][0]["action"])

    def test_encoder_without_battery_is_healthy(self):
        """Without a battery, battery_error and battery_alarm are always set (paragraph 2 (1))."""
        result, found = doctor("sim:tformat?battery=false")
        self.assert_good(result)
        self.assertEqual((found["ok"], found["findings"]), (True, []))
        _, found = doctor("sim:tformat?battery=false&alarm=over_heat")
        evidence = [finding["evidence"] for finding in found["findings"]]
        self.assertEqual(len(evidence), 1, found)
        self.assertRegex(evidence[0], r"^the encoder reports over_heat in all \d+ readings$")
        self.assertIn("battery=false", doctor("sim:tformat?condition=battery=0")[1]["findings"][0]["action"])

    def test_late_replies(self):
        result, found = doctor("sim:tformat?fault=delay=1")
        self.assertEqual(result.returncode, 1)
        self.assertEqual(ids(found), ["reply_late"])

    def test_sends_no_changing_request(self):
        """Doctor also tries requests of other protocols."""
        requests = set()

        class Listening(FakeEncoder):
            def answer(self, request):
                requests.add(request)
                return b""

        with Listening() as line:
            doctor(f"tformat:{line.path}")
        self.assertTrue(requests)
        self.assertIn(b"\x1A", requests)
        # first bytes of requests that change the encoder: resets of alarms, position and turns, and EEPROM write
        changing = {0xBA, 0xC2, 0x62, 0x32}
        self.assertEqual({request[0] for request in requests} & changing, set())

    def test_refuses_wrong_usage(self):
        self.assert_wrong_usage(absenc("doctor", "tfromat:/dev/null"), "tformat")
        self.assert_wrong_usage(absenc("doctor", "sim:tformat", "--readings", "no"), "--readings")


class OneLineFinding(EncoderCase):
    """Tests that `read` and `monitor` name the same finding as doctor, and refer to doctor."""

    def test_read_and_monitor_name_finding(self):
        class Echo(FakeEncoder):
            def answer(self, request):
                return request

        with Echo() as line:
            result = absenc("read", f"tformat:{line.path}")
            self.assertEqual(result.returncode, 1)
            lines = [text for text in result.stderr.splitlines() if "absenc doctor" in text]
            self.assertEqual(len(lines), 1, result.stderr)
            self.assertIn("only_echo: ", lines[0])
            self.assertIn(f"`absenc doctor tformat:{line.path}`", lines[0])
            seen = absenc("monitor", f"tformat:{line.path}", "--for", "0.5")
            self.assertIn("only_echo: ", seen.stderr)
            self.assertIn("absenc doctor", seen.stderr)

    def test_good_reading_names_no_finding(self):
        result = absenc("read", "sim:tformat")
        self.assert_good(result)
        self.assertNotIn("doctor", result.stderr)


if __name__ == "__main__":
    unittest.main()
