# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc serve` behind nginx and Caddy, configured as in docs/serve.md."""
import contextlib
import http.client
import json
import os
import pathlib
import re
import socket
import ssl
import subprocess
import time
import unittest
import unittest.mock

from page_scenes import Browser  # imported first, because page_scenes checks that selenium is installed

from command_support import PATIENCE, end
from npm_support import SOURCE
from serve_support import BUSY, TOKEN, ServeCase, of, wait_until

NAME = "sim:tformat?motion=rpm=60"
SITE = "encoders.example"
GOOD = {"Authorization": f"Bearer {TOKEN}"}
UPSTREAM_HOST = {"nginx": ("    proxy_set_header Host $host;\n", ""),
                 "caddy": ("reverse_proxy 127.0.0.1:8420", "reverse_proxy 127.0.0.1:8420 {\n header_up Host {upstream_hostport}\n}")}


def from_document(language):
    text = pathlib.Path(SOURCE, "docs/serve.md").read_text(encoding="utf-8")
    block, = re.findall(rf"^```{language}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    return block


def free_port():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def replaced(text, *changes):
    for old, new in changes:
        assert old in text, f"{old!r} is not in the document's configuration"
        text = text.replace(old, new)
    return text


class Proxy(ServeCase):
    def setUp(self):
        super().setUp()
        self.key, self.certificate = self.file("key"), self.file("certificate")
        subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", self.key, "-out", self.certificate,
                        "-days", "2", "-subj", f"/CN={SITE}", "-addext", f"subjectAltName=DNS:{SITE}"],
                       check=True, capture_output=True, timeout=PATIENCE)

    def run_proxy(self, *command):
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "HOME": self.directory,
                                   "XDG_DATA_HOME": self.directory, "XDG_CONFIG_HOME": self.directory})
        self.addCleanup(end, process)

        def is_ready():
            if process.poll() is not None:
                raise AssertionError(process.stderr.read().decode())
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", self.port)):
                return True
        wait_until(is_ready, "the proxy is ready")

    def start(self, proxy, passes_host, upstream):
        """Starts the proxy with the configuration shown in docs/serve.md, with other ports and paths."""
        self.port = free_port()
        text = from_document(proxy)
        if not passes_host:
            text = replaced(text, UPSTREAM_HOST[proxy])
        text = replaced(text, ("127.0.0.1:8420", f"127.0.0.1:{upstream.port}"), ("/etc/ssl/encoders.pem", self.certificate),
                        ("/etc/ssl/encoders.key", self.key))
        if proxy == "nginx":
            text = replaced(text, ("listen 443 ssl", f"listen 127.0.0.1:{self.port} ssl"))
            paths = "".join(f"{kind}_temp_path {self.directory}/{kind};\n" for kind in ("client_body", "proxy", "fastcgi", "uwsgi", "scgi"))
            main = f"daemon off; master_process off; pid {self.directory}/pid; events {{}}\nhttp {{ access_log off; {paths} {text} }}\n"
            self.run_proxy("/usr/sbin/nginx", "-p", self.directory, "-e", "stderr", "-c", self.file("nginx.conf", main))
        else:
            text = replaced(text, (f"{SITE} {{", f"{SITE}:{self.port} {{\nbind 127.0.0.1"))
            options = "{\nadmin off\nauto_https disable_redirects\n}\n"
            self.run_proxy("/usr/bin/caddy", "run", "--adapter", "caddyfile", "--config", self.file("Caddyfile", options + text))

    def connect(self):
        context = ssl.create_default_context(cafile=self.certificate)
        connection = http.client.HTTPSConnection(SITE, self.port, timeout=PATIENCE)
        connection.sock = context.wrap_socket(socket.create_connection(("127.0.0.1", self.port), PATIENCE), server_hostname=SITE)
        return connection

    def ask(self, path, method="GET", headers=None, host=SITE):
        with contextlib.closing(self.connect()) as connection:
            connection.request(method, path, headers={"Host": host, **(headers or {})})
            answer = connection.getresponse()
            return answer.status, answer.read().decode()

    def server_behind(self, proxy, passes_host=True, *arguments):
        arguments = arguments or ("--token-file", self.tokens(), "--public-url", f"https://{SITE}")
        served = self.server(NAME, "--history", self.file("history"), *arguments)
        wait_until(lambda: served.ask("/healthz")[1].find('"live":1') > 0, "it is live")
        self.start(proxy, passes_host, served)
        return served

    def zero(self, headers):
        return self.ask(of(NAME, "command") + "?command=memory-write&argument=5&argument=66", "POST", headers)

    def assert_page_and_commands_work(self, proxy, passes_host):
        self.server_behind(proxy, passes_host)
        self.assertIn("<title>", self.ask("/")[1])
        self.assertEqual(self.ask("/healthz")[0], 200)
        for path in ("/api/encoders", "/api/stream", "/metrics", of(NAME, "history")):
            self.assertEqual(self.ask(path)[0], 401, path)
        self.assertEqual(self.ask("/api/encoders", headers=GOOD)[0], 200)
        with contextlib.closing(self.connect()) as connection:
            connection.request("GET", "/api/stream", headers={"Host": SITE, **GOOD})
            begin = time.time()
            lines = iter(connection.getresponse().readline, b"")
            state = json.loads(next(line for line in lines if b'"encoders"' in line)[6:])
            # At most this many seconds may pass until the first state arrives; a proxy that buffers the event stream
            # takes longer.
            self.assertLess(abs(state["at_ms"] / 1000 - begin), 1 + BUSY)
        own = {**GOOD, "Origin": f"https://{SITE}", "Sec-Fetch-Site": "same-origin"}
        self.assertEqual(self.zero({**own, "Authorization": "Bearer " + "x" * 20})[0], 401)
        for evil in ({"Origin": "https://evil.example"}, {"Origin": f"http://{SITE}.evil.example"}, {"Sec-Fetch-Site": "cross-site"}):
            self.assertEqual(self.zero({**own, **evil})[0], 403, evil)
        # An IP address that the client itself states in a header must not be in the history.
        status, body = self.zero({**own, "X-Forwarded-For": "203.0.113.9"})
        self.assertEqual(status, 200, body)
        events = json.loads(self.ask("/api/events", headers=GOOD)[1])["events"]
        self.assertEqual([event["who"] for event in events if event["kind"] == "command"], ["anna from 127.0.0.1"])

    def test_nginx_that_forwards_host_name(self):
        self.assert_page_and_commands_work("nginx", True)

    def test_nginx_that_replaces_host_name(self):
        self.assert_page_and_commands_work("nginx", False)

    def test_caddy_that_forwards_host_name(self):
        self.assert_page_and_commands_work("caddy", True)

    def test_caddy_that_replaces_host_name(self):
        self.assert_page_and_commands_work("caddy", False)

    def test_page_in_browser(self):
        port = free_port()  # port in the public URL; the browser sends it as part of the header Origin
        served = self.server(NAME, "--history", "none", "--token-file", self.tokens(), "--public-url", f"https://{SITE}:{port}")
        with unittest.mock.patch(f"{__name__}.free_port", return_value=port):
            self.start("nginx", False, served)
        browser = Browser("--ignore-certificate-errors", f"--host-resolver-rules=MAP {SITE} 127.0.0.1").driver
        self.addCleanup(browser.quit)
        text = "return document.body.innerText"
        browser.get(f"https://{SITE}:{port}/")
        wait_until(lambda: "This needs a token" in browser.execute_script(text), "the page says that it takes a token")
        browser.execute_script("sessionStorage.setItem('token', arguments[0]); location.reload()", TOKEN)
        wait_until(lambda: "60.0 rpm" in browser.execute_script(text), "the page shows the encoder")
        status = browser.execute_async_script("""
            const [path, token, done] = arguments;
            fetch(path, {method: "POST", headers: {Authorization: `Bearer ${token}`}}).then((answer) => done(answer.status));""",
                                              of(NAME, "command") + "?command=memory-write&argument=5&argument=66", TOKEN)
        self.assertEqual(status, 200)

    def test_proxy_without_public_url(self):
        """Without --public-url, a request with forwarding headers needs a token even for reading."""
        self.server_behind("caddy", False, "--token-file", self.tokens())
        self.assertEqual(self.ask("/api/encoders")[0], 401)
        self.assertEqual(self.ask("/api/encoders", headers=GOOD)[0], 200)
        status, body = self.zero({**GOOD, "Origin": f"https://{SITE}"})
        self.assertEqual(status, 403)
        self.assertIn("--public-url", body)


