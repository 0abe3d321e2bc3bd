#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests the output of `absenc campaign`. Its numbers are tested in client/campaign."""
import json
import unittest

from command_support import Case, absenc


class Campaign(Case):
    def result(self, *arguments):
        result = absenc("campaign", *arguments, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def test_counts_have_confidence_intervals(self):
        result = self.result("tformat", "--fault", "bit=0.01", "--exchanges", "20000")
        self.assertGreaterEqual(result["exchanges"], 20000)
        for name in ("failed", "given_up", "recovered", "wrong", "older", "changed"):
            share = result[name]
            self.assertLessEqual(share["low"], share["count"] / share["of"], name)
            self.assertGreaterEqual(share["high"], share["count"] / share["of"], name)
        self.assertGreater(result["failed"]["count"], 5000)
        self.assertGreater(result["wrong"]["count"], 20)
        self.assertEqual((result["check"]["bits"], result["check"]["distance"]), (8, 2))
        self.assertEqual(result["check"]["words"], 440)

    def test_same_seed_gives_same_result(self):
        arguments = ("biss", "--exchanges", "3000", "--seed")
        self.assertEqual(self.result(*arguments, "5"), self.result(*arguments, "5"))
        self.assertNotEqual(self.result(*arguments, "5"), self.result(*arguments, "6"))

    def test_has_line_for_every_protocol(self):
        result = absenc("campaign", "--exchanges", "200", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        names = [json.loads(line)["protocol"] for line in result.stdout.splitlines()]
        listed = {line.split()[0] for line in absenc("list").stdout.splitlines()[1:] if line and "`" not in line}
        self.assertEqual(set(names), listed)
        table = absenc("campaign", "--exchanges", "200").stdout.splitlines()
        self.assertEqual([line.split()[0] for line in table[1:] if line], names)

    def test_text_states_computed_check(self):
        text = absenc("campaign", "tformat", "--exchanges", "2000", "--fault", "bit=0.01")
        self.assertIn("88 bits with a checksum of 8: of the errors of 2 bits 440 pass", text.stdout)
        self.assertIn("exchanges a second", text.stderr)
        self.assertIn("nothing is computed", absenc("campaign", "esl", "--exchanges", "2000").stdout)

    def test_guards_positions_of_turning_shaft(self):
        arguments = ("ssi", "--fault", "corrupt=0.1", "--exchanges", "10000", "--rpm", "60", "--max-rpm")
        for limit, most in (("10000", 0.1), ("100", 0.03)):
            guarded = self.result(*arguments, limit)["guarded"]
            self.assertGreater(guarded["alone"]["count"] / guarded["alone"]["of"], 0.05)
            wrong, confirmed = guarded["wrong"]["count"], guarded["confirmed"]["count"]
            self.assertLess(wrong / confirmed, most, limit)
            self.assertAlmostEqual(wrong, guarded["let_through"], delta=5 * guarded["let_through"] ** 0.5)
        text = absenc("campaign", *arguments, "100").stdout
        self.assertRegex(text, r"wrong and confirmed +\d+ +of \d+ confirmed")
        self.assertIn("agree by chance with the position before", text)
        table = absenc("campaign", "--exchanges", "200", "--rpm", "-60", "--fault", "bit=0").stdout.splitlines()
        self.assertIn("LET THROUGH", table[0])
        for line in table[1:]:
            self.assertEqual(line.split()[3:7], ["100", "%", "0", "0"], line)

    def test_refuses_wrong_usage(self):
        for arguments, word in ((("tformat", "--fault", "bits=0.1"), "did you mean bit?"), (("tformat", "--fault", "bit=2"), "0 to 1"),
                                (("tformatt",), "tformat"), (("--model", "23-bit"), "one protocol"),
                                (("ssi", "--max-rpm", "100"), "set --rpm as well")):
            result = absenc("campaign", *arguments)
            self.assertEqual(result.returncode, 2, arguments)
            self.assertIn(word, result.stderr)


if __name__ == "__main__":
    unittest.main()
