#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests RAA38S6 encoders on serial lines, virtual and fake ones."""
import csv
import io
import json
import re
import unittest

from command_support import BabblingLine, Emulator, EncoderCase, FakeEncoder, absenc, json_lines

FRAME = bytes.fromhex("ff81017f00")  # example frame of the manual (3.1.1): position 383, 14 bits


def frame(value, data_bytes=2, second=0x81):
    body = bytes([0xFF, second]) + value.to_bytes(data_bytes, "big")
    return body + bytes([sum(body) & 0xFF])


class RaaCase(EncoderCase):
    def emulator(self, *arguments):
        emulator = Emulator(self.directory, *arguments, protocol="raa38")
        self.addCleanup(emulator.end)
        return emulator

    def assert_trouble(self, result, error, *words):
        self.assert_failed(result, f"absenc: {error}: ", *words)
        self.assertIn("\n  Try: ", result.stderr)

    def read_fake(self, reply, options):
        """Returns the result of `read` with a fake encoder in bus mode that always sends `reply`."""
        with FakeEncoder({0xBC: reply}) as fake:
            return absenc("read", f"raa38:{fake.path}?mode=bus&latency=50{options}")


class Stream(RaaCase):
    def test_reads_consecutive_positions(self):
        path = self.emulator("--singleturn", "383", "--option", "refresh_hz=500").path
        result = absenc("read", f"raa38:{path}", "--count", "20", "--rate", "0", "--json")
        self.assert_good(result)
        for reading in json_lines(result.stdout):
            self.assertEqual((reading["singleturn"], reading["confirmed"]), (383, True))
            self.assertAlmostEqual(reading["angle_deg"], 360 * 383 / 2**14)

    def test_reads_as_fast_as_stream(self):
        emulator = self.emulator("--option", "refresh_hz=1000", "--motion", "rpm=60")
        result = absenc("bench", f"raa38:{emulator.path}", "--seconds", "2", "--json")
        self.assert_good(result)
        self.assertGreater(json.loads(result.stdout)["readings_per_s"], 900)

    def test_slow_reader_gets_newest_position(self):
        emulator = self.emulator("--option", "refresh_hz=200", "--motion", "rpm=60")
        result = absenc("read", f"raa38:{emulator.path}", "--count", "5", "--rate", "5", "--csv")
        self.assert_good(result)
        rows = list(csv.DictReader(io.StringIO(result.stdout)))
        for before, after in zip(rows, rows[1:]):
            seconds = float(after["time_s"]) - float(before["time_s"])
            turned = (float(after["angle_deg"]) - float(before["angle_deg"]) - 360 * seconds + 180) % 360 - 180
            self.assertLess(abs(turned), 36, "of a tenth of a second")

    def test_faults_are_counted_and_never_shown(self):
        emulator = self.emulator("--option", "refresh_hz=1000", "--singleturn", "383", "--fault", "corrupt=0.05",
                                 "--fault", "drop=0.05", "--fault", "garbage=0.05")
        result = absenc("monitor", f"raa38:{emulator.path}", "--rate", "0", "--for", "2", "--interval", "2", "--json")
        self.assert_good(result)
        self.assertRegex(result.stderr, r"[1-9][0-9]* failed \(.*bad_checksum")
        self.assertEqual({line["reading"]["singleturn"] for line in json_lines(result.stdout)}, {383})

    def test_dropped_frames_are_counted(self):
        result = absenc("read", "sim:raa38?fault=corrupt=0.3&refresh_hz=1000", "--rate", "0", "--count", "100")
        self.assert_good(result)
        dropped = int(re.search(r"(\d+) damaged frames of the stream were dropped", result.stderr).group(1))
        # About 43 damaged frames are expected per 100 good ones; a busy machine misses some of them.
        self.assertGreater(dropped, 15, result.stderr)
        result = absenc("read", "sim:raa38?refresh_hz=1000", "--rate", "0", "--count", "100")
        self.assertEqual((result.returncode, result.stderr), (0, ""))

    def test_record(self):
        emulator = self.emulator("--option", "refresh_hz=200", "--singleturn", "383")
        path = self.file("log.csv")
        self.assert_good(absenc("record", f"raa38:{emulator.path}", "--output", path, "--rate", "0", "--for", "3"))
        with open(path, encoding="utf-8") as file:
            rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
        self.assertGreater(len(rows), 100)  # an idle machine records about 600 rows in 3 s, a busy one fewer
        self.assertEqual({row["singleturn"] for row in rows if not row["event"]}, {"383"})

    def test_other_frame_sizes(self):
        for bits, value, size in ((10, 1023, 2), (17, 109517, 3), (21, 2097151, 3)):
            with self.subTest(bits=bits), BabblingLine(pieces=[frame(value, size)]) as fake:
                result = absenc("read", f"raa38:{fake.path}?bits={bits}", "--json")
                self.assert_good(result)
                self.assertEqual(json.loads(result.stdout)["singleturn"], value)

    def test_silent_line(self):
        with BabblingLine(pieces=[b""]) as fake:
            result = absenc("read", f"raa38:{fake.path}")
        self.assert_trouble(result, "timeout", "nothing comes", f"nothing came from {fake.path}", "mode=bus")

    def test_line_without_frames(self):
        with BabblingLine(pieces=[b"\x55\xAA\x00"]) as fake:
            result = absenc("read", f"raa38:{fake.path}")
        self.assert_trouble(result, "bad_framing", "no two frames in a row", "received 55 AA 00", "baud, parity")

    def test_position_with_more_bits_than_option(self):
        with BabblingLine(pieces=[frame(0x4001)]) as fake:
            result = absenc("read", f"raa38:{fake.path}")
        self.assert_trouble(result, "out_of_range", "more bits", "received FF 81 40 01", "set bits")

    def test_accepts_speed_limit(self):
        with BabblingLine(pieces=[FRAME]) as fake:
            self.assert_good(absenc("read", f"raa38:{fake.path}?max_rpm=100"))


