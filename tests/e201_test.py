#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc` with the E201-9S interface on a pseudo-terminal: reading and configuration."""
import json
import os
import pty
import re
import select
import signal
import subprocess
import time
import unittest

from command_support import ABSENC, PATIENCE, Case, Emulator, FakeEncoder, absenc

CR = b"\r"
# Each row: reply to the command `4`, expected error, evidence in the message, advice.
FRAMES = [
    (b"0" * 16 + CR, "line_stuck", "never changed", "supply-on"),
    (b"f" * 16 + CR, "line_stuck", "never changed", "supply-on"),
    (b"e0014328ff300000" + CR, "bad_framing", "do not begin with 110", "lower MA clock"),
    (b"c000000000000000" + CR, "bad_framing", "no start bit", "lower MA clock"),
    (b"c0034328ff300000" + CR, "bad_framing", "CDS bit is 1", "lower MA clock"),
    (b"c0014328ff30000g" + CR, "bad_framing", "hexadecimal digits", "it is an E201-9S"),
    (b"c000000000000001" + CR, "truncated", "ACK is too long", "lower MA clock"),
    (b"c0014328fe300000" + CR, "bad_checksum", "delay of the line", "another MA clock"),
    (b"c0014328ff300000", "wrong_length", "16 hexadecimal digits and CR", "stream-off"),
    (b"c0014328ff30000" + CR, "wrong_length", "16 hexadecimal digits and CR", "stream-off"),
    (b"12345" + CR, "wrong_length", "16 hexadecimal digits and CR", "stream-off"),
]


class FakeInterface(FakeEncoder):
    """A fake E201-9S that sends fixed replies to the commands `4` and `v`."""

    def __init__(self, samples=b"", version=b"E201-9S V1.16" + CR):
        super().__init__()
        self.replies = {ord("4"): samples, ord("v"): version}

    def answer(self, request):
        return b"".join(self.replies.get(letter, b"") for letter in request)


class InterfaceCase(Case):
    def emulator(self, *arguments):
        return Emulator(self.directory, *arguments, protocol="e201")

    def run_json(self, path, *arguments):
        result = absenc(*arguments[:1], f"e201:{path}", *arguments[1:], "--json")
        self.assert_good(result)
        return json.loads(result.stdout)

    def clock(self, path):
        settings = json.loads(absenc("config", "get", f"e201:{path}", "clock", "--json").stdout)["settings"]
        return settings["clock"]["clock"]


