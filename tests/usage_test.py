# SPDX-License-Identifier: Apache-2.0
"""Tests that arguments which absenc does not understand have no effect but status 2."""
import json
import unittest

from command_support import EncoderCase, absenc

WRITE = ["memory", "write", "{encoder}", "0x10", "0x55", "--yes"]
ZERO = ["zero", "{encoder}", "--yes"]


class WrongArguments(EncoderCase):
    """Tests wrong arguments of verbs that would change the encoder if the argument were ignored."""

    def setUp(self):
        super().setUp()
        self.address = self.encoder("--singleturn", "1000")

    def state(self):
        position = json.loads(absenc("read", self.address, "--json").stdout)["singleturn"]
        return position, absenc("memory", "read", self.address, "0x10", "--json").stdout

    def test_misplaced_words_and_options_have_no_effect(self):
        before = self.state()
        for line, words in [(["--dry-run", *WRITE], ["--dry-run stands before the verb"]),
                            (["memory", "--dry-run", *WRITE[1:]], ["--dry-run stands before the verb", "memory"]),
                            (["--force=1", *WRITE], ["--force stands before the verb"]),
                            (["nonsense", "--foo=3", *ZERO], ['no verb "nonsense"']),
                            (["--foo=3", *ZERO], ["no option --foo"]),
                            (["", *ZERO], ['no verb ""']),
                            (["--", *ZERO], ["no option --"]),
                            (["-x", *ZERO], ["no option -x"]),
                            (["--version", *ZERO], ["too much behind --version"]),
                            (["--help", *ZERO], ["too much behind --help"]),
                            (["--zero.yes", "{encoder}"], ["no option --zero.yes"]),
                            (["memroy", *WRITE[1:]], ["did you mean memory?"]),
                            (["memory", "wirte", *WRITE[2:]], ["did you mean write?"]),
                            (["memory", "{encoder}", "write", *WRITE[3:]], ["no verb", "of memory"]),
                            (["memory", *ZERO], ['no verb "zero" of memory']),
                            (["write", *WRITE[2:]], ['no verb "write"']),
                            ([*ZERO, "--dryrun"], ["zero has no option --dryrun"]),
                            ([*ZERO, "-n"], ["zero has no option -n"]),
                            ([*ZERO, "more"], ['"more" is too much']),
                            ([*ZERO, "--", "--json"], ['"--json" is too much']),
                            ([*ZERO, "--", "--", "--json"], ['"--" is too much']),
                            ([*ZERO, "--yes"], ["--yes is given 2 times"]),
                            (["zero", "{encoder}", "--yes=no"], ["--yes takes no value"]),
                            ([*WRITE, "--page", "1", "--page", "2"], ["--page is given 2 times"]),
                            ([*WRITE, "--dry-run", "--dry-run=false"], ["--dry-run is given 2 times"]),
                            ([*WRITE, "--", "--dry-run"], ['"--dry-run"'])]:
            with self.subTest(line):
                self.assert_wrong_usage(absenc(*(word.format(encoder=self.address) for word in line)), *words)
        self.assertEqual(self.state(), before)

    def test_correct_arguments_have_effect(self):
        self.assert_good(absenc("zero", "--yes", "--", self.address))
        self.assertEqual(self.state()[0], 0)


class Help(EncoderCase):
    def test_help_of_unknown_verb_is_wrong_usage(self):
        for line in (["nonsense", "--help"], ["memory", "nonsense", "--help"], ["--version", "nonsense"],
                     ["-hjunk"], ["--helpp"]):
            with self.subTest(line):
                self.assert_wrong_usage(absenc(*line))

    def test_help_at_every_position(self):
        for line, words in [(["-h"], "Usage: absenc <verb>"), (["memory", "-h"], "Usage: absenc memory <verb>"),
                            (["zero", "--yes", "-h"], "Usage: absenc zero <encoder>"),
                            (["memory", "read", "sim:tformat", "--help"], "Usage: absenc memory read")]:
            with self.subTest(line):
                result = absenc(*line)
                self.assert_good(result)
                self.assertIn(words, result.stdout)


if __name__ == "__main__":
    unittest.main()
