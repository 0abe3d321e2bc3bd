# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc` with SocketCAN."""
import contextlib
import json
import os
import re
import signal
import socket
import struct
import subprocess
import threading
import time

from command_support import PATIENCE, Emulator, EncoderCase, absenc, end, json_lines, read_line
from doctor_test import doctor, ids
from record_test import read_csv, rows_so_far, wait_until

BUS = "vcan0"
# The latency allows for a busy machine.
ENCODER = f"raa38-can:{BUS}?latency=2000&max_rpm=60"
HASTY = f"raa38-can:{BUS}"
# A position request to node 0x20, and its reply with position 9799.
ASKING, ANSWER = "220#8020000000000000", "120#4726000000000000"
NODE = 0x120


def run(*command):
    return subprocess.run(command, check=True, capture_output=True, text=True, timeout=PATIENCE).stdout


def frame(identifier, data=b"", size=None):
    return struct.pack("=IB3x8s", identifier, len(data) if size is None else size, data)


def position(counts, identifier=NODE):
    return frame(identifier, counts.to_bytes(8, "little"))


def receivers(interface):
    """Returns the number of sockets that receive every frame of the interface."""
    with open("/proc/net/can/rcvlist_all", encoding="ascii") as file:
        return len(re.findall(rf"^\s*{interface} ", file.read(), re.MULTILINE))


def losses(rows):
    """Returns the events for a lost encoder and its return."""
    return [row["event"] for row in rows if row["event"] in ("lost", "back")]


class AnotherNode(threading.Thread):
    """A fake node 0x20 that answers each position request with the given raw frames."""

    def __init__(self, *answers, interface=BUS):
        super().__init__()
        self.answers = answers
        self.asked = 0
        self.socket = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.socket.bind((interface,))
        self.wake = threading.Event()

    def run(self):
        self.socket.settimeout(0.05)
        while not self.wake.is_set():
            with contextlib.suppress(TimeoutError):
                if self.socket.recv(16)[:10] == frame(0x220, bytes([0x80, 0x20]), 8)[:10]:
                    self.asked += 1
                    for answer in self.answers:
                        self.socket.send(answer)

    def __enter__(self):
        self.start()
        return self

    def __exit__(self, *_):
        self.wake.set()
        self.join()
        self.socket.close()


class VirtualBus(EncoderCase):
    def setUp(self):
        super().setUp()
        self.add(BUS)

    def add(self, interface):
        run("ip", "link", "add", interface, "type", "vcan")
        # The interface may not exist, because a test may delete it.
        self.addCleanup(subprocess.run, ["ip", "link", "del", interface], capture_output=True)
        self.up(interface)

    def up(self, interface=BUS):
        run("ip", "link", "set", interface, "up")

    def down(self, interface=BUS):
        run("ip", "link", "set", interface, "down")

    def emulator(self, *arguments, interface=BUS):
        emulator = Emulator("", "--option", "cyclic=0", *arguments, protocol="raa38-can", name=interface, line="--can")
        self.addCleanup(emulator.end)
        self.assertEqual(emulator.ready, f"ready: {interface}\n")
        return emulator

    def popen(self, *command):
        process = subprocess.Popen(command, bufsize=0, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
        self.addCleanup(end, process)
        return process

    def candump(self, *options, interface=BUS):
        before = receivers(interface)
        process = self.popen("candump", *options, interface)
        wait_until(lambda: receivers(interface) > before, "candump to listen")
        return process

    def line(self, process):
        line = read_line(process.stdout, time.monotonic() + PATIENCE)
        self.assertIsNotNone(line, "candump shows nothing")
        return line.rstrip()

    def run_json(self, *arguments):
        result = absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)

    def singleturn(self, encoder=ENCODER):
        return self.run_json("read", encoder)["singleturn"]

    def assert_no_rule_broken(self, emulator):
        status, _, summary = emulator.end()
        self.assertEqual(status, 0, summary)
        self.assertRegex(summary, r"[1-9]\d* requests answered")
        self.assertNotIn("rules", summary)

    def next_json(self, process, condition):
        """Returns the first line of the process's JSON output for which `condition` is true."""
        deadline = time.monotonic() + PATIENCE
        while True:
            text = read_line(process.stdout, deadline)
            if text is None:
                raise AssertionError(f"it never came: {end(process)}")
            line = json.loads(text)
            if condition(line):
                return line

    def next_message(self, process, words):
        deadline = time.monotonic() + PATIENCE
        while True:
            text = read_line(process.stderr, deadline)
            self.assertIsNotNone(text, f"in vain waited for: {words}")
            if words in text:
                return text


