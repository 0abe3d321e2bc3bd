#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests QS35 ESL encoders with an independent client and with the absenc command."""
import json
import os
import select
import time
import tty
import unittest

from command_support import PATIENCE, Emulator, EncoderCase, FakeEncoder, absenc, json_lines
from decode_file_test import Wave

POSITION, QUICK, TEMPERATURE, READ, WRITE = 0x1, 0x5, 0x9, 0xE, 0xF
LENGTH = {POSITION: 18, QUICK: 6, TEMPERATURE: 4, READ: 4, WRITE: 4}
READY, CHANNEL_2 = 0x40, 0x20
REQUEST = "0875"  # request with ID 1 to address 0
REPLY = "084000efcdab34125646b3086000abd6cd84"
# Two examples: frames of a profile with crc_bit_order=msb, and a reply with one wrong bit in channel 2.
MSB_REQUEST, MSB_REPLY = "0857", "084000efcdab341255277e086000abd57f67"
WRONG_CHANNEL_2 = "084000efcdab3412553b5e086000afd5b069"


def control_field(data_id, address=0):
    parity = (bin(data_id).count("1") + 1) & 1  # the parity is odd over the data ID and the parity bit
    return parity << 7 | (data_id & 0xF) << 3 | address


def remainder(data, polynomial, bits, register=0):
    """Returns the CRC remainder of the bytes, least significant bit first."""
    for byte in data:
        for bit in range(8):
            top = register >> (bits - 1) & 1
            register = (register << 1) & ((1 << bits) - 1)
            if top ^ (byte >> bit & 1):
                register ^= polynomial
    return int(f"{register:0{bits}b}"[::-1], 2)


def crc8(data):
    return bytes([remainder(data, 0x2F, 8)])


def crc16(data, initial):
    padded = bytes(data) + bytes(len(data) % 2)
    return remainder(padded, 0x5935, 16, initial).to_bytes(2, "little")


class Client:
    """The host's end of a line with ESL encoders."""

    def __init__(self, path):
        self.descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.descriptor)

    def close(self):
        os.close(self.descriptor)

    def send(self, data):
        os.write(self.descriptor, bytes(data))

    def receive(self, length, patience=PATIENCE):
        data = b""
        deadline = time.monotonic() + patience
        while len(data) < length:
            if not select.select([self.descriptor], [], [], max(0, deadline - time.monotonic()))[0]:
                break
            data += os.read(self.descriptor, 256)
        return data

    def exchange(self, data_id, *body, address=0):
        request = bytes([control_field(data_id, address), *body])
        self.send(request + crc8(request))
        return self.receive(LENGTH[data_id])


class EslCase(EncoderCase):
    def emulator(self, *arguments):
        emulator = Emulator(self.directory, *arguments, protocol="esl")
        self.addCleanup(emulator.end)
        return emulator

    def encoder(self, *arguments, latency=300, more=""):
        return f"esl:{self.emulator(*arguments).path}?latency={latency}{more}"

    def client(self, *arguments):
        client = Client(self.emulator(*arguments).path)
        self.addCleanup(client.close)
        return client

    def good_json(self, *arguments):
        result = absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)


