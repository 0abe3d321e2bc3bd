# SPDX-License-Identifier: Apache-2.0
"""Shared by the tests of `absenc serve`: the server process, event streams, waiting."""
import contextlib
import http.client
import json
import os
import select
import subprocess
import time
import urllib.parse

from command_support import ABSENC, PATIENCE, Case, FakeLine, end, read_line

TOKEN = "a-secret-of-nobody-else"
# Time limit in seconds for a reaction of the server that should be immediate.
BUSY = float(os.environ.get("ABSENC_BUSY_SECONDS", "1"))


def wait_until(true, what):
    deadline = time.monotonic() + PATIENCE
    while not (value := true()):
        if time.monotonic() > deadline:
            raise AssertionError(f"in vain waited until {what}")
        time.sleep(0.02)
    return value


def of(encoder, part=""):
    """Returns the URL path of an encoder's API, or of a part of that API such as "history"."""
    return "/api/encoders/" + urllib.parse.quote(encoder, safe="") + (part and f"/{part}")


class Stream:
    """An open stream of the server's events (server-sent events)."""

    def __init__(self, server, trace=""):
        self.connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=PATIENCE)
        self.connection.request("GET", of(trace, "stream") if trace else "/api/stream")
        self.answer = self.connection.getresponse()

    def next(self):
        """Returns (name, data) of the next event in the stream."""
        name = data = ""
        while True:
            line = self.answer.readline().decode().rstrip("\n")
            if line.startswith("event: "):
                name = line[7:]
            if line.startswith("data: "):
                data += line[6:]
            if line == "" and name:
                return name, json.loads(data)

    def until(self, wanted):
        """Returns the data of the first event for which `wanted(name, data)` is true."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            event, data = self.next()
            if wanted(event, data):
                return data
        raise AssertionError("in vain waited for an event")

    def state(self, wanted=lambda encoder: True):
        """Returns the first encoder of the first event "state" for which `wanted(encoder)` is true."""
        data = self.until(lambda event, data: event == "state" and wanted(data["encoders"][0]))
        return data["encoders"][0]

    def close(self):
        self.answer.close()
        self.connection.close()


class Server:
    def __init__(self, *arguments, preexec_fn=None, within=(), program=ABSENC, **environment):
        where = [] if "--listen" in arguments else ["--listen", "127.0.0.1:0"]
        command = [*within, program, "serve", *arguments, *where]
        self.process = subprocess.Popen(command, bufsize=0, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                        preexec_fn=preexec_fn, env={**os.environ, **environment})
        line = read_line(self.process.stdout, time.monotonic() + PATIENCE)
        if line is None:
            raise AssertionError(f"the server did not become ready: {end(self.process)}")
        self.url = line.strip()
        self.port = int(self.url.rstrip("/").rsplit(":", 1)[1])

    def answer(self, path, method="GET", headers=None, **values):
        """Returns the reply to a request: (HTTP status, content type, text)."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE)
        with contextlib.closing(connection):
            query = "?" + urllib.parse.urlencode(values, doseq=True) if values else ""
            connection.request(method, path + query, headers=headers or {})
            answer = connection.getresponse()
            return answer.status, answer.getheader("Content-Type"), answer.read().decode()

    def ask(self, path, method="GET", headers=None, **values):
        status, _, text = self.answer(path, method, headers, **values)
        return status, text

    def json(self, path, **values):
        status, body = self.ask(path, **values)
        if status != 200:
            raise AssertionError(f"{path}: {status} {body}")
        return json.loads(body)

    def encoder(self, index=0):
        return self.json("/api/encoders")["encoders"][index]

    def command(self, encoder, command, headers, **values):
        status, body = self.ask(of(encoder, "command"), "POST", headers, command=command, **values)
        return status, json.loads(body)


class SilentLine(FakeLine):
    """A line without an encoder. Doctor takes long on such a line, because it tries all rates."""

    def serve(self):
        select.select([self.wake], [], [])


class ServeCase(Case):
    def server(self, *arguments, **settings):
        server = Server(*arguments, **settings)
        self.addCleanup(end, server.process)
        return server

    def without_history(self, *arguments, **settings):
        return self.server(*arguments, "--history", "none", **settings)

    def tokens(self):
        path = self.file("tokens", f"anna {TOKEN}\n")
        os.chmod(path, 0o600)
        return path

    def stream(self, server, trace=""):
        stream = Stream(server, trace)
        self.addCleanup(stream.close)
        return stream
