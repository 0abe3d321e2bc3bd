# SPDX-License-Identifier: Apache-2.0
"""Tests the RAA38S6 on CAN with the absenc command."""
import json
import os
import re
import select
import time
import tty
import unittest

from command_support import PATIENCE, Case, Emulator, absenc, json_lines


class CanBus(Case):
    def emulator(self, *arguments, name="adapter"):
        emulator = Emulator(self.directory, *arguments, protocol="raa38-can", name=name)
        self.addCleanup(emulator.end)
        return emulator

    def bus(self, *arguments):
        """Returns the address of a virtual CAN bus, with a latency that allows for a busy machine."""
        self.node = self.emulator(*arguments)
        return f"raa38-can:slcan:{self.node.path}?latency=300"

    def assert_no_rule_broken(self):
        summary = self.node.end()[2]
        self.assertIn("requests answered", summary)
        self.assertNotIn("rules", summary)
        self.assertNotIn("no command", summary)

    def fields(self, *arguments):
        result = absenc(*arguments, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)["fields"]

    def singleturn(self, address):
        result = absenc("read", address, "--json")
        self.assert_good(result)
        return json.loads(result.stdout)["singleturn"]

    def test_reads_by_polling_and_by_listening(self):
        address = self.bus("--singleturn", "9799", "--option", "cyclic=50")
        reading = json.loads(absenc("read", address, "--json").stdout)
        self.assertEqual((reading["singleturn"], reading["singleturn_bits"], reading["confirmed"]), (9799, 14, True))
        self.assertAlmostEqual(reading["angle_deg"], 215.31, delta=0.001)
        self.assertEqual(self.singleturn(address + "&listen=true"), 9799)
        self.assertEqual(self.fields("run", address, "listen")["singleturn"], 9799)
        self.assertEqual(self.fields("run", address, "start", "--yes")["singleturn"], 9799)
        self.assert_no_rule_broken()

    def burst(self, count):
        """Sends requests in one write. Returns how many were accepted, refused and answered."""
        descriptor = os.open(self.node.path, os.O_RDWR | os.O_NOCTTY)
        self.addCleanup(os.close, descriptor)
        tty.setraw(descriptor)
        os.write(descriptor, b"S5\rO\r" + b"t22088020000000000000\r" * count)
        text = b""
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            taken, refused = text.count(b"z\r"), text.count(b"\a")
            if taken + refused == count and text.count(b"t120") == taken:
                break
            if select.select([descriptor], [], [], 0.1)[0]:
                text += os.read(descriptor, 4096)
        return text.count(b"z\r"), text.count(b"\a"), text.count(b"t120")

    def test_adapter_queues_fifty_requests(self):
        self.bus("--option", "cyclic=0")
        self.assertEqual(self.burst(50), (50, 0, 50))
        self.assert_no_rule_broken()

    def test_adapter_refuses_requests_beyond_its_queue(self):
        self.bus("--option", "cyclic=0")
        taken, refused, answered = self.burst(150)
        self.assertEqual((taken + refused, answered), (150, taken))
        self.assertGreater(refused, 0)
        self.assertIn(f"frames refused because too many waited for the bus: {refused}", self.node.end()[2])

    def test_21_bits(self):
        address = self.bus("--singleturn", "1223629", "--option", "bits=21")
        self.assertEqual(self.singleturn(address + "&bits=21"), 1223629)
        self.assert_failed(absenc("read", address), "out_of_range", "bits", "120:CDAB120000000000")

    def test_cyclic_and_stop(self):
        address = self.bus("--option", "cyclic=0")
        self.assert_failed(absenc("run", address, "listen"), "timeout", "by itself", "cyclic 10")
        self.assertEqual(self.fields("run", address, "cyclic", "40", "--yes")["readings_per_s"], 40)
        self.assert_good(absenc("run", address, "listen"))
        self.assertEqual(self.fields("run", address, "stop", "--yes")["readings_per_s"], 0)
        self.assert_failed(absenc("run", address, "listen"), "timeout")
        self.assert_no_rule_broken()

    def test_zero(self):
        memory = self.file("memory")
        address = self.bus("--singleturn", "5000", "--memory", memory)
        zero = self.fields("zero", address, "--yes")
        self.assertEqual((zero["before"], zero["after"], zero["written"], zero["answered"]), (5000, 0, True, True))
        self.assertEqual(self.singleturn(address), 0)
        # The second `zero` writes nothing, because the position is zero already.
        self.assertFalse(self.fields("zero", address, "--yes")["written"])
        # After the zero command the node sends cyclic frames again.
        self.assertEqual(self.singleturn(address + "&listen=true"), 0)
        self.assert_no_rule_broken()
        again = self.emulator("--singleturn", "5010", "--memory", memory, name="again")
        self.assertEqual(self.singleturn(f"raa38-can:slcan:{again.path}?latency=300"), 10)

    def test_sets_node(self):
        address = self.bus("--singleturn", "77")
        self.assertEqual(json.loads(absenc("config", "get", address, "--json").stdout)["settings"],
                         {"node": {"node": 0x20}})
        result = absenc("config", "set", address, "node", "0x42", "--yes", "--json")
        self.assert_good(result)
        change = json.loads(result.stdout)
        self.assertEqual((change["old"], change["new"]), ({"node": 0x20}, {"node": 0x42}))
        self.assertEqual(self.singleturn(address + "&node=0x42"), 77)
        self.assert_failed(absenc("read", address), "timeout", "scan")
        again = absenc("config", "set", address + "&node=0x42", "node", "0x42", "--yes")
        self.assert_good(again)
        self.assertIn("nothing was sent, because it is so already", again.stderr)
        # the emulator's summary would show a rule violation if the host had written the setting twice
        self.assert_no_rule_broken()

    def test_force_writes_node_again(self):
        address = self.bus()
        self.assert_good(absenc("config", "set", address, "node", "0x20", "--yes", "--force"))
        self.assertIn("a setting written that was set already", self.node.end()[2])

    def test_sets_bit_rate(self):
        address = self.bus("--singleturn", "77")
        result = absenc("config", "set", address, "bitrate", "500000", "--yes", "--json")
        self.assert_good(result)
        change = json.loads(result.stdout)
        self.assertEqual((change["old"], change["new"]["bit_rate"], change["new"]["written"]), (None, 500000, True))
        self.assertEqual(self.singleturn(address + "&bitrate=500000"), 77)
        self.assert_failed(absenc("read", address), "timeout")
        self.assert_failed(absenc("config", "set", address + "&bitrate=500000", "bitrate", "125000", "--yes"),
                           "invalid_argument", "1000000, 500000 or 250000")
        self.assertNotIn("rules", self.node.end()[2])

    def test_sets_direction(self):
        address = self.bus("--singleturn", "1000")
        change = json.loads(absenc("config", "set", address, "direction", "1", "--yes", "--json").stdout)
        self.assertTrue(change["new"]["mirrored"])
        self.assertEqual(self.singleturn(address), 16384 - 1000)
        self.assert_wrong_usage(absenc("config", "get", address, "direction"), "no setting", "direction")
        self.assert_wrong_usage(absenc("config", "set", address, "direction", "1", "--yes", "--force"), "force")
        self.assert_no_rule_broken()

    def test_refuses_settings_that_reach_every_node(self):
        address = self.bus("--also", "node=0x21")
        for setting in (["node", "5"], ["bitrate", "500000"]):
            self.assert_failed(absenc("config", "set", address, *setting, "--yes"), "invalid_argument",
                               "other nodes are on this bus", "7E5 reaches every node")

    def test_scan(self):
        address = self.bus("--singleturn", "500", "--also", "node=0x21&cyclic=0&singleturn=700",
                           "--also", "node=0x30&cyclic=0&singleturn=1", "--also", "node=0x30&cyclic=0&singleturn=9000")
        result = absenc("scan", address, "--yes", "--json")
        self.assert_good(result)
        nodes = json.loads(result.stdout)["encoders"]
        self.assertEqual([(node["node"], node["clash"]) for node in nodes], [(0x20, False), (0x21, False), (0x30, True)])
        self.assertEqual([node.get("singleturn") for node in nodes], [500, 700, None])
        self.assertTrue(5 <= nodes[0]["readings_per_s"] <= 11, nodes)
        self.assertEqual(nodes[1]["readings_per_s"], 0)

    def test_scan_warns_and_needs_consent(self):
        address = self.bus("--also", "node=0x42")
        log = self.file("scan.log")
        for arguments in (["scan", f"{address}&log={log}"], ["run", f"{address}&log={log}", "scan"]):
            refused = absenc(*arguments)
            self.assertEqual(refused.returncode, 2, refused.stderr)
            self.assertIn("201#8001 to 2FF#80FF", refused.stderr)
            self.assertIn("process data of other devices", refused.stderr)
            self.assertIn("--yes", refused.stderr)
            self.assertFalse(os.path.exists(log), "nothing was sent")
        result = absenc("scan", address, "--yes")
        self.assert_good(result)
        self.assertIn("201#8001 to 2FF#80FF", result.stderr)
        self.assertNotIn("201#8001", absenc("scan", "sim:raa38-can").stderr, "nobody else is there")

    def test_reading_commands_send_only_to_given_node(self):
        address = self.bus("--also", "node=0x42", "--option", "cyclic=0")
        for number, arguments in enumerate((["info"], ["config", "get"], ["read"])):
            log = self.file(f"{number}.log")
            self.assert_good(absenc(*arguments, f"{address}&log={log}"))
            with open(log, encoding="utf-8") as file:
                sent = {line.split()[2] for line in file if line.split()[2].startswith("2")}
            self.assertEqual(sent, {"220#8020000000000000"}, arguments)

    def test_monitors_two_nodes(self):
        address = self.bus("--singleturn", "500", "--also", "node=0x21&singleturn=700")
        other = address + "&node=0x21"
        live = self.watch(address, other, "--rate", "20", until=lambda live: len(live) == 2)
        self.assertEqual({name: reading["singleturn"] for name, reading in live.items()}, {address: 500, other: 700})

    def test_log(self):
        log = self.file("can.log")
        address = self.bus("--singleturn", "9799", "--option", "cyclic=0")
        output = self.file("log.csv")
        self.assert_good(absenc("record", f"{address}&log={log}", "--output", output, "--count", "3", "--rate", "50"))
        with open(log, encoding="utf-8") as file:
            lines = file.read().splitlines()
        self.assertGreaterEqual(len(lines), 8)
        for asked, answered in zip(lines[::2], lines[1::2]):
            self.assertRegex(asked, r"^\(1\d{9}\.\d{6}\) adapter 220#8020000000000000$")
            self.assertRegex(answered, r"^\(1\d{9}\.\d{6}\) adapter 120#4726000000000000$")
        times = [float(re.match(r"\(([\d.]+)\)", line)[1]) for line in lines]
        self.assertEqual(times, sorted(times))
        self.assert_failed(absenc("read", f"{address}&log={log}"), log)  # `read` refuses to overwrite the existing log

    def test_survives_faults(self):
        address = self.bus("--fault", "silence=0.2", "--fault", "drop=0.1", "--fault", "repeat=0.1", "--singleturn", "9",
                           "--option", "cyclic=0").replace("latency=300", "latency=30")
        result = absenc("read", address, "--count", "60", "--rate", "0", "--json")
        readings = [line for line in json_lines(result.stdout) if line.get("ok", True)]
        self.assertGreater(len(readings), 30)
        self.assertEqual({reading["singleturn"] for reading in readings if "singleturn" in reading}, {9})
        self.assertRegex(self.node.end()[2], r"faults injected: .*drop.*silence.*repeat")

    def test_survives_interrupted_adapter(self):
        """The adapter gets garbage and an incomplete command before absenc uses it."""
        address = self.bus("--singleturn", "9799")
        with open(self.node.path, "wb", buffering=0) as other:
            other.write(b"garbage\rt22")  # another program has left garbage and an incomplete command in the adapter
        self.assertEqual(self.singleturn(address), 9799)

    def test_bench(self):
        address = self.bus("--option", "cyclic=0")
        result = absenc("bench", address, "--seconds", "0.5", "--json")
        self.assert_good(result)
        self.assertGreater(json.loads(result.stdout)["readings"], 5)


