#!/usr/bin/env python3
# Tests the waveforms of virtual encoders that `absenc wave` writes, and compares them with sigrok's decoders.
"""Tests waveforms of virtual encoders, and compares them with sigrok's decoders."""
import json
import os
import resource
import signal
import subprocess
import time
import unittest

from command_support import ABSENC, PATIENCE, Case, absenc, end

UNITS = [json.loads(line) for line in absenc("list", "--json").stdout.splitlines()]
WIRES = {"half_duplex": {"line"}, "full_duplex": {"host", "device"}, "exchange": {"cs", "sck", "mosi", "miso"},
         "clocked": {"clock", "data"}, "clocked_bidirectional": {"clock", "data", "direction"}, "can": {"can"}}
# Message of `decode` for the last part of an EncoLink frame that is spread over several exchanges.
IN_PARTS = "each of the last exchanges carried a part of it"


class Wave(Case):
    def wave(self, *arguments):
        result = absenc("wave", *arguments)
        self.assert_good(result)
        return result.stdout

    @staticmethod
    def sigrok(*arguments):
        result = subprocess.run(["sigrok-cli", *arguments], capture_output=True, text=True, timeout=60, check=True)
        return [line.split(": ", 1)[1] for line in result.stdout.splitlines()]

    def test_writes_every_unit_in_every_format(self):
        for unit, link in ((one["protocol"], one["link"]) for one in UNITS):
            for ending in ("vcd", "sr", "csv"):
                with self.subTest(unit=unit, ending=ending):
                    path = self.file(f"{unit}.{ending}")
                    report = self.wave(unit, path, "--count", "5")
                    self.assertIn("5 results", report)
                    self.assertIn("0 of them an error", report)
                    wires = set(report.strip().rsplit("wires: ", 1)[1].split(", "))
                    self.assertLessEqual(WIRES[link], wires)
                    self.assertLessEqual(wires - WIRES[link], {"trigger", "clear"})
                    self.assertGreater(os.path.getsize(path), 100)

    def test_sigrok_decodes_uart(self):
        for ending in ("vcd", "sr"):
            path = self.file(f"tformat.{ending}")
            self.wave("tformat?singleturn=4660", path, "--count", "2")
            input_format = ["-I", "vcd"] if ending == "vcd" else []
            read = self.sigrok(*input_format, "-i", path, "-P", "uart:rx=line:baudrate=2500000", "-A", "uart=rx-data")
            self.assertEqual(read, "1A 1A 00 34 12 00 11 00 00 00 00 2D".split() * 2)

    def decoded(self, unit, path):
        result = absenc("decode", unit, path, "--json")
        self.assert_good(result)
        return [json.loads(line) for line in result.stdout.splitlines()]

    def test_sigrok_decodes_modbus(self):
        path = self.file("modbus.sr")
        self.wave("raa38-modbus?motion=rpm=60", path, "--count", "20")
        read = self.sigrok("-i", path, "-P", "uart:rx=line:baudrate=19200,modbus:scchannel=RX:cschannel=RX", "-A",
                           "modbus=sc-data")
        positions = [one["fields"]["singleturn"] for one in self.decoded("raa38-modbus", path)]
        self.assertEqual(len(set(positions)), 20)
        self.assertEqual(read, [f"0x{position:04X} / {position}" for position in positions])

    def test_sigrok_decodes_spi(self):
        path = self.file("spi.sr")
        self.wave("encolink-spi?motion=rpm=60", path, "--count", "20")
        read = self.sigrok("-i", path, "-P", "spi:clk=sck:miso=miso:mosi=mosi:cs=cs:cpol=0:cpha=1", "-A",
                           "spi=miso-data")
        # Bytes that the host clocks after the end of a reply belong to no reply.
        replies = [one["reply"] for one in self.decoded("encolink-spi", path)]
        self.assertGreater(len(set(replies)), 20)
        self.assertRegex("".join(read).lower(), "^" + "(ff)*".join(replies) + "(ff)*$")

    def test_decode_reads_every_format(self):
        for unit in (one["protocol"] for one in UNITS):
            lines = {}
            for ending in ("vcd", "sr", "csv"):
                path = self.file(f"{unit}.{ending}")
                self.wave(f"{unit}?motion=rpm=60", path, "--count", "20")
                lines[ending] = [{name: one[name] for name in ("request", "reply", "ok", "fields", "angle_deg")
                                  if name in one} for one in self.decoded(unit, path)]
            with self.subTest(unit):
                self.assertGreaterEqual(len(lines["vcd"]), 20)
                self.assertTrue(all(one["ok"] for one in lines["vcd"]))
                self.assertGreaterEqual(len({one.get("angle_deg", one.get("position_um")) for one in lines["vcd"]}), 15)
                self.assertEqual(lines["vcd"], lines["sr"])
                self.assertEqual(lines["vcd"], lines["csv"])

    def test_commands_with_arguments(self):
        path = self.file("memory.vcd")
        self.wave("tformat", path, "--command", "memory-write 5 0x42", "--command", "memory-read 5")
        with open(path, encoding="ascii") as file:
            comments = [line.split(maxsplit=2)[2].removesuffix(" $end\n") for line in file
                        if line.startswith("$comment")]
        self.assertIn("host 32 host 05 host 42 host 75", " ".join(comments))
        self.assertTrue(" ".join(comments).endswith("device EA device 05 device 42 device AD"))

    def test_faults_are_drawn(self):
        report = self.wave("tformat?fault=corrupt=1", self.file("bad.vcd"), "--count", "20")
        self.assertIn("20 of them an error", report)

    def test_output_is_reproducible(self):
        for name in ("a.vcd", "b.vcd"):
            self.wave("esl?motion=rpm=600&fault=drop=0.2", self.file(name), "--count", "30")
        with open(self.file("a.vcd"), "rb") as a, open(self.file("b.vcd"), "rb") as b:
            self.assertEqual(a.read(), b.read())

    def test_decode_finds_every_exchange(self):
        """The waveform's idle times must be long enough for `decode`, even on a slow line."""
        for unit, kind in (("tformat", "exchange"), ("esl", "exchange"), ("encolink", "exchange"),
                           ("encolink-spi", "exchange"), ("biss", "reply"), ("ssi", "reply"), ("e201", "exchange"),
                           ("raa38", "reply"), ("raa38?mode=bus", "exchange"), ("raa38-modbus", "exchange"),
                           ("raa38-modbus?baud=2400", "exchange"), ("raa38-modbus?baud=57600", "exchange"),
                           ("raa38-can", "exchange"), ("raa38-can?bitrate=500000", "exchange"),
                           ("raa38-can?bitrate=1000000", "exchange")):
            protocol, _, options = unit.partition("?")
            for count in (1, 5):
                for ending in ("vcd", "sr", "csv"):
                    path = self.file("all." + ending)
                    self.wave(unit, path, "--count", str(count), "--rate", "50", "--force")
                    result = absenc("decode", protocol, path, "--json", *(["--option", options] if options else []))
                    with self.subTest(unit=unit, count=count, ending=ending):
                        self.assert_good(result)
                        rows = [json.loads(line) for line in result.stdout.splitlines()]
                        rows = [row for row in rows if row.get("message") != IN_PARTS]
                        self.assertEqual({row["kind"] for row in rows} - {kind, "request"}, set())
                        self.assertFalse(any("begins or ends" in row.get("message", "") for row in rows), rows)
                        self.assertGreaterEqual(sum(row["kind"] == kind for row in rows), count)

    def test_spread_frames_are_no_replies(self):
        """The statistics must not count cycles of EncoLink's channel 2 as unsolicited replies."""
        for unit in ("encolink", "encolink-spi"):
            with self.subTest(unit):
                path = self.file(unit + ".vcd")
                self.wave(f"{unit}?motion=rpm=600&alarm=signal_lost", path, "--command", "alarms", "--count", "3")
                rows = self.decoded(unit, path)
                cycles = [row for row in rows if row.get("message") == IN_PARTS]
                self.assertEqual(len(cycles), 3)
                self.assertEqual({tuple(row["alarms"]) for row in cycles}, {("signal_lost",)})
                result = absenc("decode", unit, path, "--stats", "--json")
                self.assert_good(result)
                report = json.loads(result.stdout)
                self.assertEqual((report["replies"], report["in_parts"]), (0, 3))
                self.assertEqual(report["exchanges"], len(rows) - 3)
                self.assertEqual(report["positions"], 0)

    def test_unanswered_requests_are_decoded_at_documented_rate(self):
        for unit, requests in (("e201", {"76", "34"}), ("amt21", {"54"}), ("tformat", {"1a"}), ("esl", {"0875"})):
            with self.subTest(unit):
                path = self.file(unit + "_silent.vcd")
                self.wave(f"{unit}?fault=request_corrupt=1&seed=1", path, "--count", "12")
                result = absenc("decode", unit, path, "--json")
                rows = [json.loads(line) for line in result.stdout.splitlines()]
                self.assertGreater(len(rows), 10)
                self.assertLessEqual({row.get("request") for row in rows}, requests)
                self.assertIn("timeout", {row.get("error") for row in rows})

    def edges(self, *arguments):
        """Returns, for each wire of the waveform, the times of its initial level and of its changes."""
        path = self.file("edges.vcd")
        self.wave(*arguments[:1], path, *arguments[1:], "--force")
        names, times, at = {}, {}, 0
        with open(path, encoding="ascii") as file:
            for line in file:
                words = line.split()
                if words[0] == "$var":
                    names[words[3]] = words[4]
                elif words[0].startswith("#"):
                    at = int(words[0][1:])
                elif words[0][0] in "01":
                    times.setdefault(names[words[0][1:]], []).append(at)
        return times

    def test_line_is_idle_before_first_request(self):
        for unit, wire, least in (("raa38-can", "can", 11 * 4000), ("e201", "host", 10 * 8681),
                                  ("raa38-modbus?baud=2400", "line", 35 * 416667)):
            with self.subTest(unit):
                self.assertGreaterEqual(self.edges(unit)[wire][1], least)

    def test_spi_clock_waits_for_encoder(self):
        times = self.edges("encolink-spi", "--count", "3")
        selected = times["cs"][1::2]
        self.assertGreaterEqual(len(selected), 3)
        for begin, end in zip(selected, times["cs"][2::2]):
            clocks = [at for at in times["sck"] if begin <= at <= end]
            self.assertEqual(clocks[0] - begin, 5000)

    def usage(self, path, *arguments):
        """Returns the peak memory, in KiB, of a run of `absenc wave`."""
        process = subprocess.Popen([ABSENC, "wave", "tformat?motion=rpm=60", path, *arguments],
                                   stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        with process.stderr:
            self.assertEqual(process.returncode, 0, process.stderr.read())
        return usage.ru_maxrss

    def test_memory_does_not_grow_with_length(self):
        for ending, long in (("vcd", 10_000), ("csv", 10_000), ("sr", 3_000)):
            path = self.file("long." + ending)
            short = self.usage(path, "--count", "10")
            with self.subTest(ending):
                self.assertLess(self.usage(path, "--count", str(long), "--force") - short, 4096)

    def test_interrupt_leaves_no_file(self):
        for ending in ("vcd", "csv", "sr"):
            for existing in (None, "precious"):
                with self.subTest(ending=ending, existing=existing):
                    path = self.file("long." + ending, existing)
                    before = os.listdir(self.directory)
                    process = subprocess.Popen([ABSENC, "wave", "esl", path, "--count", "1000000", "--force"],
                                               stdout=subprocess.PIPE, stderr=subprocess.PIPE)
                    self.wait_for_work(process.pid)
                    status, out, err = end(process, signal.SIGINT)
                    self.assertEqual((status, out), (1, ""))
                    self.assertIn("interrupted", err)
                    self.assertEqual(os.listdir(self.directory), before)
                    if existing is not None:
                        with open(path, encoding="ascii") as file:
                            self.assertEqual(file.read(), existing)
                        os.remove(path)

    @staticmethod
    def wait_for_work(process):
        """Waits until the process has written more than 1 MiB, because it catches signals by then."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            with open(f"/proc/{process}/io", encoding="ascii") as file:
                if any(int(line.split()[1]) > 1 << 20 for line in file if line.startswith("wchar")):
                    return
        raise AssertionError("it does not write")

    def test_full_disk_leaves_no_file(self):
        def small_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        for ending in ("vcd", "csv"):
            with self.subTest(ending):
                path = self.file("long." + ending, "precious")
                result = absenc("wave", "tformat", path, "--count", "1000", "--force", preexec_fn=small_files)
                self.assert_failed(result, "too large")
                with open(path, encoding="ascii") as file:
                    self.assertEqual(file.read(), "precious")
                os.remove(path)
                self.assertEqual(os.listdir(self.directory), [])

    def test_force_replaces_only_regular_files(self):
        path = self.file("fifo.vcd")
        os.mkfifo(path)
        self.assert_failed(absenc("wave", "tformat", path, "--force"), path, "no regular file")

    def test_existing_file_is_not_overwritten(self):
        path = self.file("mine.vcd")
        with open(path, "w", encoding="ascii") as file:
            file.write("mine")
        result = absenc("wave", "tformat", path)
        self.assertEqual(result.returncode, 2)
        self.assertIn("--force", result.stderr)
        with open(path, encoding="ascii") as file:
            self.assertEqual(file.read(), "mine")
        self.wave("tformat", path, "--force")

    def test_refuses_wrong_usage(self):
        for arguments, words in [(["tformat", "x.txt"], ".vcd"), (["tformat:/dev/null", "x.vcd"], "no virtual encoder"),
                                 (["tformat", "x.vcd", "--command", "nothing"], "nothing"),
                                 (["tformat", "x.vcd", "--samplerate", "1000"], "for .sr"),
                                 (["tformatt", "x.vcd"], "tformat")]:
            with self.subTest(arguments):
                result = absenc("wave", *arguments)
                self.assertEqual(result.returncode, 2)
                self.assertIn(words, result.stderr)
        result = absenc("wave", "tformat", self.file("missing/x.vcd"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("cannot be written", result.stderr)


if __name__ == "__main__":
    unittest.main()
