# SPDX-License-Identifier: Apache-2.0
"""Shared by the tests of the absenc command."""
import contextlib
import itertools
import json
import os
import re
import select
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import tty
import unittest

ABSENC = os.path.abspath(os.environ.get("ABSENC", "build/release/bin/absenc"))
os.environ.setdefault("ABSENC_CHANGES", "none")  # the tests must not write to the user's journal of changes
# Usual time limit of a wait, in seconds.
PATIENCE = float(os.environ.get("ABSENC_PATIENCE", "60"))


def absenc(*arguments, **settings):
    """Runs the absenc command and returns its completed process."""
    settings.setdefault("stdin", subprocess.DEVNULL)
    settings.setdefault("timeout", PATIENCE)
    return subprocess.run([ABSENC, *arguments], capture_output=True, text=True, **settings)


def read_line(stream, deadline):
    """Returns one line of an unbuffered binary stream; None at the deadline or the end."""
    line = b""
    while not line.endswith(b"\n"):
        left = deadline - time.monotonic()
        if left <= 0 or not select.select([stream], [], [], left)[0]:
            return None
        byte = os.read(stream.fileno(), 1)
        if not byte:
            return None
        line += byte
    return line.decode()


def end(process, number=signal.SIGTERM):
    """Sends a signal and returns exit status, standard output and standard error."""
    if process.poll() is None:
        process.send_signal(number)
    out, err = process.communicate(timeout=PATIENCE)
    return process.returncode, out.decode(), err.decode()


