#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests the output of `absenc conform` and `absenc conform-host`."""
import json
import select
import signal
import time
import tty
import unittest
import xml.etree.ElementTree

from command_support import PATIENCE, EncoderCase, absenc, end, json_lines, read_line


def content(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


class Conform(EncoderCase):
    def test_virtual_encoder_keeps_all_clauses(self):
        result = absenc("conform", "sim:tformat", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        answer = json.loads(result.stdout)
        self.assertEqual((answer["ok"], answer["protocol"], answer["left"]), (True, "tformat", []))
        for clause in answer["clauses"]:
            # The clause bad-delimiter is not tested on this kind of port: for a bad delimiter the port changes its baud
            # rate, and the reply arrives before the port is back at the usual rate.
            expected = "untested" if clause["id"] == "bad-delimiter" else "kept"
            self.assertEqual(clause["verdict"], expected, clause)
            self.assertTrue(clause["document"] and clause["paragraph"] and clause["evidence"], clause)

    def test_tap_and_junit_agree(self):
        path = self.file("conform.xml")
        result = absenc("conform", "sim:tformat?fault=drop=1", "--tap", "--junit", path, "--readings", "3")
        self.assertEqual(result.returncode, 1, result.stderr)
        lines = result.stdout.splitlines()
        tests = [line for line in lines if line.startswith(("ok ", "not ok "))]
        self.assertEqual(lines[:2], ["TAP version 13", f"1..{len(tests)}"])
        suite = xml.etree.ElementTree.parse(path).getroot()
        self.assertEqual(int(suite.get("tests")), len(tests))
        failed = sum(line.startswith("not ok ") for line in tests)
        self.assertEqual((int(suite.get("failures")), len(suite.findall("*/failure"))), (failed, failed))
        self.assertGreater(failed, 0)
        self.assertEqual(int(suite.get("skipped")), sum("# SKIP" in line for line in tests))

    def test_refuses_wrong_usage(self):
        for arguments in (("sim:tformat", "--readings", "0"), ("sim:nothing",), ()):
            self.assert_wrong_usage(absenc("conform", *arguments))

    def test_changes_need_consent(self):
        self.assert_wrong_usage(absenc("conform", self.encoder(), "--changes"), "--yes")
        self.assertNotIn("eeprom-write", absenc("conform", "sim:tformat").stdout)
        self.assertIn("kept: eeprom-write", absenc("conform", "sim:tformat", "--changes").stdout)

    def test_changes_are_put_back(self):
        memory = self.file("memory.txt")
        encoder = self.encoder("--memory", memory)
        before = content(memory)
        result = absenc("conform", encoder, "--changes", "--yes", "--readings", "5")
        self.assertIn("kept: eeprom-write", result.stdout, result.stderr)
        self.assertEqual(content(memory), before)

    def test_changes_are_put_back_after_interrupt(self):
        memory = self.file("memory.txt")
        encoder = self.encoder("--memory", memory)
        before = content(memory)
        process = self.start("conform", encoder, "--changes", "--yes", "--readings", "1")
        while process.poll() is None and content(memory) == before:
            pass
        status, out, _ = end(process, signal.SIGINT)
        self.assertEqual(content(memory), before)
        self.assertEqual((status, out), (1, ""))

    def verdicts(self, encoder, *more):
        result = absenc("conform", encoder, "--changes", "--yes", "--readings", "2", "--json", *more)
        return {one["id"]: (one["verdict"], one["evidence"]) for one in json.loads(result.stdout)["clauses"]}

    def place(self, encoder):
        reading = json_lines(absenc("read", encoder, "--json").stdout)[0]
        return reading["singleturn"], reading["multiturn"]

    def test_zero_and_turns_are_lost_only_with_resets(self):
        encoder = self.encoder("--singleturn", "1000", "--multiturn", "7")
        before = self.place(encoder)
        self.assertTrue(all(before), before)
        kept = self.verdicts(encoder)
        for clause in ("zero", "reset-multiturn"):
            self.assertEqual(kept[clause][0], "untested")
            self.assertIn("--resets gives it up", kept[clause][1])
        self.assertEqual(self.place(encoder), before)
        lost = self.verdicts(encoder, "--resets")
        self.assertEqual({clause: lost[clause][0] for clause in ("zero", "reset-multiturn")},
                         {"zero": "kept", "reset-multiturn": "kept"}, lost)
        self.assertEqual(self.place(encoder), (0, 0))

    def test_resets_need_consent(self):
        encoder = self.encoder("--singleturn", "1000", "--multiturn", "7")
        self.assert_wrong_usage(absenc("conform", encoder, "--resets"), "--changes", "give both")
        self.assert_wrong_usage(absenc("conform", encoder, "--changes", "--resets"), "--yes", "its turns and its alarms are")
        self.assertTrue(all(self.place(encoder)))


class ConformHost(EncoderCase):
    def test_monitor_keeps_all_clauses(self):
        path = self.file("encoder")
        judge = self.start("conform-host", "tformat", "--pty", path, "--answers", "10", "--patience", "60", "--json")
        self.assertIn("ready: ", read_line(judge.stderr, time.monotonic() + PATIENCE))
        host = self.start("monitor", f"tformat:{path}?latency=100", "--json")
        out, err = judge.communicate(timeout=PATIENCE)
        end(host, signal.SIGTERM)
        answer = json.loads(out)
        verdicts = {one["id"]: one["verdict"] for one in answer["clauses"]}
        # The clauses about resets and memory stay untested: a host that only reads positions sends no such request.
        read = {"asks", "silence", "damage", "turn", "refusal"}
        self.assertEqual(verdicts, {name: "kept" if name in read else "untested" for name in verdicts}, err)
        self.assertEqual((judge.returncode, answer["ok"]), (0, True))

    def verdicts_of(self, host):
        """Returns exit status, JSON output and verdicts by clause. `host` plays the host on the line."""
        path = self.file("encoder")
        judge = self.start("conform-host", "tformat", "--pty", path, "--answers", "2", "--patience", "1", "--json")
        self.assertIn("ready: ", read_line(judge.stderr, time.monotonic() + PATIENCE))
        with open(path, "r+b", buffering=0) as line:
            tty.setraw(line)
            host(line)
            out, _ = judge.communicate(timeout=PATIENCE)
        answer = json.loads(out)
        return judge.returncode, answer, {one["id"]: one["verdict"] for one in answer["clauses"]}

    def test_reports_host_that_stops_after_lost_reply(self):
        def ask_while_answered(line):
            line.write(b"\x1a")
            while select.select([line], [], [], 0.5)[0]:
                line.read(64)
                line.write(b"\x1a")
        status, answer, verdicts = self.verdicts_of(ask_while_answered)
        self.assertEqual((status, answer["ok"], answer["verdict"]), (1, False, "broken"), answer)
        self.assertEqual(verdicts["silence"], "broken", answer)

    def test_reports_invalid_request(self):
        for sent in ((b"\x9a",) * 8, (b"\x1a", b"\x9a") * 8, (b"\x1a\x1a",)):
            def send(line, sent=sent):
                for one in sent:
                    line.write(one)
                    select.select([line], [], [], 0.1)
            with self.subTest(sent[:2]):
                status, answer, verdicts = self.verdicts_of(send)
                self.assertEqual((status, answer["ok"]), (1, False), answer)
                self.assertEqual(verdicts["asks"], "broken", answer)
                self.assertNotIn("kept", verdicts.values())

    def test_ends_by_interrupt_and_refuses_spi_without_device(self):
        judge = self.start("conform-host", "tformat", "--pty", self.file("encoder"))
        self.assertIn("ready: ", read_line(judge.stderr, time.monotonic() + PATIENCE))
        self.assertEqual(end(judge, signal.SIGINT)[:2], (1, ""))
        self.assert_wrong_usage(absenc("conform-host", "ssi"), "--spidev NAME")
        self.assert_wrong_usage(absenc("conform-host", "ssi", "--spidev", "spidev9.0", "--pty", self.file("other")),
                                "--spidev NAME alone")
        self.assert_wrong_usage(absenc("conform-host", "tformat", "--spidev", "spidev9.0"), "SPI controller")
        self.assert_wrong_usage(absenc("conform-host", "raa38", "--pty", self.file("other")), "asked nothing")


if __name__ == "__main__":
    unittest.main()
