# SPDX-License-Identifier: Apache-2.0
"""Tests late replies with the absenc command, through a relay that delays replies."""
import json
import os
import re
import select
import socket
import threading
import time
import tempfile
import tty
import unittest

from command_support import Emulator, absenc, end

# Each value: unit, options, size of a position request in bytes, size of its reply in bytes; None: size not checked
ENCODERS = {
    "tformat": ("tformat", "", 1, 11),
    "esl": ("esl", "", 2, 18),
    "e201": ("e201", "", 1, 17),
    "raa38-modbus": ("raa38-modbus", "?bits=16", 8, None),
    "raa38": ("raa38", "?mode=bus&bits=16", 3, 5),
}


class DelayingRelay(threading.Thread):
    """Forwards bytes in order. The n-th reply arrives `delay(n)` seconds late."""

    def __init__(self, host, encoder, delay):
        super().__init__(daemon=True)
        self.host, self.encoder, self.delay = host, encoder, delay
        self.requests = 0  # number of requests (bursts of bytes) received from the host so far
        # replies sent to the host: (number of the request, number of requests received by then, bytes)
        self.forwarded = []
        self.delayed = []  # delayed replies, not sent to the host yet: (time to send, number of the request, bytes)
        self.replies = 0
        self.stop, self.wake = os.pipe()

    def run(self):
        while True:
            now = time.monotonic()
            while self.delayed and self.delayed[0][0] <= now:
                _, burst, data = self.delayed.pop(0)
                self.forwarded.append((burst, self.requests, data))
                os.write(self.host, data)
            limit = max(0, self.delayed[0][0] - now) if self.delayed else None
            ready = select.select([self.host, self.encoder, self.stop], [], [], limit)[0]
            if self.stop in ready:
                return
            if self.encoder in ready:
                data = os.read(self.encoder, 4096)
                at = time.monotonic() + self.delay(self.replies)
                self.replies += 1
                last = self.delayed[-1][0] if self.delayed else 0
                self.delayed.append((max(at, last), self.requests, data))
            if self.host in ready:
                try:
                    data = os.read(self.host, 4096)
                except OSError:  # the host has closed its pseudo-terminal
                    time.sleep(0.001)
                    continue
                if not data:
                    return
                self.requests += 1
                os.write(self.encoder, data)

    def replies_in_time(self):
        """Returns those replies that were forwarded before the host sent another request."""
        return [data for burst, asked, data in self.forwarded if burst == asked]

    def end(self):
        os.write(self.wake, b".")
        self.join()


def raw(descriptor):
    tty.setraw(descriptor)
    return descriptor


