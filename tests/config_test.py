# SPDX-License-Identifier: Apache-2.0
"""Tests the configuration file absenc.toml."""
import json
import os
import re
import resource
import signal
import subprocess
import time
import unittest
import urllib.request

from command_support import ABSENC, PATIENCE, Case, Emulator, absenc, end, json_lines, read_line

ELBOW = '[encoder.elbow]\nprotocol = "tformat"\n'
CANNOT_BEGIN = r"axis\d+ cannot be read beside \d+ other encoders, because this computer gives it no "
SIM = ELBOW + 'port = "sim"\n'


class ConfigCase(Case):
    """Runs the command in an empty directory as a user without any configuration."""

    def setUp(self):
        super().setUp()
        self.home = self.file("home")
        self.work = self.file("work")
        for directory in (self.home, self.work):
            os.mkdir(directory)

    def absenc(self, *arguments, **environment):
        environ = {name: value for name, value in os.environ.items()
                if name not in ("ABSENC_CONFIG", "XDG_CONFIG_HOME")}
        return absenc(*arguments, cwd=self.work, env={**environ, "HOME": self.home, **environment})

    def write(self, path, text):
        os.makedirs(os.path.dirname(self.file(path)), exist_ok=True)
        return self.file(path, text)

    def config(self, text):
        return self.write("work/absenc.toml", text)

    def json(self, *arguments):
        result = self.absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)


class Names(ConfigCase):
    def test_every_verb_accepts_name(self):
        with Emulator(self.directory, "--singleturn", "1000", "--multiturn", "7") as emulator:
            self.config(f'{ELBOW}port = "{emulator.path}"\nlatency = 300\n')
            reading = self.json("read", "elbow")
            self.assertEqual((reading["singleturn"], reading["multiturn"]), (1000, 7))
            self.assertEqual(self.json("temperature", "elbow")["fields"], {"temperature_c": 35})
            self.assertEqual(self.json("run", "elbow", "memory-read", "5")["fields"]["address"], 5)
            self.assertEqual(self.json("alarms", "elbow")["alarms"], [])
            self.assertEqual(self.json("info", "elbow")["encoder"], f"tformat:{emulator.path}")
            self.assert_good(self.absenc("bench", "elbow", "--seconds", "0.1"))
            self.assert_good(self.absenc("zero", "elbow", "--yes"))
            self.assertEqual(self.json("read", "elbow")["singleturn"], 0)

    def test_encoders_share_bus(self):
        with Emulator(self.directory, "--model", "23-bit", "--tcp", "0") as emulator:
            port = emulator.line().strip().rsplit(":", 1)[1]
            self.config(f'[bus.arm]\nport = "tcp:127.0.0.1:{port}"\nlatency = 300\n'
                        f'{ELBOW}bus = "arm"\nmodel = "23-bit"\n'
                        '[encoder.wrist]\nprotocol = "tformat"\nbus = "arm"\nlatency = 400\n')
            self.assertEqual(self.json("read", "elbow")["singleturn_bits"], 23)
            wrist = self.absenc("read", "wrist")
            self.assert_failed(wrist, "set model=23-bit", "127.0.0.1")

    def test_settings_of_virtual_encoder(self):
        self.config(SIM + 'singleturn = 8000000\nmultiturn = 3\nmodel = "23-bit"\nstrict = false\n'
                    'alarm = ["over_heat", "battery_alarm"]\n')
        reading = self.json("read", "elbow")
        self.assertEqual((reading["singleturn"], reading["multiturn"]), (8000000, 3))
        self.assertEqual(reading["alarms"], ["over_heat", "battery_alarm"])

    def test_protocol_with_port_needs_no_file(self):
        self.config("this is no TOML")
        self.assert_good(self.absenc("read", "sim:tformat"))
        self.assert_wrong_usage(self.absenc("read", "tformat"), "where the encoder is")
        self.assert_wrong_usage(self.absenc("read", "/dev/ttyUSB0"), "which protocol")


