# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc read`, `run` and `bench`."""
import json
import os
import pty
import re
import select
import shutil
import signal
import socket
import subprocess
import time
import unittest

from command_support import (ABSENC, PATIENCE, Emulator, EncoderCase, FakeEncoder, absenc, end, json_lines, read_line,
                             wait_for_handler)

GOOD_REPLY = bytes([0x1A, 0, 0, 0, 0, 0x11, 0, 0, 0, 0, 0x0B])
NOBODY = 65534


class Readings(EncoderCase):
    def test_text(self):
        result = absenc("read", self.encoder("--singleturn", "74565", "--multiturn", "4660"))
        self.assert_good(result)
        self.assertRegex(result.stdout, r"^204\.799 deg +74565 counts +4660 turns +no alarms\n$")
        self.assertEqual(result.stderr, "")

    def test_angle_has_digits_of_resolution(self):
        result = absenc("read", self.encoder("--model", "23-bit", "--singleturn", "1", more="&model=23-bit"))
        self.assertRegex(result.stdout, r"^ *0\.00004 deg +1 counts")

    def test_json(self):
        result = absenc("read", self.encoder("--singleturn", "74565", "--multiturn", "4660"), "--json", "--count", "3",
                        "--rate", "0")
        self.assert_good(result)
        readings = json_lines(result.stdout)
        self.assertEqual(len(readings), 3)
        times = [reading.pop("time_s") for reading in readings]
        self.assertEqual(times, sorted(times))
        self.assertEqual(readings[0], {
            "protocol": "tformat", "angle_deg": 360 * 74565 / 2**17, "singleturn": 74565, "singleturn_bits": 17,
            "singleturn_valid": True, "singleturn_valid_bits": 17, "multiturn": 4660, "multiturn_bits": 16,
            "multiturn_valid": True, "status": [], "alarms": [], "confirmed": True, "ok": True})

    def test_csv(self):
        result = absenc("read", self.encoder("--multiturn", "7", "--alarm", "over_speed"), "--csv", "--count", "2")
        self.assert_good(result)
        header, *rows = [line.split(",") for line in result.stdout.splitlines()]
        self.assertEqual(header, ["time_s", "angle_deg", "singleturn", "singleturn_valid", "multiturn",
                                  "multiturn_valid", "status", "alarms", "event"])
        self.assertEqual(len(rows), 2)
        self.assertEqual(rows[0][1:], ["0", "0", "true", "7", "false", "none", "over_speed", ""])
        self.assertEqual(result.stderr, "")

    def test_csv_has_row_for_failed_reading(self):
        for place in ("sim:tformat?", "sim:esl?", "sim:biss?model=linear-32-0.05um&"):
            with self.subTest(place):
                result = absenc("read", place + "fault=silence=1", "--csv", "--count", "3", "--rate", "0")
                self.assertEqual(result.returncode, 1)
                header, *rows = [line.split(",") for line in result.stdout.splitlines()]
                self.assertEqual(len(rows), 3, result.stderr)
                for row in rows:
                    self.assertEqual(len(row), len(header))
                    self.assertGreater(float(row[0]), 0)
                    self.assertEqual(set(row[1:-1]), {""})
                    self.assertIn(f"absenc: {row[-1]}: ", result.stderr)

    def test_missing_port_is_reported_in_json(self):
        for verb in ("read", "info", "alarms", "temperature", "bench"):
            with self.subTest(verb):
                result = absenc(verb, "tformat:/dev/nothing", "--json")
                self.assertEqual((result.returncode, result.stderr), (1, ""))
                answer = json.loads(result.stdout)
                self.assertEqual((answer["ok"], answer["error"]), (False, "not_found"))
                self.assertIn("there is no port /dev/nothing", answer["message"])
        result = absenc("zero", "tformat:tcp:127.0.0.1:1", "--json", "--yes")
        self.assertEqual((result.returncode, json.loads(result.stdout)["ok"]), (1, False))

    def test_alarms_are_explained_once(self):
        result = absenc("read", self.encoder("--alarm", "battery_alarm"), "--count", "3", "--rate", "0")
        self.assertEqual(result.stdout.count("alarms: battery_alarm"), 3)
        self.assertEqual(result.stderr.count("the battery is below 3.1 V"), 1)
        self.assertIn("replace the battery", result.stderr)

    def test_invalid_parts_are_no_numbers(self):
        for alarm, words, invalid in [
                ("battery_error", r"^ *0\.000 deg +0 counts +turns INVALID \(12\) +alarms: battery_error\n", "multiturn"),
                ("counting_error", r"^position INVALID \(0\) +12 turns +alarms: counting_error\n", "singleturn"),
                ("full_absolute_status", r"^position INVALID \(only the top 5 of 17 bits hold: 0 deg\)", "singleturn")]:
            with self.subTest(alarm):
                with Emulator(self.directory, "--multiturn", "12", "--alarm", alarm) as emulator:
                    address = f"tformat:{emulator.path}?latency=300"
                    self.assertRegex(absenc("read", address).stdout, words)
                    reading = json.loads(absenc("read", address, "--json").stdout)
                for part in ("singleturn", "multiturn"):
                    self.assertEqual(reading[part + "_valid"], part != invalid)
                self.assertEqual(reading["angle_deg"] is None, invalid == "singleturn")

    def test_turning_shaft(self):
        address = self.encoder("--motion", "rpm=60")
        readings = json_lines(absenc("read", address, "--json", "--count", "20", "--rate", "200").stdout)
        for before, after in zip(readings, readings[1:]):
            turned = (after["angle_deg"] - before["angle_deg"]) % 360
            # The tolerance for the motion between two readings is large, 0.3 turns: the encoder may sample a position
            # later than at the time in `time_s`.
            self.assertAlmostEqual(turned, 360 * (after["time_s"] - before["time_s"]), delta=360 * 0.3)
            self.assertGreater(turned, 0)

    def test_rate(self):
        before = time.monotonic()
        self.assert_good(absenc("read", self.encoder(), "--count", "11", "--rate", "50"))
        self.assertGreaterEqual(time.monotonic() - before, 10 / 50)

    def test_tcp(self):
        emulator = self.emulator("--tcp", "0", "--singleturn", "5")
        port = emulator.line().strip().rsplit(":", 1)[1]
        for host in ("127.0.0.1", "localhost"):
            result = absenc("read", f"tformat:tcp:{host}:{port}", "--json")
            self.assert_good(result)
            self.assertEqual(json.loads(result.stdout)["singleturn"], 5)

    def test_echo_is_removed(self):
        for echo in ("", "&echo=auto", "&echo=on"):
            with self.subTest(echo), Emulator(self.directory, "--fault", "echo=1", "--singleturn", "5") as emulator:
                result = absenc("read", f"tformat:{emulator.path}?latency=300{echo}", "--json", "--count", "3")
                self.assert_good(result)
                self.assertEqual([reading["singleturn"] for reading in json_lines(result.stdout)], [5, 5, 5])

    def test_options_of_command_line(self):
        emulator = self.emulator("--model", "23-bit", "--singleturn", "8000000")
        result = absenc("read", f"tformat:{emulator.path}", "--option", "model=23-bit", "--option", "latency=300")
        self.assert_good(result)