class VirtualEncoder(EslCase):
    def check_position(self, reply, singleturn, multiturn, address=0, alarms=0):
        """Checks both channels. Returns the sequence counters of channels 1 and 2."""
        self.assertEqual(len(reply), 18, reply.hex(" "))
        one, two = reply[:11], reply[11:]
        self.assertEqual(one[9:], crc16(one[:9], 0x0000), reply.hex(" "))
        self.assertEqual(two[5:], crc16(two[:5], 0xFFFF), reply.hex(" "))
        self.assertEqual((one[0], two[0]), (control_field(POSITION, address),) * 2)
        # The status fields of both channels are compared with the expected value, except for their error bits.
        self.assertEqual((one[1] & ~0x0C, two[1] & ~0x0C), (READY, READY | CHANNEL_2))
        self.assertEqual((one[2], two[2]), (alarms, alarms))
        self.assertEqual(int.from_bytes(one[3:6], "little"), singleturn)
        self.assertEqual(int.from_bytes(one[6:8], "little"), multiturn)
        self.assertEqual(two[3] << 1 | two[4] >> 7, singleturn >> 15)
        self.assertEqual(two[4] & 0x7F, one[8] & 0x7F)
        return one[8], two[4] & 0x7F

    def test_position_is_in_both_channels(self):
        client = self.client("--singleturn", "0xABCDEF", "--multiturn", "0x1234")
        before, _ = self.check_position(client.exchange(POSITION), 0xABCDEF, 0x1234)
        after, _ = self.check_position(client.exchange(POSITION), 0xABCDEF, 0x1234)
        self.assertNotEqual(before, after)

    def test_alarms_are_in_both_channels(self):
        client = self.client("--singleturn", "1", "--alarm", "multiturn_error")
        self.check_position(client.exchange(POSITION), 1, 0, alarms=0x02)

    def test_quick_position_and_temperature(self):
        client = self.client("--singleturn", "0xABCDEF")
        reply = client.exchange(QUICK)
        self.assertEqual(reply, bytes([0xA8, READY, 0xEF, 0xCD, 0xAB]) + crc8(reply[:5]))
        reply = client.exchange(TEMPERATURE)
        self.assertEqual((reply[0], reply[1], reply[3:]), (0xC8, READY, crc8(reply[:3])))

    def read_memory(self, client, address):
        """Reads one EEPROM byte, which follows replies with the busy flag."""
        was_busy = False
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            reply = client.exchange(READ, address << 1)
            self.assertEqual((len(reply), reply[3:]), (4, crc8(reply[:3])))
            self.assertEqual(reply[1] >> 1, address)
            if not reply[1] & 1 and was_busy:
                return reply[2]
            was_busy = was_busy or bool(reply[1] & 1)
        raise AssertionError("busy without end")

    def test_memory(self):
        client = self.client()
        self.assertEqual(client.exchange(WRITE, 0x7F << 1, 0)[1:3], bytes([0xFE, 0]))
        self.assertEqual(self.read_memory(client, 5), 0)
        reply = client.exchange(WRITE, 5 << 1, 0x5A)
        self.assertEqual(reply[3:], crc8(reply[:3]))
        self.assertEqual(self.read_memory(client, 5), 0x5A)

    def test_wrong_requests_get_no_reply(self):
        client = self.client("--option", "address=2")
        for request in [bytes([control_field(POSITION, 3)]), bytes([control_field(POSITION, 2)])]:
            wrong = b"\0" if request[0] & 7 == 2 else crc8(request)
            client.send(request + wrong)
            self.assertEqual(client.receive(1, 0.1), b"")
        self.check_position(client.exchange(POSITION, address=2), 0, 0, address=2)

    def test_wrong_parity_is_reported_at_every_address(self):
        for address in range(8):
            emulator = Emulator(self.directory, "--option", f"address={address}", protocol="esl", name=f"at{address}")
            self.addCleanup(emulator.end)
            client = Client(emulator.path)
            self.addCleanup(client.close)
            field = control_field(POSITION, address) ^ 0x80
            client.send(bytes([field]) + crc8([field]))
            reply = client.receive(18)
            self.assertEqual(len(reply), 18, address)
            self.assertEqual((reply[0], reply[11]), (field, field))
            self.assertEqual((reply[1] & 3, reply[12] & 3), (1, 1), address)

    def test_several_encoders_on_one_line(self):
        client = self.client("--singleturn", "1000", "--also", "address=3&singleturn=70000&multiturn=7",
                             "--also", "address=5&alarm=multiturn_error", "--also", "address=6&singleturn=0x5555",
                             "--also", "address=6&singleturn=0xAAAA")
        for _ in range(3):  # the requests follow each other without a pause
            self.check_position(client.exchange(POSITION, address=0), 1000, 0)
            self.check_position(client.exchange(POSITION, address=3), 70000, 7, address=3)
            self.check_position(client.exchange(POSITION, address=5), 0, 0, address=5, alarms=2)
            clash = client.exchange(QUICK, address=6)
            # Two encoders with the same address reply at once, and the line carries 0x5555 AND 0xAAAA.
            self.assertEqual(clash[:5], bytes([control_field(QUICK, 6), READY, 0, 0, 0]))
            self.assertNotEqual(clash[5:], crc8(clash[:5]))


