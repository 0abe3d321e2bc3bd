#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests the RAA38S6 over Modbus RTU on a pseudo-terminal, read and configured with the command."""
import json
import os
import re
import unittest

from command_support import Case, Emulator, FakeEncoder, absenc, json_lines


def framed(text):
    """Returns the bytes of a hexadecimal text and their CRC, as in the manual (3.1.7)."""
    data = bytes.fromhex(text)
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ 0xA001 if crc & 1 else crc >> 1
    return data + crc.to_bytes(2, "little")


REQUEST_1, REQUEST_2 = framed("010300000001"), framed("010300000002")
# Each row: options, request, reply, expected error, evidence in the message, advice.
FRAMES = [
    ("bits=14", REQUEST_1, framed("0103020180")[:-1], "wrong_length", "byte count 02", "bits and registers"),
    ("bits=14", REQUEST_1, framed("01030400000180"), "wrong_length", "byte count 02", "more than 16 bits has two"),
    ("bits=14", REQUEST_1, framed("0103040180"), "wrong_length", "byte count 02", "only one slave"),
    ("bits=21", REQUEST_2, framed("0103020180"), "wrong_length", "byte count 04 or 03", "registers=1"),
    ("bits=14", REQUEST_1, framed("0103020180")[:-2] + framed("0103020180")[:-3:-1], "bad_checksum",
     "low byte first", "does not speak Modbus RTU"),
    ("bits=14", REQUEST_1, framed("0103020180")[:-1] + b"\0", "bad_checksum", "checksum", "termination"),
    ("bits=14", REQUEST_1, framed("0203020180"), "unexpected_reply", "another address", "scan"),
    ("bits=14", REQUEST_1, framed("0104020180"), "unexpected_reply", "another function", "other program"),
    ("bits=14", REQUEST_1, framed("0103024000"), "out_of_range", "more bits", "resolution of the encoder"),
    ("bits=14", REQUEST_1, framed("018301"), "request_rejected", "exception 01, illegal function", "another kind"),
    ("bits=14", REQUEST_1, framed("018302"), "request_rejected", "exception 02, illegal data address", "registers"),
    ("bits=14", REQUEST_1, framed("018303"), "request_rejected", "exception 03, illegal data value", "registers"),
    ("bits=14", REQUEST_1, framed("018304"), "request_rejected", "exception 04, server device failure", "off and on"),
    ("bits=14", REQUEST_1, framed("018306"), "request_rejected", "exception 06, server device busy", "wait"),
    ("bits=14", REQUEST_1, framed("01830b"), "request_rejected", "behind the gateway", "gateway"),
    ("bits=14", REQUEST_1, framed("018377"), "request_rejected", "the standard does not have", "manual"),
]
# Exchanges of other commands than `read`. Each row: request, reply, expected error, evidence in the message.
OTHER_FRAMES = [
    (framed("ffa0"), framed("ffa000"), "out_of_range", "from 1 to 247"),
    (framed("ffa0"), framed("ffa001")[:-1], "wrong_length", "several encoders"),
    (framed("01a102"), framed("03a1"), "unexpected_reply", "another address"),
    (framed("01a102"), framed("01a102"), "request_rejected", "exception 02"),
    (framed("01a102"), framed("02a1")[:-1], "wrong_length", "the new address, A1"),
    (framed("01cc01"), framed("01cc02"), "unexpected_reply", "another than was sent"),
    (framed("01cc01"), framed("01cc01")[:-1], "wrong_length", "the request once more"),
    (framed("01cc01"), framed("02cc01"), "unexpected_reply", "another address"),
    (framed("010300050002"), framed("01030400000001"), "unsupported", "from register 0"),
    (framed("010600000001"), framed("010600000001"), "unsupported", "03, A0, A1 and CC"),
    (framed("01a0"), framed("ffa001"), "unexpected_reply", "asked of address FF"),
    (REQUEST_1[:-2] + REQUEST_1[:-3:-1], framed("0103020180"), "bad_checksum", "low byte first"),
    (REQUEST_1[:-1] + b"\0", framed("0103020180"), "bad_checksum", "of the request"),
    (REQUEST_1[:-1], framed("0103020180"), "wrong_length", "length of a request"),
]


