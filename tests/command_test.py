# SPDX-License-Identifier: Apache-2.0
"""Tests decode, encode, list, vectors and help, and wrong usage."""
import json
import os
import subprocess
import tempfile
import unittest

from command_support import ABSENC, Case, absenc, json_lines

VERBS = ["list", "read", "monitor", "record", "info", "alarms", "temperature", "zero", "reset-multiturn", "clear-alarms",
         "memory read", "memory write", "memory dump", "memory load", "memory verify", "config get", "config set", "run",
         "scan", "emulate", "tap", "decode", "encode", "wave", "probe", "identify", "doctor", "conform",
         "conform-host", "crc find", "vectors",
         "campaign", "bench"]
GOOD_REPLY = "1A 00 45 23 01 11 34 12 00 00 4A"


def reference_vectors():
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "vectors.json"), encoding="utf-8") as file:
        return json.load(file)["vectors"]


def option_arguments(options):
    arguments = []
    for name, value in options.items():
        arguments += ["--option", f"{name}={str(value).lower() if isinstance(value, bool) else value}"]
    return arguments


class Decode(Case):
    def assert_fields(self, wanted, fields):
        for name, value in wanted.items():
            self.assertIn(name, fields)
            if isinstance(value, float):
                self.assertAlmostEqual(fields[name], value, delta=1e-6)
            else:
                self.assertEqual(fields[name], value)
                self.assertEqual(type(fields[name]), type(value), name)

    def check_vector(self, vector):
        arguments = ["decode", vector["protocol"], "--json", *option_arguments(vector["options"])]
        if vector["request"]:
            arguments += ["--request", vector["request"]]
        if vector["response"]:
            arguments += ["--hex", vector["response"]]
        result = absenc(*arguments)
        decoded = json.loads(result.stdout)
        self.assertEqual(decoded["protocol"], vector["protocol"])
        self.assertEqual(result.stderr, "")
        if "error" in vector:
            self.assertEqual((decoded["ok"], decoded["error"]), (False, vector["error"]))
            self.assertTrue(decoded["message"])
            self.assertNotIn("fields", decoded)
            self.assertEqual(result.returncode, 1)
        else:
            self.assertTrue(decoded["ok"], decoded)
            self.assert_fields(vector["fields"], decoded["fields"])
            self.assertEqual(result.returncode, 0)

    def test_decodes_reference_vectors(self):
        known = {unit["protocol"] for unit in json_lines(absenc("list", "--json").stdout)}
        self.assertIn("tformat", known)
        checked = 0
        for vector in reference_vectors():
            if vector["protocol"] in known:
                with self.subTest(vector["id"]):
                    self.check_vector(vector)
                    checked += 1
        self.assertGreaterEqual(checked, 29)

    def test_decodes_own_vectors(self):
        vectors = json_lines(absenc("vectors", "--json").stdout)
        self.assertTrue(vectors)
        for vector in vectors:
            with self.subTest(vector["id"]):
                self.check_vector(vector)

    def test_fields_are_in_wire_order(self):
        result = absenc("decode", "tformat", "--request", "1A", "--hex", GOOD_REPLY, "--json")
        names = [name for name, _ in json.loads(result.stdout, object_pairs_hook=list)[2][1]]
        self.assertEqual(names, ["data_id", "status", "singleturn", "encoder_id", "multiturn", "alarms"])

    def test_accepts_all_notations_of_bytes(self):
        wanted = absenc("decode", "tformat", "--hex", "0200cdab0165", "--json").stdout
        for written in ["02 00 cd ab 01 65", "0x02 0x00 0xCD 0xAB 0x01 0x65", "0x0200CDAB0165", "02,00,cd,AB,01,65",
                        " 02, 00,\tCDAB  0165 "]:
            with self.subTest(written):
                self.assertEqual(absenc("decode", "tformat", "--hex", written, "--json").stdout, wanted)

    def test_refuses_bad_hexadecimal(self):
        for written, words in [("1A 0G", ["'G'", "position 5"]), ("1A 0", ["position 4", "one digit"]),
                               ("1A-00", ["'-'", "position 3"]), ("1A 0x", ["0x", "position 4"]),
                               ("0x0x1A", ["'x'", "position 4"])]:
            with self.subTest(written):
                self.assert_wrong_usage(absenc("decode", "tformat", "--hex", written), "--hex", *words)

    def test_text_output(self):
        result = absenc("decode", "tformat", "--request", "1a", "--hex", "1a2000000011000000103b")
        self.assert_good(result)
        for word in ["singleturn", "counts", "over_heat", "let it cool, then `absenc clear-alarms`"]:
            self.assertIn(word, result.stdout)

    def test_reports_bad_frame(self):
        result = absenc("decode", "tformat", "--request", "1a", "--hex", "1a0055230111341200004a")
        self.assert_failed(result, "bad_checksum", "the checksum of the reply is wrong")
        self.assertEqual(result.stdout, "")

    def test_explains_bad_frame(self):
        too_long = absenc("decode", "tformat", "--request", "1A", "--hex", GOOD_REPLY + " 00", "--json")
        self.assertIn("the first 11 bytes are a good reply, but 1 byte more came", too_long.stdout)
        echoed = absenc("decode", "tformat", "--request", "1A", "--hex", "1A " + GOOD_REPLY, "--json")
        self.assertIn("after the adapter's echo", echoed.stdout)
        only_echo = absenc("decode", "tformat", "--request", "1A", "--hex", "1A", "--json")
        self.assertIn("only the request itself came back", only_echo.stdout)
        model = absenc("decode", "tformat", "--request", "92", "--hex", "92001785", "--json")
        self.assertIn("set model=23-bit", model.stdout)
        strict = absenc("decode", "tformat", "--request", "02", "--hex", "020100000003", "--json")
        self.assertIn("strict=false", strict.stdout)

    def test_model_option(self):
        frame = ["decode", "tformat", "--request", "92", "--hex", "92001785", "--json"]
        self.assertEqual(absenc(*frame, "--model", "23-bit").returncode, 0)
        self.assertEqual(absenc(*frame, "--option", "model=23-bit").returncode, 0)
        self.assertEqual(absenc(*frame, "--model", "TS5700N8500").returncode, 1)
        self.assert_wrong_usage(absenc(*frame, "--model", "24-bit"), "no model", "did you mean 23-bit?")
        self.assert_wrong_usage(absenc(*frame, "--model", "TS5700N8500", "--option", "model=23-bit"), "two models")

    def test_refuses_wrong_options(self):
        frame = ["decode", "tformat", "--hex", "020000000002"]
        self.assert_wrong_usage(absenc(*frame, "--option", "single_turn_bits=17"), "did you mean singleturn_bits?")
        self.assert_wrong_usage(absenc(*frame, "--option", "singleturn_bits=99"), "1 to 24", '"99"')
        self.assert_wrong_usage(absenc(*frame, "--option", "strict=maybe"), "false or true")
        self.assert_wrong_usage(absenc(*frame, "--option", "strict"), "NAME=VALUE")

    def test_refuses_empty_input(self):
        self.assert_wrong_usage(absenc("decode", "tformat"), "nothing to decode", "--hex")
        for empty in ("", " ", ","):
            with self.subTest(empty):
                self.assert_wrong_usage(absenc("decode", "tformat", "--request", "1A", "--hex", empty), "--hex is empty")


