# SPDX-License-Identifier: Apache-2.0
"""Tests that a command which changes an encoder reports the state of the change."""
import json
import os
import shlex
import unittest

from command_support import Case, Emulator, absenc, end, json_lines
from serve_support import Server

STATES = ("not_sent", "confirmed", "refused", "unknown")


class ChangeStates(Case):
    def both(self, *arguments):
        text, json_result = absenc(*arguments), absenc(*arguments, "--json")
        answer = json.loads(json_result.stdout)
        self.assertEqual(answer["ok"], json_result.returncode == 0, answer)
        return text, answer

    def test_success_is_confirmed(self):
        for verb in (["zero", "sim:tformat?singleturn=1000"], ["config", "set", "sim:tformat", "overheat-threshold", "80"],
                     ["run", "sim:tformat", "memory-write", "5", "0x42"], ["memory", "write", "sim:tformat", "5", "0x42"]):
            with self.subTest(verb):
                text, answer = self.both(*verb)
                self.assert_good(text)
                self.assertEqual(answer["change"], "confirmed")

    def test_zero_that_may_have_been_ignored_is_unknown(self):
        """0.35 degrees are 127 counts of 17 bits."""
        for place, state in (("0", "unknown"), ("120", "unknown"), ("131000", "unknown"), ("128", "confirmed")):
            with self.subTest(place):
                text, answer = self.both("zero", f"sim:tformat?singleturn={place}")
                self.assertEqual((text.returncode, answer["change"]), (0, state))
                if state == "unknown":
                    self.assertIn("turn the shaft and try again", answer["change_note"])
                    self.assertIn("note: sent, result unknown; the position was already there before", text.stderr)
                else:
                    self.assertNotIn("change_note", answer)

    def test_unchanged_value_is_not_sent(self):
        _, answer = self.both("memory", "write", "sim:tformat", "5", "0")
        self.assertEqual(answer["change"], "not_sent")
        _, answer = self.both("config", "set", "sim:raa38-modbus", "baud", "19200")
        self.assertEqual(answer["change"], "not_sent")

    def test_failure_before_request_is_not_sent(self):
        for verb in (["zero", "sim:tformat?fault=silence=1"], ["zero", "sim:tformat?motion=rpm=60"],
                     ["config", "set", "sim:tformat?fault=silence=1", "overheat-threshold", "80"],
                     ["memory", "write", "sim:tformat?fault=silence=1", "5", "0x42"],
                     ["zero", f"tformat:{self.file('no-port')}", "--yes"]):
            with self.subTest(verb):
                text, answer = self.both(*verb)
                self.assertEqual(answer["change"], "not_sent")
                if verb[0] != "memory":
                    self.assert_failed(text, "Change: not sent")

    def test_reading_reports_no_change(self):
        self.assertNotIn("Change:", absenc("read", "sim:tformat?fault=silence=1").stderr)
        self.assertNotIn("change", json.loads(absenc("read", "sim:tformat?fault=silence=1", "--json").stdout))
        self.assertNotIn("change", json.loads(absenc("run", "sim:tformat", "temperature", "--json").stdout))

    def test_every_change_on_bad_line_has_state(self):
        """Covers changes whose value cannot be read back at the old baud rate."""
        seen = set()
        for seed in range(100, 124):
            with Emulator(self.directory, "--fault", "truncate=0.4", "--seed", str(seed), protocol="raa38-modbus",
                          name=f"line{seed}") as line:
                result = absenc("config", "set", f"raa38-modbus:{line.path}", "baud", "57600", "--yes", "--json")
                answer = json.loads(result.stdout)
                self.assertIn(answer["change"], STATES, answer)
                seen.add(answer["change"])
                if answer["change"] in ("confirmed", "unknown") and not answer["ok"]:
                    self.assertIn("57600", answer["change_advice"])
        self.assertTrue({"not_sent", "confirmed"} <= seen, seen)


