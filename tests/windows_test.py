#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests absenc.exe under wine: COM ports that lead to pseudo-terminals, TCP, files, the console. ABSENC is the command
for Linux, ABSENC_EXE the one for Windows."""
import contextlib
import itertools
import json
import os
import re
import select
import shlex
import signal
import socket
import sqlite3
import subprocess
import sys
import threading
import time
import tty
import unittest
import zipfile
from pathlib import Path

import h5py

from capture_support import FRAMES, conversation, write_each_format
from command_support import PATIENCE, Emulator, EncoderCase, FakeEncoder, absenc, character_units, end, json_lines
from command_support import read_line, run_tool
from monitor_test import Terminal
from mqtt_support import Broker, Receiver, free_port, numbers as numbers_of
from serve_support import TOKEN, Server, Stream, of, wait_until
from wine_support import WINE, Prefix

EXE = os.path.abspath(os.environ.get("ABSENC_EXE", "build/windows/bin/absenc.exe"))
prefix = Prefix()
numbers = itertools.count(10)


def setUpModule():
    prefix.__enter__()


def tearDownModule():
    prefix.__exit__()


def windows(*arguments, **settings):
    """Runs absenc.exe and returns its completed process."""
    settings.setdefault("stdin", subprocess.DEVNULL)
    settings.setdefault("timeout", PATIENCE)
    settings.setdefault("env", prefix.environment)
    return subprocess.run([WINE, EXE, *arguments], capture_output=True, encoding="utf-8", **settings)


class Cable:
    """Two pseudo-terminals that are connected: what is written to one is read from the other."""

    def __init__(self):
        self.masters, slaves = zip(os.openpty(), os.openpty())
        for slave in slaves:
            tty.setraw(slave)
        self.slaves = slaves
        self.paths = [os.ttyname(slave) for slave in slaves]
        self.wake, self.waker = os.pipe()
        self.thread = threading.Thread(target=self.carry)

    def carry(self):
        while True:
            ready, _, _ = select.select([*self.masters, self.wake], [], [])
            if self.wake in ready:
                return
            for one, other in (self.masters, self.masters[::-1]):
                if one in ready:
                    os.write(other, os.read(one, 4096))

    def __enter__(self):
        self.thread.start()
        return self

    def __exit__(self, *_):
        os.write(self.waker, b"x")
        self.thread.join()
        for descriptor in (*self.masters, *self.slaves, self.wake, self.waker):
            os.close(descriptor)


class WindowsCase(EncoderCase):
    def com(self, path):
        """Returns the name of a new COM port that leads to the terminal at `path`."""
        number = next(numbers)
        prefix.link_port(number, path)
        self.addCleanup(prefix.link_port, number, None)
        return f"COM{number}"

    def at_com(self, *arguments, latency=300, protocol="tformat"):
        """Returns the address of a new emulator at a COM port."""
        emulator = Emulator(self.directory, *arguments, protocol=protocol, name=f"encoder-{next(numbers)}")
        self.addCleanup(emulator.end)
        return f"{protocol}:{self.com(emulator.path)}?latency={latency}"

    def begin(self, *arguments, **settings):
        """Starts absenc.exe in the background."""
        settings.setdefault("stdin", subprocess.DEVNULL)
        process = subprocess.Popen([WINE, EXE, *arguments], bufsize=0, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                                   env=prefix.environment, **settings)
        self.addCleanup(lambda: end(process, signal.SIGKILL) if process.poll() is None else None)
        return process

    def dos(self, name):
        """Returns the path of a file in the test's directory as Windows names it."""
        return "Z:" + self.file(name).replace("/", "\\")


class Basics(WindowsCase):
    def test_version_and_help_and_wrong_options(self):
        version = windows("--version")
        self.assert_good(version)
        with open(os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "VERSION"),
                  encoding="utf-8") as file:
            self.assertIn(f"absenc {file.read().strip()}\n", version.stdout)
        text = windows("--help")
        self.assert_good(text)
        self.assertIn("Usage: absenc <verb> ...", text.stdout)
        self.assertIn("absenc read tformat:COM3", windows("read", "--help").stdout)
        self.assertNotIn("\r", text.stdout)
        self.assert_wrong_usage(windows("--nonsense"), "there is no option --nonsense")
        self.assert_wrong_usage(windows("read", "sim:tformat", "--cuont", "1"), "read has no option --cuont", "--count")

    def test_virtual_encoder_and_all_units(self):
        result = windows("read", "sim:tformat?motion=rpm=60&multiturn=12", "--count", "3", "--json")
        self.assert_good(result)
        self.assertEqual([line["multiturn"] for line in json_lines(result.stdout)], [12, 12, 12])
        self.assertEqual(windows("list", "--json").stdout, absenc("list", "--json").stdout)

    def test_parts_that_are_left_out_say_so(self):
        self.assert_failed(windows("read", "ssi:spi:/dev/spidev0.0"), "SPI controller", "which Windows does not have")
        can = next(unit["protocol"] for unit in json_lines(absenc("list", "--json").stdout) if unit["link"] == "can")
        self.assert_failed(windows("read", f"{can}:can0"), "which Windows does not have", "slcan:COM5")
        self.assert_failed(windows("emulate", "tformat"), "Windows has no pseudo-terminals", "--tcp")

    def test_output_to_a_full_disk_fails(self):
        with open("/dev/full", "wb") as full:
            result = subprocess.run([WINE, EXE, "read", "sim:tformat"], stdin=subprocess.DEVNULL, stdout=full,
                                    stderr=subprocess.PIPE, env=prefix.environment, timeout=PATIENCE, check=False)
        self.assertEqual(result.returncode, 1)
        self.assertIn(b"standard output cannot be written: No space left", result.stderr)

    def test_closed_output_ends_the_command(self):
        process = self.begin("read", "sim:tformat", "--count", "0", "--rate", "200")
        self.assertIsNotNone(read_line(process.stdout, time.monotonic() + PATIENCE))
        process.stdout.close()
        self.assertEqual(process.wait(timeout=PATIENCE), 0, process.stderr.read())