class LateReplyTest(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.TemporaryDirectory(prefix="absenc.")
        self.addCleanup(self.directory.cleanup)

    def pty_relay(self, encoder, delay):
        """Returns a relay to a new emulator, and the path of the pseudo-terminal for the host."""
        unit, _, _, _ = ENCODERS[encoder]
        options = [f"--option={option}" for option in ENCODERS[encoder][1].lstrip("?").split("&") if option]
        self.emulators = getattr(self, "emulators", 0) + 1
        emulator = Emulator(self.directory.name, "--motion", "rpm=6", *options, protocol=unit,
                            name=f"encoder{self.emulators}")
        self.addCleanup(end, emulator.process)
        master, slave = os.openpty()
        raw(slave)
        path = os.ttyname(slave)
        far = raw(os.open(emulator.path, os.O_RDWR | os.O_NOCTTY))
        relay = DelayingRelay(master, far, delay)
        relay.start()
        self.addCleanup(lambda: [os.close(descriptor) for descriptor in (master, slave, far)])
        self.addCleanup(relay.end)
        return relay, f"{encoder}:{path}{ENCODERS[encoder][1]}"

    def tcp_relay(self, encoder, delay):
        relay, _ = self.pty_relay(encoder, delay)
        server = socket.create_server(("127.0.0.1", 0))
        self.addCleanup(server.close)

        def serve():
            connection, _ = server.accept()
            relay.end()
            over_tcp = DelayingRelay(connection.fileno(), relay.encoder, delay)
            self.over_tcp = over_tcp
            with connection:
                over_tcp.run()

        threading.Thread(target=serve, daemon=True).start()
        return f"{encoder}:tcp:127.0.0.1:{server.getsockname()[1]}{ENCODERS[encoder][1]}"

    def positions_in(self, encoder, replies):
        """Returns the positions that `decode` finds in these replies, each decoded alone."""
        unit, options, _, _ = ENCODERS[encoder]
        request = {"tformat": "1A", "esl": None, "e201": "34", "raa38": "BC AA B1", "raa38-modbus": None}[encoder]
        found = set()
        for data in set(replies):
            words = ["decode", unit, "--hex", data.hex(" "), "--json"]
            for option in options.lstrip("?").split("&"):
                words += ["--option", option] if option else []
            if request:
                words += ["--request", request]
            row = json.loads(absenc(*words).stdout.splitlines()[-1])
            if row["ok"]:
                found.add(row["fields"].get("singleturn", row["fields"].get("position")))
        return found

    def check(self, encoder, relay, rows):
        shown = [row["singleturn"] for row in rows if row.get("ok", True) and row.get("singleturn") is not None]
        replies_in_time = self.positions_in(encoder, relay.replies_in_time())
        stale = [position for position in shown if position not in replies_in_time]
        self.assertEqual(stale, [], f"{len(stale)} of {len(shown)} positions are older than their request")
        return len(shown)

    def test_one_late_reply(self):
        """Without protection, each later reading would show the previous position."""
        for encoder in ENCODERS:
            with self.subTest(encoder):
                relay, address = self.pty_relay(encoder, lambda n: 0.06 if n == 6 else 0)
                done = absenc("read", address, "--count", "40", "--rate", "50", "--json")
                rows = [json.loads(line) for line in done.stdout.splitlines()]
                self.assertGreater(self.check(encoder, relay, rows), 10)

    def test_all_replies_late(self):
        """The command must report an error with advice, and no position of an earlier request."""
        for encoder in ("tformat", "esl", "e201"):
            with self.subTest(encoder):
                relay, address = self.pty_relay(encoder, lambda n: 0.25)
                # Ten readings take a second, in which late replies also come from a busy machine.
                done = absenc("read", address, "--count", "10", "--json")
                rows = [json.loads(line) for line in done.stdout.splitlines()]
                self.check(encoder, relay, rows)
                self.assertEqual(done.returncode, 1, done.stdout)
                self.assertIn("latency=", rows[-1]["advice"], rows)
                # With the latency that the advice names, the encoder must be readable.
                latency = re.search(r"latency=(\d+)", rows[-1]["advice"]).group(1)
                joined = "&" if "?" in address else "?"
                done = absenc("read", f"{address}{joined}latency={latency}", "--count", "3", "--json")
                self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_record_and_bench(self):
        for encoder in ("tformat", "raa38"):
            with self.subTest(encoder):
                relay, address = self.pty_relay(encoder, lambda n: 0.1 if n % 7 == 5 else 0)
                path = os.path.join(self.directory.name, f"{encoder}.jsonl")
                done = absenc("record", address, "--rate", "100", "--for", "2", "--output", path)
                self.assertIn(done.returncode, (0, 1), done.stderr)
                with open(path, encoding="utf-8") as file:
                    rows = [json.loads(line) for line in file]
                self.assertGreater(self.check(encoder, relay, rows), 0)

    def test_over_tcp(self):
        for encoder in ("tformat", "e201"):
            with self.subTest(encoder):
                # The replies are delayed by 0.6 s; the timeout over a network is 250 ms, and 300 ms for E201.
                address = self.tcp_relay(encoder, lambda n: 0.6)
                done = absenc("read", address, "--count", "5", "--rate", "10", "--json")
                rows = [json.loads(line) for line in done.stdout.splitlines()]
                self.check(encoder, self.over_tcp, rows)
                self.assertEqual(done.returncode, 1)
                self.assertIn("latency=", rows[-1]["advice"], rows)


if __name__ == "__main__":
    unittest.main()
