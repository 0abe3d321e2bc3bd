#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests that verbs of absenc end by themselves on a pseudo-terminal that is never silent."""
import concurrent.futures
import json
import time
import unittest

from command_support import BabblingLine, Case, absenc

LIMIT = 40.0  # time limit of a command in seconds, long enough for a busy machine
AT_ONCE = 8  # number of commands that run in parallel; they mostly wait


def units():
    """Returns the entries of `absenc list --json` for the units with a character link."""
    listed = [json.loads(line) for line in absenc("list", "--json").stdout.splitlines()]
    return [unit for unit in listed if unit["link"] in ("half_duplex", "full_duplex")]


def least(argument):
    return str(max(argument["minimum"], 1))


def invocations(unit, encoder):
    """Yields command lines that communicate with an encoder and end by themselves."""
    verbs = {command["verb"] for command in unit["commands"]}
    yield "read", encoder
    yield "read", encoder, "--count", "2"
    yield "info", encoder
    yield "bench", encoder, "--seconds", "0.1"
    if "memory_read" in verbs:
        yield "memory", "read", encoder, "0"
    if unit["memory"]:
        yield "memory", "dump", encoder
    if "config_get" in verbs:
        yield "config", "get", encoder
    for verb in ("scan", "alarms", "temperature"):
        if verb in verbs:
            yield verb, encoder
    for verb in ("zero", "reset_multiturn", "clear_alarms"):
        if verb in verbs:
            yield verb.replace("_", "-"), encoder, "--yes"
    for command in unit["commands"]:
        arguments = [least(argument) for argument in command["arguments"] if argument["required"]]
        yield ("run", encoder, command["name"], *arguments, *(["--yes"] if command["changes_encoder"] else []))


class NeverSilentTest(Case):
    def run_all(self, period, pieces, wanted):
        """Runs each wanted command line on a line of its own that sends `pieces` with this period."""
        def one(unit, number):
            with BabblingLine(period, pieces) as line:
                arguments = list(invocations(unit, f"{unit['protocol']}:{line.path}"))[number]
                start = time.monotonic()
                return arguments, absenc(*arguments), time.monotonic() - start

        with concurrent.futures.ThreadPoolExecutor(AT_ONCE) as pool:
            waiting = [pool.submit(one, unit, number) for unit in units()
                       for number, arguments in enumerate(invocations(unit, "")) if wanted(arguments)]
            for future in waiting:
                arguments, result, duration = future.result()
                with self.subTest(arguments=arguments):
                    self.assertLess(duration, LIMIT)
                    self.assertIn(result.returncode, (0, 1), result.stderr)
                    # A command of the verb `run` may expect no reply and so succeed.
                    if arguments[0] != "run":
                        self.assert_failed(result)

    def test_every_command_ends_with_a_byte_every_5_ms(self):
        self.run_all(0.005, (b"\x55",), lambda arguments: True)

    def test_reading_ends_on_flooded_line(self):
        self.run_all(0, (b"\x55" * 64,), lambda arguments: arguments[0] in ("read", "zero", "scan"))

    def test_reading_ends_with_empty_lines_only(self):
        self.run_all(0.005, (b"\r",), lambda arguments: arguments[0] in ("read", "info", "zero"))

    def test_reports_received_bytes(self):
        with BabblingLine() as line:
            result = absenc("read", f"tformat:{line.path}?latency=500&echo=off")
        self.assert_failed(result, "something sends without a pause", "received 55 55 55", "find the node")

    def test_identify_ends_in_time(self):
        with BabblingLine() as line:
            start = time.monotonic()
            result = absenc("identify", line.path, "--for", "2")
            self.assertLess(time.monotonic() - start, LIMIT)
        self.assertEqual(result.returncode, 1, result.stderr)


if __name__ == "__main__":
    unittest.main()
