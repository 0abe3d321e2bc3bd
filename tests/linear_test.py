# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc` with linear encoders, whose positions are in millimetres."""
import csv
import json
import os
import unittest

from command_support import Case, absenc, json_lines
from monitor_test import Terminal

# The scale of the encoder SLOW is 214748.3648 mm long: 32 bits of 0.05 um.
SLOW = "sim:biss?model=linear-32-0.05um&singleturn=1579271"
FAST = "sim:biss?model=linear-26-1um&motion=rpm=60"


def read_csv(path):
    with open(path, encoding="utf-8") as file:
        lines = file.read().splitlines()
    header = dict(line[2:].split(": ", 1) for line in lines if line.startswith("# ") and ": " in line)
    return header, list(csv.DictReader(line for line in lines if not line.startswith("#")))


class Reading(Case):
    def test_text(self):
        result = absenc("read", SLOW)
        self.assert_good(result)
        self.assertEqual(result.stdout.split(), "78.96355 mm 78963.55 um 1579271 counts no alarms".split())
        whole = absenc("read", "sim:biss?position_bits=10&unit_um=10&singleturn=150").stdout
        self.assertEqual(whole.split()[:6], "1.50 mm 1500 um 150 counts".split())

    def test_json(self):
        reading = json.loads(absenc("read", SLOW, "--json").stdout)
        self.assertAlmostEqual(reading["position_mm"], 78.96355, delta=1e-9)
        self.assertAlmostEqual(reading["position_um"], 78963.55, delta=1e-6)
        self.assertEqual(reading["singleturn"], 1579271)
        self.assertNotIn("angle_deg", reading)

    def test_csv(self):
        header, row = absenc("read", SLOW, "--csv").stdout.splitlines()
        self.assertEqual(header, "time_s,position_mm,position_um,singleturn,singleturn_valid,multiturn,multiturn_valid,"
                                 "status,alarms,event")
        self.assertEqual(row.split(",")[1:], ["78.96355", "78963.55", "1579271", "true", "", "", "", "none", ""])

    def test_invalid_position_is_no_number(self):
        address = SLOW + "&alarm=error"
        self.assertIn("position INVALID (1579271)", absenc("read", address).stdout)
        reading = json.loads(absenc("read", address, "--json").stdout)
        self.assertEqual((reading["position_mm"], reading["position_um"]), (None, None))
        row = absenc("read", address, "--csv").stdout.splitlines()[1]
        self.assertEqual(row.split(",")[1:5], ["", "", "1579271", "false"])

    def test_info(self):
        info = json.loads(absenc("info", SLOW, "--json").stdout)
        self.assertEqual(info["resolution"], {"singleturn_bits": 32, "multiturn_bits": 0, "unit_um": 0.05})
        self.assertAlmostEqual(info["answers"]["position"]["position_mm"], 78.96355, delta=1e-9)
        text = absenc("info", SLOW).stdout
        self.assertIn("32 bits of 0.05 um", text)
        self.assertIn("78.96355 mm", text)

    def test_word_with_unit_is_linear(self):
        for protocol in ("biss", "ssi", "e201"):
            reading = json.loads(absenc("read", f"sim:{protocol}?word=position:20 error:1&unit_um=0.5&singleturn=30",
                                        "--json").stdout)
            self.assertEqual((reading["position_mm"], reading["position_um"]), (0.015, 15))