class Command(EslCase):
    def test_read_info_and_alarms(self):
        encoder = self.encoder("--singleturn", "0xABCDEF", "--multiturn", "4660", "--alarm", "multiturn_error")
        reading = self.good_json("read", encoder)
        self.assertEqual((reading["singleturn"], reading["multiturn"]), (0xABCDEF, 4660))
        self.assertEqual((reading["singleturn_valid"], reading["multiturn_valid"]), (True, False))
        info = self.good_json("info", encoder)
        self.assertTrue(info["ok"])
        self.assertEqual(info["answers"]["encoder-id"]["fields"]["encoder_id"], 0xD8)
        alarms = self.good_json("alarms", encoder)
        for channel in ("ch1_alarms", "ch2_alarms"):
            self.assertEqual([alarm["name"] for alarm in alarms[channel]], ["multiturn_error"])
        self.assertIn("temperature_c", self.good_json("temperature", encoder)["fields"])
        safe = self.good_json("run", encoder, "safe-position")["fields"]
        self.assertEqual(safe["safe_singleturn"], 0xABCDEF)

    def test_changing_commands(self):
        encoder = self.encoder("--singleturn", "0x500000", "--multiturn", "5", "--alarm", "multiturn_error")
        self.assert_wrong_usage(absenc("zero", encoder), "--yes")
        for verb in ["zero", "reset-multiturn", "clear-alarms"]:
            # On a busy machine the emulator may receive the requests of a reset faster than the encoder allows.
            results = [absenc(verb, encoder, "--yes")]
            while results[-1].returncode != 0 and len(results) < 4:
                results.append(absenc(verb, encoder, "--yes"))
            self.assert_good(results[-1])
        reading = self.good_json("read", encoder)
        self.assertEqual((reading["singleturn"], reading["multiturn"], reading["alarms"]), (0, 0, []))

    def test_memory(self):
        encoder = self.encoder()
        self.assert_good(absenc("memory", "write", encoder, "3", "0x42", "0x43", "--page", "1", "--yes"))
        self.assertEqual(self.good_json("memory", "read", encoder, "2", "--count", "4", "--page", "1")["data"], "00424300")
        protected = ["memory", "write", encoder, "3", "0x42", "--page", "4", "--yes"]
        self.assert_wrong_usage(absenc(*protected), "page 4", "IEC table", "--force")
        self.assertEqual(self.good_json("memory", "read", encoder, "3", "--page", "4")["data"], "00")
        self.assert_good(absenc(*protected, "--force"))
        self.assertEqual(self.good_json("memory", "read", encoder, "3", "--page", "4")["data"], "42")
        self.assert_wrong_usage(absenc("memory", "read", encoder, "0", "--page", "7"), "esl has no page 7")
        self.assert_failed(absenc("memory", "read", f"{encoder}&bus=true", "0"), "unsupported", "bus=false")

    def test_load_of_protected_page_needs_force(self):
        encoder = self.encoder()
        dump = self.file("dump")
        self.assert_good(absenc("memory", "dump", encoder, "--output", dump))
        with open(dump, encoding="utf-8") as file:
            lines = [line for line in file if not line.startswith(("checksum", "#"))]
        self.assertTrue(all("page 0 " in line for line in lines if line.startswith("page")), lines)
        text = "".join(lines) + "page 4 address 0x10: 11 22\nchecksum: edited\n"
        changed = self.file("changed", text)
        self.assert_failed(absenc("memory", "load", encoder, changed, "--yes"), "page 4 address 0x10", "--force")
        self.assert_good(absenc("memory", "load", encoder, changed, "--yes", "--force"))
        self.assert_good(absenc("memory", "verify", encoder, changed))

    def test_decode_and_encode(self):
        self.assertEqual(absenc("encode", "esl", "position").stdout.strip(), "08 75")
        fields = self.good_json("decode", "esl", "--request", REQUEST, "--hex", REPLY)["fields"]
        self.assertEqual((fields["singleturn"], fields["redundant_singleturn"]), (0xABCDEF, 0xABCDEF >> 15))
        self.assert_failed(absenc("decode", "esl", "--request", REQUEST, "--hex", WRONG_CHANNEL_2), "bad_checksum")

    def test_scan_finds_encoders_and_clash(self):
        line = self.encoder("--also", "address=3&singleturn=5", "--also", "address=6&singleturn=0x5555", "--also",
                            "address=6&singleturn=0xAAAA", latency=60)
        found = self.good_json("scan", line)["encoders"]
        self.assertEqual([(one["encoder_address"], one["clash"]) for one in found], [(0, False), (3, False), (6, True)])
        self.assertEqual((found[1]["singleturn"], found[1]["ch1_status"]), (5, ["ready"]))
        self.assertEqual(self.good_json("run", line, "scan")["encoders"][1], found[1])
        result = absenc("scan", line)
        self.assert_good(result)
        self.assertRegex(result.stdout, r"(?m)^6 +yes +-")
        self.assert_sentence(result.stderr, "two encoders share the address")

    def test_scan_finds_encoder_that_refuses(self):
        """Scan must not report that two encoders share an address if one refuses requests."""
        encoder = self.encoder("--condition", "ch1_status_set=1")
        result = absenc("scan", encoder, "--json")
        self.assertEqual(result.returncode, 1)
        found = json.loads(result.stdout)["encoders"]
        self.assertEqual([(one["encoder_address"], one["clash"]) for one in found], [(0, False)])
        self.assertIn("wrong parity bit", found[0]["trouble"])
        text = absenc("scan", encoder)
        self.assertIn("wrong parity bit", text.stdout)
        self.assertNotIn("share the address", text.stderr)
        verdict = absenc("doctor", encoder)
        self.assertIn("refused: ", verdict.stdout)
        self.assertNotIn("disconnect one", verdict.stdout)

    def test_scan_without_encoder(self):
        encoder = self.encoder(latency=20, more="&crc_bit_order=msb")
        self.assert_failed(absenc("scan", encoder), "timeout")
        self.assert_wrong_usage(absenc("scan", "sim:tformat"), "one encoder")