class Ports(WindowsCase):
    def test_reads_as_text_and_json(self):
        address = self.at_com("--singleturn", "65536", "--multiturn", "12")
        result = windows("read", address)
        self.assert_good(result)
        self.assertIn("180.000 deg", result.stdout)
        self.assertIn("12 turns", result.stdout)
        lines = json_lines(windows("read", address.lower(), "--json", "--count", "50", "--rate", "0").stdout)
        self.assertEqual({(line["ok"], line["singleturn"]) for line in lines}, {(True, 65536)})
        self.assertEqual(len(lines), 50)

    def test_silence_is_a_timeout_with_its_evidence(self):
        result = windows("read", self.at_com("--fault", "silence=1", latency=20))
        self.assertEqual(result.returncode, 1)
        self.assertIn("timeout: the encoder did not answer", result.stderr)
        self.assertRegex(result.stderr, r"sent 1A to COM\d+ at 2500000 baud; nothing came back")

    def test_late_replies_never_answer_a_later_request(self):
        address = self.at_com("--fault", "delay=0.3", "--motion", "rpm=60", latency=20)
        result = windows("read", address, "--json", "--count", "60", "--rate", "50")
        lines = json_lines(result.stdout)
        self.assertIn("timeout", {line.get("error") for line in lines})
        good = [line for line in lines if line["ok"]]
        self.assertGreater(len(good), 10)
        for line in good:
            turned = (line["multiturn"] + line["angle_deg"] / 360) * 60 / 60  # seconds at 60 rpm
            self.assertAlmostEqual(turned - line["time_s"], good[0]["multiturn"] + good[0]["angle_deg"] / 360 -
                                   good[0]["time_s"], delta=0.045)

    def test_echo_is_removed(self):
        with FakeEncoder() as fake:
            fake.answer = lambda request: request + bytes.fromhex("1A 00 45 23 01 11 34 12 00 00 4A")
            result = windows("read", f"tformat:{self.com(fake.path)}?latency=300&echo=on", "--json")
        self.assert_good(result)
        self.assertEqual(json.loads(result.stdout)["singleturn"], 0x12345)

    def test_bytes_from_before_are_discarded(self):
        with FakeEncoder(bytes.fromhex("1A 00 45 23 01 11 34 12 00 00 4A")) as fake:
            os.write(fake.master, bytes(range(200)))
            result = windows("read", f"tformat:{self.com(fake.path)}?latency=300", "--json")
        self.assert_good(result)

    def test_absent_and_unsuitable_ports(self):
        self.assert_failed(windows("read", "tformat:COM200"), "there is no port COM200")
        file = self.file("text.txt", "no port")
        self.assert_failed(windows("read", "tformat:Z:" + file.replace("/", "\\")), "is not a serial port")
        self.assert_wrong_usage(windows("read", "COM200"), "does not say which protocol", "tformat:COM200")
        self.assert_wrong_usage(windows("read", "tformat"), "does not say where", "COM")

    def test_direction_by_rts_is_refused_where_the_driver_cannot(self):
        self.assert_failed(windows("read", self.at_com() + "&rs485=on"), "cannot switch the direction of RS-485 by RTS")
        self.assert_failed(windows("read", self.at_com() + "&rs485=rts"), "has no RTS line to switch the direction")

    def test_ports_lists_what_windows_lists(self):
        subprocess.run([WINE, "reg", "add", r"HKLM\HARDWARE\DEVICEMAP\SERIALCOMM", "/v", r"\Device\Absenc0", "/d",
                        "COM77", "/f"], env=prefix.environment, check=True, capture_output=True, timeout=PATIENCE)
        listed = {port["port"]: port for port in json_lines(windows("ports", "--json").stdout)}
        self.assertEqual(listed["COM77"]["kind"], "serial")
        self.assertIn("next: absenc identify COM77", windows("ports").stdout)

    def test_unplugged_and_back(self):
        emulator = Emulator(self.directory, "--singleturn", "65536")
        number = next(numbers)
        prefix.link_port(number, emulator.path)
        process = self.begin("read", f"tformat:COM{number}?latency=300", "--json", "--count", "0", "--rate", "20")

        def wait_for(wanted):
            deadline = time.monotonic() + PATIENCE
            while (text := read_line(process.stdout, deadline)) is not None:
                if wanted(json.loads(text)):
                    return
            self.fail(f"in vain waited for it: {end(process)}")

        wait_for(lambda line: line["ok"])
        prefix.link_port(number, None)
        emulator.kill()
        wait_for(lambda line: not line["ok"])
        with Emulator(self.directory, "--singleturn", "32768", name="again") as again:
            prefix.link_port(number, again.path)
            wait_for(lambda line: line["ok"] and line["singleturn"] == 32768)
            status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        self.assertIn("the port went away: 1", messages)

    def test_slcan_adapter_at_a_com_port(self):
        can = next(unit["protocol"] for unit in json_lines(absenc("list", "--json").stdout) if unit["link"] == "can")
        emulator = Emulator(self.directory, protocol=can)
        self.addCleanup(emulator.end)
        result = windows("read", f"{can}:slcan:{self.com(emulator.path)}?latency=300", "--json")
        self.assert_good(result)
        self.assertTrue(json.loads(result.stdout)["ok"])


