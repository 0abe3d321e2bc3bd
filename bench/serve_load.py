#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the cost and the lateness of readings in `absenc serve`: bench/serve_load.py [SECONDS [ENCODERS...]]

A reading is late if more than the period has passed since the previous one, by the server's times."""
import contextlib
import json
import os
import pathlib
import selectors
import socket
import subprocess
import sys
import tempfile
import time
import urllib.parse
import urllib.request

ROOT = pathlib.Path(__file__).resolve().parent.parent
ABSENC = os.environ.get("ABSENC", str(ROOT / "build/release/bin/absenc"))
RATE, STREAMS, PARSED = 100, 200, 20
TICK = os.sysconf("SC_CLK_TCK")


def cpu_of(process):
    fields = pathlib.Path(f"/proc/{process.pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / TICK


class Emulators:
    def __init__(self, count):
        command = [ABSENC, "emulate", "tformat", "--tcp", "0", "--motion", "rpm=60"]
        self.processes = [subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
                          for _ in range(count)]
        self.ports = [self.port(process) for process in self.processes]

    @staticmethod
    def port(process):
        for line in process.stdout:
            if line.startswith("ready: tcp:"):
                return line.split(maxsplit=1)[1].strip()
        sys.exit("an emulator did not become ready")

    def cpu(self):
        return sum(map(cpu_of, self.processes))

    def end(self):
        for process in self.processes:
            process.terminate()
        for process in self.processes:
            process.wait()


class Server:
    def __init__(self, folder, ports):
        config = pathlib.Path(folder, "absenc.toml")
        config.write_text("".join(f'[encoder.e{i}]\nprotocol = "tformat"\nport = "{port}"\nrate_hz = {RATE}\n'
                                  for i, port in enumerate(ports)), encoding="utf-8")
        self.process = subprocess.Popen([ABSENC, "serve", "--history", f"{folder}/history", "--listen", "127.0.0.1:0"],
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                                        env={**os.environ, "ABSENC_CONFIG": str(config)})
        self.url = self.process.stdout.readline().strip()

    def cpu(self):
        return cpu_of(self.process)

    def memory_mb(self):
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text(encoding="ascii")
        return int(status.split("VmRSS:")[1].split()[0]) / 1024

    def metric(self, name):
        with urllib.request.urlopen(self.url + "metrics") as answer:
            lines = answer.read().decode().splitlines()
        return sum(float(line.rsplit(" ", 1)[1]) for line in lines if line.startswith(name + "{"))

    def end(self):
        self.process.terminate()
        self.process.wait()


class Streams:
    """Open event streams of the server. Times of readings are stored for some of them."""

    def __init__(self, server, encoders):
        self.selector = selectors.DefaultSelector()
        self.texts, self.times = {}, {}
        where = urllib.parse.urlparse(server.url)
        for i in range(STREAMS):
            stream = socket.create_connection((where.hostname, where.port))
            stream.sendall(f"GET /api/encoders/e{i % encoders}/stream HTTP/1.0\r\nHost: {where.netloc}\r\n\r\n".encode())
            self.selector.register(stream, selectors.EVENT_READ, i)
            if i < min(PARSED, encoders):
                self.texts[i], self.times[i] = b"", []

    def read(self, seconds):
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            for key, _ in self.selector.select(left):
                got = key.fileobj.recv(1 << 20)
                if not got:
                    sys.exit("the server has ended a stream")
                if key.data in self.texts:
                    self.store_times(key.data, got)

    def store_times(self, i, got):
        *lines, self.texts[i] = (self.texts[i] + got).split(b"\n")
        for line in lines:
            if line.startswith(b"data: ") and b'"points":' in line:
                self.times[i] += [at for at, *_ in json.loads(line[6:])["points"]]

    def late_ms(self):
        """Returns the lateness of each stored reading in ms, in ascending order."""
        return sorted(max(0, after - before - 1000 // RATE)
                      for times in self.times.values() for before, after in zip(times, times[1:]))

    def close(self):
        for key in list(self.selector.get_map().values()):
            key.fileobj.close()
        self.selector.close()


def measure(count, seconds):
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as running:
        emulators = Emulators(count)
        running.callback(emulators.end)
        server = Server(folder, emulators.ports)
        running.callback(server.end)
        measure_served(server, emulators, seconds)


def measure_served(server, emulators, seconds):
    count = len(emulators.processes)
    streams = Streams(server, count)
    streams.read(5)
    for times in streams.times.values():
        times.clear()
    readings, memory, start = server.metric("absenc_readings_total"), [], time.monotonic()
    cpu, of_emulators = server.cpu(), emulators.cpu()
    while (left := seconds - (time.monotonic() - start)) > 0:
        streams.read(min(1, left))
        memory.append(server.memory_mb())
    cpu, of_emulators, took = server.cpu() - cpu, emulators.cpu() - of_emulators, time.monotonic() - start
    readings = server.metric("absenc_readings_total") - readings
    late = streams.late_ms()
    of_each, of_all = 1e6 / readings, 100 / took / os.cpu_count()
    print(f"{count} encoders, {STREAMS} streams, {took:.0f} s: {readings / took:.0f} of {count * RATE} readings a "
          f"second, {of_each * cpu:.0f} us of CPU for each ({of_each * of_emulators:.0f} of its emulator), "
          f"{of_all * (cpu + of_emulators):.0f} % of the processors; of {len(late)} readings 99 % are late by at most "
          f"{late[len(late) * 99 // 100]} ms, one by {late[-1]} ms, {sum(one > 100 for one in late)} by more than "
          f"100 ms; memory {memory[0]:.0f} MB, at most {max(memory):.0f}, at the end {memory[-1]:.0f}", flush=True)
    streams.close()


def main():
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60
    for count in [int(text) for text in sys.argv[2:]] or [25, 50, 100]:
        measure(count, seconds)


if __name__ == "__main__":
    main()
