# SPDX-License-Identifier: Apache-2.0
"""The history file of a running `absenc serve` is damaged, or the server is killed."""
from abuse_support import often

import contextlib
import os
import random
import sqlite3
import time
import unittest

from serve_support import TOKEN, ServeCase, of, wait_until

NAME = "sim:tformat?motion=rpm=60"
ROUNDS = often(6, 200)
KILLS = often(3, 100)
SEED = int(os.environ.get("ABSENC_ABUSE_SEED", "1"))


def harm(random_, path):
    """Moves, removes, replaces or damages the history file. Returns what was done."""
    way = random_.choice(("move", "move all", "remove", "remove all", "replace", "cut off", "overwrite"))
    size = os.path.getsize(path)
    if way.startswith("move"):
        for ending in ("", "-wal", "-shm") if way == "move all" else ("",):
            os.replace(path + ending, path + ".old" + ending)
    elif way.startswith("remove"):
        for ending in ("", "-wal", "-shm") if way == "remove all" else ("",):
            os.unlink(path + ending)
    elif way == "replace":
        with open(path + ".new", "wb") as file:
            file.write(random_.randbytes(random_.randrange(100_000)))
        os.replace(path + ".new", path)
    elif way == "cut off":
        os.truncate(path, random_.randrange(size))
    else:
        with open(path, "r+b") as file:
            file.seek(random_.randrange(size))
            file.write(random_.randbytes(random_.randrange(1, 5000)))
    return way


class DamagedHistory(ServeCase):
    def test_readings_continue_and_history_is_recorded_again(self):
        path = self.file("history.sqlite")
        server = self.server(NAME, "--history", path)
        random_ = random.Random(SEED)

        def is_kept_since(begin):
            status, body = server.ask(of(NAME, "history.csv"), **{"from": int(begin), "to": int(begin) + 1000})
            return status == 200 and body.count("\n") > 1 and "broken off" not in body
        for i in range(ROUNDS):
            wait_until(lambda: is_kept_since(time.time() - 2), "it is kept")
            way = harm(random_, path)
            with self.subTest(seed=SEED, round=i, way=way):
                begin = time.time() + 1
                self.assertEqual(server.encoder()["state"], "live")
                wait_until(lambda: is_kept_since(begin), "it is kept again")
                self.assertIsNone(server.process.poll())


class KilledServer(ServeCase):
    def test_no_acknowledged_command_is_lost(self):
        path = self.file("history.sqlite")
        random_ = random.Random(SEED)
        tokens, answered = self.tokens(), 0
        for i in range(KILLS):
            server = self.server(NAME, "--history", path, "--token-file", tokens)
            for _ in range(random_.randrange(1, 6)):
                status, answer = server.command(NAME, "memory-write", {"Authorization": f"Bearer {TOKEN}"},
                                                argument=["5", str(random_.randrange(256))])
                self.assertEqual(status, 200, answer)
                answered += 1
            server.process.kill()
            server.process.wait()
            with self.subTest(seed=SEED, round=i), contextlib.closing(sqlite3.connect(path)) as database:
                self.assertEqual(database.execute("PRAGMA integrity_check").fetchall(), [("ok",)])
                self.assertEqual(database.execute("SELECT count(*) FROM happening WHERE kind = 'command'").fetchone()[0], answered)


if __name__ == "__main__":
    unittest.main()