class Verbs(VirtualBus):
    def test_read_and_monitor(self):
        emulator = self.emulator("--singleturn", "9799")
        reading = self.run_json("read", ENCODER)
        self.assertEqual((reading["singleturn"], reading["singleturn_bits"], reading["confirmed"]), (9799, 14, True))
        monitor = self.start("monitor", ENCODER, "--json", "--rate", "20")
        for _ in range(3):
            live = self.next_json(monitor, lambda line: line["state"] == "live")
            self.assertEqual(live["reading"]["singleturn"], 9799, live)
        end(monitor)
        self.assert_no_rule_broken(emulator)

    def test_two_nodes(self):
        self.emulator("--singleturn", "500", "--also", "node=0x21&singleturn=700&cyclic=20")
        self.assertEqual((self.singleturn(), self.singleturn(f"{ENCODER}&node=0x21")), (500, 700))
        self.assertEqual(self.singleturn(f"{ENCODER}&node=0x21&listen=true"), 700)
        nodes = self.run_json("scan", ENCODER, "--yes")["encoders"]
        self.assertEqual([(node["node"], node["singleturn"], node["clash"]) for node in nodes],
                         [(0x20, 500, False), (0x21, 700, False)])
        self.assertEqual(nodes[0]["readings_per_s"], 0)
        self.assertTrue(15 <= nodes[1]["readings_per_s"] <= 21, nodes)
        self.assert_failed(absenc("config", "set", ENCODER, "node", "5", "--yes"), "other nodes are on this bus")

    def test_zero(self):
        emulator = self.emulator("--singleturn", "5000", "--option", "cyclic=50")
        zero = self.run_json("zero", ENCODER, "--yes")["fields"]
        self.assertEqual((zero["before"], zero["after"], zero["written"], zero["answered"]), (5000, 0, True, True))
        # The node sends cyclic frames again, as it did before the command `zero`.
        self.assertEqual(self.singleturn(f"{ENCODER}&listen=true"), 0)
        self.assert_no_rule_broken(emulator)

    def test_record_follows_shaft(self):
        emulator = self.emulator("--motion", "rpm=30")
        log = self.file("log.csv")
        self.assert_good(absenc("record", ENCODER, "--output", log, "--count", "40", "--rate", "40"))
        self.assert_follows_shaft(read_csv(log)[1])
        self.assert_no_rule_broken(emulator)

    def test_record_follows_shaft_while_clock_is_set(self):
        """The kernel stamps frames with the calendar clock, which this test sets an hour forward and back again."""
        emulator = self.emulator("--motion", "rpm=30")
        log = self.file("log.csv")
        recording = self.start("record", ENCODER, "--output", log, "--count", "100", "--rate", "50")
        step = 3600
        steps = 0
        while recording.poll() is None:
            time.clock_settime(time.CLOCK_REALTIME, time.time() + step)
            step = -step
            steps += 1
            time.sleep(0.013)
        self.assertEqual(recording.returncode, 0, recording.stderr.read())
        self.assertGreater(steps, 20)
        self.assert_follows_shaft(read_csv(log)[1])
        self.assert_no_rule_broken(emulator)

    def assert_follows_shaft(self, rows):
        self.assertLessEqual({row["event"] for row in rows}, {"", "gap"})
        rows = [row for row in rows if row["event"] == ""]
        counts = [int(row["position"]) for row in rows]
        moments = [float(row["time_s"]) for row in rows]
        self.assertEqual(counts, sorted(counts))
        # The shaft makes half a turn (of 16384 counts) per second.
        for moment, count in zip(moments, counts):
            self.assertAlmostEqual(count - counts[0], 8192 * (moment - moments[0]), delta=8192 * 0.02)

    def test_settings(self):
        emulator = self.emulator("--singleturn", "1000")
        direction = self.run_json("config", "set", ENCODER, "direction", "1", "--yes")
        self.assertTrue(direction["new"]["mirrored"])
        self.assertEqual(self.singleturn(), 16384 - 1000)
        node = self.run_json("config", "set", ENCODER, "node", "0x42", "--yes")
        self.assertEqual((node["old"], node["new"]), ({"node": 0x20}, {"node": 0x42}))
        self.assertEqual(self.singleturn(f"{ENCODER}&node=0x42"), 16384 - 1000)
        self.assert_failed(absenc("read", HASTY), "timeout", "scan", f"to {BUS}")
        rate = self.run_json("config", "set", f"{ENCODER}&node=0x42", "bitrate", "500000", "--yes")
        self.assertEqual((rate["new"]["bit_rate"], rate["new"]["written"]), (500000, True))
        # A virtual bus has no bit rate, so nodes with different settings of the rate receive each other's frames.
        self.assertEqual(self.singleturn(f"{ENCODER}&node=0x42&bitrate=500000"), 16384 - 1000)
        self.assert_no_rule_broken(emulator)

    def test_interface_whose_bit_rate_needs_ip(self):
        """absenc takes the interface for a hardware adapter because of its name."""
        self.add("can7")
        self.emulator(interface="can7")
        encoder = "raa38-can:can7?latency=2000"
        self.assert_failed(absenc("config", "set", encoder, "bitrate", "500000", "--yes"),
                           "can7 cannot be brought to 500000 bit/s", "sudo ip link set can7 down",
                           "sudo ip link set can7 up type can bitrate 500000", "then bitrate=500000")


