#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the cost of MQTT in `absenc serve`, and how fast it sends a full spool: bench/serve_mqtt.py [absenc]

Needs mosquitto, python3-paho-mqtt."""
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parent.parent
os.environ.setdefault("ABSENC", sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "build/release/bin/absenc"))
sys.path.insert(0, str(ROOT / "tests"))
from mqtt_support import Broker, Receiver, free_port, numbers  # noqa: E402

ENCODERS, RATE, SECONDS = 50, 100, 10
TICK = os.sysconf("SC_CLK_TCK")


class Server:
    def __init__(self, folder, *arguments):
        config = pathlib.Path(folder, "absenc.toml")
        config.write_text("".join(f'[encoder.e{i}]\nprotocol = "tformat"\nport = "sim"\nmotion = "rpm=60"\n'
                                  f"rate_hz = {RATE}\n" for i in range(ENCODERS)), encoding="utf-8")
        command = [os.environ["ABSENC"], "serve", "--history", "none", "--listen", "127.0.0.1:0", *arguments]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                                        env={**os.environ, "ABSENC_CONFIG": str(config)})
        self.url = self.process.stdout.readline().strip()

    def cpu(self):
        fields = pathlib.Path(f"/proc/{self.process.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / TICK

    def mqtt(self):
        with urllib.request.urlopen(self.url + "api/mqtt") as answer:
            return json.load(answer)

    def end(self):
        self.process.terminate()
        self.process.wait()


def share(server):
    """Returns the load of the server in percent of a core."""
    time.sleep(2)
    before, start = server.cpu(), time.monotonic()
    time.sleep(SECONDS)
    return 100 * (server.cpu() - before) / (time.monotonic() - start)


def cost(folder, broker):
    mqtt = ("--mqtt", broker.url, "--mqtt-spool", f"{folder}/spool", "--mqtt-prefix", "bench")
    for title, arguments in (("nothing sent", ()), ("MQTT", mqtt), ("UDP", ("--udp", f"127.0.0.1:{free_port()}"))):
        server = Server(folder, *arguments)
        print(f"{ENCODERS} encoders at {RATE} Hz, {title}: {share(server):.1f} % of a core", flush=True)
        server.end()


def delay(folder, broker):
    """Measures the time from a reading to its arrival at an MQTT receiver."""
    receiver = Receiver(broker.port, "bench/+/readings")
    late = []
    receiver.client.on_message = lambda client, data, message: late.extend(
        time.time() - one[0] / 1e6 for one in json.loads(message.payload)["readings"])
    server = Server(folder, "--mqtt", broker.url, "--mqtt-spool", f"{folder}/spool", "--mqtt-prefix", "bench")
    time.sleep(SECONDS)
    server.end()
    receiver.end()
    late.sort()
    print(f"from reading to receiver: median {1000 * late[len(late) // 2]:.0f} ms, 99 % within "
          f"{1000 * late[len(late) * 99 // 100]:.0f} ms, of {len(late)}")


def emptying(folder, broker):
    spool = ("--mqtt-spool", f"{folder}/full", "--mqtt-prefix", "bench")
    server = Server(folder, "--mqtt", f"mqtt://127.0.0.1:{free_port()}", *spool)
    while server.mqtt()["waiting"] < 20_000:
        time.sleep(0.2)
    server.process.kill()
    server.process.wait()
    receiver = Receiver(broker.port, "bench/+/readings")
    server = Server(folder, "--mqtt", broker.url, *spool)
    start = time.monotonic()
    while server.mqtt()["waiting"] > 500:
        time.sleep(0.02)
    seconds, sent = time.monotonic() - start, server.mqtt()["sent"]
    taken = server.mqtt()["taken"]
    while any((numbers(receiver.all("readings"), f"e{i}") or [0])[-1] < taken[f"e{i}"] for i in range(ENCODERS)):
        time.sleep(0.2)
    bad = [i for i in range(ENCODERS)
           if (found := numbers(receiver.all("readings"), f"e{i}")) != list(range(1, len(found) + 1))]
    server.end()
    receiver.end()
    print(f"a spool of 20000 messages: {sent} in {seconds:.1f} s, {sent / seconds:.0f} a second, "
          f"{'all in order' if not bad else f'NOT in order: {bad}'}")


def main():
    with tempfile.TemporaryDirectory() as folder:
        broker = Broker(folder)
        try:
            cost(folder, broker)
            delay(folder, broker)
            emptying(folder, broker)
        finally:
            broker.end()


if __name__ == "__main__":
    main()