def run_tool(*command, timeout=100, **settings):
    """Runs a program, such as a compiler, that must succeed, and returns its standard output."""
    done = subprocess.run([str(word) for word in command], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=timeout, check=False, **settings)
    if done.returncode != 0:
        raise AssertionError(f"{shlex.join(map(str, command))}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def wait_for_handler(process):
    """Waits until the process has a handler for SIGINT. Before that, SIGINT would kill the process."""
    if os.environ.get("ABSENC_IN_QEMU"):
        raise unittest.SkipTest("qemu itself handles every signal, so nothing shows when the command does")
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        with open(f"/proc/{process.pid}/status", encoding="ascii") as file:
            caught = int(re.search(r"^SigCgt:\s*(\w+)$", file.read(), re.MULTILINE).group(1), 16)
        if caught >> (signal.SIGINT - 1) & 1:
            return
    raise AssertionError(f"in vain waited until process {process.pid} catches SIGINT")


def character_units():
    """Returns the units with a character link: from name to entry in `absenc list --json`."""
    return {unit["protocol"]: unit for unit in json_lines(absenc("list", "--json").stdout)
            if unit["link"] in ("half_duplex", "full_duplex")}


class Busy:
    """A context with `count` processes that use all the processor time that they get."""

    def __init__(self, count):
        self.processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for process in self.processes:
            process.kill()
            process.wait()


class Emulator:
    """A process of `absenc emulate`, which is ready. `path` is its port."""

    def __init__(self, directory, *arguments, protocol="tformat", name="encoder", line="--pty",
                 stdin=subprocess.DEVNULL):
        self.path = os.path.join(directory, name)
        command = [ABSENC, "emulate", protocol, line, self.path, *arguments]
        self.process = subprocess.Popen(command, bufsize=0, stdin=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.ready = self.line()
        if self.ready is None:
            raise AssertionError(f"the emulator did not become ready: {end(self.process)}")

    def line(self):
        return read_line(self.process.stdout, time.monotonic() + PATIENCE)

    def end(self, number=signal.SIGTERM):
        return end(self.process, number)

    def kill(self):
        """Kills the emulator and removes its link."""
        os.unlink(self.path)
        self.process.kill()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()


class FakeLine:
    """A pseudo-terminal whose far end is a thread, in which `serve` of a derived class runs."""

    def __init__(self):
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.path = os.ttyname(self.slave)
        self.wake, self.waker = os.pipe()
        self.thread = threading.Thread(target=self.serve)

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        os.write(self.waker, b"x")
        self.thread.join()
        for descriptor in (self.master, self.slave, self.wake, self.waker):
            os.close(descriptor)


class FakeEncoder(FakeLine):
    """A fake encoder with fixed replies, by the first byte of a request."""

    def __init__(self, replies=b""):
        super().__init__()
        self.replies = replies if isinstance(replies, dict) else {0x1A: bytes(replies)}

    def answer(self, request):
        return self.replies.get(request[0], b"")

    def serve(self):
        while True:
            ready, _, _ = select.select([self.master, self.wake], [], [])
            if self.wake in ready:
                return
            os.write(self.master, self.answer(os.read(self.master, 64)))


class BabblingLine(FakeLine):
    """A line that sends one of `pieces` every `period` seconds, in turn; 0: as fast as possible."""

    def __init__(self, period=0.005, pieces=(b"\x55",)):
        super().__init__()
        self.period = period
        self.pieces = pieces
        os.set_blocking(self.master, False)

    def serve(self):
        due = time.monotonic()
        for piece in itertools.cycle(self.pieces):
            # If this thread was late, the next period begins now, and not at the time at which it was due.
            due = max(due + self.period, time.monotonic())
            writable = [self.master] if self.period == 0 else []
            timeout = None if self.period == 0 else max(due - time.monotonic(), 0)
            if select.select([self.wake], writable, [], timeout)[0]:
                return
            for transfer in (lambda: os.write(self.master, piece), lambda: os.read(self.master, 4096)):
                with contextlib.suppress(BlockingIOError):
                    transfer()


class Case(unittest.TestCase):
    """A test with a temporary directory that every user may read."""

    def setUp(self):
        self.directory = tempfile.mkdtemp(prefix="absenc-test-")
        os.chmod(self.directory, 0o755)
        self.addCleanup(shutil.rmtree, self.directory)

    def file(self, name, text=None):
        path = os.path.join(self.directory, name)
        if text is not None:
            with open(path, "w", encoding="utf-8") as file:
                file.write(text)
        return path

    def watch(self, *arguments, until, **settings):
        """Runs `monitor --json` until `until(readings)` is true; returns the live readings by encoder."""
        process = subprocess.Popen([ABSENC, "monitor", *arguments, "--json", "--interval", "0.1"], bufsize=0,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, **settings)
        self.addCleanup(lambda: end(process, signal.SIGKILL) if process.poll() is None else None)
        deadline = time.monotonic() + PATIENCE
        live = {}
        while not until(live):
            text = read_line(process.stdout, deadline)
            if text is None:
                self.fail(f"in vain waited for it: {live}\n{end(process)}")
            line = json.loads(text)
            if line["state"] == "live":
                live[line["encoder"]] = line["reading"]
        status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        return live

    def assert_good(self, result):
        self.assertEqual(result.returncode, 0, f"{result.stdout}\n{result.stderr}")

    def assert_wrong_usage(self, result, *words):
        """Expects exit status 2, an error message with these words, and no standard output."""
        self.assertEqual(result.returncode, 2, f"{result.stdout}\n{result.stderr}")
        self.assertEqual(result.stdout, "")
        self.assert_sentence(result.stderr, *words)

    def assert_failed(self, result, *words):
        self.assertEqual(result.returncode, 1, f"{result.stdout}\n{result.stderr}")
        self.assert_sentence(result.stderr, *words)

    def assert_sentence(self, text, *words):
        self.assertTrue(text.startswith("absenc: "), text)
        for word in words:
            self.assertIn(word, text)


class EncoderCase(Case):
    """A test with emulators, and with absenc commands that run in the background."""

    def emulator(self, *arguments):
        emulator = Emulator(self.directory, *arguments)
        self.addCleanup(emulator.end)
        return emulator

    def encoder(self, *arguments, latency=300, more=""):
        """Returns the address of a new emulator, with a latency that allows for a busy machine."""
        return f"tformat:{self.emulator(*arguments).path}?latency={latency}{more}"

    def start(self, *arguments, **settings):
        settings.setdefault("stdin", subprocess.DEVNULL)
        process = subprocess.Popen([ABSENC, *arguments], bufsize=0, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   **settings)
        self.addCleanup(lambda: end(process, signal.SIGKILL) if process.poll() is None else None)
        return process

    def first_line(self, process):
        line = read_line(process.stdout, time.monotonic() + PATIENCE)
        self.assertIsNotNone(line)
        return line


def json_lines(text):
    return [json.loads(line) for line in text.splitlines()]