class Overriding(ConfigCase):
    def test_encoder_overrides_bus_and_defaults(self):
        self.config('[defaults]\nsingleturn = 1\nmultiturn = 1\nseed = 1\nalarm = "over_heat"\n'
                    f'[bus.b]\nport = "sim"\nmultiturn = 2\n{ELBOW}bus = "b"\nalarm = "battery_alarm"\n')
        reading = self.json("read", "elbow")
        self.assertEqual((reading["singleturn"], reading["multiturn"]), (1, 2))
        self.assertEqual(reading["alarms"], ["battery_alarm"])

    def test_address_and_option_override_file(self):
        self.config(SIM + 'singleturn = 1\nmultiturn = 1\nmodel = "23-bit"\nalarm = "over_heat"\n')
        reading = self.json("read", "elbow?singleturn=5&model=TS5700N8500", "--option", "multiturn=6",
                            "--option", "alarm=battery_alarm")
        self.assertEqual((reading["singleturn"], reading["multiturn"], reading["singleturn_bits"]), (5, 6, 17))
        self.assertEqual(reading["alarms"], ["battery_alarm"])

    def test_empty_list_overrides(self):
        self.config('[defaults]\nalarm = "over_heat"\n' + SIM + "alarm = []\n")
        self.assertEqual(self.json("read", "elbow")["alarms"], [])

    def test_defaults_apply_only_where_valid(self):
        self.config('[defaults]\nlatency = 5\nbaud = 9600\necho = "auto"\nmultiturn = 4\nstrict = false\n' + SIM)
        self.assertEqual(self.json("read", "elbow")["multiturn"], 4)
        self.assertEqual(self.json("info", "elbow")["options"]["strict"], False)
        # A setting of a bus or an encoder must suit its protocol and port; a setting in [defaults] may be unsuitable
        # for some encoders.
        self.config(SIM + "latency = 5\n")
        self.assert_wrong_usage(self.absenc("read", "elbow"), "absenc.toml:4:1: latency cannot be set here", "tcp")

    def test_refuses_wrong_settings_in_address(self):
        self.config(SIM)
        self.assert_wrong_usage(self.absenc("read", "elbow?sigleturn=5"), "did you mean singleturn?")
        self.assert_wrong_usage(self.absenc("read", "elbow", "--option", "latency=5"), "cannot be set here")


class FileSearch(ConfigCase):
    def multiturn(self, **environment):
        result = self.absenc("read", "elbow", "--json", **environment)
        self.assert_good(result)
        return json.loads(result.stdout)["multiturn"]

    def test_search_order(self):
        self.write("home/.config/absenc/absenc.toml", SIM + "multiturn = 1\n")
        self.assertEqual(self.multiturn(), 1)
        self.write("xdg/absenc/absenc.toml", SIM + "multiturn = 2\n")
        self.assertEqual(self.multiturn(XDG_CONFIG_HOME=self.file("xdg")), 2)
        self.config(SIM + "multiturn = 3\n")
        self.assertEqual(self.multiturn(), 3)
        mine = self.file("mine.toml", SIM + "multiturn = 4\n")
        self.assertEqual(self.multiturn(ABSENC_CONFIG=mine), 4)

    def test_missing_file_is_reported_with_example(self):
        for arguments in (["read", "elbow"], ["list", "--names"]):
            self.assert_wrong_usage(self.absenc(*arguments), "looked for absenc.toml and ",
                                    f"{self.home}/.config/absenc/absenc.toml",
                                    '[encoder.elbow]\n  protocol = "tformat"')

    def test_example_of_message_is_valid(self):
        message = self.absenc("read", "elbow").stderr
        self.config("\n".join(line for line in message.splitlines() if line.startswith("  ")))
        self.assertIn("elbow  tformat:/dev/ttyUSB0", self.absenc("list", "--names").stdout)

    def test_refuses_missing_file_of_environment(self):
        self.config(SIM)
        path = self.file("nothing.toml")
        self.assert_wrong_usage(self.absenc("read", "elbow", ABSENC_CONFIG=path), path, "ABSENC_CONFIG")
        self.assert_wrong_usage(self.absenc("read", "elbow", ABSENC_CONFIG=self.directory), "cannot be read", "directory")


