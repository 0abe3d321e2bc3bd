# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc serve` with Debian's mosquitto, also when either is killed."""
import json
import os
import pathlib
import re
import resource
import signal
import socket
import subprocess
import unittest

import jsonschema

from command_support import ABSENC, PATIENCE, Emulator, absenc, end, read_line
from mqtt_support import ONE, Broker, MqttCase, free_port, now, numbers, twice, waiting_in
from serve_support import BUSY, TOKEN, ServeCase, of, wait_until

SOURCE = pathlib.Path(os.environ.get("ABSENC_SOURCE_DIR", pathlib.Path(__file__).resolve().parent.parent))
SCHEMA = json.loads((SOURCE / "docs/mqtt-schema.json").read_text(encoding="utf-8"))
ONE_LEVEL = "sim%3Atformat%3Fmotion%3Drpm%3D60"


def check(kind, payload):
    jsonschema.validate(payload, {**SCHEMA, "$ref": f"#/$defs/{kind}"}, jsonschema.Draft202012Validator)


class Messages(MqttCase):
    def test_match_schema(self):
        jsonschema.Draft202012Validator.check_schema(SCHEMA)
        broker = self.broker()
        receiver = self.receiver(broker)
        linear = "sim:biss?model=linear-26-1um&motion=sine=20,0.5&singleturn=30000000"
        self.sender(broker.url, "sim:tformat?alarm=over_heat&fault=corrupt=0.2&seed=1", linear, "sim:ssi")
        receiver.until("readings", lambda one: one["encoder"] == linear and one["readings"][-1][2] is not None)
        receiver.until("event", lambda one: one["kind"] == "alarm")
        receiver.until("state", lambda one: one.get("alarms"))
        with receiver.lock:
            seen = list(receiver.messages)
        kinds = set()
        for topic, payload, _ in seen:
            kind = "server state" if topic == "plant/hall/state" else topic.rsplit("/", 1)[1]
            kinds.add(kind)
            check(kind, payload)
        self.assertEqual(kinds, {"server state", "state", "readings", "event"})
        units = {one["encoder"]: one["position_unit"] for one in receiver.all("readings")}
        self.assertEqual(units[linear], "mm")
        with self.assertRaises(jsonschema.ValidationError):
            check("readings", {**receiver.all("readings")[0], "first": 0})

    def test_values_and_topics(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        self.sender(broker.url, ONE)
        first = receiver.until("readings")
        later = receiver.until("readings", lambda one: one["first"] > 60 and one["readings"][0][2] is not None)
        self.assertIn(f"plant/hall/{ONE_LEVEL}/readings", [topic for topic, _, _ in receiver.messages])
        self.assertAlmostEqual(later["readings"][0][2], 60, delta=6)
        at = [one[0] / 1e6 for one in (first["readings"][0], later["readings"][0])]
        turned = (later["readings"][0][1] - first["readings"][0][1]) / 360
        self.assertAlmostEqual(turned, at[1] - at[0], delta=0.05)

    def test_readings_are_batched_above_ten_per_second(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        path = self.file("absenc.toml", "".join(
            f'[encoder.{name}]\nprotocol = "tformat"\nport = "sim"\nrate_hz = {rate}\n'
            for name, rate in (("slow", 5), ("fast", 200))))
        started = now()
        self.sender(broker.url, ABSENC_CONFIG=path)
        receiver.until("readings", lambda one: one["encoder"] == "fast" and one["first"] > 300)
        seconds = now() - started
        all_of = {name: [one for one in receiver.all("readings") if one["encoder"] == name] for name in ("slow", "fast")}
        alone = [one for one in all_of["slow"] if len(one["readings"]) == 1]
        # A message may have two readings if a busy machine delays the server.
        self.assertGreater(len(alone), len(all_of["slow"]) / 2)
        self.assertLessEqual(len(all_of["fast"]), 10 * seconds + 2)
        for name, messages in all_of.items():
            found = numbers(messages, name)
            self.assertEqual(found, list(range(1, len(found) + 1)))

    def test_alarms_and_losses(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        emulator = Emulator(self.directory)
        self.addCleanup(emulator.end)
        self.sender(broker.url, f"tformat:{emulator.path}")
        receiver.until("state", lambda one: one["state"] == "live")
        emulator.kill()
        event = receiver.until("event", lambda one: one["kind"] == "lost")
        state = receiver.until("state", lambda one: one.get("encoder") and one["state"] == "lost")
        self.assertEqual(event["text"], state["message"])


    def test_acknowledgements_are_not_sent(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        name = "sim:tformat?alarm=over_heat"
        server = self.sender(broker.url, name, "--token-file", self.tokens())
        receiver.until("state", lambda one: one.get("alarms"))
        good = {"Authorization": f"Bearer {TOKEN}"}
        self.assertEqual(server.ask(of(name, "acknowledge"), "POST", good, alarm="over_heat")[0], 200)
        server.command(name, "position", good)
        # When this event of the command arrives, an event of the earlier acknowledgement would have arrived, too.
        receiver.until("event", lambda one: one["kind"] == "command")
        self.assertNotIn("acknowledged", [one["kind"] for one in receiver.all("event")])
        self.assertNotIn("acknowledged", [one for state in receiver.all("state") for alarm in state.get("alarms") or [] for one in alarm])


class State(MqttCase):
    def test_last_will_after_kill(self):
        broker = self.broker()
        receiver = self.receiver(broker, "plant/hall/state")
        server = self.sender(broker.url, ONE)
        receiver.until("state", lambda one: one["state"] == "online")
        server.process.kill()
        self.assertEqual(receiver.until("state", lambda one: one["state"] == "offline")["why"],
                         "the connection was lost")
        # The receiver subscribes after the message was sent, so it gets the retained copy.
        late = self.receiver(broker, "plant/hall/state")
        self.assertEqual(late.until("state")["state"], "offline")
        self.assertTrue(late.messages[0][2])
        self.sender(broker.url, ONE)
        wait_until(lambda: receiver.all("state")[-1]["state"] == "online", "it is online again")

    def test_end_of_server_is_published(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        server = self.sender(broker.url, ONE)
        receiver.until("readings")
        status, _, err = end(server.process)
        self.assertEqual(status, 0, err)
        self.assertEqual(receiver.until("state", lambda one: one["state"] == "offline")["why"], "it ended")
        self.assertEqual(waiting_in(self.spool()), [])

    def test_removed_encoder_is_cleared(self):
        broker = self.broker()
        text = '[encoder.{}]\nprotocol = "tformat"\nport = "sim"\n'
        path = self.file("absenc.toml", text.format("elbow") + text.format("wrist"))
        server = self.sender(broker.url, "--home-assistant", ABSENC_CONFIG=path)
        kept = self.receiver(broker)
        kept.until("state", lambda one: one.get("encoder") == "wrist")
        self.file("absenc.toml", text.format("elbow"))
        server.process.send_signal(signal.SIGHUP)
        wait_until(lambda: ("plant/hall/wrist/state", None, False) in kept.messages, "nothing is kept of it")
        later = self.receiver(broker)
        later.until("state", lambda one: one.get("encoder") == "elbow")
        self.assertFalse([topic for topic, _, retained in later.messages if retained and "wrist" in topic])


class Spool(MqttCase):
    def numbers(self, receiver):
        return numbers(receiver.all("readings"), ONE)

    def test_no_reading_is_lost_while_broker_is_away(self):
        broker = self.broker()
        receiver = self.receiver(broker, client_id="keeps")
        server = self.sender(broker.url, ONE, "--rate", "100")
        wait_until(lambda: len(self.numbers(receiver)) > 50, "readings come")
        broker.kill()
        seen, before = self.numbers(receiver)[-1], self.taken(server)
        wait_until(lambda: self.taken(server) > before + 200, "two seconds are spooled")
        self.assertFalse(self.mqtt(server)["connected"])
        self.assertTrue(self.mqtt(server)["trouble"])
        self.assertEqual(server.encoder()["state"], "live")
        broker.start()
        goal = self.taken(server)
        wait_until(lambda: self.numbers(receiver)[-1] >= goal, "they come")
        found = self.numbers(receiver)
        self.assertEqual(found, sorted(found))
        # Messages that the broker had accepted shortly before it was killed may be missing.
        missing = set(range(1, goal + 1)) - set(found)
        self.assertFalse([one for one in missing if not seen < one <= before], missing)
        self.assertEqual(self.mqtt(server)["dropped"], 0)

    def test_survives_kill(self):
        port = free_port()  # the test starts a broker on this port later
        server = self.sender(f"mqtt://127.0.0.1:{port}", ONE, "--rate", "100")
        wait_until(lambda: self.taken(server) > 150, "they are spooled")
        shown = self.taken(server)
        server.process.kill()
        server.process.wait()
        broker = self.broker()
        receiver = self.receiver(broker)
        server = self.sender(broker.url, ONE, "--rate", "100")
        goal = wait_until(lambda: self.taken(server), "it goes on")
        wait_until(lambda: (self.numbers(receiver) or [0])[-1] >= goal, "they come")
        found = self.numbers(receiver)
        self.assertGreater(goal, shown)
        self.assertEqual(found, list(range(1, len(found) + 1)))
        wait_until(lambda: self.mqtt(server)["waiting"] < 5, "the spool is empty")

    def test_unacknowledged_message_is_repeated(self):
        """The broker accepts messages but acknowledges none, so the server must repeat them."""
        silent = SilentBroker()
        self.addCleanup(silent.end)
        server = self.sender(f"mqtt://127.0.0.1:{silent.port}", ONE)
        first = silent.published(5)
        self.assertGreaterEqual(self.mqtt(server)["waiting"], 5)
        self.assertEqual(self.mqtt(server)["sent"], 0)
        silent.drop()
        second = silent.published(5)
        self.assertEqual([one["id"] for one in second], [one["id"] for one in first])

    def test_size_is_limited(self):
        server = self.sender(f"mqtt://127.0.0.1:{free_port()}", ONE, "sim:esl?motion=rpm=6", "--rate", "0",
                             "--mqtt-spool-mb", "1")
        stream = self.stream(server)
        dropped = wait_until(lambda: self.mqtt(server)["dropped"] > 500 and self.mqtt(server), "some were dropped")
        self.assertLessEqual(dropped["waiting_bytes"], 1_000_000)
        event = stream.until(lambda event, data: event == "happening" and "the spool is full" in data["text"])
        self.assertRegex(event["text"], r"^\d+ readings in \d+ messages were dropped, the oldest first: the spool is full")
        end(server.process, signal.SIGKILL)
        broker = self.broker()
        receiver = self.receiver(broker)
        self.sender(broker.url, ONE, "--mqtt-spool-mb", "1")
        found = wait_until(lambda: self.numbers(receiver), "they come")
        self.assertGreater(found[0], 1)
        self.assertLess(sum(one.stat().st_size for one in os.scandir(self.spool())), 4_000_000)

    def test_two_servers_cannot_share_it(self):
        url = f"mqtt://127.0.0.1:{free_port()}"
        self.sender(url, ONE)
        result = absenc("serve", ONE, "--listen", "127.0.0.1:0", "--history", "none", "--mqtt", url, "--mqtt-spool",
                        self.spool())
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, "the spool .* locked")


    def test_many_open_descriptors(self):
        """The server has more open descriptors than select() supports."""
        broker = self.broker()
        receiver = self.receiver(broker)
        crowded = 'ulimit -n 4096 && for ((i = 3; i < 1030; ++i)); do eval "exec $i</dev/null"; done; exec "$@"'
        server = self.sender(f"mqtt://localhost:{broker.port}", ONE, within=("bash", "-c", crowded, "bash"))
        receiver.until("readings")
        self.assertGreater(max(int(one) for one in os.listdir(f"/proc/{server.process.pid}/fd")), 1024)

    def test_full_disk_is_reported(self):
        server = self.sender(f"mqtt://127.0.0.1:{free_port()}", ONE, "--rate", "500", "--mqtt-spool-mb", "1",
                             preexec_fn=lambda: signal.signal(signal.SIGXFSZ, signal.SIG_IGN))
        shown = wait_until(lambda: self.taken(server) > 20 and self.taken(server), "readings are spooled")
        # A limit on the file size has the same effect on the server as a full disk.
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
        full = wait_until(lambda: self.mqtt(server)["dropped"] > 20 and self.mqtt(server), "it says so")
        self.assertIn("the spool", full["trouble"])
        self.assertEqual(server.encoder()["state"], "live")
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        goal = wait_until(lambda: self.taken(server) > full["taken"][ONE] and self.taken(server), "it goes on")
        end(server.process, signal.SIGKILL)
        broker = self.broker()
        receiver = self.receiver(broker)
        server = self.sender(broker.url, ONE)
        found = wait_until(lambda: (self.numbers(receiver) or [0])[-1] >= goal and self.numbers(receiver), "all is sent")
        self.assertLessEqual(set(range(1, shown + 1)), set(found))
        self.assertGreaterEqual(found[-1] - len(found), 20, "a gap tells of those that were dropped")

    def test_example_of_documentation(self):
        text = (SOURCE / "docs/mqtt.md").read_text(encoding="utf-8")
        path = self.file("absenc.toml", "".join(re.findall(r"```toml\n(.*?)```", text, re.DOTALL)))
        result = absenc("serve", ONE, "--history", "none", "--listen", "127.0.0.1:0", "--mqtt-spool", self.spool(),
                        env={**os.environ, "ABSENC_CONFIG": path})
        self.assertEqual(result.returncode, 1, result.stderr)
        # The only complaint is the missing file mqtt-login, so the server has accepted all other settings.
        self.assertIn("/etc/absenc/mqtt-login", result.stderr)


class SilentBroker:
    """A fake MQTT 5 broker that acknowledges no message."""

    def __init__(self):
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.listener.settimeout(PATIENCE)
        self.port = self.listener.getsockname()[1]
        self.connection = None

    def packet(self):
        def read(count):
            data = b""
            while len(data) < count:
                piece = self.connection.recv(count - len(data))
                if not piece:
                    raise AssertionError("the server went away")
                data += piece
            return data
        kind = read(1)[0]
        size, shift = 0, 0
        while True:
            byte = read(1)[0]
            size |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return kind, read(size)

    def published(self, count):
        """Accepts a connection of the server. Returns the next `count` messages of readings."""
        self.connection, _ = self.listener.accept()
        self.connection.settimeout(PATIENCE)
        self.packet()
        self.connection.sendall(bytes((0x20, 3, 0, 0, 0)))
        found = []
        while len(found) < count:
            kind, body = self.packet()
            if kind >> 4 != 3:
                continue
            size = int.from_bytes(body[:2], "big")
            if body[2:2 + size].endswith(b"/readings"):
                found.append(json.loads(body[2 + size + 3:]))
        return found

    def drop(self):
        self.connection.close()

    def end(self):
        if self.connection:
            self.connection.close()
        self.listener.close()


class Access(MqttCase):
    def test_user_and_password(self):
        passwords = self.file("passwords", "bench:secret of plants\n")
        subprocess.run(["mosquitto_passwd", "-U", passwords], check=True, capture_output=True, timeout=PATIENCE)
        os.chmod(passwords, 0o644)
        broker = self.broker("allow_anonymous false", f"password_file {passwords}")
        login = self.file("login", "bench secret of plants\n")
        os.chmod(login, 0o600)
        server = self.sender(broker.url, ONE, "--mqtt-login-file", login)
        wait_until(lambda: self.mqtt(server)["connected"], "it is let in")
        end(server.process)
        server = self.sender(broker.url, ONE)
        trouble = wait_until(lambda: self.mqtt(server)["trouble"], "it is refused")
        self.assertIn("uthorized", trouble)
        os.chmod(login, 0o644)
        result = absenc("serve", ONE, "--history", "none", "--listen", "127.0.0.1:0", "--mqtt", broker.url,
                        "--mqtt-spool", self.file("other"), "--mqtt-login-file", login)
        self.assertEqual(result.returncode, 1)
        self.assertIn("chmod 600", result.stderr)

    def test_refused_topic_stays_in_spool(self):
        rules = self.file("rules", "topic write plant/hall/#\ntopic read #\n")
        closed = self.file("closed", f"topic write plant/hall/state\ntopic write plant/hall/{ONE_LEVEL}/state\n")
        broker = self.broker("allow_anonymous true", f"acl_file {closed}")
        server = self.sender(broker.url, ONE)
        wait_until(lambda: "refuses a message" in self.mqtt(server)["trouble"], "it says so")
        self.assertIn("(plant/hall/", self.mqtt(server)["trouble"])  # the reported trouble names the refused topic
        self.assertGreater(self.mqtt(server)["waiting"], 0)
        self.assertEqual(self.mqtt(server)["sent"], 0)
        pathlib.Path(closed).write_text(pathlib.Path(rules).read_text(encoding="utf-8"), encoding="utf-8")
        broker.process.send_signal(signal.SIGHUP)
        receiver = self.receiver(broker)
        receiver.until("readings", lambda one: one["first"] == 1)

    def test_tls(self):
        self.openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", "key", "-out", "cert", "-days", "2",
                     "-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1")
        cert, key = (os.path.join(self.directory, name) for name in ("cert", "key"))
        os.chmod(key, 0o644)
        broker = self.broker("allow_anonymous true", f"certfile {cert}", f"keyfile {key}")
        url = f"mqtts://127.0.0.1:{broker.port}"
        for place in (url, f"mqtts://localhost:{broker.port}"):  # localhost may resolve to the IPv6 address ::1 first
            server = self.sender(place, ONE, "--mqtt-ca-file", cert)
            wait_until(lambda s=server: self.mqtt(s)["sent"], "it is sent")
            end(server.process)
        server = self.sender(url, ONE)
        wait_until(lambda: self.mqtt(server)["trouble"], "a broker that nobody vouches for is not trusted")
        self.assertEqual(self.mqtt(server)["sent"], 0)

    def openssl(self, *arguments):
        subprocess.run(["openssl", *arguments], cwd=self.directory, check=True, capture_output=True, timeout=PATIENCE)


class OldBroker(MqttCase):
    def test_broker_with_only_3_1_1(self):
        """The broker answers the CONNECT of MQTT 5 with a reply of version 3.1.1."""
        with socket.create_server(("127.0.0.1", 0)) as listener:
            listener.settimeout(PATIENCE)
            server = self.sender(f"mqtt://127.0.0.1:{listener.getsockname()[1]}", ONE)
            stream = self.stream(server)
            versions = []
            for answer in (b"\x20\x02\x00\x01", b"\x20\x02\x00\x00"):
                connection, _ = listener.accept()
                with connection:
                    connection.settimeout(PATIENCE)
                    versions.append(connection.recv(4096)[8])
                    connection.sendall(answer)
                    if len(versions) == 2:
                        event = stream.until(lambda event, data: event == "happening" and data["kind"] == "mqtt")
                        self.assertIn("3.1.1", event["text"])
            self.assertEqual(versions, [5, 4])


class Settings(MqttCase):
    FILE = ('[serve.mqtt]\nbroker = "{}"\nprefix = "plant/{}"\nspool = "{}"\nbatch_ms = 50\n'
            '[encoder.elbow]\nprotocol = "tformat"\nport = "sim"\n')

    def test_file_is_reloaded(self):
        broker = self.broker()
        receiver = self.receiver(broker)
        path = self.file("absenc.toml", self.FILE.format(broker.url, "a", self.spool()))
        server = self.without_history(ABSENC_CONFIG=path)
        wait_until(lambda: any(topic == "plant/a/elbow/readings" for topic, _, _ in receiver.messages), "a")
        before = server.json(of("elbow"))["readings"]
        self.file("absenc.toml", self.FILE.format(broker.url, "b", self.spool()))
        server.process.send_signal(signal.SIGHUP)
        wait_until(lambda: any(topic == "plant/b/elbow/readings" for topic, _, _ in receiver.messages), "b")
        self.assertGreater(server.json(of("elbow"))["readings"], before)
        times = [one[0] for payload in receiver.all("readings") for one in payload["readings"]]
        self.assertLess(max(later - earlier for earlier, later in zip(times, times[1:])), 1_000_000 * BUSY)
        self.file("absenc.toml", self.FILE.format("ftp://x", "b", self.spool()))
        server.process.send_signal(signal.SIGHUP)
        self.assertIn("mqtt://", self.event(server, "goes on as it was"))
        self.assertTrue(self.mqtt(server)["connected"])
        self.file("absenc.toml", self.FILE.format(broker.url, "b", "/none/spool"))
        server.process.send_signal(signal.SIGHUP)
        self.assertIn("/none/spool", self.event(server, "not all of it can be done"))
        self.assertEqual(server.encoder()["state"], "live")

    def event(self, server, words):
        """Returns the next line on the server's standard error that contains these words."""
        line = ""
        while words not in line:
            line = read_line(server.process.stderr, now() + PATIENCE)
            self.assertIsNotNone(line, words)
        return line

    def test_refuses_wrong_settings(self):
        good = 'broker = "mqtt://127.0.0.1:1"\n'
        for text, words in (("", "broker"), (good + 'prefx = "a"\n', 'did you mean prefix'),
                            (good + 'prefix = "a/#"\n', "prefix"), (good + "spool_mb = 0\n", "spool_mb"),
                            ('broker = "mqtt://x:99999"\n', "HOST:PORT"), (good + 'ca_file = "x"\n', "mqtts"),
                            (good + 'prefix = ["a"]\n', "one value")):
            path = self.file("absenc.toml", "[serve.mqtt]\n" + (text or 'prefix = "a"\n'))
            result = absenc("serve", ONE, "--history", "none", "--listen", "127.0.0.1:0",
                            env={**os.environ, "ABSENC_CONFIG": path})
            self.assertEqual(result.returncode, 2, text + result.stderr)
            self.assertIn(words, result.stderr)
        path = self.file("absenc.toml", '[serve.mqqt]\nbroker = "x"\n')
        result = absenc("serve", ONE, "--history", "none", env={**os.environ, "ABSENC_CONFIG": path})
        self.assertIn("did you mean mqtt", result.stderr)

    def test_without_mqtt(self):
        server = self.without_history(ONE)
        self.assertIsNone(self.mqtt(server))
        self.assertNotIn("absenc_mqtt", server.ask("/metrics")[1])


if __name__ == "__main__":
    unittest.main()