class Recording(Case):
    SPEED = -2**26 / 1000 / 60  # mm/s: 1 rpm

    def record(self, name, *more):
        path = os.path.join(self.directory, name)
        # The carriage moves from 0.1 mm downwards, so that its position passes 0 at once. It is slow, because a busy
        # machine may pause for longer than a fast one takes for half of the scale.
        self.assert_good(absenc("record", "sim:biss?model=linear-26-1um&motion=rpm=-1&singleturn=100&max_mm_s=2000",
                                "--output", path, "--for", "0.5", *more))
        return path

    def assert_motion(self, rows):
        # A busy machine may cause gaps and failed readings: their rows are left out, and the rows after them may have no
        # speed yet.
        rows = [row for row in rows if not row.get("event")]
        first = rows[0]
        self.assertTrue([row for row in rows[5:] if row.get("speed_mm_s")])
        for row in rows[5:]:
            if row.get("speed_mm_s"):
                self.assertAlmostEqual(float(row["speed_mm_s"]), self.SPEED, delta=2)
            way = self.SPEED * (float(row["time_s"]) - float(first["time_s"]))
            self.assertAlmostEqual(float(row["unwrapped_mm"]) - float(first["unwrapped_mm"]), way, delta=1)
            self.assertEqual(float(row["unwrapped_mm"]), float(row["position"]) / 1000)
            self.assertEqual(float(row["position_um"]), float(row["singleturn"]))

    def test_csv(self):
        header, rows = read_csv(self.record("log.csv"))
        self.assertEqual(list(rows[0]), ["time_s", "position_mm", "position_um", "singleturn", "singleturn_valid",
                                         "multiturn", "multiturn_valid", "status", "alarms", "position", "unwrapped_mm",
                                         "speed_mm_s", "speed_uncertainty_mm_s", "speed_delay_s", "missed", "event"])
        for name in ("position_mm", "position_um", "unwrapped_mm", "speed_mm_s"):
            self.assertIn(name, header)
        self.assert_motion(rows)
        self.assertNotIn(None, [value for row in rows for value in row.values()])

    def test_json_lines(self):
        with open(self.record("log.jsonl"), encoding="utf-8") as file:
            header, *rows, end = [json.loads(line) for line in file]
        self.assertEqual(end, {"absenc_end": 1, "rows": len(rows)})
        self.assertIn("speed_mm_s", header["units"])
        self.assertNotIn("angle_deg", header["units"])
        self.assertNotIn("speed_rpm", rows[0])
        self.assert_motion(rows)

    def test_failures_fill_all_columns(self):
        path = os.path.join(self.directory, "log.csv")
        absenc("record", "sim:e201?model=linear-26-1um&fault=truncate=0.9", "--output", path, "--for", "0.5")
        _, rows = read_csv(path)
        events = [row for row in rows if row["event"]]
        self.assertTrue(events)
        for row in events:
            self.assertNotIn(None, row)
            self.assertEqual(row["position_mm"], "")


class SpeedLimit(Case):
    def test_is_in_mm_per_second(self):
        encoder = "sim:biss?model=linear-26-1um"
        self.assert_good(absenc("read", f"{encoder}&max_mm_s=500"))
        for setting, other in (("&max_rpm=500", "max_mm_s=MM/S"), ("&max_mm_s=0", "max_mm_s")):
            result = absenc("read", encoder + setting)
            self.assertEqual(result.returncode, 2)
            self.assertIn(other, result.stderr)
        result = absenc("read", "sim:biss?max_mm_s=500")
        self.assertEqual(result.returncode, 2)
        self.assertIn("set max_rpm=RPM", result.stderr)

    def test_pause_names_option(self):
        """The message must name the option that limits the speed."""
        log = os.path.join(self.directory, "pause.csv")
        result = absenc("record", "sim:biss?model=linear-26-1um&max_mm_s=1000000", "--output", log, "--rate", "10", "--for", "0.5")
        self.assertIn("at up to 1000000 mm/s", result.stderr)
        self.assertIn("max_mm_s=MM/S", result.stderr)


class Monitor(Case):
    def test_lines(self):
        text = absenc("monitor", FAST, "--for", "1").stdout
        self.assertRegex(text, r"\d\.\d{3} mm .* 6710\d\.\d+ ± 0\.\d+ mm/s ")
        shown = json_lines(absenc("monitor", FAST, "--for", "1", "--json").stdout)[-1]
        self.assertAlmostEqual(shown["speed_mm_s"], 2**26 / 1000, delta=5)
        self.assertEqual(shown["unwrapped_mm"], shown["position"] / 1000)
        self.assertNotIn("speed_rpm", shown)

    def test_screen(self):
        # The carriage stands in the middle of the scale.
        terminal = Terminal(self, "sim:biss?model=linear-26-1um&singleturn=33554432")
        screen = terminal.wait_for(r"live +33554\.43")
        self.assertRegex(screen, r"state +mm +turns +mm/s +a second")
        self.assertIn("33554.432 mm", screen)
        self.assertRegex(screen, r"0 \|-+\+-+O-+\+-+\| 67108\.9 mm")
        terminal.wait_for(r"speed 0\.0+ \+/- 0\.\d+ mm/s, .*; position 33554\.432 mm")

    def test_beside_rotary_encoder(self):
        terminal = Terminal(self, "sim:biss?model=linear-26-1um", "sim:tformat")
        terminal.wait_for(r"deg, mm +turns +rpm, mm/s")


if __name__ == "__main__":
    unittest.main()
