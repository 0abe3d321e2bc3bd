# SPDX-License-Identifier: Apache-2.0
"""Tests EncoLink encoders with the absenc command."""
import csv
import json
import os
import unittest

from command_support import Case, Emulator, absenc

KNOWN = "resolution=20&multiturn_bits=16"


def fields(*arguments):
    result = absenc("run", *arguments, "--json")
    return json.loads(result.stdout)["fields"]


class PseudoTerminal(Case):
    def emulator(self, *arguments):
        emulator = Emulator(self.directory, *arguments, protocol="encolink")
        self.addCleanup(emulator.end)
        return emulator

    def test_reads_with_and_without_options(self):
        path = self.emulator("--singleturn", "1000", "--multiturn", "7").path
        for uri in (f"encolink:{path}", f"encolink:{path}?{KNOWN}"):
            with self.subTest(uri):
                reading = json.loads(absenc("read", uri, "--json").stdout)
                self.assertEqual((reading["singleturn"], reading["multiturn"]), (1000, 7))
                self.assertEqual((reading["singleturn_bits"], reading["confirmed"]), (20, True))

    def test_detects_wrong_resolution(self):
        path = self.emulator("--singleturn", "1001").path
        result = absenc("read", f"encolink:{path}?resolution=19&multiturn_bits=16")
        self.assert_failed(result, "out_of_range", "resolution")

    def test_zero_is_saved(self):
        memory = self.file("memory")
        emulator = self.emulator("--singleturn", "1000", "--memory", memory)
        self.assert_good(absenc("zero", f"encolink:{emulator.path}?{KNOWN}", "--yes"))
        emulator.end()
        again = self.emulator("--singleturn", "1005", "--memory", memory)
        self.assertEqual(json.loads(absenc("read", f"encolink:{again.path}?{KNOWN}", "--json").stdout)["singleturn"], 5)

    def test_reads_streaming_encoder(self):
        path = self.emulator("--singleturn", "77", "--option", "stream_rate=500").path
        reading = json.loads(absenc("read", f"encolink:{path}?{KNOWN}&stream_rate=500", "--json").stdout)
        self.assertEqual(reading["singleturn"], 77)

    def test_host_violates_no_rule(self):
        emulator = self.emulator("--motion", "rpm=60")
        self.assert_good(absenc("run", f"encolink:{emulator.path}", "info"))
        self.assert_good(absenc("read", f"encolink:{emulator.path}", "--count", "20", "--rate", "0"))
        self.assertNotIn("rules", emulator.end()[2])


class TurnsAcrossPause(Case):
    """Tests that the host assumes no turns if the encoder's identity says that it counts none."""

    def record(self, motion, settings=""):
        emulator = Emulator(self.directory, "--option", "multiturn_bits=0", "--motion", motion, protocol="encolink")
        self.addCleanup(emulator.end)
        path = os.path.join(self.directory, "log.csv")
        result = absenc("record", f"encolink:{emulator.path}{settings}", "--output", path, "--rate", "5", "--count", "6")
        self.assert_good(result)
        with open(path, encoding="utf-8", newline="") as file:
            return result, list(csv.DictReader(line for line in file if not line.startswith("#")))

    def test_unknown_turns_are_marked_as_restart(self):
        result, rows = self.record("rpm=600")
        self.assertEqual([row["event"] for row in rows], [""] + 5 * ["restarted"])
        self.assertEqual([row["speed_rpm"] for row in rows], 6 * [""])
        for row in rows:
            self.assertEqual(row["position"], row["singleturn"])
        self.assertIn("max_rpm=RPM", result.stderr)
        self.assertIn("started again 5 times", result.stderr)

    def test_monitor_shows_no_unknown_speed(self):
        emulator = Emulator(self.directory, "--option", "multiturn_bits=0", "--motion", "rpm=600", protocol="encolink")
        self.addCleanup(emulator.end)
        result = absenc("monitor", f"encolink:{emulator.path}", "--json", "--rate", "5", "--for", "2")
        self.assert_good(result)
        last = json.loads(result.stdout.splitlines()[-1])
        self.assertGreater(last["restarts"], 1)
        self.assertIsNone(last["speed_rpm"])

    def test_follows_slow_shaft(self):
        _, rows = self.record("rpm=6", "?max_rpm=6")
        self.assertEqual({row["event"] for row in rows}, {""})
        turned = int(rows[-1]["position"]) - int(rows[0]["position"])
        seconds = float(rows[-1]["time_s"]) - float(rows[0]["time_s"])
        self.assertAlmostEqual(turned / 2**20, seconds / 10, delta=0.01)