class Simulator(Case):
    def test_verbs(self):
        for arguments in (["read", "sim:raa38-can"], ["read", "sim:raa38-can?listen=true"], ["info", "sim:raa38-can"],
                          ["zero", "sim:raa38-can?singleturn=500"], ["scan", "sim:raa38-can"],
                          ["config", "get", "sim:raa38-can"], ["config", "set", "sim:raa38-can", "node", "3"],
                          ["config", "set", "sim:raa38-can", "bitrate", "1000000"],
                          ["config", "set", "sim:raa38-can", "direction", "1"],
                          ["run", "sim:raa38-can", "cyclic", "100"], ["run", "sim:raa38-can", "stop"],
                          ["run", "sim:raa38-can", "start"], ["list", "raa38-can"], ["vectors", "raa38-can"],
                          ["bench", "sim:raa38-can", "--seconds", "0.1"]):
            with self.subTest(arguments):
                self.assert_good(absenc(*arguments))

    def test_log_of_simulator(self):
        log = self.file("sim.log")
        self.assert_good(absenc("read", f"sim:raa38-can?log={log}"))
        with open(log, encoding="utf-8") as file:
            self.assertIn(" sim 220#8020000000000000\n", file.read())

    def test_refuses_unsupported_verbs(self):
        self.assert_wrong_usage(absenc("temperature", "sim:raa38-can"), "no command for this")
        self.assert_wrong_usage(absenc("alarms", "sim:raa38-can"))
        self.assert_wrong_usage(absenc("read", "sim:raa38-can?alarm=x"), "no alarms")


