# SPDX-License-Identifier: Apache-2.0
"""Tests that outputs show the three states of an alarm: clear, raised, not reported."""
import csv
import io
import json
import unittest

from command_support import Case, absenc, json_lines

# Requests of T-format, each with its reply; the digit in the name is the data ID.
CLEAR_3 = "1A 1A 00 45 23 01 11 34 12 00 00 4A"
CLEAR_0 = "02 02 00 CD AB 01 65"
ALARM_0 = "02 02 20 CD AB 01 45"
COUNTING_0 = "02 02 10 CD AB 01 75"


class EveryUnit(Case):
    """Tests every unit in `absenc list`, without code for a particular unit."""

    def each(self):
        for about in json_lines(absenc("list", "--json").stdout):
            flags = {field["name"]: [flag["name"] for flag in field["flags"]]
                     for field in about["fields"] if field.get("flags")}
            alarms = next((names for name, names in flags.items() if name.endswith("alarms")), [])
            for alarm in filter(None, alarms):
                refused = absenc("read", f"sim:{about['protocol']}?alarm={alarm}")
                # An error with the words "nothing in what" means that the frame of this unit has no bit for the alarm.
                if "nothing in what" not in refused.stderr:
                    yield about, alarm

    def assert_raised_or_unknown(self, alarms, alarm):
        self.assertNotEqual(alarms, [], f"{alarm} is raised")
        if alarms is not None:
            self.assertIn(alarm, alarms)

    def test_read(self):
        for about, alarm in self.each():
            address = f"sim:{about['protocol']}?alarm={alarm}"
            with self.subTest(address):
                reading, = json_lines(absenc("read", address, "--json").stdout)
                self.assert_raised_or_unknown(reading["alarms"], alarm)
                text = absenc("read", address).stdout
                self.assertNotIn("no alarms", text)
                self.assertIn(alarm if reading["alarms"] else "alarms not reported", text)
                _, row = csv.reader(io.StringIO(absenc("read", address, "--csv").stdout))
                self.assertNotEqual(row[-2], "none")

    def test_decode(self):
        for about, alarm in self.each():
            for command in about["commands"]:
                if command["verb"] not in ("read", "read_part") or command["arguments"]:
                    continue
                with self.subTest(f"{about['protocol']} {command['name']} {alarm}"):
                    file = self.file("wave.vcd")
                    wave = absenc("wave", f"{about['protocol']}?alarm={alarm}", file, "--force", "--command", command["name"])
                    if wave.returncode == 2:
                        continue  # `wave` cannot write a waveform of this command
                    rows = json_lines(absenc("decode", about["protocol"], file, "--json").stdout)
                    for row in rows:
                        if "alarms" in row:
                            self.assert_raised_or_unknown(row["alarms"], alarm)
                    text = absenc("decode", about["protocol"], file).stdout
                    self.assertNotIn("no alarms", text)


class UnreportedAlarms(Case):
    def test_word_without_error_bit(self):
        self.assertIn("alarms not reported", absenc("read", "sim:ssi").stdout)
        reading, = json_lines(absenc("read", "sim:ssi", "--json").stdout)
        self.assertIsNone(reading["alarms"])
        self.assertTrue(reading["singleturn_valid"])
        names, row = csv.reader(io.StringIO(absenc("read", "sim:ssi", "--csv").stdout))
        self.assertEqual(dict(zip(names, row))["alarms"], "")
        self.assert_failed(absenc("alarms", "sim:ssi"), "the alarms are not known", "error, warning", "it reported only 0.00",
                           "Try: ", "absenc list ssi")
        result = absenc("alarms", "sim:ssi", "--json")
        self.assertEqual((result.returncode, json.loads(result.stdout)["ok"]), (1, False))

    def test_word_with_error_bit(self):
        address = "sim:ssi?error_bit=active_high"
        self.assertIn("no alarms", absenc("read", address).stdout)
        self.assertEqual(absenc("alarms", address).stdout, "no alarms\n")
        names, row = csv.reader(io.StringIO(absenc("read", address, "--csv").stdout))
        self.assertEqual(dict(zip(names, row))["alarms"], "none")
        self.assertIn("alarms not reported", absenc("read", "sim:ssi?word=position:12 warning:1").stdout)
        self.assertIn("alarms not reported: error", absenc("alarms", "sim:ssi?word=position:12 warning:1").stdout)

    def test_encolink(self):
        address = "sim:encolink?singleturn=77"
        reading, = json_lines(absenc("read", address, "--json").stdout)
        self.assertEqual((reading["status"], reading["alarms"]), ([], []))
        self.assertEqual(absenc("alarms", address).stdout, "no alarms\n")
        self.assert_failed(absenc("alarms", address + "&condition=channels_disagree=1"), "cross_check_failed")
        alone = address + "&has_ch2=false"
        reading, = json_lines(absenc("read", alone, "--json").stdout)
        self.assertEqual((reading["status"], reading["alarms"]), ([], None))
        self.assertIn("general_status clear   alarms not reported", absenc("read", alone).stdout)
        result = absenc("alarms", alone)
        self.assertEqual((result.returncode, result.stdout), (0, "alarms not reported\ngeneral_status clear\n"))
        self.assertIn("error: the position is not valid", absenc("alarms", alone + "&alarm=signal_lost").stdout)
        self.assertEqual(json.loads(absenc("alarms", alone, "--json").stdout),
                         {"ok": True, "protocol": "encolink", "alarms": None, "general_status": []})

    def test_esl_channel_without_alarms(self):
        file = self.file("short.vcd")
        for command in ("position-short", "singleturn-short", "calibration"):
            with self.subTest(command):
                self.assert_good(absenc("wave", "esl", file, "--force", "--command", command))
                text = absenc("decode", "esl", file).stdout
                self.assertIn("ch1_alarms not reported", text)
                self.assertNotIn("no ch", text)
                row, = json_lines(absenc("decode", "esl", file, "--json").stdout)
                self.assertIsNone(row["alarms"])


