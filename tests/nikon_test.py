# SPDX-License-Identifier: Apache-2.0
"""Tests of what only Nikon's A-format has: characters of 16 bits in captures, requests of several frames, a memory of
words."""

import os
import unittest
from pathlib import Path

from command_support import Case, absenc, json_lines


class Nikon(Case):
    def test_waveform_decodes_to_what_was_read(self):
        """A waveform of wide characters decodes to the same frames, at every rate and in every format of file."""
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
        self.assertIn("words of 4 hexadecimal digits", absenc("memory", "load", "sim:nikon", str(dump), "--yes").stderr)

    @unittest.skipUnless(os.path.exists("/dev/ttyS0"), "this machine has no UART")
    def test_uart_refuses_wide_characters(self):
        refused = absenc("read", "nikon:/dev/ttyS0")
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("no UART has 16-bit characters", refused.stderr)


if __name__ == "__main__":
    unittest.main()
