# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc identify`."""
import concurrent.futures
import json
import os
import random
import select
import signal
import subprocess
import threading
import tty
import unittest

from command_support import ABSENC, Case, Emulator, EncoderCase, absenc, end, json_lines

UNITS = json_lines(absenc("list", "--json").stdout)


def with_role(infos, role):
    """Returns those of `infos`, options or fields of a unit, that have this role."""
    return [one for one in infos if one.get("role") == role]


def another(option):
    """Returns a valid value of the option that is not its default."""
    if "choices" in option:
        return next(one for one in option["choices"] if one != option["default"])
    return option["maximum"] if option["maximum"] != option["default"] else option["minimum"]


def cases(unit):
    """Yields (settings of the emulated encoder, options that identify must find)."""
    yield {}, {}
    model = unit["models"][-1] if unit["models"] else {"options": {}}
    if model["options"]:
        yield {"model": model["name"]}, model["options"]
    for role in ("encoder", "rate"):
        for option in with_role(unit["options"], role):
            if role == "rate" and unit["link"] == "can":
                continue  # the slcan adapter on a pseudo-terminal has no rate on the bus to search for
            yield {option["name"]: another(option)}, {option["name"]: another(option)}


def usual(unit, settings):
    """Returns the settings with the default rate, as they follow a port in an address."""
    rates = {option["name"]: option["default"] for option in with_role(unit["options"], "rate")}
    texts = [f"{name}={value}" for name, value in {**settings, **rates}.items()]
    return "?" + "&".join(texts) if texts else ""


# Encoders on clocked and SPI links are left out, because they need an SPI controller.
ENCODERS = [(unit, *case) for unit in UNITS if unit["link"] not in ("exchange", "clocked", "clocked_bidirectional") for case in cases(unit)]

# Time limit of an identify search in seconds, long enough for a busy machine.
SEARCH = 300


def identify(*arguments, **settings):
    """Returns the result of `absenc identify` and its parsed JSON output, if any."""
    result = absenc("identify", *arguments, "--json", **settings)
    return result, json.loads(result.stdout) if result.stdout else None


