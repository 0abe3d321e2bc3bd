# SPDX-License-Identifier: Apache-2.0
"""Tests encoders that no unit supports: the user describes the encoder's word."""
import csv
import json
import os
import unittest

from command_support import Case, Emulator, absenc, json_lines

WORD = "multiturn:12 position:24 temperature=value:8 error:1! warning:1!"
OPTION = ["--option", f"word={WORD}"]
PLAIN = "position:12 battery=value:4"


def bits(**values):
    """Returns the bits of a word as transmitted, built independently of the library."""
    fields = [("multiturn", 12), ("position", 24), ("temperature", 8), ("error", 1), ("warning", 1)]
    return "".join(f"{values[name]:0{width}b}" for name, width in fields)


class Verbs(Case):
    def json_of(self, *arguments):
        result = absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)

    def test_read(self):
        for protocol in ("biss", "ssi", "e201"):
            with self.subTest(protocol):
                address = f"sim:{protocol}?word={WORD}&singleturn=11184810&multiturn=5"
                reading = self.json_of("read", address)
                self.assertEqual((reading["singleturn"], reading["singleturn_bits"]), (11184810, 24))
                self.assertEqual((reading["multiturn"], reading["multiturn_bits"]), (5, 12))
                self.assertAlmostEqual(reading["angle_deg"], 360 * 11184810 / 2**24)
                self.assertEqual(self.json_of("read", f"sim:{protocol}?singleturn=11184810&multiturn=5", *OPTION)
                                 ["singleturn"], 11184810)

    def test_alarms(self):
        for alarm in ("error", "warning"):
            alarms = self.json_of("alarms", f"sim:ssi?alarm={alarm}", *OPTION)["alarms"]
            self.assertEqual([one["name"] for one in alarms], [alarm])
        reading = self.json_of("read", "sim:biss?alarm=error", *OPTION)
        self.assertFalse(reading["singleturn_valid"])
        self.assertIsNone(reading["angle_deg"])

    def test_info(self):
        info = self.json_of("info", "sim:ssi", *OPTION)
        self.assertEqual(info["options"]["word"], WORD)
        self.assertNotIn("bits", info["options"])
        self.assertEqual(info["model"], None)
        self.assertEqual(info["resolution"], {"singleturn_bits": 24, "multiturn_bits": 12, "multiturn_signed": False})
        self.assertRegex(absenc("info", "sim:ssi", *OPTION, "--all").stdout, f"options +word={WORD}\n +after_word")

    def test_run_decode_and_encode(self):
        self.assertEqual(self.json_of("run", "sim:ssi?singleturn=9", "position", *OPTION)["fields"],
                         {"multiturn": 0, "singleturn": 9, "angle_deg": 360 * 9 / 2**24, "temperature": 0,
                          "error": False, "warning": False})
        wire = bits(multiturn=7, position=0x123456, temperature=85, error=1, warning=0)
        fields = self.json_of("decode", "ssi", "--hex", wire, *OPTION)["fields"]
        self.assertEqual((fields["multiturn"], fields["singleturn"], fields["temperature"]), (7, 0x123456, 85))
        self.assertEqual((fields["error"], fields["warning"]), (False, True))
        self.assertRegex(absenc("decode", "ssi", "--hex", wire, *OPTION).stdout, r"temperature +85")
        self.assert_good(absenc("encode", "ssi", "position", *OPTION))

    def test_record_and_monitor(self):
        path = self.file("log.csv")
        self.assert_good(absenc("record", "sim:biss?singleturn=77", "--output", path, "--count", "3", *OPTION))
        with open(path, encoding="utf-8") as file:
            lines = file.read().splitlines()
        self.assertTrue(any(line.startswith(f"# options: word={WORD} unit_um=") for line in lines), lines)
        rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
        self.assertEqual([row["singleturn"] for row in rows if row["event"] != "gap"], ["77"] * 3)
        shown = json_lines(absenc("monitor", f"sim:biss?singleturn=77&word={WORD}", "--for", "2", "--json").stdout)
        self.assertEqual(shown[-1]["reading"]["singleturn"], 77)

    def test_emulate(self):
        with Emulator(self.directory, *OPTION, "--singleturn", "11184810", "--multiturn", "4095", protocol="e201") as one:
            reading = self.json_of("read", f"e201:{one.path}", *OPTION)
            self.assertEqual((reading["singleturn"], reading["multiturn"]), (11184810, 4095))

    def test_gray_and_parity(self):
        options = ["--option", "word=multiturn:4 position:13 parity:1! gray"]
        self.assertEqual(self.json_of("read", "sim:ssi?singleturn=4660&multiturn=5", *options)["singleturn"], 4660)
        gray = (5 << 13 | 4660) ^ (5 << 13 | 4660) >> 1
        parity = 1 - bin(gray).count("1") % 2
        fields = self.json_of("decode", "ssi", "--hex", f"{gray:017b}{parity}", *options)["fields"]
        self.assertEqual((fields["multiturn"], fields["singleturn"]), (5, 4660))
        self.assert_failed(absenc("decode", "ssi", "--hex", f"{gray:017b}{1 - parity}", *options), "bad_checksum")

    def test_list(self):
        for protocol in ("biss", "ssi", "e201"):
            text = absenc("list", protocol).stdout
            self.assertRegex(text, r"\n  word +a word format")
            self.assertIn("position, multiturn, error, warning, parity, value, skip", text)
            self.assertTrue(self.json_of("list", protocol)["takes_word"])
        self.assertNotIn("word format", absenc("list", "tformat").stdout)
        self.assertFalse(self.json_of("list", "tformat")["takes_word"])