class Bus(RaaCase):
    def bus(self):
        return self.emulator("--option", "mode=bus", "--option", "zeroing=command", "--singleturn", "383",
                             "--also", "unit=3&second_byte=echo&singleturn=77",
                             "--also", "unit=9", "--also", "unit=9&singleturn=99&second_byte=echo").path

    def test_each_unit_and_clash(self):
        path = self.bus()
        for unit, value in ((1, 383), (3, 77)):
            result = absenc("read", f"raa38:{path}?mode=bus&unit={unit}&latency=300", "--json")
            self.assert_good(result)
            self.assertEqual(json.loads(result.stdout)["singleturn"], value)
        result = absenc("read", f"raa38:{path}?mode=bus&unit=9")
        self.assert_trouble(result, "bad_checksum", "two encoders with one number", "sent BC AA B9", "scan")
        result = absenc("read", f"raa38:{path}?mode=bus&unit=4")
        self.assert_trouble(result, "timeout", "did not answer", "sent BC AA B4", "nothing came back", "scan")

    def test_scan(self):
        result = absenc("scan", f"raa38:{self.bus()}?latency=100", "--json")
        self.assert_good(result)
        found = {one["encoder_address"]: (one["clash"], one.get("singleturn"))
                 for one in json.loads(result.stdout)["encoders"]}
        self.assertEqual(found, {1: (False, 383), 3: (False, 77), 9: (True, None)})

    def test_scan_reports_stream(self):
        result = absenc("scan", f"raa38:{self.emulator().path}")
        self.assert_trouble(result, "unexpected_reply", "although nobody asks", "mode=timing")

    def test_scan_without_reply(self):
        with FakeEncoder({0xBC: b""}) as fake:
            result = absenc("scan", f"raa38:{fake.path}?latency=10")
        self.assert_trouble(result, "timeout", "no number from 0 to F")

    def test_zero_needs_consent_and_is_read_back(self):
        path = self.bus()
        address = f"raa38:{path}?mode=bus&unit=3&zeroing=command&latency=300"
        refused = absenc("zero", address)
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("--yes", refused.stderr)
        result = absenc("zero", address, "--yes", "--json")
        self.assert_good(result)
        fields = json.loads(result.stdout)["fields"]
        self.assertEqual((fields["before"], fields["singleturn"]), (77, 0))

    def test_reports_zero_without_effect(self):
        result = absenc("zero", f"raa38:{self.bus()}?mode=bus&zeroing=command&zero_unit=12&latency=100", "--yes")
        self.assert_trouble(result, "cross_check_failed", "not zero after the zero was set", "zero_unit")

    def test_zero_survives_restart(self):
        memory = self.file("memory")
        options = ("--option", "mode=bus", "--option", "zeroing=command", "--singleturn", "383", "--memory", memory)
        address = "raa38:{}?mode=bus&zeroing=command&latency=300"
        emulator = Emulator(self.directory, *options, protocol="raa38")
        self.assert_good(absenc("zero", address.format(emulator.path), "--yes"))
        self.assertEqual(emulator.end()[0], 0)
        result = absenc("read", address.format(self.emulator(*options).path), "--json")
        self.assertEqual(json.loads(result.stdout)["singleturn"], 0)

    def test_bad_replies(self):
        for reply, options, error, *words in (
                (FRAME[:4], "", "wrong_length", "received FF 81 01 7F", "check bits"),
                (FRAME[:4] + b"\x01", "", "bad_checksum", "two encoders", "termination"),
                (frame(383, second=0xB2), "", "unexpected_reply", "another unit", "`absenc scan`"),
                (FRAME, "&second_byte=echo", "unexpected_reply", "another unit", "second_byte"),
                (frame(383, second=0xB1), "&second_byte=81", "unexpected_reply", "second_byte"),
                (bytes.fromhex("fe81017fff"), "", "unexpected_reply", "no frame came"),
                (frame(0x4000), "", "out_of_range", "more bits", "set bits"),
                (frame(383, 3), "", "wrong_length", "another number of bytes", "check bits")):
            with self.subTest(reply=reply.hex(), options=options):
                self.assert_trouble(self.read_fake(reply, options), error, "sent BC AA B1", *words)

    def test_accepts_both_forms_of_second_byte(self):
        for second in (0x81, 0xB1):
            result = self.read_fake(frame(383, second=second), "")
            self.assert_good(result)
            self.assertIn("383 counts", result.stdout)


