# SPDX-License-Identifier: Apache-2.0
"""Tests the history of `absenc serve` when its file is changed or cannot be written."""
import contextlib
import glob
import json
import os
import resource
import shutil
import signal
import sqlite3
import time
import unittest

from command_support import PATIENCE, end
from serve_support import TOKEN, ServeCase, Server, of, wait_until

NAME = "sim:tformat?motion=rpm=60"
GARBAGE = b"no database, but what somebody else wrote here\n" * 200
NOTICED_S = 5


def seconds_in(path):
    """Checks the integrity of a history file. Returns the times that it has, in seconds."""
    with contextlib.closing(sqlite3.connect(path)) as database:
        assert database.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        return {at for at, in database.execute("SELECT at FROM second")}


class DisturbedFile(ServeCase):
    """Tests of a disturbed history file, of which no remaining row may be lost."""

    def setUp(self):
        super().setUp()
        self.path = self.file("history.sqlite")
        self.disturbed_at = 0
        self.served = self.server(NAME, "--history", self.path)
        wait_until(lambda: len(self.rows()) >= 2, "it has two seconds")

    def rows(self):
        return self.served.json(of(NAME, "history"), rows=5000)["rows"]

    def records_again_after(self, disturb, words):
        """Disturbs the file and waits for `words` and new rows. Returns the seconds before."""
        before = {row[0] for row in self.rows()}
        begin = self.disturbed_at = time.time()
        disturb()
        self.assertEqual(self.served.encoder()["state"], "live")
        event = wait_until(lambda: self.reported_event(words), f"an event has {words!r}")
        late = time.time() - begin
        wait_until(lambda: self.is_recorded_since(begin), "seconds are kept again")
        self.assertTrue(self.served.json("/healthz")["ok"])
        self.assertLess(event["at_ms"] / 1000 - begin, NOTICED_S, late)
        return before

    def reported_event(self, words):
        status, body = self.served.ask("/api/events")
        if status == 503:  # the server is opening the history again, so it cannot list events
            return None
        events = [event for event in json.loads(body)["events"] if event["kind"] == "history"]
        return next((one for one in events if words in one["text"] and one["at_ms"] > 1000 * self.disturbed_at), None)

    def is_recorded_since(self, begin):
        status, body = self.served.ask(of(NAME, "history"), rows=5000)
        return status == 200 and any(row[0] > begin for row in json.loads(body)["rows"])

    def set_aside_path(self):
        recorded, = glob.glob(self.path + ".damaged-*Z")
        return recorded

    def test_moved(self):
        before = self.records_again_after(lambda: os.rename(self.path, self.path + ".old"), "was moved or removed")
        self.assertLessEqual(before, seconds_in(self.path + ".old"))
        self.assertTrue(seconds_in(self.path).isdisjoint(before))

    def test_moved_with_its_log(self):
        def move():
            for ending in ("", "-wal", "-shm"):
                os.rename(self.path + ending, self.path + ".old" + ending)
        before = self.records_again_after(move, "was moved or removed")
        self.assertLessEqual(before, seconds_in(self.path + ".old"))

    def test_moved_with_its_folder(self):
        end(self.served.process)
        folder = self.file("folder")
        os.mkdir(folder)
        self.path = os.path.join(folder, "history.sqlite")
        self.served = self.server(NAME, "--history", self.path)
        wait_until(lambda: len(self.rows()) >= 2, "it has two seconds")
        before = {row[0] for row in self.rows()}
        os.rename(folder, folder + ".old")
        wait_until(lambda: self.served.json("/healthz")["history"] == "failing", "it says so")
        self.assertEqual(self.served.encoder()["state"], "live")
        self.assertEqual(self.served.ask(of(NAME, "history"))[0], 503)
        os.mkdir(folder)
        wait_until(lambda: self.served.json("/healthz")["history"] == "good", "it is well again")
        wait_until(lambda: self.reported_event("could not be written"), "the missing rows are reported")
        self.assertLessEqual(before, seconds_in(os.path.join(folder + ".old", "history.sqlite")))

    def test_removed(self):
        self.records_again_after(lambda: os.unlink(self.path), "was moved or removed")

    def test_removed_with_its_log(self):
        def remove():
            for ending in ("", "-wal", "-shm"):
                os.unlink(self.path + ending)
        self.records_again_after(remove, "was moved or removed")

    def test_replaced_by_copy(self):
        copy = self.path + ".copy"
        with contextlib.closing(sqlite3.connect(self.path)) as database:
            database.execute("VACUUM INTO ?", (copy,))
        copied = seconds_in(copy)
        self.records_again_after(lambda: os.rename(copy, self.path), "was replaced")
        self.assertLessEqual(copied, seconds_in(self.path))

    def test_replaced_by_other_file(self):
        other = self.file("other", "")
        with open(other, "wb") as file:
            file.write(GARBAGE)
        self.records_again_after(lambda: os.replace(other, self.path), "it was renamed to")
        with open(self.set_aside_path(), "rb") as file:
            self.assertEqual(file.read(), GARBAGE)

    def test_truncated_to_nothing(self):
        self.records_again_after(lambda: os.truncate(self.path, 0), "it was renamed to")
        self.assertTrue(self.set_aside_path())

    def test_truncated_to_half(self):
        self.write_to_the_file()
        size = os.path.getsize(self.path)
        with open(self.path, "rb") as file:
            half = file.read(size // 2)
        self.records_again_after(lambda: os.truncate(self.path, size // 2), "it was renamed to")
        with open(self.set_aside_path(), "rb") as file:
            self.assertEqual(file.read(), half)

    def test_overwritten_by_copy(self):
        """The copied content is not valid together with the existing write-ahead log."""
        self.write_to_the_file()
        copy = self.path + ".copy"
        with contextlib.closing(sqlite3.connect(self.path)) as database:
            database.execute("VACUUM INTO ?", (copy,))
        with contextlib.closing(sqlite3.connect(copy)) as database:
            database.execute("DELETE FROM second WHERE at % 7 = 0")
            database.commit()
            database.execute("VACUUM")
        self.records_again_after(lambda: shutil.copyfile(copy, self.path), f"the history {self.path} ")
        # The server renames the overwritten file only if SQLite finds it invalid.
        if recorded := glob.glob(self.path + ".damaged-*Z"):
            self.assertEqual(seconds_in(copy), seconds_in(recorded[0]))
        self.assertTrue(seconds_in(self.path))

    def test_overwritten_by_garbage(self):
        def overwrite():
            with open(self.path, "r+b") as file:
                file.write(GARBAGE)
        self.records_again_after(overwrite, "it was renamed to")
        with open(self.set_aside_path(), "rb") as file:
            self.assertEqual(file.read()[:len(GARBAGE)], GARBAGE)

    def write_to_the_file(self, rows=5000):
        """Writes rows into the main database file of the history, not only into its write-ahead log."""
        with contextlib.closing(sqlite3.connect(self.path, timeout=PATIENCE)) as database:
            database.executemany("INSERT INTO second SELECT id, ?, 50, 0, 1, 2, 3, NULL, NULL, NULL FROM encoder",
                                 [(1_000_000 + i,) for i in range(rows)])
            database.commit()
            database.execute("PRAGMA wal_checkpoint(FULL)")
        wait_until(lambda: self.reported_event("was changed by another program"), "it tells that another has written")
        begin = time.time()
        wait_until(lambda: self.is_recorded_since(begin), "it goes on")


class UnusableFile(ServeCase):
    """Tests of a history that cannot be written: encoders must still be read."""

    def assert_failing(self, path, words, **settings):
        server = self.server(NAME, "--history", path, "--token-file", self.tokens(), **settings)
        wait_until(lambda: server.encoder()["state"] == "live", "it is read")
        health = server.json("/healthz")
        self.assertEqual((health["ok"], health["history"]), (False, "failing"))
        self.assertIn(words, server.json("/api/encoders")["history"]["trouble"])
        self.assertEqual(server.ask(of(NAME, "history"))[0], 503)
        status, answer = server.command(NAME, "memory-write", {"Authorization": f"Bearer {TOKEN}"}, argument=["5", "66"])
        self.assertEqual(status, 200, answer)
        return server

    def assert_well_again(self, server):
        wait_until(lambda: server.json("/healthz")["history"] == "good", "it is written")
        wait_until(lambda: server.ask(of(NAME, "history"))[0] == 200 and server.json(of(NAME, "history"))["rows"], "it has rows")

    def test_garbage(self):
        path = self.file("history.sqlite")
        with open(path, "wb") as file:
            file.write(GARBAGE)
        server = self.assert_failing(path, "move it away")
        with open(path, "rb") as file:
            # The server has left the file unchanged, because it may belong to another program.
            self.assertEqual(file.read(), GARBAGE)
        os.rename(path, path + ".old")
        self.assert_well_again(server)

    def test_missing_folder(self):
        folder = self.file("folder")
        server = self.assert_failing(os.path.join(folder, "history.sqlite"), "No such file")
        os.mkdir(folder)
        self.assert_well_again(server)

    def test_unwritable_folder(self):
        # The folder /sys stands for one in which nobody may create a file, not even root.
        self.assert_failing("/sys/absenc-history.sqlite", "/sys/absenc-history.sqlite")

    def test_full_disk(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))
        server = self.assert_failing(self.file("history.sqlite"), "history.sqlite", preexec_fn=limit)
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        self.assert_well_again(server)

    def test_locked_by_another_program(self):
        path = self.file("history.sqlite")
        with contextlib.closing(sqlite3.connect(path)) as database:
            database.execute("CREATE TABLE other (number INTEGER)")
            database.commit()
            database.execute("BEGIN EXCLUSIVE")
            server = self.assert_failing(path, "locked")
        self.assert_well_again(server)

    def test_used_by_another_server(self):
        path = self.file("history.sqlite")
        self.server(NAME, "--history", path)
        with self.assertRaisesRegex(AssertionError, "another server keeps its history"):
            Server(NAME, "--history", path)


DAY = 86_400


class WrongSystemClock(ServeCase):
    """Tests in which the system clock jumps, but not the clock of the readings."""

    def setUp(self):
        super().setUp()
        self.path = self.file("history.sqlite")
        library = glob.glob("/usr/lib/*/faketime/libfaketimeMT.so.1")
        self.assertTrue(library, "the package faketime is missing")
        self.settings = {"LD_PRELOAD": library[0], "FAKETIME_TIMESTAMP_FILE": self.file("clock"), "FAKETIME_NO_CACHE": "1",
                         "NO_FAKE_STAT": "1",  # libfaketime must not change the times of files
                         "FAKETIME_DONT_FAKE_MONOTONIC": "1"}
        self.wrong_by(0)

    def wrong_by(self, seconds):
        new = self.file("clock.new", f"{seconds:+d}\n")
        os.rename(new, self.settings["FAKETIME_TIMESTAMP_FILE"])

    def serve(self):
        return self.server(NAME, "--history", self.path, **self.settings)

    def wait_for_event(self, server, words):
        everything = {"from": 0, "to": int(time.time()) + 500 * DAY}
        wait_until(lambda: any(words in event["text"] for event in server.json("/api/events", **everything)["events"]),
                   f"an event has {words!r}")

    def wait_for_readings(self, server, more=150):
        """Waits for `more` readings. Returns the total number of readings."""
        before = server.json(of(NAME))["readings"]
        wait_until(lambda: server.json(of(NAME))["readings"] >= before + more, "it is read")
        return server.json(of(NAME))["readings"]

    def recorded(self, condition="1"):
        with contextlib.closing(sqlite3.connect(self.path)) as database:
            return database.execute(f"SELECT ifnull(sum(readings), 0) FROM second WHERE {condition}").fetchone()[0]

    def test_clock_ahead_by_days_deletes_nothing_even_across_restart(self):
        server = self.serve()
        self.wait_for_readings(server)
        self.wrong_by(400 * DAY)
        self.wait_for_event(server, "the clock jumped forward by 400 days")
        self.wait_for_readings(server)
        end(server.process)
        now = int(time.time())
        before = self.recorded(f"at < {now + DAY}")
        self.assertGreater(before, 0)
        self.assertGreater(self.recorded(f"at > {now + 300 * DAY}"), 0)
        server = self.serve()
        self.wait_for_readings(server)
        self.wrong_by(0)
        self.wait_for_event(server, "the clock jumped back by 400 days")
        end(server.process)
        self.assertGreaterEqual(self.recorded(f"at < {now + DAY}"), before)

    def test_step_back_loses_no_readings(self):
        server = self.serve()
        self.wait_for_readings(server)
        self.wrong_by(-600)
        self.wait_for_event(server, "the clock jumped back by 10 minutes")
        self.wait_for_readings(server)
        self.wrong_by(-602)  # sets the clock back by another 2 s: too little to be reported; some seconds occur twice
        readings = self.wait_for_readings(server)
        self.wait_for_readings(server)  # waits until the second in which the readings were recorded is over
        end(server.process)
        self.assertGreaterEqual(self.recorded(), readings)


if __name__ == "__main__":
    unittest.main()
