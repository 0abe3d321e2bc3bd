# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc` with HIPERFACE encoders: frames that other programs print, the resolution from the type label, alarms
live and in captures, settings, data fields, and refusals in words."""
import unittest

from command_support import Case, absenc, json_lines


class Frames(Case):
    def decoded(self, request, reply):
        row, = json_lines(absenc("decode", "hiperface", "--request", request, "--hex", reply, "--json").stdout)
        return row

    def test_frames_of_others(self):
        # Replies from logs in HPMicro's hpm_sdk: one of its virtual encoder, then two of an SKM36 (checksum printed
        # with its bits reversed).
        for reply, turns, position in (("40420000a5a502", 10, 0x5A5), ("40420027255151", 0x272, 0x551),
                                       ("404200271c023b", 0x271, 0xC02)):
            fields = self.decoded("404202", reply)["fields"]
            self.assertEqual((fields["multiturn"], fields["singleturn"]), (turns, position), reply)
        # Reply from a capture by Nilab: type label of an encoder that is described by its data field FF.
        label = self.decoded("405212", "4052e4ff800188")["fields"]
        self.assertEqual((label["type"], label["memory_size"], label["baud"]), (0xFF, 2048, 9600))

    def test_refusal_is_in_words(self):
        refused = absenc("decode", "hiperface", "--request", "404b000501547e25", "--hex", "40500f1f")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("the access code is wrong", refused.stdout + refused.stderr)


class Readings(Case):
    def test_resolution_is_that_of_type_label(self):
        for model, bits, turns in (("SEL34", 9, True), ("SRS50", 15, False)):
            for address in (f"sim:hiperface?model={model}", f"sim:hiperface?model={model}&singleturn={1 << (bits - 1)}"):
                reading, = json_lines(absenc("read", address, "--json").stdout)
                self.assertEqual("multiturn" in reading and reading["multiturn"] is not None, turns, address)
            self.assertAlmostEqual(reading["angle_deg"], 180)

    def test_alarms_invalidate_what_they_are_about(self):
        warned, = json_lines(absenc("read", "sim:hiperface?alarm=led_current", "--json").stdout)
        self.assertTrue(warned["singleturn_valid"] and warned["multiturn_valid"])
        lost, = json_lines(absenc("read", "sim:hiperface?alarm=multiturn_position_1", "--json").stdout)
        self.assertEqual((lost["singleturn_valid"], lost["multiturn_valid"]), (True, False))
        shown = absenc("read", "sim:hiperface?alarm=over_speed").stdout
        self.assertIn("INVALID", shown)
        self.assertIn("over_speed", shown)
        self.assertIn("turns too fast", absenc("alarms", "sim:hiperface?alarm=over_speed").stdout)

    def test_capture_joins_status_to_position(self):
        file = self.file("wave.vcd")
        self.assert_good(absenc("wave", "hiperface?alarm=temperature&singleturn=1024", file))
        rows = json_lines(absenc("decode", "hiperface", file, "--json").stdout)
        self.assertTrue(all(row["ok"] for row in rows), rows)
        alone, first, complete = (row for row in rows if row["fields"]["command"] == "position")
        self.assertEqual((alone["singleturn_valid"], alone["alarms"]), (None, None))
        # The alarms of the first reading are incomplete: another status code could follow. They are complete when the
        # same code is reported again.
        self.assertEqual((first["singleturn_valid"], first["alarms"]), (None, ["temperature"]))
        self.assertEqual((complete["singleturn_valid"], complete["alarms"]), (True, ["temperature"]))
        self.assertEqual(complete["fields"]["singleturn"], 1024)


class Settings(Case):
    def test_settings_and_identity(self):
        address = "sim:hiperface?address=0x4A"
        self.assertIn("0x4A", absenc("config", "get", address, "address").stdout)
        self.assertIn("9600", absenc("config", "get", address, "baud").stdout)
        info, = json_lines(absenc("info", address, "--json").stdout)
        self.assertEqual(info["answers"]["info"]["fields"]["serial_number"], "VIRTUAL01")

    def test_write_is_read_back(self):
        written = absenc("memory", "write", "sim:hiperface", "5", "0x7E", "--yes")
        self.assertEqual(written.returncode, 0, written.stderr)
        refused = absenc("memory", "write", "sim:hiperface?access_code=0x54", "5", "0x7E", "--page", "14", "--yes")
        self.assertNotEqual(refused.returncode, 0)


if __name__ == "__main__":
    unittest.main()