class ModbusCase(Case):
    def emulator(self, *arguments, name="encoder"):
        emulator = Emulator(self.directory, *arguments, protocol="raa38-modbus", name=name)
        self.addCleanup(emulator.end)
        return emulator

    def uri(self, emulator, options=""):
        return f"raa38-modbus:{emulator.path}?latency=300{options}"

    def good_json(self, *arguments):
        result = absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)

    def set(self, uri, *arguments):
        result = absenc("config", "set", uri, *arguments, "--yes", "--json")
        self.assert_good(result)
        return json.loads(result.stdout), result.stderr

    def violations(self, emulator):
        _, _, messages = emulator.end()
        return re.findall(r" s: (.*)", messages)


class Reading(ModbusCase):
    def test_every_form_of_reply(self):
        for options, data in (("bits=14", "four"), ("bits=21", "four"), ("bits=21", "three"),
                              ("bits=21", "three_as_four"), ("bits=12&registers=2", "three_as_four")):
            with self.subTest(options, data=data):
                settings = [word for option in options.split("&") for word in ("--option", option)]
                emulator = self.emulator(*settings, "--option", f"reply_data={data}", "--singleturn", "1023",
                                         name=f"{options}-{data}".replace("&", "-"))
                reading = self.good_json("read", self.uri(emulator, f"&{options}"))
                self.assertEqual(reading["singleturn"], 1023)
                self.assertTrue(reading["confirmed"])
                self.assertEqual(self.violations(emulator), [])

    def test_read_record_and_monitor(self):
        uri = self.uri(self.emulator("--motion", "rpm=60"))
        lines = json_lines(absenc("read", uri, "--count", "10", "--json").stdout)
        self.assertEqual(len({line["singleturn"] for line in lines}), 10)
        recording = self.file("log.jsonl")
        self.assert_good(absenc("record", uri, "--output", recording, "--count", "10", "--rate", "0"))
        with open(recording, encoding="utf-8") as file:
            self.assertEqual(sum("singleturn" in line for line in json_lines(file.read())), 10)
        self.assertIn("singleturn", self.watch(uri, until=len)[uri])

    def test_info(self):
        answers = self.good_json("info", self.uri(self.emulator("--singleturn", "7")))["answers"]
        self.assertEqual(answers["address"]["fields"], {"address": 1})
        self.assertEqual(answers["baud"]["fields"], {"baud": 19200})
        self.assertEqual(answers["position"]["singleturn"], 7)

    def test_refuses_options_out_of_range(self):
        for option in ("address=0", "address=248", "bits=9", "bits=22", "registers=3", "baud=38400"):
            self.assert_wrong_usage(absenc("read", f"sim:raa38-modbus?{option}"), option.split("=", maxsplit=1)[0])
        self.assert_failed(absenc("read", "sim:raa38-modbus?bits=17&registers=1"), "16 bits", "registers=2")

    def test_named_encoder_has_baud_rate(self):
        config = self.file("absenc.toml", '[encoder.drum]\nprotocol = "raa38-modbus"\nport = "sim"\nbaud = 2400\n')
        info = absenc("info", "drum", "--json", env={**os.environ, "ABSENC_CONFIG": config})
        self.assert_good(info)
        self.assertEqual(json.loads(info.stdout)["rate"], 2400)
        self.assertEqual(json.loads(info.stdout)["answers"]["baud"]["fields"], {"baud": 2400})