class Simulator(EncoderCase):
    def test_reads_without_hardware(self):
        result = absenc("read", "sim:tformat?singleturn=5&multiturn=7", "--json")
        self.assert_good(result)
        reading = json.loads(result.stdout)
        self.assertEqual((reading["singleturn"], reading["multiturn"]), (5, 7))

    def test_motion(self):
        result = absenc("read", "sim:tformat?motion=rpm=60&model=23-bit", "--count", "5", "--rate", "100", "--json")
        readings = json_lines(result.stdout)
        self.assertEqual(len({reading["angle_deg"] for reading in readings}), 5)
        self.assertEqual(readings[0]["singleturn_bits"], 23)

    def test_damaged_words_are_not_confirmed(self):
        """SSI has no check: only another word can confirm a word."""
        result = absenc("read", "sim:ssi?fault=corrupt=1&max_rpm=1", "--json", "--count", "6", "--rate", "50")
        readings = [json.loads(line) for line in result.stdout.splitlines()]
        self.assertEqual(len(readings), 6)
        for one in readings:
            away = min(one["singleturn"], 4096 - one["singleturn"])
            # Two damaged words with nearly the same position may confirm each other by chance.
            self.assertTrue(not one["confirmed"] or away <= 4, one)
        doubtful = [one for one in readings if not one["confirmed"]]
        self.assertTrue(doubtful)
        for one in doubtful:
            self.assertIsNone(one["angle_deg"])
            self.assertFalse(one["singleturn_valid"])

    def test_speed_limit_confirms_words(self):
        """Three of ten words are damaged. Damaged words may confirm each other by chance."""
        for encoder in ("sim:ssi?fault=corrupt=0.3&max_rpm=1", "sim:amt21?fault=corrupt=0.3&max_rpm=1"):
            result = absenc("read", encoder, "--json", "--count", "400", "--rate", "0")
            readings = [json.loads(line) for line in result.stdout.splitlines()]
            confirmed = [one["singleturn"] for one in readings if one.get("confirmed")]
            self.assertGreater(len(confirmed), 300, encoder)
            self.assertLess(sum(one != 0 for one in confirmed), 40, encoder)

    def test_faults_and_alarms(self):
        self.assert_failed(absenc("read", "sim:tformat?fault=silence=1"), "timeout", "the virtual encoder")
        result = absenc("read", "sim:tformat?alarm=over_heat&alarm=battery_alarm", "--json")
        self.assertEqual(json.loads(result.stdout)["alarms"], ["over_heat", "battery_alarm"])


