# SPDX-License-Identifier: Apache-2.0
"""Runs the tests inside the virtual machine, and prints "ok NAME" or "not ok NAME: WHY"."""
import fnmatch
import os
import subprocess
import sys
import unittest

FOLDER = os.path.dirname(os.path.abspath(__file__))


def kernel_log():
    return subprocess.run(["dmesg"], capture_output=True, text=True).stdout.splitlines()


class Result(unittest.TestResult):
    """A result of unittest that collects failures, and skipped tests as failures."""

    def startTest(self, test):
        super().startTest(test)
        self.problems = []
        self.log = len(kernel_log())

    def addFailure(self, test, err):
        super().addFailure(test, err)
        self.add(err[1], self.failures[-1][1])

    def addError(self, test, err):
        super().addError(test, err)
        self.add(err[1], self.errors[-1][1])

    def addSubTest(self, test, subtest, err):
        super().addSubTest(test, subtest, err)
        if err is not None:
            self.add(err[1], f"{subtest}\n{self._exc_info_to_string(err, test)}")

    def addSkip(self, test, reason):
        super().addSkip(test, reason)
        self.add(f"skipped: {reason}", "")

    def add(self, why, text):
        self.problems.append((" ".join(str(why).split()), text))

    def stopTest(self, test):
        super().stopTest(test)
        if not self.problems:
            print(f"ok {test.id()}", flush=True)
            return
        print(f"not ok {test.id()}: {self.problems[0][0]}")
        lines = [line for _, text in self.problems for line in text.splitlines()]
        for line in [*lines, "the kernel's log meanwhile:", *kernel_log()[self.log:]]:
            print(f"# {line}")
        sys.stdout.flush()


def tests_of(suite):
    for part in suite:
        if isinstance(part, unittest.TestSuite):
            yield from tests_of(part)
        else:
            yield part


def main(patterns):
    loaded = list(tests_of(unittest.defaultTestLoader.discover(FOLDER, pattern="*_test.py")))
    wanted = [test for test in loaded if not patterns or any(fnmatch.fnmatch(test.id(), f"*{p}*") for p in patterns)]
    unittest.TestSuite(wanted).run(Result())
    print(f"end of {len(wanted)} tests", flush=True)


main(sys.argv[1:])
