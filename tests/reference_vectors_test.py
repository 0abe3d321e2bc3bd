#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the vectors of the units with the reference vectors in tests/vectors*.json.

The reference vectors come from outside. The vectors of the older units state many of the same frames, because the
compiler, the kit and doctor need them there. These tests make sure that both state the same."""
import glob
import json
import os
import sys
import unittest

from command_support import absenc, json_lines

SOURCES = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(SOURCES, "firmware"))
import vectors  # noqa: E402: the module is in another folder

STATED_TWICE = 183  # number of frames that vectors.hpp of a unit and the reference state for the same options


def reference_vectors():
    for path in sorted(glob.glob(os.path.join(SOURCES, "tests", "vectors*.json"))):
        with open(path, encoding="utf-8") as file:
            yield from json.load(file)["vectors"]


def frames_of(vector):
    """Returns request and reply of a reference vector as `absenc vectors --json` prints them."""
    texts = (vector["cdm"], vector.get("cds", "")) if "cdm" in vector else (vector["request"], vector["response"])
    return tuple(text.lower().replace(" ", "") for text in texts)


def number_of(value):
    """Returns the number in a text such as 0x90D9, and any other value as it is."""
    return int(value, 16) if isinstance(value, str) and value.startswith("0x") else value


class Vectors(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        listed = json_lines(absenc("list", "--json").stdout)
        defaults = {unit["protocol"]: {option["name"]: option.get("default") for option in unit["options"]}
                    for unit in listed}
        own = {}
        for vector in json_lines(absenc("vectors", "--json").stdout):
            unit = vector["protocol"]
            own.setdefault((unit, vector["request"], vector["response"]), []).append(
                (defaults[unit] | vector["options"], vector))
        cls.pairs = []  # (reference vector, unit's vector) for the same frames and the same options
        cls.frames_of_id = {vector["id"]: frames for frames, same in own.items() for _, vector in same}
        cls.references = list(reference_vectors())
        for reference in cls.references:
            unit = vectors.SAME_UNIT.get(reference["protocol"], reference["protocol"])
            options = defaults[unit] | {name: number_of(value) for name, value in vectors.options_of(reference).items()}
            cls.pairs += [(reference, vector) for other, vector in own.get((unit, *frames_of(reference)), ())
                          if other == options]

    def test_same_frames_have_same_result(self):
        for reference, vector in self.pairs:
            with self.subTest(reference["id"]):
                self.assertEqual(vector.get("error"), reference.get("error"))
                fields = vector.get("fields", {})
                for name, value in vectors.fields_of(reference).items():
                    self.assertIn(name, fields)
                    if isinstance(value, float):
                        self.assertAlmostEqual(fields[name], value, delta=1e-6)
                    else:
                        self.assertEqual(fields[name], value)

    def test_same_id_means_same_frames(self):
        shared = [one for one in self.references if one["id"] in self.frames_of_id]
        self.assertTrue(shared)
        for reference in shared:
            with self.subTest(reference["id"]):
                self.assertEqual(self.frames_of_id[reference["id"]][1:], frames_of(reference))

    def test_no_further_frame_is_stated_twice(self):
        """A new vector stands in one place: in the reference if it is given from outside, else in vectors.hpp."""
        self.assertEqual(len(self.pairs), STATED_TWICE)


if __name__ == "__main__":
    unittest.main()
