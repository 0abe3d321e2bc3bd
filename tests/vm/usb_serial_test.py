# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc` on a USB serial port that can be unplugged, with a virtual gadget."""
import contextlib
import json
import os
import signal
import subprocess
import time

import e201_test
from command_support import PATIENCE, Emulator, EncoderCase, absenc, end, read_line
from record_test import read_csv, rows_so_far, wait_until

PORT, GADGET = "/dev/ttyACM0", "/dev/ttyGS0"
ENCODER = f"e201:{PORT}?latency=2000"
SOCKET = "/sys/bus/usb/devices/usb1/1-0:1.0/usb1-port1/disable"


def pull():
    with open(SOCKET, "w", encoding="ascii") as file:
        file.write("1")
    wait_until(lambda: not os.path.exists(PORT), f"{PORT} to go")


def plug():
    with open(SOCKET, "w", encoding="ascii") as file:
        file.write("0")
    wait_until(lambda: os.path.exists(PORT), f"{PORT} to come")


class UsbSerial(EncoderCase):
    def setUp(self):
        super().setUp()
        self.addCleanup(plug)
        # The cable is unplugged and plugged in once, because a late hang-up of an earlier test could otherwise hit
        # this one.
        with self.without_cable():
            pass

    def emulator(self, *arguments, port=GADGET):
        emulator = Emulator("/dev", *arguments, protocol="e201", name=port, line="--port")
        self.addCleanup(emulator.end)
        return emulator

    def run_json(self, *arguments):
        result = absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)

    @contextlib.contextmanager
    def without_cable(self):
        pull()
        try:
            yield
        finally:
            plug()

    @contextlib.contextmanager
    def without_gadget(self):
        """Removes the gadget, as if the computer that emulates it were off."""
        subprocess.run(["rmmod", "g_serial"], check=True, timeout=PATIENCE)
        self.assertFalse(os.path.exists(GADGET))
        try:
            yield
        finally:
            subprocess.run(["insmod", "/modules/g_serial.ko"], check=True, timeout=PATIENCE)
            wait_until(lambda: os.path.exists(PORT), f"{PORT} to come")

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


class Reading(UsbSerial):
    def test_reads_and_configures(self):
        options = ["--option", "singleturn_bits=19", "--option", "multiturn_bits=16"]
        emulator = self.emulator(*options, "--singleturn", "275096", "--multiturn", "3")
        self.assertEqual(emulator.ready, f"ready: {GADGET}\n")
        reading = self.run_json("read", ENCODER, *options)
        self.assertEqual((reading["singleturn"], reading["multiturn"], reading["singleturn_valid"]), (275096, 3, True))
        self.assertEqual(self.run_json("run", ENCODER, "set-clock", "560", "--yes")["fields"]["clock"], 5)
        self.assertEqual(self.run_json("run", ENCODER, "info")["fields"]["clock_khz"], 560)
        status, _, messages = emulator.end()
        self.assertEqual(status, 0)
        self.assertRegex(messages, r"[1-9]\d* requests answered")

    def test_clock_sweep(self):
        self.emulator("--option", "line_delay_ns=905", "--option", "latency_us=0")
        self.assert_good(absenc("config", "set", ENCODER, "clock", "6", "--yes"))
        fields = self.run_json("run", ENCODER, "clock-sweep", "20")["fields"]
        self.assertEqual((fields["valid_560_khz"], fields["valid_2200_khz"]), (20, 0))
        self.assertLess(fields["valid_1100_khz"], 20)
        self.assertEqual((fields["restored_clock"], fields["aborted"]), (6, False))

    def test_port_in_use(self):
        self.emulator()
        first = self.start("read", ENCODER, "--count", "0")
        self.first_line(first)
        self.assert_failed(absenc("read", ENCODER), "is in use by absenc", str(first.pid))
        self.assertEqual(end(first, signal.SIGINT)[0], 0)
        self.assert_good(absenc("read", ENCODER))