class IdentifyOnLine(EncoderCase):
    def find(self, index, unit, settings):
        protocol = unit["protocol"]
        arguments = [word for name, value in settings.items()
                     for word in (("--model", value) if name == "model" else ("--option", f"{name}={value}"))]
        with Emulator(self.directory, "--motion", "rpm=60", *arguments, protocol=protocol,
                      name=f"line{index}") as emulator:
            place = ("slcan:" if unit["link"] == "can" else "") + emulator.path
            result, found = identify(place, "--for", str(SEARCH), timeout=2 * SEARCH)
            self.assertEqual((result.returncode, found and found["complete"]), (0, True), f"{protocol}: {result.stdout}{result.stderr}")
            # The added latency allows for a busy machine that delays the emulator.
            verb, encoder = found["candidates"][0]["command"].replace('"', "").split()[1:3]
            again = absenc(verb, encoder + ("&" if "?" in encoder else "?") + "latency=1000", "--json")
            # Reading at the default rate may succeed, too, because a pseudo-terminal has no baud rate.
            at_usual_rate = absenc("read", f"{protocol}:{place}{usual(unit, settings)}", "--json").returncode == 0
            return found["candidates"], again, at_usual_rate

    def test_every_encoder_is_the_first_candidate(self):
        with concurrent.futures.ThreadPoolExecutor(6) as pool:
            searches = [pool.submit(self.find, i, unit, settings) for i, (unit, settings, _) in enumerate(ENCODERS)]
        for (unit, settings, wanted), search in zip(ENCODERS, searches):
            with self.subTest(unit["protocol"], settings=settings):
                candidates, again, at_usual_rate = search.result()
                rates = [] if at_usual_rate else with_role(unit["options"], "rate")
                self.check(unit, wanted, candidates[0], with_role(unit["options"], "encoder") + rates)
                # The command that identify recommends must work.
                self.assertEqual(again.returncode, 0, again.stderr)
                self.assertTrue(json_lines(again.stdout)[0]["ok"])

    def check(self, unit, wanted, best, shown):
        """Checks the best candidate. `shown`: the options that the encoder's replies reveal."""
        self.assertEqual(best["protocol"], unit["protocol"])
        self.assertTrue(best["found"])
        self.assertGreater(best["explained"], 0.9 * best["tried"])
        if best["unasked"] and not best["encoder"]:
            return  # unsolicited replies reveal only the position, and no options
        for option in shown:
            if option["name"] in wanted:
                self.assertEqual(best["options"][option["name"]], wanted[option["name"]])
        identity = best["identity"]
        self.assertEqual(bool(identity), bool(with_role(unit["fields"], "identity")) and not best["unasked"])
        for name in wanted.keys() & identity.keys():
            self.assertEqual((best["options"][name], identity[name]), (wanted[name], wanted[name]))

    def test_text_names_next_command(self):
        emulator = self.emulator("--model", "23-bit")
        result = absenc("identify", f"{emulator.path}?baud=2500000")
        self.assert_good(result)
        self.assertIn("6 of 6", result.stdout)
        self.assertIn("\n1 says: encoder_id 0x17\n", result.stdout)
        self.assertRegex(result.stdout, r'go on with: absenc read "tformat:.*\?model=23-bit')

    def test_says_which_other_devices_answer_alike(self):
        for protocol, is_noted in (("raa38-modbus", True), ("tformat", False)):
            with Emulator(self.directory, protocol=protocol, name=protocol) as emulator:
                rate = "19200" if is_noted else "2500000"
                result = absenc("identify", f"{emulator.path}?baud={rate}")
                self.assert_good(result)
                self.assertEqual("any Modbus device that has the same registers answers like this" in result.stderr, is_noted)

    def test_sends_no_changing_request(self):
        memory = self.file("memory")
        with Emulator(self.directory, "--memory", memory, "--alarm", "battery_alarm") as emulator:
            identify(f"{emulator.path}?baud=2500000")
            alarms = json_lines(absenc("read", f"tformat:{emulator.path}?latency=300", "--json").stdout)[0]["alarms"]
        self.assertEqual(alarms, ["battery_alarm"])


