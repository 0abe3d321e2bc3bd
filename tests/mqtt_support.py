# SPDX-License-Identifier: Apache-2.0
"""Shared by the MQTT tests of `absenc serve`: brokers, and clients that collect messages."""
import json
import os
import pathlib
import socket
import struct
import subprocess
import threading
import time

import paho.mqtt.client as paho

from command_support import PATIENCE, end
from serve_support import ServeCase, wait_until

ONE = "sim:tformat?motion=rpm=60"
MOSQUITTO = "/usr/sbin/mosquitto"


def free_port():
    with socket.socket() as one:
        one.bind(("127.0.0.1", 0))
        return one.getsockname()[1]


def answers(port):
    try:
        socket.create_connection(("127.0.0.1", port), timeout=PATIENCE).close()
        return True
    except OSError:
        return False


class Daemon:
    """A server process other than `absenc serve`. The constructor starts it."""

    def __init__(self, command, port, log, wait=True):
        self.command, self.port, self.log = command, port, log
        self.process = None
        self.begin()
        if wait:
            self.wait()

    def start(self):
        self.begin()
        self.wait()

    def begin(self):
        with open(self.log, "ab") as log:
            self.process = subprocess.Popen(self.command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def wait(self):
        wait_until(lambda: self.process.poll() is not None or answers(self.port), f"{self.command[0]} answers")
        if self.process.poll() is not None:
            with open(self.log, encoding="utf-8", errors="replace") as log:
                raise AssertionError(f"{self.command} ended: {log.read()}")

    def kill(self):
        self.process.kill()
        self.process.wait()

    def end(self):
        if self.process.poll() is None:
            self.process.terminate()
            try:
                self.process.wait(PATIENCE)
            except subprocess.TimeoutExpired:
                self.kill()


class Broker(Daemon):
    def __init__(self, directory, *settings, name="broker"):
        port = free_port()
        path = os.path.join(directory, name + ".conf")
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n".join((f"listener {port} 127.0.0.1", "max_queued_messages 0",
                                  *(settings or ("allow_anonymous true",)), "")))
        super().__init__([MOSQUITTO, "-c", path], port, os.path.join(directory, name + ".log"))

    @property
    def url(self):
        return f"mqtt://127.0.0.1:{self.port}"


class Receiver:
    """A client that collects messages: (topic, payload as JSON or None, retained)."""

    def __init__(self, port, topics="#", version=paho.MQTTv5, client_id="", login=None):
        self.messages = []
        self.lock = threading.Lock()
        self.ready = threading.Event()
        keep = {"clean_session": not client_id} if version == paho.MQTTv311 else {}
        self.client = paho.Client(client_id, protocol=version, **keep)
        if login:
            self.client.username_pw_set(*login)
        self.topics = topics
        self.client.on_connect = lambda *_: self.client.subscribe(topics, 1)
        self.client.on_subscribe = lambda *_: self.ready.set()
        self.client.on_message = self.take
        self.client.reconnect_delay_set(1, 1)
        self.client.connect("127.0.0.1", port)
        self.client.loop_start()
        if not self.ready.wait(PATIENCE):
            raise AssertionError("the broker did not let us subscribe")

    def take(self, _client, _data, message):
        payload = json.loads(message.payload) if message.payload else None
        with self.lock:
            self.messages.append((message.topic, payload, bool(message.retain)))

    def all(self, kind):
        """Returns the payloads of all received messages whose topic ends with `kind`."""
        with self.lock:
            return [payload for topic, payload, _ in self.messages if topic.endswith("/" + kind)]

    def until(self, kind, wanted=lambda payload: True):
        def found():
            return next(([one] for one in self.all(kind) if wanted(one)), None)
        return wait_until(found, f"a message {kind} comes")[0]

    def end(self):
        self.client.disconnect()
        self.client.loop_stop()


def numbers(messages, encoder):
    """Returns the numbers of an encoder's readings, without those of repeated messages."""
    found, seen = [], set()
    for one in messages:
        if one["encoder"] == encoder and one["id"] not in seen:
            seen.add(one["id"])
            found += range(one["first"], one["first"] + len(one["readings"]))
    return found


def twice(messages):
    """Returns how many of the messages repeat an earlier one."""
    return len(messages) - len({one["id"] for one in messages})


def waiting_in(spool):
    """Returns the payloads that wait in a spool folder (absenc/serve/spool_file.hpp)."""
    found = []
    for path in sorted(pathlib.Path(spool).glob("*.part")):
        data, at = path.read_bytes(), 0
        while at < len(data):
            size, kind, state = struct.unpack_from("<Icc", data, at + 4)
            if (kind, state) == (b"m", b"w"):
                topic, = struct.unpack_from("<I", data, at + 26)
                found.append(json.loads(data[at + 34 + topic:at + 10 + size]))
            at += 10 + size
    return found


def now():
    return time.monotonic()


class MqttCase(ServeCase):
    def broker(self, *settings, **more):
        broker = Broker(self.directory, *settings, **more)
        self.addCleanup(broker.end)
        return broker

    def receiver(self, broker, *arguments, **settings):
        receiver = Receiver(broker.port, *arguments, **settings)
        self.addCleanup(receiver.end)
        return receiver

    def spool(self):
        return os.path.join(self.directory, "spool")

    def sender(self, url, *arguments, **settings):
        return self.without_history(*arguments, "--mqtt", url, "--mqtt-prefix", "plant/hall", "--mqtt-spool",
                                    self.spool(), **settings)

    def mqtt(self, server):
        return server.json("/api/mqtt")

    def taken(self, server, encoder=ONE):
        return self.mqtt(server)["taken"].get(encoder, 0)


__all__ = ["ONE", "Broker", "Daemon", "MqttCase", "Receiver", "answers", "end", "free_port", "now", "numbers", "twice", "waiting_in"]