class ManyEncoders(ConfigCase):
    def many(self, numbers):
        self.config("".join(f'[encoder.axis{i}]\nprotocol = "tformat"\nport = "/dev/absent{i}"\n' for i in numbers))

    def processor_time(self, count):
        self.many(range(count))
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.assert_good(self.absenc("list", "--names"))
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def test_file_is_parsed_once(self):
        """The processor time must not grow with the square of the number of encoders."""
        self.assertLess(self.processor_time(2000), 30 * max(self.processor_time(200), 0.01))

    def served(self, megabytes, *shell):
        """Starts the server, by the command `shell` if given, with at most this many megabytes of addresses.

        glibc reserves 64 MiB of them for each of up to 8 heaps per core, on a machine of 32 bits only 1 MiB. With two
        heaps, the threads have equally many however many cores the machine has."""
        def limit():
            if not os.environ.get("ABSENC_IN_QEMU"):  # qemu needs more, and gives an emulated machine of 32 bits 4 GB
                resource.setrlimit(resource.RLIMIT_AS, (megabytes << 20,) * 2)

        environment = {**os.environ, "HOME": self.home, "XDG_STATE_HOME": self.home, "MALLOC_ARENA_MAX": "2"}
        environment.pop("ABSENC_CONFIG", None)
        process = subprocess.Popen([*shell, ABSENC, "serve", "--listen", "127.0.0.1:0", "--history", "none"],
                                   cwd=self.work, env=environment, bufsize=0, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE, preexec_fn=limit)
        self.addCleanup(lambda: process.stdout.closed or end(process))
        return process

    def test_serve_with_many_encoders_ends_by_signal(self):
        """The server has as many addresses as on a machine of 32 bits."""
        self.many(range(1000))
        process = self.served(3072)
        self.assertIn(b"http://", process.stdout.readline())
        self.assertEqual(end(process)[0], 0)

    @unittest.skipIf(os.environ.get("ABSENC_IN_QEMU"), "qemu needs more addresses than the test leaves")
    def test_serve_says_which_encoder_has_no_memory(self):
        """Wherever the memory is at its end, there is enough left to say so. Its last part may be missing for a thread."""
        self.many(range(1000))
        for megabytes in range(200, 900, 25):
            with self.subTest(megabytes):
                process = self.served(megabytes)
                said = read_line(process.stderr, time.monotonic() + PATIENCE)
                self.assertRegex(said, CANNOT_BEGIN + "(memory|thread)")
                self.assertIn("ulimit", said)
                self.assertEqual(process.wait(PATIENCE), 1)

    def test_serve_says_which_encoder_has_no_thread(self):
        """The limit of threads does not hold for root, so root runs the server as a user who may open root's files."""
        self.many(range(1000))
        user, shell = os.geteuid(), []
        if user == 0:
            user = 100_000 + os.getpid()
            may_open = ["--inh-caps=+dac_override", "--ambient-caps=+dac_override"]
            shell = ["setpriv", f"--reuid={user}", "--clear-groups", *may_open]
        find = ["find", "/proc", "-mindepth", "3", "-maxdepth", "3", "-path", "*/task/*", "-uid", str(user)]
        threads = subprocess.run(find, capture_output=True, check=False).stdout.count(b"\n")
        process = self.served(3072, *shell, "prlimit", f"--nproc={threads + 100}")
        said = read_line(process.stderr, time.monotonic() + PATIENCE)
        self.assertRegex(said, CANNOT_BEGIN + "thread")
        self.assertIn("ulimit", said)
        self.assertEqual(process.wait(PATIENCE), 1)

    @unittest.skipIf(os.environ.get("ABSENC_IN_QEMU"), "qemu needs more addresses than the test leaves")
    def test_serve_goes_on_with_the_encoders_that_have_memory(self):
        """An encoder without memory is read once the file has fewer."""
        def reload(numbers):
            self.many(numbers)
            process.send_signal(signal.SIGHUP)
            for line in iter(lambda: read_line(process.stderr, time.monotonic() + PATIENCE), None):
                if "was read again" in line:
                    return line
            return ""

        def served():
            with urllib.request.urlopen(url + "api/encoders", timeout=PATIENCE) as reply:
                return {one["encoder"] for one in json.load(reply)["encoders"]}

        self.many(range(3))
        process = self.served(768)
        url = re.search(r"http://[0-9.:]+/", process.stdout.readline().decode())[0]
        said = reload(range(1000))
        begun, left_out = re.search(r"3 unchanged; ended: none; begun: (.*); not begun: (.*): axis", said).groups()
        self.assertRegex(said, CANNOT_BEGIN + "(memory|thread)")
        self.assertEqual(len(begun.split(", ")) + len(left_out.split(", ")), 997)
        self.assertEqual(served(), {"axis0", "axis1", "axis2", *begun.split(", ")})
        first = left_out.split(", ")[0]
        self.assertRegex(reload((0, 1, int(first.removeprefix("axis")))), f"2 unchanged; .*; begun: {first}\n")
        self.assertEqual(served(), {"axis0", "axis1", first})
        self.assertEqual(end(process)[0], 0)