class Unplugged(UsbSerial):
    def test_record_continues(self):
        for away in (self.without_cable, self.without_gadget):
            with self.subTest(away.__name__):
                self.check_recording(away)

    def check_recording(self, away):
        log = os.path.join(self.directory, f"{away.__name__}.csv")
        emulator = self.emulator("--singleturn", "1000")
        process = self.start("record", ENCODER, "--output", log, "--rate", "50")
        wait_until(lambda: len(rows_so_far(log)) > 10, "readings")
        with away():
            wait_until(lambda: read_csv(log)[1][-1]["event"] == "lost", "the loss in the file")
        wait_until(lambda: read_csv(log)[1][-1]["singleturn"] != "", "readings again")
        status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        self.assertRegex(messages, f"the port {PORT} went away: unplugged")
        self.assertIn("the port is back after", messages)
        rows = read_csv(log)[1]
        events = [row["event"] for row in rows]
        lost = events.index("lost")
        self.assertEqual([event for event in events if event in ("lost", "back")], ["lost", "back"])
        self.assertEqual(events[lost + 1], "back")
        self.assertEqual({row["singleturn"] for row in rows if row["event"] == ""}, {"1000"})
        self.assertEqual(emulator.end()[0], 0)

    def test_monitor_continues(self):
        self.emulator("--singleturn", "1000")
        process = self.start("monitor", ENCODER, "--json", "--interval", "0.1")
        self.next_json(process, lambda line: line["state"] == "live")
        with self.without_cable():
            lost = self.next_json(process, lambda line: line["state"] == "lost")
            self.assertEqual((lost["reading"], lost["position"], lost["losses"]), (None, None, 1))
            gone = self.next_json(process, lambda line: "there is no port" in line["message"])
            self.assertIn(PORT, gone["message"])
            self.assertIn("this machine has", gone["message"])
        back = self.next_json(process, lambda line: line["state"] == "live")
        self.assertEqual(back["reading"]["singleturn"], 1000)
        status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0)
        self.assertRegex(messages, "is lost: .*went away: unplugged")

    def test_read_ends_if_port_does_not_return(self):
        self.emulator()
        process = self.start("read", ENCODER, "--count", "1000000", "--rate", "100")
        self.first_line(process)
        log = os.path.join(self.directory, "log.csv")
        with self.without_cable():
            _, err = process.communicate(timeout=PATIENCE)
            self.assertEqual(process.returncode, 1)
            self.assert_sentence(err.decode(), f"the port {PORT} went away: unplugged")
            # /sys lists four ports of the 16550 driver, although one of them has no hardware.
            result = absenc("read", ENCODER)
            self.assert_failed(result, f"there is no port {PORT}", "/dev/ttyS1")
            self.assertNotIn("/dev/ttyS3", result.stderr)
            result = absenc("record", ENCODER, "--output", log, "--for", "0.5")
            self.assertEqual(result.returncode, 1)
            self.assertIn(f"there is no port {PORT}", result.stderr)

    start_sweep, read_until = e201_test.ClockSweep.start, e201_test.ClockSweep.read_until

    def test_interrupted_sweep_reports_clock(self):
        self.emulator()
        process, terminal = self.start_sweep(f"{PORT}?latency=2000", 1000)
        self.read_until(terminal, "clock-sweep: valid_35_khz:")
        with self.without_cable():
            messages = self.read_until(terminal)
            out, _ = process.communicate(timeout=PATIENCE)
        self.assertEqual((process.returncode, out), (1, b""))
        self.assertIn(f"the port {PORT} went away: unplugged", messages)
        self.assertIn("clock-sweep was broken off and has left", messages)
        self.assertRegex(messages, r"previous_clock +4 ")

    def test_emulator_continues(self):
        """In this test the port of the virtual encoder is unplugged, not that of the host."""
        emulator = self.emulator("--singleturn", "1000", port=PORT)
        address = f"e201:{GADGET}?latency=2000"
        self.assertEqual(self.run_json("read", address)["singleturn"], 1000)
        self.assert_good(absenc("config", "set", address, "clock", "6", "--yes"))
        with self.without_cable():
            self.next_message(emulator.process, f"the port {PORT} went away: unplugged")
            self.next_message(emulator.process, "Waiting for it to come back")
        self.next_message(emulator.process, f"the port {PORT} is back")
        self.assertEqual(self.run_json("read", address)["singleturn"], 1000)
        self.assertEqual(self.run_json("config", "get", address, "clock")["settings"]["clock"]["clock"], 6)
        status, _, messages = emulator.end()
        self.assertEqual(status, 0)
        self.assertIn("requests answered", messages)