class WrongAddress(ModbusCase):
    def test_names_right_address(self):
        emulator = self.emulator("--option", "address=42")
        uri = self.uri(emulator, "&address=5")
        named = "nobody answers at address 5, but A0 is answered by address 42 at 19200 baud"
        self.assert_failed(absenc("config", "get", uri), "timeout", named)
        self.assert_failed(absenc("config", "get", uri, "direction"), "timeout", named)
        info = absenc("info", uri)
        self.assertEqual(info.returncode, 1)
        self.assertIn(named, info.stdout)

    def test_address_reply_with_either_crc_order(self):
        for order in ("low_first", "high_first"):
            emulator = self.emulator("--option", "address=42", "--option", f"address_crc={order}", name=order)
            found = self.good_json("config", "get", self.uri(emulator), "address")
            self.assertEqual(found["settings"]["address"], {"address": 42})
            self.assertEqual([one["encoder_address"] for one in self.good_json("scan", self.uri(emulator))["encoders"]],
                             [42])
            self.assertEqual(self.violations(emulator), [])


class Settings(ModbusCase):
    def test_host_follows_new_baud_rate(self):
        emulator = self.emulator("--singleturn", "383", "--memory", self.file("memory"))
        uri = self.uri(emulator)
        for before, baud in ((19200, 57600), (57600, 2400), (2400, 19200), (19200, 9600)):
            now, note = self.set(f"{uri}&baud={before}", "baud", str(baud))
            self.assertEqual((now["old"], now["new"]), ({"baud": before}, {"baud": baud}))
            self.assertIn(f"baud={baud}", note)
        self.assert_failed(absenc("read", f"raa38-modbus:{emulator.path}"), "timeout", "this address and baud rate",
                           "config get")
        found = self.good_json("config", "get", f"raa38-modbus:{emulator.path}", "baud")
        self.assertEqual(found["settings"]["baud"], {"baud": 9600})
        self.assertEqual(self.good_json("read", f"{uri}&baud=9600")["singleturn"], 383)
        self.assertEqual(self.violations(emulator), [])
        kept = self.emulator("--memory", self.file("memory"), name="again")
        self.assertEqual(self.good_json("read", self.uri(kept, "&baud=9600"))["singleturn"], 0)

    def test_new_baud_rate_keeps_parity(self):
        for parity in ("odd", "even"):
            uri = f"sim:raa38-modbus?parity={parity}&singleturn=383"
            self.assertEqual(self.good_json("read", uri)["singleturn"], 383)
            now, _ = self.set(uri, "baud", "9600")
            self.assertEqual((now["old"], now["new"]), ({"baud": 19200}, {"baud": 9600}))

    def test_new_address_is_verified(self):
        emulator = self.emulator()
        now, note = self.set(self.uri(emulator), "address", "200")
        self.assertEqual((now["old"], now["new"]), ({"address": 1}, {"address": 200}))
        self.assertIn("address=200", note)
        self.assert_failed(absenc("read", f"raa38-modbus:{emulator.path}"), "timeout", "scan")
        self.assert_good(absenc("read", self.uri(emulator, "&address=200")))
        self.assertEqual(self.violations(emulator), [])

    def test_unchanged_value_is_not_sent(self):
        emulator = self.emulator()
        for setting, value in (("address", "1"), ("baud", "19200")):
            now, note = self.set(self.uri(emulator), setting, value)
            self.assertEqual(now["old"], now["new"])
            self.assertIn("nothing was sent", note)
        self.assertEqual(self.good_json("zero", self.uri(emulator), "--yes")["fields"]["written"], False)
        self.set(self.uri(emulator), "baud", "19200", "--force")
        self.assert_good(absenc("run", self.uri(emulator), "zero", "1", "--yes"))
        rules = self.violations(emulator)
        self.assertEqual(len(rules), 2, rules)
        self.assertIn("wears out", rules[0])

    def test_refuses_wrong_values_and_force(self):
        uri = self.uri(self.emulator())
        self.assert_wrong_usage(absenc("config", "set", uri, "direction", "1", "--yes", "--force"), "--force")
        self.assert_failed(absenc("config", "set", uri, "baud", "14400", "--yes"), "2400, 4800")
        self.assert_wrong_usage(absenc("config", "set", uri, "address", "248", "--yes"), "1 to 247")
        self.assert_wrong_usage(absenc("config", "set", uri, "baud", "9600"), "--yes")

    def test_refuses_address_of_another_encoder(self):
        emulator = self.emulator("--also", "address=2")
        result = absenc("config", "set", self.uri(emulator), "address", "2", "--yes")
        self.assert_failed(result, "invalid_argument", "answers at that address already", "nothing was sent")
        # The address is set although the line has two encoders, which reply to the broadcast request A0 at the same
        # time.
        self.set(self.uri(emulator), "address", "3")
        self.assert_good(absenc("read", self.uri(emulator, "&address=2")))
        self.assertEqual(self.violations(emulator), [])

    def test_direction_and_zero(self):
        emulator = self.emulator("--singleturn", "100")
        uri = self.uri(emulator)
        now, _ = self.set(uri, "direction", "2")
        self.assertIn("does not tell", now["new"]["direction"])
        self.assertEqual((now["old"]["singleturn"], now["new"]["singleturn"]), (100, 16284))
        result = self.good_json("run", uri, "set-direction", "1", "--yes")["fields"]
        self.assertEqual((result["parameter"], result["setting"]), (1, "positive direction"))
        self.assertIn("has changed", result["effect"])
        self.assertEqual(self.good_json("zero", uri, "--yes")["fields"]["singleturn"], 0)
        self.assertEqual(self.good_json("read", uri)["singleturn"], 0)
        self.assertEqual(self.violations(emulator), [])
        turning = self.emulator("--motion", "rpm=60", name="turning")
        self.assert_failed(absenc("zero", self.uri(turning), "--yes"), "turning", "nothing was changed")

    def test_refuses_baud_rate_over_tcp(self):
        emulator = self.emulator("--tcp", "0")
        port = emulator.line().strip().rpartition(":")[2]
        result = absenc("config", "set", f"raa38-modbus:tcp:127.0.0.1:{port}", "baud", "9600", "--yes")
        self.assert_failed(result, "cannot change to 19200 baud")
        self.assert_good(absenc("read", self.uri(emulator)))