class NamedProxy(ServeCase):
    """Tests the access rules directly, by requests with the headers that a proxy adds."""

    def test_accepts_only_public_host_name(self):
        server = self.without_history(NAME, "--token-file", self.tokens(), "--public-url", f"https://{SITE}")
        for host, expected in ((SITE, 200), (SITE.upper(), 200), (f"{SITE}:443", 200), ("localhost", 200), ("evil.example", 403),
                               (f"{SITE}.evil.example", 403)):
            self.assertEqual(server.ask("/api/encoders", headers={**GOOD, "Host": host})[0], expected, host)
        self.assertEqual(server.ask("/api/encoders")[0], 401)

    def test_client_address_is_last_forwarded_one(self):
        path = self.file("history")
        for arguments, forwarded, expected in (
                (("--public-url", f"https://{SITE}"), "203.0.113.9, 10.1.2.3", "10.1.2.3"),
                (("--public-url", f"https://{SITE}"), "<b>", "127.0.0.1"),
                ((), "203.0.113.9", "127.0.0.1")):
            server = self.server(NAME, "--history", path, "--token-file", self.tokens(), *arguments)
            headers = {**GOOD, "X-Forwarded-For": forwarded}
            self.assertEqual(server.command(NAME, "memory-write", headers, argument=["5", "66"])[0], 200)
            status, body = server.ask("/api/events", headers=GOOD)
            self.assertEqual(status, 200)
            last = next(event for event in json.loads(body)["events"] if event["kind"] == "command")
            self.assertEqual(last["who"], f"anna from {expected}")
            end(server.process)

    def test_without_tokens_everybody_may_read(self):
        server = self.without_history(NAME, "--public-url", f"https://{SITE}")
        self.assertEqual(server.ask("/api/encoders", headers={"Host": SITE, "X-Forwarded-For": "10.1.2.3"})[0], 200)

    def test_refuses_invalid_public_url(self):
        for url in (SITE, "ftp://encoders.example", "https://", "https://user@encoders.example"):
            with self.assertRaisesRegex(AssertionError, "--public-url"):
                self.without_history(NAME, "--public-url", url)


if __name__ == "__main__":
    unittest.main()
