# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc info` and `absenc alarms`, mostly over a pseudo-terminal."""
import json
import unittest

from command_support import Case, Emulator, absenc, json_lines


class EncoderCase(Case):
    def encoder(self, *arguments, latency=300, more=""):
        """Returns the address of a new emulator, with a latency that allows for a busy machine."""
        emulator = Emulator(self.directory, *arguments)
        self.addCleanup(emulator.end)
        return f"tformat:{emulator.path}?latency={latency}{more}"


def questions():
    """Returns the names of the commands that `info` runs with tformat, in its order."""
    commands = json_lines(absenc("list", "tformat", "--json").stdout)[0]["commands"]
    free = [command for command in commands if not any(one["required"] for one in command["arguments"])]
    return [command["name"] for verb in ("info", "temperature", "config_get", "read")
            for command in free if command["verb"] == verb]


class Info(EncoderCase):
    def test_all_fields_as_text(self):
        result = absenc("info", self.encoder("--singleturn", "74565", "--multiturn", "4660"), "--all")
        self.assert_good(result)
        self.assertEqual(result.stderr, "")
        self.assertNotIn("FAILED", result.stdout)
        for row in [rf"^encoder +tformat:{self.directory}/encoder$", r"^protocol +Tamagawa T-format",
                    r"^model +TS5700N8500: ", r"^line +RS-485 half duplex, 2\.5 Mbit/s$",
                    r"^resolution +17 bits in a turn, 16 bits of turns \(0 to 65535\)$",
                    r"^options +singleturn_bits=17$", r"^ +strict=true$", r"^  encoder_id +0x11 ",
                    r"^  temperature_c +35 degC ", r"^  overheat_threshold_c +90 degC ",
                    r"^ *204\.799 deg +74565 counts +4660 turns +no alarms$"]:
            self.assertRegex(result.stdout, "(?m)" + row)
        places = [result.stdout.index(f"\n{name} ") for name in questions()]
        self.assertEqual(places, sorted(places))

    def test_summary_as_text(self):
        """The summary omits raw fields."""
        result = absenc("info", self.encoder("--singleturn", "74565", "--multiturn", "4660"))
        self.assert_good(result)
        for row in [r"^model +TS5700N8500: ", r"^options +all at their defaults$", r"^encoder id +0x11$",
                    r"^temperature +35 degC$", r"^position +204\.799 deg +74565 counts +4660 turns +no alarms$"]:
            self.assertRegex(result.stdout, "(?m)" + row)
        for word in ["data_id", "strict", "overheat", "_c "]:
            self.assertNotIn(word, result.stdout)
        for unit in ["tformat", "esl", "encolink", "biss", "e201", "raa38-modbus", "raa38-can", "amt21"]:
            with self.subTest(unit):
                card = absenc("info", f"sim:{unit}")
                self.assert_good(card)
                self.assertLess(len(card.stdout.splitlines()), 15)
                self.assertRegex(card.stdout, r"(?m)^position +\d")
        self.assertRegex(absenc("info", "sim:tformat?singleturn_bits=20").stdout, r"(?m)^options +singleturn_bits=20 ")

    def test_names_channels_only_if_they_differ(self):
        for verb in ("read", "info"):
            well = absenc(verb, "sim:esl")
            self.assertIn("0 turns   both channels ready   no alarms", well.stdout)
            for setting in ("alarm=overspeed", "alarm=led_error", "condition=ch2_status_set=4"):
                with self.subTest((verb, setting)):
                    ill = absenc(verb, f"sim:esl?{setting}")
                    self.assertNotIn("both channels ready", ill.stdout)

    def test_json(self):
        address = self.encoder("--model", "23-bit", "--singleturn", "5", "--alarm", "over_heat",
                               more="&model=23-bit&baud=1000000")
        result = absenc("info", address, "--json")
        self.assert_good(result)
        info = json.loads(result.stdout)
        answers = info.pop("answers")
        self.assertEqual(info, {
            "encoder": address.split("?")[0], "protocol": "tformat", "model": "23-bit", "link": "half_duplex",
            "rate": 1000000, "resolution": {"singleturn_bits": 23, "multiturn_bits": 16, "multiturn_signed": False},
            "options": {"singleturn_bits": 23, "multiturn_bits": 16, "encoder_id": 23, "strict": True,
                        "battery": True}, "ok": True})
        self.assertEqual(list(answers), questions())
        self.assertEqual(answers["temperature"], {"ok": True, "fields": {"temperature_c": 35}})
        self.assertEqual(answers["encoder-id"]["fields"]["encoder_id"], 23)
        self.assertEqual((answers["position"]["singleturn"], answers["position"]["alarms"]), (5, ["over_heat"]))

    def test_alarms_are_explained(self):
        result = absenc("info", self.encoder("--alarm", "battery_error"))
        self.assert_good(result)
        self.assertIn("turns INVALID (0)   alarms: battery_error\n  battery_error: the battery was below",
                      result.stdout)

    def test_options_without_model(self):
        result = absenc("info", "sim:tformat?singleturn_bits=20", "--json")
        info = json.loads(result.stdout)
        self.assertEqual((info["model"], info["resolution"]["singleturn_bits"]), (None, 20))
        self.assertIn("none with these options", absenc("info", "sim:tformat?singleturn_bits=20").stdout)

    def test_timeout_is_reported_once(self):
        address = self.encoder("--fault", "silence=1", latency=1)
        result = absenc("info", address, "--all")
        self.assert_failed(result, "timeout: the encoder did not answer", "Try: ")
        self.assertEqual(result.stderr.count("timeout"), 1)
        self.assertEqual(result.stdout.count("FAILED  timeout: "), len(questions()))
        self.assertRegex(result.stdout, r"(?m)^model +TS5700N8500")
        info = absenc("info", address, "--json")
        self.assertEqual((info.returncode, info.stderr), (1, ""))
        answers = json.loads(info.stdout)["answers"]
        self.assertEqual(list(answers), questions())
        self.assertEqual({answer["error"] for answer in answers.values()}, {"timeout"})

    def test_one_failure_does_not_stop_the_rest(self):
        # Replies to memory requests are accepted although the encoder ID is wrong, because they contain no encoder
        # ID.
        result = absenc("info", self.encoder(more="&encoder_id=23"), "--all")
        self.assert_failed(result, "unexpected_reply", "set model=TS5700N8500")
        self.assertRegex(result.stdout, r"(?m)^encoder-id +FAILED +unexpected_reply: ")
        self.assertRegex(result.stdout, r"(?m)^  temperature_c +35 degC ")
        self.assertRegex(result.stdout, r"(?m)^position +FAILED +unexpected_reply: ")

    def test_reports_readings_that_disagree(self):
        address = "sim:tformat?motion=file=" + self.file("motion.csv", "0,0\n0.0001,0\n100,600000000\n")
        result = absenc("info", address)
        self.assertRegex(result.stdout, r"position unconfirmed \(\d+\) .*\n  no two readings in a row agree")
        answer = json.loads(absenc("info", address, "--json").stdout)["answers"]["position"]
        self.assertEqual((answer["singleturn_valid"], answer["angle_deg"], answer["confirmed"]), (None, None, False))