class Library(VirtualBus):
    def test_virtual_encoder_in_a_program(self):
        self.add("can8")
        process = subprocess.Popen(["can_emulation", "can8"], bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
        self.addCleanup(end, process)
        self.assertEqual(self.line(process), "raa38-can:can8 9799")
        run("ip", "link", "del", "can8")
        process.stdin.write(b"\n")
        # The emulation can switch the power also while its interface is gone.
        self.assertEqual(self.line(process), "switched")
        self.add("can8")
        wait_until(lambda: receivers("can8") > 0, "the encoder to come back")
        self.assertEqual(self.singleturn("raa38-can:can8?latency=2000"), 9799)
        process.stdin.close()
        process.stdin = None
        self.assertEqual(process.wait(PATIENCE), 0)


class CanUtils(VirtualBus):
    def test_candump_shows_both_directions(self):
        self.emulator("--singleturn", "9799")
        listener = self.candump()
        self.assertEqual(self.singleturn(), 9799)
        shown = [self.line(listener).split() for _ in range(2)]
        self.assertEqual([line[1] for line in shown], ["220", "120"])
        self.assertEqual(shown[0][2:], ["[8]", "80", "20", "00", "00", "00", "00", "00", "00"])
        self.assertEqual(shown[1][2:], ["[8]", "47", "26", "00", "00", "00", "00", "00", "00"])

    def test_cansend_requests_position(self):
        emulator = self.emulator("--singleturn", "9799")
        listener = self.candump("-L")
        run("cansend", BUS, ASKING)
        self.assertEqual([self.line(listener).split()[1:] for _ in range(2)], [[BUS, ASKING], [BUS, ANSWER]])
        self.assert_no_rule_broken(emulator)

    def test_log_equals_candump(self):
        self.emulator("--singleturn", "9799", "--also", "node=0x21&cyclic=10&singleturn=77")
        listener = self.candump("-L")
        log, output = self.file("can.log"), self.file("log.csv")
        self.assert_good(absenc("record", f"{ENCODER}&log={log}", "--output", output, "--count", "10", "--rate", "20"))
        with open(log, encoding="utf-8") as file:
            logged = [line.split() for line in file.read().splitlines()]
        self.assertGreaterEqual([line[2] for line in logged].count(ASKING), 10)
        self.assertIn("121#4D00000000000000", [line[2] for line in logged])
        self.assertEqual({line[1] for line in logged}, {BUS})
        last = "7FF#454E44"
        run("cansend", BUS, last)
        seen = []
        while not seen or seen[-1][2] != last:
            seen.append(self.line(listener).split())
        # A frame that another node sends at the same time may be logged before or after a request.
        for kind in (ASKING, ANSWER, "121#4D00000000000000"):
            times, seen_times = ([float(line[0].strip("()")) for line in lines if line[2] == kind]
                                 for lines in (logged, seen))
            first = min(range(len(seen_times)), key=lambda i: abs(seen_times[i] - times[0]))
            self.assertGreaterEqual(len(seen_times) - first, len(times))
            for moment, seen_moment in zip(times, seen_times[first:]):
                self.assertAlmostEqual(moment, seen_moment, delta=0.04)

    def test_no_reply_is_lost_on_busy_bus(self):
        """cangen sends extended frames with the identifier of the replies: absenc must ignore them."""
        emulator = self.emulator("--singleturn", "9799")
        cangen = self.popen("cangen", BUS, "-g", "1", "-e", "-I", "120", "-L", "8", "-D", "01".ljust(16, "0"))
        before = self.frames()
        result = absenc("read", ENCODER, "--count", "200", "--rate", "0", "--json")
        load = self.frames() - before - 2 * 200
        self.assert_good(result)
        self.assertIsNone(cangen.poll(), "cangen has ended")
        self.assertGreater(load, 50)
        self.assertEqual([line["singleturn"] for line in json_lines(result.stdout)], 200 * [9799])
        # The first reading needs two position requests, each further reading one.
        self.assertRegex(emulator.end()[2], r"^absenc: 20[0-2] requests answered")

    @staticmethod
    def frames():
        with open(f"/sys/class/net/{BUS}/statistics/tx_packets", encoding="ascii") as file:
            return int(file.read())


class OtherFrames(VirtualBus):
    def failure(self, *answers, words):
        with AnotherNode(*answers) as node:
            result = absenc("read", HASTY)
        self.assertGreaterEqual(node.asked, 1)
        self.assert_failed(result, *words)
        self.assertEqual(result.stdout, "")

    def test_invalid_frames_are_no_positions(self):
        data = (9799).to_bytes(8, "little")
        for answer, words in [
                (frame(NODE | socket.CAN_RTR_FLAG, size=8), ["bad_framing", "remote frame", "received 120:R8"]),
                (frame(NODE, data[:7]), ["wrong_length", "8 bytes of data", "received 120:47260000000000"]),
                (frame(NODE), ["wrong_length", "8 bytes of data"]),
                (frame(NODE | socket.CAN_EFF_FLAG, data), ["29 bits", "received 00000120:4726000000000000"]),
                (frame(NODE, bytes(2) + data[:6]), ["out_of_range", "more bits than the encoder"])]:
            with self.subTest(words[-1]):
                self.failure(answer, words=words)

    def test_frames_of_other_nodes_are_ignored(self):
        """Frames that are no reply of this node are ignored if its reply follows."""
        with AnotherNode(position(1, NODE | socket.CAN_EFF_FLAG), position(2, 0x121), frame(0x121, b"\3"),
                         frame(0x7FF | socket.CAN_RTR_FLAG, size=8), position(9799)):
            self.assertEqual(self.singleturn(HASTY), 9799)


class ErrorFrames(VirtualBus):
    BUS_OFF = "20000040#0000000000000000"
    NO_ACKNOWLEDGE = frame(socket.CAN_ERR_FLAG | 0x20, bytes(8))
    # Error frame with a warning of the CAN controller that errors are frequent; it does not mean a lost frame.
    WARNING = frame(socket.CAN_ERR_FLAG | 0x04, bytes([0, 8, 0, 0, 0, 0, 97, 0]))

    def test_destroyed_frames(self):
        with AnotherNode(self.NO_ACKNOWLEDGE):
            self.assert_failed(absenc("read", HASTY), "bad_framing", "frames are destroyed on the bus", "120 ohms",
                               "the bit rate")
        with AnotherNode(self.WARNING):
            self.assert_failed(absenc("read", HASTY), "timeout")
        with AnotherNode(self.NO_ACKNOWLEDGE, position(9799)):
            self.assertEqual(self.singleturn(HASTY), 9799)

    def test_bus_off(self):
        self.add("can7")
        for interface, up in ((BUS, f"`sudo ip link set {BUS} up`"),
                              ("can7", "`sudo ip link set can7 up type can bitrate 250000`")):
            with self.subTest(interface):
                self.emulator(interface=interface)
                process = self.start("read", f"raa38-can:{interface}?latency=2000", "--count", "1000000", "--rate", "50")
                self.first_line(process)
                run("cansend", interface, self.BUS_OFF)
                _, err = process.communicate(timeout=PATIENCE)
                self.assertEqual(process.returncode, 1)
                self.assert_sentence(err.decode(), f"{interface} is bus-off", "Check the bit rate", "120 ohms",
                                     f"`sudo ip link set {interface} down` and {up}", "restart-ms 100")

    def assert_found(self, *wanted):
        result, found = doctor(HASTY)
        self.assertEqual(result.returncode, 1, f"{result.stdout}{result.stderr}")
        self.assertEqual(ids(found), list(wanted), result.stdout)

    def test_doctor_names_error_frames(self):
        with AnotherNode(self.NO_ACKNOWLEDGE):
            self.assert_found("can_errors")
        with AnotherNode(frame(socket.CAN_ERR_FLAG | 0x40, bytes(8))):
            self.assert_found("can_bus_off")
        self.down()
        self.assert_found("port_failed")

    def test_record_continues_after_bus_off(self):
        emulator = self.emulator("--singleturn", "1000")
        log = self.file("log.csv")
        process = self.start("record", ENCODER, "--output", log, "--rate", "50")
        wait_until(lambda: len(rows_so_far(log)) > 5, "readings")
        run("cansend", BUS, self.BUS_OFF)
        self.next_message(process, f"{BUS} is bus-off")
        self.next_message(process, "the port is back after")
        wait_until(lambda: rows_so_far(log)[-1]["singleturn"] == "1000", "readings again")
        self.assertEqual(end(process, signal.SIGINT)[0], 0)
        self.assertEqual(losses(read_csv(log)[1]), ["lost", "back"])
        self.next_message(emulator.process, f"{BUS} is bus-off")
        self.next_message(emulator.process, f"{BUS} is back")


class InterfaceDown(VirtualBus):
    @contextlib.contextmanager
    def while_down(self):
        self.down()
        try:
            yield
        finally:
            self.up()

    @contextlib.contextmanager
    def while_gone(self):
        run("ip", "link", "del", BUS)
        try:
            yield
        finally:
            run("ip", "link", "add", BUS, "type", "vcan")
            self.up()

    def test_record_continues(self):
        for away, why in ((self.while_down, f"{BUS} went down"), (self.while_gone, f"{BUS} went (down|away)")):
            with self.subTest(away.__name__):
                self.check_recording(away, why)

    def check_recording(self, away, why):
        emulator = self.emulator("--singleturn", "1000")
        output, can_log = self.file(f"{away.__name__}.csv"), self.file(f"{away.__name__}.log")
        process = self.start("record", f"{ENCODER}&log={can_log}", "--output", output, "--rate", "50")
        wait_until(lambda: len(rows_so_far(output)) > 5, "readings")
        with away():
            wait_until(lambda: read_csv(output)[1][-1]["event"] == "lost", "the loss in the file")
            self.next_message(emulator.process, "Waiting for it to come back")
        wait_until(lambda: read_csv(output)[1][-1]["singleturn"] != "", "readings again")
        status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        self.assertRegex(messages, why)
        self.assertIn("the port is back after", messages)
        rows = read_csv(output)[1]
        self.assertEqual(losses(rows), ["lost", "back"])
        self.assertEqual({row["singleturn"] for row in rows if row["event"] == ""}, {"1000"})
        # One log file has the frames from before and after the loss of the port.
        with open(can_log, encoding="utf-8") as file:
            answers = file.read().count(f"{BUS} 120#E803000000000000\n")
        self.assertGreaterEqual(answers, sum(row["event"] == "" for row in rows))
        self.assert_no_rule_broken(emulator)

    def test_monitor_continues(self):
        self.emulator("--singleturn", "1000")
        process = self.start("monitor", ENCODER, "--json", "--interval", "0.1")
        self.next_json(process, lambda line: line["state"] == "live")
        with self.while_down():
            lost = self.next_json(process, lambda line: line["state"] == "lost")
            self.assertEqual((lost["reading"], lost["losses"]), (None, 1))
            self.next_json(process, lambda line: f"{BUS} is down: `sudo ip link set {BUS} up`" in line["message"])
        back = self.next_json(process, lambda line: line["state"] == "live")
        self.assertEqual(back["reading"]["singleturn"], 1000)
        status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0)
        self.assertRegex(messages, f"is lost: .*{BUS} went down")

    def test_down_while_reading(self):
        self.emulator()
        process = self.start("read", ENCODER, "--count", "1000000", "--rate", "50")
        self.first_line(process)
        self.down()
        _, err = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 1)
        self.assert_sentence(err.decode(), f"{BUS} went down", f"`ip -details link show {BUS}` says why",
                             f"`sudo ip link set {BUS} up` brings it up")
        for arguments in (["read", ENCODER], ["emulate", "raa38-can", "--can", BUS]):
            self.assert_failed(absenc(*arguments), f"{BUS} is down: `sudo ip link set {BUS} up` brings it up")

    def test_refuses_other_interfaces(self):
        for encoder, words in (("raa38-can:vcan9", ["there is no CAN interface vcan9", f"this machine has {BUS}"]),
                               ("raa38-can:lo", ["lo is a network interface, but none of a CAN bus"])):
            self.assert_failed(absenc("read", encoder), *words)
        self.down()
        run("ip", "link", "del", BUS)
        self.assert_failed(absenc("read", ENCODER), f"there is no CAN interface {BUS}, nor any other", "slcan:/dev/tty")