class Encode(Case):
    def test_encodes_requests(self):
        for arguments, wanted in [(["position"], "1A"), (["singleturn"], "02"), (["zero"], "C2"),
                                  (["memory-read", "1"], "EA 01 EB"), (["memory-write", "0x01", "0x5a"], "32 01 5A 69"),
                                  (["memory-write", "1", "90"], "32 01 5A 69")]:
            with self.subTest(arguments):
                result = absenc("encode", "tformat", *arguments)
                self.assert_good(result)
                self.assertEqual(result.stdout, wanted + "\n")

    def test_json_output(self):
        result = absenc("encode", "tformat", "memory-write", "1", "90", "--json")
        self.assertEqual(json.loads(result.stdout),
                         {"protocol": "tformat", "command": "memory-write", "request": "32 01 5A 69"})

    def test_refuses_wrong_arguments(self):
        for arguments, words in [(["memory-write", "1", "256"], ["value", "0 to 255"]),
                                 (["memory-write", "1"], ["value", "needs"]),
                                 (["memory-write", "1", "ten"], ["value", '"ten"']),
                                 (["position", "1"], ["no arguments", '"1"']),
                                 (["memory-wirte", "1", "2"], ["did you mean memory-write?"])]:
            with self.subTest(arguments):
                self.assert_wrong_usage(absenc("encode", "tformat", *arguments), *words)


