#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests `tap` on a line between a host and an emulator. `--all` reads more positions."""
import collections
import os
import re
import subprocess
import sys
import time
import unittest
import unittest.mock

from command_support import ABSENC, PATIENCE, absenc, json_lines, read_line
from tap_support import Relay, TapCase, joined

ALL = "--all" in sys.argv
COUNT = 10_000 if ALL else 150


# Tested units, each with options of the emulator, options of the host, and the number of readings.
UNITS = {
    "tformat": ([], "latency=1000", COUNT), "esl": ([], "latency=1000", COUNT), "e201": ([], "latency=1000", COUNT),
    "raa38": (["--option", "mode=bus"], "latency=1000&mode=bus", COUNT),
    "raa38-modbus": ([], "latency=1000", COUNT),
    "encolink": ([], "latency=400", max(COUNT // 20, 10)), "amt21": ([], "latency=400", max(COUNT // 20, 10)),
}


class EveryExchange(TapCase):
    def test_of_our_host(self):
        for protocol, (emulated, read, count) in UNITS.items():
            with self.subTest(protocol):
                emulator = self.emulator(protocol, "--motion", "rpm=60", *emulated, name=f"e-{protocol}")
                with Relay(emulator.path) as relay:
                    self.compare(protocol, relay, emulated, read, count)
                emulator.end()

    def compare(self, protocol, relay, emulated, read, count):
        record = self.file(f"{protocol}.txt")
        tap = self.tap(relay.tap_path, protocol, *emulated, "--json", "--record", record)
        host = absenc("read", f"{protocol}:{relay.host_path}?{read}", "--json", "--rate", "0", "--count",
                      str(count), timeout=600)
        self.assert_good(host)
        readings = json_lines(host.stdout)
        self.assertEqual(len(readings), count)
        self.wait_for_all(tap, relay)
        status, text, messages = self.finish(tap)
        lines, summary = self.lines(text)
        # On a busy machine a reply may arrive after the host's timeout.
        repeated = [line for line in lines if line["kind"] == "request" and line.get("error") == "timeout"]
        exchanges = [line for line in lines if line["kind"] == "exchange"]
        # A reply that arrives more than half a second after its request is shown by tap without the request
        # (docs/tap.md).
        late = [line for before, line in zip(lines, lines[1:])
                if line["kind"] == "reply" and before in repeated and line["time_s"] - before["time_s"] >= 0.5]
        self.assertEqual([line for line in lines
                          if line not in repeated + late and not (line in exchanges and line["ok"])], [], messages)
        if count == COUNT:
            self.assertEqual(repeated + late, [], messages)
            self.assertEqual(status, 0, messages)
        # Each byte of the line must be in exactly one line of tap's output, in order.
        self.assertEqual(joined(lines), relay.copied.hex())
        self.assertEqual(bytes(relay.from_tap), b"")
        self.assertEqual(summary["exchanges"], len(exchanges))
        self.assertEqual(summary["bytes"], len(relay.copied))
        self.assertEqual(sum(kind["count"] for kind in summary["per_request"]), len(lines) - len(late))
        # Each position that the host read must be in tap's output, in the same order.
        key = "singleturn" if "singleturn" in readings[0] else "position"
        said = [line["fields"][key] for line in lines if key in line.get("fields", {})]
        wanted = [reading.get(key, reading.get("fields", {}).get(key)) for reading in readings]
        rest = iter(said)
        self.assertEqual([position for position in wanted if position not in rest], [], "in this order")
        decoded = absenc("decode", protocol, *emulated, record, "--json")
        again = [line for line in json_lines(decoded.stdout) if line["kind"] == "exchange"]
        keys = ("request", "reply", "ok")
        self.assertEqual([[line[key] for key in keys] for line in again], [[line[key] for key in keys] for line in exchanges])

    def test_of_mbpoll(self):
        emulator = self.emulator("raa38-modbus", "--singleturn", "383")
        relay = self.relay(emulator)
        tap = self.tap(relay.tap_path, "raa38-modbus", "--json")
        count = 20
        for _ in range(count):
            polled = subprocess.run(["mbpoll", "-m", "rtu", "-b", "19200", "-P", "none", "-0", "-1", "-o", "5", "-a", "1",
                                     "-t", "4", "-r", "0", "-c", "1", relay.host_path], capture_output=True, text=True,
                                    timeout=PATIENCE, stdin=subprocess.DEVNULL)
            self.assertEqual(re.findall(r"^\[0\]:\s+(\d+)", polled.stdout, re.MULTILINE), ["383"], polled.stderr)
        self.wait_for_all(tap, relay)
        status, text, messages = self.finish(tap)
        lines, _ = self.lines(text)
        self.assertEqual([(line["ok"], line["fields"]["singleturn"]) for line in lines], [(True, 383)] * count)
        self.assertEqual(joined(lines), relay.copied.hex())
        self.assertEqual(status, 0, messages)


class Damage(TapCase):
    def test_damaged_bytes(self):
        """tap must show intact exchanges as good and damaged ones as bad."""
        emulator = self.emulator("tformat", "--motion", "rpm=60")
        replies = collections.Counter()

        def change(data, from_host):
            if not from_host and len(data) == 11:
                replies["all"] += 1
                if replies["all"] % 20 == 10:
                    replies["damaged"] += 1
                    return data[:5] + bytes([data[5] ^ 0x10]) + data[6:]
            return data

        relay = self.relay(emulator, change=change)
        tap = self.tap(relay.tap_path, "tformat", "--json")
        absenc("read", f"tformat:{relay.host_path}?latency=1000", "--json", "--rate", "0", "--count", str(COUNT),
               timeout=600)
        self.wait_for(tap, lambda text: text.count('"ok": true') + text.count('"ok":true') >=
                      replies["all"] - replies["damaged"])
        status, text, messages = self.finish(tap)
        lines, summary = self.lines(text)
        good = [line for line in lines if line["ok"] and line["kind"] == "exchange"]
        self.assertEqual(len(good), replies["all"] - replies["damaged"], messages)
        self.assertEqual(summary["bad"], replies["damaged"])
        self.assertEqual(joined(lines), relay.copied.hex())
        self.assertEqual(status, 1)

    def test_starts_in_the_middle_of_a_frame(self):
        data = bytes.fromhex("1a1a204523011134120010" + "7a")
        process = subprocess.run([ABSENC, "tap", "-", "tformat", "--json"], input=data[7:] + data * 30, timeout=PATIENCE,
                                 capture_output=True)
        lines, _ = self.lines(process.stdout.decode())
        self.assertEqual([line["kind"] for line in lines if line["kind"] != "exchange"], ["noise"], lines[:3])
        self.assertEqual(sum(line["ok"] and line["kind"] == "exchange" for line in lines), 30)

    def test_no_reply(self):
        nobody, slave = os.openpty()
        for descriptor in (nobody, slave):
            self.addCleanup(os.close, descriptor)
        emulator = unittest.mock.Mock(path=os.ttyname(slave))
        relay = self.relay(emulator)
        tap = self.tap(relay.tap_path, "tformat", "--json")
        self.assertEqual(absenc("read", f"tformat:{relay.host_path}?latency=1200").returncode, 1)
        self.wait_for(tap, lambda text: text.count("unanswered") + text.count("no encoder answered") >= 2)
        status, text, messages = self.finish(tap)
        lines, _ = self.lines(text)
        self.assertIn("request", {line["kind"] for line in lines})
        self.assertFalse(any(line["ok"] and line["kind"] == "exchange" for line in lines), lines)
        self.assertIn("only requests came", messages)
        self.assertEqual(status, 1)


class DetectedProtocol(TapCase):
    def test_detects_protocol(self):
        for protocol in ("tformat", "esl", "raa38-modbus"):
            with self.subTest(protocol):
                emulator = self.emulator(protocol, "--motion", "rpm=60", name=f"e-{protocol}")
                with Relay(emulator.path) as relay:
                    tap = self.tap(relay.tap_path, "--json")
                    self.assert_good(absenc("read", f"{protocol}:{relay.host_path}?latency=1000", "--rate", "0", "--count",
                                            "60", timeout=600))
                    self.wait_for_all(tap, relay)
                    status, text, messages = self.finish(tap)
                    lines, _ = self.lines(text)
                    self.assertEqual({line["protocol"] for line in lines}, {protocol}, messages)
                    self.assertEqual(joined(lines), relay.copied.hex())
                    self.assertEqual(bytes(relay.from_tap), b"")
                    self.assertEqual(status, 0, messages)
                    self.assertIn(f"{protocol} explains what is said", messages)
                emulator.end()

    def test_reports_unknown_protocol(self):
        process = subprocess.run([ABSENC, "tap", "-"], input=bytes(range(256)) * 4, timeout=PATIENCE, capture_output=True)
        self.assertEqual((process.returncode, process.stdout), (1, b""))
        self.assertIn("1024 bytes came, but no protocol explains them", process.stderr.decode())


class Output(TapCase):
    EXCHANGE = bytes.fromhex("1a1a204523011134120010" + "7a")

    def run_tap(self, *arguments, data=EXCHANGE):
        return subprocess.run([ABSENC, "tap", "-", "tformat", *arguments], input=data, timeout=PATIENCE, capture_output=True,
                              check=False)

    def test_text_marks_and_rates(self):
        result = self.run_tap(data=self.EXCHANGE * 5)
        text = result.stdout.decode()
        self.assertRegex(text, r"(?m)^ +0\.\d{6}  ! 1A > 1A 20 45 23 01 11 34 12 00 10 7A .*alarms: ")
        self.assertRegex(text, r"(?m)^exchanges +5$")
        self.assertRegex(text, r"(?m)^position\S* +1A +5 ")
        self.assertNotIn("turn-around", text)
        self.assertEqual(result.returncode, 0, result.stderr)

    def test_exchange_is_shown_at_once(self):
        """tap must print every exchange, also the last one, while its input is still open."""
        with subprocess.Popen([ABSENC, "tap", "-", "tformat", "--json"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL, bufsize=0) as process:
            for _ in range(20):
                process.stdin.write(self.EXCHANGE)
            shown = 0
            while shown < 20:
                self.assertIsNotNone(read_line(process.stdout, time.monotonic() + PATIENCE), shown)
                shown += 1
            process.stdin.close()
            process.wait(PATIENCE)

    def test_csv_equals_decode(self):
        record = self.file("a.txt")
        tapped = self.run_tap("--csv", "--record", record).stdout.decode().splitlines()
        decoded = absenc("decode", "tformat", record, "--csv").stdout.splitlines()
        self.assertEqual(tapped[0], decoded[0])
        self.assertEqual(len(tapped), 2)

    def test_record_is_never_overwritten(self):
        path = self.file("there.txt", "mine\n")
        result = self.run_tap("--record", path)
        self.assertEqual(result.returncode, 1)
        self.assertIn("there.txt", result.stderr.decode())
        with open(path, encoding="utf-8") as file:
            self.assertEqual(file.read(), "mine\n")
        self.assertEqual(self.run_tap("--record", path, "--force").returncode, 0)
        self.assert_good(absenc("decode", "tformat", path))

    def test_refuses_wrong_usage(self):
        for arguments, words in ((["can-that-is-not-there", "raa38-can"], "candump"), (["-", "ssi"], "decode"),
                                 (["-", "tformat", "--json", "--csv"], "together"), (["-", "--model", "23-bit"], "protocol"),
                                 (["sim:tformat"], "virtual")):
            with self.subTest(arguments):
                self.assert_wrong_usage(absenc("tap", *arguments), words)

    def test_ends_after_given_time(self):
        emulator = self.emulator("tformat")
        result = absenc("tap", emulator.path, "tformat", "--for", "0.2")
        self.assert_failed_with(result, "nothing came")

    def assert_failed_with(self, result, words):
        self.assertEqual(result.returncode, 1)
        self.assertIn(words, result.stderr)


class OneDirection(TapCase):
    def test_replies_only(self):
        reply = Output.EXCHANGE[1:]
        result = subprocess.run([ABSENC, "tap", "-", "tformat", "--json"], input=reply * 40, timeout=PATIENCE,
                                capture_output=True)
        lines, _ = self.lines(result.stdout.decode())
        self.assertEqual({line["kind"] for line in lines}, {"reply"})
        self.assertIn("only replies came", result.stderr.decode())


if __name__ == "__main__":
    unittest.main(argv=[argument for argument in sys.argv if argument != "--all"])
