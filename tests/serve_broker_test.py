# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc serve` with brokers and MQTT processes that fail."""
import json
import os
import shutil
import signal
import unittest

from command_support import PATIENCE
from mqtt_fake import CONNACK, CONNECT, NOT_AUTHORIZED, PUBACK, PUBLISH, Closed, FakeBroker, packet, published
from mqtt_support import numbers
from serve_support import ServeCase, wait_until

ONE = "sim:tformat?motion=rpm=60"
DEADLY = {  # packets at which an assertion of libmosquitto 2.0.11 fails and ends the process
    "CONNACK with an unknown property": bytes.fromhex("20050000027f00"),
    "DISCONNECT with an unknown property": bytes.fromhex("e00487027f00"),
    "PUBACK with an unknown property": bytes.fromhex("4006000100027f00"),
    "PUBLISH that is too short": bytes.fromhex("30050001615859"),
}


class BrokerCase(ServeCase):
    def fake(self, answer=None):
        broker = FakeBroker(answer)
        self.addCleanup(broker.end)
        return broker

    def sender(self, url, *arguments, **settings):
        return self.without_history(ONE, "--mqtt", url, "--mqtt-prefix", "plant/hall", "--mqtt-spool",
                                    os.path.join(self.directory, "spool"), *arguments, **settings)

    def mqtt(self, server):
        return server.json("/api/mqtt")

    def children(self, server):
        """Returns (number, state, command line) of each child process of the server, including zombies."""
        found = []
        for name in filter(str.isdigit, os.listdir("/proc")):
            try:
                with open(f"/proc/{name}/stat", encoding="ascii", errors="replace") as file:
                    state, parent = file.read().rsplit(")", 1)[1].split()[:2]
                if int(parent) == server.process.pid:
                    with open(f"/proc/{name}/cmdline", "rb") as file:
                        found.append((int(name), state, file.read()))
            except (FileNotFoundError, ProcessLookupError):
                continue
        return found

    def events(self, broker):
        """Returns the text of each published event once, even if its message was repeated."""
        return list({one["id"]: one["text"] for one in broker.all("/event")}.values())


class BadPackets(BrokerCase):
    def test_packets_that_end_the_client_do_not_end_the_server(self):
        for name, bad in DEADLY.items():
            with self.subTest(name):
                def answer(_broker, connection, kind, _flags, _body, usual, bad=bad):
                    if connection.index:
                        return usual
                    return bad if (kind == CONNECT) == (bad[0] >> 4 == CONNACK) else usual
                broker = self.fake(answer)
                server = self.sender(broker.url)
                wait_until(lambda b=broker: b.connections > 1, "it connects again")
                died = wait_until(lambda s=server: self.mqtt(s)["client_deaths"], "the death is counted")
                self.assertEqual(died, 1)
                self.assertIn("absenc_mqtt_client_deaths_total{} 1\n", server.ask("/metrics")[1])
                self.assertEqual(server.json("/healthz")["mqtt_client_deaths"], 1)
                wait_until(lambda b=broker: [one for one in self.events(b) if "ended by signal 6 (Aborted)" in one],
                           "an event says so")
                wait_until(lambda b=broker: len(numbers(b.all("/readings"), ONE)) > 100, "readings come")
                found = numbers(broker.all("/readings"), ONE)
                self.assertEqual(found, list(range(1, len(found) + 1)))
                self.assertLessEqual({state for _, state, _ in self.children(server)}, {"S", "R", "D"}, "no zombie")
                server.process.kill()
                server.process.wait()
                shutil.rmtree(os.path.join(self.directory, "spool"))

    def test_killed_client_is_restarted(self):
        broker = self.fake()
        server = self.sender(broker.url)
        wait_until(lambda: self.mqtt(server)["sent"], "it sends")
        os.kill(self.children(server)[0][0], signal.SIGKILL)
        wait_until(lambda: broker.connections > 1 and self.mqtt(server)["connected"], "it connects again")
        self.assertEqual(self.mqtt(server)["client_deaths"], 1)

    def test_hanging_client_is_ended(self):
        broker = self.fake()
        server = self.sender(broker.url)
        wait_until(lambda: self.mqtt(server)["sent"], "it sends")
        number = self.children(server)[0][0]
        os.kill(number, signal.SIGSTOP)
        wait_until(lambda: broker.connections > 1, "it connects again")
        self.assertFalse(os.path.exists(f"/proc/{number}"))
        self.assertEqual(server.encoder()["state"], "live")

    def test_unstable_broker_causes_few_events(self):
        def answer(_broker, connection, kind, _flags, _body, usual):
            connection.seen = getattr(connection, "seen", 0) + (kind == PUBLISH)
            return DEADLY["PUBLISH that is too short"] if connection.seen > 3 and connection.index < 4 else usual
        broker = self.fake(answer)
        server = self.sender(broker.url)
        wait_until(lambda: broker.connections > 4, "it connects again and again")
        wait_until(lambda: len(numbers(broker.all("/readings"), ONE)) > 200, "readings come")
        self.assertEqual(len([one for one in self.events(broker) if "is not reachable" in one]), 1)
        self.assertEqual(len([one for one in self.events(broker) if one.startswith("connected")]), 1)


