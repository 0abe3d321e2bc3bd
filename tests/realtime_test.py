# SPDX-License-Identifier: Apache-2.0
"""Tests the option --realtime of `absenc`, and the punctuality that `absenc bench --rate` shows.

Where the kernel of the test machine refuses real-time threads, the tests of threads expect the error instead.
"""
import json
import os
import subprocess
import threading
import time
import unittest

from command_support import ABSENC, PATIENCE, EncoderCase, absenc, end, read_line

PRIORITY = 7
ENCODER = "sim:tformat?motion=rpm=60"
REALTIME = ("--realtime", str(PRIORITY))


def kernel_allows():
    """Returns whether a thread of this user may be real-time and lock the memory, without the code under test."""
    refused = []

    def try_it():
        try:
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(PRIORITY))
        except PermissionError as error:
            refused.append(error)

    thread = threading.Thread(target=try_it)
    thread.start()
    thread.join()
    limit = subprocess.run(["prlimit", "--memlock", "--output=SOFT", "--noheadings"], capture_output=True, text=True, check=True)
    return not refused and (os.geteuid() == 0 or limit.stdout.strip() == "unlimited")


def without(limit, capability):
    """Returns the beginning of a command line that sets a limit to 0 and, for root, removes a capability."""
    capabilities = ["setpriv", f"--bounding-set=-{capability}"] if os.geteuid() == 0 else []
    return [*capabilities, "prlimit", f"--{limit}=0:0"]


def policies(process):
    """Returns the number of threads of each scheduling policy and priority."""
    counted = {}
    for thread in os.listdir(f"/proc/{process.pid}/task"):
        try:
            policy = os.sched_getscheduler(int(thread)) & ~os.SCHED_RESET_ON_FORK
            key = ("fifo" if policy == os.SCHED_FIFO else "other", os.sched_getparam(int(thread)).sched_priority)
        except ProcessLookupError:  # the thread has ended since the list of threads was read
            continue
        counted[key] = counted.get(key, 0) + 1
    return counted


def locked_kb(process):
    with open(f"/proc/{process.pid}/status", encoding="ascii") as status:
        return int(next(line for line in status if line.startswith("VmLck:")).split()[1])


