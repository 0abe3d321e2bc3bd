# SPDX-License-Identifier: Apache-2.0
"""Tests the files that `absenc record` writes, also after failures."""
import csv
import datetime
import glob
import json
import os
import pty
import random
import re
import signal
import subprocess
import time
import unittest

from command_support import ABSENC, PATIENCE, Emulator, EncoderCase, absenc, end

COLUMNS = ["time_s", "angle_deg", "singleturn", "singleturn_valid", "multiturn", "multiturn_valid", "status", "alarms",
           "position", "speed_rpm", "speed_uncertainty_rpm", "speed_delay_s", "missed", "event"]


def wait_until(condition, what):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > deadline:
            raise AssertionError(f"in vain waited for: {what}")
        time.sleep(0.005)


def read_csv(path):
    """Returns the header and the rows of a CSV recording, whose lines must be complete."""
    with open(path, encoding="utf-8", newline="") as file:
        text = file.read()
    if text and not text.endswith("\n"):
        raise AssertionError(f"the last line is cut: {text[-80:]!r}")
    lines = text.splitlines()
    header = dict(line[2:].split(": ", 1) for line in lines if line.startswith("# ") and ": " in line)
    rows = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    for row in rows:
        if None in row or None in row.values():
            raise AssertionError(f"not all columns: {row}")
    return header, rows


def rows_so_far(path):
    """Returns the rows written to a recording so far, or an empty list if it has no header yet."""
    return read_csv(path)[1] if os.path.exists(path) and os.path.getsize(path) > 0 else []


def read_json_lines(path):
    with open(path, encoding="utf-8") as file:
        first, *rest = [json.loads(line) for line in file.read().splitlines()]
    if rest and "absenc_end" in rest[-1]:
        if rest.pop() != {"absenc_end": 1, "rows": len(rest)}:
            raise AssertionError("the end counts other rows")
    return first, rest


def times(rows):
    return [float(row["time_s"]) for row in rows]


class RecordCase(EncoderCase):
    def output(self, name="log.csv"):
        return os.path.join(self.directory, name)

    def assert_rising(self, values):
        for before, after in zip(values, values[1:]):
            self.assertLess(before, after)