class Captures(Case):
    def decode(self, *lines):
        file = self.file("bytes.txt", "".join(line + "\n" for line in lines))
        result = absenc("decode", "tformat", file)
        self.assert_good(result)
        return result.stdout.splitlines(), json_lines(absenc("decode", "tformat", file, "--json").stdout)

    def test_single_reply(self):
        for line, status, valid, position in [(CLEAR_0, [], None, "unknown"), (ALARM_0, ["alarm"], None, "unknown"),
                                              (COUNTING_0, ["counting_error"], False, "INVALID")]:
            with self.subTest(line):
                [text], [row] = self.decode(line)
                self.assertNotIn("no alarms", text)
                self.assertIn(f"position {position} (109517)", text)
                self.assertEqual((row["singleturn_valid"], row["angle_deg"]), (valid, None))
                self.assertEqual(row["fields"]["status"], status)
                self.assertEqual(row["alarms"], status if status == ["counting_error"] else None)
                for name in status:
                    self.assertIn(f"status: {name}", text)

    def test_state_of_earlier_reply_is_kept(self):
        texts, rows = self.decode(CLEAR_3, CLEAR_0, COUNTING_0, ALARM_0, CLEAR_0)
        self.assertEqual([row["singleturn_valid"] for row in rows], [True, True, False, True, True])
        self.assertEqual([row["alarms"] for row in rows], [[], [], ["counting_error"], None, []])
        self.assertEqual(["no alarms" in text for text in texts], [True, True, False, False, True])
        self.assertIn("300.797 deg", texts[1])
        self.assertIn("status: alarm   alarms not reported: over_heat multiturn_error battery_error battery_alarm", texts[3])

    def test_csv(self):
        file = self.file("bytes.txt", f"{CLEAR_0}\n{CLEAR_3}\n{CLEAR_0}\n")
        rows = list(csv.DictReader(io.StringIO(absenc("decode", "tformat", file, "--csv").stdout)))
        self.assertEqual([(row["singleturn_valid"], row["status"], row["alarms"]) for row in rows],
                         [("", "none", ""), ("true", "none", "none"), ("true", "none", "none")])
        self.assertIn("singleturn=unknown(109517)", rows[0]["fields"])

    def test_one_frame(self):
        result = absenc("decode", "tformat", "--request", "02", "--hex", "02 20 CD AB 01 45")
        self.assertRegex(result.stdout, r"singleturn +unknown \(109517 counts\)")
        good = json.loads(absenc("decode", "tformat", "--request", "02", "--hex", "02 20 CD AB 01 45", "--json").stdout)
        self.assertEqual((good["singleturn_valid"], good["alarms"]), (None, None))


class Live(Case):
    def test_turns_are_invalid_only_with_alarms_of_turns(self):
        for alarm in ("battery_alarm", "over_heat"):
            answer = json.loads(absenc("run", f"sim:tformat?multiturn=12&alarm={alarm}", "multiturn", "--json").stdout)
            self.assertEqual(answer["fields"]["multiturn"], 12)
            self.assertNotIn("multiturn_valid", answer["fields"])
        answer = json.loads(absenc("run", "sim:tformat?alarm=multiturn_error", "multiturn", "--json").stdout)
        self.assertIs(answer["fields"]["multiturn_valid"], False)

    def test_recordings(self):
        for ending, value in [("csv", ""), ("jsonl", None)]:
            path = self.file(f"log.{ending}")
            self.assert_good(absenc("record", "sim:ssi", "--output", path, "--count", "3", "--rate", "50"))
            with open(path, encoding="utf-8") as file:
                lines = [line for line in file if not line.startswith("#")]
            rows = list(csv.DictReader(lines)) if ending == "csv" else json_lines("".join(lines[1:-1]))
            self.assertEqual({row["alarms"] for row in rows if row.get("event", "") == ""}, {value})

    def test_monitor(self):
        result = absenc("monitor", "sim:ssi", "--for", "1", "--interval", "0.5")
        self.assertIn("alarms not reported", result.stdout)
        result = absenc("monitor", "sim:ssi", "--for", "1", "--interval", "0.5", "--json")
        self.assertIsNone(json_lines(result.stdout)[-1]["reading"]["alarms"])


if __name__ == "__main__":
    unittest.main()