class Tcp(WindowsCase):
    def tcp(self, *arguments):
        emulator = self.emulator("--tcp", "0", *arguments)
        return emulator, emulator.line().removeprefix("ready: ").strip()

    def test_reads(self):
        _, place = self.tcp("--singleturn", "65536")
        lines = json_lines(windows("read", f"tformat:{place}", "--json", "--count", "20", "--rate", "0").stdout)
        self.assertEqual({(line["ok"], line["singleturn"]) for line in lines}, {(True, 65536)})

    def test_nothing_listens_and_unknown_host(self):
        emulator, place = self.tcp()
        emulator.end()
        self.assert_failed(windows("read", f"tformat:{place}"), "nothing listens on 127.0.0.1 port")
        self.assert_failed(windows("read", "tformat:tcp:no-such-host.invalid:4001"), "no-such-host.invalid is not known")

    def test_other_end_closes(self):
        emulator, place = self.tcp()
        process = self.begin("read", f"tformat:{place}", "--json", "--count", "0", "--rate", "20")
        self.assertTrue(json.loads(read_line(process.stdout, time.monotonic() + PATIENCE))["ok"])
        emulator.end()
        deadline = time.monotonic() + PATIENCE
        while (text := read_line(process.stdout, deadline)) is not None and json.loads(text)["ok"]:
            pass
        self.assertIsNotNone(text)
        status, _, messages = end(process, signal.SIGINT)
        self.assertIn("the port went away: 1", messages, status)


class Emulates(WindowsCase):
    def test_for_tcp_clients(self):
        process = self.begin("emulate", "tformat", "--tcp", "0", "--singleturn", "65536", stdin=subprocess.PIPE)
        place = read_line(process.stdout, time.monotonic() + PATIENCE)
        match = re.search(r"tcp:127\.0\.0\.1:\d+", place)
        self.assertIsNotNone(match, place)
        for _ in range(2):
            result = absenc("read", f"tformat:{match[0]}", "--json", "--count", "20", "--rate", "0")
            self.assert_good(result)
            self.assertEqual({line["singleturn"] for line in json_lines(result.stdout)}, {65536})
        process.stdin.write(b"alarm over_heat\n")
        self.assertIn("ok: raised over_heat", read_line(process.stdout, time.monotonic() + PATIENCE))
        self.assertEqual(json.loads(absenc("read", f"tformat:{match[0]}", "--json").stdout)["alarms"], ["over_heat"])
        status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        self.assertIn("requests answered", messages)

    def test_tcp_port_in_use(self):
        emulator = self.emulator("--tcp", "0")
        port = emulator.line().rsplit(":", 1)[1].strip()
        self.assert_failed(windows("emulate", "tformat", "--tcp", port), f"TCP port {port} is in use")

    def test_at_a_com_port(self):
        with Cable() as cable:
            process = self.begin("emulate", "tformat", "--port", self.com(cable.paths[0]), "--singleturn", "65536")
            self.assertIn("ready: COM", read_line(process.stdout, time.monotonic() + PATIENCE))
            result = absenc("read", f"tformat:{cable.paths[1]}?latency=300", "--json", "--count", "20", "--rate", "0")
            self.assert_good(result)
            self.assertEqual({line["singleturn"] for line in json_lines(result.stdout)}, {65536})
            status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)

    def test_memory_file_with_umlauts_is_owned(self):
        path = self.dos("Gedächtnis eins.txt")
        process = self.begin("emulate", "tformat", "--tcp", "0", "--memory", path)
        place = re.search(r"tcp:[\d.:]+", read_line(process.stdout, time.monotonic() + PATIENCE))[0]
        self.assert_failed(windows("emulate", "tformat", "--tcp", "0", "--memory", path, "--for", "1"),
                           "another emulator keeps its memory in")
        self.assert_good(absenc("memory", "write", f"tformat:{place}", "0x10", "0x42", "--page", "2", "--yes"))
        self.assertEqual(end(process, signal.SIGINT)[0], 0)
        with open(self.file("Gedächtnis eins.txt"), encoding="utf-8") as file:
            self.assertIn(" 42 ", file.read())


class Commands(WindowsCase):
    def test_interrupt_ends_reading_with_its_summary(self):
        process = self.begin("read", self.at_com(), "--count", "0", "--rate", "20")
        self.assertIsNotNone(read_line(process.stdout, time.monotonic() + PATIENCE))
        status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        self.assertIn("good readings and 0 failed ones", messages)

    def test_config_memory_and_journal(self):
        address = self.at_com()
        self.assert_good(windows("config", "set", address, "overheat-threshold", "80", "--yes"))
        self.assertIn("80 degC", windows("config", "get", address).stdout)
        environment = {name: value for name, value in prefix.environment.items() if name != "ABSENC_CHANGES"}
        self.assert_good(windows("memory", "write", address, "0x10", "0x42", "--page", "2", "--yes", env=environment))
        self.assertIn("42 00", windows("memory", "read", address, "0x10", "--count", "2", "--page", "2").stdout)
        journal = os.path.join(prefix.user_folder("Local"), "absenc", "changes.tsv")
        with open(journal, encoding="utf-8") as file:
            self.assertIn("memory-write", file.read().replace("memory write", "memory-write"))
        self.assertIn("memory", windows("changes", address, env=environment).stdout)
        self.assert_wrong_usage(windows("zero", address), "nobody is there to be asked", "--yes")

    def test_dump_and_load_a_file_with_umlauts_and_spaces(self):
        address = self.at_com()
        name = "Meßwerte Übung.txt"
        self.assert_good(windows("memory", "dump", address, "--output", self.dos(name)))
        self.assertTrue(os.path.exists(self.file(name)))
        self.assert_good(windows("memory", "verify", address, self.dos(name)))

    def test_records_into_files_with_umlauts_and_spaces(self):
        address = self.at_com("--motion", "rpm=60")
        for ending in ("csv", "jsonl"):
            name = f"Aufnahme für Jürgen.{ending}"
            self.assert_good(windows("record", address, "--output", self.dos(name), "--count", "20", "--rate", "50"))
            with open(self.file(name), encoding="utf-8", newline="") as file:
                text = file.read()
            self.assertNotIn("\r", text)
            self.assertGreaterEqual(len(text.splitlines()), 20)
            again = windows("record", address, "--output", self.dos(name), "--count", "1")
            self.assert_failed(again, "there is already a file", "für Jürgen")

    def test_names_in_the_settings_file_of_the_user(self):
        folder = os.path.join(prefix.user_folder("Roaming"), "absenc")
        os.makedirs(folder, exist_ok=True)
        path = os.path.join(folder, "absenc.toml")
        self.addCleanup(os.remove, path)
        address = self.at_com("--singleturn", "65536")
        port = re.search(r"COM\d+", address)[0]
        with open(path, "w", encoding="utf-8") as file:
            file.write(f'[encoder.elbow]\nprotocol = "tformat"\nport = "{port}"\nlatency = 300\n')
        environment = {name: value for name, value in prefix.environment.items() if name != "ABSENC_CONFIG"}
        result = windows("read", "elbow", "--json", env=environment, cwd=self.directory)
        self.assert_good(result)
        self.assertEqual(json.loads(result.stdout)["singleturn"], 65536)

    def test_scan_finds_all_on_a_line(self):
        address = self.at_com("--also", "address=3", "--also", "address=5", protocol="esl", latency=100) + "&baud=2500000"
        result = windows("scan", address, "--json")
        self.assert_good(result)
        found = [one["encoder_address"] for one in json.loads(result.stdout)["encoders"]]
        self.assertEqual(found, [0, 3, 5])

    def test_identify_finds_the_protocol(self):
        place = self.at_com(latency=100).removeprefix("tformat:")
        result = windows("identify", place, "--json", timeout=3 * PATIENCE)
        self.assert_good(result)
        self.assertIn("tformat:COM", result.stdout)

    def test_doctor_calls_it_good(self):
        result = windows("doctor", self.at_com(latency=100))
        self.assert_good(result)
        self.assertTrue(result.stdout.startswith("good: "), result.stdout)
        silent = windows("doctor", self.at_com("--fault", "silence=1", latency=20))
        self.assertEqual(silent.returncode, 1)
        self.assertIn("no_answer", silent.stdout)