class ErrorMessages(EncoderCase):
    """Tests that error messages state what happened."""

    def test_silence(self):
        result = absenc("read", f"tformat:{self.emulator('--fault', 'silence=1').path}")
        self.assert_failed(result, "absenc: timeout: the encoder did not answer", "sent 1A to ", "at 2500000 baud",
                           "Try: check supply")
        self.assertRegex(result.stderr, r"nothing came back within 100 us, plus \d+ ms for the adapter or network\n")
        self.assertEqual(result.stdout, "")

    def test_hint_examines_the_same_encoder(self):
        encoder = "sim:tformat?fault=silence=1&seed=2"
        self.assertIn(f'`absenc doctor "{encoder}"` says more', absenc("read", encoder).stderr)

    def test_silence_as_json(self):
        result = absenc("read", f"tformat:{self.emulator('--fault', 'silence=1').path}", "--json", "--count", "2")
        self.assertEqual(result.returncode, 1)
        for line in json_lines(result.stdout):
            self.assertEqual((line["ok"], line["error"], line["sent"], line["received"]), (False, "timeout", "1A", ""))
            self.assertTrue(line["message"])

    def test_corruption(self):
        result = absenc("read", self.encoder("--fault", "corrupt=1", latency=20), "--json", "--count", "20", "--rate", "0")
        self.assertEqual(result.returncode, 1)
        lines = json_lines(result.stdout)
        self.assertEqual([line["ok"] for line in lines], [False] * 20)
        bad = [line for line in lines if line["error"] == "bad_checksum"]
        self.assertGreater(len(bad), 10)
        self.assertRegex(bad[0]["received"], r"^([0-9A-F]{2} ){10}[0-9A-F]{2}$")

    def test_repeated_error_has_advice_once(self):
        result = absenc("read", self.encoder("--fault", "silence=1", latency=0), "--count", "3", "--rate", "0")
        self.assert_failed(result)
        self.assertEqual(result.stderr.count("absenc: timeout"), 3)
        self.assertEqual(result.stderr.count("Try:"), 1)

    def test_unexpected_echo(self):
        result = absenc("read", self.encoder("--fault", "echo=1", latency=20, more="&echo=off"))
        self.assert_failed(result, "wrong_length", "after the adapter's echo", "received 1A 1A 00", "set echo=on")

    def test_missing_echo(self):
        result = absenc("read", self.encoder(latency=20, more="&echo=on"))
        self.assert_failed(result, "if no echo is taken from it", "set echo=off")

    def test_refusal_is_explained(self):
        for alarm, words in [(0x40, "ca0: it received the request with a parity error"),
                             (0x80, "ca1: it received a damaged character")]:
            reply = bytes([0x1A, alarm, 0, 0, 0, 0x11, 0, 0, 0, 0, 0x1A ^ alarm ^ 0x11])
            with FakeEncoder(reply) as fake:
                result = absenc("read", f"tformat:{fake.path}?latency=100&echo=off")
            self.assert_failed(result, "request_rejected", words, "Try: send the same request again")
            self.assert_failed(absenc("decode", "tformat", "--request", "1A", "--hex", reply.hex()), "request_rejected",
                               words, "send the same request again")

    def test_only_echo(self):
        for echo in ("auto", "on", "off"):
            with self.subTest(echo), FakeEncoder([0x1A]) as fake:
                result = absenc("read", f"tformat:{fake.path}?latency=200&echo={echo}")
                self.assert_failed(result, "only the request itself came back", "received 1A", "Try: check supply")

    def test_one_byte_too_long(self):
        for extra in (0x00, 0x1A):
            with self.subTest(extra), FakeEncoder(GOOD_REPLY + bytes([extra])) as fake:
                result = absenc("read", f"tformat:{fake.path}?latency=200&echo=off")
                self.assert_failed(result, "wrong_length", "the first 11 bytes are a good reply, but 1 byte more came")

    def test_one_byte_too_short(self):
        with FakeEncoder(GOOD_REPLY[:-1]) as fake:
            result = absenc("read", f"tformat:{fake.path}?latency=20")
            self.assert_failed(result, "wrong_length", "received 1A 00 00 00 00 11 00 00 00 00 ")

    def test_other_model(self):
        result = absenc("read", self.encoder("--model", "23-bit", latency=20))
        self.assert_failed(result, "unexpected_reply", "a good reply of the model 23-bit", "Try: set model=23-bit")

    def test_missing_port(self):
        result = absenc("read", "tformat:/dev/ttyABSENC9")
        self.assert_failed(result, "there is no port /dev/ttyABSENC9")
        ports = [f"/dev/{name}" for name in sorted(os.listdir("/sys/class/tty"))
                 if os.path.exists(f"/sys/class/tty/{name}/device")
                 and self.first(f"/sys/class/tty/{name}/type") != "0"]
        for port in ports:
            self.assertIn(port, result.stderr)

    @staticmethod
    def first(path):
        try:
            with open(path, encoding="ascii") as file:
                return file.readline().strip()
        except OSError:
            return ""

    def test_file_is_no_port(self):
        self.assert_failed(absenc("read", f"tformat:{self.file('file', 'text')}"), "not a serial port")

    def test_nothing_listens_on_tcp_port(self):
        with socket.socket() as listener:
            listener.bind(("127.0.0.1", 0))  # reserves a TCP port, on which no program listens then
            result = absenc("read", f"tformat:tcp:127.0.0.1:{listener.getsockname()[1]}")
        self.assert_failed(result, "nothing listens on 127.0.0.1")

    def test_unplugged(self):
        emulator = self.emulator()
        process = self.start("read", f"tformat:{emulator.path}", "--count", "1000000", "--rate", "0")
        self.first_line(process)
        emulator.end()
        _, err = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 1)
        self.assertIn("went away", err.decode())

    def test_endless_reading_waits_for_unplugged_encoder(self):
        with Emulator(self.directory, "--singleturn", "1000") as emulator:
            process = self.start("read", f"tformat:{emulator.path}?latency=300", "--count", "0", "--rate", "100", "--json")
            self.first_line(process)
            emulator.kill()
            lines = [self.next_line(process)]
            while "event" not in lines[-1]:
                lines.append(self.next_line(process))
        with Emulator(self.directory, "--singleturn", "2000"):
            while len(lines) < 3 or "singleturn" not in lines[-1]:
                lines.append(self.next_line(process))
            status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0)
        self.assertEqual([line["event"] for line in lines if "event" in line], ["lost", "back"])
        lost = next(number for number, line in enumerate(lines) if "event" in line)
        self.assertEqual({line["singleturn"] for line in lines[:lost]} - {1000}, set())
        self.assertEqual(lines[-1]["singleturn"], 2000)
        self.assertEqual(sorted(line["time_s"] for line in lines), [line["time_s"] for line in lines])
        self.assertIn("Waiting for it to come back", messages)
        self.assertRegex(messages, r"the port is back after [\d.]+ m?s")
        self.assertIn("the port went away: 1", messages)

    def next_line(self, process):
        return json.loads(self.first_line(process))


