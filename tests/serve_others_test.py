# SPDX-License-Identifier: Apache-2.0
"""Tests what `absenc serve` sends to other programs, such as Prometheus."""
import json
import os
import pathlib
import re
import socket
import subprocess
import unittest
import urllib.error
import urllib.parse
import urllib.request

from command_support import PATIENCE, absenc, end
from mqtt_support import Broker, Daemon, Receiver, free_port
from serve_support import ServeCase, wait_until

SOURCE = pathlib.Path(os.environ.get("ABSENC_SOURCE_DIR", pathlib.Path(__file__).resolve().parent.parent))
ONE = "sim:tformat?motion=rpm=60&alarm=over_heat&fault=corrupt=0.2&seed=1"


class HomeAssistant(ServeCase):
    def setUp(self):
        super().setUp()
        self.broker = Broker(self.directory)
        self.addCleanup(self.broker.end)

    def server_with(self, *arguments):
        return self.without_history("--mqtt", self.broker.url, "--mqtt-prefix", "plant/hall", "--mqtt-spool",
                                    os.path.join(self.directory, "spool"), *arguments)

    def receiver(self):
        receiver = Receiver(self.broker.port)
        self.addCleanup(receiver.end)
        return receiver

    def test_publishes_entities(self):
        receiver = self.receiver()
        server = self.server_with(ONE, "sim:biss?model=linear-26-1um&motion=sine=20,0.5&singleturn=30000000",
                                  "--home-assistant")
        wait_until(lambda: len(receiver.all("config")) == 7, "all entities are published")
        configs = {topic: payload for topic, payload, _ in receiver.messages if topic.endswith("/config")}
        self.assertEqual(len({one["unique_id"] for one in configs.values()}), 7)
        self.assertEqual(len({one["device"]["identifiers"][0] for one in configs.values()}), 2)
        for linear in (True, False):
            receiver.until("value", lambda one, linear=linear: one["linear"] == linear)
        receiver.until("state", lambda one: one.get("alarms"))
        with receiver.lock:
            last = {topic: payload for topic, payload, _ in receiver.messages}
        for topic, config in configs.items():
            # A topic of Home Assistant's discovery must have the form PREFIX/COMPONENT/NODE/OBJECT/config.
            self.assertRegex(topic, r"^homeassistant/(sensor|binary_sensor)/[a-zA-Z0-9_-]+/[a-zA-Z0-9_-]+/config$")
            self.assertIn(config["state_topic"], last)
            for one in config["availability"]:
                self.assertIn(one["topic"], last)
            key = re.search(r"value_json\.(\w+)", config["value_template"]).group(1)
            self.assertIn(key, last[config["state_topic"]])
        template = next(one["value_template"] for one in configs.values() if one["name"] == "Alarm")
        expression = template.strip("{} ").replace("is none", "is None").replace("value_json.alarms", "alarms")
        values = [eval(expression, {"alarms": alarms}) for alarms in ([], [{"name": "over_heat"}], None)]
        # An alarm that is not reported has the value None ("unknown"), not OFF.
        self.assertEqual(values, ["OFF", "ON", "None"])
        units = {(one["name"], one.get("unit_of_measurement")) for one in configs.values()}
        self.assertLessEqual({("Angle", "°"), ("Position", "mm"), ("Speed", "rpm"), ("Speed", "mm/s")}, units)
        self.assertEqual(end(server.process)[0], 0)

    def test_publishes_nothing_without_option(self):
        receiver = self.receiver()
        self.server_with(ONE)
        receiver.until("readings")
        receiver.until("state", lambda one: one.get("alarms"))
        self.assertFalse(receiver.all("config") + receiver.all("value"))


