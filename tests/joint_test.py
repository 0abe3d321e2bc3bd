#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests angles of joint and motor in the output of absenc, in recordings and in `serve`."""
import csv
import json
import os
import re
import unittest

from command_support import EncoderCase, absenc
from serve_support import ServeCase, of, wait_until

SETTINGS = "gear=50/3&direction=-1&offset_deg=10&pole_pairs=7"
TURN = 2**17


def joint_of(position):
    return -(360 * position / TURN - 10) / (50 / 3)


class Command(EncoderCase):
    def test_read(self):
        address = self.encoder("--singleturn", "32768", "--multiturn", "3", more="&" + SETTINGS)
        result = absenc("read", address)
        self.assertEqual(result.returncode, 0, result.stderr)
        joint, electrical = map(float, re.search(r" joint (\S+) deg   electrical (\S+) deg$", result.stdout.strip()).groups())
        self.assertAlmostEqual(joint, joint_of(3 * TURN + 32768), places=4)
        self.assertAlmostEqual(electrical, -(90 - 10) * 7 % 360)
        row = json.loads(absenc("read", address, "--json").stdout)
        self.assertEqual((row["singleturn"], row["multiturn"], row["angle_deg"]), (32768, 3, 90))
        self.assertAlmostEqual(row["joint_deg"], joint_of(3 * TURN + 32768))
        self.assertAlmostEqual(row["electrical_deg"], 160)

    def test_record(self):
        path = os.path.join(self.directory, "log.csv")
        result = absenc("record", f"sim:tformat?motion=rpm=300&{SETTINGS}", "--output", path, "--rate", "200", "--for", "1")
        self.assertEqual(result.returncode, 0, result.stderr)
        with open(path, encoding="utf-8") as file:
            rows = [row for row in csv.DictReader(line for line in file if not line.startswith("#")) if not row["event"]]
        for row in rows:
            self.assertAlmostEqual(float(row["joint_deg"]), joint_of(int(row["position"])), places=4)
            self.assertTrue(0 <= float(row["electrical_deg"]) < 360)
            if row["speed_rpm"]:
                self.assertAlmostEqual(float(row["joint_speed_rpm"]), -float(row["speed_rpm"]) * 3 / 50, places=2)
                self.assertTrue(row["joint_speed_uncertainty_rpm"])
        self.assertGreater(int(rows[-1]["position"]) - int(rows[0]["position"]), 3 * TURN)

    def test_settings_in_configuration_file(self):
        with open(os.path.join(self.directory, "absenc.toml"), "w", encoding="utf-8") as file:
            file.write('[encoder.elbow]\nprotocol = "tformat"\nport = "sim"\ngear = 100\ndirection = -1\noffset_deg = 12.5\n'
                       'pole_pairs = 4\n[encoder.wrist]\nprotocol = "tformat"\nport = "sim"\ngear = 0\n')
        elbow = json.loads(absenc("read", "elbow", "--json", cwd=self.directory).stdout)
        self.assertAlmostEqual(elbow["joint_deg"], 0.125)
        self.assertAlmostEqual(elbow["electrical_deg"], 50)
        wrist = absenc("read", "wrist", cwd=self.directory)
        self.assertEqual(wrist.returncode, 2)
        self.assertIn('gear is "0", but must be a number above 0', wrist.stderr)


class Serve(ServeCase):
    def test_json(self):
        name = f"sim:tformat?singleturn=32768&multiturn=3&{SETTINGS}"
        server = self.without_history(name, "sim:tformat")
        wait_until(lambda: server.json(of(name))["state"] == "live", "it is read")
        one = server.json(of(name))
        self.assertTrue(one["has_joint"] and one["has_motor"])
        self.assertAlmostEqual(one["joint_deg"], joint_of(3 * TURN + 32768))
        self.assertAlmostEqual(one["electrical_deg"], 160)
        self.assertEqual((one["angle_deg"], one["turns"]), (90, 3))
        plain = server.json(of("sim:tformat"))
        self.assertEqual((plain["has_joint"], plain["has_motor"], plain["joint_deg"], plain["electrical_deg"]),
                         (False, False, None, None))


if __name__ == "__main__":
    unittest.main()