class DecodeReasons(EslCase):
    """`decode` must give the reason for a bad reply, for single frames and for captures."""
    ONE = bytes.fromhex("084000efcdab34125646b3")
    TWO = bytes.fromhex("086000abd6cd84")

    def test_reasons_equal_those_of_host(self):
        damaged = bytes([*self.ONE[:5], self.ONE[5] ^ 1, *self.ONE[6:]])
        for reply, words in ((self.TWO + self.ONE, "the channels are swapped"),
                             (self.ONE, "channel 2 is missing"),
                             (damaged + self.TWO, "the CRC of channel 1 is wrong, channel 2 is good"),
                             (self.ONE + bytes([*self.TWO[:-1], 0]), "the CRC of channel 2 is wrong, channel 1 is good")):
            with self.subTest(words):
                result = absenc("decode", "esl", "--hex", reply.hex())
                self.assertEqual(result.returncode, 1)
                self.assertIn(words, result.stderr)
                request = absenc("encode", "esl", "position").stdout.strip()
                good = f"{request}\n{(self.ONE + self.TWO).hex()}\n"
                capture = self.file("reasons.txt", good + f"{request}\n{reply.hex()}\n")
                lines = json_lines(absenc("decode", "esl", capture, "--json").stdout)
                self.assertIn(words, " ".join(line.get("message", "") for line in lines))

    def test_reports_stuck_counter(self):
        request = absenc("encode", "esl", "position").stdout.strip()
        reply = (self.ONE + self.TWO).hex()
        capture = self.file("still.txt", f"{request}\n{reply}\n" * 2)
        first, second = json_lines(absenc("decode", "esl", capture, "--json").stdout)
        self.assertTrue(first["ok"])
        self.assertEqual((second["ok"], second["error"]), (False, "sequence_mismatch"))

    def test_reports_refusal(self):
        """The CRC of the request is right, but the reply's status reports a refusal."""
        good = absenc("encode", "esl", "position").stdout.strip()
        field = control_field(POSITION) ^ 0x80
        refused = bytes([field]) + crc8([field])
        one = bytes([field, READY | 1, 0, 0xEF, 0xCD, 0xAB, 0x34, 0x12, 0x56])
        two = bytes([field, READY | CHANNEL_2 | 1, 0, 0xAB, 0x80 | 0x56])
        answer = one + crc16(one, 0x0000) + two + crc16(two, 0xFFFF)
        self.assert_failed(absenc("decode", "esl", "--request", refused.hex(), "--hex", answer.hex()),
                           "request_rejected", "wrong parity bit")
        wave = Wave(D0=1)
        for asked, result in ((bytes.fromhex(good), self.ONE + self.TWO), (refused, answer)):
            wave.send("D0", asked, 100)
            wave.wait(2000)
            wave.send("D0", result, 100)
            wave.wait(10_000)
        lines = json_lines(absenc("decode", "esl", self.file("refused.vcd", wave.vcd()), "--json").stdout)
        self.assertEqual([(one["kind"], one["ok"]) for one in lines], [("exchange", True), ("exchange", False)])
        self.assertEqual(lines[1]["error"], "request_rejected")
        self.assertIn("wrong parity bit", lines[1]["message"])

    def test_probe_names_contradiction(self):
        result = absenc("probe", "esl", "--request", "0858", "--hex", (self.ONE + self.TWO).hex())
        self.assertEqual(result.returncode, 1)
        self.assertNotIn("number of bytes", result.stdout + result.stderr)
        self.assertIn("would not have answered", result.stderr)