class Interface(InterfaceCase):
    def test_reads_biss_encoder(self):
        options = ["--option", "singleturn_bits=19", "--option", "multiturn_bits=16"]
        with self.emulator(*options, "--singleturn", "275096", "--multiturn", "1") as emulator:
            reading = self.run_json(emulator.path, "read", *options)
            self.assertEqual((reading["singleturn"], reading["multiturn"]), (275096, 1))
            self.assertTrue(reading["singleturn_valid"])

    def test_reads_ssi_encoder(self):
        options = ["--option", "carries=ssi", "--option", "singleturn_bits=13", "--option", "gray=true"]
        with self.emulator(*options, "--singleturn", "4660") as emulator:
            self.assertEqual(self.run_json(emulator.path, "read", *options)["singleturn"], 4660)

    def test_sets_clock_and_supply(self):
        with self.emulator() as emulator:
            self.assertEqual(self.run_json(emulator.path, "run", "set-clock", "560", "--yes")["fields"]["clock"], 5)
            info = self.run_json(emulator.path, "run", "info")["fields"]
            self.assertEqual((info["version"], info["clock_khz"]), ("E201-9S V1.16", 560))
            off = self.run_json(emulator.path, "run", "supply-off", "--yes")["fields"]
            self.assertLess(off["supply_mv"], 1000)
            self.assert_failed(absenc("read", f"e201:{emulator.path}"), "line_stuck", "supply-on")
            on = self.run_json(emulator.path, "run", "supply-on", "--yes")["fields"]
            self.assertGreater(on["supply_mv"], 4000)
            self.assert_good(absenc("read", f"e201:{emulator.path}"))

    def test_info_shows_interface_and_encoder(self):
        with self.emulator("--singleturn", "1000", "--alarm", "warning") as emulator:
            info = self.run_json(emulator.path, "info")
            answers = info["answers"]
            self.assertEqual(info["resolution"], {"singleturn_bits": 19, "multiturn_bits": 0})
            self.assertEqual(answers["info"]["fields"]["serial"], "09S0417")
            self.assertEqual(answers["clock"]["fields"], {"clock": 4, "clock_khz": 280})
            self.assertEqual(answers["width"]["fields"], {"width": 19})
            self.assertEqual((answers["position"]["singleturn"], answers["position"]["alarms"]), (1000, ["warning"]))
            absenc("run", f"e201:{emulator.path}", "supply-off", "--yes")
            result = absenc("info", f"e201:{emulator.path}")
            self.assertEqual(result.returncode, 1)
            self.assertIn("E201-9S V1.16", result.stdout)
            self.assertRegex(result.stdout, "position +FAILED +line_stuck")
            self.assertIn("supply-on", result.stderr)

    def test_sets_own_zero(self):
        def counts(path):
            return self.run_json(path, "run", "decimal")["fields"]["counts"]
        with self.emulator("--singleturn", "1000") as emulator:
            self.assertEqual(counts(emulator.path), 1000)
            # The command `set-zero` does not affect `read`, so E201 has no command `zero`.
            self.assert_wrong_usage(absenc("zero", f"e201:{emulator.path}", "--yes"), "set-zero")
            self.assertEqual(counts(emulator.path), 1000)
            self.assert_good(absenc("run", f"e201:{emulator.path}", "set-zero", "--yes"))
            self.assertEqual(counts(emulator.path), 0)
            self.assertEqual(self.run_json(emulator.path, "read")["singleturn"], 1000)
            for state in ("confirmed", "unknown"):  # there is no zero any more when it is cleared again
                cleared = self.run_json(emulator.path, "run", "clear-zero", "--yes")
                self.assertEqual((cleared["fields"]["counts"], cleared["change"]), (1000, state))
            self.assertIn("no zero was set, or", cleared["change_note"])
        with self.emulator("--motion", "rpm=60") as emulator:
            self.assert_failed(absenc("run", f"e201:{emulator.path}", "set-zero", "--yes"), "not_still", "standing still")

    def test_long_line_needs_lower_clock(self):
        with self.emulator("--option", "line_delay_ns=3600") as emulator:
            result = absenc("read", f"e201:{emulator.path}")
            self.assertEqual(result.returncode, 1)
            self.run_json(emulator.path, "run", "set-clock", "140", "--yes")
            self.assert_good(absenc("read", f"e201:{emulator.path}"))


class Failures(InterfaceCase):
    def test_read_reports_received_bytes_and_advice(self):
        for reply, error, found, advice in FRAMES:
            with self.subTest(reply), FakeInterface(reply) as interface:
                result = absenc("read", f"e201:{interface.path}?latency=300")
                self.assert_failed(result, error, found, reply.hex(" ").upper())
                self.assertIn(advice, result.stderr.partition("Try: ")[2])
                trouble = json.loads(absenc("read", f"e201:{interface.path}?latency=300", "--json").stdout)
                self.assertEqual((trouble["ok"], trouble["error"]), (False, error))
                self.assertIn(found, trouble["message"])
                self.assertIn(advice, trouble["advice"])

    def test_decode_reports_same_errors(self):
        for reply, error, found, advice in FRAMES:
            with self.subTest(reply):
                result = absenc("decode", "e201", "--request", "34", "--hex", reply.hex())
                self.assert_failed(result, error, found, advice)

    def test_error_depends_on_request(self):
        self.assert_failed(absenc("decode", "e201", "--request", "6d", "--hex", "39390d"), "bad_framing", "that command")
        self.assert_failed(absenc("decode", "e201", "--request", "76", "--hex", "4142"), "wrong_length", "a line that ends")

    def test_recognizes_other_model(self):
        with FakeInterface(b"c0014328ff300000" + CR) as interface:
            result = absenc("read", f"e201:{interface.path}?model=linear-26-1um")
            self.assert_failed(result, "bad_checksum", "set model=rotary-19")

    def test_reports_silence(self):
        with FakeInterface() as interface:
            self.assert_failed(absenc("read", f"e201:{interface.path}"), "timeout", "`v` but not `4`", "`absenc info`")
        with FakeInterface(version=b"") as interface:
            self.assert_failed(absenc("read", f"e201:{interface.path}"), "timeout", "is silent", "it is an E201-9S")

    def test_refuses_old_firmware(self):
        with self.emulator("--option", "firmware=1.15") as emulator:
            for arguments in (["read"], ["run", "clock-sweep"]):
                result = absenc(arguments[0], f"e201:{emulator.path}", *arguments[1:])
                self.assert_failed(result, "unsupported", "1.16", "`absenc info`")
        with FakeInterface(b"?" + CR, b"V0.9" + CR) as interface:
            self.assert_failed(absenc("read", f"e201:{interface.path}"), "unsupported", "1.16")

    def test_detects_wrong_number_of_ssi_bits(self):
        with self.emulator("--option", "carries=ssi", "--option", "singleturn_bits=13", "--singleturn", "4660") as emulator:
            result = absenc("read", f"e201:{emulator.path}", "--option", "carries=ssi", "--option", "singleturn_bits=12")
            self.assert_failed(result, "cross_check_failed", "after_word", "number of bits")

    def test_refuses_word_that_is_too_long(self):
        self.assert_wrong_usage(absenc("read", "sim:e201?word=position:60"), "e201")
        self.assert_failed(absenc("decode", "e201", "--hex", FRAMES[0][0].hex(), "--option", "word=position:60"), "64 bits")


