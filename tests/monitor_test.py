# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc monitor`, on a screen emulated by tmux and without a terminal."""
import json
import os
import re
import shlex
import signal
import subprocess
import time
import unittest

from command_support import ABSENC, PATIENCE, Emulator, EncoderCase, absenc, end, json_lines, read_line

KEYS = " q quit  p pause  z zero  c clear  tab next  e errors  h help"


class Terminal:
    """A tmux terminal that runs `absenc monitor`."""

    def __init__(self, case, *arguments, columns=80, rows=24, environment="", program=(ABSENC,)):
        self.case = case
        # number in the names of this terminal's files, because a test may open several terminals
        number = len(os.listdir(case.directory))
        self.socket = os.path.join(case.directory, f"tmux-{number}")
        self.status = os.path.join(case.directory, f"status-{number}")
        command = f"env {environment} {shlex.join([*program, 'monitor', *arguments])}; echo $? >{self.status}; read wait"
        self.tmux("-f", "/dev/null", "new-session", "-d", "-x", str(columns), "-y", str(rows), command)
        case.addCleanup(self.tmux, "kill-server")

    def tmux(self, *arguments):
        return subprocess.run(["tmux", "-S", self.socket, *arguments], capture_output=True, text=True, check=False,
                              timeout=PATIENCE).stdout

    def press(self, *keys):
        self.tmux("send-keys", *keys)

    def resize(self, columns, rows):
        self.tmux("resize-window", "-x", str(columns), "-y", str(rows))

    def screen(self, *arguments):
        return self.tmux("capture-pane", "-p", *arguments)

    def wait_for(self, pattern, *arguments):
        """Returns the screen as soon as it matches the pattern."""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            screen = self.screen(*arguments)
            if re.search(pattern, screen, re.MULTILINE):
                return screen
            time.sleep(0.02)
        raise AssertionError(f"in vain waited for {pattern!r}:\n{screen}")

    def exit_status(self):
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            if os.path.exists(self.status):
                with open(self.status, encoding="utf-8") as file:
                    text = file.read()
                if text:
                    return int(text)
            time.sleep(0.02)
        raise AssertionError(f"it does not end:\n{self.screen()}")


class MonitorCase(EncoderCase):
    def assert_screen(self, screen, *patterns):
        """Checks the first lines of the screen, apart from trailing spaces."""
        lines = [line.rstrip() for line in screen.splitlines()]
        for number, pattern in enumerate(patterns):
            self.assertRegex(lines[number], f"^{pattern}$", f"line {number} of\n{screen}")