class Usage(Case):
    def test_refuses_wrong_addresses(self):
        for encoder, words in [("raa38-can:/dev/ttyUSB0", ["does not go over a serial port", "slcan:/dev/ttyACM0"]),
                               ("raa38-can:tcp:host:1", ["does not go over TCP"]),
                               ("raa38-can:slcan:", ["which serial port"]),
                               ("raa38-can", ["where the encoder is", "raa38-can:can0"]),
                               ("tformat:slcan:/dev/ttyACM0", ["does not go over a CAN adapter"]),
                               ("raa38-can:can0?node=0", ["1 to 255"]), ("raa38-can:can0?node=256", ["1 to 255"]),
                               ("raa38-can:can0?bits=22", ["10 to 21"]),
                               ("raa38-can:can0?bitrate=125000", ["1000000 or 500000 or 250000"]),
                               ("raa38-can:can0?baud=9600", ["it is for: serial, slcan"]),
                               ("sim:tformat?log=x", ["CAN bus"]), ("tformat:/dev/ttyUSB0?log=x", ["it is for: can"])]:
            with self.subTest(encoder):
                self.assert_wrong_usage(absenc("read", encoder), *words)

    def test_emulate_refuses_wrong_usage(self):
        for arguments, words in [(["tformat", "--can", "vcan0"], ["CAN bus"]),
                                 (["raa38-can", "--can", "vcan0", "--pty", "x"], ["--pty is a line of its own: not with --can"]),
                                 (["raa38-can", "--singleturn", "16384"], ["0 to 16383"]),
                                 (["raa38-can", "--also", "node=1", "--memory", "x"], ["not with --also"]),
                                 (["ssi"], ["sim:ssi"])]:
            with self.subTest(arguments):
                self.assert_wrong_usage(absenc("emulate", *arguments, "--for", "0.01"), *words)

    def test_reports_missing_interface(self):
        for arguments in (["read", "raa38-can:absenc-none"], ["emulate", "raa38-can", "--can", "absenc-none"]):
            with self.subTest(arguments):
                result = absenc(*arguments)
                self.assertEqual(result.returncode, 1)
                self.assertRegex(result.stderr, "there is no CAN interface absenc-none|this kernel has no CAN.*modprobe")

    def test_reports_missing_adapter(self):
        self.assert_failed(absenc("read", f"raa38-can:slcan:{self.directory}/none"), "none")


