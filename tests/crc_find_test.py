#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc crc find`, which determines a checksum from frames."""
import functools
import json
import operator
import random
import unittest

from command_support import Case, absenc


def crc(data, width, poly, init, xorout, reflected=False):
    """Returns the CRC, computed bit by bit. `reflected` sets refin and refout."""
    remainder = init
    for byte in data:
        for bit in range(8) if reflected else range(7, -1, -1):
            feedback = remainder >> (width - 1) & 1 ^ byte >> bit & 1
            remainder = (remainder << 1 & (1 << width) - 1) ^ (poly if feedback else 0)
    if reflected:
        remainder = int(f"{remainder:0{width}b}"[::-1], 2)
    return remainder ^ xorout


class CrcFind(Case):
    def setUp(self):
        super().setUp()
        self.random = random.Random(1)

    def find(self, option, frames, *arguments):
        return absenc("crc", "find", *[word for frame in frames for word in (option, frame)], *arguments)

    def best(self, option, frames):
        result = self.find(option, frames, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)["solutions"][0]

    def encolink_frames(self, count):
        frames = [self.random.randbytes(5) for _ in range(count)]
        return [(frame + bytes([crc(frame, 8, 0x97, 0, 0xFF)])).hex() for frame in frames]

    def test_finds_crc_of_encolink(self):
        best = self.best("--hex", self.encolink_frames(4))
        self.assertEqual((best["width"], best["poly"], best["init"], best["xorout"]), (8, "0x97", "0x00", "0xFF"))
        self.assertEqual((best["refin"], best["refout"], best["covered_from"]), (False, False, [0]))

    def test_finds_crcs_of_both_esl_channels(self):
        frames = []
        for _ in range(4):
            channels = [self.random.randbytes(10), self.random.randbytes(6)]
            frames.append(b"".join(channel + crc(channel, 16, 0x5935, init, 0, True).to_bytes(2, "little")
                                   for channel, init in zip(channels, (0, 0xFFFF))).hex())
        result = self.find("--hex", frames, "--json")
        self.assert_good(result)
        first, second = sorted(json.loads(result.stdout)["solutions"][:2], key=lambda one: one["behind_check"])
        for one, init, start, behind in ((first, "0xFFFF", 12, 0), (second, "0x0000", 0, 8)):
            self.assertEqual((one["poly"], one["init"], one["refin"], one["byte_order"]),
                             ("0x5935", init, True, "low_first"))
            self.assertEqual((one["covered_from"], one["behind_check"]), ([start], behind))

    def test_finds_crc_of_biss(self):
        words = [self.random.randbytes(4) for _ in range(6)]
        frames = ["".join(f"{byte:08b}" for byte in word) + f"{crc(word, 6, 3, 0, 0x3F):06b}" for word in words]
        best = self.best("--bits", frames)
        self.assertEqual((best["width"], best["poly"], best["xorout"], best["covered_from"]), (6, "0x03", "0x3F", [0]))

    def test_names_options_that_read_the_word(self):
        words = [self.random.randbytes(3 + i % 2) for i in range(8)]
        for name, check, options in (
            ("as it is", (6, 3, 0, 0x3F), []),
            ("with --option crc_width=16 --option crc_poly=37081 --option crc_init=21 --option crc_inverted=false",
             (16, 0x90D9, 21, 0), ["crc_width=16", "crc_poly=37081", "crc_init=21", "crc_inverted=false"]),
            # This CRC inverts only some of its bits, which no option of the protocol describes.
            (None, (8, 0x97, 0, 0x55), None),
        ):
            with self.subTest(name):
                frames = ["".join(f"{byte:08b}" for byte in word) + f"{crc(word, *check):0{check[0]}b}" for word in words]
                found = self.best("--bits", frames)
                self.assertEqual(found.get("options", {}).get("biss"), options, found)
                shown = self.find("--bits", frames).stdout
                if name is None:
                    self.assertNotIn("biss", shown)
                else:
                    self.assertIn(f"biss has the first of these {name}", shown)
        self.assertNotIn("options", self.best("--hex", self.encolink_frames(4)))

    def test_names_start_value_for_frames_of_equal_length(self):
        for start in (0x2A, 0x15):
            words = [self.random.randbytes(3) for _ in range(8)]
            frames = ["".join(f"{byte:08b}" for byte in word) + f"{crc(word, 6, 3, start, 0x3F):06b}" for word in words]
            self.assertEqual(self.best("--bits", frames)["options"]["biss"], [f"crc_init={start}"])

    def test_constant_bytes_leave_result_open(self):
        frames = [bytes((0x40, 0x42, 0, 0)) + (0xA5A5 + 311 * i).to_bytes(2, "big") for i in range(8)]
        frames = [frame + bytes([functools.reduce(operator.xor, frame)]) for frame in frames]
        self.assertEqual(frames[0].hex(), "40420000a5a502")
        result = self.find("--hex", [frame.hex() for frame in frames], "--json")
        self.assert_good(result)
        solutions = json.loads(result.stdout)["solutions"]
        self.assertEqual((solutions[0]["check"], solutions[0]["init"], solutions[0]["behind_check"]), ("xor", "0x00", 0))
        self.assertEqual({solution["behind_check"] for solution in solutions}, {0})

    def test_text_output(self):
        result = self.find("--hex", self.encolink_frames(6))
        self.assert_good(result)
        heading, best = result.stdout.splitlines()[:2]
        self.assertEqual(heading.split()[:4], ["check", "width", "poly", "Koopman"])
        self.assertEqual(best.split()[:4], ["CRC", "8", "0x97", "0xCB"])
        self.assertIn("bytes 0 to 4", best)
        self.assertEqual(result.stderr, "")

    def test_states_number_of_missing_frames(self):
        result = self.find("--hex", self.encolink_frames(4))
        self.assertIn("1 more frame with other data would settle it", result.stderr)
        self.assertIn("3 more frames with other data", self.find("--hex", self.encolink_frames(2)).stderr)
        result = self.find("--hex", [self.random.randbytes(20).hex() for _ in range(2)])
        self.assertIn("tell too little", result.stderr)

    def test_names_damaged_frame(self):
        frames = self.encolink_frames(8)
        frames[5] = f"{int(frames[5], 16) ^ 0x100:012x}"
        result = self.find("--hex", frames)
        self.assertEqual(result.returncode, 1)
        self.assertIn("except frame 6", result.stderr)

    def test_reports_noise(self):
        result = self.find("--hex", [self.random.randbytes(8).hex() for _ in range(8)])
        self.assertEqual(result.returncode, 1)
        self.assertIn("explains all frames", result.stderr)

    def test_refuses_wrong_usage(self):
        for arguments, words in [([], "one frame fits"), (["--hex", "1A00"], "one frame fits"),
                                 (["--hex", "1A", "--hex", "00"], "too short"),
                                 (["--hex", "1A00", "--bits", "0101"], "all with --bits"),
                                 (["--hex", "1G"], "is not a hexadecimal digit"),
                                 (["--bits", "0120"], "is not a bit"),
                                 (["--hex", "00" * 65] * 2, "more than the 64")]:
            with self.subTest(arguments):
                result = absenc("crc", "find", *arguments)
                self.assertEqual(result.returncode, 2)
                self.assertIn(words, result.stderr)


if __name__ == "__main__":
    unittest.main()