class ListAndVectors(Case):
    def test_list_shows_table(self):
        result = absenc("list")
        self.assert_good(result)
        for word in ["tformat", "TS5700N8500", "23-bit", "RS-485 half duplex, 2.5 Mbit/s"]:
            self.assertIn(word, result.stdout)

    def test_encode_prints_reply_with_values(self):
        reply = absenc("encode", "tformat", "position", "--reply", "singleturn=74565 multiturn=4660")
        self.assert_good(reply)
        self.assertEqual(reply.stdout.strip(), GOOD_REPLY)
        both = absenc("encode", "biss", "position", "--reply", "singleturn=1000", "--json")
        decoded = absenc("decode", "biss", "--hex", json.loads(both.stdout)["reply"], "--json")
        self.assertEqual(json.loads(decoded.stdout)["fields"]["singleturn"], 1000)
        self.assert_wrong_usage(absenc("encode", "tformat", "position", "--reply", "singletrun=1"), "singletrun")

    def test_list_shows_details_of_unit(self):
        result = absenc("list", "tformat")
        self.assert_good(result)
        for word in ["singleturn_bits", "memory-write <address> <value> [page]", "battery_error", "changes the encoder"]:
            self.assertIn(word, result.stdout)

    def test_list_json(self):
        units = json_lines(absenc("list", "--json").stdout)
        unit = next(unit for unit in units if unit["protocol"] == "tformat")
        self.assertEqual(unit["link"], "half_duplex")
        self.assertEqual(unit["line"], {"rate": 2500000, "parity": "none", "stop_bits": 1})
        models = {model["name"]: model["options"] for model in unit["models"]}
        self.assertEqual(models["23-bit"]["singleturn_bits"], 23)
        options = {option["name"]: option for option in unit["options"]}
        self.assertEqual((options["strict"]["default"], options["strict"]["choices"]), (True, [False, True]))
        self.assertEqual((options["singleturn_bits"]["minimum"], options["singleturn_bits"]["maximum"]), (1, 24))
        commands = {command["name"]: command for command in unit["commands"]}
        self.assertTrue(commands["zero"]["changes_encoder"])
        self.assertFalse(commands["position"]["changes_encoder"])
        self.assertEqual([argument["name"] for argument in commands["memory-write"]["arguments"]],
                         ["address", "value", "page"])
        self.assertEqual(sum(area["count"] for area in unit["memory"] if area["in_dump"]), 6 * 127)
        self.assertEqual(unit["memory"][-1]["writable"], False)
        self.assertEqual(json_lines(absenc("list", "tformat", "--json").stdout), [unit])

    def test_own_vectors_equal_reference(self):
        own = {vector["id"]: vector for vector in json_lines(absenc("vectors", "tformat", "--json").stdout)}
        for vector in reference_vectors():
            if vector["protocol"] != "tformat":
                continue
            with self.subTest(vector["id"]):
                same = own[vector["id"]]
                self.assertEqual(list(same)[:7], list(vector)[:7])
                for name in ("request", "response", "fields", "error"):
                    self.assertEqual(same.get(name), vector.get(name))

    def test_vectors_reports_decoding_result(self):
        result = absenc("vectors")
        self.assert_good(result)
        self.assertNotIn("WRONG", result.stdout)
        self.assertGreaterEqual(result.stdout.count("  ok  "), 29)