class WrongWord(Case):
    def decode(self, protocol, *options):
        return absenc("decode", protocol, "--hex", "0101", *(f"--option={option}" for option in options))

    def test_error_states_position_in_word(self):
        for word, *words in [("position:12 eror:1", "character 13", '"eror:1"', "none of position"),
                             ("position", "character 9", "its end", "bits is missing"),
                             ("", "character 1", "needs a position"),
                             ("position:12 b!=value:3", "character 14", "letters, digits"),
                             ("position:12 crc=value:3", "character 13", "another"),
                             ("position:33 multiturn:32", "64 bits together")]:
            with self.subTest(word):
                self.assert_wrong_usage(self.decode("biss", f"word={word}"), f'word is "{word}"', *words)

    def test_refuses_options_that_word_replaces(self):
        self.assert_wrong_usage(self.decode("biss", f"word={WORD}", "singleturn_bits=3"), "singleturn_bits", "word")
        self.assert_wrong_usage(self.decode("ssi", "gray=true", f"word={WORD}"), "gray", "word")
        self.assert_wrong_usage(self.decode("biss", "model=rotary-19", f"word={WORD}"), "model", "word")
        self.assert_wrong_usage(absenc("decode", "biss", "--model", "rotary-19", "--hex", "01", *OPTION), "model", "word")

    def test_refuses_word_for_other_protocols(self):
        self.assert_wrong_usage(self.decode("tformat", f"word={WORD}"), 'tformat has no option "word"')
        self.assert_wrong_usage(self.decode("ssi", "wrod=position:12"), "did you mean word?")


class ConfigurationFile(Case):
    def absenc(self, text, *arguments):
        path = self.file("absenc.toml", text)
        return absenc(*arguments, env={**os.environ, "ABSENC_CONFIG": path})

    def test_named_encoder(self):
        text = f'[encoder.drum]\nprotocol = "ssi"\nport = "sim"\nword = "{WORD}"\nsingleturn = 77\n'
        self.assertEqual(json.loads(self.absenc(text, "read", "drum", "--json").stdout)["singleturn"], 77)
        self.assertEqual(json_lines(self.absenc(text, "list", "--names", "--json").stdout)[0]["options"]["word"], WORD)
        other = self.absenc(text, "read", f"drum?word={PLAIN}", "--json")
        self.assertEqual(json.loads(other.stdout)["singleturn_bits"], 12)

    def test_error_has_line_and_position(self):
        head = '[encoder.drum]\nprotocol = "ssi"\nport = "sim"\n'
        for line, *words in [('word = "position:12 eror:1"', ":4:1:", "character 13", "none of position"),
                             ("word = 12", ":4:1:", "none of position"),
                             ('word = ["position:12"]', ":4:1:", "must be one value"),
                             (f'word = "{PLAIN}"\nbits = 3', ":5:1:", "bits cannot be given together with word"),
                             (f'bits = 3\nword = "{PLAIN}"', ":5:1:", "bits cannot be given together with word"),
                             (f'word = "{PLAIN}"\nsingleturn = 4096', ":5:1:", "0 to 4095")]:
            with self.subTest(line):
                self.assert_wrong_usage(self.absenc(head + line + "\n", "read", "drum"), "absenc.toml" + words[0],
                                        *words[1:])
        self.assert_wrong_usage(self.absenc(head.replace("ssi", "tformat") + f'word = "{PLAIN}"\n', "read", "drum"),
                                ":4:1:", 'no setting "word"')


if __name__ == "__main__":
    unittest.main()