class Files(RecordCase):
    def test_csv(self):
        address = self.encoder("--singleturn", "74565", "--multiturn", "4660", "--alarm", "battery_alarm")
        before = datetime.datetime.now(datetime.timezone.utc)
        result = absenc("record", address, "--output", self.output(), "--count", "20", "--rate", "200")
        self.assert_good(result)
        self.assertIn("20 readings and 0 failures", result.stderr)
        self.assertEqual(result.stdout, "")
        header, rows = read_csv(self.output())
        self.assertEqual(list(rows[0]), COLUMNS)
        self.assertEqual((header["encoder"], header["protocol"], header["model"], header["rate_hz"], header["part"]),
                         (address, "tformat", "TS5700N8500", "200", "1"))
        self.assertIn("singleturn_bits=17", header["options"])
        self.assertEqual(header["singleturn"], "counts")
        started = datetime.datetime.fromisoformat(header["started"].replace("Z", "+00:00"))
        self.assertLess(abs((started - before).total_seconds()), PATIENCE)
        self.assert_rising(times(rows))
        # Rows that mark gaps between readings are left out, because a busy machine may cause gaps.
        rows = [row for row in rows if row["event"] != "gap"]
        self.assertEqual(len(rows), 20)
        for row in rows:
            self.assertEqual((row["singleturn"], row["singleturn_valid"], row["multiturn"], row["multiturn_valid"],
                              row["alarms"], row["position"], row["event"]),
                             ("74565", "true", "4660", "true", "battery_alarm", str(4660 * 2**17 + 74565), ""))
            self.assertAlmostEqual(float(row["angle_deg"]), 360 * 74565 / 2**17)
        self.assertEqual(rows[0]["speed_rpm"], "")
        self.assertEqual(float(rows[-1]["speed_rpm"]), 0)

    def test_json_lines(self):
        self.assert_good(absenc("record", self.encoder("--singleturn", "5"), "--output", self.output("log.jsonl"),
                                "--count", "12", "--rate", "10"))
        header, rows = read_json_lines(self.output("log.jsonl"))
        # Rows that mark gaps between readings are left out, because a busy machine may cause gaps.
        rows = [row for row in rows if row.get("event") != "gap"]
        self.assertEqual((header["absenc_record"], header["protocol"], header["model"]), (1, "tformat", "TS5700N8500"))
        self.assertIn("speed_rpm", header["units"])
        self.assertEqual([row["singleturn"] for row in rows], [5] * 12)
        self.assertEqual(rows[0]["position"], 5)
        self.assertEqual(rows[0]["speed_rpm"], None)
        # A busy machine may leave some rows without a speed.
        self.assertEqual({row["speed_rpm"] for row in rows[1:]} - {None}, {0})

    def test_speed_and_position_past_wrap(self):
        result = absenc("record", "sim:tformat?motion=rpm=-90", "--output", self.output(), "--for", "1.2")
        self.assert_good(result)
        rows = [row for row in read_csv(self.output())[1] if row["event"] == ""]
        self.assertLess(float(rows[-1]["position"]), float(rows[0]["position"]) - 1.5 * 2**17)
        self.assertIn("65535", [row["multiturn"] for row in rows])
        for row in rows[5:]:
            self.assertAlmostEqual(float(row["speed_rpm"]), -90, delta=1)
            # The position must fit its timestamp: the shaft makes 1.5 revolutions per second.
            self.assertAlmostEqual(float(row["position"]) - float(rows[0]["position"]),
                                   -1.5 * 2**17 * (float(row["time_s"]) - float(rows[0]["time_s"])), delta=20)

    def test_decimation(self):
        self.assert_good(absenc("record", "sim:tformat?motion=rpm=60", "--output", self.output(), "--rate", "1000",
                                "--every", "10", "--count", "20"))
        rows = [row for row in read_csv(self.output())[1] if row["event"] != "gap"]
        self.assertEqual(len(rows), 20)
        self.assertGreaterEqual(times(rows)[-1] - times(rows)[0], 0.189)

    def test_rate(self):
        self.assert_good(absenc("record", "sim:tformat", "--output", self.output(), "--rate", "50", "--for", "1"))
        _, rows = read_csv(self.output())
        self.assertEqual(sum(int(row["missed"] or 1) for row in rows), 50)
        for rate, words in (("1e-9", ["one reading in 1.16e+04 days"]), ("1e-300", ["too few"]), ("-1", ["--rate"])):
            with self.subTest(rate):
                for verb in (["record", "--output", self.output("b.csv")], ["monitor"], ["read"]):
                    self.assert_wrong_usage(absenc(*verb, "sim:tformat", "--rate", rate), *words)
        self.assertFalse(os.path.exists(self.output("b.csv")))
        for verb in (["record", "--output", self.output("c.csv")], ["monitor"]):
            self.assertIn("note: at --rate 0.5 a reading comes every 2 s, so --for 0.6 ends after the first",
                          absenc(*verb, "sim:tformat", "--rate", "0.5", "--for", "0.6").stderr)

    def test_parts_by_size(self):
        result = absenc("record", "sim:tformat?motion=rpm=60", "--output", self.output(), "--rate", "0", "--count", "300",
                        "--part-size", "0.004")
        self.assert_good(result)
        parts = sorted(glob.glob(os.path.join(self.directory, "log-*.csv")))
        self.assertGreater(len(parts), 3)
        self.assertEqual(os.path.basename(parts[0]), "log-0001.csv")
        self.assertIn(f"{parts[0]} to {parts[-1]}", result.stderr)
        together = []
        for number, part in enumerate(parts, 1):
            header, rows = read_csv(part)
            self.assertEqual(header["part"], str(number))
            self.assertTrue(rows)
            self.assertLess(os.path.getsize(part), 4200)
            together += rows
        self.assertEqual(len(together), 300)
        self.assert_rising(times(together))

    def test_parts_by_time(self):
        self.assert_good(absenc("record", "sim:tformat", "--output", self.output("a.jsonl"), "--for", "0.5", "--part-time",
                                "0.1"))
        parts = sorted(glob.glob(os.path.join(self.directory, "a-*.jsonl")))
        self.assertGreaterEqual(len(parts), 4)
        together = []
        for part in parts:
            _, rows = read_json_lines(part)
            self.assertLessEqual(rows[-1]["time_s"] - rows[0]["time_s"], 0.3)
            together += rows
        self.assert_rising(times(together))