class WrongFiles(ConfigCase):
    def test_refuses_dangling_link(self):
        self.write("home/.config/absenc/absenc.toml", SIM)
        self.assert_good(self.absenc("read", "elbow"))
        for target in ("nowhere.toml", "absenc.toml"):
            os.symlink(target, os.path.join(self.work, "absenc.toml"))
            self.assert_wrong_usage(self.absenc("read", "elbow"), "absenc.toml", "leads to no file")
            os.unlink(os.path.join(self.work, "absenc.toml"))

    def test_refuses_fifo(self):
        os.mkfifo(os.path.join(self.work, "absenc.toml"))
        self.assert_wrong_usage(self.absenc("read", "elbow"), "no regular file")

    def test_refuses_repeated_option(self):
        for encoder in ("sim:tformat?seed=1&seed=2", "sim:tformat?singleturn=1&singleturn=1",
                        "sim:tformat?model=TS5700N8500&model=TS5667N120"):
            self.assert_wrong_usage(self.absenc("read", encoder), "is given twice")
        self.assert_wrong_usage(self.absenc("info", "sim:tformat?seed=1", "--option", "seed=2"), "is given twice")
        self.assert_good(self.absenc("read", "sim:tformat?alarm=over_heat&alarm=battery_alarm"))

    def test_refuses_number_below_range_of_double(self):
        self.assert_wrong_usage(self.absenc("read", "sim:tformat", "--count", "1", "--rate", "1e-400"), "1e-400", "from 0")

    def test_reports_too_deep_nesting(self):
        deep = 50_000
        for text, place in [(".".join(["a"] * deep) + " = 1\n", "1:34:"),
                            (SIM + "[" + ".".join(["a"] * deep) + "]\n", "4:35:"),
                            ("[encoder.x]\n" + " . ".join(['"a"'] * deep) + " = 1\n", "2:"),
                            ("a = " + "[" * deep + "]" * deep + "\n", "1:21:"),
                            ("a = " + "{a=" * deep + "1" + "}" * deep + "\n", "1:"),
                            ("a = [ \"\"\"x\"\"\"\", {" + ".".join(["a"] * deep) + " = 1} ]\n", "1:")]:
            with self.subTest(text[:30]):
                self.config(text)
                self.assert_wrong_usage(self.absenc("read", "elbow"), "absenc.toml:" + place, "nested")

    def test_ignores_brackets_in_texts_and_comments(self):
        dots = "." * 100 + "[" * 100
        self.config(f"# {dots} it's\n[encoder.elbow] # {dots}\nprotocol = 'tformat'\nport = \"sim\"\n"
                    f'alarm = ["over_heat"]\n[encoder.other]\nprotocol = "tformat"\nport = "/dev/{dots}\\"{dots}"\n')
        self.assert_good(self.absenc("read", "elbow"))

    def test_refuses_endless_file(self):
        self.assert_wrong_usage(self.absenc("read", "elbow", ABSENC_CONFIG="/dev/zero"), "/dev/zero", "16 MiB")

    def test_error_begins_with_line_and_column(self):
        for text, words in [("[encoder.elbow\n", ["1:15: this is no TOML"]),
                            (SIM + 'modle = "23-bit"\n', ["4:1:", "did you mean model?"]),
                            (ELBOW + 'port = "/dev/x"\nlatency = 2.5\n', ["4:1:", '"2.5"', "a whole number"]),
                            (SIM + 'model = "24-bit"\n', ["4:1:", "did you mean 23-bit?"]),
                            (SIM + 'echo = "maybe"\n', ["4:1:", "auto, on or off"]),
                            (SIM + "singleturn_bits = 99\n", ["4:1:", "1 to 24"]),
                            (SIM + "singleturn = 131072\n", ["4:1:", "0 to 131071"]),
                            (SIM + 'seed = 2\nalarm = ["over_heat", "over_haet"]\n',
                             ["5:1:", "did you mean over_heat?"]),
                            (SIM + 'fault = "corrupt=2"\n', ["4:1:", "from 0 to 1"]),
                            (SIM + 'motion = "rmp=2"\n', ["4:1:", "rpm=R"]),
                            (ELBOW + 'port = "tcp:host"\n', ["3:1:", "tcp:HOST:PORT"]),
                            (ELBOW + 'port = ""\n', ["3:1:", "where the encoder is"]),
                            ('[defaults]\necho = "maybe"\n' + SIM, ["2:1:", "auto, on or off"]),
                            (ELBOW + 'bus = "b"\n[bus.b]\nport = "sim"\nbaud = 9600\n', ["6:1:", "it is for: serial"])]:
            with self.subTest(text):
                self.config(text)
                place, *rest = words
                self.assert_wrong_usage(self.absenc("read", "elbow"), "absenc: absenc.toml:" + place, *rest)

    def test_checks_names_everywhere_but_values_only_if_used(self):
        self.config(SIM + '[encoder.wrist]\nprotocol = "tformat"\nport = "sim"\nmodle = "23-bit"\n')
        self.assert_wrong_usage(self.absenc("read", "elbow"), "absenc.toml:7:1:")
        self.config(SIM + '[encoder.wrist]\nprotocol = "tformat"\nport = "sim"\nmotion = "file=nothing.csv"\n')
        self.assert_good(self.absenc("read", "elbow"))
        for arguments in (["read", "wrist"], ["list", "--names"], ["list", "--names", "--json"]):
            self.assert_wrong_usage(self.absenc(*arguments), "absenc.toml:7:1:", "nothing.csv")

    def test_refuses_unknown_names(self):
        self.config(SIM)
        self.assert_wrong_usage(self.absenc("read", "elbwo"), '"elbwo" in absenc.toml', "did you mean elbow?")
        self.assert_wrong_usage(self.absenc("read", "shoulder?latency=5"), "known are: elbow")


