# SPDX-License-Identifier: Apache-2.0
"""Attacks `absenc serve` from one address. Clients of another address must still be served."""
from abuse_support import often

import contextlib
import os
import random
import resource
import socket
import unittest

from command_support import PATIENCE
from serve_support import ServeCase

ROUNDS = often(3, 60)
MUTANTS = often(300, 100_000)
SEED = int(os.environ.get("ABSENC_ABUSE_SEED", "1"))
STREAM = b"GET /api/stream HTTP/1.1\r\nHost: localhost\r\n\r\n"
SEEDS = (b"GET /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n", STREAM, b"GET /api/events?from=1&to=2 HTTP/1.1\r\nHost: localhost\r\n\r\n",
         b"POST /api/command HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5\r\n\r\nhello",
         b"POST /api/command HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n")


class Http(ServeCase):
    def setUp(self):
        super().setUp()
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(4096, hard), hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        self.served = self.server("sim:tformat?motion=rpm=60", "--history", self.file("history"))

    def connect(self, address="127.0.0.1"):
        return socket.create_connection(("127.0.0.1", self.served.port), PATIENCE, (address, 0))

    def assert_others_are_answered(self):
        for path in ("/healthz", "/metrics", "/api/encoders"):
            with self.connect("127.0.0.2") as other:
                other.sendall(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n".encode())
                self.assertIn(b" 200 ", other.recv(100).split(b"\r\n")[0])
        self.assertIsNone(self.served.process.poll())

    def test_serves_others_despite_many_connections(self):
        random_ = random.Random(SEED)
        for i in range(ROUNDS):
            kind = random_.choice((b"", b"G", STREAM, STREAM[:-2]))
            with self.subTest(seed=SEED, round=i, kind=kind), contextlib.ExitStack() as stack:
                for _ in range(random_.randrange(500, 2000)):
                    connection = stack.enter_context(self.connect())
                    with contextlib.suppress(OSError):
                        connection.sendall(kind)
                self.assert_others_are_answered()

    def test_serves_others_despite_mutated_requests(self):
        random_ = random.Random(SEED)
        for i in range(MUTANTS):
            request = bytearray(random_.choice(SEEDS))
            for _ in range(random_.randrange(1, 6)):
                at = random_.randrange(len(request))
                request[at:at + random_.randrange(3)] = random_.choice((b"", b"\r\n", b" ", b"\0", b"Content-Length: 3\r\n", random_.randbytes(2)))
            with self.connect() as connection, contextlib.suppress(OSError):
                connection.sendall(request)
            if i % 100 == 99:
                with self.subTest(seed=SEED, round=i):
                    self.assert_others_are_answered()


if __name__ == "__main__":
    unittest.main()