class Gaps(RecordCase):
    """Tests of gaps: readings that were due but not taken."""

    def record_and_stop(self, name, stopped, *arguments):
        """Stops a recording for `stopped` seconds. Returns the final message of `record`."""
        path = self.output(name)
        process = self.start("record", "sim:tformat", "--output", path, "--rate", "200", "--for", "3", *arguments)
        wait_until(lambda: os.path.exists(path) and os.path.getsize(path) > 3000, "readings")
        process.send_signal(signal.SIGSTOP)
        time.sleep(stopped)
        process.send_signal(signal.SIGCONT)
        status, _, messages = process.wait(PATIENCE), *process.communicate(timeout=PATIENCE)
        self.assertEqual(status, 0, messages)
        return messages.decode()

    def test_stopped_process(self):
        message = self.record_and_stop("log.csv", 1)
        _, rows = read_csv(self.output())
        self.assert_rising(times(rows))
        gaps = [row for row in rows if row["event"] == "gap"]
        missed = [int(row["missed"]) for row in gaps]
        self.assertGreaterEqual(max(missed), 150)
        readings = [row for row in rows if row["event"] == ""]
        self.assertTrue(all(row["missed"] == "" for row in readings))
        self.assertEqual(len(readings) + sum(missed), 600)
        self.assertIn(f"{len(readings)} readings and 0 failures", message)
        self.assertIn(f"{sum(missed)} readings that were due were not taken, in {len(gaps)} gap", message)
        before = rows.index(gaps[missed.index(max(missed))]) - 1
        self.assertGreaterEqual(times(rows)[before + 2] - times(rows)[before], 0.9)

    def test_process_stopped_beyond_end(self):
        message = self.record_and_stop("log.jsonl", 3.2)
        _, rows = read_json_lines(self.output("log.jsonl"))
        missed = sum(row["missed"] for row in rows if row.get("event") == "gap")
        self.assertEqual(sum(row["ok"] for row in rows) + missed, 600)
        self.assertIn(f"{missed} readings that were due were not taken", message)
        self.assertEqual(rows[-1]["event"], "gap")

    def test_process_stopped_and_ended(self):
        path = self.output()
        process = self.start("record", "sim:tformat", "--output", path, "--rate", "200")
        wait_until(lambda: len(rows_so_far(path)) > 20, "readings")
        process.send_signal(signal.SIGSTOP)
        time.sleep(0.5)
        process.send_signal(signal.SIGTERM)
        messages = end(process, signal.SIGCONT)[2]
        rows = read_csv(path)[1]
        self.assertEqual(rows[-1]["event"], "gap", messages)
        self.assertGreaterEqual(int(rows[-1]["missed"]), 80)
        self.assertIn("readings that were due were not taken", messages)

    def test_line_too_slow_for_rate(self):
        address = self.encoder("--fault", "silence=1", latency=25)
        result = absenc("record", address, "--output", self.output(), "--rate", "100", "--for", "1")
        self.assertEqual(result.returncode, 1)
        _, rows = read_csv(self.output())
        failed = [row for row in rows if row["event"] == "timeout"]
        missed = sum(int(row["missed"]) for row in rows if row["event"] == "gap")
        self.assertGreater(missed, len(failed))
        self.assertIn(f"0 readings and {len(failed)} failures", result.stderr)
        self.assertIn(f"{missed} readings that were due were not taken", result.stderr)