class Settings(RaaCase):
    def test_port_needs_baud_rate(self):
        result = absenc("read", "raa38:/dev/absenc-no-such-port")
        self.assert_wrong_usage(result, "states no baud rate", '"raa38:/dev/absenc-no-such-port?baud=9600"')
        self.assert_failed(absenc("read", "raa38:/dev/absenc-no-such-port?baud=9600"), "there is no port")
        self.assertIsNone(json.loads(absenc("list", "raa38", "--json").stdout)["line"]["rate"])

    def test_handshake_needs_trigger_wire(self):
        for place, *words in ((self.emulator().path, "trigger=rts", "trigger=gpio:NAME"),
                              ("tcp:127.0.0.1:1", "TCP does not carry")):
            self.assert_wrong_usage(absenc("read", f"raa38:{place}?mode=handshake"), "a pulse asks raa38", *words)

    def test_refuses_wrong_wires(self):
        path = self.emulator().path
        for setting, *words in (("trigger=cts", "rts, dtr or gpio:NAME"), ("clear=gpio:", "gpioinfo"),
                                ("trigger_us=0", "from 1 to"), ("clear_active=no", "must be low or high"),
                                ("parity=mark", "must be none, odd or even")):
            self.assert_wrong_usage(absenc("read", f"raa38:{path}?{setting}"), *words)
        self.assert_failed(absenc("read", f"raa38:{path}?mode=handshake&trigger=rts"), "has no RTS line")
        self.assert_failed(absenc("read", f"raa38:{path}?mode=handshake&trigger=gpio:absenc-no-such-line"), "GPIO line")
        self.assert_failed(absenc("zero", f"raa38:{path}?zeroing=line", "--yes"), "nothing says which wire", "clear=dtr")
        self.assert_wrong_usage(absenc("read", "sim:raa38?mode=handshake&trigger=rts"), "cannot be set here")

    def test_emulate_has_no_pulses(self):
        result = absenc("emulate", "raa38", "--option", "mode=handshake", "--option", "bits=17")
        self.assert_wrong_usage(result, "neither a pseudo-terminal nor TCP carries", "sim:raa38?mode=handshake&bits=17")
        result = absenc("emulate", "raa38", "--option", "zeroing=line", "--for", "0.1")
        self.assert_good(result)
        self.assertIn("sets the zero: sim:raa38 does", result.stderr)

    def test_refuses_zero_without_zeroing_option(self):
        result = absenc("zero", "sim:raa38", "--yes")
        self.assert_trouble(result, "unsupported", "nothing is known", "zeroing=line")
        result = absenc("zero", "sim:raa38?zeroing=command", "--yes")
        self.assert_trouble(result, "invalid_argument", "command of a bus", "mode=bus")

    def test_parity_and_baud_rate(self):
        path = self.emulator().path
        for settings in ("parity=even", "parity=odd&baud=9600"):
            result = absenc("read", f"raa38:{path}?{settings}")
            self.assert_good(result)
        self.assert_good(absenc("read", "sim:raa38?parity=even"))

    def test_waits_for_slow_acquisition(self):
        for mode in ("handshake", "bus"):
            for t3 in (20_000, 400_000):
                result = absenc("read", f"sim:raa38?mode={mode}&acquisition_us={t3}&singleturn=383", "--json")
                self.assert_good(result)
                self.assertEqual(json.loads(result.stdout)["singleturn"], 383)

    def test_handshake_in_virtual_time(self):
        result = absenc("read", "sim:raa38?mode=handshake&acquisition_us=500&singleturn=383", "--count", "3", "--json")
        self.assert_good(result)
        self.assertEqual({line["singleturn"] for line in json_lines(result.stdout)}, {383})
        self.assert_good(absenc("zero", "sim:raa38?mode=handshake&zeroing=line&singleturn=383", "--yes"))