class PlotJuggler(ServeCase):
    def test_every_reading_is_a_datagram(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as plot:
            plot.bind(("127.0.0.1", 0))
            plot.settimeout(PATIENCE)
            name = "sim:tformat?motion=rpm=60"
            server = self.without_history(name, "--rate", "100", "--udp", f"127.0.0.1:{plot.getsockname()[1]}")
            found = [json.loads(plot.recv(4096)) for _ in range(100)]
        times = [one["timestamp"] for one in found]
        self.assertEqual(times, sorted(set(times)))
        placed = [one for one in found if "position" in one[name]]
        first, last = placed[0], placed[-1]
        self.assertGreater(len(placed), 90)
        self.assertAlmostEqual((last[name]["position"] - first[name]["position"]) / 360,
                               last["timestamp"] - first["timestamp"], delta=0.05)
        self.assertLessEqual({"position", "speed", "counts", "turns"}, set(found[-1][name]))
        wait_until(lambda: server.encoder()["state"] == "live", "it goes on while nobody is there")

    def test_refuses_address_without_port(self):
        result = absenc("serve", "sim:tformat", "--history", "none", "--udp", "127.0.0.1")
        self.assertEqual(result.returncode, 2)
        self.assertIn("HOST:PORT", result.stderr)


class Metrics(ServeCase):
    def test_names_and_units_follow_prometheus_conventions(self):
        server = self.without_history(ONE, "--mqtt", f"mqtt://127.0.0.1:{free_port()}", "--mqtt-spool",
                                      os.path.join(self.directory, "spool"))
        wait_until(lambda: 'alarm="' in server.ask("/metrics")[1], "it is live")
        page = server.ask("/metrics")[1]
        done = subprocess.run(["promtool", "check", "metrics"], input=page, capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assertEqual((done.returncode, done.stdout + done.stderr), (0, ""))
        for name, kind in re.findall(r"^# TYPE (\w+) (\w+)$", page, re.MULTILINE):
            self.assertEqual(name.endswith("_total"), kind == "counter", name)
            self.assertNotRegex(name, r"_(ms|us|millis\w+|micros\w+|hz|pct|percent)$")


class Dashboard(ServeCase):
    def test_uses_only_existing_metrics(self):
        text = (SOURCE / "docs/grafana-dashboard.json").read_text(encoding="utf-8")
        dashboard = json.loads(text)
        used = set(re.findall(r"\babsenc_\w+", text))
        server = self.without_history(ONE, "--mqtt", f"mqtt://127.0.0.1:{free_port()}", "--mqtt-spool",
                                      os.path.join(self.directory, "spool"))
        wait_until(lambda: 'alarm="' in server.ask("/metrics")[1], "it is live")
        page = server.ask("/metrics")[1]
        there = set(re.findall(r"^(absenc_\w+)\{", page, re.MULTILINE))
        self.assertEqual(used - there, set())
        of_mqtt = set(re.findall(r"^# TYPE (absenc_mqtt_\w+)", page, re.MULTILINE))
        self.assertLessEqual(of_mqtt - {"absenc_mqtt_waiting_bytes"}, used)
        labels = {label for panel in dashboard["panels"] for target in panel["targets"]
                  for label in re.findall(r"\{\{(\w+)\}\}", target["legendFormat"])} - {"instance"}
        for label in labels:
            self.assertIn(f'{label}="', page)


class Prometheus(ServeCase):
    def test_scrapes_metrics(self):
        server = self.without_history(ONE, "--mqtt", f"mqtt://127.0.0.1:{free_port()}", "--mqtt-spool",
                                      os.path.join(self.directory, "spool"))
        config = self.file("prometheus.yml", "scrape_configs:\n  - job_name: absenc\n    scrape_interval: 500ms\n"
                           f'    scrape_timeout: 500ms\n    static_configs: [{{targets: ["127.0.0.1:{server.port}"]}}]\n')
        port = free_port()
        prometheus = Daemon(["prometheus", f"--config.file={config}", f"--web.listen-address=127.0.0.1:{port}",
                             f"--storage.tsdb.path={self.directory}/prometheus"], port,
                            os.path.join(self.directory, "prometheus.log"))
        self.addCleanup(prometheus.end)

        def ask(query):
            address = f"http://127.0.0.1:{port}/api/v1/query?" + urllib.parse.urlencode({"query": query})
            try:
                with urllib.request.urlopen(address, timeout=PATIENCE) as answer:
                    return json.load(answer)["data"]["result"]
            except urllib.error.HTTPError as refused:
                self.assertEqual(refused.code, 503)  # Prometheus answers with HTTP status 503 until it is ready
                return []
        wait_until(lambda: [one for one in ask('up{job="absenc"}') if one["value"][1] == "1"], "it is scraped")
        dashboard = json.loads((SOURCE / "docs/grafana-dashboard.json").read_text(encoding="utf-8"))
        for panel in dashboard["panels"]:
            for target in panel["targets"]:
                # The variables in the query are replaced, as Grafana does it.
                query = target["expr"].replace("$encoder", ".*").replace("$__range", "5m")
                self.assertNotIn("$", query)
                found = wait_until(lambda q=query: ask(q), f"{panel['title']}: {query} has values")
                for label in re.findall(r"\{\{(\w+)\}\}", target["legendFormat"]):
                    self.assertIn(label, found[0]["metric"], query)
        variable = next(one["query"]["query"] for one in dashboard["templating"]["list"] if one["name"] == "encoder")
        metric, label = re.fullmatch(r"label_values\((\w+), (\w+)\)", variable).groups()
        self.assertEqual([one["metric"][label] for one in ask(metric)], [ONE])
        for query in ("absenc_up == 1", 'absenc_alarm{alarm="over_heat"} == 1', 'absenc_alarm{alarm="over_speed"} == 0',
                      "absenc_readings_total > 10", 'absenc_errors_total{error="unsupported"} == 0',
                      "histogram_quantile(0.99, absenc_latency_seconds_bucket) > 0",
                      "absenc_errors_total > 0", "absenc_mqtt_connected == 0"):
            wait_until(lambda q=query: ask(q), query)
        self.assertEqual(ask("absenc_up")[0]["metric"]["encoder"], ONE)
        with open(prometheus.log, encoding="utf-8") as log:
            self.assertNotIn("err=", log.read())


if __name__ == "__main__":
    unittest.main()
