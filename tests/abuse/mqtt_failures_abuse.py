# SPDX-License-Identifier: Apache-2.0
"""MQTT brokers that fail, and `absenc serve` killed with SIGKILL: no reading may be lost."""
from abuse_support import often

import os
import random
import signal
import threading
import unittest

import paho.mqtt.client as paho

from command_support import end
from mqtt_fake import PUBLISH, FakeBroker
from mqtt_support import ONE, MqttCase, numbers
from serve_support import wait_until

ROUNDS = often(9, 90)
SEED = int(os.environ.get("ABSENC_ABUSE_SEED", "1"))


class Failures(MqttCase):
    def check(self, payloads, goal):
        wait_until(lambda: (numbers(payloads(), ONE) or [0])[-1] >= goal, "all that was taken comes")
        came, same = payloads(), {}
        found = numbers(came, ONE)
        self.assertEqual(found, list(range(1, len(found) + 1)))
        for one in came:
            self.assertEqual(same.setdefault(one["id"], one), one, "an id is for one message")

    def test_no_reading_is_lost_if_broker_fails_or_server_is_killed(self):
        random_ = random.Random(SEED)
        mute = threading.Event()
        broker = FakeBroker(lambda _broker, _connection, kind, _flags, _body, usual:
                            b"" if mute.is_set() and kind == PUBLISH else usual)
        self.addCleanup(broker.end)
        def begin():
            return self.sender(broker.url, ONE, "--rate", "200")
        server = begin()
        readings = f"/{ONE.replace(':', '%3A').replace('?', '%3F').replace('=', '%3D')}/readings"
        for round_ in range(ROUNDS):
            with self.subTest(round=round_, seed=SEED):
                sent = wait_until(lambda s=server: self.mqtt(s)["sent"], "it sends")
                wait_until(lambda s=server, n=sent: self.mqtt(s)["sent"] > n + random_.randrange(1, 10), "it sends more")
                way = ("hangs up", "says nothing", "kill server", "hangs up and kill")[round_ % 4]
                taken = self.taken(server)
                if way == "says nothing":
                    mute.set()
                    wait_until(lambda s=server, n=taken: self.taken(s) > n + 100, "it spools")
                if way != "kill server":
                    broker.drop_all()
                mute.clear()
                if "kill" in way:
                    end(server.process, signal.SIGKILL)
                    server = begin()
                wait_until(lambda s=server: self.mqtt(s)["connected"], "it connects again")
        self.check(lambda: broker.all(readings), wait_until(lambda: self.taken(server), "it goes on"))
        self.assertEqual(self.mqtt(server)["dropped"], 0)

    def test_no_reading_is_lost_across_mosquitto_restart(self):
        folder = os.path.join(self.directory, "kept")
        os.mkdir(folder)
        os.chmod(folder, 0o777)
        broker = self.broker("allow_anonymous true", "persistence true", f"persistence_location {folder}/")
        # The receiver speaks MQTT 3.1.1: an MQTT 5 session would end when its connection ends.
        receiver = self.receiver(broker, version=paho.MQTTv311, client_id="keeps")
        server = self.sender(broker.url, ONE, "--rate", "200")
        for round_ in range(ROUNDS):
            with self.subTest(round=round_):
                goal = self.taken(server) + 100
                wait_until(lambda n=goal: (numbers(receiver.all("readings"), ONE) or [0])[-1] > n, "readings come")
                if round_ % 3 == 2:
                    broker.end()
                    broker.start()
                    continue
                broker.process.send_signal(signal.SIGSTOP)
                wait_until(lambda n=goal: self.taken(server) > n + 300, "it spools")
                broker.process.send_signal(signal.SIGCONT)
        self.check(lambda: receiver.all("readings"), self.taken(server))


if __name__ == "__main__":
    unittest.main()