class SharedLine(ModbusCase):
    def test_scan(self):
        alone = self.emulator("--option", "address=77", name="alone")
        self.assertEqual(self.good_json("scan", f"raa38-modbus:{alone.path}")["encoders"],
                         [{"encoder_address": 77, "clash": False}])
        emulator = self.emulator("--also", "address=4", "--also", "address=6&singleturn=1", "--also",
                                 "address=6&singleturn=9000", "--also", "address=5&bits=18")
        found = absenc("run", f"raa38-modbus:{emulator.path}", "scan", "1", "7", "--json")
        self.assert_good(found)
        self.assertEqual(json.loads(found.stdout)["encoders"],
                         [{"encoder_address": 1, "clash": False}, {"encoder_address": 4, "clash": False},
                          {"encoder_address": 5, "clash": False, "refuses": True},
                          {"encoder_address": 6, "clash": True}])
        self.assertEqual(self.violations(emulator), [])
        nobody = absenc("run", "sim:raa38-modbus?address=9&fault=silence=1", "scan", "1", "3")
        self.assert_failed(nobody, "timeout", "no address was answered")

    def test_monitors_several_encoders(self):
        emulator = self.emulator("--also", "address=2&singleturn=222", "--also", "address=3&singleturn=333")
        uris = [self.uri(emulator, f"&address={address}") for address in (1, 2, 3)]
        live = self.watch(*uris, until=lambda live: len(live) == 3)
        self.assertEqual([live[uri]["singleturn"] for uri in uris], [0, 222, 333])
        self.assertEqual(self.violations(emulator), [])

    def test_survives_faults(self):
        emulator = self.emulator("--singleturn", "383", "--fault", "corrupt=0.2", "--fault", "drop=0.1", "--seed", "3")
        result = absenc("read", f"raa38-modbus:{emulator.path}", "--count", "50", "--json")
        self.assertTrue(all(line.get("singleturn", 383) == 383 for line in json_lines(result.stdout)), result.stdout)
        self.assertGreater(sum(line["ok"] for line in json_lines(result.stdout)), 30)


