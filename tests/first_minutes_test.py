# SPDX-License-Identifier: Apache-2.0
"""From what is plugged in to a reading: who types only what the command printed last."""
import json
import re
import shlex
import unittest

from command_support import Case, Emulator, absenc

TYPED = re.compile(r"absenc (?:identify|read) (?:\"[^\"]*\"|[^\s`\"]+)")


def serial_units():
    units = [json.loads(line) for line in absenc("list", "--json").stdout.splitlines()]
    return [unit["protocol"] for unit in units if unit["link"] in ("half_duplex", "full_duplex")]


class FirstMinutes(Case):
    def next_command(self, text):
        found = TYPED.findall(text)
        self.assertTrue(found, text)
        return shlex.split(found[0])[1:]

    def test_from_a_port_to_a_reading(self):
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

    def test_every_verb_that_reads_names_identify(self):
        for verb in ["read", "monitor", "scan", "info", "alarms", "bench"]:
            with self.subTest(verb):
                self.assert_wrong_usage(absenc(verb, "/dev/ttyUSB9"), "`absenc identify /dev/ttyUSB9`")
        self.assert_wrong_usage(absenc("read", "tcp:localhost:4001"), "`absenc identify tcp:localhost:4001`")

    def test_doctor_of_a_port_identifies_first(self):
        with Emulator(self.directory, "--motion", "rpm=10", protocol="raa38") as emulator:
            result = absenc("doctor", emulator.path, "--readings", "10")
            self.assertIn(f"raa38:{emulator.path}", result.stderr)
            self.assertTrue(result.stdout.startswith("good"), result.stdout)
            self.assertEqual(result.returncode, 0)

    def test_doctor_of_a_port_where_nobody_answers(self):
        with Emulator(self.directory, "--fault", "silence=1") as emulator:
            result = absenc("doctor", emulator.path)
            self.assert_failed(result, "which encoder is on", "nothing came back")

    def test_ports(self):
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

    def test_what_people_type(self):
        self.assertEqual(absenc("version").stdout, absenc("--version").stdout)
        self.assertEqual(absenc("help").stdout, absenc("--help").stdout)
        self.assertEqual(absenc("help", "read").stdout, absenc("read", "--help").stdout)
        self.assertEqual(absenc("help", "memory", "read").stdout, absenc("memory", "read", "--help").stdout)
        self.assertEqual(absenc("help", "memory").stdout, absenc("memory", "--help").stdout)
        self.assert_wrong_usage(absenc("help", "raed"), "did you mean read?")


if __name__ == "__main__":
    unittest.main()