class UnknownLine(Case):
    def setUp(self):
        super().setUp()
        self.master, self.slave = os.openpty()
        tty.setraw(self.slave)
        self.path = os.ttyname(self.slave)
        self.addCleanup(os.close, self.slave)
        self.addCleanup(os.close, self.master)

    def serve(self, answer):
        """Lets the line's far end answer every request with `answer(request)` until the test ends."""
        wake, waker = os.pipe()

        def run():
            while True:
                ready, _, _ = select.select([self.master, wake], [], [])
                if wake in ready:
                    return
                os.write(self.master, answer(os.read(self.master, 256)))
        thread = threading.Thread(target=run)
        thread.start()

        def stop():
            os.write(waker, b"x")
            thread.join()
            os.close(wake)
            os.close(waker)
        self.addCleanup(stop)

    def test_silent_line(self):
        result = absenc("identify", self.path, "--for", "2")
        self.assert_failed(result, "nothing came back", "A and B", "supply")
        self.assertEqual(result.stdout, "")

    def test_noise_replies(self):
        noise = random.Random(1)
        self.serve(lambda request: noise.randbytes(noise.randrange(4, 24)))
        result, found = identify(self.path, "--for", "2")
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertFalse(found["ok"])
        self.assertFalse(any(candidate["found"] for candidate in found["candidates"]))

    def test_noise_stream(self):
        noise = random.Random(2)
        stop = threading.Event()
        os.set_blocking(self.master, False)

        def send():
            while not stop.is_set():
                try:
                    os.write(self.master, noise.randbytes(200))
                except BlockingIOError:
                    select.select([], [self.master], [], 0.01)
        thread = threading.Thread(target=send)
        thread.start()
        try:
            for _ in range(8):
                result, found = identify(self.path, "--for", "3")
                self.assertEqual(result.returncode, 1, result.stdout)
                self.assertNotIn("at 0 baud", result.stderr)
        finally:
            stop.set()
            thread.join()

    def test_only_echo(self):
        self.serve(lambda request: request)
        result = absenc("identify", self.path, "--for", "2")
        self.assertEqual(result.returncode, 1, result.stdout)
        self.assertNotIn("go on with", result.stdout)

    def test_time_is_limited(self):
        result, found = identify(self.path, "--for", "0.3")
        self.assert_failed(result, "the time is over")
        self.assertFalse(found["complete"])

    def test_says_that_the_identity_could_not_be_read(self):
        """The encoder answers readings, and no request for its encoder id."""
        reading = bytes.fromhex("1A 00 45 23 01 11 34 12 00 00 4A")
        self.serve(lambda request: reading if request == reading[:1] else b"")
        result, found = identify(f"{self.path}?baud=2500000", "--for", str(SEARCH))
        self.assertEqual((result.returncode, found["candidates"][0]["protocol"], found["complete"]), (0, "tformat", True))
        self.assertEqual(found["candidates"][0]["identity"], {})
        note = ("tformat: not known who it is: encoder-id could not be read: the encoder did not answer; "
                "`absenc info` tries it again")
        self.assertEqual(found["notes"], [note])
        self.assertIn(f"note: {note}\n", result.stderr)

    def test_interrupt_ends_it(self):
        process = subprocess.Popen([ABSENC, "identify", self.path], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
        os.read(self.master, 1)  # waits for the first byte that identify sends
        status, _, err = end(process, signal.SIGINT)
        self.assertEqual(status, 1)
        self.assertIn("interrupted", err)


class SeveralEncoders(EncoderCase):
    def test_several_on_one_line(self):
        more = [word for address in (3, 5) for word in ("--also", f"address={address}")]
        with Emulator(self.directory, *more, protocol="esl") as emulator:
            result = absenc("identify", emulator.path)
        self.assert_good(result)
        self.assertIn("3 encoders are on the line: address=0, address=3, address=5", result.stderr)
        self.assertNotIn("equally well", result.stderr)
        commands = [line.split("absenc read ")[1] for line in result.stdout.splitlines() if "absenc read " in line]
        self.assertEqual(sorted(command.strip('"').partition("?")[2] for command in commands),
                         ["", "address=3", "address=5"])

    def test_streaming_can_node_is_found_by_its_number(self):
        with Emulator(self.directory, "--option", "node=0x21", "--option", "cyclic=100", protocol="raa38-can") as emulator:
            # 0.4 s is too short for identify to send a request.
            _, found = identify(f"slcan:{emulator.path}", "--for", "0.4")
        self.assertEqual({one["options"]["node"] for one in found["candidates"]}, {0x21})


class WrongUsage(Case):
    def test_refuses_missing_port(self):
        self.assert_failed(absenc("identify", self.file("nothing")), "there is no port", "nothing")

    def test_refuses_protocol(self):
        self.assert_wrong_usage(absenc("identify", "tformat:/dev/null"), "says which protocol")

    def test_refuses_options_of_protocol(self):
        self.assert_wrong_usage(absenc("identify", "/dev/null?singleturn_bits=23"), "no setting of a port")

    def test_needs_port_or_frames(self):
        self.assert_wrong_usage(absenc("identify"), "one of")
        self.assert_wrong_usage(absenc("identify", "/dev/null", "--hex", "00"), "one of")
        self.assert_wrong_usage(absenc("identify", "--request", "1A"), "--hex")
        self.assert_wrong_usage(absenc("identify", "--hex", "00", "--request", "1A", "--request", "1A"), "--request")
        self.assert_wrong_usage(absenc("identify", "--hex", "xyz"), "--hex", "'x'")


class Frames(Case):
    def test_frame_with_request(self):
        result = absenc("identify", "--request", "1A", "--hex", "1A 00 45 23 01 11 34 12 00 00 4A")
        self.assert_good(result)
        self.assertIn("go on with: absenc decode tformat --request", result.stdout)

    def test_finds_options(self):
        result, found = identify("--hex", "084000efcdab341255277e086000abd57f67")
        self.assertEqual(result.returncode, 0)
        self.assertEqual(found["candidates"][0]["options"]["crc_bit_order"], "msb")

    def test_damaged_frame(self):
        result = absenc("identify", "--request", "1A", "--hex", "1A 00 45 23 01 11 34 12 00 00 4B")
        self.assert_failed(result, "no protocol explains")

    def test_unchecked_word_is_ssi(self):
        moving = [f"{i:012b}" for i in range(100, 108)]
        result, found = identify(*[argument for word in moving for argument in ("--hex", word)])
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertEqual(found["candidates"][0]["protocol"], "ssi")
        # These SSI words contain no turns, so identify must not list a candidate for each bit at which turns could
        # begin.
        ssi = [one["options"] for one in found["candidates"] if one["protocol"] == "ssi"]
        self.assertEqual({options["multiturn_first"] for options in ssi}, {ssi[0]["multiturn_first"]})

    def test_two_protocols_explain_a_frame(self):
        # A captured frame of EncoLink may be from a UART or from SPI, because both carry the same frames.
        frames = ["0000000d131e00", "0000029c735600", "0000036a439e00", "0000052bd3ec00"]
        arguments = [argument for frame in frames for argument in ("--hex", frame)]
        result, found = identify(*arguments)
        self.assertEqual(result.returncode, 0, result.stdout)
        self.assertEqual({one["protocol"] for one in found["candidates"][:2]}, {"encolink", "encolink-spi"})
        self.assertIn("equally well", absenc("identify", *arguments).stderr)

    def test_reports_that_match_may_be_chance(self):
        self.assert_failed(absenc("identify", "--hex", "0001 0010 0011"), "may be chance", "turn the shaft")


class Capture(Case):
    def check(self, encoder, name, protocol, wanted):
        path = self.file(name)
        self.assert_good(absenc("wave", encoder, path, "--count", "20"))
        result, found = identify(path)
        self.assertEqual(result.returncode, 0, f"{result.stdout}{result.stderr}")
        best = found["candidates"][0]
        self.assertEqual(best["protocol"], protocol)
        self.assertEqual({name: best["options"][name] for name in wanted}, wanted)
        self.assert_good(absenc(*best["command"].split()[1:]))

    def test_line(self):
        self.check("tformat?model=23-bit&motion=rpm=60", "line.vcd", "tformat", {"singleturn_bits": 23})

    def test_finds_options(self):
        self.check("esl?crc_bit_order=msb&motion=rpm=60", "line.sr", "esl", {"crc_bit_order": "msb"})

    def test_word_with_checksum_is_not_ssi(self):
        self.check("biss?model=rotary-19&motion=rpm=60", "words.vcd", "biss", {"singleturn_bits": 19})

    def test_random_bytes(self):
        noise = random.Random(3)
        for kind in ("bytes", "lines", "frames"):
            for size in (20, 200, 4000):
                text = noise.randbytes(size).hex(" ")
                if kind == "lines":
                    text = "".join(byte + noise.choice("     \n") for byte in text.split())
                if kind == "frames":
                    text = "".join(f"({i / 100:.6f}) can0 {noise.randrange(2048):03X}#{noise.randbytes(8).hex()}\n"
                                   for i in range(size // 8))
                with self.subTest(kind, size=size):
                    result, found = identify(self.file(f"{kind}{size}.txt", text.rstrip() + "\n"))
                    self.assertEqual(result.returncode, 1, result.stdout)

    def test_capture_without_frames(self):
        path = self.file("bytes.txt", "00 11 22 33 44 55 66 77\n")
        self.assert_failed(absenc("identify", path), "no protocol explains")


if __name__ == "__main__":
    unittest.main()