class Probe(EslCase):
    def test_probes_one_reply(self):
        result = absenc("probe", "esl", "--request", MSB_REQUEST, "--hex", MSB_REPLY)
        self.assert_good(result)
        self.assertRegex(result.stdout, r"(?m)^crc_bit_order +lsb +no +frame 1: ")
        self.assertRegex(result.stdout, r"(?m)^ +msb +possible +only this value explains all frames$")
        self.assertIn("go on with: --option crc_bit_order=msb ", result.stdout)

    def test_reported_options_decode_frames(self):
        client = self.client("--option", "crc16_byte_order=high", "--option", "sequence_step=safety")
        frames = []
        for data_id in [POSITION, TEMPERATURE, POSITION]:
            request = bytes([control_field(data_id)])
            frames += ["--request", (request + crc8(request)).hex(), "--hex", client.exchange(data_id).hex()]
        answer = self.good_json("probe", "esl", *frames)
        self.assertIn("crc16_byte_order=high", answer["settled"])
        excluded = {(one["option"], one["value"]): one["frame"] for one in answer["evidence"] if not one["possible"]}
        self.assertEqual(excluded[("crc16_byte_order", "low")], 1)
        self.assertEqual(excluded[("sequence_step", "request")], 3)
        settings = [part for setting in answer["settled"] for part in ("--option", setting)]
        self.assert_good(absenc("decode", "esl", *frames[:4], *settings))
        self.assertEqual(absenc("decode", "esl", *frames[:4]).returncode, 1)

    def test_reports_damaged_and_missing_frames(self):
        self.assert_failed(absenc("probe", "esl", "--hex", REPLY[:-2]), "whatever the options, frame 1")
        self.assert_failed(absenc("probe", "esl", "--hex", MSB_REPLY, "--hex", REPLY), "no options explain all frames")
        self.assert_wrong_usage(absenc("probe", "esl"), "--hex")
        self.assert_wrong_usage(absenc("probe", "esl", "--hex", REPLY, "--request", "08", "--request", "08"),
                                "2 --request for 1 --hex")
        self.assert_wrong_usage(absenc("probe", "tformat", "--hex", "1A"), "leave nothing open")
        self.assert_good(absenc("probe", "esl", "--request", "", "--hex", REPLY))


class ErrorMessages(EslCase):
    """Tests the error messages about bad replies of an encoder."""

    def fake(self, *replies):
        fake = FakeEncoder({reply[0]: reply for reply in replies})
        fake.__enter__()
        self.addCleanup(fake.__exit__)
        return f"esl:{fake.path}?latency=50&echo=off"

    def assert_message(self, reply, *words, options=""):
        self.assert_failed(absenc("read", self.fake(reply) + options), *words)

    def test_bad_replies(self):
        good = bytes.fromhex(REPLY)
        self.assert_message(bytes.fromhex(WRONG_CHANNEL_2), "bad_checksum", "channel 2")
        self.assert_message(good[:5] + bytes([good[5] ^ 1]) + good[6:], "bad_checksum", "channel 1")
        self.assert_message(good[:11], "wrong_length", "channel 2")

    def test_reply_of_other_address(self):
        other = bytes.fromhex(REPLY)
        fake = FakeEncoder({control_field(POSITION, 1): other})
        with fake:
            self.assert_failed(absenc("read", f"esl:{fake.path}?latency=50&echo=off&address=1"), "unexpected_reply",
                               "address")

    def test_names_option_of_other_profile(self):
        encoder = self.encoder("--option", "crc16_byte_order=high")
        self.assert_failed(absenc("read", encoder), "bad_checksum", "crc16_byte_order=high")
        self.assert_good(absenc("read", f"{encoder}&crc16_byte_order=high"))

    def test_repeated_counter(self):
        """The replies to IDs 1 and 2 are valid, each alone, but have the same sequence counter."""
        one = bytes([control_field(0x2), READY, 0, 0xEF, 0xCD, 0xAB, 0x56])
        two = bytes([control_field(0x2), READY | CHANNEL_2, 0, 0xAB, 0x80 | 0x56])
        singleturn = one + crc16(one, 0x0000) + two + crc16(two, 0xFFFF)
        encoder = self.fake(bytes.fromhex(REPLY), singleturn)
        self.assert_good(absenc("read", encoder))
        self.assert_failed(absenc("run", encoder, "safe-position"), "sequence_mismatch", "stands still")

    def test_memory_that_stays_busy(self):
        page = bytes([control_field(WRITE), 0xFE, 0])
        busy = bytes([control_field(READ), 1, 0])
        encoder = self.fake(page + crc8(page), busy + crc8(busy))
        self.assert_failed(absenc("memory", "read", encoder, "0"), "busy", "not executed")