class Frames(RaaCase):
    def test_decode(self):
        for request, reply, options, wanted in (
                ("", "ff81017f00", ("bits=14",), {"singleturn": 383, "second_byte": 129}),
                ("bcaab2", "ffb2017f31", ("bits=14",), {"singleturn": 383, "second_byte": 178}),
                ("bcaac1", "", (), {"command": "zero_clear", "unit": 1}),
                ("bcaabf", "", (), {"command": "read", "unit": 15})):
            arguments = [part for option in options for part in ("--option", option)]
            arguments += ["--hex", reply] if reply else []
            arguments += ["--request", request] if request else []
            result = absenc("decode", "raa38", "--json", *arguments)
            self.assert_good(result)
            fields = json.loads(result.stdout)["fields"]
            self.assertEqual({name: fields[name] for name in wanted}, wanted)

    def test_decode_infers_bus_mode_from_request(self):
        for mode in ("timing", "bus"):
            other = absenc("decode", "raa38", "--request", "bcaab1", "--hex", "ffb2017f31", "--option", f"mode={mode}")
            self.assert_failed(other, "unexpected_reply", "another unit answered", "`absenc scan` shows who answers")
            clash = absenc("decode", "raa38", "--request", "bcaab1", "--hex", "ffb1017f31", "--option", f"mode={mode}")
            self.assert_failed(clash, "bad_checksum", "two encoders with one number")
        self.assert_failed(absenc("decode", "raa38", "--hex", "fe81017fff"), "unexpected_reply", "it is no frame")

    def test_encode(self):
        result = absenc("encode", "raa38", "position", "--option", "mode=bus", "--option", "unit=10")
        self.assertEqual(result.stdout.strip(), "BC AA BA")
        result = absenc("encode", "raa38", "zero", "--option", "zero_unit=12")
        self.assertEqual(result.stdout.strip(), "BC AA CC")
        self.assertNotEqual(absenc("encode", "raa38", "position").returncode, 0)

    def test_probe(self):
        result = absenc("probe", "raa38", "--hex", frame(0x8001).hex(), "--hex", frame(5).hex(), "--json")
        self.assert_good(result)
        result = absenc("probe", "raa38", "--hex", frame(0x8001).hex(), "--hex", frame(5).hex())
        self.assertRegex(result.stdout, r"15 +no +frame 1: its position has more bits")
        self.assertRegex(result.stdout, r"17 +no +frame 1: it has another number of data bytes")
        self.assertRegex(result.stdout, r"echo +no +frame 1: its second byte is not the number")


if __name__ == "__main__":
    unittest.main()
