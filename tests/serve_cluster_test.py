# SPDX-License-Identifier: Apache-2.0
"""Tests two `absenc serve` with a cluster of nats-server, of which some are killed."""
import json
import os
import unittest

import paho.mqtt.client as paho

from command_support import end
from mqtt_support import Daemon, Receiver, free_port, now, numbers, twice
from serve_support import ServeCase, wait_until

READINGS = int(os.environ.get("ABSENC_CLUSTER_READINGS", "3000"))
RATE = 500  # readings per second of each `absenc serve`


class Cluster(ServeCase):
    def cluster(self):
        routes = [free_port() for _ in range(3)]
        nodes = []
        for index, route in enumerate(routes):
            mqtt = free_port()
            config = self.file(f"node{index}.conf", json.dumps({
                "server_name": f"node{index}", "listen": f"127.0.0.1:{free_port()}",
                "jetstream": {"store_dir": os.path.join(self.directory, f"node{index}")},
                "cluster": {"name": "hall", "listen": f"127.0.0.1:{route}",
                            "routes": [f"nats://127.0.0.1:{one}" for one in routes]},
                "mqtt": {"listen": f"127.0.0.1:{mqtt}"}}))
            # All servers are started before the first is waited for: a nats-server answers on its MQTT port only if
            # others run.
            nodes.append((["nats-server", "-c", config], mqtt, os.path.join(self.directory, f"node{index}.log")))
        started = [Daemon(*one, wait=False) for one in nodes]
        for one in started:
            self.addCleanup(one.end)
        for one in started:
            one.wait()
        return started

    def sender(self, name, node):
        path = os.path.join(self.directory, name + ".toml")
        with open(path, "w", encoding="utf-8") as file:
            file.write(f'[encoder.{name}]\nprotocol = "tformat"\nport = "sim"\nrate_hz = {RATE}\nmotion = "rpm=60"\n')
        return self.without_history("--mqtt", f"mqtt://127.0.0.1:{node.port}", "--mqtt-prefix", f"plant/{name}",
                                    "--mqtt-spool", os.path.join(self.directory, name + ".spool"), ABSENC_CONFIG=path)

    @staticmethod
    def taken(server, name):
        return server.json("/api/mqtt")["taken"].get(name, 0)

    def test_every_reading_counted_as_taken_arrives(self):
        first, second, third = self.cluster()
        receiver = Receiver(third.port, "plant/#", version=paho.MQTTv311, client_id="collects")
        self.addCleanup(receiver.end)
        started = now()
        left, right = self.sender("left", first), self.sender("right", second)
        part = READINGS // 2
        wait_until(lambda: self.taken(left, "left") > part // 4, "a quarter")
        wait_until(lambda: numbers(receiver.all("readings"), "left"), "they arrive")
        first.kill()
        wait_until(lambda: self.taken(right, "right") > part // 2, "half")
        shown = self.taken(right, "right")
        right.process.kill()
        right.process.wait()
        right = self.sender("right", second)
        self.assertGreaterEqual(wait_until(lambda: self.taken(right, "right"), "it goes on"), shown)
        first.start()
        goals = {}
        for name, server in (("left", left), ("right", right)):
            goals[name] = wait_until(lambda s=server, n=name: self.taken(s, n) >= part and self.taken(s, n), "all")
        for name, goal in goals.items():
            wanted = set(range(1, goal + 1))
            wait_until(lambda n=name, w=wanted: w <= set(numbers(receiver.all("readings"), n)), f"all of {name} arrive")
        seconds = now() - started
        messages = receiver.all("readings")
        for name, goal in goals.items():
            found = numbers(messages, name)
            self.assertEqual(len(found), len(set(found)), "no reading has two ids")
            self.assertEqual(sorted(found)[:goal], list(range(1, goal + 1)))
        self.assertEqual(right.json("/api/mqtt")["dropped"] + left.json("/api/mqtt")["dropped"], 0)
        print(f"{sum(goals.values())} readings shown as taken, {len(messages)} messages of which {twice(messages)} came "
              f"twice, all told apart, in {seconds:.0f} s")
        for server in (left, right):
            self.assertEqual(end(server.process)[0], 0)


if __name__ == "__main__":
    unittest.main()