class SafePositions(EslCase):
    """Tests of consecutive safe positions, each of which is compared with the previous one."""

    def test_read(self):
        lines = json_lines(absenc("read", "sim:esl?singleturn=5&multiturn=3", "--command", "safe-position", "--count", "20",
                                  "--rate", "0", "--json").stdout)
        self.assertEqual([one["singleturn"] for one in lines], [5] * 20)
        self.assertTrue(all(one["singleturn_valid"] for one in lines))
        # the reply to safe-position has no turns
        self.assertTrue(all("multiturn" not in one for one in lines), lines[0])

    def test_stuck_counter_is_an_error_each_time(self):
        encoder = "sim:esl?condition=ch1_sequence=5&condition=ch2_sequence=5&command=safe-position"
        result = absenc("read", encoder, "--count", "3", "--json")
        self.assertEqual(result.returncode, 1)
        self.assertEqual([one["error"] for one in json_lines(result.stdout)], ["sequence_mismatch"] * 3)
        self.assert_good(absenc("read", "sim:esl?condition=ch1_sequence=5&condition=ch2_sequence=5"))

    def test_monitor_and_record(self):
        live = self.watch("sim:esl?singleturn=77", "--command", "safe-position", until=len)
        self.assertEqual(live["sim:esl?singleturn=77"]["singleturn"], 77)
        path = self.file("safe.jsonl")
        self.assert_good(absenc("record", "sim:esl?singleturn=77", "--command", "safe-position", "--output", path,
                                "--rate", "0", "--count", "30"))
        with open(path, encoding="utf-8") as file:
            rows = json_lines(file.read())
        self.assertEqual([row["singleturn"] for row in rows if "singleturn" in row], [77] * 30)

    def test_two_encoders_on_one_line(self):
        """Requests to another encoder on the line must not break the sequence of safe positions."""
        line = self.encoder("--also", "address=3&singleturn=70000", latency=300)
        live = self.watch(line, f"{line}&address=3", "--command", "safe-position", until=lambda live: len(live) == 2)
        self.assertEqual(sorted(one["singleturn"] for one in live.values()), [0, 70000])
        result = absenc("monitor", line, f"{line}&address=3", "--command", "safe-position", "--for", "2", "--json")
        self.assertEqual([one["errors"] for one in json_lines(result.stdout)][-2:], [{}, {}])

    def test_refuses_commands_that_cannot_be_repeated(self):
        self.assert_wrong_usage(absenc("read", "sim:esl?command=zero"), "changes the encoder")
        self.assert_wrong_usage(absenc("monitor", "sim:esl", "--command", "memory-read"), "takes arguments")
        self.assert_wrong_usage(absenc("read", "sim:esl?command=safe-positon"), "safe-position")
        self.assert_failed(absenc("read", "sim:esl?command=temperature"), "temperature yields no position")


class SingleTurn(EslCase):
    def test_has_no_turns(self):
        reading = self.good_json("read", "sim:esl?model=single-turn&singleturn=1000")
        self.assertEqual((reading["singleturn"], "multiturn" in reading), (1000, False))
        info = self.good_json("info", "sim:esl?model=single-turn")
        self.assertEqual(info["answers"]["encoder-id"]["fields"]["encoder_id"], 0x98)
        self.assert_failed(absenc("reset-multiturn", "sim:esl?model=single-turn", "--yes"), "unsupported", "one turn")

    def test_reports_encoder_id_that_contradicts_options(self):
        encoder = self.encoder("--model", "single-turn")
        self.assert_failed(absenc("run", encoder, "encoder-id"), "unexpected_reply", "no turns", "model")
        self.assert_good(absenc("run", f"{encoder}&model=single-turn", "encoder-id"))


class Doctor(EslCase):
    """Tests that doctor reports the flags of a reply in the finding that they belong to."""

    def verdict(self, settings, *words):
        result = absenc("doctor", f"sim:esl?{settings}")
        self.assertEqual(result.returncode, 1, result.stdout)
        for word in words:
            self.assertIn(word, result.stdout)
        self.assertNotIn("good: ", result.stdout)

    def test_channels_that_disagree(self):
        self.verdict("condition=redundant_offset=3", "contradictory: ", "redundant position of channel 2")
        self.verdict("condition=ch2_sequence=5", "contradictory: ", "sequence counters of the two channels")

    def test_status_bits(self):
        self.verdict("condition=ch2_status_set=4", "status: ", "safety_error in ch2_status alone")
        self.verdict("condition=temperature=120", "status: ", "temperature_warning")
        self.verdict("alarm=singleturn_error", "alarm: ", "singleturn_error")
        result = absenc("doctor", "sim:esl?alarm=singleturn_error", "--json")
        # Doctor reports the alarm alone, because the status flag safety_error only summarizes it.
        self.assertEqual(len(json.loads(result.stdout)["findings"]), 1)

    def test_repeated_replies_are_not_late(self):
        self.verdict("fault=repeat=1", "two_answer: ")


