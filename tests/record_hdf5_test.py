# SPDX-License-Identifier: Apache-2.0
"""Tests recordings in HDF5 with h5py."""
import datetime
import os
import random
import signal
import subprocess
import sys
import time
import unittest

import h5py
import numpy

from command_support import ABSENC, PATIENCE, absenc, end
from record_test import COLUMNS, RecordCase, wait_until

LOST = 2  # number of seconds whose rows may be lost after SIGKILL; on an idle machine at most one second is lost


def can_be_read(path):
    try:
        with h5py.File(path, "r") as file:
            return len(file["time_s"]) > 0
    except (OSError, KeyError):
        return False


class Hdf5(RecordCase):
    def output(self, name="log.h5"):
        return super().output(name)

    def read(self, path=None):
        """Returns the attributes and columns of a recording, which must be complete."""
        with h5py.File(path or self.output(), "r") as file:
            attributes = {name: value.decode() if isinstance(value, bytes) else value for name, value in file.attrs.items()}
            count = len(file["time_s"])
            columns = {name: file[name][:count] for name in attributes["columns"].split(",")}
            self.assertEqual(set(file), set(columns))
            for name, column in columns.items():
                self.assertEqual(len(column), count, name)
        self.assert_rising(columns["time_s"])
        return attributes, columns

    def assert_is_what_the_shaft_did(self, columns):
        """Checks that the positions fit their times: the shaft turns at 60 rpm from 0."""
        good = columns["event"] == b""
        turns = columns["position"][good] / 2**17
        self.assertLess(numpy.ptp(turns - columns["time_s"][good]), 1e-4)
        self.assertTrue((columns["position"][~good] == numpy.iinfo("i8").min).all())

    def test_file_is_valid_as_soon_as_it_exists(self):
        """A recording must be valid even if the recorder is killed as soon as the file's name appears."""
        for i in range(20):
            path = self.output(f"{i}.h5")
            process = subprocess.Popen([ABSENC, "record", "sim:tformat", "--output", path], stdout=subprocess.DEVNULL,
                                       stderr=subprocess.DEVNULL)
            try:
                deadline = time.monotonic() + PATIENCE
                while not os.path.exists(path):
                    self.assertLess(time.monotonic(), deadline)
            finally:
                process.kill()
                process.wait()
            self.read(path)
        self.assertEqual(len(os.listdir(self.directory)), 20)

    def test_each_column_is_a_dataset(self):
        result = absenc("record", "sim:tformat?motion=rpm=60&alarm=over_heat", "--output", self.output(), "--count", "70")
        self.assertEqual(result.returncode, 0, result.stderr)
        attributes, columns = self.read()
        self.assertEqual(list(columns), COLUMNS)
        self.assertEqual({name: attributes[name] for name in ("absenc_record", "protocol", "rate_hz", "every", "part")},
                         {"absenc_record": 1, "protocol": "tformat", "rate_hz": 100, "every": 1, "part": 1})
        datetime.datetime.fromisoformat(attributes["started"].replace("Z", "+00:00"))
        self.assertEqual((columns["event"] == b"").sum(), 70)
        self.assertIn("70 readings", result.stderr)
        self.assert_is_what_the_shaft_did(columns)
        good = columns["event"] == b""
        self.assertEqual(set(columns["alarms"][good]), {1 << 4})
        with h5py.File(self.output(), "r") as file:
            self.assertEqual((file["angle_deg"].attrs["unit"], file["position"].attrs["unit"]), (b"deg", b"counts"))
            self.assertIn(b"seconds after", file["time_s"].attrs["meaning"])
            self.assertEqual(file["alarms"].attrs["missing_value"], 2**32 - 1)

    def test_parts_and_failures(self):
        absenc("record", "sim:tformat?fault=drop=0.9", "--output", self.output(), "--rate", "0", "--for", "1.2",
               "--part-time", "0.5")
        parts = sorted(os.listdir(self.directory))
        self.assertGreaterEqual(len(parts), 2)
        for number, part in enumerate(parts, 1):
            attributes, columns = self.read(self.output(part))
            self.assertEqual(attributes["part"], number)
            self.assertTrue(set(columns["event"]) - {b"", b"gap"}, part)

    def test_killed_recording_is_valid(self):
        """A killed recording may lack at most the rows of LOST seconds."""
        random.seed(3)
        for number in range(8):
            path = self.output(f"{number}.h5")
            process = self.start("record", "sim:tformat?motion=rpm=60", "--output", path, "--rate", "1000")
            wait_until(lambda p=path: can_be_read(p), "the first rows")
            time.sleep(random.uniform(0, 3))
            killed = time.time()
            end(process, signal.SIGKILL)
            attributes, columns = self.read(path)
            started = datetime.datetime.fromisoformat(attributes["started"].replace("Z", "+00:00")).timestamp()
            self.assertLess(killed - (started + columns["time_s"][-1]), LOST)
            self.assert_is_what_the_shaft_did(columns)

    def test_slow_readings_are_on_disk_within_a_second(self):
        process = self.start("record", "sim:tformat", "--output", self.output(), "--rate", "0.01")
        wait_until(lambda: can_be_read(self.output()), "its only reading")
        self.assertEqual(end(process, signal.SIGINT)[0], 0)
        self.assertEqual(len(self.read()[1]["time_s"]), 1)

    def test_removed_file_is_an_error(self):
        process = self.start("record", "sim:tformat", "--output", self.output())
        wait_until(lambda: can_be_read(self.output()), "readings")
        os.remove(self.output())
        self.assertEqual(process.wait(PATIENCE), 1)
        messages = process.communicate()[1].decode()
        self.assert_sentence(messages, self.output(), "was removed")
        self.assertNotIn("is whole", messages)

    def test_full_disk(self):
        """A limit on the file size has the effect of a full disk."""
        limit = ("import resource, signal, os, sys; signal.signal(signal.SIGXFSZ, signal.SIG_IGN); "
                 "resource.setrlimit(resource.RLIMIT_FSIZE, (1_000_000, 1_000_000)); os.execv(sys.argv[1], sys.argv[1:])")
        result = subprocess.run([sys.executable, "-c", limit, ABSENC, "record", "sim:tformat?motion=rpm=60", "--rate", "0",
                                 "--output", self.output()], capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assert_sentence(result.stderr, "File too large", "what is written so far is whole")
        _, columns = self.read()
        self.assertIn(f"{(columns['event'] == b'').sum()} readings", result.stderr)
        self.assert_is_what_the_shaft_did(columns)

    def test_no_file_is_overwritten(self):
        with open(self.output(), "w", encoding="utf-8") as file:
            file.write("precious")
        self.assert_failed(absenc("record", "sim:tformat", "--output", self.output(), "--count", "1"), "already a file")
        with open(self.output(), encoding="utf-8") as file:
            self.assertEqual(file.read(), "precious")


if __name__ == "__main__":
    unittest.main()