class Screen(MonitorCase):
    def test_details_of_one_encoder(self):
        address = self.encoder("--singleturn", "65536", "--multiturn", "12", "--alarm", "over_heat")
        terminal = Terminal(self, address)
        screen = terminal.wait_for(r"live .* [1-9]\d\.\d +0 !")
        self.assert_screen(
            screen,
            f" absenc monitor   {re.escape(address[:62])}.*",
            "  encoder                  state     degrees   turns       rpm a second failed",
            rf"> {re.escape(address[:11])}\.\.{re.escape(address[-11:])} live      180\.000      12 +0\.0+ +\d+\.\d      0 !",
            "",
            "  180.000 deg    65536 counts      12 turns   alarms: over_heat",
            r"  0 \|-{17}\+-{16}O-{16}\+-{16}\| 360",
            r"  speed 0\.0+ \+/- 0\.\d+ rpm, [\d.]+ ms ago; position 1638400 counts",
            r"  \d+\.\d a second; latency 50 % [\d.]+ .s, 99 % [\d.]+ .s, longest [\d.]+ .s",
            r"  \d+ good; the port went away: 0",
            "  over_heat: the encoder is or was hotter than its threshold. What to do: let it",
            "  cool, then `absenc clear-alarms`",
            "  status alarm +encoder_id 0x11",
            "",
            r"      \d\.\d{3}  .*")
        self.assertEqual(screen.splitlines()[23].rstrip(), KEYS)
        self.assertRegex(screen, r"\n +\d\.\d{3}  180\.000 deg    65536 counts      12 turns   alarms: over_heat\n")

    def test_several_encoders(self):
        terminal = Terminal(self, "sim:tformat?singleturn=0", "sim:tformat?singleturn=32768", "tformat:/dev/nothing")
        screen = terminal.wait_for(r"live .* \d\d\.\d")
        self.assertRegex(screen, r"(?m)^> sim:\S+ +live +0\.000")
        self.assertRegex(screen, r"(?m)^  sim:\S+ +live +90\.000")
        self.assertRegex(screen, r"(?m)^  tformat:/dev/nothing +opening +- +- +- +0\.0")
        terminal.press("Tab")
        self.assertIn("  90.000 deg    32768 counts", terminal.wait_for(r"^> sim:\S+ +live +90\.000"))
        terminal.press("Down")
        terminal.wait_for(r"there is no port /dev/nothing")
        terminal.press("n")
        terminal.wait_for(r"^> sim:\S+ +live +0\.000")
        terminal.press("Up")
        terminal.wait_for(r"^> tformat:/dev/nothing")
        terminal.press("q")
        self.assertEqual(terminal.exit_status(), 1)  # one of the encoders was never read, so monitor fails
        self.assertIn("/dev/nothing: 0 readings", terminal.wait_for("of processor time each"))

    def test_zero_needs_confirmation(self):
        emulator = self.emulator("--singleturn", "1000")
        terminal = Terminal(self, f"tformat:{emulator.path}?latency=300")
        terminal.wait_for(r"live +2\.747")
        for answer in ("n", "q", "Enter"):
            terminal.press("z")
            terminal.wait_for(r"make this the zero of the turn\? y: yes, any other key: no")
            terminal.press(answer)
            terminal.wait_for(f"^{KEYS}")
            self.assertRegex(terminal.screen(), r"2\.747")
        terminal.press("z")
        terminal.wait_for("y: yes")
        terminal.press("y")
        screen = terminal.wait_for("zero: sent and confirmed")
        terminal.wait_for(r"live +0\.000")
        terminal.press("q")
        self.assertEqual(terminal.exit_status(), 0, screen)
        self.assertEqual(json.loads(absenc("read", f"tformat:{emulator.path}", "--json").stdout)["singleturn"], 0)

    def test_clear_alarms_needs_confirmation(self):
        emulator = self.emulator("--alarm", "over_speed")
        terminal = Terminal(self, f"tformat:{emulator.path}?latency=300")
        terminal.wait_for("over_speed: ")
        terminal.press("c")
        terminal.wait_for(r"clear all latched alarms\? y: yes, any other key: no")
        terminal.press("n")
        self.assertIn("over_speed: ", terminal.wait_for(f"^{KEYS}"))
        terminal.press("c")
        terminal.wait_for("y: yes")
        terminal.press("y")
        terminal.wait_for("clear-alarms: sent and confirmed")
        terminal.wait_for("no alarms")

    def test_alarm_with_persistent_cause(self):
        emulator = self.emulator("--condition", "temperature=127")
        terminal = Terminal(self, f"tformat:{emulator.path}?latency=300")
        terminal.wait_for("over_heat: ")
        terminal.press("c")
        terminal.wait_for("y: yes")
        terminal.press("y")
        terminal.wait_for("clear-alarms failed: .*over_heat")

    def test_encoder_without_clear_command(self):
        terminal = Terminal(self, "sim:ssi")
        terminal.wait_for(" live ")
        terminal.press("c")
        terminal.wait_for("ssi has no command that clears alarms")

    def test_pause(self):
        emulator = self.emulator()
        terminal = Terminal(self, f"tformat:{emulator.path}?latency=300")
        terminal.wait_for(" live ")
        terminal.press("Space")
        screen = terminal.wait_for(" paused ")
        self.assertIn("PAUSED", screen.splitlines()[0])
        self.assertRegex(screen, r"paused +- +- +-")
        terminal.wait_for(r"paused: no reading for [1-9]\S* s; the last was: +0\.000 deg")
        terminal.press("p")
        terminal.wait_for(" live ")
        self.assertNotIn("PAUSED", terminal.screen())

    def test_errors_and_help(self):
        terminal = Terminal(self, "sim:tformat?fault=truncate=0.3")
        terminal.press("e")
        terminal.wait_for(r"^ +\d\.\d{3}  wrong_length: 1A -> 1A( [0-9A-F]{2})*$")
        terminal.press("h")
        terminal.wait_for("make this position the zero of this encoder: asks first")
        terminal.press("h")
        terminal.wait_for(r"^ +\d+\.\d{3}  +0\.000 deg")

    def test_unplugged_and_back(self):
        with Emulator(self.directory, "--singleturn", "65536") as emulator:
            terminal = Terminal(self, f"tformat:{emulator.path}?latency=300")
            terminal.wait_for(r"live +180\.000")
            emulator.kill()
            screen = terminal.wait_for(r" lost +- +- +-")
            self.assertRegex(screen, r"lost: no reading for .*; the last was: 180\.000 deg")
            terminal.wait_for("the port went away: 1")
        with Emulator(self.directory, "--singleturn", "32768"):
            terminal.wait_for(r"live +90\.000")
            terminal.press("q")
            self.assertEqual(terminal.exit_status(), 0)

    def test_encoder_that_stops_replying(self):
        emulator = self.emulator("--singleturn", "65536")
        terminal = Terminal(self, f"tformat:{emulator.path}?latency=300")
        terminal.wait_for(r"live +180\.000")
        emulator.process.send_signal(signal.SIGSTOP)
        try:
            self.assertNotRegex(terminal.wait_for(r"^> \S+ +(silent|failing) "), r"(?m)^> \S+ .*180\.000")
            terminal.wait_for("timeout: the encoder did not answer")
        finally:
            emulator.process.send_signal(signal.SIGCONT)
        terminal.wait_for(r"live +180\.000")

    def test_window_sizes(self):
        terminal = Terminal(self, "sim:tformat?alarm=battery_alarm")
        terminal.wait_for(" live ")
        terminal.resize(50, 12)
        terminal.wait_for("the terminal is too small:\n50 x 12, needs 64 x 16")
        terminal.resize(132, 50)
        screen = terminal.wait_for(r"^> sim:tformat\?alarm=battery_alarm +live")
        self.assertEqual(screen.splitlines()[49].rstrip(), KEYS)
        terminal.resize(64, 16)
        # The terminal shows parts of the old screen until the new one is drawn.
        screen = terminal.wait_for(rf"(?s)battery_alarm: the battery is below 3\.1 V.*^{re.escape(KEYS)} *$")
        self.assertEqual(screen.splitlines()[15].rstrip(), KEYS)

    def test_long_names_stay_distinguishable(self):
        """The screen must show the part in which long names differ, and the alarm mark."""
        path = self.emulator_of_two().path
        addresses = [f"esl:{path}?latency=300&address={number}" for number in (0, 3)]
        terminal = Terminal(self, *addresses, columns=64, rows=20)
        for columns in (64, 80, 100):
            terminal.resize(columns, 20)
            screen = terminal.wait_for(r"^> es\S*\.\.\S*0 +live +0\.000 .* !$")
            self.assertEqual(terminal.wait_for(rf"^ +es\S*\.\.\S*3 +live .* !$").count("!"), 2, screen)
        terminal.resize(64, 20)
        terminal.press("Tab", "z")
        terminal.wait_for(r"y: yes.*\(\S*s=3\)$")
        terminal.wait_for(r"^ absenc monitor   es\S*\.\.\S*=3$")

    def emulator_of_two(self):
        emulator = Emulator(self.directory, "--alarm", "multiturn_error", "--also", "address=3&alarm=multiturn_error",
                            protocol="esl", name="a-name-that-is-much-too-long-for-the-list")
        self.addCleanup(emulator.end)
        return emulator

    def test_extra_fields_of_reading(self):
        terminal = Terminal(self, "sim:esl?singleturn=0xABCDEF&alarm=multiturn_error")
        screen = terminal.wait_for(r"ch2_alarms multiturn_error")
        self.assertRegex(screen, rf"(?m)^  .*redundant_singleturn {0xABCDEF >> 15} counts")
        self.assertRegex(screen, r"ch2_status channel_2 ready non_safety_error|ch2_status .*channel_2")
        self.assertNotRegex(screen, r"(?m)^  .*\bsingleturn \d")
        terminal.resize(64, 16)
        screen = terminal.wait_for(rf"\A(.*\n){{15}}{KEYS}")
        # Even on the smallest screen, at least one line of the trace is above the line of keys.
        self.assertRegex(screen.splitlines()[14], r"^ +\d+\.\d{3}  ")
        terminal.press("e")
        terminal.wait_for("no exchange has failed")

    def test_more_encoders_than_rows(self):
        terminal = Terminal(self, *["sim:tformat"] * 20)
        terminal.wait_for("1 to 10 of 20")
        for _ in range(12):
            terminal.press("Tab")
        terminal.wait_for("8 to 17 of 20")
        self.assertRegex(terminal.wait_for("^> sim:tformat +live"), KEYS)

    def test_colours(self):
        red = "\x1b\\[[0-9;]*31m"
        for environment, coloured in (("TERM=screen-256color", True), ("TERM=screen-256color NO_COLOR=1", False),
                                      ("TERM=vt100", False)):
            with self.subTest(environment):
                terminal = Terminal(self, "sim:tformat?alarm=battery_alarm", environment=environment)
                screen = terminal.wait_for("battery_alarm: the battery", "-e")
                self.assertEqual(re.search(red, screen) is not None, coloured)
                self.assertIn(KEYS.strip()[:10], screen)
                terminal.tmux("kill-server")

    def test_interrupt_restores_terminal(self):
        terminal = Terminal(self, "sim:tformat")
        terminal.wait_for(" live ")
        terminal.press("C-c")
        self.assertEqual(terminal.exit_status(), 0)
        screen = terminal.wait_for(r"absenc: sim:tformat: \d+ readings; \d+ good")
        self.assertNotIn(KEYS, screen)

    def test_terminal_without_cursor_control(self):
        terminal = Terminal(self, "sim:tformat", "--for", "1.2", environment="TERM=dumb")
        terminal.wait_for(r"^sim:tformat: +0\.000 deg +0 counts +0 turns +no alarms")
        self.assertEqual(terminal.exit_status(), 0)