class TwoChannels(EslCase):
    """Tests that flags which only one channel reports are shown."""

    NONE = {"ch1_status": ["ready"], "ch1_alarms": [], "ch2_status": ["channel_2", "ready"], "ch2_alarms": [],
            "alarms": []}

    def fake(self, status_2=READY | CHANNEL_2, alarms_2=0):
        """Returns the address of a fake encoder whose channel 2 alone has the given flags."""
        replies = {}
        for data_id, turns in ((POSITION, b"\x34\x12"), (0x2, b"")):
            field = control_field(data_id)
            one = bytes([field, READY, 0, 0xEF, 0xCD, 0xAB]) + turns + bytes([0x56])
            two = bytes([field, status_2, alarms_2, 0xAB, 0x80 | 0x56])
            replies[field] = one + crc16(one, 0x0000) + two + crc16(two, 0xFFFF)
        fake = FakeEncoder(replies)
        fake.__enter__()
        self.addCleanup(fake.__exit__)
        return f"esl:{fake.path}?latency=200&echo=off"

    def flags_of(self, reading):
        return {name: reading[name] for name in self.NONE}

    def test_alarm_of_channel_2(self):
        encoder = self.fake(alarms_2=0x20)
        wanted = dict(self.NONE, ch2_alarms=["singleturn_error"], alarms=["singleturn_error"])
        reading = self.good_json("read", encoder)
        self.assertEqual(self.flags_of(reading), wanted)
        self.assertFalse(reading["singleturn_valid"])
        # `info` fails for all other requests, because the fake encoder answers only `position`
        info = json.loads(absenc("info", encoder, "--json").stdout)
        self.assertEqual(self.flags_of(info["answers"]["position"]), wanted)
        text = absenc("read", encoder).stdout
        self.assertIn("no ch1_alarms", text)
        self.assertIn("ch2_alarms: singleturn_error", text)
        alarms = self.good_json("alarms", encoder)
        self.assertEqual((alarms["ch1_alarms"], [one["name"] for one in alarms["ch2_alarms"]]), ([], ["singleturn_error"]))
        self.assertRegex(absenc("alarms", encoder).stdout, r"no ch1_alarms\nch2_alarms:\n +singleturn_error: .*stop the drive")

    def test_status_of_channel_2(self):
        encoder = self.fake(status_2=CHANNEL_2 | 0x04)
        reading = self.good_json("read", encoder)
        self.assertEqual(self.flags_of(reading), dict(self.NONE, ch2_status=["safety_error", "channel_2"]))
        self.assertFalse(reading["singleturn_valid"])
        self.assertIn("ch2_status: safety_error channel_2", absenc("read", encoder).stdout)
        self.assertRegex(absenc("alarms", encoder).stdout, r"no ch1_alarms\nno ch2_alarms\n(.*\n)*ch2_status:\n +safety_error:")

    def test_csv_and_recordings(self):
        encoder = self.fake(alarms_2=0x20)
        names, row = absenc("read", encoder, "--csv").stdout.splitlines()
        values = dict(zip(names.split(","), row.split(",")))
        self.assertEqual((values["ch1_alarms"], values["ch2_alarms"]), ("none", "singleturn_error"))
        self.assertEqual((values["ch1_status"], values["ch2_status"]), ("ready", "channel_2 ready"))
        for path in (self.file("log.csv"), self.file("log.jsonl")):
            self.assert_good(absenc("record", encoder, "--output", path, "--rate", "5", "--for", "1"))
            with open(path, encoding="utf-8") as file:
                lines = [line.rstrip("\n") for line in file if not line.startswith("#")]
            if path.endswith("csv"):
                last = dict(zip(lines[0].split(","), lines[-1].split(",")))
                self.assertEqual((last["ch1_alarms"], last["ch2_alarms"]), ("none", "singleturn_error"))
                self.assertEqual(len(lines[0].split(",")), len(lines[-1].split(",")))
            else:
                self.assertEqual(json.loads(lines[-2])["ch2_alarms"], ["singleturn_error"])

    def test_monitor(self):
        encoder = self.fake(alarms_2=0x20)
        result = absenc("monitor", encoder, "--for", "2", "--interval", "0.5", "--json")
        self.assertEqual(self.flags_of(json_lines(result.stdout)[-1]["reading"]),
                         dict(self.NONE, ch2_alarms=["singleturn_error"], alarms=["singleturn_error"]))