class Slcand(EncoderCase):
    """Tests of the kernel's slcan driver with a virtual serial adapter."""

    def setUp(self):
        super().setUp()
        self.adapter = Emulator(self.directory, "--singleturn", "9799", "--option", "cyclic=0", protocol="raa38-can",
                                name="adapter")
        self.addCleanup(self.adapter.end)

    def slcand(self, *options):
        # slcand needs a device whose path begins with /dev.
        process = subprocess.Popen(["slcand", "-F", *options, os.path.realpath(self.adapter.path), "slcan0"],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(self.end_slcand, process)
        wait_until(lambda: os.path.exists("/sys/class/net/slcan0") or process.poll() is not None, "slcan0")
        self.assertIsNone(process.poll(), process.stderr)

    @staticmethod
    def end_slcand(process):
        end(process)
        wait_until(lambda: not os.path.exists("/sys/class/net/slcan0"), "slcan0 to go")

    def reading(self):
        result = absenc("read", "raa38-can:slcan0?latency=2000", "--count", "5", "--rate", "0", "--json")
        self.assert_good(result)
        return [line["singleturn"] for line in json_lines(result.stdout)]

    def test_slcand_opens_bus(self):
        self.slcand("-o", "-c", "-s5")
        self.assert_failed(absenc("read", "raa38-can:slcan0"), "slcan0 is down",
                           "`sudo ip link set slcan0 up type can bitrate 250000`")
        run("ip", "link", "set", "slcan0", "up")
        self.assertEqual(self.reading(), 5 * [9799])
        zero = absenc("zero", "raa38-can:slcan0?latency=2000", "--yes", "--json")
        self.assert_good(zero)
        self.assertEqual(json.loads(zero.stdout)["fields"]["after"], 0)
        summary = self.adapter.end()[2]
        self.assertNotIn("rules", summary)
        self.assertNotIn("frames lost", summary)

    def test_ip_opens_bus(self):
        """Runs the `ip` command that absenc's error message recommends."""
        self.slcand()
        run("ip", "link", "set", "slcan0", "up", "type", "can", "bitrate", "250000")
        self.assertEqual(self.reading(), 5 * [9799])

    def test_other_bit_rate(self):
        self.slcand("-o", "-c", "-s6")
        run("ip", "link", "set", "slcan0", "up")
        self.assert_failed(absenc("read", "raa38-can:slcan0"), "timeout", "the bit rate")
        self.assertRegex(self.adapter.end()[2], "frames lost while the adapter was closed or at another bit rate: [1-9]")
