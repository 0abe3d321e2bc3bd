# SPDX-License-Identifier: Apache-2.0
"""What changes an encoder says what became of the change, in words and as one word."""
import json
import unittest

from command_support import Case, Emulator, absenc

STATES = ("not_sent", "confirmed", "refused", "unknown")


class States(Case):
    def both(self, *arguments):
        text, told = absenc(*arguments), absenc(*arguments, "--json")
        answer = json.loads(told.stdout)
        self.assertEqual(answer["ok"], told.returncode == 0, answer)
        return text, answer

    def test_good(self):
        for verb in (["zero", "sim:tformat"], ["config", "set", "sim:tformat", "overheat-threshold", "80"],
                     ["run", "sim:tformat", "memory-write", "5", "0x42"], ["memory", "write", "sim:tformat", "5", "0x42"]):
            with self.subTest(verb):
                text, answer = self.both(*verb)
                self.assert_good(text)
                self.assertEqual(answer["change"], "confirmed")

    def test_nothing_to_do(self):
        _, answer = self.both("memory", "write", "sim:tformat", "5", "0")
        self.assertEqual(answer["change"], "not_sent")
        _, answer = self.both("config", "set", "sim:raa38-modbus", "baud", "19200")
        self.assertEqual(answer["change"], "not_sent")

    def test_not_sent(self):
        for verb in (["zero", "sim:tformat?fault=silence=1"], ["zero", "sim:tformat?motion=rpm=60"],
                     ["config", "set", "sim:tformat?fault=silence=1", "overheat-threshold", "80"],
                     ["memory", "write", "sim:tformat?fault=silence=1", "5", "0x42"],
                     ["zero", f"tformat:{self.file('no-port')}", "--yes"]):
            with self.subTest(verb):
                text, answer = self.both(*verb)
                self.assertEqual(answer["change"], "not_sent")
                if verb[0] != "memory":
                    self.assert_failed(text, "Change: not sent")

    def test_a_reading_says_nothing_of_changes(self):
        self.assertNotIn("Change:", absenc("read", "sim:tformat?fault=silence=1").stderr)
        self.assertNotIn("change", json.loads(absenc("read", "sim:tformat?fault=silence=1", "--json").stdout))
        self.assertNotIn("change", json.loads(absenc("run", "sim:tformat", "temperature", "--json").stdout))

    def test_every_change_on_a_bad_line_is_named(self):
        """Also where only reading it again fails, after the encoder has moved to another baud rate."""
        seen = set()
        for seed in range(100, 124):
            with Emulator(self.directory, "--fault", "truncate=0.4", "--seed", str(seed), protocol="raa38-modbus",
                          name=f"line{seed}") as line:
                result = absenc("config", "set", f"raa38-modbus:{line.path}", "baud", "57600", "--yes", "--json")
                answer = json.loads(result.stdout)
                self.assertIn(answer["change"], STATES, answer)
                seen.add(answer["change"])
                if answer["change"] in ("confirmed", "unknown") and not answer["ok"]:
                    self.assertIn("57600", answer["change_advice"])
        self.assertTrue({"not_sent", "confirmed"} <= seen, seen)


if __name__ == "__main__":
    unittest.main()
