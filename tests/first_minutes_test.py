# SPDX-License-Identifier: Apache-2.0
"""Tests the first steps of a new user, from a serial port to a reading."""
import json
import re
import shlex
import signal
import subprocess
import unittest

from command_support import ABSENC, Case, Emulator, absenc, end, wait_for_handler

TYPED = re.compile(r"absenc (?:identify|read) (?:\"[^\"]*\"|[^\s`\"]+)")


def serial_units():
    units = [json.loads(line) for line in absenc("list", "--json").stdout.splitlines()]
    return [unit["protocol"] for unit in units if unit["link"] in ("half_duplex", "full_duplex")]


class FirstMinutes(Case):
    def next_command(self, text):
        found = TYPED.findall(text)
        self.assertTrue(found, text)
        return shlex.split(found[0])[1:]

    def test_leads_from_port_to_reading(self):
        units = serial_units()
        self.assertGreater(len(units), 4)
        for unit in units:
            with self.subTest(unit), Emulator(self.directory, "--motion", "rpm=1", protocol=unit, name=unit) as emulator:
                refused = absenc("read", emulator.path)
                self.assertEqual(refused.returncode, 2)
                identify = self.next_command(refused.stderr)
                self.assertEqual(identify, ["identify", emulator.path])
                identified = absenc(*identify)
                self.assert_good(identified)
                read = self.next_command(identified.stdout)
                self.assertEqual(read[0], "read")
                self.assertIn(f"{unit}:", read[1])
                reading = absenc(*read, "--count", "1", "--json")
                self.assert_good(reading)
                self.assertTrue(json.loads(reading.stdout)["ok"])

    def test_reading_verbs_refer_to_identify(self):
        for verb in ["read", "monitor", "scan", "info", "alarms", "bench"]:
            with self.subTest(verb):
                self.assert_wrong_usage(absenc(verb, "/dev/ttyUSB9"), "`absenc identify /dev/ttyUSB9`")
        self.assert_wrong_usage(absenc("read", "tcp:localhost:4001"), "`absenc identify tcp:localhost:4001`")

    def test_doctor_identifies_port(self):
        with Emulator(self.directory, "--motion", "rpm=10", protocol="raa38") as emulator:
            result = absenc("doctor", emulator.path, "--readings", "10")
            self.assertIn(f"raa38:{emulator.path}", result.stderr)
            self.assertTrue(result.stdout.startswith("good"), result.stdout)
            self.assertEqual(result.returncode, 0)

    def test_doctor_reports_port_without_reply(self):
        with Emulator(self.directory, "--fault", "silence=1") as emulator:
            result = absenc("doctor", emulator.path)
            self.assert_failed(result, "which encoder is on", "nothing came back")

    def test_doctor_reports_uncertain_protocol(self):
        # The shaft stands still, so all frames are equal: they may fit the protocol by chance.
        with Emulator(self.directory, protocol="raa38") as emulator:
            result = absenc("doctor", emulator.path)
            self.assert_failed(result, "It may be raa38", "may be chance")
            command = shlex.split(re.search(r"`absenc (doctor [^`]*)`", result.stderr).group(1))
            self.assert_good(absenc(*command, "--readings", "10"))

    def test_doctor_ends_by_interrupt(self):
        with Emulator(self.directory, "--motion", "rpm=1") as emulator:
            doctor = subprocess.Popen([ABSENC, "doctor", emulator.path], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
            wait_for_handler(doctor)
            status, out, err = end(doctor, signal.SIGINT)
            self.assertEqual((status, out), (1, ""))
            self.assertIn("interrupted", err)

    def test_ports_are_listed(self):
        alone = absenc()
        self.assert_good(alone)
        ports = absenc("ports")
        self.assert_good(ports)
        self.assertTrue(alone.stdout.startswith(ports.stdout), alone.stdout)
        self.assertIn("`absenc --help`", alone.stdout)
        for line in absenc("ports", "--json").stdout.splitlines():
            port = json.loads(line)
            self.assertIn(port["port"], ports.stdout)
            if port["kind"] == "serial" and port["may_open"] and port["in_use_by"] is None:
                self.assertIn(f"absenc identify {port['port']}", ports.stdout)

    def test_list_accepts_product_names(self):
        for word, words in [("tamagawa", ["Tamagawa: the protocol is tformat", "TS5700N8500", "Commands"]),
                            ("AksIM-2", ["AksIM-2 is a model of encolink and encolink-spi", "full-duplex UART"]),
                            ("rls", ["RLS: the protocols are encolink, encolink-spi", "e201"]),
                            ("aksim2", ["AksIM-2 is a model"]), ("qs35", ["QS35: the protocol is esl"])]:
            with self.subTest(word):
                listed = absenc("list", word)
                self.assert_good(listed)
                for one in words:
                    self.assertIn(one, listed.stdout)
        self.assertEqual(len(absenc("list", "AksIM-2", "--json").stdout.splitlines()), 2)
        for encoder, words in [("TS5700N8500:/dev/ttyUSB0", ["TS5700N8500 is a model of tformat: write tformat;"]),
                               ("23-bit:/dev/ttyUSB0", ["is a model of tformat: write tformat with model=23-bit"]),
                               ("qs35:/dev/ttyUSB0", ["QS35: the protocol is esl: write esl"]),
                               ("sim:rls", ["RLS: the protocols are encolink", "write encolink"])]:
            with self.subTest(encoder):
                self.assert_wrong_usage(absenc("read", encoder), *words)
        self.assert_wrong_usage(absenc("list", "tfromat"), "did you mean tformat?")

    def test_decode_identifies_capture_without_protocol(self):
        capture = self.file("drive.vcd")
        self.assert_good(absenc("wave", "tformat?motion=rpm=60", capture, "--count", "20"))
        result = absenc("decode", capture)
        self.assertEqual(result.returncode, 2)
        self.assertIn("the protocol is missing", result.stderr)
        self.assertIn(f"go on with: absenc decode tformat {capture}", result.stdout)

    def test_list_finds_protocol_of_every_model(self):
        for line in absenc("list", "--json").stdout.splitlines():
            unit = json.loads(line)
            for model in unit["models"]:
                named = [json.loads(one)["protocol"] for one in absenc("list", model["name"], "--json").stdout.splitlines()]
                self.assertIn(unit["protocol"], named)

    def test_settings_have_same_form_in_every_verb(self):
        """Settings after `?` have the same form in the tested verbs."""
        settings = "model=23-bit"
        capture = self.file("capture.vcd")
        for arguments in [["read", f"sim:tformat?{settings}"], ["wave", f"tformat?{settings}", capture],
                          ["wave", f"sim:tformat?{settings}", self.file("other.vcd")],
                          ["decode", f"tformat?{settings}", capture], ["decode", f"sim:tformat?{settings}", capture],
                          ["encode", f"tformat?{settings}", "position"],
                          ["emulate", f"tformat?{settings}&motion=rpm=60&alarm=battery_alarm", "--for", "0.01"],
                          ["emulate", f"sim:tformat?{settings}", "--for", "0.01"],
                          ["info", f"sim:tformat?{settings}"], ["doctor", f"sim:tformat?{settings}", "--for", "0.2"]]:
            with self.subTest(arguments):
                self.assert_good(absenc(*arguments))
        turning = absenc("wave", f"tformat?{settings}&singleturn=5000000", self.file("high.vcd"), "--count", "1")
        self.assert_good(turning)
        self.assertIn("5000000", absenc("decode", f"tformat?{settings}", self.file("high.vcd")).stdout)
        with Emulator(self.directory, protocol=f"tformat?{settings}&singleturn=5000000") as emulator:
            reading = absenc("read", f"tformat:{emulator.path}?{settings}", "--json")
            self.assertEqual(json.loads(reading.stdout)["singleturn"], 5000000)
        for arguments, words in [(["emulate", "tformat?baud=9600"], "no option \"baud\""),
                                 (["emulate", "tformat?motoin=still"], "motoin"),
                                 (["emulate", "tformat?motion=still", "--motion", "still"], "--motion is given 2 times"),
                                 (["decode", "tformat?motion=still", capture], "no option \"motion\"")]:
            with self.subTest(arguments):
                self.assert_wrong_usage(absenc(*arguments), words)

    def test_virtual_encoder_is_valid_at_high_speed(self):
        for line in absenc("list", "--json").stdout.splitlines():
            unit = json.loads(line)["protocol"]
            with self.subTest(unit):
                read = absenc("read", f"sim:{unit}?motion=rpm=3000", "--json", "--count", "3", "--rate", "100")
                self.assert_good(read)
                for one in read.stdout.splitlines():
                    self.assertNotEqual(json.loads(one).get("singleturn_valid"), False, one)

    def test_accepts_common_spellings(self):
        self.assertEqual(absenc("version").stdout, absenc("--version").stdout)
        self.assertEqual(absenc("help").stdout, absenc("--help").stdout)
        self.assertEqual(absenc("help", "read").stdout, absenc("read", "--help").stdout)
        self.assertEqual(absenc("help", "memory", "read").stdout, absenc("memory", "read", "--help").stdout)
        self.assertEqual(absenc("help", "memory").stdout, absenc("memory", "--help").stdout)
        self.assert_wrong_usage(absenc("help", "raed"), "did you mean read?")


if __name__ == "__main__":
    unittest.main()