class SerialUnits(WindowsCase):
    """Every unit with a serial line, at a COM port where wine can carry its line there, and over TCP."""

    # A pseudo-terminal has no parity, and no UART has characters of 16 bits.
    REFUSALS = "no parity|even parity|odd parity|16-bit characters"

    def rate(self, unit):
        """Returns the setting of the rate at a COM port: some units have none of their own, and wine has none above
        4 Mbit/s."""
        rate = unit["line"]["rate"]
        return "&baud=9600" if rate is None else "&baud=2500000" if rate > 4_000_000 else ""

    def emulated(self, name, unit):
        """Starts Linux's emulator of a unit and returns its addresses for absenc.exe, at a COM port (None if wine cannot
        carry its line there) and over TCP."""
        emulator = Emulator(self.directory, "--tcp", "0", protocol=name, name=name)
        self.addCleanup(emulator.end)
        tcp = f"{name}:{emulator.line().removeprefix('ready: ').strip()}?latency=100"
        com = f"{name}:{self.com(emulator.path)}?latency=100{self.rate(unit)}"
        refused = windows("read", com)
        if refused.returncode == 0:
            return com, tcp
        self.assertRegex(refused.stderr, self.REFUSALS)
        return None, tcp

    def test_absenc_exe_reads_the_encoders_of_linux(self):
        at_com = []
        for name, unit in character_units().items():
            with self.subTest(name):
                com, tcp = self.emulated(name, unit)
                for address in filter(None, (com, tcp)):
                    readings = json_lines(windows("read", address, "--json", "--count", "3").stdout)
                    self.assertEqual([reading["ok"] for reading in readings], [True] * 3, readings)
                at_com += [name] * (com is not None)
        self.assertGreater(len(at_com), 5)

    def assert_conforms(self, result):
        self.assertEqual(result.returncode, 0, f"{result.stdout}\n{result.stderr}")
        self.assertIn("kept: ", result.stdout)

    def test_encoders_of_linux_keep_the_clauses_for_absenc_exe(self):
        for name, unit in character_units().items():
            with self.subTest(name):
                com, tcp = self.emulated(name, unit)
                self.assert_conforms(windows("conform", com or tcp, "--readings", "3", timeout=3 * PATIENCE))

    def test_encoders_of_absenc_exe_keep_the_clauses_for_linux(self):
        for name, unit in character_units().items():
            with self.subTest(name):
                encoder = self.begin("emulate", name, "--tcp", "0")
                place = re.search(r"tcp:[\d.:]+", read_line(encoder.stdout, time.monotonic() + PATIENCE))[0]
                self.assert_conforms(absenc("conform", f"{name}:{place}?latency=100", "--readings", "3",
                                            timeout=3 * PATIENCE))
                self.assertEqual(end(encoder, signal.SIGINT)[0], 0)

    def verdicts(self, address):
        result = absenc("conform", address, "--readings", "3", "--json", timeout=3 * PATIENCE)
        return {one["id"]: one["verdict"] for one in json.loads(result.stdout)["clauses"]}

    def test_encoders_of_absenc_exe_are_judged_as_those_of_linux_at_a_com_port(self):
        """The cable carries no rate, so a clause about a request at a wrong rate is broken with both."""
        at_com = []
        for name, unit in character_units().items():
            rate = self.rate(unit)
            with self.subTest(name), Cable() as cable:
                encoder = self.begin("emulate", name, "--port", f"{self.com(cable.paths[0])}?{rate[1:]}".rstrip("?"))
                if read_line(encoder.stdout, time.monotonic() + PATIENCE) is None:
                    self.assertRegex(end(encoder)[2], self.REFUSALS)
                    continue
                there = self.verdicts(f"{name}:{cable.paths[1]}?latency=100{rate}")
                self.assertEqual(end(encoder, signal.SIGINT)[0], 0)
                folder, port = os.path.split(cable.paths[0])
                with Emulator(folder, protocol=name, line="--port", name=f"{port}?latency=100{rate}"):
                    here = self.verdicts(f"{name}:{cable.paths[1]}?latency=100{rate}")
                self.assertEqual(there, here)
                self.assertIn("kept", there.values())
                at_com.append(name)
        self.assertGreater(len(at_com), 5)

    def test_hosts_keep_the_clauses(self):
        """The host of Linux at the judge of absenc.exe, and the other way round."""
        seen = 0
        for name in character_units():
            for judged, judge in ((absenc, self.begin), (windows, self.start)):
                with self.subTest(f"{name}, judged by {judge.__name__}"):
                    process = judge("conform-host", name, "--tcp", "0", "--answers", "3", "--patience", "1", "--json")
                    place = None
                    while place is None:
                        line = read_line(process.stderr, time.monotonic() + PATIENCE)
                        self.assertIsNotNone(line)
                        place = re.search(r"tcp:[\d.:]+", line)
                        if "is asked nothing" in line:
                            break
                    if place is None:
                        process.communicate(timeout=PATIENCE)
                        self.assertEqual(process.returncode, 2)
                        continue
                    judged("read", f"{name}:{place[0]}?latency=100", "--count", "30", "--rate", "0")
                    out, messages = process.communicate(timeout=PATIENCE)
                    verdicts = {one["id"]: one["verdict"] for one in json.loads(out)["clauses"]}
                    self.assertEqual((process.returncode, verdicts["asks"]), (0, "kept"), f"{verdicts}\n{messages}")
                    seen += 1
        self.assertGreater(seen, 10)

    def test_encoder_and_port_follow_a_new_rate(self):
        """Of every unit with such a setting: after it the encoder answers at the new rate only."""
        changed = 0
        for name, unit in character_units().items():
            option = next((one for one in unit["options"] if one.get("role") == "rate"), None)
            commands = {command["name"] for command in unit["commands"]}
            if option is None or f"set-{option['name']}" not in commands:
                continue
            with self.subTest(name):
                com, _ = self.emulated(name, unit)
                if com is None:
                    continue
                new = next(value for value in reversed(option["choices"]) if value != option["default"])
                self.assert_good(windows("config", "set", com, option["name"], new, "--yes"))
                old = windows("read", com)
                self.assertEqual(old.returncode, 1, old.stdout)
                self.assert_good(windows("read", f"{com}&{option['name']}={new}"))
                changed += 1
        self.assertGreater(changed, 0)


