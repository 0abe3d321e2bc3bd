# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc` with an FT232H on USB: the real libftdi and libusb talk to a device of the kernel's FunctionFS whose
bulk endpoints are an MPSSE of test code, with virtual encoders on its pins (ftdi_device.cpp)."""
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time

from command_support import PATIENCE, EncoderCase, absenc, end
from record_test import read_csv, rows_so_far, wait_until

GADGET = "/sys/kernel/config/usb_gadget/ftdi"
FOLDER = "/tmp/ftdi"
SERIAL = "FT1ABC"
NODE = "/dev/bus/usb"
UNITS = ("ssi", "biss", "biss-safety", "biss-chain", "endat")


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

    @contextlib.contextmanager
    def plugged(self, what):
        """A chip that is there until the end of the block, for one of several subtests."""
        chip = Chip(what)
        try:
            yield chip
        finally:
            chip.end()

    def findings(self, unit, *more):
        """Returns the findings of doctor by their ids."""
        result = absenc("doctor", f"{unit}:ftdi", "--readings", "20", "--json", *more)
        found = {one["id"]: one for one in json.loads(result.stdout)["findings"]}
        is_ill = any(one["severity"] != "note" for one in found.values())
        self.assertEqual(result.returncode, 1 if is_ill else 0, result.stdout)
        return found

    def run_json(self, *arguments):
        result = absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)


class Reading(Ftdi):
    def test_biss_at_every_clock(self):
        chip = self.chip("biss?model=rotary-19-16&singleturn=12345&multiturn=7")
        for khz, rate in ((70, 69930), (1000, 1000000), (5000, 5000000), (10000, 10000000)):
            with self.subTest(khz=khz):
                reading = self.run_json("read", f"biss:ftdi?model=rotary-19-16&ma_khz={khz}")
                self.assertEqual((reading["singleturn"], reading["multiturn"]), (12345, 7))
                self.assertEqual(chip.counts()["rate"], rate)
                self.assertEqual(self.run_json("info", f"biss:ftdi?ma_khz={khz}&model=rotary-19-16")["clock_hz"], rate)
        self.assertEqual(chip.counts()["misused"], 0)

    def test_every_clocked_unit(self):
        for unit in UNITS:
            with self.subTest(unit=unit), self.plugged(f"{unit}?singleturn=2748&motion=still") as chip:
                self.assertEqual(self.run_json("read", f"{unit}:ftdi:{SERIAL}")["singleturn"], 2748)
                self.assertEqual(self.run_json("read", f"{unit}:ftdi:{SERIAL}/A", "--count", "1")["ok"], True)
                found = self.findings(unit)
                self.assertEqual(list(found), ["clock_range"])
                self.assertEqual(found["clock_range"]["action"], "keep the clock")
                self.assertEqual(chip.counts()["misused"], 0)

    def test_turning(self):
        """Over two seconds, because a busy machine reads single replies tens of milliseconds late."""
        self.chip("biss?motion=rpm=60")
        turned = [json.loads(line) for line in
                  absenc("read", "biss:ftdi", "--count", "21", "--rate", "10", "--json").stdout.splitlines()]
        self.assertEqual(len(turned), 21)
        turn = 0
        for before, after in zip(turned, turned[1:]):
            turn += (after["angle_deg"] - before["angle_deg"]) % 360 / 360
        speed = turn / (turned[-1]["time_s"] - turned[0]["time_s"])
        self.assertAlmostEqual(speed, 1, delta=0.05)

    def test_registers_of_biss(self):
        """A control bit of 1 is a clock that is low in the timeout."""
        self.chip("biss?motion=rpm=60")
        info = self.run_json("info", "biss:ftdi")["answers"]["info"]["fields"]
        self.assertEqual((info["slaves"], info["serial_number"], bytes.fromhex(info["device_id"])), (1, 1, b"Absenc"))
        self.assert_good(absenc("memory", "write", "biss:ftdi", "5", "0xA5", "--yes"))
        result = absenc("memory", "read", "biss:ftdi", "5", "--json")
        self.assert_good(result)
        self.assertIn("a5", result.stdout)

    def test_information_and_memory(self):
        """Reads and writes registers of BiSS (control frames), and information and memory of EnDat."""
        biss = {"serial_number": 1, "device_id": b"Absenc".hex()}
        for unit, known, page, address, old, new in (
                ("biss-safety", biss, 0, 5, "00", "0xA5"),
                ("biss-chain", biss, 0, 5, "00", "0xA5"),
                ("endat", {"kind": "rotary, single-turn", "serial_number": "412045230141"}, 169, 2, "0000", "0xABCD")):
            with self.subTest(unit=unit), self.plugged(f"{unit}?singleturn=2748&motion=still") as chip:
                info = self.run_json("info", f"{unit}:ftdi")
                self.assertEqual(info["clock_hz"], 1000000)
                fields = info["answers"]["info"]["fields"]
                self.assertEqual({name: fields[name] for name in known}, known)
                place = (f"{unit}:ftdi", str(address), "--page", str(page))
                self.assertEqual(self.run_json("memory", "read", *place)["data"], old)
                write = absenc("memory", "write", *place[:2], new, *place[2:], "--yes")
                self.assert_good(write)
                self.assertIn("written and read back", write.stdout + write.stderr)
                self.assertEqual(self.run_json("memory", "read", *place)["data"], new[2:].lower())
                self.assertEqual(self.run_json("read", f"{unit}:ftdi")["singleturn"], 2748)
                self.assertEqual(chip.counts()["misused"], 0)

    def test_values_that_endat_alone_has(self):
        self.chip("endat?singleturn=2748&condition=temperature=55")
        self.assertAlmostEqual(self.run_json("temperature", "endat:ftdi")["fields"]["temperature_c"], 55, delta=0.1)
        self.assertEqual(self.run_json("read", "endat:ftdi?clock_khz=2000")["singleturn"], 2748)
        self.assert_failed(absenc("read", "endat:ftdi?clock_khz=2001"), "reads a line that turns at up to 2000000 Hz")

    def test_identify(self):
        """A busy machine takes longer than the usual limit."""
        self.chip("biss?motion=rpm=60")
        result = self.run_json("identify", "ftdi", "--for", "600")
        found = result["candidates"][0]
        self.assertEqual((found["protocol"], found["options"].get("singleturn_bits")), ("biss", 19))
        self.assertEqual((found["identity"].get("serial_number"), result["complete"]), (1, True), result["notes"])

    def test_identify_every_clocked_unit(self):
        """The shaft turns. SSI has no checksum: it is one of several candidates, and no conclusion."""
        for unit in ("ssi", "biss-safety", "biss-chain", "endat"):
            with self.subTest(unit=unit), self.plugged(f"{unit}?motion=rpm=60"):
                result = json.loads(absenc("identify", "ftdi", "--for", "300", "--json").stdout)
                self.assertIn(unit, [one["protocol"] for one in result["candidates"]])
                if unit == "endat":
                    first = result["candidates"][0]
                    self.assertEqual((first["protocol"], first["identity"].get("serial_number")), (unit, "412045230141"))

    def test_a_reading_is_one_transfer(self):
        """Of a shaft so slow that no reading must be confirmed by another one, however late it is."""
        chip = self.chip("biss?motion=still")
        counts = []
        for readings in (50, 150):
            self.assert_good(absenc("read", "biss:ftdi?max_rpm=1", "--count", str(readings), "--csv"))
            counts.append(chip.counts()["writes"])
        self.assertEqual(counts[1] - counts[0], 100)

    def test_serial_port_is_given_back(self):
        self.chip("biss")
        wait_until(lambda: os.path.exists("/dev/ttyUSB0"), "the kernel's serial port")
        self.assert_good(absenc("read", "biss:ftdi"))
        wait_until(lambda: os.path.exists("/dev/ttyUSB0"), "the kernel's serial port again")


class Ports(Ftdi):
    def test_lists_the_chip(self):
        self.chip("biss")
        lines = [json.loads(line) for line in absenc("ports", "--json").stdout.splitlines()]
        found = next(one for one in lines if one["kind"] == "ftdi")
        self.assertEqual((found["port"], found["chip"], found["may_open"]), (f"ftdi:{SERIAL}", "FT232H", True))
        text = absenc("ports").stdout
        self.assertIn(f"ftdi:{SERIAL}: FTDI Single RS232-HS, serial number {SERIAL}", text)
        self.assertIn(f"next: absenc identify ftdi:{SERIAL}", text)

    def test_errors_in_words(self):
        self.assert_failed(absenc("read", "biss:ftdi"), "no FTDI chip with an MPSSE on USB, nor any other FTDI chip")
        chip = self.chip("biss")
        self.assert_failed(absenc("read", "biss:ftdi:FT9"), "no FTDI chip with the serial number FT9",
                           f"this computer has FT232H (serial number {SERIAL})")
        self.assert_failed(absenc("read", "biss:ftdi/B"), "channel B of the FT232H", "use channel A")
        self.assert_failed(absenc("read", "biss:ftdi?speed=40000000"), "makes 458 Hz to 30000000 Hz", "set another speed=HZ")
        self.assert_failed(absenc("read", "encolink:ftdi"), "shifts in SPI modes 0 and 2", "needs mode 1")
        first = self.start("read", "biss:ftdi", "--count", "0")
        self.first_line(first)
        self.assert_failed(absenc("read", "biss:ftdi"), f"the FT232H (serial number {SERIAL}) is in use by absenc",
                           str(first.pid))
        self.assertEqual(end(first, signal.SIGINT)[0], 0)
        del chip

    def test_a_chip_without_mpsse_is_named(self):
        self.chip("nothing", product="0x6001", release="0x0600", serial="A50285BI")
        self.assert_failed(absenc("read", "biss:ftdi"), "FT232R (serial number A50285BI), which has no MPSSE")
        self.assert_failed(absenc("read", "biss:ftdi:A50285BI"), "has no MPSSE, so it cannot clock an encoder")

    def test_no_permission_names_the_rule(self):
        self.chip("biss")
        result = absenc("read", "biss:ftdi", user=65534, env={"HOME": "/tmp", "PATH": os.environ["PATH"]})
        self.assert_failed(result, "no permission to open the FT232H", "60-absenc-ftdi.rules")
        line = next(json.loads(line) for line in absenc("ports", "--json", user=65534).stdout.splitlines()
                    if json.loads(line)["kind"] == "ftdi")
        self.assertFalse(line["may_open"])
        self.assertIn("60-absenc-ftdi.rules", line["refusal"])


class Unplugged(Ftdi):
    def test_record_continues(self):
        chip = self.chip("biss?singleturn=1000")
        log = self.file("log.csv")
        record = self.start("record", "biss:ftdi", "--output", log, "--rate", "50")
        wait_until(lambda: len(rows_so_far(log)) > 10, "readings")
        chip.pull()
        wait_until(lambda: read_csv(log)[1][-1]["event"] == "lost", "the loss in the file")
        chip.plug()
        wait_until(lambda: read_csv(log)[1][-1]["singleturn"] != "", "readings again")
        status, _, messages = end(record, signal.SIGINT)
        self.assertEqual(status, 0, messages)
        self.assertIn(f"the FT232H (serial number {SERIAL}) went away: was it unplugged?", messages)
        self.assertIn("the port is back after", messages)
        rows = read_csv(log)[1]
        self.assertEqual([row["event"] for row in rows if row["event"] in ("lost", "back")], ["lost", "back"])
        self.assertEqual({row["singleturn"] for row in rows if row["event"] == ""}, {"1000"})


class Faults(Ftdi):
    STUCK = {"miso_stuck", "transceiver_missing", "data_at_rest"}

    def test_stuck_lines_and_a_missing_transceiver(self):
        """Each fault gives its finding and none of the others. A word of ones is a position of SSI."""
        for unit in UNITS:
            with self.plugged(f"{unit}?singleturn=12&motion=still") as chip:
                for order, id_, id_of_ssi in (("stuck 0", "miso_stuck", "miso_stuck"),
                                              ("stuck 1", "miso_stuck", "data_at_rest"),
                                              ("no-clock", "miso_stuck", "data_at_rest"),
                                              ("no-transceiver", "transceiver_missing", "transceiver_missing")):
                    with self.subTest(unit=unit, order=order):
                        chip.order(order)
                        is_read = absenc("read", f"{unit}:ftdi").returncode == 0
                        self.assertEqual(is_read, unit == "ssi" and order != "stuck 0")
                        self.assertEqual(list(self.findings(unit)), [id_of_ssi if unit == "ssi" else id_])
                chip.order("good")
                self.assertEqual(self.run_json("read", f"{unit}:ftdi")["singleturn"], 12)

    def test_exchanged_wires_of_the_clock(self):
        chip = self.chip("biss?singleturn=12")
        chip.order("swap-clock")
        self.assertEqual(absenc("read", "biss:ftdi").returncode, 1)
        found = self.findings("biss")
        self.assertEqual(list(found), ["wrong_spi_mode"])
        self.assertIn("wires of the clock pair are exchanged", found["wrong_spi_mode"]["cause"])
        self.assertEqual(found["wrong_spi_mode"]["action"], "set spi_mode=0")
        self.assertEqual(self.run_json("read", "biss:ftdi?spi_mode=0")["singleturn"], 12)
        self.assertEqual(list(self.findings("biss", "--option", "spi_mode=0")), ["clock_range"])

    def test_wrong_bits(self):
        """SSI has no checksum: only positions that a shaft cannot reach show them, here at 10 rpm, because this machine is
        late by milliseconds."""
        damage = {"damaged_bits", "sometimes_damaged", "always_damaged", "damaged_bursts"}
        for unit in UNITS:
            with self.subTest(unit=unit), self.plugged(f"{unit}?singleturn=12&motion=still") as chip:
                chip.order("flip 41")
                found = self.findings(unit, "--option", "max_rpm=10")
                self.assertTrue(found.keys() & ({"position_jumps"} if unit == "ssi" else damage), found)
                chip.order("good")
                self.assertEqual(self.run_json("read", f"{unit}:ftdi")["singleturn"], 12)

    def test_clock_sweep_measures_the_way(self):
        """SSI has no start bit, so a way longer than half a period shifts its bits."""
        chip = self.chip("ssi?singleturn=2748&min_clock_khz=10&max_clock_khz=2000")
        chip.order("delay 700")  # half a period at 714 kHz
        found = self.findings("ssi", "--option", "speed=400000")["clock_range"]
        # At 50 kHz the encoder's monoflop ends the word before the next clock.
        self.assertIn("good with clocks of 100000 to 600000 Hz, but only 0 of 5 at 50000 Hz and 0 of 5 at 800000 Hz",
                      found["evidence"])
        self.assertIn("takes 625 to 833 ns", found["cause"])

    def test_clock_sweep_on_a_line_that_turns(self):
        chip = self.chip("endat?model=ECN-1325&singleturn=2748")
        chip.order("delay 700")  # a period at 1429 kHz
        found = self.findings("endat", "--option", "model=ECN-1325")["clock_range"]
        self.assertIn("to 1000000 Hz, but only 0 of 5 at 1500000 Hz", found["evidence"])
        self.assertIn("takes 666 to 1000 ns", found["cause"])

    def test_clock_sweep_behind_a_start_bit(self):
        """A way of any length only shifts the bits of BiSS by whole clocks."""
        chip = self.chip("biss?singleturn=2748")
        chip.order("delay 700")
        found = self.findings("biss")
        self.assertEqual(list(found), ["clock_range"])
        self.assertEqual(found["clock_range"]["action"], "keep the clock")


class OtherPrograms(Ftdi):
    """Programs of other projects use the same device, so that it is not only our reading of AN 108."""

    def test_flashrom_reads_a_memory(self):
        chip = self.chip("flash")
        path = self.file("flash.bin")
        result = subprocess.run(["flashrom", "-p", "ft2232_spi:type=232H,divisor=4", "-c", "W25X10", "-r", path],
                                capture_output=True, text=True, timeout=PATIENCE)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        self.assertIn('Found Winbond flash chip "W25X10" (128 kB, SPI)', result.stdout)
        with open(path, "rb") as file:
            content = file.read()
        self.assertEqual(content, bytes((at * 7 + (at >> 8) * 13 + (at >> 16)) & 0xFF for at in range(128 * 1024)))
        self.assertEqual((chip.counts()["misused"], chip.counts()["unknown"]), (0, 0))

    def test_libftdi_of_python(self):
        sys.path.append("/usr/lib/python3/dist-packages")  # the virtual machine's Python does not import `site`
        import ftdi1

        self.chip("ssi?singleturn=2748&word=position:13")
        context = ftdi1.new()
        self.assertEqual(ftdi1.set_interface(context, ftdi1.INTERFACE_A), 0)
        context.module_detach_mode = ftdi1.AUTO_DETACH_REATACH_SIO_MODULE
        self.assertEqual(ftdi1.usb_open(context, 0x0403, 0x6014), 0)
        ftdi1.set_bitmode(context, 0, ftdi1.BITMODE_MPSSE)
        ftdi1.set_latency_timer(context, 2)

        def exchange(commands, size):
            ftdi1.write_data(context, bytes(commands))
            got = b""
            deadline = time.monotonic() + PATIENCE
            while len(got) < size and time.monotonic() < deadline:
                count, data = ftdi1.read_data(context, size - len(got))
                got += data[:count]
            return got

        self.assertEqual(exchange([0xAB], 2), b"\xFA\xAB")  # a command that does not exist
        rest = [0x80, 0x09, 0x0B]
        # 14 clocks in at falling edges: one byte, then six bits, at 30 MHz / 300.
        word = exchange([0x8A, 0x97, 0x8D, 0x85, 0x86, 0x2B, 0x01, *rest, 0x24, 0, 0, 0x26, 5, 0x87], 2)
        bits = (word[0] << 6 | word[1] & 0x3F) & 0x1FFF
        self.assertEqual(bits, 2748)
        # The loop connects what is shifted out with what is shifted in, in SPI mode 0.
        self.assertEqual(exchange([0x84, 0x80, 0x08, 0x0B, 0x31, 2, 0, 0x12, 0xA5, 0xFE, 0x85, 0x87], 3), b"\x12\xA5\xFE")
        ftdi1.usb_close(context)
        ftdi1.free(context)


class Speed(Ftdi):
    def test_readings_a_second(self):
        """Prints what stands in docs/benchmarks.md: readings a second, and the USB transfers of each."""
        chip = self.chip("biss?ma_khz=5000")
        self.run_json("read", "biss:ftdi?ma_khz=5000")
        chip.counts()
        result = absenc("bench", "biss:ftdi?ma_khz=5000", "--seconds", "10", "--json")
        self.assert_good(result)
        print(f"figures: {result.stdout.strip()} {chip.counts()}", flush=True)