class RefusedMessages(BrokerCase):
    """Tests of a broker that refuses messages of one of two encoders."""
    BAD, GOOD = "/bad/readings", "/good/readings"

    def serve(self, answer):
        broker = self.fake(answer)
        path = self.configure("bad", "good")
        server = self.without_history("--mqtt", broker.url, "--mqtt-prefix", "plant", "--mqtt-spool",
                                      os.path.join(self.directory, "spool"), ABSENC_CONFIG=path)
        return broker, server

    def configure(self, *names):
        return self.file("absenc.toml", "".join(f'[encoder.{name}]\nprotocol = "tformat"\nport = "sim"\n'
                                                for name in names))

    def check(self, broker, server, connections, how):
        good, bad = (lambda: numbers(broker.all(self.GOOD), "good")), (lambda: numbers(broker.taken(self.BAD), "bad"))
        wait_until(lambda: len(good()) > 300, "the others go on")
        self.assertEqual(good(), list(range(1, len(good()) + 1)))
        self.assertEqual(bad(), [])
        self.assertLessEqual(broker.connections, connections)
        about = [one for one in self.events(broker) if "plant/bad/readings" in one]
        self.assertEqual(len(about), 1, about)
        self.assertIn(how, about[0])
        self.assertIn("(plant/bad/readings)", self.mqtt(server)["trouble"])
        wait_until(lambda: server.json("/api/mqtt")["taken"]["good"] - good()[-1] < 100, "they are not starved")
        broker.permits = True
        goal = self.mqtt(server)["taken"]["bad"]
        wait_until(lambda: (bad() or [0])[-1] >= goal, "it comes, too")
        self.assertEqual(bad(), list(range(1, len(bad()) + 1)))
        wait_until(lambda: [one for one in self.events(broker) if one == "the broker accepts plant/bad/readings again"],
                   "an event says so")
        self.assertEqual(self.mqtt(server)["trouble"], "")
        self.assertEqual(self.mqtt(server)["dropped"], 0)

    def refuses(self, broker, kind, flags, body):
        topic, number, payload = published(flags, body) if kind == PUBLISH else ("", 0, b"")
        is_bad = topic.endswith(self.BAD) and not getattr(broker, "permits", False)
        if topic.endswith(self.BAD) and not is_bad:
            broker.kept = getattr(broker, "kept", []) + [json.loads(payload)]
        broker.taken = lambda _: getattr(broker, "kept", [])
        return number if is_bad else None

    def test_refused_with_reason_code(self):
        def answer(broker, _connection, kind, flags, body, usual):
            number = self.refuses(broker, kind, flags, body)
            return usual if number is None else packet(PUBACK, number.to_bytes(2, "big") + bytes((NOT_AUTHORIZED,)))
        broker, server = self.serve(answer)
        self.check(broker, server, 1, "Not authorized")

    def test_refused_by_closing_connection(self):
        """The broker refuses a message by closing the connection, as those of MQTT 3.1.1 do."""
        def answer(broker, _connection, kind, flags, body, usual):
            if self.refuses(broker, kind, flags, body) is not None:
                raise Closed
            return usual
        broker, server = self.serve(answer)
        self.check(broker, server, 6, "closes the connection")

    def test_refused_states(self):
        def answer(broker, _connection, kind, flags, body, usual):
            topic, number, _ = published(flags, body) if kind == PUBLISH else ("", 0, b"")
            if topic != "plant/bad/state" or getattr(broker, "permits", False):
                return usual
            return packet(PUBACK, number.to_bytes(2, "big") + bytes((NOT_AUTHORIZED,)))
        broker, server = self.serve(answer)
        wait_until(lambda: len(broker.all("/bad/state")) > 1, "it is tried again")
        self.assertEqual(broker.connections, 1)
        self.assertEqual(len([one for one in self.events(broker) if "plant/bad/state" in one]), 1)
        self.assertIn("(plant/bad/state)", self.mqtt(server)["trouble"])
        # If an encoder is removed while the broker refuses its state, the state must be cleared when the broker
        # accepts it again.
        self.configure("good")
        server.process.send_signal(signal.SIGHUP)
        wait_until(lambda: len(server.json("/api/encoders")["encoders"]) == 1, "it is no longer served")
        self.assertNotIn(None, broker.all("plant/bad/state"))
        broker.permits = True
        wait_until(lambda: None in broker.all("plant/bad/state"), "its state is cleared")