class Recordings(WindowsCase):
    def test_full_disk(self):
        """Uses a file system of 1 MB in a namespace of its own, and a wine prefix in there, because wine's server opens
        all files."""
        folder, messages = self.file("disk"), self.file("messages")
        os.mkdir(folder)
        shell = ["unshare", "--mount"] if os.geteuid() == 0 else ["unshare", "--user", "--map-root-user", "--mount"]
        support = os.path.join(os.path.dirname(os.path.abspath(__file__)), "wine_support.py")
        for ending in ("csv", "jsonl"):
            with self.subTest(ending):
                copy = self.file(f"copy.{ending}")
                script = ('mount -t tmpfs -o size=1m absenc-test "$1" && "$2" -B "$3" "$4" "$5" record sim:tformat '
                          '--rate 0 --output "Z:$1/log.$8" 2>"$6"; echo "status $?"; cp "$1/log.$8" "$7"')
                result = subprocess.run([*shell, "sh", "-c", script, "sh", folder, sys.executable, support, WINE, EXE,
                                         messages, copy, ending], stdin=subprocess.DEVNULL, capture_output=True,
                                        text=True, timeout=5 * PATIENCE, check=False)
                self.assertEqual((result.returncode, result.stdout), (0, "status 1\n"), result.stderr)
                with open(messages, encoding="utf-8") as file:
                    text = file.read()
                self.assert_sentence(text, "No space left on device", "what is written so far is whole")
                with open(copy, encoding="utf-8") as file:
                    written = file.read()
                self.assertTrue(written.endswith("\n"))
                self.assertGreater(len(written), 2**20 - 3 * 4096)
                readings = int(re.search(r"(\d+) readings", text)[1])
                rows = [line for line in written.splitlines() if line[0] in ("{" if ending == "jsonl" else "0123456789")]
                self.assertGreaterEqual(len(rows), readings)  # a gap has a row, too

    def test_unplugged_and_back(self):
        number = next(numbers)
        path = self.file("log.csv")

        def wait_for(event):
            deadline = time.monotonic() + PATIENCE
            while True:
                with contextlib.suppress(FileNotFoundError), open(path, encoding="utf-8") as file:
                    rows = [line.split(",") for line in file.read().splitlines() if line[:1].isdigit()]
                    if any(event(row) for row in rows):
                        return
                if time.monotonic() > deadline:
                    self.fail(f"in vain waited for it: {end(process)}")

        first = Emulator(self.directory, "--singleturn", "1000")
        prefix.link_port(number, first.path)
        self.addCleanup(prefix.link_port, number, None)
        process = self.begin("record", f"tformat:COM{number}?latency=300", "--output", self.dos("log.csv"), "--rate", "50")
        wait_for(lambda row: row[2] == "1000")
        prefix.link_port(number, None)
        first.kill()
        first.process.communicate()
        wait_for(lambda row: row[-1] == "lost")
        with Emulator(self.directory, "--singleturn", "2000", name="again") as again:
            prefix.link_port(number, again.path)
            wait_for(lambda row: row[2] == "2000")
            status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        self.assertIn("went away", messages)
        self.assertIn("the port is back after", messages)