class Alarms(EncoderCase):
    def test_no_alarms(self):
        address = self.encoder()
        result = absenc("alarms", address)
        self.assert_good(result)
        self.assertEqual((result.stdout, result.stderr), ("no alarms\n", ""))
        self.assertEqual(json.loads(absenc("alarms", address, "--json").stdout),
                         {"ok": True, "protocol": "tformat", "alarms": [], "status": []})

    def test_alarms_as_text(self):
        result = absenc("alarms", self.encoder("--alarm", "over_heat", "--alarm", "battery_alarm"))
        self.assert_good(result)
        self.assertEqual(
            result.stdout,
            "alarms:\n"
            "  over_heat: the encoder is or was hotter than its threshold. "
            "What to do: let it cool, then `absenc clear-alarms`\n"
            "  battery_alarm: the battery is below 3.1 V. What to do: replace the battery with the encoder switched on; "
            "without a battery set battery=false\n"
            "status:\n"
            # `alarms` does not print the advice of the status flag, which is to read the alarms.
            "  alarm: over-heat, multi-turn error, battery error or battery alarm\n")

    def test_status_refers_to_alarms_only_if_not_shown(self):
        address = self.encoder("--alarm", "over_heat")
        status = json.loads(absenc("alarms", address, "--json").stdout)["status"]
        self.assertEqual([(flag["name"], flag["action"]) for flag in status], [("alarm", "")])
        alone = absenc("run", address, "encoder-id")  # the reply to the request `encoder-id` contains no alarms
        self.assertIn("battery error or battery alarm: `absenc alarms` names the cause", alone.stdout)
        both = absenc("decode", "tformat", "--request", "1a", "--hex", "1a2000000011000000103b")
        self.assertIn("let it cool, then `absenc clear-alarms`", both.stdout)
        self.assertNotIn("`absenc alarms`", both.stdout)

    def test_encoder_id_is_hexadecimal(self):
        address = self.encoder()
        for shown in (absenc("run", address, "encoder-id"), absenc("info", address, "--all")):
            self.assertRegex(shown.stdout, r"encoder_id +0x11 ")
        self.assertIn("encoder_id=0x11\n", absenc("info", address, "--all").stdout)
        fields = json.loads(absenc("run", address, "encoder-id", "--json").stdout)["fields"]
        self.assertEqual(fields["encoder_id"], 0x11)
        self.assertRegex(absenc("list", "tformat").stdout, r"encoder_id +-1 to 0xFF +default -1 ")
        self.assertRegex(absenc("run", "sim:esl", "encoder-id").stdout, r"encoder_id +0xD8 ")

    def test_every_alarm(self):
        unit = json_lines(absenc("list", "tformat", "--json").stdout)[0]
        known = next(field["flags"] for field in unit["fields"] if field["name"] == "alarms")
        self.assertGreater(len(known), 7)
        for flag in known:
            with self.subTest(flag["name"]):
                result = absenc("alarms", f"sim:tformat?alarm={flag['name']}", "--json")
                self.assert_good(result)
                self.assertEqual(json.loads(result.stdout)["alarms"], [flag])

    def test_timeout(self):
        address = self.encoder("--fault", "silence=1", latency=1)
        result = absenc("alarms", address)
        self.assert_failed(result, "timeout: the encoder did not answer", "sent 1A to ", "Try: ")
        self.assertEqual(result.stdout, "")
        result = absenc("alarms", address, "--json")
        self.assertEqual((result.returncode, json.loads(result.stdout)["error"]), (1, "timeout"))


if __name__ == "__main__":
    unittest.main()