class Journal(Case):
    """Tests of the journal of changes, which is in $XDG_STATE_HOME if no other place is set."""

    def setUp(self):
        super().setUp()
        self.environment = {name: value for name, value in os.environ.items()
                            if name not in ("ABSENC_CHANGES", "STATE_DIRECTORY")}
        self.environment["XDG_STATE_HOME"] = self.file("state")
        self.journal = self.file("state/absenc/changes.tsv")

    def absenc(self, *arguments, **more):
        return absenc(*arguments, env={**self.environment, **more})

    def changes(self, *arguments):
        result = self.absenc("changes", *arguments, "--json")
        self.assert_good(result)
        return json_lines(result.stdout)

    def put_back(self, entry):
        return self.absenc(*shlex.split(entry["put_back"])[1:], "--yes")

    def test_empty_journal_is_reported(self):
        result = self.absenc("changes")
        self.assert_good(result)
        self.assertIn("no changes are in " + self.journal, result.stdout)
        self.assertIn(f"no changes of elbow are in {self.journal}", self.absenc("changes", "elbow").stdout)
        # a change of a virtual encoder is not recorded in the journal
        self.assert_good(self.absenc("zero", "sim:tformat"))
        self.assertEqual(self.changes(), [])

    def test_every_kind_of_change_can_be_put_back(self):
        with Emulator(self.directory, "--singleturn", "1000") as encoder:
            address = f"tformat:{encoder.path}?latency=300"
            self.assert_good(self.absenc("config", "set", address, "overheat-threshold", "80", "--yes"))
            self.assert_good(self.absenc("memory", "write", address, "5", "0x42", "--page", "2", "--yes"))
            self.assert_good(self.absenc("run", address, "memory-write", "6", "0x17", "--yes"))
            self.assert_good(self.absenc("zero", address, "--yes"))
            self.assert_good(self.absenc("read", address))
            entries = self.changes()
            self.assertEqual([(one["encoder"], one["what"], one["before"], one["after"], one["change"]) for one in entries],
                             [(address, "config set overheat-threshold", "90", "80", "confirmed"),
                              (address, "memory write 0x05 --page 2", "0x00", "0x42", "confirmed"),
                              (address, "memory write 0x06", "0x00", "0x17", "confirmed"),
                              (address, "zero", None, None, "confirmed")])
            for one in entries[:3]:
                self.assert_good(self.put_back(one))
            self.assertIn("90 degC", self.absenc("config", "get", address, "overheat-threshold").stdout)
            self.assertIn("00", self.absenc("memory", "read", address, "5", "--page", "2").stdout)
            self.assertEqual(len(self.changes()), 7)
            self.assertEqual(len(self.changes(f"tformat:{encoder.path}")), 7)
            self.assertEqual(self.changes("tformat:/dev/other"), [])
            text = self.absenc("changes").stdout
            self.assertIn("absenc config set", text)
            self.assertRegex(text, r"overheat-threshold +90 +80 +confirmed")

    def test_baud_rate_is_put_back_at_new_rate(self):
        with Emulator(self.directory, protocol="raa38-modbus") as encoder:
            address = f"raa38-modbus:{encoder.path}?latency=300"
            self.assert_good(self.absenc("config", "set", address, "baud", "57600", "--yes"))
            entry, = self.changes()
            self.assertEqual((entry["before"], entry["after"]), ("19200", "57600"))
            self.assert_good(self.put_back(entry))
            self.assert_good(self.absenc("read", address))

    def test_unknown_result_is_recorded(self):
        for seed in range(1, 60):
            with Emulator(self.directory, "--fault", "silence=0.3", "--seed", str(seed), name=f"line{seed}") as encoder:
                address = f"tformat:{encoder.path}?latency=250"
                json_result = json.loads(self.absenc("run", address, "memory-write", "5", str(seed), "--yes", "--json").stdout)
            if json_result["change"] == "unknown":
                break
        self.assertIn(f'`absenc memory read "{address}" 0x05` shows what is there now', json_result["change_advice"])
        self.assertEqual(self.changes()[-1]["change"], "unknown")
        self.assertEqual(self.changes()[-1]["after"], f"0x{seed:02X}")

    def test_serve_records_changes(self):
        tokens = self.file("tokens", "anna a-secret-of-hers-0123456789\n")
        os.chmod(tokens, 0o600)
        with Emulator(self.directory) as encoder:
            address = f"tformat:{encoder.path}?latency=300"
            server = Server(address, "--history", "none", "--token-file", tokens, ABSENC_CHANGES=self.journal)
            self.addCleanup(end, server.process)
            status, body = server.command(address, "memory-write", {"Authorization": "Bearer a-secret-of-hers-0123456789"},
                                          argument=["5", "66"])
            self.assertEqual((status, body["change"]), (200, "confirmed"), body)
            entry, = self.changes()
            self.assertEqual((entry["encoder"], entry["what"], entry["before"], entry["after"]),
                             (address, "memory write 0x05", "0x00", "0x42"))

    def test_full_disk_does_not_hide_result(self):
        with Emulator(self.directory) as encoder:
            for journal in ("/dev/full", self.file("no")):
                if journal != "/dev/full":
                    os.mkdir(journal)  # the journal's path is that of a folder, so that the journal cannot be written
                result = self.absenc("clear-alarms", f"tformat:{encoder.path}?latency=300", "--yes", ABSENC_CHANGES=journal)
                self.assertEqual(result.returncode, 0)
                self.assertIn("singleturn", result.stdout)
                self.assertIn(f"note: the change is not in the journal {journal}: ", result.stderr)
                json_result = json.loads(self.absenc("clear-alarms", f"tformat:{encoder.path}?latency=300", "--yes", "--json",
                                              ABSENC_CHANGES=journal).stdout)
                self.assertEqual((json_result["ok"], json_result["change"]), (True, "confirmed"))
                self.assertIn("is not in the journal", json_result["change_note"])

    def test_truncated_line_does_not_damage_next_one(self):
        os.makedirs(os.path.dirname(self.journal))
        with open(self.journal, "w", encoding="utf-8") as file:
            file.write("2026-01-01T00:00:00.000Z\ttformat:/dev/x\tmemory wr")
        with Emulator(self.directory) as encoder:
            self.assert_good(self.absenc("zero", f"tformat:{encoder.path}?latency=300", "--yes"))
        result = self.absenc("changes", "--json")
        self.assertEqual([one["what"] for one in json_lines(result.stdout)], ["zero"])
        self.assertIn("1 line", result.stderr)


if __name__ == "__main__":
    unittest.main()