class OrdinaryUser(EncoderCase):
    """Tests of file access. As root they run a copy of absenc as the user nobody."""

    def setUp(self):
        super().setUp()
        self.command = ABSENC
        self.settings = {}
        if os.getuid() == 0:
            self.command = self.file("absenc")
            shutil.copy(ABSENC, self.command)
            os.chmod(self.command, 0o755)
            self.settings = {"user": NOBODY, "group": NOBODY, "extra_groups": []}

    def as_user(self, *arguments):
        return subprocess.run([self.command, *arguments], capture_output=True, text=True, timeout=PATIENCE, check=False,
                              stdin=subprocess.DEVNULL, **self.settings)

    def test_port_in_use(self):
        emulator = self.emulator()
        if self.settings:
            os.chown(emulator.path, NOBODY, NOBODY)
        address = f"tformat:{emulator.path}?latency=300"
        first = subprocess.Popen([self.command, "read", address, "--count", "0"], bufsize=0, stdout=subprocess.PIPE,
                                 stderr=subprocess.PIPE, **self.settings)
        try:
            self.first_line(first)
            second = self.as_user("read", address)
            self.assert_failed(second, emulator.path, "in use", f"process {first.pid}")
            # The first `read` continues, although a second `read` tried to open the same port.
            self.assertIsNotNone(read_line(first.stdout, time.monotonic() + PATIENCE))
        finally:
            end(first)
        self.assert_good(self.as_user("read", address))

    @unittest.skipUnless(os.getuid() == 0, "only root can give a port to another group")
    def test_port_without_permission(self):
        import grp
        emulator = self.emulator()
        group = grp.getgrnam("dialout")
        os.chown(emulator.path, 0, group.gr_gid)
        os.chmod(emulator.path, 0o660)
        self.assert_failed(self.as_user("read", f"tformat:{emulator.path}"), "no permission", "the group dialout",
                           "usermod -aG dialout")

    def test_read_only_memory_file(self):
        path = self.file("memory")
        self.assert_good(absenc("emulate", "tformat", "--memory", path, "--for", "0.01"))
        os.chmod(path, 0o444)
        result = self.as_user("emulate", "tformat", "--memory", path, "--for", "60")
        self.assert_failed(result, path, "cannot be written")