class ClockSweep(InterfaceCase):
    def start(self, path, frames):
        """Starts the sweep with a terminal for its messages. Returns the process and the terminal."""
        ours, terminal = pty.openpty()
        self.addCleanup(os.close, ours)
        process = subprocess.Popen([ABSENC, "run", f"e201:{path}", "clock-sweep", str(frames)],
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=terminal)
        os.close(terminal)
        return process, ours

    def read_until(self, descriptor, words=None):
        """Returns the terminal's text up to `words`; None: until the process closes the terminal."""
        deadline = time.monotonic() + PATIENCE
        text = ""
        while words is None or words not in text:
            if not select.select([descriptor], [], [], max(0, deadline - time.monotonic()))[0]:
                raise AssertionError(f"in vain waited for {words}: {text}")
            try:
                text += os.read(descriptor, 4096).decode()
            except OSError:  # reading fails because no process has the other end of the terminal open any more
                if words is None:
                    return text
                raise AssertionError(f"{words} never came: {text}") from None
        return text

    def leave(self, process):
        """Waits until the process ends by itself. Returns its exit status and standard output."""
        out, _ = process.communicate(timeout=PATIENCE)
        return process.returncode, out.decode()

    def test_counts_valid_replies_and_recommends_clock(self):
        with self.emulator() as emulator:
            fields = self.run_json(emulator.path, "run", "clock-sweep", "3")["fields"]
            self.assertEqual((fields["valid_35_khz"], fields["valid_4400_khz"]), (3, 0))
            self.assertEqual((fields["recommended_khz"], fields["restored_clock"]), (280, 4))
            self.assertFalse(fields["aborted"])

    def test_warns_of_clocks_outside_resolute_range(self):
        self.assertRegex(absenc("list", "e201").stdout, r"resolute-26 +Renishaw Resolute, 26 bits: MA at 280 or 560 kHz")
        with self.emulator("--model", "resolute-26") as emulator:
            for encoder, clock, advised in (("resolute", "2200", True), ("resolute", "560", False), ("other", "2200", False)):
                result = absenc("run", f"e201:{emulator.path}?singleturn_bits=26&encoder={encoder}", "set-clock", clock,
                                "--yes", "--json")
                fields = json.loads(result.stdout)["fields"]
                self.assertEqual("280 or 560 kHz" in fields.get("advice", ""), advised, (encoder, clock))
            plain = absenc("info", f"e201:{emulator.path}?singleturn_bits=26", "--json")
            self.assertNotIn("advice", json.loads(plain.stdout))

    def test_long_line_fails_at_high_clocks(self):
        with self.emulator("--option", "line_delay_ns=905", "--option", "latency_us=0") as emulator:
            self.assert_good(absenc("config", "set", f"e201:{emulator.path}", "clock", "6", "--yes"))
            fields = self.run_json(emulator.path, "run", "clock-sweep", "20")["fields"]
            self.assertEqual((fields["valid_560_khz"], fields["valid_2200_khz"]), (20, 0))
            self.assertLess(fields["valid_1100_khz"], 20)
            self.assertEqual(fields["restored_clock"], 6)
            self.assertEqual(self.clock(emulator.path), 6)
            clock = str(fields["recommended_clock"])
            self.assert_good(absenc("config", "set", f"e201:{emulator.path}", "clock", clock, "--yes"))
            self.assertEqual(self.clock(emulator.path), fields["recommended_clock"])
            self.assert_good(absenc("read", f"e201:{emulator.path}", "--count", "20", "--rate", "0"))

    def test_fails_without_valid_reply(self):
        with self.emulator() as emulator:
            absenc("run", f"e201:{emulator.path}", "supply-off", "--yes")
            result = absenc("run", f"e201:{emulator.path}", "clock-sweep", "2")
            self.assert_failed(result, "line_stuck", "no MA clock", "supply-on")
            self.assertEqual(self.clock(emulator.path), 4)

    def test_interrupt_restores_clock(self):
        for number in (signal.SIGINT, signal.SIGTERM):
            with self.subTest(number), self.emulator() as emulator:
                process, terminal = self.start(emulator.path, 300)
                self.read_until(terminal, "clock-sweep: valid_35_khz: 300")
                process.send_signal(number)
                messages = self.read_until(terminal)
                status, out = self.leave(process)
                self.assertEqual(status, 1)
                self.assertRegex(messages, "absenc: interrupted: clock-sweep .* as it was before")
                self.assertRegex(out, "valid_35_khz +300")
                self.assertRegex(out, "restored_clock +4")
                self.assertRegex(out, "aborted +yes")
                self.assertNotIn("valid_4400_khz", out)
                self.assertEqual(self.clock(emulator.path), 4)

    def test_unplugged_port_keeps_last_clock(self):
        with self.emulator() as emulator:
            process, terminal = self.start(emulator.path, 300)
            self.read_until(terminal, "clock-sweep: valid_35_khz: 300")
            emulator.kill()
            messages = self.read_until(terminal)
            self.assertEqual(self.leave(process), (1, ""))
        self.assertIn("went away", messages)
        self.assertIn("clock-sweep was broken off and has left", messages)
        self.assertRegex(messages, r"previous_clock +4 ")
        left, khz = (int(re.search(name + r" +(\d+)", messages)[1]) for name in ("left_clock", "left_khz"))
        self.assertGreaterEqual(left, 2)
        self.assertEqual(khz, [35, 70, 140, 280, 560, 1100, 2200, 4400][left - 1])