class RealTime(EncoderCase):
    def assert_refused(self, result):
        self.assertEqual(result.returncode, 1, result.stderr)
        self.assertEqual(result.stdout, "")
        for part in ("the kernel refuses", "Try: ", "/etc/security/limits.conf", "systemd unit", "CAP_"):
            self.assertIn(part, result.stderr)

    def assert_threads(self, process, fifo):
        """Waits until so many threads of the process are real-time ones."""
        deadline = time.monotonic() + PATIENCE
        while policies(process).get(("fifo", PRIORITY), 0) != fifo:
            self.assertLess(time.monotonic(), deadline, policies(process))
            time.sleep(0.01)
        self.assertEqual(set(policies(process)) - {("fifo", PRIORITY), ("other", 0)}, set())
        self.assertGreater(locked_kb(process), 1000)

    def started(self, *arguments):
        """Starts a command that reads with --realtime. Returns its process, or None after the expected refusal."""
        if not kernel_allows():
            self.assert_refused(absenc(*arguments, *REALTIME))
            return None
        return self.start(*arguments, *REALTIME)

    def test_thread_that_reads_is_real_time(self):
        for verb, *more in (("read", "--count", "0"), ("record", "--output", self.file("log.csv"))):
            with self.subTest(verb):
                process = self.started(verb, ENCODER, *more)
                if process is not None:
                    self.assert_threads(process, 1)
                    self.assertNotIn(("other", 0), policies(process))
                    end(process)

    def test_only_threads_that_read_are_real_time(self):
        encoders = (ENCODER, "sim:esl", "sim:biss")
        for verb, *more in (("monitor", "--json"), ("serve", "--history", "none", "--listen", ":0")):
            with self.subTest(verb):
                process = self.started(verb, *encoders, *more)
                if process is not None:
                    self.assert_threads(process, len(encoders))
                    self.assertGreaterEqual(policies(process)[("other", 0)], 1)
                    end(process)

    def test_setting_of_absenc_toml_counts_before_option(self):
        settings = {**os.environ, "ABSENC_CONFIG": self.file(
            "absenc.toml", f'[encoder.elbow]\nprotocol = "tformat"\nport = "sim"\nrealtime = {PRIORITY + 1}\n[encoder.wrist]\nprotocol = "esl"\nport = "sim"\n')}
        arguments = ("serve", "--history", "none", "--listen", ":0")
        if not kernel_allows():
            return self.assert_refused(absenc(*arguments, *REALTIME, env=settings))
        process = self.start(*arguments, *REALTIME, env=settings)
        self.assert_threads_of_both(process)
        end(process)

    def assert_threads_of_both(self, process):
        deadline = time.monotonic() + PATIENCE
        while not {("fifo", PRIORITY), ("fifo", PRIORITY + 1)} <= set(policies(process)):
            self.assertLess(time.monotonic(), deadline, policies(process))
            time.sleep(0.01)

    def test_without_option_nothing_is_real_time(self):
        process = self.start("read", ENCODER, "--count", "0")
        self.assertIsNotNone(read_line(process.stdout, time.monotonic() + PATIENCE))
        self.assertEqual(policies(process), {("other", 0): 1})
        self.assertEqual(locked_kb(process), 0)
        end(process)

    def test_refusal_has_three_parts_and_ends_every_verb(self):
        verbs = (("read",), ("record", "--output", self.file("log.csv")), ("monitor",), ("bench",),
                 ("serve", "--history", "none", "--listen", ":0"))
        for limit, capability, evidence in (("rtprio", "sys_nice", "`ulimit -r` is 0"), ("memlock", "ipc_lock", "`ulimit -l` is 0 kB")):
            for verb, *more in verbs:
                with self.subTest(verb, limit=limit):
                    command = [*without(limit, capability), ABSENC, verb, ENCODER, *more, *REALTIME]
                    result = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, stdin=subprocess.DEVNULL, check=False)
                    self.assert_refused(result)
                    if kernel_allows():
                        self.assertIn(evidence, result.stderr)
                    self.assertFalse(os.path.exists(self.file("log.csv")))

    def test_priority_must_be_possible(self):
        for priority in ("0", "100", "high", "-1"):
            self.assert_wrong_usage(absenc("read", ENCODER, f"--realtime={priority}"), "realtime", "1", "99")
        self.assert_wrong_usage(absenc("read", f"{ENCODER}&realtime=5", *REALTIME), "realtime is given twice")


class Punctuality(EncoderCase):
    def test_bench_shows_deviation_from_period(self):
        result = absenc("bench", ENCODER, "--rate", "200", "--seconds", "1", "--json")
        self.assert_good(result)
        measured = json.loads(result.stdout)
        cycle = measured["cycle_us"]
        self.assertEqual(cycle["period"], 5000)
        self.assertGreater(cycle["deviation_max"], 0)
        self.assertLessEqual(cycle["deviation_p99.9"], cycle["deviation_max"])
        self.assertLessEqual(measured["readings"], 201)
        self.assertIn("every 5 ms; deviation of 99.9 %", absenc("bench", ENCODER, "--rate", "200", "--seconds", "0.2").stdout)

    def test_bench_sees_pause_of_process(self):
        process = self.start("bench", ENCODER, "--rate", "100", "--seconds", "2", "--json")
        time.sleep(1)
        os.kill(process.pid, 19)  # SIGSTOP, which pauses the process
        time.sleep(0.3)
        os.kill(process.pid, 18)  # SIGCONT, which continues the process
        cycle = json.loads(self.first_line(process))["cycle_us"]
        end(process)
        self.assertGreater(cycle["deviation_max"], 200_000)

    def test_bench_without_rate_has_no_period(self):
        self.assertNotIn("cycle_us", json.loads(absenc("bench", ENCODER, "--seconds", "0.1", "--json").stdout))


if __name__ == "__main__":
    unittest.main()
