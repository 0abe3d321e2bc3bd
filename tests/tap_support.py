# SPDX-License-Identifier: Apache-2.0
"""Shared by the tests of `absenc tap`: a relay that copies a line, and the `tap` process."""
import os
import select
import signal
import subprocess
import threading
import time
import tty

from command_support import ABSENC, PATIENCE, Case, Emulator, end, json_lines, read_line


class Relay:
    """Forwards bytes between host and encoder, and copies them to a tap. `change` may alter them."""

    def __init__(self, encoder_path, change=lambda data, from_host: data, copy_to=None):
        self.change = change
        self.copied = bytearray()
        self.opened = []
        self.host, self.host_path = self.pseudo_terminal()
        if copy_to is None:
            self.tap, self.tap_path = self.pseudo_terminal()
        else:
            self.tap, self.tap_path = os.open(copy_to, os.O_RDWR | os.O_NOCTTY), None
            self.opened.append(self.tap)
        for master in (self.host, self.tap):
            os.set_blocking(master, False)
        self.encoder = os.open(encoder_path, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(self.encoder)
        self.from_tap = bytearray()  # bytes that tap has sent to the line; there must be none
        self.wake, self.waker = os.pipe()
        self.thread = threading.Thread(target=self.run)

    def pseudo_terminal(self):
        master, slave = os.openpty()
        tty.setraw(slave)
        self.opened += master, slave
        return master, os.ttyname(slave)

    def run(self):
        while True:
            ready = select.select([self.host, self.encoder, self.tap, self.wake], [], [])[0]
            if self.wake in ready:
                return
            if self.tap in ready:
                self.from_tap += os.read(self.tap, 4096)
            # The encoder's bytes are copied first: if both sides have sent, the host's bytes may be the request after
            # this reply.
            for here, there in ((self.encoder, self.host), (self.host, self.encoder)):
                if here in ready:
                    data = self.change(os.read(here, 4096), here == self.host)
                    self.write(self.tap, data)
                    self.copied += data
                    self.write(there, data)

    def write(self, descriptor, data):
        while data:
            ready = select.select([self.wake], [descriptor], [])
            if ready[0]:
                return
            data = data[os.write(descriptor, data):]

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        os.write(self.waker, b"x")
        self.thread.join(PATIENCE)
        for descriptor in (*self.opened, self.encoder, self.wake, self.waker):
            os.close(descriptor)


class TapCase(Case):
    def emulator(self, protocol, *arguments, name="encoder"):
        emulator = Emulator(self.directory, *arguments, protocol=protocol, name=name)
        self.addCleanup(emulator.end)
        return emulator

    def relay(self, emulator, **settings):
        relay = Relay(emulator.path, **settings)
        relay.__enter__()
        self.addCleanup(relay.__exit__)
        return relay

    def tap(self, *arguments, stdin=subprocess.DEVNULL):
        """Starts `tap` with its output in a file. Returns the process when tap is ready."""
        out, messages = open(self.file("out"), "w+b"), subprocess.PIPE
        self.addCleanup(out.close)
        process = subprocess.Popen([ABSENC, "tap", *arguments], stdin=stdin, stdout=out, stderr=messages, bufsize=0)
        self.addCleanup(lambda: end(process, signal.SIGKILL) if process.poll() is None else None)
        process.out, process.messages = out, ""
        while "frames are told apart" not in process.messages:
            line = read_line(process.stderr, time.monotonic() + PATIENCE)
            self.assertIsNotNone(line, process.messages)
            process.messages += line
        return process

    def finish(self, process, number=signal.SIGINT):
        """Ends `tap` with the signal `number`. Returns its exit status, output and messages."""
        if process.poll() is None:
            process.send_signal(number)
        _, messages = process.communicate(timeout=PATIENCE)
        process.out.seek(0)
        return process.returncode, process.out.read().decode(), process.messages + messages.decode()

    def wait_for(self, process, found):
        """Waits until `found(output)` is true for the output of `tap` so far. Returns the output."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            with open(process.out.name, encoding="utf-8") as file:
                text = file.read()
            if found(text):
                return text
            select.select([], [], [], 0.02)
        self.fail(f"in vain waited: {text[-1000:]}")

    def wait_for_all(self, process, relay):
        """Waits until `tap --json` has printed each byte that the relay copied."""
        self.wait_for(process, lambda text: joined(json_lines(text[:text.rfind("\n") + 1])) == relay.copied.hex())

    def lines(self, text):
        lines = json_lines(text)
        return [line for line in lines if "summary" not in line], lines[-1].get("summary")


def joined(lines):
    return "".join(line.get("request", "") + line.get("reply", "") for line in lines).lower()
