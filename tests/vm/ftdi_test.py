# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc` with an FT232H on USB: the real libftdi and libusb talk to a device of the kernel's FunctionFS whose
bulk endpoints are an MPSSE of test code, with virtual encoders on its pins (ftdi_device.cpp)."""
import contextlib
import json
import os
import re
import signal
import subprocess
import time

from command_support import PATIENCE, EncoderCase, absenc, end
from record_test import read_csv, wait_until

GADGET = "/sys/kernel/config/usb_gadget/ftdi"
FOLDER = "/tmp/ftdi"
SERIAL = "FT1ABC"
NODE = "/dev/bus/usb"


def write(path, text):
    with open(path, "w", encoding="ascii") as file:
        file.write(text)


def run(*command):
    subprocess.run(command, check=True, timeout=PATIENCE)


class Chip:
    """An FT232H that is plugged in, with `what` on its pins."""

    def __init__(self, what, *, vcd=None, product="0x6014", release="0x0900", serial=SERIAL):
        for name, text in (("idVendor", "0x0403"), ("idProduct", product), ("bcdDevice", release), ("bcdUSB", "0x0200")):
            os.makedirs(GADGET, exist_ok=True)
            write(f"{GADGET}/{name}", text)
        os.makedirs(f"{GADGET}/strings/0x409", exist_ok=True)
        for name, text in (("manufacturer", "FTDI"), ("product", "Single RS232-HS"), ("serialnumber", serial)):
            write(f"{GADGET}/strings/0x409/{name}", text)
        os.makedirs(f"{GADGET}/configs/c.1", exist_ok=True)
        os.makedirs(f"{GADGET}/functions/ffs.ftdi")
        os.symlink(f"{GADGET}/functions/ffs.ftdi", f"{GADGET}/configs/c.1/ffs.ftdi")
        os.makedirs(FOLDER, exist_ok=True)
        run("mount", "-t", "functionfs", "ftdi", FOLDER)
        self.process = subprocess.Popen(["ftdi_device", FOLDER, what, *([vcd] if vcd else [])], stdin=subprocess.PIPE,
                                        stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n"
        self.plug()

    def plug(self):
        write(f"{GADGET}/UDC", "dummy_udc.0")
        wait_until(lambda: any(len(files) > 1 for _, _, files in os.walk(NODE)), "the chip to come")

    def pull(self):
        write(f"{GADGET}/UDC", "\n")
        wait_until(lambda: not any(len(files) > 1 for _, _, files in os.walk(NODE)), "the chip to go")

    def order(self, text):
        """Gives the device an order and returns what it prints before "done"."""
        self.process.stdin.write(text + "\n")
        self.process.stdin.flush()
        answer = ""
        for line in iter(self.process.stdout.readline, "done\n"):
            answer += line
        return answer

    def counts(self):
        words = self.order("counts").split()
        return {name: int(value) for name, value in zip(words[::2], words[1::2])}

    def end(self):
        with contextlib.suppress(OSError):
            self.pull()
        self.process.stdin.close()
        self.process.wait(timeout=PATIENCE)
        self.process.stdout.close()
        run("umount", FOLDER)
        os.remove(f"{GADGET}/configs/c.1/ffs.ftdi")
        os.rmdir(f"{GADGET}/functions/ffs.ftdi")


class Ftdi(EncoderCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        run("rmmod", "g_serial")
        if not os.path.exists("/sys/kernel/config/usb_gadget"):
            run("mount", "-t", "configfs", "none", "/sys/kernel/config")

    @classmethod
    def tearDownClass(cls):
        run("insmod", "/modules/g_serial.ko")
        wait_until(lambda: os.path.exists("/dev/ttyACM0"), "the serial gadget to come")
        super().tearDownClass()

    def chip(self, what, **more):
        chip = Chip(what, **more)
        self.addCleanup(chip.end)
        return chip

    def run_json(self, *arguments):
        result = absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)


class Reading(Ftdi):
    def test_biss_at_every_clock(self):
        chip = self.chip("biss?multiturn_bits=16&singleturn=12345&multiturn=7")
        for speed, rate in ((70, 69930), (1000, 1000000), (5000, 5000000), (10000, 10000000)):
            with self.subTest(speed=speed):
                reading = self.run_json("read", f"biss:ftdi?multiturn_bits=16&ma_khz={speed}")
                self.assertEqual(reading["singleturn"], 12345)
                self.assertEqual(chip.counts()["rate"], rate)
        self.assertEqual((chip.counts()["misused"], chip.counts()["unknown"]), (0, 1))