class Termination(EncoderCase):
    def test_interrupted_stream(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(number), Emulator(self.directory) as emulator:
                process = self.start("read", f"tformat:{emulator.path}?latency=300", "--count", "0", "--rate", "100")
                self.first_line(process)
                status, _, err = end(process, number)
                self.assertEqual(status, 0, err)
                self.assertRegex(err, r"^absenc: \d+ good readings and 0 failed ones in [\d.]+ m?s; exchanges: \d+ good")

    def test_interrupted_stream_of_failures(self):
        process = self.start("read", self.encoder("--fault", "silence=1", latency=0), "--count", "0", "--json")
        self.first_line(process)
        status, _, err = end(process, signal.SIGINT)
        self.assertEqual(status, 1)
        self.assertRegex(err, r"0 good readings and \d+ failed ones .*\d+ timeout")

    def test_interrupted_count(self):
        process = self.start("read", self.encoder(), "--count", "1000")
        self.first_line(process)
        status, _, err = end(process, signal.SIGINT)
        self.assertEqual((status, err), (1, "absenc: interrupted\n"))

    def test_interrupted_change(self):
        emulator = self.emulator("--fault", "silence=1")
        process = self.start("zero", f"tformat:{emulator.path}?latency=60000", "--yes")
        wait_for_handler(process)
        status, _, err = end(process, signal.SIGINT)
        self.assertEqual(status, 1)
        # `zero` was interrupted while it still read the position, so no change was sent.
        self.assert_sentence(err, "interrupted in the middle of zero", "Change: not sent")

    def test_interrupted_wait_for_reply(self):
        emulator = self.emulator("--fault", "silence=1")
        process = self.start("read", f"tformat:{emulator.path}?latency=60000")
        wait_for_handler(process)
        self.assertEqual(end(process, signal.SIGINT)[::2], (1, "absenc: interrupted\n"))

    def test_closed_output_ends_reading(self):
        for form in ([], ["--json"], ["--csv"]):
            with self.subTest(form), Emulator(self.directory) as emulator:
                process = self.start("read", f"tformat:{emulator.path}?latency=300", "--count", "0", "--rate", "0", *form)
                self.first_line(process)
                process.stdout.close()
                self.assertEqual(process.wait(PATIENCE), 0)
                self.assertEqual(process.stderr.read(), b"")
                process.stderr.close()

    def test_head(self):
        result = subprocess.run(["sh", "-c", '"$0" read sim:tformat --count 0 --rate 0 | head -1', ABSENC],
                                capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual(len(result.stdout.splitlines()), 1)

    def test_closed_output_does_not_become_the_port(self):
        emulator = self.emulator()
        result = subprocess.run(["sh", "-c", '"$0" read "tformat:$1?latency=300" >&-', ABSENC, emulator.path],
                                capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assert_failed(result, "standard output cannot be written")
        # Only the two position requests reached the emulator: the text of the reading was not written to the port in
        # place of the closed output.
        self.assertIn("absenc: 2 requests answered", emulator.end()[2])


class Run(EncoderCase):
    def test_fields(self):
        address = self.encoder()
        self.assertRegex(absenc("run", address, "temperature").stdout, r"^temperature_c +35 degC ")
        result = absenc("run", address, "temperature", "--json")
        self.assertEqual(json.loads(result.stdout), {"ok": True, "fields": {"temperature_c": 35}})

    def test_invalid_fields_are_marked(self):
        for encoder, command, field, words in [
                ("sim:tformat?singleturn=74565&alarm=full_absolute_status", "singleturn", "singleturn",
                 "INVALID (only the top 5 of 17 bits hold: 73728 counts)"),
                ("sim:tformat?singleturn=74565&alarm=counting_error", "singleturn", "singleturn", "INVALID (74565 counts)"),
                ("sim:tformat?multiturn=5&alarm=over_speed", "multiturn", "multiturn", "INVALID (5 revolutions)"),
                ("sim:tformat?multiturn=5&alarm=battery_error", "position", "multiturn", "INVALID (5 revolutions)"),
                ("sim:esl?singleturn=70000&alarm=memory_error", "calibration", "redundant_singleturn", "INVALID (273 counts)"),
                ("sim:esl?multiturn=5&alarm=xc_error", "position", "multiturn", "INVALID (5 revolutions)"),
                ("sim:encolink?singleturn=7&alarm=signal_lost", "position", "singleturn", "INVALID (7 counts)"),
                ("sim:biss?singleturn=7&alarm=error", "position", "singleturn", "INVALID (7 counts)"),
        ]:
            with self.subTest(encoder, command=command):
                result = absenc("run", encoder, command)
                self.assert_good(result)
                self.assertRegex(result.stdout, rf"(?m)^{field} +{re.escape(words)}")
                fields = json.loads(absenc("run", encoder, command, "--json").stdout)["fields"]
                self.assertIs(fields[f"{field}_valid"], False)
                good = json.loads(absenc("run", encoder.split("&alarm")[0], command, "--json").stdout)["fields"]
                self.assertNotIn(f"{field}_valid", good)
        fields = json.loads(absenc("run", "sim:biss?alarm=error", "position", "--json").stdout)["fields"]
        self.assertIs(fields["angle_deg_valid"], False)

    def test_invalid_fields_of_changes_are_marked(self):
        result = absenc("zero", "sim:tformat?multiturn=5&alarm=over_speed", "--yes")
        self.assert_good(result)
        self.assertRegex(result.stdout, r"(?m)^multiturn +INVALID \(5 revolutions\)")
        self.assertRegex(result.stdout, r"(?m)^singleturn +0 counts")

    def test_memory(self):
        address = self.encoder()
        for value, written in (("0x42", True), ("66", False)):
            result = absenc("run", address, "memory-write", "5", value, "3", "--yes", "--json")
            self.assertEqual(json.loads(result.stdout),
                             {"ok": True, "fields": {"page": 3, "address": 5, "value": 66, "written": written},
                              "change": "confirmed" if written else "not_sent"})
        result = absenc("run", address, "memory-read", "4", "3", "3", "--json")
        self.assertEqual(json.loads(result.stdout)["fields"]["data"], "004200")

    def test_zero(self):
        address = self.encoder("--singleturn", "1000", "--multiturn", "7")
        self.assert_good(absenc("run", address, "zero", "--yes"))
        reading = json.loads(absenc("read", address, "--json").stdout)
        self.assertEqual((reading["singleturn"], reading["multiturn"]), (0, 7))

    def test_verbs_for_common_commands(self):
        address = self.encoder("--singleturn", "1000", "--multiturn", "7", "--alarm", "over_speed")
        self.assertRegex(absenc("temperature", address).stdout, r"^temperature_c +35 degC ")
        cleared = json.loads(absenc("clear-alarms", address, "--yes", "--json").stdout)
        self.assertEqual((cleared["fields"]["alarms"], cleared["fields"]["multiturn"]), ([], 7))
        self.assert_good(absenc("zero", address, "--yes"))
        self.assert_good(absenc("reset-multiturn", address, "--yes"))
        reading = json.loads(absenc("read", address, "--json").stdout)
        self.assertEqual((reading["singleturn"], reading["multiturn"], reading["alarms"]), (0, 0, []))

    def test_changing_verbs_need_consent(self):
        emulator = self.emulator("--multiturn", "7")
        for verb in ("zero", "reset-multiturn", "clear-alarms"):
            self.assert_wrong_usage(absenc(verb, f"tformat:{emulator.path}"), "--yes", "changes the encoder")
        self.assertIn("0 requests answered", emulator.end()[2])

    def test_refuses_zero_of_invalid_position(self):
        for address in (self.encoder("--alarm", "counting_error", "--singleturn", "1000"),
                        "sim:esl?alarm=singleturn_error"):
            self.assert_failed(absenc("zero", address, "--yes"), "invalid_argument", "does not hold", "`absenc alarms`")

    def test_clearing_alarms_does_not_hide_lost_turns(self):
        address = self.encoder("--alarm", "battery_error")
        self.assert_failed(absenc("clear-alarms", address, "--yes"), "turns are lost", "reset-multiturn")
        self.assertEqual(json.loads(absenc("read", address, "--json").stdout)["alarms"], ["battery_error"])

    def test_refuses_zero_of_turning_shaft(self):
        result = absenc("run", self.encoder("--motion", "rpm=60"), "zero", "--yes", "--json")
        self.assertEqual(result.returncode, 1)
        answer = json.loads(result.stdout)
        self.assertEqual((answer["ok"], answer["error"]), (False, "not_still"))
        self.assertIn("the shaft is turning", answer["message"])

    def test_change_without_terminal_needs_yes(self):
        emulator = self.emulator("--singleturn", "1000")
        self.assert_wrong_usage(absenc("run", f"tformat:{emulator.path}", "zero"), "--yes", "zero changes the encoder")
        self.assertIn("0 requests answered", emulator.end()[2])

    def ask(self, address, answer):
        """Runs `zero` on a terminal and gives `answer`. Returns the exit status and the text."""
        terminal, ours = pty.openpty()
        process = subprocess.Popen([ABSENC, "run", address, "zero"], stdin=ours, stdout=subprocess.DEVNULL, stderr=ours)
        os.close(ours)
        shown = b""
        while b"[y/N] " not in shown:
            self.assertTrue(select.select([terminal], [], [], PATIENCE)[0], shown)
            shown += os.read(terminal, 1024)
        os.write(terminal, answer)
        status = process.wait(PATIENCE)
        try:
            while True:
                shown += os.read(terminal, 1024)
        except OSError:  # the process has closed its end of the terminal, and all text was read
            os.close(terminal)
        return status, shown.decode()

    def test_question(self):
        address = self.encoder("--singleturn", "1000")
        for answer in (b"n\n", b"\n", b"yeah\n", b"\x04"):
            with self.subTest(answer):
                status, shown = self.ask(address, answer)
                self.assertEqual(status, 1)
                self.assertIn("make this the zero of the turn", shown)
                self.assertRegex(shown, r"(?s)now: 2\.747 deg +1000 counts .*This changes the encoder")
                self.assertIn("nothing was changed", shown)
        self.assertEqual(json.loads(absenc("read", address, "--json").stdout)["singleturn"], 1000)
        for answer in (b"y\n", b"yes\n", b"Y\n", b"Yes\n", b"YES\n", b" y \n"):
            self.assertEqual(self.ask(address, answer)[0], 0)
        self.assertEqual(json.loads(absenc("read", address, "--json").stdout)["singleturn"], 0)

    def test_closed_memory_area(self):
        result = absenc("run", self.encoder(), "memory-read", "5", "6")
        self.assert_failed(result, "invalid_argument", "this area is closed")


class Bench(EncoderCase):
    def test_json(self):
        result = absenc("bench", self.encoder(), "--seconds", "0.2", "--json")
        self.assert_good(result)
        measured = json.loads(result.stdout)
        self.assertGreater(measured["readings_per_s"], 10)
        latency = measured["latency_us"]
        self.assertEqual(sorted(latency.values()), [latency[name] for name in ("p50", "p90", "p99", "p99.9", "max")])
        self.assertGreater(measured["cpu_us_per_reading"], 0)
        self.assertGreater(measured["line_share"], 0)

    def test_text(self):
        result = absenc("bench", self.encoder(), "--seconds", "0.1")
        self.assert_good(result)
        for word in ("a second", "latency", "99.9 %", "processor", "2500000 baud"):
            self.assertIn(word, result.stdout)

    def test_silence(self):
        self.assert_failed(absenc("bench", "sim:tformat?fault=silence=1"), "timeout")


if __name__ == "__main__":
    unittest.main()