class Frames(ModbusCase):
    def test_read_reports_received_bytes_and_advice(self):
        for options, _, reply, error, found, advice in FRAMES:
            with self.subTest(reply.hex()), FakeEncoder({0x01: reply}) as encoder:
                result = absenc("read", f"raa38-modbus:{encoder.path}?{options}&latency=300")
                self.assert_failed(result, error, found, reply.hex(" ").upper())
                self.assertIn(advice, result.stderr.partition("Try: ")[2])

    def test_decode_reports_same_errors(self):
        for options, request, reply, error, found, _ in FRAMES:
            with self.subTest(reply.hex()):
                result = absenc("decode", "raa38-modbus", "--request", request.hex(), "--hex", reply.hex(), "--option",
                                options)
                self.assert_failed(result, error, found)

    def test_decode_of_other_frames(self):
        for request, reply, error, found in OTHER_FRAMES:
            with self.subTest(request=request.hex(), reply=reply.hex()):
                result = absenc("decode", "raa38-modbus", "--request", request.hex(), "--hex", reply.hex())
                self.assert_failed(result, error, found)

    def test_silence_and_noise(self):
        with FakeEncoder({0x01: b""}) as encoder:
            self.assert_failed(absenc("read", f"raa38-modbus:{encoder.path}"), "timeout", "nobody answers", "scan")
        with FakeEncoder({0x01: REQUEST_1}) as encoder:  # the fake encoder returns only the echo of the request
            self.assert_failed(absenc("read", f"raa38-modbus:{encoder.path}"), "request itself came back")

    def test_decode_without_request(self):
        def decoded(reply, *options):
            arguments = [word for option in options for word in ("--option", option)]
            return self.good_json("decode", "raa38-modbus", "--hex", reply.hex(), *arguments)["fields"]
        self.assertEqual(decoded(framed("010302017f"))["singleturn"], 383)
        self.assertEqual(decoded(framed("0103031fabcd"), "bits=21")["singleturn"], 0x1FABCD)
        self.assertEqual(decoded(framed("02a1"))["new_address"], 2)
        self.assertEqual(decoded(framed("01cc96"))["setting"], "9600 baud")
        self.assertEqual(decoded(framed("ffa001")[:-2] + framed("ffa001")[:-3:-1])["crc_order"], "high_first")

    def test_encode(self):
        for arguments, frame in ((["position"], REQUEST_1), (["position", "--option", "bits=17"], REQUEST_2),
                                 (["address"], framed("ffa0")), (["set-address", "2"], framed("01a102")),
                                 (["set-baud", "57600"], framed("01cc57")), (["set-direction", "2"], framed("01cc02")),
                                 (["zero"], framed("01cc00"))):
            result = absenc("encode", "raa38-modbus", *arguments)
            self.assert_good(result)
            self.assertEqual(bytes.fromhex(result.stdout), frame, arguments)
        self.assertNotEqual(absenc("encode", "raa38-modbus", "set-baud", "14400").returncode, 0)

    def test_probe(self):
        result = absenc("probe", "raa38-modbus", "--hex", framed("010304001fabcd").hex())
        self.assert_good(result)
        self.assertIn("go on with: --option bits=21", result.stdout)
        damaged = absenc("probe", "raa38-modbus", "--hex", framed("010302017f")[:-1].hex() + "00")
        self.assertEqual(damaged.returncode, 1)
        self.assertIn("checksum", damaged.stderr)


if __name__ == "__main__":
    unittest.main()