class List(ConfigCase):
    def test_list_shows_names(self):
        self.config(ELBOW + 'port = "/dev/ttyUSB0"\nmodel = "23-bit"\nlatency = 5\n'
                    '[encoder.arm]\nprotocol = "tformat"\nport = "tcp:host:4001"\nsingleturn_bits = 20\n')
        result = self.absenc("list", "--names")
        self.assert_good(result)
        self.assertEqual([line.split() for line in result.stdout.splitlines()[:3]],
                         [["NAME", "ENCODER", "MODEL"], ["elbow", "tformat:/dev/ttyUSB0", "23-bit"],
                          ["arm", "tformat:tcp:host:4001"]])
        self.assertIn("absenc.toml", result.stdout)
        elbow, arm = json_lines(self.absenc("list", "--names", "--json").stdout)
        self.assertEqual(elbow, {"name": "elbow", "encoder": "tformat:/dev/ttyUSB0", "protocol": "tformat",
                                 "model": "23-bit",
                                 "options": {"singleturn_bits": 23, "multiturn_bits": 16, "encoder_id": 23,
                                             "strict": True, "battery": True}})
        self.assertEqual((arm["name"], arm["model"]), ("arm", None))

    def test_refuses_protocol_together_with_names(self):
        self.config(SIM)
        self.assert_wrong_usage(self.absenc("list", "tformat", "--names"), "--names")


if __name__ == "__main__":
    unittest.main()