class SharedLine(EslCase):
    def lines(self, *arguments, seconds=2):
        result = absenc("monitor", *arguments, "--for", str(seconds), "--interval", "0.5", "--json")
        last = {line["encoder"]: line for line in json_lines(result.stdout)}
        return result, [last[name] for name in arguments if name in last]

    def test_monitor_reads_encoders_in_turn(self):
        line = self.encoder("--also", "address=3&singleturn=70000", "--also", "address=6&singleturn=0x5555", "--also",
                            "address=6&singleturn=0xAAAA", latency=50)
        names = [line, f"{line}&address=3", f"{line}&address=6", f"{line}&address=7"]
        result, last = self.lines(*names, "--rate", "0", seconds=6)
        # The readings of two of the four encoders failed, so the exit status is 1.
        self.assertEqual(result.returncode, 1)
        self.assertEqual([one["state"] for one in last], ["live", "live", "failing", "failing"])
        self.assertEqual([one["reading"]["singleturn"] for one in last[:2]], [0, 70000])
        self.assertEqual([one["errors"] for one in last[:2]], [{}, {}])
        self.assertEqual(set(last[3]["errors"]), {"timeout"})
        least, most = sorted(one["readings"] for one in last[:2])
        # the number of readings is small, because the timeouts of the other encoders on the line take most of the
        # time
        self.assertGreater(least, 10)
        # the two encoders that answer are read about equally often; the limit is wide, because a busy computer may
        # delay the thread of one of them
        self.assertLess(most, 5 * least)

    def test_names_of_one_bus(self):
        path = self.emulator("--also", "address=3&singleturn=70000").path
        config = self.file("absenc.toml", f"""
            [bus.arm]
            port = "{path}"
            latency = 300
            [encoder.shoulder]
            protocol = "esl"
            bus = "arm"
            [encoder.elbow]
            protocol = "esl"
            bus = "arm"
            address = 3
            """)
        live = self.watch("shoulder", "elbow", until=lambda live: len(live) == 2, env=dict(os.environ, ABSENC_CONFIG=config))
        self.assertEqual([live[name]["singleturn"] for name in ("shoulder", "elbow")], [0, 70000])

    def test_memory_is_refused_on_shared_line(self):
        """An encoder that knows of others on its line does not answer memory requests."""
        emulator = self.emulator("--also", "address=3")
        encoder = f"esl:{emulator.path}?latency=20"
        self.assert_failed(absenc("memory", "read", encoder, "0"), "timeout", "others share its line")
        config = self.file("absenc.toml", f"""
            [bus.arm]
            port = "{emulator.path}"
            latency = 20
            [encoder.shoulder]
            protocol = "esl"
            bus = "arm"
            [encoder.elbow]
            protocol = "esl"
            bus = "arm"
            address = 3
            [bus.leg]
            port = "sim"
            [encoder.knee]
            protocol = "esl"
            bus = "leg"
            """)
        env = dict(os.environ, ABSENC_CONFIG=config)
        for command in (["memory", "read", "elbow", "0"], ["memory", "write", "elbow", "0", "1", "--yes"]):
            self.assert_failed(absenc(*command, env=env), "unsupported", "several encoders on the line", "nothing was sent")
        result = json.loads(absenc("run", "elbow", "led-or-lissajous", "--json", env=env).stdout)["fields"]
        # These flags were read from the field SF of a reply, not from memory.
        self.assertEqual((result["led_error"], result["lissajous_error"]), (False, False))
        self.assert_good(absenc("memory", "read", "knee", "0", env=env))
        self.assert_failed(absenc("memory", "read", "elbow?bus=false", "0", env=env), "timeout")
        summary = emulator.end()[2]
        self.assertIn("memory access with several encoders on the line", summary)

    def test_refuses_encoders_that_cannot_share_a_line(self):
        self.assert_wrong_usage(absenc("monitor", "esl:/dev/x", "esl:/dev/x?address=1&baud=115200"), "/dev/x", "baud")
        self.assert_wrong_usage(absenc("monitor", "esl:/dev/x", "tformat:/dev/x"), "one line", "baud")
        self.assert_wrong_usage(absenc("monitor", "esl:/dev/x?address=1", "esl:/dev/x?address=1"), "the same encoder")
        self.assert_wrong_usage(absenc("emulate", "esl", "--also", "adress=1"), "adress", "address")
        self.assert_wrong_usage(absenc("emulate", "esl", "--also", "address=1", "--memory", "x"), "--memory")

    def test_reports_loss_and_return_of_all(self):
        first = self.emulator("--also", "address=3")
        names = [f"esl:{first.path}?latency=300&address={address}" for address in (0, 3)]
        monitor = self.start("monitor", *names, "--json", "--interval", "0.1")
        wanted = ["live", "gone", "live"]
        seen = {name: 0 for name in names}
        deadline = time.monotonic() + PATIENCE
        while any(count < len(wanted) for count in seen.values()):
            self.assertLess(time.monotonic(), deadline)
            line = json.loads(self.first_line(monitor))
            name = line["encoder"]
            state = "gone" if line["state"] in ("lost", "opening") else line["state"]
            if seen[name] < len(wanted) and state == wanted[seen[name]]:
                seen[name] += 1
            if first.process.poll() is None and all(count == 1 for count in seen.values()):
                first.end()
            if first.process.poll() is not None and all(count == 2 for count in seen.values()):
                first = self.emulator("--also", "address=3")
        self.assertEqual(line["losses"], 1)


if __name__ == "__main__":
    unittest.main()