class Library(WindowsCase):
    """The archive with the C++ library, in a project that finds it with find_package."""

    PROJECT = """
cmake_minimum_required(VERSION 3.25)
project(outside LANGUAGES CXX)
find_package(absenc {version} REQUIRED)
add_executable(outside outside.cpp)
target_link_libraries(outside PRIVATE absenc::configuration absenc::captures absenc::recording)
target_link_options(outside PRIVATE -static)
"""
    # Reads the first argument, records an encoder that absenc.toml names, and decodes a capture.
    PROGRAM = r"""
#include <cstdio>
#include <exception>

#include "absenc/client/configuration.hpp"
#include "absenc/client/decode.hpp"
#include "absenc/client/encoder.hpp"
#include "absenc/client/recording.hpp"

using namespace absenc;

int main(int, char** arguments) try {
  client::Encoder encoder = client::open(arguments[1]);
  std::printf("%u\n", static_cast<unsigned>(encoder.read().singleturn));
  client::Encoder elbow = client::open("elbow");
  client::Recording recording({.path = arguments[2], .encoder = "elbow", .count = 3}, elbow);
  std::printf("%d\n", recording.run());
  for (const client::Row& row : client::decode(arguments[3], "tformat")) {
    std::printf("%s\n", client::to_text(row.values[0]).c_str());
    break;
  }
} catch (const std::exception& failure) {
  std::fprintf(stderr, "%s\n", failure.what());
  return 1;
}
"""

    def test_program_finds_the_library_and_reads(self):
        root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
        with open(os.path.join(root, "VERSION"), encoding="utf-8") as file:
            version = file.read().strip()
        name = f"absenc-{version}-windows-x64-dev"
        with zipfile.ZipFile(os.path.join(os.path.dirname(os.path.dirname(EXE)), f"{name}.zip")) as archive:
            archive.extractall(self.directory)
        self.file("CMakeLists.txt", self.PROJECT.format(version=version))
        self.file("outside.cpp", self.PROGRAM)
        run_tool("cmake", "-G", "Ninja", "-S", self.directory, "-B", self.file("build"),
                 "-DCMAKE_TOOLCHAIN_FILE=" + os.path.join(root, "cmake/x86_64-w64-mingw32.cmake"),
                 "-Dabsenc_DIR=" + self.file(f"{name}/lib/cmake/absenc"))
        run_tool("cmake", "--build", self.file("build"))
        com = self.at_com("--singleturn", "65536")
        port = re.search(r"COM\d+", com)[0]
        self.file("absenc.toml", f'[encoder.elbow]\nprotocol = "tformat"\nport = "{port}"\nlatency = 300\n')
        self.file("wave.vcd", conversation(3).vcd())
        environment = {name: value for name, value in prefix.environment.items() if name != "ABSENC_CONFIG"}
        for address, position in (("sim:tformat?singleturn=1234", 1234), (com, 65536)):
            result = subprocess.run([WINE, self.file("build/outside.exe"), address, self.dos(f"{position}.csv"),
                                     self.dos("wave.vcd")], stdin=subprocess.DEVNULL, capture_output=True, text=True,
                                    env=environment, cwd=self.directory, timeout=PATIENCE, check=False)
            self.assert_good(result)
            self.assertEqual(result.stdout.splitlines()[:2], [str(position), "1"])
            self.assertEqual(len(result.stdout.splitlines()), 3)
            with open(self.file(f"{position}.csv"), encoding="utf-8") as file:
                self.assertIn(",65536,", file.read())


class Captures(WindowsCase):
    def test_decodes_each_format_as_on_linux(self):
        for file, arguments in write_each_format(Path(self.directory)):
            protocol, *more = arguments
            with self.subTest(file.name):
                there = windows("decode", protocol, f"Z:{file}", *more, "--json")
                here = absenc("decode", protocol, str(file), *more, "--json")
                self.assertEqual(there.stdout, here.stdout, there.stderr)
                self.assertEqual(there.returncode, here.returncode)
                self.assertGreater(len([line for line in json_lines(here.stdout) if line.get("fields")]), 0, here.stderr)

    def test_draws_the_same_waveform(self):
        for ending in ("vcd", "csv", "sr"):
            self.assert_good(windows("wave", "sim:tformat", self.dos(f"dort ü.{ending}")))
            self.assert_good(absenc("wave", "sim:tformat", self.file(f"hier.{ending}")))
            with open(self.file(f"dort ü.{ending}"), "rb") as there, open(self.file(f"hier.{ending}"), "rb") as here:
                self.assertEqual(there.read(), here.read())

    def test_report_of_doctor_is_read_there_and_here(self):
        name = "Bericht für Jürgen.zip"
        self.assert_good(windows("doctor", "sim:tformat", "--report", self.dos(name)))
        there = windows("decode", self.dos(name))
        self.assert_good(there)
        self.assertIn("good: ", there.stdout)
        self.assertEqual(there.stdout, absenc("decode", self.file(name)).stdout)

    def test_standard_input(self):
        there = subprocess.run([WINE, EXE, "decode", "tformat", "-", "--json"], input=FRAMES.encode(),
                               capture_output=True, env=prefix.environment, timeout=PATIENCE, check=False)
        self.assertEqual(there.stdout.decode(), absenc("decode", "tformat", self.file("frames.txt", FRAMES), "--json").stdout)
        self.assertIn(str(0x12345), there.stdout.decode())


class Hdf5(WindowsCase):
    def read(self, name):
        """Returns the rows of a recording, times and positions, after a check that they fit a shaft of 60 rpm."""
        with h5py.File(self.file(name), "r") as file:
            good = file["event"][:] == b""
            times, places = file["time_s"][:][good], file["position"][:][good]
        self.assertEqual(len(times), len(places))
        for at, place in zip(times, places):
            self.assertAlmostEqual(place / 2**17 - at, places[0] / 2**17 - times[0], delta=0.3)
        return times

    def test_recording_is_read_by_another_program(self):
        name = "Aufnahme für Jürgen.h5"
        address = self.at_com("--motion", "rpm=60")
        self.assert_good(windows("record", address, "--output", self.dos(name), "--count", "70", "--rate", "50"))
        self.assertEqual(len(self.read(name)), 70)
        with h5py.File(self.file(name), "r") as file:
            self.assertEqual(file.attrs["protocol"], b"tformat")
            self.assertEqual(file["angle_deg"].attrs["unit"], b"deg")
        self.assert_failed(windows("record", address, "--output", self.dos(name), "--count", "1"),
                           "there is already a file", "für Jürgen")

    def test_recording_is_whole_after_a_kill(self):
        process = self.begin("record", "sim:tformat?motion=rpm=60", "--output", self.dos("log.h5"), "--rate", "200",
                             "--count", "0")

        def rows():
            try:
                return len(self.read("log.h5"))
            except (OSError, KeyError, IndexError):  # the file is not there yet, or is changed meanwhile
                return 0

        wait_until(lambda: rows() > 300, "rows are written")
        before = rows()
        end(process, signal.SIGKILL)
        self.assertGreaterEqual(len(self.read("log.h5")), before)


