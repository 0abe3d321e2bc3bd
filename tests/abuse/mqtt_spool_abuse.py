# SPDX-License-Identifier: Apache-2.0
"""Damaged spool files: the server must run, empty its spool, and use no id twice."""
from abuse_support import often

import os
import pathlib
import random
import shutil
import signal
import unittest

from command_support import end
from mqtt_fake import FakeBroker
from mqtt_support import ONE, MqttCase, free_port, numbers
from serve_support import of, wait_until

ROUNDS = often(6, 200)
SEED = int(os.environ.get("ABSENC_ABUSE_SEED", "1"))


def harm(random_, path):
    """Damages the spool file at `path` in a random manner, or removes it."""
    data = bytearray(path.read_bytes())
    way = random_.randrange(7)
    at = random_.randrange(max(1, len(data)))
    if way == 0:
        data[at:at + 1] = bytes((random_.randrange(256),))
    elif way == 1:
        del data[at:]
    elif way == 2:
        data[at:at + 1000] = random_.randbytes(1000)
    elif way == 3:
        data = bytearray(random_.randbytes(random_.randrange(5000)))
    elif way == 4:
        data += random_.randbytes(random_.randrange(1, 5000))
    elif way == 5:
        return path.unlink()
    else:
        # the end of the file is replaced by zeros, as a file system may leave it after a power failure
        data[at:] = bytes(len(data) - at)
    with open(path, "r+b") as file:
        file.write(data)
        file.truncate()
    return None


class Spool(MqttCase):
    def test_survives_damaged_spool_files(self):
        for round_ in range(ROUNDS):
            with self.subTest(seed=SEED + round_):
                self.one_round(random.Random(SEED + round_), round_)

    def one_round(self, random_, round_):
        folder = pathlib.Path(self.directory, f"spool{round_}")
        def begin(url):
            return self.without_history(ONE, "--rate", "0", "--mqtt", url, "--mqtt-prefix", "plant", "--mqtt-spool",
                                        str(folder), "--mqtt-spool-mb", "2")
        away = f"mqtt://127.0.0.1:{free_port()}"
        server = begin(away)
        wait_until(lambda: len(list(folder.glob("*.part"))) > 2, "there are several files")
        while_open = random_.random() < 0.5
        if not while_open:
            end(server.process, signal.SIGKILL)
        files = sorted(folder.glob("*.part"))
        for path in random_.sample(files, random_.randrange(1, len(files) + 1)):
            harm(random_, path)
        if random_.random() < 0.2:
            os.rename(folder, f"{folder}.gone")
            if random_.random() < 0.5:
                folder.write_bytes(random_.randbytes(1000))
        if while_open:
            taken = server.json(of(ONE))["readings"]
            wait_until(lambda: server.json(of(ONE))["readings"] > taken + 100, "readings go on")
            end(server.process, signal.SIGKILL)
        broker = FakeBroker()
        server = begin(broker.url)
        first = wait_until(lambda: self.mqtt(server)["taken"].get(ONE), "it spools")
        wait_until(lambda: (numbers(broker.all("/readings"), ONE) or [0])[-1] > first, "what is read comes")
        wait_until(lambda: self.mqtt(server)["waiting"] < 50, "the spool empties")
        found = numbers(broker.all("/readings"), ONE)
        # If the spool is damaged, numbers of readings may be used twice, but each message has a new id.
        ids = [one["id"] for one in broker.all("/readings")]
        self.assertEqual(len(set(ids)), len(ids), "no id comes twice")
        self.assertGreater(len(found), 0)
        self.assertEqual(server.encoder()["state"], "live")
        self.assertEqual(self.mqtt(server)["trouble"], "")
        end(server.process)
        broker.end()
        shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    unittest.main()