class ClientProcess(BrokerCase):
    def started(self, *arguments, **settings):
        broker = self.fake()
        server = self.sender(broker.url, *arguments, **settings)
        wait_until(lambda: self.mqtt(server)["sent"], "it sends")
        return broker, server

    def test_has_no_secrets_and_no_inherited_files(self):
        login = self.file("login", "bench secret-of-plants\n")
        os.chmod(login, 0o600)
        inherited = os.open("/dev/zero", os.O_RDONLY)
        self.addCleanup(os.close, inherited)
        _, server = self.started("--mqtt-login-file", login, preexec_fn=lambda: os.set_inheritable(inherited, True))
        (number, _, arguments), = self.children(server)
        self.assertNotIn(b"secret", arguments)
        with open(f"/proc/{number}/environ", "rb") as file:
            self.assertNotIn(b"secret-of-plants", file.read())
        links, of_parent = self.links(number), self.links(server.process.pid)
        self.assertTrue([one for one in of_parent if "spool" in one], of_parent)
        self.assertFalse((links & of_parent) - {"/dev/null"})
        self.assertNotIn("/dev/zero", links)

    def links(self, number):
        """Returns the targets of all files and sockets that the process `number` has open."""
        folder = f"/proc/{number}/fd"
        return {os.readlink(f"{folder}/{one}") for one in os.listdir(folder)}

    def test_ends_with_its_parent(self):
        for ending in (signal.SIGKILL, signal.SIGTERM):
            with self.subTest(ending):
                _, server = self.started()
                (number, _, _), = self.children(server)
                server.process.send_signal(ending)
                server.process.wait(PATIENCE)
                wait_until(lambda n=number: not os.path.exists(f"/proc/{n}"), "it is gone")

    def test_disconnects_cleanly_if_all_processes_get_a_signal(self):
        """Ctrl-C and systemd send the signal to all processes of the server, also to its MQTT client."""
        broker, server = self.started(preexec_fn=os.setsid)
        os.killpg(server.process.pid, signal.SIGTERM)
        self.assertEqual(server.process.wait(PATIENCE), 0)
        ended = [one for one in broker.all("plant/hall/state") if one["why"] == "it ended"]
        self.assertEqual(len(ended), 1)


if __name__ == "__main__":
    unittest.main()