class Lines(MonitorCase):
    def test_summary_lines_agree(self):
        """The summary lines of several encoders have the same form."""
        result = absenc("monitor", "sim:tformat", "sim:esl?fault=corrupt=0.05", "sim:ssi", "--rate", "0", "--for", "0.73",
                        "--json", "--interval", "0.2")
        closing = re.findall(r"^absenc: (sim:\S+): (\d+) readings; (\d+) good(.*)", result.stderr, re.MULTILINE)
        self.assertEqual(len(closing), 3, result.stderr)
        last = {line["encoder"]: line for line in json_lines(result.stdout)}
        for name, readings, good, rest in closing:
            beside = re.search(r"; (\d+) of the good exchanges gave no reading", rest)
            self.assertEqual(int(good), int(readings) + (int(beside[1]) if beside else 0), result.stderr)
            self.assertGreaterEqual(int(readings), last[name]["readings"])
            self.assertEqual("failed" in rest, "fault" in name)
        self.assertIn(f"{sum(int(readings) for _, readings, _, _ in closing)} readings in ", result.stderr)

    def test_text(self):
        address = self.encoder("--singleturn", "65536", "--alarm", "battery_alarm")
        result = absenc("monitor", address, "--for", "1.2", "--interval", "0.3")
        self.assert_good(result)
        lines = result.stdout.splitlines()
        self.assertGreaterEqual(len(lines), 3)
        self.assertTrue(lines[-1].startswith(f"{address}: 180.000 deg    65536 counts       0 turns   alarms: "
                                             "battery_alarm   0.0"), lines[-1])
        self.assertRegex(lines[-1], r"battery_alarm   0\.0+ ± 0\.\d+ rpm   ")
        self.assertIn(f"{address} is live", result.stderr)
        self.assertIn("of processor time each", result.stderr)

    def test_json(self):
        result = absenc("monitor", "sim:tformat?motion=rpm=90", "tformat:/dev/nothing", "--json", "--for", "1", "--interval",
                        "0.4", "--rate", "100")
        self.assertEqual(result.returncode, 1)
        lines = json_lines(result.stdout)
        live = [line for line in lines if line["encoder"].startswith("sim:")]
        away = [line for line in lines if not line["encoder"].startswith("sim:")]
        self.assertEqual(len(live), len(away))
        self.assertEqual((live[-1]["state"], away[-1]["state"]), ("live", "opening"))
        self.assertAlmostEqual(live[-1]["speed_rpm"], 90, delta=0.5)
        self.assertAlmostEqual(live[-1]["rate_hz"], 100, delta=40)
        self.assertEqual(live[-1]["position"], live[-1]["reading"]["singleturn"] + 2**17 * live[-1]["reading"]["multiturn"])
        self.assertGreater(live[-1]["latency_us"]["max"], 0)
        self.assertIsNone(away[-1]["reading"])
        self.assertIn("no port /dev/nothing", away[-1]["message"])

    def test_unplugged_and_back(self):
        with Emulator(self.directory, "--singleturn", "1000") as emulator:
            process = self.start("monitor", f"tformat:{emulator.path}?latency=300", "--json", "--interval", "0.1")
            self.wait_for(process, lambda line: line["state"] == "live")
            emulator.kill()
            lost = self.wait_for(process, lambda line: line["state"] == "lost")
            self.assertEqual((lost["reading"], lost["position"], lost["losses"]), (None, None, 1))
        with Emulator(self.directory, "--singleturn", "2000"):
            back = self.wait_for(process, lambda line: line["state"] == "live")
            self.assertEqual(back["reading"]["singleturn"], 2000)
            status, _, messages = end(process, signal.SIGINT)
        self.assertEqual(status, 0)
        self.assertRegex(messages, r"is lost: .*went away")

    def wait_for(self, process, condition):
        deadline = time.monotonic() + PATIENCE
        while True:
            text = read_line(process.stdout, deadline)
            self.assertIsNotNone(text)
            line = json.loads(text)
            if condition(line):
                return line

    def test_old_reading_has_age(self):
        result = absenc("monitor", "sim:tformat", "--rate", "1", "--for", "3", "--interval", "0.4")
        self.assertRegex(result.stdout, r"rpm   \(0\.[2-9] s old\)")

    def test_closed_output_ends_it(self):
        result = subprocess.run(["sh", "-c", '"$0" monitor sim:tformat sim:tformat --interval 0.1 | head -1', ABSENC],
                                capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assertEqual((result.returncode, len(result.stdout.splitlines())), (0, 1))

    def test_refuses_wrong_usage(self):
        self.assert_wrong_usage(absenc("monitor"), "<encoder> is missing")
        self.assert_wrong_usage(absenc("monitor", "tformt:/dev/x"), "did you mean tformat?")
        self.assert_wrong_usage(absenc("monitor", "tformat:/dev/x", "tformat:/dev/x?echo=on"), "the same encoder")
        self.assert_wrong_usage(absenc("monitor", "sim:tformat", "--rate", "fast"), "--rate")

    def test_port_of_another_command_is_in_use(self):
        address = self.encoder()
        process = self.start("monitor", address, "--json", "--interval", "0.1")
        self.wait_for(process, lambda line: line["state"] == "live")
        self.assert_failed(absenc("read", address), "is in use")
        result = absenc("monitor", address, "--json", "--interval", "0.1", "--for", "0.5")
        self.assertIn("is in use", json_lines(result.stdout)[-1]["message"])
        self.wait_for(process, lambda line: line["state"] == "live")


if __name__ == "__main__":
    unittest.main()
