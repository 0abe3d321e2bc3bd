#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The E201-9S on a pseudo-terminal, read and set up by the command."""
import json
import unittest

from command_support import Case, Emulator, absenc


class Interface(Case):
    def emulator(self, *arguments):
        return Emulator(self.directory, *arguments, protocol="e201")

    def run_json(self, path, *arguments):
        result = absenc(*arguments[:1], f"e201:{path}", *arguments[1:], "--json")
        self.assert_good(result)
        return json.loads(result.stdout)

    def test_reads_a_biss_encoder(self):
        options = ["--option", "singleturn_bits=19", "--option", "multiturn_bits=16"]
        with self.emulator(*options, "--singleturn", "275096", "--multiturn", "1") as emulator:
            reading = self.run_json(emulator.path, "read", *options)
            self.assertEqual((reading["singleturn"], reading["multiturn"]), (275096, 1))
            self.assertTrue(reading["singleturn_valid"])

    def test_reads_an_ssi_encoder(self):
        options = ["--option", "carries=ssi", "--option", "singleturn_bits=13", "--option", "gray=true"]
        with self.emulator(*options, "--singleturn", "4660") as emulator:
            self.assertEqual(self.run_json(emulator.path, "read", *options)["singleturn"], 4660)

    def test_clock_supply_and_info(self):
        with self.emulator() as emulator:
            self.assertEqual(self.run_json(emulator.path, "run", "set-clock", "560", "--yes")["fields"]["clock"], 5)
            info = self.run_json(emulator.path, "run", "info")["fields"]
            self.assertEqual((info["version"], info["clock_khz"]), ("E201-9S V1.16", 560))
            self.run_json(emulator.path, "run", "supply-off", "--yes")
            self.assert_failed(absenc("read", f"e201:{emulator.path}"), "line_stuck", "supply-on")
            self.run_json(emulator.path, "run", "supply-on", "--yes")
            self.assert_good(absenc("read", f"e201:{emulator.path}"))

    def test_clock_sweep(self):
        with self.emulator() as emulator:
            fields = self.run_json(emulator.path, "run", "clock-sweep", "3")["fields"]
            self.assertEqual((fields["valid_35_khz"], fields["valid_4400_khz"]), (3, 0))
            self.assertEqual((fields["recommended_khz"], fields["restored_clock"]), (280, 4))

    def test_old_firmware(self):
        with self.emulator("--option", "firmware=1.15") as emulator:
            self.assert_failed(absenc("read", f"e201:{emulator.path}"), "unsupported", "1.16")

    def test_a_line_that_is_too_long(self):
        with self.emulator("--option", "line_delay_ns=3600") as emulator:
            result = absenc("read", f"e201:{emulator.path}")
            self.assertEqual(result.returncode, 1)
            self.run_json(emulator.path, "run", "set-clock", "140", "--yes")
            self.assert_good(absenc("read", f"e201:{emulator.path}"))


class Decode(Case):
    def test_a_linear_encoder(self):
        arguments = ["decode", "e201", "--request", "34", "--hex", "633030343030333033323066666163300d", "--json"]
        fields = json.loads(absenc(*arguments, "--model", "linear-32-0.05um").stdout)["fields"]
        self.assertEqual(fields["position"], 1579271)
        self.assertAlmostEqual(fields["position_mm"], 78.96355, delta=1e-9)
        options = ["--option", "position_bits=32", "--option", "unit_um=0.05"]
        self.assertEqual(json.loads(absenc(*arguments, *options).stdout)["fields"], fields)

    def test_units_have_six_decimals(self):
        arguments = ["decode", "biss", "--hex", "0101"]
        self.assert_wrong_usage(absenc(*arguments, "--option", "unit_um=0.0000001"), "0.0 to 1000000.0")
        self.assert_wrong_usage(absenc(*arguments, "--option", "unit_um=-1"), "unit_um")

    def test_sixty_four_bits(self):
        vectors = [json.loads(line) for line in absenc("vectors", "biss", "--json").stdout.splitlines()]
        widest = next(vector for vector in vectors if vector["id"] == "biss-009")
        self.assertEqual(widest["fields"]["position"], 2**64 - 1)


if __name__ == "__main__":
    unittest.main()
