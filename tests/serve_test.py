# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc serve` without a browser: its API, access rights, and history."""
import contextlib
import json
import os
import re
import resource
import shlex
import signal
import sqlite3
import subprocess
import threading
import time
import unittest
import unittest.mock
import urllib.parse

import jsonschema

from command_support import ABSENC, PATIENCE, Emulator, absenc, end, read_line
from npm_support import SOURCE
from serve_support import BUSY, TOKEN, ServeCase, Server, SilentLine, of, wait_until


class EncoderValues(ServeCase):
    def test_values_change(self):
        server = self.without_history("sim:tformat?motion=rpm=60")
        stream = self.stream(server)
        first = stream.state(lambda one: one["state"] == "live" and one["speed"] is not None)
        second = stream.state(lambda one: one["angle_deg"] not in (None, first["angle_deg"]))
        self.assertEqual((second["protocol"], second["speed_unit"], second["alarms"]), ("tformat", "rpm", []))
        self.assertAlmostEqual(stream.state(lambda one: one["speed"] is not None)["speed"], 60, delta=6)

    def test_stream_of_points(self):
        name = "sim:tformat?motion=rpm=60"
        server = self.without_history(name, "sim:esl?motion=rpm=6", "--rate", "100")
        stream = self.stream(server, name)
        points = []
        while len(points) < 50:
            data = stream.until(lambda event, _: event == "points")
            self.assertEqual(data["encoder"], name)
            points += data["points"]
        times = [at for at, _, _, _ in points]
        self.assertEqual(times, sorted(times))
        self.assertEqual(len(set(place for _, place, _, _ in points)), len(points))

    def test_alarms_have_texts(self):
        server = self.without_history("sim:tformat?alarm=over_heat")
        encoder = wait_until(lambda: server.encoder()["alarms"] and server.encoder(), "it has an alarm")
        alarm = encoder["alarms"][0]
        self.assertEqual(alarm["name"], "over_heat")
        self.assertTrue(alarm["meaning"] and alarm["action"], alarm)
        page = server.ask("/metrics")[1]
        self.assertIn('alarm="over_heat"} 1\n', page)
        self.assertIn('alarm="over_speed"} 0\n', page)

    def test_unreported_alarms_are_null(self):
        server = self.without_history("sim:ssi")
        encoder = wait_until(lambda: server.encoder()["state"] == "live" and server.encoder(), "it is live")
        self.assertEqual((encoder["alarms"], encoder["status"], encoder["singleturn_valid"]), (None, None, True))
        self.assertIn("absenc_up", server.ask("/metrics")[1])
        self.assertNotIn("absenc_alarm{", server.ask("/metrics")[1])

    def test_invalid_turns_are_null(self):
        server = self.without_history("sim:tformat?alarm=battery_error")
        encoder = wait_until(lambda: server.encoder()["state"] == "live" and server.encoder(), "it is live")
        self.assertEqual((encoder["singleturn_valid"], encoder["multiturn_valid"], encoder["turns"]), (True, False, None))

    def test_cleared_alarm_is_reported_as_zero(self):
        emulator = Emulator(self.directory, "--alarm", "over_heat")
        self.addCleanup(emulator.end)
        name = f"tformat:{emulator.path}"
        server = self.without_history(name, "--token-file", self.tokens())
        wait_until(lambda: 'alarm="over_heat"} 1\n' in server.ask("/metrics")[1], "it has an alarm")
        status, body = server.command(name, "clear-alarms", {"Authorization": f"Bearer {TOKEN}"})
        self.assertEqual(status, 200, body)
        wait_until(lambda: 'alarm="over_heat"} 0\n' in server.ask("/metrics")[1], "it is over")
        emulator.kill()
        wait_until(lambda: "absenc_alarm{" not in server.ask("/metrics")[1], "it is not known any more")

    def test_latencies(self):
        name = "sim:tformat"
        server = self.without_history(name)
        latency = wait_until(lambda: (result := server.json(of(name))["latency_us"])["p50"] and result,
                             "it was read")
        buckets = latency["buckets"]
        self.assertEqual([one["at_most"] for one in buckets[:4] + buckets[-2:]], [10, 20, 50, 100, 1e6, None])
        filled = [one["at_most"] or float("inf") for one in buckets if one["count"]]
        self.assertLessEqual(latency["max"], filled[-1] * 33 / 32)
        page = server.ask("/metrics")[1]
        self.assertIn("# TYPE absenc_latency_seconds histogram\n", page)
        counts = [int(count) for count in re.findall(r"^absenc_latency_seconds_bucket\{.*,le=.*\} (\d+)$", page, re.M)]
        self.assertEqual(counts, sorted(counts))
        self.assertEqual(len(counts), len(buckets))
        total = int(re.search(r"^absenc_latency_seconds_count\{.*\} (\d+)$", page, re.M)[1])
        mean = float(re.search(r"^absenc_latency_seconds_sum\{.*\} (\S+)$", page, re.M)[1]) / total
        self.assertGreater(total, 0)
        self.assertEqual(counts[-1], total)
        self.assertTrue(0 < mean <= float(re.search(r"^absenc_latency_longest_seconds\{.*\} (\S+)$", page, re.M)[1]))
        self.assertIn('error="bad_checksum"} 0\n', page)

    def test_details_of_one_encoder(self):
        name = "sim:tformat?fault=corrupt=0.3&seed=1"
        server = self.without_history(name)

        def has_bad():
            details = server.json(of(name))
            return details["bad_exchanges"] and details["fields"] and details
        details = wait_until(has_bad, "an exchange has failed")
        self.assertTrue(details["errors"])
        self.assertGreater(details["errors_last_minute"], 0)
        self.assertRegex(details["bad_exchanges"][0]["sent"], "^[0-9A-F]{2}")
        changing = [command["name"] for command in details["commands"] if command["changes_encoder"]]
        self.assertIn("zero", changing)
        self.assertNotIn("position", changing)
        self.assertEqual(server.ask(of("none"))[0], 404)

    def test_unknown_encoder_is_404_with_suggestion(self):
        server = self.server("sim:tformat", "sim:esl", "--history", self.file("history"), "--token-file", self.tokens())
        good = {"Authorization": f"Bearer {TOKEN}"}
        for part, method in (("", "GET"), ("history", "GET"), ("history.csv", "GET"), ("events", "GET"),
                             ("settings", "GET"), ("memory", "GET"), ("stream", "GET"), ("doctor", "POST"),
                             ("command", "POST")):
            with self.subTest(part=part):
                status, body = server.ask(of("sim:tfornat", part), method, good)
                self.assertEqual((status, json.loads(body)["error"]),
                                 (404, 'there is no encoder "sim:tfornat" here; did you mean sim:tformat?'))
        status, body = server.ask(of("sim:tformat", "histori"))
        self.assertEqual((status, json.loads(body)["error"]),
                         (404, 'an encoder has no "histori"; did you mean history?'))

    def test_old_path_is_404_with_new_path(self):
        server = self.without_history("sim:tformat", "--token-file", self.tokens())
        good = {"Authorization": f"Bearer {TOKEN}"}
        for part, method in (("history", "GET"), ("history.csv", "GET"), ("settings", "GET"), ("memory", "GET"),
                             ("doctor", "POST"), ("command", "POST"), ("events", "GET")):
            with self.subTest(part=part):
                status, body = server.ask(f"/api/{part}", method, good, encoder="sim:tformat")
                self.assertEqual((status, json.loads(body)["error"]), (404, f"this path is now /api/encoders/NAME/{part}"))
        status, body = server.ask("/api/encoder", name="sim:tformat")
        self.assertEqual((status, json.loads(body)["error"]), (404, "this path is now /api/encoders/NAME"))
        status, body = server.ask("/api/stream", trace="sim:tformat")
        self.assertEqual((status, json.loads(body)["error"]), (404, "this path is now /api/encoders/NAME/stream"))

    def test_name_with_slashes_and_question_mark(self):
        name = "tformat:" + self.file("nothing") + "?latency=300"
        server = self.without_history(name)
        self.assertEqual(server.json(of(name))["encoder"], name)
        self.assertEqual(server.ask(of(name, "settings"))[0], 502)

    def test_units_and_ranges(self):
        server = self.without_history("sim:tformat", "sim:biss?model=linear-26-1um")
        turned, slid = (wait_until(lambda: server.encoder(i)["state"] == "live" and server.encoder(i), "it is live")
                        for i in range(2))
        self.assertEqual([turned[name] for name in ("position_unit", "speed_unit", "counts_in_all", "length_mm", "has_turns")],
                         ["deg", "rpm", 131072, None, True])
        self.assertEqual([slid[name] for name in ("position_unit", "speed_unit", "counts_in_all", "length_mm", "has_turns")],
                         ["mm", "mm/s", 2**26, 67108.864, False])

    def test_last_minute(self):
        server = self.without_history("sim:tformat?motion=rpm=60")

        def seconds():
            return server.json("/api/minute")["encoders"][0]["seconds"]
        rows = wait_until(lambda: len(seconds()) >= 3 and seconds(), "three seconds are over")
        self.assertEqual([row[0] - rows[0][0] for row in rows], list(range(len(rows))))
        self.assertAlmostEqual(rows[2][2], 60, delta=1)
        self.assertAlmostEqual(rows[2][1] - rows[1][1], 360, delta=60)

    def test_last_minute_averages_across_wrap(self):
        """The mean angle must be circular: the plain mean of 1 and 359 degrees is far away."""
        server = self.without_history("sim:raa38-can?motion=sine=40,1")

        def places():
            return [row[1] for row in server.json("/api/minute")["encoders"][0]["seconds"]]
        shown = wait_until(lambda: len(places()) >= 3 and places(), "three seconds are over")
        self.assertEqual([place for place in shown if 41 < place % 360 < 319], [])

    def test_lost_encoder_has_last_reading(self):
        emulator = Emulator(self.directory, "--singleturn", "1000")
        self.addCleanup(emulator.end)
        server = self.without_history(f"tformat:{emulator.path}")
        live = wait_until(lambda: server.encoder()["state"] == "live" and server.encoder(), "it is live")
        self.assertIsNone(live["last_reading"])
        emulator.kill()
        before = time.time() * 1000
        lost = wait_until(lambda: server.encoder()["state"] == "lost" and server.encoder(), "it is lost")
        self.assertIsNone(lost["counts"])
        self.assertIsNone(lost["continued_position"])
        self.assertEqual(lost["last_reading"]["counts"], 1000)
        self.assertLess(abs(lost["last_reading"]["at_ms"] - before), 5000)

    def test_token_has_name(self):
        server = self.without_history("sim:tformat")
        self.assertEqual(server.json("/api/token"), {"tokens": False, "name": None})
        server = self.without_history("sim:tformat", "--token-file", self.tokens())
        self.assertEqual(server.json("/api/token"), {"tokens": True, "name": None})
        status, body = server.ask("/api/token", headers={"Authorization": f"Bearer {TOKEN}"})
        self.assertEqual((status, json.loads(body)), (200, {"tokens": True, "name": "anna"}))
        for path, method in (("/api/token", "GET"), (of("sim:tformat", "command"), "POST")):
            status, body = server.ask(path, method, headers={"Authorization": "Bearer another-secret-than-that"})
            self.assertEqual(status, 401)
            self.assertIn("token is wrong", json.loads(body)["error"])

    def test_last_points_have_all_readings(self):
        name = "sim:tformat?motion=rpm=60"
        server = self.without_history(name, "--rate", "100")
        wait_until(lambda: len(server.json(of(name, "points"))["points"]) > 100, "it was read for a second")
        points = server.json(of(name, "points"))["points"]
        times = [at_ms for at_ms, _, _, _ in points]
        steps = sorted(after - before for before, after in zip(times, times[1:]))
        self.assertGreaterEqual(steps[0], 10)
        self.assertLess(steps[len(steps) // 2], 50)
        turned = points[-1][1] - points[0][1]  # the shaft turns at 360 degrees per second
        self.assertAlmostEqual(turned / 360, (times[-1] - times[0]) / 1000, delta=0.1 * BUSY)

    def test_reads_single_setting(self):
        server = self.without_history("sim:tformat")
        found = server.json(of("sim:tformat", "settings"), setting="overheat-threshold")
        self.assertEqual({row["setting"] for row in found["rows"]}, {"overheat-threshold"})
        status, body = server.ask(of("sim:tformat", "settings"), setting="overheat-treshold")
        self.assertEqual(status, 400)
        self.assertIn("did you mean overheat-threshold?", json.loads(body)["error"])
        shown = server.json(of("sim:tformat", "settings"))["rows"] + wait_until(lambda: server.json(of("sim:tformat"))["reply"], "there is a reply")
        self.assertNotIn("data_id", {row["field"] for row in shown})

    def test_description_health_and_page(self):
        server = self.without_history("sim:tformat")
        paths = set(server.json("/openapi.json")["paths"])
        self.assertLessEqual({"/api/encoders/{encoder}/" + part for part in ("command", "settings", "memory", "doctor")}, paths)
        self.assertTrue(server.json("/healthz")["ok"])
        page = server.ask("/")
        self.assertEqual(page[0], 200)
        for name in ("app.js", "style.css", "dygraph.min.js"):
            self.assertIn(f'"{name}"', page[1])
            self.assertEqual(server.ask(f"/{name}")[0], 200)
        self.assertEqual(server.ask("/nothing")[0], 404)
        self.assertEqual(server.ask("/api/encoders", "PUT")[0], 405)
        for line in server.ask("/metrics")[1].splitlines():
            self.assertRegex(line, r'^(# (HELP|TYPE) absenc_\w+ .+|absenc_\w+\{.*\} [-+.e\d]+)$')


class ApiDescription(ServeCase):
    """Tests that openapi.json describes every route, and that replies of the server match it."""
    NAME = "sim:tformat?motion=rpm=60&alarm=over_heat"
    DISTURBED = f"{NAME}&fault=corrupt=0.1&seed=1"  # for the description of bad exchanges; a command may fail here
    # Values of the parameters that a route of the API requires.
    VALUES = {"/api/encoders/{encoder}/command": {"command": "position"},
              "/api/encoders/{encoder}/acknowledge": {"alarm": "over_heat"}}

    def schema(self, schema, components):
        """Returns an OpenAPI 3.0 schema in the form for jsonschema."""
        if isinstance(schema, list):
            return [self.schema(one, components) for one in schema]
        if not isinstance(schema, dict):
            return schema
        if "$ref" in schema:
            return self.schema(components[schema["$ref"].rsplit("/", 1)[1]], components)
        made = {key: self.schema(value, components) for key, value in schema.items() if key != "nullable"}
        return {"anyOf": [made, {"type": "null"}]} if schema.get("nullable") is True else made

    def test_every_route_of_source_is_described(self):
        source = (SOURCE / "absenc/serve/api.cpp").read_text(encoding="utf-8")
        parts = re.search(r"parts_of_encoder\{(.*?)\};", source, re.DOTALL)[1]
        there = {"/api/encoders/{encoder}/" + part for part in re.findall(r'"([\w.]+)"', parts)}
        there |= set(re.findall(r'path == "(/[\w/]+)"', source)) | {"/api/encoders/{encoder}", "/openapi.json"}
        described = json.loads((SOURCE / "absenc/serve/page/openapi.json").read_text(encoding="utf-8"))
        self.assertEqual(set(described["paths"]), there)

    def test_every_reply_matches_its_schema(self):
        server = self.server(self.NAME, self.DISTURBED, "--history", self.file("history"), "--token-file", self.tokens())
        wait_until(lambda: server.json(of(self.NAME, "history"))["rows"], "it has a second")
        wait_until(lambda: server.json("/api/events")["events"], "something has happened")
        wait_until(lambda: server.json(of(self.DISTURBED))["bad_exchanges"], "an exchange has failed")
        described = server.json("/openapi.json")
        for path, methods in described["paths"].items():
            for method, result in methods.items():
                with self.subTest(route=f"{method} {path}"):
                    (kind, content), = result["responses"]["200"]["content"].items()
                    values = self.VALUES.get(path, {})
                    parameters = [described["components"]["parameters"][one["$ref"].rsplit("/", 1)[1]] if "$ref" in one
                                  else one for one in result.get("parameters", [])]
                    needed = [one["name"] for one in parameters if one.get("required") and one["in"] == "query"]
                    in_path = [one["name"] for one in parameters if one["in"] == "path"]
                    self.assertEqual(set(needed), set(values))
                    self.assertEqual(in_path, re.findall(r"\{(\w+)\}", path))
                    encoder = self.DISTURBED if path == "/api/encoders/{encoder}" else self.NAME
                    asked = path.replace("{encoder}", urllib.parse.quote(encoder, safe=""))
                    self.check(server, method.upper(), asked, values, kind,
                               self.schema(content["schema"], described["components"]["schemas"]))

    def check(self, server, method, path, values, kind, schema):
        if kind == "text/event-stream":
            # The first event of the stream may be another than "state".
            data = self.stream(server).until(lambda event, _: event == "state")
            self.assertTrue(data["encoders"])
            return
        status, got, body = server.answer(path, method, {"Authorization": f"Bearer {TOKEN}"}, **values)
        self.assertEqual((status, got.split(";")[0]), (200, kind), body)
        jsonschema.validate(json.loads(body) if kind == "application/json" else body, schema)


class AcknowledgedAlarms(ServeCase):
    GOOD = {"Authorization": f"Bearer {TOKEN}"}

    def acknowledge(self, server, name, headers, **values):
        status, body = server.ask(of(name, "acknowledge"), "POST", headers, **values)
        return status, json.loads(body)

    @staticmethod
    def alarms(server):
        return server.encoder()["alarms"] or []

    def test_stores_name_of_token_and_clears_nothing(self):
        name = "sim:tformat?alarm=over_heat&alarm=battery_alarm"
        server = self.server(name, "--history", self.file("history"), "--token-file", self.tokens())
        wait_until(lambda: len(self.alarms(server)) == 2, "both are raised")
        self.assertEqual([one["acknowledged"] for one in self.alarms(server)], [None, None])
        self.assertEqual(self.acknowledge(server, name, {}, alarm="over_heat")[0], 401)
        self.assertEqual(self.acknowledge(server, name, self.GOOD)[0], 400)
        status, body = self.acknowledge(server, name, self.GOOD, alarm="overheat")
        self.assertEqual(status, 409)
        self.assertIn("did you mean over_heat?", body["error"])
        stream = self.stream(server)
        stream.state()
        self.assertEqual(self.acknowledge(server, name, self.GOOD, alarm="over_heat"), (200, {"ok": True, "alarm": "over_heat", "who": "anna"}))
        result = stream.until(lambda event, data: event == "happening" and data["kind"] == "acknowledged")
        self.assertEqual((result["encoder"], result["text"], result["who"]), (name, "over_heat", "anna from 127.0.0.1"))
        seen = {one["name"]: one["acknowledged"] for one in stream.state()["alarms"]}
        self.assertEqual(seen["over_heat"]["who"], "anna")
        self.assertIsNone(seen["battery_alarm"])
        self.assertIn(result, server.json(of(name, "events"))["events"])
        self.assertIn('alarm="over_heat"} 1', server.ask("/metrics")[1])

    def test_acknowledgement_ends_with_alarm(self):
        emulator = Emulator(self.directory, stdin=subprocess.PIPE)
        self.addCleanup(emulator.end)
        name = f"tformat:{emulator.path}?latency=300"
        server = self.without_history(name, "--token-file", self.tokens())
        wait_until(lambda: server.encoder()["state"] == "live", "it is read")

        def order(line):
            emulator.process.stdin.write(line)
            self.assertTrue(emulator.line().startswith("ok"))
        order(b"alarm over_speed\n")
        wait_until(lambda: self.alarms(server), "it is raised")
        self.assertEqual(self.acknowledge(server, name, self.GOOD, alarm="over_speed")[0], 200)
        self.assertEqual(self.alarms(server)[0]["acknowledged"]["who"], "anna")
        order(b"clear over_speed\n")
        self.assertEqual(server.command(name, "clear-alarms", self.GOOD)[0], 200)
        wait_until(lambda: server.encoder()["alarms"] == [], "it is over")
        self.assertEqual(self.acknowledge(server, name, self.GOOD, alarm="over_speed")[0], 409)
        order(b"alarm over_speed\n")
        wait_until(lambda: self.alarms(server), "it is raised again")
        self.assertIsNone(self.alarms(server)[0]["acknowledged"])

    def test_needs_tokens(self):
        name = "sim:tformat?alarm=over_heat"
        server = self.without_history(name)
        wait_until(lambda: self.alarms(server), "it is raised")
        self.assertEqual(self.acknowledge(server, name, {}, alarm="over_heat")[0], 403)


@unittest.skipIf(os.environ.get("ABSENC_IN_QEMU"), "the kernel gives the process the name of qemu")
class PortInUse(ServeCase):
    def test_message_does_not_suggest_ending_the_server(self):
        with Emulator(self.directory) as emulator:
            served = self.without_history(f"tformat:{emulator.path}")
            wait_until(lambda: served.encoder()["state"] == "live", "it is read")
            refused = absenc("read", f"tformat:{emulator.path}")
            self.assertEqual(refused.returncode, 1)
            self.assertIn(f"in use by absenc serve (process {served.process.pid})", refused.stderr)
            self.assertNotIn("end it", refused.stderr)

    def test_message_refers_to_server(self):
        with unittest.mock.patch.dict(os.environ, {"XDG_RUNTIME_DIR": self.directory}), \
             Emulator(self.directory) as emulator:
            served = self.without_history(f"tformat:{emulator.path}")
            wait_until(lambda: served.encoder()["state"] == "live", "it is read")
            refused = absenc("read", f"tformat:{emulator.path}").stderr
            command = re.search(r"`(curl --silent \S+)` prints what it reads", refused)
            self.assertIsNotNone(command, refused)
            printed = subprocess.run(shlex.split(command.group(1)), capture_output=True, text=True, check=True).stdout
            self.assertEqual(json.loads(printed)["encoders"][0]["encoder"], f"tformat:{emulator.path}")
            folder = os.path.join(self.directory, "absenc")
            (notice,) = os.listdir(folder)
            # The file by which a server announces its page must be ignored if it names another process than the one
            # that uses the port.
            with open(os.path.join(folder, notice), "w", encoding="utf-8") as file:
                file.write("1 http://127.0.0.1:1/\n")
            refused = absenc("read", f"tformat:{emulator.path}").stderr
            self.assertNotIn("127.0.0.1:1/", refused)
            self.assertIn("its page and its API", refused)
            end(served.process)
            self.assertEqual(os.listdir(folder), [])


class LostEncoder(ServeCase):
    def test_encoder_is_lost_and_returns(self):
        emulator = Emulator(self.directory)
        self.addCleanup(emulator.end)
        server = self.without_history(f"tformat:{emulator.path}")
        wait_until(lambda: server.encoder()["state"] == "live", "it is read")
        stream = self.stream(server)
        stream.state()
        emulator.kill()
        killed = time.monotonic()
        result = stream.until(lambda event, data: event == "happening")
        gone = stream.state(lambda one: one["state"] != "live")
        self.assertLess(time.monotonic() - killed, BUSY)
        self.assertEqual((result["kind"], gone["state"]), ("lost", "lost"), result)
        self.assertIsNone(gone["angle_deg"])
        self.assertIsNone(gone["speed"])
        emulator.end()
        again = Emulator(self.directory)
        self.addCleanup(again.end)
        self.assertIsNotNone(stream.state(lambda one: one["state"] == "live")["angle_deg"])

    def test_signal_ends_server(self):
        for number in (signal.SIGTERM, signal.SIGINT):
            server = self.without_history("sim:tformat", "tformat:/dev/nothing")
            stream = self.stream(server)
            stream.next()
            status, _, err = end(server.process, number)
            self.assertEqual(status, 0, err)

    def test_refuses_wrong_usage(self):
        for arguments, words in ((("sim:tformatt",), "tformat"), (("sim:tformat", "sim:tformat"), "twice"),
                                 (("sim:tformat", "--listen", "0.0.0.0:0"), "--token-file"),
                                 (("sim:tformat", "--listen", "127.0.0.1:x"), "HOST:PORT")):
            result = self.run_serve(*arguments)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(words, result.stderr)
        first = self.without_history("sim:tformat")
        result = self.run_serve("sim:tformat", "--listen", f"127.0.0.1:{first.port}")
        self.assertEqual(result.returncode, 1)
        self.assertIn("in use", result.stderr)

    @staticmethod
    def run_serve(*arguments):
        return subprocess.run([ABSENC, "serve", *arguments, "--history", "none"], capture_output=True, text=True,
                              timeout=PATIENCE, check=False)


class Reload(ServeCase):
    FILE = ('[encoder.elbow]\nprotocol = "tformat"\nport = "sim"\nrate_hz = 20\n'
            '[encoder.{}]\nprotocol = "esl"\nport = "sim"\nmultiturn = {}\n')

    def test_unchanged_encoders_continue(self):
        path = self.file("absenc.toml", self.FILE.format("wrist", 3))
        server = self.without_history(ABSENC_CONFIG=path)

        def readings(name):
            return server.json(of(name))["readings"]

        def turns(index):
            return server.encoder(index)["turns"]
        wait_until(lambda: readings("elbow") > 20, "it was read")
        wait_until(lambda: turns(1) == 3, "it has turns")
        before = readings("elbow")
        self.file("absenc.toml", self.FILE.format("wrist", 4))
        server.process.send_signal(signal.SIGHUP)
        wait_until(lambda: turns(1) == 4, "the file was read again")
        self.assertGreaterEqual(readings("elbow"), before)
        self.file("absenc.toml", self.FILE.format("hand", "true true"))
        server.process.send_signal(signal.SIGHUP)
        self.assertIn("begun: wrist", self.error_line(server))
        self.assertIn("goes on as it was", self.error_line(server))
        self.assertEqual(turns(1), 4)

    @staticmethod
    def error_line(server):
        while True:
            line = read_line(server.process.stderr, time.monotonic() + PATIENCE)
            if line is None or "absenc.toml" in line and "SIGHUP" not in line:
                return line or ""

    def test_rate_changes(self):
        path = self.file("absenc.toml", self.FILE.format("wrist", 0))
        server = self.without_history("--rate", "200", ABSENC_CONFIG=path)
        wait_until(lambda: server.encoder(1)["rate_hz"] > 60, "the others have the usual rate")
        self.assertLess(server.encoder(0)["rate_hz"], 40)
        self.file("absenc.toml", self.FILE.format("wrist", 0).replace("20", '"much"'))
        result = subprocess.run(
            [ABSENC, "serve", "--history", "none"], capture_output=True, text=True, timeout=PATIENCE, check=False,
            env={**os.environ, "ABSENC_CONFIG": path})
        self.assertEqual(result.returncode, 2)
        self.assertIn("rate_hz", result.stderr)


class AccessRights(ServeCase):
    def setUp(self):
        super().setUp()
        self.emulator = Emulator(self.directory, "--singleturn", "1000")
        self.addCleanup(self.emulator.end)
        self.name = f"tformat:{self.emulator.path}"

    def counts(self, server):
        return wait_until(lambda: server.encoder()["counts"] is not None and server.encoder(), "it is live")["counts"]

    def test_zero_needs_token(self):
        server = self.server(self.name, "--token-file", self.tokens(), "--history", self.file("history"))
        self.assertEqual(self.counts(server), 1000)
        good = {"Authorization": f"Bearer {TOKEN}"}
        for headers, expected in (({}, 401), ({"Authorization": "Bearer " + TOKEN[:-1] + "x"}, 401),
                                  ({"Authorization": TOKEN}, 401),
                                  ({**good, "Origin": "http://evil.example"}, 403),
                                  ({**good, "Sec-Fetch-Site": "cross-site"}, 403),
                                  ({**good, "Host": "evil.example"}, 403)):
            with self.subTest(headers=headers):
                status, body = self.command(server, headers)
                self.assertEqual(status, expected, body)
        self.assertEqual(server.ask(of(self.name, "command"), headers=good, command="zero")[0], 405)
        self.assertEqual(self.counts(server), 1000)
        origin = {"Origin": f"http://127.0.0.1:{server.port}", "Sec-Fetch-Site": "same-origin"}
        status, body = self.command(server, {**good, **origin})
        self.assertEqual((status, body["ok"]), (200, True), body)
        wait_until(lambda: self.counts(server) == 0, "it is at zero")

        def commands():
            return [event for event in server.json(of(self.name, "events"))["events"]
                    if event["kind"] == "command"]
        events = wait_until(commands, "the history has it")
        self.assertEqual(len(events), 1)
        self.assertEqual(events[0]["who"], "anna from 127.0.0.1")

    def command(self, server, headers):
        return server.command(self.name, "zero", headers)

    def test_refuses_bad_commands(self):
        server = self.without_history(self.name, "--token-file", self.tokens())
        good = {"Authorization": f"Bearer {TOKEN}"}
        status, body = server.command(self.name, "memory-read", good, argument=["5"])
        self.assertEqual(status, 200, body)
        # the reply of the command has no key "change", because memory-read changes nothing
        self.assertNotIn("change", body)
        status, body = server.command(self.name, "memory-write", good, argument=["5", "66"])
        self.assertEqual((status, body["change"]), (200, "confirmed"))
        for command, argument in (("zerro", []), ("memory-read", ["x"]), ("memory-read", ["5", "6", "7", "8", "9"])):
            status, body = server.command(self.name, command, good, argument=argument)
            self.assertEqual(status, 400, body)
            self.assertTrue(body["error"])

    def test_removed_token_is_refused(self):
        path = self.tokens()
        server = self.without_history(self.name, "--token-file", path)
        good = {"Authorization": f"bearer {TOKEN}"}  # the authorization scheme may be written in upper or lower case
        self.assertEqual(self.command(server, good)[0], 200)
        with open(path, "w", encoding="utf-8") as file:
            file.write("berta another-secret-of-hers\n")
        server.process.send_signal(signal.SIGHUP)
        wait_until(lambda: self.command(server, good)[0] == 401, "the token is gone")
        self.assertEqual(self.command(server, {"Authorization": "Bearer another-secret-of-hers"})[0], 200)
        os.chmod(path, 0o644)
        server.process.send_signal(signal.SIGHUP)
        line = b""
        while b"chmod 600" not in line:
            line = server.process.stderr.readline()
            self.assertTrue(line, "it was read, although others may read it")
        self.assertEqual(self.command(server, {"Authorization": "Bearer another-secret-of-hers"})[0], 200)

    def test_wrong_tokens_are_counted_limited_and_reported(self):
        server = self.server(self.name, "--token-file", self.tokens(), "--history", self.file("history"))
        wrong = {"Authorization": "Bearer " + "x" * 20}
        self.assertEqual([self.command(server, wrong)[0] for _ in range(13)], [401] * 10 + [429] * 3)
        self.assertEqual(self.command(server, {"Authorization": f"Bearer {TOKEN}"})[0], 200)
        self.assertIn("absenc_wrong_tokens_total{} 13\n", server.ask("/metrics")[1])
        # Wrong tokens of one IP address are counted together for all paths.
        self.assertEqual(server.ask("/api/token", headers=wrong)[0], 429)
        self.assertIn("absenc_wrong_tokens_total{} 14\n", server.ask("/metrics")[1])

        def events():
            return [event for event in server.json("/api/events")["events"] if event["kind"] == "access"]
        result = wait_until(lambda: len(events()) >= 2 and events(), "both are reported")
        self.assertEqual(len(result), 2)
        self.assertIn("a request had a wrong token", result[1]["text"])
        self.assertIn("10", result[0]["text"])
        self.assertEqual({event["who"] for event in result}, {"127.0.0.1"})

    def test_without_tokens_nothing_can_be_changed(self):
        server = self.without_history(self.name)
        status, body = self.command(server, {"Authorization": "Bearer "})
        self.assertEqual(status, 403)
        self.assertIn("--token-file", body["error"])

    def test_other_computers_need_token_to_read(self):
        server = Server("sim:tformat", "--token-file", self.tokens(), "--history", "none", "--listen", "0.0.0.0:0")
        self.addCleanup(end, server.process)
        self.assertEqual(server.ask("/api/encoders")[0], 401)
        self.assertEqual(server.ask("/metrics")[0], 401)
        self.assertEqual(server.ask("/healthz")[0], 200)
        self.assertEqual(server.ask("/")[0], 200)
        self.assertEqual(server.ask("/api/encoders", headers={"Authorization": f"Bearer {TOKEN}"})[0], 200)

    def test_host_names_ignore_case(self):
        server = self.without_history(self.name, "--token-file", self.tokens())
        self.counts(server)
        headers = {"Authorization": f"BEARER {TOKEN}", "Host": f"LocalHost:{server.port}"}
        command = {"argument": ["5", "66"]}
        for origin, expected in ((f"http://LOCALHOST:{server.port}", 200), (f"http://LOCALHOSTS:{server.port}", 403)):
            status, body = server.command(self.name, "memory-write", {**headers, "Origin": origin}, **command)
            self.assertEqual(status, expected, body)

    def test_refuses_other_host_names(self):
        server = self.without_history(self.name)
        self.assertEqual(server.ask("/api/encoders", headers={"Host": "evil.example"})[0], 403)
        self.assertEqual(server.ask("/api/encoders", headers={"Host": f"localhost:{server.port}"})[0], 200)

    def test_refuses_readable_token_file(self):
        path = self.tokens()
        os.chmod(path, 0o644)
        result = LostEncoder.run_serve("sim:tformat", "--token-file", path)
        self.assertEqual(result.returncode, 1)
        self.assertIn("chmod 600", result.stderr)
        os.chmod(path, 0o600)
        self.file("tokens", "anna short\n")
        self.assertIn("16 characters", LostEncoder.run_serve("sim:tformat", "--token-file", path).stderr)


class EncoderAccess(ServeCase):
    """Tests of settings, memory and doctor, which access an encoder beside its readings."""

    def post(self, server, encoder, headers=None):
        status, body = server.ask(of(encoder, "doctor"), "POST", headers)
        return status, json.loads(body)

    def emulator(self, *arguments, **settings):
        emulator = Emulator(self.directory, *arguments, **settings)
        self.addCleanup(emulator.end)
        return emulator, f"{settings.get('protocol', 'tformat')}:{emulator.path}?latency=300"

    def live(self, server, index=0):
        return wait_until(lambda: server.encoder(index)["state"] == "live", "it is live")

    def test_settings_equal_config(self):
        units = ("tformat", "encolink", "e201", "biss")
        server = self.without_history(*(f"sim:{unit}" for unit in units))
        for unit in units:
            wanted = json.loads(absenc("config", "get", f"sim:{unit}", "--json").stdout)["settings"]
            result = json.loads(absenc("info", f"sim:{unit}", "--json").stdout)["answers"]
            with self.subTest(unit):
                found = server.json(of(f"sim:{unit}", "settings"))
                self.assertEqual((found["settings"], found["failed"]), (wanted, {}))
                self.assertTrue(found["identity"])
                for name, fields in found["identity"].items():
                    self.assertEqual(list(fields), list(result[name]["fields"]))
                readable = server.json(of(f"sim:{unit}"))["readable"]
                self.assertEqual(readable["settings"], [*found["identity"], *wanted])
                self.assertLessEqual({row["setting"] for row in found["rows"]}, set(readable["settings"]))

    def test_written_setting_is_read(self):
        server = self.without_history("sim:tformat", "--token-file", self.tokens())
        good = {"Authorization": f"Bearer {TOKEN}"}
        status, body = server.command("sim:tformat", "set-overheat-threshold", good, argument=["77"])
        self.assertEqual(status, 200, body)
        found = server.json(of("sim:tformat", "settings"))
        row = next(row for row in found["rows"] if row["field"] == "overheat_threshold_c")
        self.assertEqual(row["value"], "77 degC")
        self.assertEqual([row["value"] for row in found["rows"] if row["field"] == "status"], ["none"])
        self.assertEqual([row["range"] for row in found["rows"] if row["range"]],
                         ["degrees: degC, 1 to 127; 0: never (0 to 127)"] * 2)

    def test_written_memory_is_read(self):
        emulator, name = self.emulator()
        server = self.without_history(name, "--token-file", self.tokens(), "--rate", "200")
        self.live(server)
        good = {"Authorization": f"Bearer {TOKEN}"}
        for address, value, page in ((5, 0x5A, 0), (126, 0xC3, 2)):
            status, body = server.command(name, "memory-write", good, argument=[address, value, page])
            self.assertEqual(status, 200, body)
        before = server.json(of(name))["readings"]
        found = server.json(of(name, "memory"))
        self.assertGreater(server.json(of(name))["readings"], before)
        self.assertEqual(found["bytes"], 6 * 127)
        pages = {part["page"]: bytes.fromhex(part["data"]) for part in found["memory"]}
        self.assertEqual((pages[0][5], pages[2][126]), (0x5A, 0xC3))
        self.assertEqual({part["address"] for part in found["memory"]}, {0})
        one = server.json(of(name, "memory"), page=2)
        self.assertEqual([(part["page"], bytes.fromhex(part["data"])) for part in one["memory"]], [(2, pages[2])])
        end(server.process)
        for page, content in pages.items():
            result = absenc("memory", "read", name, "0", "--page", str(page), "--count", "127", "--json")
            self.assertEqual(bytes.fromhex(json.loads(result.stdout)["data"]), content, result)

    def test_registers(self):
        server = self.without_history("sim:encolink")
        found = server.json(of("sim:encolink", "memory"))
        result = json.loads(absenc("memory", "read", "sim:encolink", "serial_number", "--json").stdout)
        serial = next(one for one in found["registers"] if one["name"] == "serial_number")
        self.assertEqual((serial["fields"], serial["value"]), (result["fields"], result["fields"]["serial_number"]))
        self.assertEqual(server.json(of("sim:encolink"))["readable"]["registers"],
                         len(found["registers"]) + len(found["failed"]))

    def test_reports_missing_settings_and_memory(self):
        server = self.without_history("sim:ssi", "sim:tformat")
        for path, values, words in ((of("sim:ssi", "settings"), {}, "no settings"),
                                    (of("sim:ssi", "memory"), {}, "cannot be read"),
                                    (of("sim:tformat", "memory"), {"page": 6}, "no page 6"),
                                    (of("sim:tformat", "memory"), {"page": "x"}, "page")):
            with self.subTest(path=path, values=values):
                status, body = server.ask(path, **values)
                self.assertEqual(status, 400, body)
                self.assertIn(words, json.loads(body)["error"])

    def test_reports_unreachable_encoder(self):
        server = self.without_history("tformat:" + self.file("nothing"))
        for part in ("settings", "memory"):
            status, body = server.ask(of("tformat:" + self.file("nothing"), part))
            self.assertEqual(status, 502, body)
            self.assertIn("was not done", json.loads(body)["error"])
        status, found = self.post(server, "tformat:" + self.file("nothing"))
        self.assertEqual((status, [one["id"] for one in found["findings"]]), (200, ["port_missing"]), found)

    def test_doctor_passes_healthy_encoder(self):
        emulator, name = self.emulator("--singleturn", "1000")
        server = self.server(name, "--history", self.file("history"))
        self.live(server)
        stream = self.stream(server)
        status, found = self.post(server, name)
        self.assertEqual((status, found["ok"], found["findings"]), (200, True, []), found)
        self.assertRegex(found["verdict"], "^good: ")
        examined = stream.state(lambda one: one["state"] == "examined")
        self.assertEqual((examined["angle_deg"], examined["counts"], examined["alarms"]), (None, None, None))
        self.assertIn("examined", examined["message"])
        self.assertEqual(stream.state(lambda one: one["state"] == "live")["counts"], 1000)

        def commands():
            return [event for event in server.json(of(name, "events"))["events"]
                    if event["kind"] == "command"]
        events = wait_until(commands, "the history has it")
        self.assertEqual([(event["text"], event["who"]) for event in events],
                         [(f"doctor: {found['verdict']}", "127.0.0.1")])
        end(server.process)
        result = json.loads(absenc("doctor", name, "--json").stdout)
        self.assertEqual(list(found), list(result))

    def test_doctor_names_problems(self):
        names = ("sim:tformat?alarm=battery_alarm", "sim:tformat?fault=corrupt=0.3&seed=1")
        server = self.without_history(*names)
        for name, wanted in zip(names, ("alarm", "damaged_bits")):
            status, found = self.post(server, name)
            self.assertEqual((status, found["findings"][0]["id"]), (200, wanted), found)
            for part in ("severity", "evidence", "cause", "action"):
                self.assertTrue(found["findings"][0][part])
        self.assertIn("battery_alarm", self.post(server, names[0])[1]["findings"][0]["evidence"])

    def test_doctor_keeps_virtual_encoder(self):
        server = self.without_history("sim:tformat", "--token-file", self.tokens())
        good = {"Authorization": f"Bearer {TOKEN}"}
        self.assertEqual(server.command("sim:tformat", "memory-write", good, argument=[2, 0x77, 1])[0], 200)
        self.assertTrue(self.post(server, "sim:tformat")[1]["ok"])
        page = server.json(of("sim:tformat", "memory"), page=1)
        self.assertEqual(bytes.fromhex(page["memory"][0]["data"])[2], 0x77)

    def test_doctor_refuses_shared_line(self):
        names = [f"amt21:{self.file('line')}?address={address}" for address in ("0x54", "0x58")]
        server = self.without_history(*names, "sim:tformat")
        status, body = self.post(server, names[0])
        self.assertEqual(status, 409, body)
        self.assertIn(names[1], body["error"])
        self.assertIn(f'`absenc doctor "{names[0]}"`', body["error"])
        self.assertEqual(self.post(server, "sim:tformat")[0], 200)

    def silent(self):
        """Returns the port of a line without an encoder, on which doctor takes long."""
        line = SilentLine()
        line.__enter__()
        self.addCleanup(line.__exit__, None, None, None)
        return line.path

    def begin(self, server, name):
        """Starts doctor in a thread. Returns the thread and the list for its reply."""
        answers = []

        def ask():
            # the connection is lost if the server ends before it replies
            with contextlib.suppress(OSError, ValueError):
                answers.append(self.post(server, name))
        client = threading.Thread(target=ask)
        client.start()
        self.addCleanup(client.join)
        wait_until(lambda: server.encoder()["state"] == "examined", "it is examined")
        return client, answers

    def test_one_doctor_at_a_time_and_others_continue(self):
        name = f"tformat:{self.silent()}?latency=200"
        server = self.without_history(name, "sim:tformat")
        self.live(server, 1)
        client, answers = self.begin(server, name)
        before = server.json(of("sim:tformat"))["readings"]
        for part, method in (("doctor", "POST"), ("settings", "GET"), ("memory", "GET")):
            status, body = server.ask(of(name, part), method)
            self.assertEqual(status, 409, body)
            self.assertIn("examined", json.loads(body)["error"])
        wait_until(lambda: server.json(of("sim:tformat"))["readings"] > before + 20, "others are read")
        self.assertEqual(server.encoder(1)["state"], "live")
        client.join()
        status, found = answers[0]
        self.assertEqual((status, found["ok"], found["findings"][0]["id"]), (200, False, "no_answer"), found)
        wait_until(lambda: server.encoder()["state"] == "failing", "it is asked again")

    def test_doctor_ends_with_server(self):
        port = self.silent()
        for number in (signal.SIGTERM, signal.SIGHUP):
            path = self.file("absenc.toml", f'[encoder.still]\nprotocol = "tformat"\nport = "{port}"\n'
                             'latency = 200\n[encoder.other]\nprotocol = "esl"\nport = "sim"\n')
            server = self.without_history(ABSENC_CONFIG=path)
            wait_until(lambda: server.encoder()["state"] == "failing", "it is asked in vain")
            client, answers = self.begin(server, "still")
            self.file("absenc.toml", '[encoder.other]\nprotocol = "esl"\nport = "sim"\n')
            sent = time.monotonic()
            server.process.send_signal(number)
            if number == signal.SIGTERM:
                server.process.wait(PATIENCE)
            else:
                wait_until(lambda: server.encoder()["encoder"] == "other", "it is no longer served")
            self.assertLess(time.monotonic() - sent, 1 + BUSY)
            client.join()
            if number == signal.SIGHUP:
                self.assertEqual(answers[0][0], 502, answers)
                self.assertIn("interrupted", answers[0][1]["error"])
            else:
                self.assertEqual(server.process.returncode, 0)

    def test_access_rights_of_encoder_requests(self):
        server = self.without_history("sim:tformat")
        asked = [(of("sim:tformat", part), method)
                 for part, method in (("settings", "GET"), ("memory", "GET"), ("doctor", "POST"))]
        for path, method in asked:
            for headers in ({"Origin": "http://evil.example"}, {"Sec-Fetch-Site": "cross-site"},
                            {"Host": "evil.example"}):
                self.assertEqual(server.ask(path, method, headers)[0], 403)
            self.assertEqual(server.ask(path, method)[0], 200)
        self.assertEqual(server.ask(of("sim:tformat", "doctor"))[0], 405)
        server = Server("sim:tformat", "--token-file", self.tokens(), "--history", "none", "--listen", "0.0.0.0:0")
        self.addCleanup(end, server.process)
        good = {"Authorization": f"Bearer {TOKEN}"}
        for path, method in asked:
            self.assertEqual(server.ask(path, method)[0], 401)
            self.assertEqual(server.ask(path, method, good)[0], 200)
            evil = {**good, "Origin": "http://evil.example"}
            self.assertEqual(server.ask(path, method, evil)[0], 403)


class History(ServeCase):
    NAME = "sim:tformat?motion=rpm=60&alarm=over_heat"

    def rows(self, server):
        return server.json(of(self.NAME, "history"))["rows"]

    def test_survives_kill(self):
        path = self.file("history")
        server = self.server(self.NAME, "--history", path)
        wait_until(lambda: len(self.rows(server)) >= 3, "it has three seconds")
        before = self.rows(server)
        server.process.kill()
        server.process.wait()
        with contextlib.closing(sqlite3.connect(path)) as database:
            self.assertEqual(database.execute("PRAGMA integrity_check").fetchall(), [("ok",)])
        server = self.server(self.NAME, "--history", path)
        after = {row[0]: row for row in self.rows(server)}
        for row in before:
            self.assertEqual(after.get(row[0]), row)
        whole = [row for row in before if row[7] > 40]
        self.assertTrue(whole)
        for _, least, mean, greatest, speed_least, speed_mean, speed_greatest, _, _ in whole:
            self.assertTrue(least < mean < greatest)
            self.assertTrue(speed_least <= speed_mean <= speed_greatest)
        kinds = [event["kind"] for event in server.json("/api/events")["events"]]
        self.assertIn("alarm", kinds)

    def test_command_is_recorded_before_reply(self):
        for _ in range(5):
            path = self.file("history")
            server = self.server("sim:tformat", "--history", path, "--token-file", self.tokens())
            answer = server.command("sim:tformat", "zero", {"Authorization": f"Bearer {TOKEN}"})
            server.process.kill()
            server.process.wait()
            self.assertEqual(answer[0], 200, answer)
            with contextlib.closing(sqlite3.connect(path)) as database:
                events = database.execute("SELECT text, who FROM happening WHERE kind = 'command'").fetchall()
            self.assertEqual([(text, who.split()[0]) for text, who in events], [(answer[1]["text"], "anna")])
            for ending in ("", "-wal", "-shm"):
                if os.path.exists(path + ending):
                    os.unlink(path + ending)

    def test_csv(self):
        server = self.server(self.NAME, "--history", self.file("history"))
        wait_until(lambda: len(self.rows(server)) >= 2, "it has two seconds")
        status, text = server.ask(of(self.NAME, "history.csv"))
        lines = text.splitlines()
        self.assertEqual(status, 200)
        self.assertEqual(lines[0].split(",")[:4], ["encoder", "at_s", "readings", "errors"])
        self.assertGreaterEqual(len(lines), 3)
        self.assertEqual(server.ask(of(self.NAME, "history.csv"), **{"from": 1, "to": 2})[1], lines[0] + "\n")
        self.assertEqual(server.ask(of(self.NAME, "history"), **{"from": 2, "to": 1})[0], 400)

    def test_csv_with_many_rows(self):
        path = self.file("history")
        server = self.server(self.NAME, "--history", path)
        wait_until(lambda: self.rows(server), "it has a second")
        with contextlib.closing(sqlite3.connect(path, timeout=PATIENCE)) as database:
            now = int(time.time())
            database.executemany("INSERT INTO second SELECT id, ?, 50, 0, 1, 2, 3, NULL, NULL, NULL FROM encoder",
                                 [(now - 100_000 + i,) for i in range(35_000)])
            database.commit()
        _, text = server.ask(of(self.NAME, "history.csv"), **{"from": now - 100_000, "to": now - 60_000})
        self.assertEqual(len(text.splitlines()), 35_001)
        rows = server.json(of(self.NAME, "history"), rows=100, **{"from": now - 100_000, "to": now - 60_000})
        self.assertLessEqual(len(rows["rows"]), 101)

    def test_old_rows_are_deleted(self):
        path = self.file("history")
        server = self.server(self.NAME, "--history", path)
        wait_until(lambda: self.rows(server), "it has a second")
        end(server.process)
        with contextlib.closing(sqlite3.connect(path)) as database:
            # Old rows are deleted only if there are newer rows in 24 different hours.
            hours = [(int(time.time()) - 3600 * i,) for i in range(1, 25)]
            database.executemany("INSERT INTO second SELECT id, ?, 50, 0, 1, 2, 3, NULL, NULL, NULL FROM encoder",
                                 [(1,), *hours])
            database.commit()
        end(self.server(self.NAME, "--history", path, "--history-days", "2").process)
        with contextlib.closing(sqlite3.connect(path)) as database:
            self.assertGreater(database.execute("SELECT min(at) FROM second").fetchone()[0], 1)

    def test_full_disk_is_reported(self):
        server = self.server(self.NAME, "--history", self.file("history"),
                             preexec_fn=lambda: signal.signal(signal.SIGXFSZ, signal.SIG_IGN))
        wait_until(lambda: len(self.rows(server)) >= 2, "it has two seconds")
        before = self.rows(server)
        # A limit on the file size has the same effect on the server as a full disk.
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
        wait_until(lambda: not server.json("/healthz")["ok"], "it says so")
        state = server.json("/api/encoders")
        self.assertTrue(state["history"]["trouble"])
        self.assertEqual(state["encoders"][0]["state"], "live")
        self.assertEqual(self.rows(server)[:len(before)], before)
        resource.prlimit(server.process.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        wait_until(lambda: server.json("/healthz")["ok"], "it is well again")

        def history_texts():
            return [event["text"] for event in server.json("/api/events")["events"] if event["kind"] == "history"]
        wait_until(lambda: any("could not be written" in text for text in history_texts()), "the missing rows are reported")


if __name__ == "__main__":
    unittest.main()