class Identity(Case):
    def encoder(self, *arguments, settings=""):
        emulator = Emulator(self.directory, *arguments, protocol="encolink")
        self.addCleanup(emulator.end)
        return f"encolink:{emulator.path}{settings}"

    def test_info_shows_resolution_of_identity(self):
        built = ["--option", "resolution=17", "--option", "multiturn_bits=0", "--singleturn", "1000"]
        uri = self.encoder(*built)
        result = absenc("info", uri)
        self.assert_good(result)
        self.assertRegex(result.stdout, r"(?m)^resolution +17 bits in a turn$")
        info = json.loads(absenc("info", uri, "--json").stdout)
        self.assertEqual(info["resolution"], {"singleturn_bits": 17, "multiturn_bits": 0})
        # `info` shows no position if the options contradict the encoder's identity.
        for settings in ("?resolution=20&multiturn_bits=0", "?resolution=20"):
            with self.subTest(settings):
                result = absenc("info", uri + settings, "--json")
                self.assertEqual(result.returncode, 1)
                info = json.loads(result.stdout)
                self.assertEqual(info["resolution"], {"singleturn_bits": 17, "multiturn_bits": 0})
                self.assertFalse(info["answers"]["position"]["ok"])
        self.assert_failed(absenc("read", uri + "?resolution=20"), "unexpected_reply", "another resolution")

    def test_accepts_identity_of_twenty_bytes(self):
        uri = self.encoder("--option", "identity_bytes=20", "--singleturn", "1000")
        for _ in range(3):
            self.assertEqual(json.loads(absenc("read", uri, "--json").stdout)["singleturn"], 1000)
        self.assertEqual(fields(uri, "info")["serial_number"], "AK2A0001")
        self.assertEqual(fields(uri + "?" + KNOWN, "identify")["resolution"], 20)
        padded = "02074d42303830534c4132304d454e5430302900"
        self.assert_good(absenc("decode", "encolink", "--hex", padded))

    def test_version_4_has_no_registers(self):
        uri = self.encoder("--option", "protocol_version=4", "--singleturn", "1000")
        self.assertEqual(json.loads(absenc("read", uri, "--json").stdout)["singleturn"], 1000)
        for one in (uri, f"{uri}?{KNOWN}", "sim:encolink-spi?protocol_version=4"):
            for arguments in (["run", one, "save", "--yes"], ["run", one, "self-calibrate", "--yes"],
                              ["zero", one, "--yes"], ["reset-multiturn", one, "--yes"], ["temperature", one],
                              ["memory", "read", one, "serial_number"],
                              ["memory", "write", one, "position_offset", "5", "--yes"],
                              ["config", "get", one, "position-offset"],
                              ["config", "set", one, "write-lock", "1", "--yes"]):
                with self.subTest(arguments):
                    self.assert_failed(absenc(*arguments), "unsupported", "AksIM-4")
        shown = fields(uri, "info")
        self.assertEqual(shown["protocol_version"], 4)
        self.assertIn("AksIM-4", shown["registers"])


class Simulator(Case):
    def test_uart_and_spi(self):
        for unit in ("sim:encolink", "sim:encolink-spi"):
            with self.subTest(unit):
                info = fields(f"{unit}?motion=rpm=60", "info")
                self.assertEqual((info["resolution"], info["frame_bytes"], info["firmware_major"]), (20, 7, 1))
                self.assertEqual((info["serial_number"], info["speed_rpm"]), ("AK2A0001", 60.0))
                self.assertEqual(fields(unit, "temperature")["temperature_c"], 35.0)
                alarms = fields(f"{unit}?alarm=signal_lost", "alarms")
                self.assertEqual((alarms["alarms"], alarms["error"]), (["signal_lost"], True))
                self.assertEqual(fields(unit, "preset-multiturn", "42")["multiturn"], 42)
                self.assertEqual(fields(unit, "memory-read", "0x64")["order_number"], "MB080SLA20MENT00 SIM")
                self.assertEqual(fields(unit, "set-position-offset", "4096")["position_offset"], 4096)
                self.assertEqual(fields(f"{unit}?motion=rpm=120", "self-calibrate")["calibrations"], 1)

    def test_alarms_have_advice(self):
        result = absenc("read", "sim:encolink?alarm=amplitude_low")
        self.assert_good(result)
        self.assertIn("make the gap smaller", result.stdout + result.stderr)

    def test_refusals_state_reason(self):
        self.assert_failed(absenc("run", "sim:encolink", "memory-write", "0x4C", "1"), "request_rejected", "access denied")
        self.assert_failed(absenc("run", "sim:encolink", "memory-read", "0x9999", "2"), "no register at this address")
        self.assert_failed(absenc("run", "sim:encolink", "self-calibrate"), "did not turn far enough", "turn it evenly")
        self.assert_failed(absenc("run", "sim:encolink?has_ch2=false", "temperature"), "unsupported", "has_ch2")


if __name__ == "__main__":
    unittest.main()
