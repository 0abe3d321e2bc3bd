# SPDX-License-Identifier: Apache-2.0
"""Tests Nikon's A-format with the absenc command."""

import os
import unittest
from pathlib import Path

from command_support import Case, Emulator, absenc, json_lines


class Nikon(Case):
    def test_waveform_decodes_to_what_was_read(self):
        """A waveform of wide characters decodes to the same frames."""
        for rate in ("2500000", "6666667", "16000000"):
            for ending in ("vcd", "sr", "csv"):
                file = self.file(f"{rate}.{ending}")
                drawn = absenc("wave", f"nikon?rate={rate}&motion=rpm=300", file, "--count", "3")
                self.assertEqual(drawn.returncode, 0, drawn.stderr)
                rows = json_lines(absenc("decode", "nikon", file, "--json", "--option", f"rate={rate}").stdout)
                self.assertEqual([row["request"] for row in rows], ["0200"] * 3)
                self.assertTrue(all(len(row["reply"]) == 16 for row in rows))

    def test_request_of_several_frames_is_one_request(self):
        """The four frames of a write, with their pauses, are one request in a capture."""
        file = self.file("write.sr")
        drawn = absenc("wave", "nikon", file, "--command", "memory-write 18 23100")
        self.assertEqual(drawn.returncode, 0, drawn.stderr)
        rows = json_lines(absenc("decode", "nikon", file, "--json").stdout)
        self.assertEqual([row["request"] for row in rows],
                         ["020d5a02", "020d5a02", "022e8a67520b5a02", "020d5a02", "020d5a02"])
        self.assertEqual(rows[-1]["fields"]["value"], 23100)

    def test_memory_has_words(self):
        """Words are read and written as such, and a dump has four digits for each."""
        written = absenc("memory", "write", "sim:nikon", "0x12", "0x5A3C", "7", "--yes")
        self.assertEqual(written.returncode, 0, written.stderr)
        self.assertIn("5A3C 0007", written.stdout)
        self.assertIn("2 words written", written.stdout)
        refused = absenc("memory", "write", "sim:nikon", "0x12", "0x10000", "--yes")
        self.assertIn("0 to 65535", refused.stderr)
        dump = Path(self.file("encoder.dump"))
        self.assertIn("240 words", absenc("memory", "dump", "sim:nikon", "--output", str(dump)).stdout)
        text = dump.read_text(encoding="utf-8")
        self.assertIn("address 0x00: 0000 0000 ", text)
        self.assertIn("all 240 words are the same", absenc("memory", "verify", "sim:nikon", str(dump)).stdout)
        lines = text.replace("address 0x00: 0000", "address 0x00: BEEF").splitlines()
        dump.write_text("\n".join([*lines[:-1], "checksum: edited", ""]), encoding="utf-8")
        verified = absenc("memory", "verify", "sim:nikon", str(dump), "--json")
        self.assertIn('"wanted":48879', verified.stdout)
        self.assertIn("1 word written", absenc("memory", "load", "sim:nikon", str(dump), "--yes").stdout)
        halved = text.replace("address 0x00: 0000", "address 0x00: 00")
        dump.write_text(halved, encoding="utf-8")
        self.assertIn("words of four hexadecimal digits", absenc("memory", "load", "sim:nikon", str(dump), "--yes").stderr)

    def test_alarms_complete_later_readings_of_a_capture(self):
        """The status of the first reading names no alarm."""
        file = self.file("alarm.vcd")
        self.assert_good(absenc("wave", "nikon?alarm=singleturn_error", file, "--count", "3"))
        rows = json_lines(absenc("decode", "nikon", file, "--json").stdout)
        self.assertEqual([row["request"] for row in rows], ["0200", "02000223", "0223"] * 3)
        positions = [row for row in rows if "singleturn_valid" in row]
        self.assertEqual([row["singleturn_valid"] for row in positions], [None] + [False] * 5)
        self.assertEqual([row["multiturn_valid"] for row in positions], [None] + [True] * 5)
        self.assertEqual([row["alarms"] for row in positions], [None] + [["singleturn_error"]] * 5)

    def test_reads_the_replies_that_others_print(self):
        """TI's sample output shows ABS 1526F: 237.961120605 degrees of 17 bits, and 51200 turns."""
        decoded = absenc("decode", "nikon", "--option", "singleturn_bits=17", "--request", "e244", "--hex", "04a16f5201900185", "--json")
        fields = json_lines(decoded.stdout)[0]["fields"]
        self.assertEqual((fields["singleturn"], fields["multiturn"]), (0x1526F, 51200))
        self.assertAlmostEqual(fields["singleturn"] * 360 / 2**17, 237.961120605)

    def scanned(self, line):
        found = absenc("scan", f"nikon:{line}?latency=50", "--json")  # the latency of 50 ms allows for a busy machine
        self.assert_good(found)
        return [encoder["encoder_address"] for encoder in json_lines(found.stdout)[0]["encoders"]]

    def test_encoders_of_a_line_answer_in_turn(self):
        line = self.file("line")
        with Emulator(self.directory, "--also", "address=3", "--also", "address=7&singleturn=1000", protocol="nikon", name="line"):
            self.assertEqual(self.scanned(line), [0, 3, 7])
            shown = absenc("run", f"nikon:{line}?latency=50", "all-positions").stdout
            self.assertEqual([text.split()[1] for text in shown.splitlines() if text.startswith(("encoder_address", "singleturn"))],
                             ["0", "0", "3", "0", "7", "1000"])
            refused = absenc("config", "set", f"nikon:{line}", "address", "2", "--yes")
            self.assert_failed(refused, "another encoder answers on this line")
            self.assert_good(absenc("config", "set", f"nikon:{line}?address=3", "identification", "0x123", "--yes"))
            self.assert_good(absenc("run", f"nikon:{line}", "assign-address", "5", "0x123", "--yes"))
            self.assertEqual(self.scanned(line), [0, 5, 7])

    @unittest.skipUnless(os.path.exists("/dev/ttyS0"), "this machine has no UART")
    def test_uart_refuses_wide_characters(self):
        refused = absenc("read", "nikon:/dev/ttyS0")
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("no UART has 16-bit characters", refused.stderr)


if __name__ == "__main__":
    unittest.main()