class Frames(Case):
    def decode(self, *arguments):
        return json.loads(absenc("decode", "raa38-can", "--json", *arguments).stdout)

    def test_explains_every_bad_frame(self):
        for arguments, error, words in [
                (["--hex", "120:47260000000000"], "wrong_length", "8 bytes"),
                (["--hex", "120:"], "wrong_length", "8 bytes"),
                (["--hex", "00000120:4726000000000000"], "unexpected_reply", "29 bits"),
                (["--hex", "220:8020000000000000"], "unexpected_reply", "what a node is sent"),
                (["--hex", "7A0:4726000000000000"], "unexpected_reply", "none of this encoder's frames"),
                (["--hex", "120:4766000000000000"], "out_of_range", "more bits than the encoder"),
                (["--request", "220:8020000000000000", "--hex", "121:4726000000000000"], "unexpected_reply", ""),
                (["--request", "220:2020000000000000", "--hex", "120:4726000000000000"], "unexpected_reply", ""),
                (["--request", "7E5:1121000000000000", "--hex", "7E5:1101000000000000"], "request_rejected", "CiA 305"),
                (["--request", "220:8021000000000000"], "cross_check_failed", "different nodes"),
                (["--request", "220:9920000000000000"], "unsupported", "none of the commands"),
                (["--request", "120:4726000000000000"], "unexpected_reply", "2NN and 7E5"),
                (["--request", "220:80200000000000"], "wrong_length", "8 bytes")]:
            with self.subTest(arguments):
                decoded = self.decode(*arguments)
                self.assertEqual((decoded["ok"], decoded["error"]), (False, error))
                self.assertIn(words, decoded["message"])

    def test_names_canopen_frames(self):
        for frame, fields in [("000:0120", {"function": "NMT", "data": "0120"}),
                              ("080:", {"function": "SYNC", "data": ""}),
                              ("0A0:1081110000000000", {"node": 32, "function": "EMCY", "data": "1081110000000000"}),
                              ("5A0:4304600100000000", {"node": 32, "function": "SDO RX", "data": "4304600100000000"}),
                              ("620:4004600100000000", {"node": 32, "function": "SDO TX", "data": "4004600100000000"})]:
            with self.subTest(frame):
                decoded = self.decode("--hex", frame)
                self.assertTrue(decoded["ok"], decoded)
                self.assertEqual({name: str(value).upper() if name == "data" else value
                                  for name, value in decoded["fields"].items()}, fields)

    def test_encodes_requests(self):
        for arguments, wanted in [(["position"], "220:8020000000000000"), (["start"], "220:0120000000000000"),
                                  (["cyclic", "10"], "220:31200A0000000000"), (["stop"], "220:3120000000000000"),
                                  (["zero"], "220:2020000000000000"), (["direction", "1"], "220:2220010000000000"),
                                  (["set-node", "0x21"], "7E5:1121000000000000"),
                                  (["bitrate", "500000"], "7E5:1300020000000000"),
                                  (["position", "--option", "node=255"], "2FF:80FF000000000000")]:
            with self.subTest(arguments):
                result = absenc("encode", "raa38-can", *arguments)
                self.assert_good(result)
                self.assertEqual(result.stdout, wanted + "\n")
        self.assert_wrong_usage(absenc("encode", "raa38-can", "bitrate", "125000"), "cannot be encoded")


if __name__ == "__main__":
    unittest.main()