SHAFT = "sim:tformat?motion=rpm=60"


class Console(WindowsCase):
    """A console of wine, which shows its content on a terminal of tmux."""

    def terminal(self, address):
        environment = shlex.join(f"{name}={prefix.environment[name]}" for name in
                                 ("WINEPREFIX", "WINEDEBUG", "WINEDLLOVERRIDES"))
        return Terminal(self, address, columns=100, rows=30, environment=environment, program=[WINE, EXE])

    def test_screen_of_monitor(self):
        terminal = self.terminal(self.at_com("--motion", "rpm=60", "--alarm", "over_heat"))
        first = terminal.wait_for(r"^> tformat:COM\d+\S* +live +\d+\.\d+ (.|\n)*alarms: over_heat")
        self.assertIn(" q quit  p pause  z zero", first)
        position = re.search(r"live +(\d+\.\d+)", first)[1]
        terminal.wait_for(rf"live +(?!{re.escape(position)})\d+\.\d+ ")
        terminal.press("h")
        terminal.wait_for("the last bad exchanges, byte by byte")
        terminal.press("h", "p")
        terminal.wait_for("paused")
        terminal.press("q")
        self.assertEqual(terminal.exit_status(), 0)

    def test_monitor_prints_lines_without_a_console(self):
        lines = windows("monitor", "sim:tformat", "--for", "1.5")
        self.assert_good(lines)
        self.assertIn("sim:tformat:   0.000 deg", lines.stdout)

    def test_interrupt_ends_a_command(self):
        terminal = self.terminal(SHAFT)
        terminal.wait_for("live")
        terminal.press("C-c")
        self.assertEqual(terminal.exit_status(), 0)