class Decode(Case):
    def test_decodes_linear_encoder(self):
        arguments = ["decode", "e201", "--request", "34", "--hex", "633030343030333033323066666163300d", "--json"]
        fields = json.loads(absenc(*arguments, "--model", "linear-32-0.05um").stdout)["fields"]
        self.assertEqual(fields["position"], 1579271)
        self.assertAlmostEqual(fields["position_mm"], 78.96355, delta=1e-9)
        options = ["--option", "position_bits=32", "--option", "unit_um=0.05"]
        self.assertEqual(json.loads(absenc(*arguments, *options).stdout)["fields"], fields)

    def test_unit_has_six_decimals(self):
        arguments = ["decode", "biss", "--hex", "0101"]
        self.assert_wrong_usage(absenc(*arguments, "--option", "unit_um=0.0000001"), "0.0 to 1000000.0")
        self.assert_wrong_usage(absenc(*arguments, "--option", "unit_um=-1"), "unit_um")

    def test_decodes_64_bits(self):
        vectors = [json.loads(line) for line in absenc("vectors", "biss", "--json").stdout.splitlines()]
        widest = next(vector for vector in vectors if vector["id"] == "biss-009")
        self.assertEqual(widest["fields"]["position"], 2**64 - 1)



class ScriptCommands(Case):
    def test_decode_names_script_commands(self):
        for command in (">", "1", "B26"):
            shown = absenc("decode", "e201", "--request", command.encode().hex(), "--json")
            self.assertEqual(json.loads(shown.stdout)["fields"]["command"], command)
        self.assert_failed(absenc("decode", "e201", "--request", b"M9".hex()), "unsupported")


if __name__ == "__main__":
    unittest.main()
