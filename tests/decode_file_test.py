# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc decode` with captures."""
import csv
import io
import json
import os
import shutil
import subprocess
import unittest

from capture_support import BIT, Wave, conversation, exchange
from command_support import ABSENC, PATIENCE, Case, absenc, json_lines


def hex_text(data):
    return " ".join(f"{byte:02X}" for byte in data)


class OwnWaveforms(Case):
    def decode(self, encoder, *arguments, count=50):
        path = self.file("own.vcd")
        self.assert_good(absenc("wave", encoder, path, "--count", str(count), "--force"))
        result = absenc("decode", encoder.partition("?")[0], path, "--json", *arguments)
        return result, json_lines(result.stdout)

    def test_identity_gives_frame_length(self):
        result, lines = self.decode("encolink-spi?motion=rpm=600&resolution=20", count=1000)
        self.assert_good(result)
        positions = [line["fields"] for line in lines if "singleturn" in line["fields"]]
        self.assertGreater(len(positions), 999)
        for before, after in zip(positions, positions[1:]):
            moved = (after["singleturn"] - before["singleturn"]) % 2**20
            self.assertLess(moved, 2**20 // 50, f"{before} {after}")
            self.assertIn("multiturn", after)

    def test_detects_parity(self):
        for parity in ("odd", "even"):
            with self.subTest(parity):
                result, lines = self.decode(f"raa38?parity={parity}&motion=rpm=60")
                self.assert_good(result)
                self.assertIn(f"parity {parity}", result.stderr)
                self.assertGreater(sum("singleturn" in line.get("fields", {}) for line in lines), 45)

    def test_parity_option(self):
        result, _ = self.decode("raa38?parity=odd&motion=rpm=60", "--parity", "odd")
        self.assert_good(result)
        self.assertEqual(result.stderr, "")
        result, _ = self.decode("raa38?parity=odd&motion=rpm=60", "--parity", "none")
        self.assertEqual(result.returncode, 1)
        self.assert_wrong_usage(absenc("decode", "raa38", self.file("own.vcd"), "--parity", "mark"), "--parity")


class Invalid(Case):
    def alarm(self, alarm, *arguments):
        path = self.file("alarm.vcd")
        self.assert_good(absenc("wave", f"tformat?alarm={alarm}", path, "--count", "5", "--force"))
        return absenc("decode", "tformat", path, *arguments)

    def test_reports_swapped_arguments(self):
        result = absenc("decode", "drive.sr", "tformat")
        self.assertEqual(result.returncode, 2)
        self.assertIn("the protocol comes first, then the capture: absenc decode tformat drive.sr", result.stderr)

    def test_shows_invalid_fields_of_one_frame(self):
        [line] = json_lines(self.alarm("full_absolute_status", "--json").stdout)[:1]
        frames = ["--request", line["request"], "--hex", line["reply"]]
        shown = absenc("decode", "tformat", *frames)
        self.assert_good(shown)
        self.assertRegex(shown.stdout, r"singleturn +INVALID \(only the top 5 of 17 bits hold: 0 counts\)")
        [one] = json_lines(absenc("decode", "tformat", *frames, "--json").stdout)
        self.assertFalse(one["singleturn_valid"])
        self.assertEqual(one["fields"]["singleturn"], 0)

    def test_shows_invalid_fields_of_capture(self):
        for alarm, fields in (("full_absolute_status", {"singleturn"}), ("over_speed", {"multiturn"})):
            with self.subTest(alarm):
                line = json_lines(self.alarm(alarm, "--json").stdout)[0]
                for field in fields:
                    self.assertFalse(line[f"{field}_valid"])
                [row, *_] = csv.DictReader(io.StringIO(self.alarm(alarm, "--csv").stdout))
                for field in fields:
                    self.assertIn(f"{field}=INVALID(", row["fields"])


class Text(Case):
    def capture(self, *exchanges):
        return self.file("capture.txt", "".join(f"{hex_text(a)}\n{hex_text(b)}\n" for a, b in exchanges))

    def test_prints_each_exchange(self):
        result = absenc("decode", "tformat", self.capture(exchange(74565, 4660), exchange(1, 2, 0x80)))
        self.assert_good(result)
        first, second = result.stdout.splitlines()
        self.assertIn("1A > 1A 00 45 23 01 11 34 12 00 00 4A   204.799 deg    74565 counts    4660 turns", first)
        self.assertIn("alarms: battery_alarm", second)

    def test_json(self):
        result = absenc("decode", "tformat", self.capture(exchange(74565, 4660)), "--json")
        self.assert_good(result)
        [line] = json_lines(result.stdout)
        self.assertEqual((line["kind"], line["request"], line["ok"]), ("exchange", "1a", True))
        self.assertEqual(line["fields"]["singleturn"], 74565)
        self.assertAlmostEqual(line["angle_deg"], 74565 * 360 / 2**17)
        self.assertEqual(line["turns"], 4660)

    def test_csv(self):
        request, reply = exchange(5)
        result = absenc("decode", "tformat", self.capture(exchange(74565), (request, reply[:-1] + [0])), "--csv")
        self.assertEqual(result.returncode, 1)
        good, bad = csv.DictReader(io.StringIO(result.stdout))
        self.assertEqual((good["singleturn"], good["singleturn_valid"], good["error"]), ("74565", "true", ""))
        self.assertIn("encoder_id=0x11", good["fields"])
        self.assertEqual((bad["angle_deg"], bad["fields"], bad["error"]), ("", "", "bad_checksum"))
        self.assertIn("checksum", bad["message"])

    def test_bit_positions_of_capture(self):
        capture = self.capture(exchange(74565, 4660))
        result = absenc("decode", "tformat", capture, "--bits")
        self.assert_good(result)
        self.assertIn("singleturn 16-32, encoder_id 40-47, multiturn 48-63, alarms 72-79]", result.stdout)
        [line] = json_lines(absenc("decode", "tformat", capture, "--bits", "--json").stdout)
        self.assertEqual(line["bits"]["singleturn"], [{"first": 16, "count": 17}])
        self.assertNotIn("bits", json_lines(absenc("decode", "tformat", capture, "--json").stdout)[0])
        self.assert_wrong_usage(absenc("decode", "tformat", capture, "--bits", "--csv"), "--bits")
        self.assert_wrong_usage(absenc("decode", "tformat", capture, "--bits", "--stats"), "--bits")
        self.assert_wrong_usage(absenc("decode", "e201", capture, "--bits"), "does not say where")

    def test_bit_positions_of_one_frame(self):
        # The high bits of this big-endian field are in the earlier byte; their positions are printed first.
        result = absenc("decode", "raa38", "--hex", "ff81017f00", "--bits", "--option", "bits=14")
        self.assert_good(result)
        self.assertRegex(result.stdout, r"singleturn +383 counts +bits 16-21 24-31")
        result = absenc("decode", "ssi", "--hex", "0000000000101", "--option", "bits=13", "--option", "gray=false",
                        "--bits", "--json")
        self.assert_good(result)
        self.assertEqual(json.loads(result.stdout)["bits"]["singleturn"], [{"first": 0, "count": 13}])
        # Bit positions count from the lowest bit of each byte, except on clocked lines.
        for arguments, field, places in (
            (["encolink", "--hex", "003e825200"], "warning", [{"first": 16, "count": 1, "inverted": True}]),
            (["raa38-modbus", "--hex", "0103021234B533"], "singleturn",
             [{"first": 32, "count": 8}, {"first": 24, "count": 6}]),
            (["raa38-can", "--hex", "120:4726000000000000"], "singleturn", [{"first": 0, "count": 14}]),
        ):
            result = absenc("decode", *arguments, "--bits", "--json")
            self.assert_good(result)
            self.assertEqual(json.loads(result.stdout)["bits"][field], places)

    def test_log_with_times_and_directions(self):
        request, reply = exchange(7)
        text = f"12.000100 tx {hex_text(request)}\n12.000250 rx {hex_text(reply)}\n12.5 tx {hex_text(request)}\n"
        text += f"12.500300 rx {hex_text(request + reply)}\n"
        result = absenc("decode", "tformat", self.file("log.txt", text), "--json")
        self.assert_good(result)
        plain, echoed = json_lines(result.stdout)
        self.assertAlmostEqual(plain["turnaround_us"], 150)
        self.assertIn("the request was received again", echoed["message"])
        self.assertEqual(echoed["reply"], bytes(reply).hex())

    def test_slow_log_is_no_timeout(self):
        request, reply = exchange(7)
        text = f"1.0 tx {hex_text(request)}\n1.5 rx {hex_text(reply)}\n"
        self.assert_good(absenc("decode", "tformat", self.file("log.txt", text)))

    def test_standard_input(self):
        request, reply = exchange(9)
        text = f"{hex_text(request)}\n{hex_text(reply)}\n"
        result = absenc("decode", "tformat", "-", "--json", stdin=None, input=text)
        self.assert_good(result)
        self.assertEqual(json_lines(result.stdout)[0]["fields"]["singleturn"], 9)

    def test_reports_damaged_text(self):
        path = self.capture(exchange(1), exchange(2))
        with open(path, "a", encoding="utf-8") as file:
            file.write("what is this?\n1A\n")
        result = absenc("decode", "tformat", path, "--json")
        self.assert_failed(result, "damaged at byte 72")
        self.assertEqual(len(json_lines(result.stdout)), 2)

    def test_reports_capture_without_frames(self):
        result = absenc("decode", "tformat", self.file("noise.txt", "55 AA 55 AA 77 77 77\n"))
        self.assert_failed(result, "no good frame of tformat", "check the channel")

    def test_decodes_stream(self):
        frames = [bytes.fromhex("003e83c500")] * 20
        path = self.file("stream.txt", "".join(f"{hex_text(frame)}\n" for frame in frames))
        options = ["--option", "resolution=20", "--option", "multiturn_bits=0"]
        result = absenc("decode", "encolink", path, *options, "--json")
        self.assert_good(result)
        lines = json_lines(result.stdout)
        self.assertEqual([line["kind"] for line in lines], ["reply"] * 20)
        self.assertEqual({line["fields"]["singleturn"] for line in lines}, {1000})


class Levels(Case):
    def vcd(self, wave):
        return self.file("capture.vcd", wave.vcd())

    def test_rs485_line(self):
        result = absenc("decode", "tformat", self.vcd(conversation()), "--json")
        self.assert_good(result)
        lines = json_lines(result.stdout)
        self.assertEqual([line["fields"]["singleturn"] for line in lines], [100 * i for i in range(50)])
        self.assertEqual([line["turns"] for line in lines], list(range(50)))
        for i, line in enumerate(lines):
            self.assertAlmostEqual(line["turnaround_us"], 3, delta=0.05)
            self.assertAlmostEqual(line["time_s"], (20_000 + i * (12 * 10 * BIT + 23_000)) * 1e-9, delta=1e-7)

    def test_detects_other_baud_rate(self):
        wave = Wave(D0=1)
        for i in range(20):
            request, reply = exchange(i)
            wave.send("D0", request, 1000)
            wave.wait(10_000)
            wave.send("D0", reply, 1000)
            wave.wait(100_000)
        result = absenc("decode", "tformat", self.vcd(wave), "--baud", "1000000", "--json")
        self.assert_good(result)
        self.assertEqual([line["fields"]["singleturn"] for line in json_lines(result.stdout)], list(range(20)))

    def test_reports_errors_at_their_exchanges(self):
        result = absenc("decode", "tformat", self.vcd(conversation(bad={7}, silent={20})), "--json")
        self.assertEqual(result.returncode, 1)
        lines = json_lines(result.stdout)
        self.assertEqual({i: line["error"] for i, line in enumerate(lines) if not line["ok"]},
                         {7: "bad_checksum", 20: "timeout"})
        self.assertNotIn("fields", lines[7])
        self.assertNotIn("angle_deg", lines[7])

    def test_statistics(self):
        path = self.vcd(conversation(bad={7, 8}, silent={20}))
        result = absenc("decode", "tformat", path, "--stats")
        self.assertEqual(result.returncode, 1)
        for words in ("exchanges       49", "bad_checksum  2", "timeout       1", "baud rate measured: 2500000",
                      "median 3 us", "the document: 3 us", "turns |", "first errors:", "worst: 2 in a row"):
            self.assertIn(words, result.stdout)
        statistics = json_lines(absenc("decode", "tformat", path, "--stats", "--json").stdout)[0]
        self.assertEqual((statistics["exchanges"], statistics["good"], statistics["bad"]), (49, 47, 3))
        self.assertEqual(statistics["errors"], {"timeout": 1, "bad_checksum": 2})
        self.assertAlmostEqual(statistics["turnaround_us"]["median"], 3, delta=0.1)
        self.assertEqual(statistics["first_errors"][0]["kind"], "exchange")

    def test_all_file_formats_agree(self):
        wave = conversation()
        expected = [line["fields"] for line in json_lines(absenc("decode", "tformat", self.vcd(wave), "--json").stdout)]
        raw = self.file("capture.bin")
        with open(raw, "wb") as file:
            file.write(wave.samples("D0", 50))
        result = absenc("decode", "tformat", raw, "--raw-channels", "1", "--rate", "20000000", "--json")
        self.assert_good(result)
        self.assertEqual([line["fields"] for line in json_lines(result.stdout)], expected)
        session = self.file("capture.sr")
        subprocess.run(["sigrok-cli", "-I", "binary:numchannels=1:samplerate=20000000", "-i", raw, "-o", session],
                       check=True, timeout=PATIENCE, capture_output=True)
        result = absenc("decode", "tformat", session, "--json")
        self.assert_good(result)
        self.assertEqual([line["fields"] for line in json_lines(result.stdout)], expected)

    def test_two_wire_pairs(self):
        wave = Wave(A=1, B=1)
        for _ in range(30):
            wave.send("A", [0, 0], 1000)
            wave.wait(5000)
            wave.send("B", bytes.fromhex("003e83c500"), 1000)
            wave.wait(50_000)
        options = ["--option", "resolution=20", "--option", "multiturn_bits=0", "--json"]
        for channels in ([], ["--channel", "B,A"], ["--channel", "host=A", "--channel", "device=B"]):
            result = absenc("decode", "encolink", self.vcd(wave), *options, *channels)
            self.assert_good(result)
            lines = json_lines(result.stdout)
            self.assertEqual({(line["kind"], line["request"], line["angle_deg"]) for line in lines},
                             {("exchange", "0000", 1000 * 360 / 2**20)})
            self.assertEqual(len(lines), 30)

    def test_clocked_word(self):
        wave = Wave(clock=1, data=1)
        for position in (495, 496, 4095):
            wave.word([position >> (11 - i) & 1 for i in range(12)])
        result = absenc("decode", "ssi", self.vcd(wave), "--option", "bits=12", "--json")
        self.assert_good(result)
        self.assertEqual([line["fields"]["singleturn"] for line in json_lines(result.stdout)], [495, 496, 4095])

    def test_capture_that_begins_within_frame(self):
        wave = conversation(10)
        cut = 20_000 + 5 * 10 * BIT + 3000 + 700
        wave.changes["D0"] = [(0, 1), *((at - cut, level) for at, level in wave.changes["D0"] if at > cut)]
        wave.now -= cut
        result = absenc("decode", "tformat", self.vcd(wave), "--json")
        self.assert_good(result)
        good = [line for line in json_lines(result.stdout) if line["kind"] == "exchange"]
        self.assertEqual([line["fields"]["singleturn"] for line in good], [100 * i for i in range(1, 10)])

    def test_decodes_truncated_file_up_to_damage(self):
        text = conversation().vcd()
        result = absenc("decode", "tformat", self.file("cut.vcd", text[:len(text) // 2] + "?!"), "--json")
        self.assert_failed(result, "the capture is damaged at byte")
        self.assertGreater(len(json_lines(result.stdout)), 20)

    def test_closed_output_ends_quietly(self):
        path = self.vcd(conversation(2000))
        command = f"{ABSENC} decode tformat {path} --json | head -n 1"
        result = subprocess.run(["bash", "-c", f"set -o pipefail; {command}"], capture_output=True, text=True,
                                timeout=PATIENCE, check=False)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual(len(json_lines(result.stdout)), 1)

    def test_memory_does_not_grow_with_file(self):
        wave = conversation(1000)
        samples = wave.samples("D0", 50)

        def most(name, times):
            path = self.file(name)
            with open(path, "wb") as file:
                for _ in range(times):
                    file.write(samples)
            process = subprocess.Popen([ABSENC, "decode", "tformat", path, "--raw-channels", "1", "--rate", "20000000",
                                        "--stats", "--json"], stdout=subprocess.PIPE)
            out = process.stdout.read()
            process.stdout.close()
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
            os.remove(path)
            self.assertEqual(process.returncode, 0)
            self.assertEqual(json_lines(out.decode())[0]["good"], 1000 * times)
            return usage.ru_maxrss

        self.assertLess(most("long.bin", 80), most("short.bin", 20) + 8192)


class Usage(Case):
    def test_refuses_conflicting_options(self):
        text = self.file("capture.txt", "1A\n1A 00 45 23 01 11 34 12 00 00 4A\n")
        self.assert_wrong_usage(absenc("decode", "tformat", text, "--json", "--csv"), "--json and --csv")
        self.assert_wrong_usage(absenc("decode", "tformat", text, "--stats", "--csv"), "--stats")
        self.assert_wrong_usage(absenc("decode", "tformat", text, "--hex", "1A"), "cannot be given together")
        self.assert_wrong_usage(absenc("decode", "tformat", "--stats"), "name its file")
        self.assert_wrong_usage(absenc("decode", "tformat"), "name a capture")
        self.assert_wrong_usage(absenc("decode", "tformat", text, "--raw-channels", "8"), "--rate")
        self.assert_wrong_usage(absenc("decode", "ssi", text), "holds bytes", "clocked bits")
        can = self.file("can.log", "(1.000000) can0 121#0102030405060708\n")
        self.assert_wrong_usage(absenc("decode", "tformat", can), "CAN frames")

    def test_standard_input_must_be_text(self):
        raw = ["--raw-channels", "1", "--rate", "1000000"]
        self.assert_wrong_usage(absenc("decode", "tformat", "-", *raw, stdin=None, input="text"), "only text")
        self.assert_wrong_usage(absenc("decode", "tformat", "-", stdin=None, input="PK\3\4\0\0"), "only text")

    def test_refuses_wrong_channels(self):
        wave = Wave(D0=1, D1=1, D2=1)
        path = self.file("three.vcd", wave.vcd())
        self.assert_wrong_usage(absenc("decode", "tformat", path), "--channel line=NAME", "D0, D1, D2")
        self.assert_wrong_usage(absenc("decode", "tformat", path, "--channel", "D7"), "no channel \"D7\"", "D0, D1, D2")
        self.assert_wrong_usage(absenc("decode", "tformat", path, "--channel", "moon=D1"), "no wire \"moon\"", "line")
        self.assert_wrong_usage(absenc("decode", "tformat", path, "--channel", "D0,D1"), "one too many")

    def test_reports_missing_or_invalid_files(self):
        self.assert_failed(absenc("decode", "tformat", self.file("missing")), "missing")
        self.assert_failed(absenc("decode", "tformat", self.file("empty", "")), "empty")
        self.assert_failed(absenc("decode", "tformat", self.file("what.bin", "\0\1\2\3")), "what.bin")
        self.assert_failed(absenc("decode", "nothere.zip"), "nothere.zip does not exist")
        # The first of two files is taken for the name of a protocol, but it does exist.
        there = absenc("decode", self.file("a.txt", "1A\n"), self.file("b.txt", "1A\n"))
        self.assertNotEqual(there.returncode, 0)
        self.assertNotIn("does not exist", there.stderr)


if __name__ == "__main__":
    if shutil.which("sigrok-cli") is None:
        raise SystemExit("sigrok-cli is missing: apt install sigrok-cli")
    unittest.main()