class Serves(WindowsCase):
    def server(self, *arguments):
        server = Server(*arguments, within=[WINE], program=EXE, **prefix.environment)
        self.addCleanup(self.finish, server.process)
        return server

    @staticmethod
    def finish(process):
        if process.poll() is None:
            end(process)
        for stream in (process.stdout, process.stderr):
            stream.close()

    @staticmethod
    def seconds(server):
        """Returns the times of all seconds in the history of the encoder; none while a damaged one is replaced."""
        now = int(time.time())
        status, text = server.ask(of(SHAFT, "history"), **{"from": now - 600, "to": now, "rows": 1000})
        return [row[0] for row in json.loads(text)["rows"]] if status == 200 else []

    def test_api_events_and_ctrl_c(self):
        server = self.server(SHAFT, "--history", "none")
        self.assertEqual(server.url, f"http://127.0.0.1:{server.port}/")
        wait_until(lambda: server.encoder()["state"] == "live", "the encoder is live")
        stream = Stream(server, SHAFT)
        self.addCleanup(stream.close)
        places = [stream.next() for _ in range(5)]
        self.assertEqual(len(places), 5)
        self.assertIn("absenc_readings_total", server.ask("/metrics")[1])
        status, _, messages = end(server.process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        self.assertIn("Ctrl-C ends\n", messages)

    def test_reads_encoders_at_com_ports(self):
        address = self.at_com("--singleturn", "65536")
        server = self.server(address, "--history", "none")
        wait_until(lambda: server.encoder()["state"] == "live", "the encoder is live")
        busy = self.server(SHAFT, "--history", "none")
        taken = windows("serve", SHAFT, "--history", "none", "--listen", f"127.0.0.1:{busy.port}")
        self.assert_failed(taken, "is in use by another program")

    def test_page_in_a_browser(self):
        from page_scenes import Browser  # is here, because only this test needs selenium
        server = self.server(SHAFT, self.at_com("--singleturn", "65536"), "--history", self.dos("Seite ü.sqlite"))
        browser = Browser()
        self.addCleanup(browser.driver.quit)
        browser.go(server.url)
        wait_until(lambda: "tformat" in browser.ask("return document.body.innerText"), "the page names the encoders")
        shown = "return [...document.querySelectorAll('.card')].map((card) => card.innerText)"
        first = wait_until(lambda: len(browser.ask(shown)) == 2 and browser.ask(shown), "the page has both encoders")
        wait_until(lambda: browser.ask(shown)[0] != first[0], "the angle of the shaft changes on the page")
        wait_until(lambda: "180.0" in browser.ask(shown)[1], "the page shows the encoder at the COM port")
        problems = [line for line in browser.driver.get_log("browser") if line["level"] == "SEVERE"]
        self.assertEqual(problems, [])

    def test_history_is_whole_after_a_kill(self):
        path = self.file("Verlauf für Jürgen.sqlite")
        arguments = [SHAFT, "--history", self.dos(os.path.basename(path))]
        server = self.server(*arguments)
        before = wait_until(lambda: len(rows := self.seconds(server)) >= 4 and rows, "four seconds are written")
        self.assertEqual(before, list(range(before[0], before[-1] + 1)))
        second = windows("serve", *arguments, "--listen", "127.0.0.1:0")
        self.assert_failed(second, "another server keeps its history in")
        server.process.kill()
        server.process.wait()
        again = self.server(*arguments)
        after = wait_until(lambda: (rows := self.seconds(again))[-1:] > before[-1:] and rows, "the history goes on")
        self.assertEqual(after[:len(before)], before)
        self.assertEqual(end(again.process, signal.SIGINT)[0], 0)
        with sqlite3.connect(path) as database:
            self.assertEqual(database.execute("PRAGMA integrity_check").fetchone(), ("ok",))
            written = [at for at, in database.execute("SELECT at FROM second ORDER BY at")]
        self.assertEqual(written[:len(before)], before)

    def test_damaged_history_is_set_aside(self):
        path = self.file("history.sqlite")
        server = self.server(SHAFT, "--history", self.dos("history.sqlite"))
        wait_until(lambda: self.seconds(server), "a second is written")
        with open(path, "r+b") as file:
            file.write(b"no database" * 1000)
        wait_until(lambda: any(".damaged-" in name for name in os.listdir(self.directory)), "the file is renamed")
        wait_until(lambda: self.seconds(server), "a new history begins")
        wait_until(lambda: "a new one begins" in json.dumps(server.json("/api/events")), "the new history says so")

    def test_usual_history_is_in_the_local_folder_of_the_user(self):
        environment = {name: value for name, value in prefix.environment.items()
                       if name not in ("STATE_DIRECTORY", "XDG_STATE_HOME")}
        server = Server(SHAFT, within=[WINE], program=EXE, **environment)
        self.addCleanup(end, server.process)
        wait_until(lambda: self.seconds(server), "a second is written")
        self.assertTrue(os.path.exists(os.path.join(prefix.user_folder("Local"), "absenc", "history.sqlite")))

    def test_tokens_that_others_may_read_are_refused(self):
        path = self.file("Schlüssel.txt", f"anna {TOKEN}\n")
        address = self.at_com()
        arguments = [address, "--history", "none", "--token-file", self.dos("Schlüssel.txt")]
        os.chmod(path, 0o644)
        self.assert_failed(windows("serve", *arguments, "--listen", "127.0.0.1:0"), "others may read", "icacls")
        os.chmod(path, 0o600)
        server = self.server(*arguments)
        wait_until(lambda: server.encoder()["state"] == "live", "the encoder is live")
        self.assertEqual(server.command(address, "clear-alarms", {})[0], 401)
        status, answer = server.command(address, "clear-alarms", {"Authorization": f"Bearer {TOKEN}"})
        self.assertEqual(status, 200, answer)

    @staticmethod
    def mqtt_processes():
        """Returns the process numbers of the MQTT clients that servers in this prefix have started."""
        found = []
        for number in filter(str.isdigit, os.listdir("/proc")):
            with contextlib.suppress(OSError):  # the process has ended, or belongs to others
                with open(f"/proc/{number}/cmdline", "rb") as words, open(f"/proc/{number}/environ", "rb") as values:
                    if b"serve-mqtt-client" in words.read() and prefix.folder.encode() in values.read():
                        found.append(int(number))
        return found

    def test_mqtt_client_that_dies_is_started_again_and_ends_with_the_server(self):
        broker = Broker(self.directory)
        self.addCleanup(broker.end)
        server = self.sender(broker.url)
        mqtt = lambda: server.json("/api/mqtt")
        wait_until(lambda: mqtt()["connected"], "the broker is connected")
        [client] = self.mqtt_processes()
        os.kill(client, signal.SIGKILL)
        wait_until(lambda: mqtt()["client_deaths"] == 1 and mqtt()["connected"], "another client is connected")
        self.assertEqual(len(self.mqtt_processes()), 1)
        server.process.kill()
        server.process.wait()
        wait_until(lambda: not self.mqtt_processes(), "the client has ended")

    def test_udp(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver:
            receiver.bind(("127.0.0.1", 0))
            receiver.settimeout(PATIENCE)
            self.server(SHAFT, "--history", "none", "--udp", f"127.0.0.1:{receiver.getsockname()[1]}")
            sent = [json.loads(receiver.recv(4096)) for _ in range(10)]
        self.assertTrue(all(SHAFT in one and one["timestamp"] > 1e9 for one in sent), sent)

    def sender(self, url):
        return self.server(SHAFT, "--history", "none", "--rate", "50", "--mqtt", url, "--mqtt-prefix", "plant/hall",
                           "--mqtt-spool", self.dos("Warteschlange ü"))

    @staticmethod
    def taken(server):
        """Returns the number of readings that the server has taken for MQTT."""
        return server.json("/api/mqtt")["taken"].get(SHAFT, 0)

    def test_readings_wait_for_the_broker_and_survive_a_kill(self):
        server = self.sender(f"mqtt://127.0.0.1:{free_port()}")
        wait_until(lambda: self.taken(server) > 100, "readings wait in the spool")
        taken = self.taken(server)
        server.process.kill()
        server.process.wait()
        broker = Broker(self.directory)
        self.addCleanup(broker.end)
        receiver = Receiver(broker.port, client_id="keeps")
        self.addCleanup(receiver.end)
        found = lambda: numbers_of(receiver.all("readings"), SHAFT)
        server = self.sender(broker.url)
        goal = wait_until(lambda: (now := self.taken(server)) > taken and now, "it goes on")
        wait_until(lambda: found()[-1:] >= [goal], "all readings arrive")
        self.assertEqual(found(), list(range(1, len(found()) + 1)))
        broker.kill()
        before = self.taken(server)
        wait_until(lambda: self.taken(server) > before + 100, "two seconds wait in the spool")
        broker.start()
        goal = self.taken(server)
        wait_until(lambda: found()[-1] >= goal, "readings arrive again")
        wait_until(lambda: server.json("/api/mqtt")["waiting"] < 5, "the spool is sent")
        self.assertEqual(server.json("/api/mqtt")["dropped"], 0)
        second = windows("serve", SHAFT, "--history", "none", "--listen", "127.0.0.1:0", "--mqtt", broker.url,
                         "--mqtt-spool", self.dos("Warteschlange ü"))
        self.assert_failed(second, "is locked: another process keeps it")
        self.assertEqual(end(server.process, signal.SIGINT)[0], 0)

    def test_mqtt_over_tls_is_refused_in_words(self):
        result = windows("serve", SHAFT, "--history", "none", "--mqtt", "mqtts://127.0.0.1:1", "--mqtt-spool",
                         self.dos("spool"), "--listen", "127.0.0.1:0")
        self.assert_failed(result, "needs TLS, which is not in this build")


if __name__ == "__main__":
    unittest.main()