class Failures(RecordCase):
    def lose(self, change, *words):
        """Records, calls `change(path)`, and expects that `record` ends with an error."""
        path = self.output(f"{len(os.listdir(self.directory))}.csv")
        process = self.start("record", "sim:tformat", "--output", path, "--every", "1000", "--rate", "100")
        wait_until(lambda: len(rows_so_far(path)) > 0, "readings")
        change(path)
        self.assertEqual(process.wait(PATIENCE), 1)
        messages = process.communicate()[1].decode()
        self.assert_sentence(messages, path, *words)
        self.assertNotIn("are in", messages)
        self.assertNotIn("is whole", messages)

    def test_removed_file(self):
        self.lose(os.remove, "was removed")

    def test_replaced_file(self):
        def replace(path):
            other = self.file("other", "precious\n")
            os.rename(other, path)
            self.addCleanup(lambda: self.assertEqual(open(path, encoding="utf-8").read(), "precious\n"))

        self.lose(replace, "was replaced by another")

    def test_moved_file(self):
        self.lose(lambda path: os.rename(path, path + ".1"), "was moved away")

    def test_truncated_file(self):
        self.lose(lambda path: os.truncate(path, 10), "was cut by another program")

    def test_removed_log_of_frames(self):
        log = self.output("bus.log")
        process = self.start("record", f"sim:raa38-can?log={log}", "--output", self.output())
        wait_until(lambda: len(rows_so_far(self.output())) > 3, "readings")
        os.remove(log)
        self.assertEqual(process.wait(PATIENCE), 1)
        self.assert_sentence(process.communicate()[1].decode(), log, "was removed", "what is written so far is whole")

    def test_summary_equals_file(self):
        with Emulator(self.directory) as first:
            process = self.start("record", f"tformat:{first.path}?latency=300", "--output", self.output())
            wait_until(lambda: len(rows_so_far(self.output())) > 5, "readings")
            first.kill()
            wait_until(lambda: read_csv(self.output())[1][-1]["event"] == "lost", "the loss in the file")
        messages = end(process, signal.SIGINT)[2]
        events = [row["event"] for row in read_csv(self.output())[1]]
        readings = events.count("")
        self.assertIn(f"{readings} readings and 0 failures", messages)
        self.assertIn("the port went away: 1", messages)
        good = int(re.search(r"exchanges: (\d+) good", messages)[1])
        beside = re.search(r"; (\d+) of the good exchanges gave no reading", messages)
        self.assertEqual(good, readings + (int(beside[1]) if beside else 0))

    def test_no_file_is_overwritten(self):
        with open(self.output(), "w", encoding="utf-8") as file:
            file.write("precious")
        self.assert_failed(absenc("record", "sim:tformat", "--output", self.output(), "--count", "1"), "already a file")
        with open(self.output(), encoding="utf-8") as file:
            self.assertEqual(file.read(), "precious")
        os.rename(self.output(), self.output("log-0007.csv"))
        self.assert_wrong_usage(absenc("record", "sim:tformat", "--output", self.output(), "--count", "1", "--part-size",
                                       "1"), "log-0007.csv", "another name")

    def test_refuses_wrong_usage(self):
        self.assert_wrong_usage(absenc("record", "sim:tformat"), "--output is missing")
        self.assert_wrong_usage(absenc("record", "sim:tformat", "--output", self.output("log.txt")), ".csv", ".jsonl")
        self.assert_wrong_usage(absenc("record", "sim:tformat", "--output", self.output(), "--every", "0"), "--every")
        self.assert_failed(absenc("record", "sim:tformat", "--output", os.path.join(self.directory, "no", "log.csv")),
                           "cannot be made", "No such file or directory")
        self.assert_failed(absenc("record", "tformat:/dev/nothing", "--output", self.output()), "no port /dev/nothing")
        self.assertFalse(os.path.exists(self.output()))

    def test_failures_have_rows(self):
        absenc("record", "sim:tformat?fault=truncate=0.7&singleturn=77", "--output", self.output(), "--rate", "0", "--for",
               "0.5")
        _, rows = read_csv(self.output())
        events = {row["event"] for row in rows}
        self.assertIn("", events)
        self.assertIn("wrong_length", events)
        for row in rows:
            self.assertEqual(row["singleturn"], "77" if row["event"] == "" else "")

    def test_unplugged_and_back(self):
        process = None
        with Emulator(self.directory, "--singleturn", "1000") as first:
            process = self.start("record", f"tformat:{first.path}?latency=300", "--output", self.output(), "--rate", "200")
            wait_until(lambda: len(rows_so_far(self.output())) > 20, "readings")
            first.kill()
        wait_until(lambda: read_csv(self.output())[1][-1]["event"] == "lost", "the loss in the file")
        with Emulator(self.directory, "--singleturn", "2000", "--alarm", "battery_alarm"):
            wait_until(lambda: len(read_csv(self.output())[1][-1]["singleturn"]) > 0, "readings again")
            status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        self.assertIn("went away", messages)
        self.assertIn("the port is back after", messages)
        _, rows = read_csv(self.output())
        self.assert_rising(times(rows))
        events = [row["event"] for row in rows]
        lost, back = events.index("lost"), events.index("back")
        self.assertEqual([event for event in events if event in ("lost", "back")], ["lost", "back"])
        self.assertEqual(back, lost + 1)
        for number, row in enumerate(rows):
            if row["event"] == "":
                self.assertEqual(row["singleturn"], "1000" if number < lost else "2000")
                self.assertEqual(row["alarms"], "none" if number < lost else "battery_alarm")

    def test_full_disk(self):
        """Uses a file system of 1 MB, mounted in a namespace of its own, as a disk that becomes full."""
        script = ('mount -t tmpfs -o size=1m absenc-test "$1" && "$0" record sim:tformat --rate 0 --output "$1/log.csv" 2>"$2"; '
                  'echo $? >"$3"; cp "$1/log.csv" "$4"; df --output=avail "$1"; umount "$1"')
        folder, messages, status, copy = (self.output(name) for name in ("disk", "messages", "status", "copy.csv"))
        os.mkdir(folder)
        shell = ["unshare", "--mount"] if os.geteuid() == 0 else ["unshare", "--user", "--map-root-user", "--mount"]
        if subprocess.run([*shell, "mount", "-t", "tmpfs", "-o", "size=1m", "absenc-test", folder], check=False,
                          capture_output=True).returncode != 0:
            self.skipTest("this machine does not let us mount a small file system")
        subprocess.run([*shell, "sh", "-c", script, ABSENC, folder, messages, status, copy], check=True,
                       capture_output=True, timeout=PATIENCE)
        with open(status, encoding="utf-8") as file:
            self.assertEqual(file.read(), "1\n")
        with open(messages, encoding="utf-8") as file:
            text = file.read()
        self.assert_sentence(text, "No space left on device", "what is written so far is whole")
        _, rows = read_csv(copy)
        self.assertIn(f"{len(rows)} readings", text)
        self.assertGreater(os.path.getsize(copy), 2**20 - 3 * 4096)

    def test_killed_recording_is_complete(self):
        """Every line must be complete, and at most the last second may be missing."""
        random.seed(1)
        for number in range(100):
            path = self.output(f"{number}.csv")
            process = self.start("record", "sim:tformat?motion=rpm=60", "--output", path, "--rate", "2000")
            wait_until(lambda p=path: os.path.exists(p), "the file")
            time.sleep(random.uniform(0.001, 0.05))
            killed = time.time()
            end(process, signal.SIGKILL)
            header, rows = read_csv(path)
            if not rows:
                self.assertLess(killed - os.path.getctime(path), 1)
                continue
            started = datetime.datetime.fromisoformat(header["started"].replace("Z", "+00:00")).timestamp()
            self.assertLess(killed - (started + times(rows)[-1]), 1)
            self.assert_rising(times(rows))

    def test_system_clock_set_back(self):
        library = glob.glob("/usr/lib/*/faketime/libfaketime.so.1")
        self.assertTrue(library, "the package faketime is missing")
        shift = self.file("shift", "+0")
        environment = {**os.environ, "LD_PRELOAD": library[0], "FAKETIME_TIMESTAMP_FILE": shift,
                       "FAKETIME_NO_CACHE": "1", "FAKETIME_DONT_FAKE_MONOTONIC": "1"}
        process = self.start("record", "sim:tformat", "--output", self.output(), "--part-time", "0.2", env=environment)
        part = self.output("log-0001.csv")
        wait_until(lambda: len(rows_so_far(part)) > 5, "readings")
        self.file("shift", "-3600")
        wait_until(lambda: os.path.exists(self.output("log-0003.csv")), "two parts more")
        status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        together = []
        for path in sorted(glob.glob(self.output("log-*.csv"))):
            together += read_csv(path)[1]
        self.assert_rising(times(together))
        self.assertLess(times(together)[-1], PATIENCE)

    def test_signal_ends_recording(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(number):
                path = self.output(f"{number}.csv")
                process = self.start("record", "sim:tformat", "--output", path)
                wait_until(lambda p=path: len(rows_so_far(p)) > 2, "readings")
                status, _, messages = end(process, number)
                self.assertEqual(status, 0)
                readings = [row for row in read_csv(path)[1] if row["event"] == ""]
                self.assertIn(f"{len(readings)} readings", messages)

    def test_progress_appears_only_on_terminals(self):
        terminal, ours = pty.openpty()
        process = subprocess.run([ABSENC, "record", "sim:tformat", "--output", self.output(), "--for", "0.3"], stdin=ours,
                                 stdout=subprocess.DEVNULL, stderr=ours, check=False, timeout=PATIENCE)
        os.close(ours)
        shown = os.read(terminal, 4096).decode()
        os.close(terminal)
        self.assertEqual(process.returncode, 0)
        self.assertRegex(shown, r"\r\x1b\[K\d.*: \d+ readings, .* 0 failures, \d+ bytes")
        quiet = absenc("record", "sim:tformat", "--output", self.output("b.csv"), "--for", "0.3")
        self.assertEqual(len(quiet.stderr.splitlines()), 1)


if __name__ == "__main__":
    unittest.main()