class Usage(Case):
    def test_help_lists_verbs(self):
        result = absenc("--help")
        self.assert_good(result)
        for verb in VERBS:
            self.assertIn(f"\n  {verb}", result.stdout)
            with self.subTest(verb):
                verb_help = absenc(*verb.split(), "--help")
                self.assert_good(verb_help)
                for word in [f"Usage: absenc {verb}", "Options:", "Examples:"]:
                    self.assertIn(word, verb_help.stdout)
                self.assertGreaterEqual(verb_help.stdout.count(f"  absenc {verb}"), 2)
                self.assertTrue(all(len(line) <= 120 for line in verb_help.stdout.splitlines()), verb_help.stdout)

    def test_help_of_two_word_verbs(self):
        result = absenc("memory", "--help")
        self.assert_good(result)
        for word in ["Usage: absenc memory <verb>", "\n  memory read ", "\n  memory verify "]:
            self.assertIn(word, result.stdout)
        self.assertNotIn("config", result.stdout)
        self.assertIn("Try: absenc memory --help", absenc("memory", "raed").stderr)
        self.assertIn("Try: absenc memory read --help", absenc("memory", "read").stderr)

    def test_version_has_three_numbers(self):
        result = absenc("--version")
        self.assert_good(result)
        self.assertRegex(result.stdout, r"^absenc \d+\.\d+\.\d+\ncommit \w+\nfor \w+\nbuilt in: .+\n$")

    def test_refuses_wrong_usage(self):
        for arguments, words in [(["raed"], ["did you mean read?"]),
                                 (["--versoin"], ["did you mean --version?"]),
                                 (["read", "sim:tformat", "--cuont", "3"], ["did you mean --count?"]),
                                 (["read", "--jsn"], ["--json"]),
                                 (["read"], ["<encoder> is missing"]),
                                 (["read", "sim:tformat", "more"], ['"more" is too much']),
                                 (["read", "sim:tformat", "--count"], ["--count needs a value"]),
                                 (["read", "sim:tformat", "--count", "-1"], ["--count", "0 or more"]),
                                 (["read", "sim:tformat", "--count", "many"], ["--count", '"many"']),
                                 (["read", "sim:tformat", "--rate", "fast"], ["--rate", '"fast"']),
                                 (["read", "sim:tformat", "--json=no"], ["--json takes no value"]),
                                 (["read", "sim:tformat", "--json", "--csv"], ["exclude each other"]),
                                 (["list", "tfromat"], ["did you mean tformat?"]),
                                 (["memroy"], ["did you mean memory?"]),
                                 (["memory"], ["what shall be done", "read, write, dump, load, verify"]),
                                 (["memory", "raed"], ["of memory", "did you mean read?"]),
                                 (["memory", "decode"], ["of memory"]),
                                 (["memory", "--jsn"], ["no option --jsn"]),
                                 (["memory", "read", "--jsn"], ["memory read has no option", "did you mean --json?"]),
                                 (["config", "gte", "sim:tformat"], ["did you mean get?"]),
                                 (["run", "sim:tformat", "temprature"], ["did you mean temperature?"]),
                                 (["emulate", "tformat", "--fault", "corupt=1"], ["corrupt"]),
                                 (["emulate", "tformat", "--fault", "corrupt=2"], ["from 0 to 1"]),
                                 (["emulate", "tformat", "--alarm", "baterry_alarm"], ["did you mean battery_alarm?"]),
                                 (["emulate", "tformat", "--motion", "rmp=3"], ["rpm=R"]),
                                 (["emulate", "tformat", "--singleturn", "131072"], ["0 to 131071", "17 bits"]),
                                 (["emulate", "tformat", "--multiturn", "65536"], ["0 to 65535"]),
                                 (["emulate", "tformat", "--power-on", "slow"], ["real or skip"])]:
            with self.subTest(arguments):
                self.assert_wrong_usage(absenc(*arguments), *words)

    def test_refuses_wrong_addresses(self):
        for encoder, words in [("/dev/ttyUSB0", ["which protocol", "tformat:/dev/ttyUSB0"]),
                               ("tformat", ["where the encoder is", "tformat:tcp:HOST:PORT"]),
                               ("tformat:", ["where the encoder is"]),
                               ("sim", ["sim:tformat"]),
                               ("sim:tformta", ["did you mean tformat?"]),
                               ("tformatt:/dev/ttyUSB0", ["did you mean tformat?"]),
                               ("tformat:tcp:host", ["tcp:HOST:PORT"]),
                               ("tformat:tcp:::1:4001", ["brackets"]),
                               ("tformat:tcp:host:99999", ["1 to 65535"]),
                               ("tformat:/dev/ttyUSB0?baudd=3", ["did you mean baud?"]),
                               ("tformat:/dev/ttyUSB0?baud=fast", ["baud", '"fast"']),
                               ("tformat:/dev/ttyUSB0?echo=maybe", ["auto, on or off"]),
                               ("tformat:/dev/ttyUSB0?motion=still", ["it is for: sim"]),
                               ("tformat:tcp:host:4001?baud=9600", ["it is for: serial"]),
                               ("amt21:/dev/ttyUSB0?baud=1152", ["rate is \"1152\"", "115200"]),
                               ("tformat:/dev/ttyUSB0?model", ["NAME=VALUE"]),
                               ("sim:tformat?singleturn=131072", ["0 to 131071"])]:
            with self.subTest(encoder):
                self.assert_wrong_usage(absenc("read", encoder), *words)

    def test_reports_unwritable_output(self):
        closed = subprocess.run(["sh", "-c", '"$0" list >&-', ABSENC], capture_output=True, text=True, check=False)
        self.assert_failed(closed, "standard output cannot be written")
        full = subprocess.run(["sh", "-c", '"$0" list >/dev/full', ABSENC], capture_output=True, text=True, check=False)
        self.assert_failed(full, "standard output cannot be written", "No space left")

    def test_file_size_limit_is_reported_as_full_disk(self):
        """`ulimit -f 4` is four blocks of 1024 bytes, or of 512 in some shells."""
        def limited(*arguments, output=None):
            with open(output or os.devnull, "w", encoding="utf-8") as file:
                return subprocess.run(["sh", "-c", 'ulimit -f 4; exec "$0" "$@"', ABSENC, *arguments], stdout=file,
                                      stderr=subprocess.PIPE, text=True, check=False)

        with tempfile.TemporaryDirectory() as folder:
            output = os.path.join(folder, "read.csv")
            done = limited("read", "sim:tformat", "--csv", "--count", "1000", "--rate", "0", output=output)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn("standard output cannot be written: File too large", done.stderr)
            with open(output, encoding="utf-8") as file:
                text = file.read()
            self.assertTrue(text.endswith("\n"), text[-80:])
            self.assertEqual({len(line.split(",")) for line in text.splitlines()}, {len(text.splitlines()[0].split(","))})
            for name in ("log.csv", "log.jsonl", "log.h5"):
                recorded = os.path.join(folder, name)
                done = limited("record", "sim:tformat", "--output", recorded, "--count", "1000", "--rate", "0")
                self.assertEqual(done.returncode, 1, (name, done.stderr))
                self.assertIn("File too large", done.stderr)
                if name == "log.h5":
                    self.assertEqual(os.path.exists(recorded), False)
                else:
                    with open(recorded, encoding="utf-8") as file:
                        self.assertTrue(file.read().endswith("\n"))
            dump = os.path.join(folder, "motor.dump")
            done = limited("memory", "dump", "sim:tformat", "--output", dump)
            self.assertEqual(done.returncode, 1, done.stderr)
            self.assertIn("File too large", done.stderr)
            self.assertFalse(os.path.exists(dump))
            self.assertEqual(sorted(os.listdir(folder)), ["log.csv", "log.jsonl", "read.csv"])

    def test_unwritable_messages_keep_exit_status(self):
        for where in ("2>/dev/full", "2>&-"):
            with self.subTest(where):
                result = subprocess.run(["sh", "-c", f'"$0" raed {where}', ABSENC], check=False)
                self.assertEqual(result.returncode, 2)


if __name__ == "__main__":
    unittest.main()
