# SPDX-License-Identifier: Apache-2.0
"""Tests in real time that the verdict of `absenc doctor` names the cause of a fault; with --all, with more units."""
import concurrent.futures
import contextlib
import json
import os
import re
import socket
import sys
import threading
import unittest

import fault_proxy as faults
from command_support import Case, Emulator, absenc, character_units

ALL = "--all" in sys.argv
# Latencies in milliseconds: a busy machine may delay a reply by this much. With the higher one, which is still less than
# the delays of late replies, examinations take longer.
LATENCY, HIGH_LATENCY = 40, 100
# How many times a failed case is examined again. A machine that is busy with other work makes a good reply late, which is
# another fault than the one that the case has.
REPETITIONS = 3

# Protocols whose check bits accept many damaged replies.
WEAK_CHECK = {"amt21"}

# A finding that doctor may also report as the cause of damaged frames, by protocol and fault.
ALSO = {
    # If a line of EncoLink loses a byte 00 of channel 2, which the checksum does not cover, the settings of the host
    # look wrong.
    ("encolink", "NUL lost"): "wrong_settings",
    # A late reply to the command `v` may arrive just before the next reply, which then seems to have extra bytes.
    ("e201", "randomly late"): "extra_bytes",
}

# Each row: name, fault of the line, ids of the findings that doctor may report first. The id "good" means that doctor
# finds no fault.
PROXIED = [
    ("healthy", faults.Fault, "good"),
    ("split in packets", faults.Split, "good"),
    # the finding wrong_echo is right on a line with four wires, where no echo is expected
    ("own echo", faults.Echo, "good wrong_echo"),
    ("dead", faults.Dead, "no_answer"),
    ("line low", faults.LineLow, "line_inverted"),
    ("only the echo", faults.OnlyEcho, "only_echo"),
    ("login console", faults.Console, "modem_answers"),
    ("modem", faults.Modem, "modem_answers"),
    ("NMEA", faults.Nmea, "modem_answers never_silent"),
    ("chatter", faults.Chatter, "never_silent"),
    ("always late", faults.AlwaysLate, "reply_late"),
    # The finding sometimes_silent is also right: a late reply may arrive after the host has stopped listening for it.
    ("randomly late", faults.SometimesLate, "sometimes_late reply_late sometimes_silent"),
    ("loose contact", faults.LooseContact, "comes_and_goes sometimes_silent"),
    ("starting", faults.Starting, "good starting"),
    ("lost 10 %", faults.Lost, "sometimes_silent"),
    ("requests lost 10 %", faults.LostRequests, "sometimes_silent"),
    ("corrupt 2 %", faults.Corrupt, "damaged_bits sometimes_damaged"),
    ("bursts 10 %", faults.Bursts, "damaged_bursts sometimes_damaged"),
    ("bytes lost 10 %", faults.BytesLost, "bytes_missing damaged_bursts sometimes_damaged"),
    ("end cut off", faults.Cut, "bytes_missing"),
    ("reply twice", faults.Twice, "two_answer extra_bytes"),
    ("byte before", faults.ByteBefore, "byte_before"),
    ("byte after", faults.ByteAfter, "byte_after"),
    ("seven bits", faults.SevenBits, "seven_bits"),
    ("XON stripped", faults.FlowControl, "flow_control"),
    ("LF to CR LF", lambda: faults.Translated(b"\n", b"\r\n"), "newline_translated"),
    ("NUL lost", lambda: faults.Translated(b"\0", b""), "nul_lost"),
    ("telnet", faults.ParityMarks, "telnet_doubled"),
]

BYTE_CHANGES = {"seven_bits", "flow_control", "newline_translated", "nul_lost", "telnet_doubled"}
OF_REQUESTS = {"line low", "only the echo", "login console", "modem", "requests lost 10 %",
               "starting", "always late", "randomly late", "own echo"}


def first_of(found):
    """Returns the id of the finding that the verdict of doctor names, or "good"."""
    verdict = found["verdict"]
    return verdict.split(":")[1].strip() if verdict.startswith("first:") else verdict.split(":")[0]


class DoctorFaults(Case):
    latency = LATENCY

    def examine(self, encoder, settings=""):
        address = f"{encoder}?latency={self.latency}{settings}"
        result = absenc("doctor", address, "--json")
        self.assertTrue(result.stdout, f"{address}: {result.stderr}")
        return json.loads(result.stdout)

    def assert_first(self, found, wanted, what):
        self.assertIn(first_of(found), wanted.split(),
                      "\n".join([what, found["verdict"]] + [f"  {one['id']}: {one['evidence']}"
                                                            for one in found["findings"]]))

    def rotated(self, number, names):
        return names if ALL else [names[number % len(names)]]

    def side_by_side(self, examine, cases):
        """Calls `examine` for all cases, four at a time. Failed cases run again, alone, with the higher latency."""
        def one(case):
            try:
                print(examine(*case), flush=True)
                return None
            except AssertionError as failure:
                return case, str(failure)

        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            failures = [failure for failure in pool.map(one, cases) if failure]
        self.latency = HIGH_LATENCY
        for _ in range(REPETITIONS):
            print("".join(f"again, alone: {text}\n" for _, text in failures), flush=True)
            failures = [failure for case, _ in failures if (failure := one(case))]
        self.assertEqual(failures, [], "\n\n".join(text for _, text in failures))

    def is_asked(self, unit):
        """Returns whether the unit's encoder answers requests, rather than sending frames unsolicited."""
        with Emulator(self.directory, "--motion", "rpm=20", protocol=unit, name=f"asked-{unit}") as emulator, \
             faults.FaultProxy(faults.Fault(), emulator.path) as proxy:
            self.assert_good(absenc("read", f"{unit}:{proxy.path}?latency={self.latency}", "--count", "3"))
            return proxy.requests > 0

    def test_faults_of_the_line(self):
        names = list(character_units())
        asked = [unit for unit in names if self.is_asked(unit)]
        self.assertGreater(len(asked), 4)
        self.side_by_side(self.examine_fault,
                          [(unit, *fault) for number, fault in enumerate(PROXIED)
                           for unit in self.rotated(number, asked if fault[0] in OF_REQUESTS else names)])

    def examine_fault(self, unit, what, make, wanted):
        name = f"{unit}-{what.replace(' ', '-').replace('%', '')}"
        with Emulator(self.directory, "--motion", "rpm=20", protocol=unit, name=name) as emulator, \
             faults.FaultProxy(make(), emulator.path) as proxy:
            found = self.examine(f"{unit}:{proxy.path}")
            # If the fault changed only a few replies, doctor may overlook it or take it for another one.
            also = "good sometimes_damaged" if proxy.changed <= 1 else "sometimes_damaged" if proxy.changed < 10 else ""
            if unit in WEAK_CHECK and wanted in BYTE_CHANGES:
                also += " sometimes_damaged damaged_bits damaged_bursts"
            # An encoder that gets no requests and sends unsolicited frames is never silent, even without the fault
            # "chatter", so doctor may report damaged replies instead.
            if what == "chatter" and proxy.requests == 0:
                also += " always_damaged sometimes_damaged"
            also += f" {ALSO.get((unit, what), '')}"
            self.assert_first(found, f"{wanted} {also}", f"{unit}: {what}")
            return f"{unit:14} {what:24} {first_of(found)} ({proxy.changed} changed)"

    def test_echo_is_found_with_high_latency(self):
        """With a high latency the readings that compare both settings of the echo take longer."""
        self.latency = HIGH_LATENCY
        self.side_by_side(self.examine_fault, [("encolink", "own echo", faults.Echo, "wrong_echo")])

    def test_another_model(self):
        """Reads an encoder of one model with another one selected; some pairs are the same model."""
        cases = []
        for unit, about in character_units().items():
            models = [model["name"] for model in about["models"]]
            both = [(unit, None, model) for model in models] + [(unit, model, None) for model in models]
            cases += dict.fromkeys(both if ALL else both[1:2] + both[-1:])
        self.side_by_side(self.examine_model, cases)

    def examine_model(self, unit, actual, said):
        with Emulator(self.directory, *(["--model", actual] if actual else []), "--motion", "rpm=20", protocol=unit,
                      name=f"{unit}-{actual}-{said}") as emulator:
            found = self.examine(f"{unit}:{emulator.path}", f"&model={said}" if said else "")
            # Doctor may report stuck_bits or turns_stand: the encoder has fewer bits than the model in the address, or
            # no turns, and always sends zeros in their place.
            self.assert_first(found, "wrong_settings good stuck_bits turns_stand", f"{unit}: {actual} read as {said}")
            for finding in found["findings"]:
                if finding["id"] == "turns_stand":
                    self.assertIn("single-turn", finding["action"])
            return f"{unit:14} {actual or 'usual'} read as {said or 'usual'}: {found['verdict'][:100]}"

    def test_another_address(self):
        addresses = [(unit, option["minimum"] + 3 * option.get("step", 1)) for unit, about in character_units().items()
                     for option in about["options"] if option["name"] == "address"]
        self.assertGreater(len(addresses), 1)
        self.side_by_side(self.examine_address, addresses)

    def examine_address(self, unit, address):
        with Emulator(self.directory, "--option", f"address={address}", protocol=unit, name=f"{unit}-3") as emulator:
            found = self.examine(f"{unit}:{emulator.path}")
            self.assert_first(found, "wrong_address", unit)
            shown = re.search(r"address=(0x[0-9A-F]+|\d+)", found["verdict"])
            self.assertEqual(int(shown[1], 0) if shown else None, address, found["verdict"])
            return f"{unit:14} at address={address}: {found['verdict'][:100]}"

    def test_another_protocol(self):
        """Reads a polled encoder with the protocol of another polled encoder."""
        names = [unit for unit in character_units() if self.is_asked(unit)]
        self.side_by_side(self.examine_protocol,
                          [(unit, other) for number, unit in enumerate(names)
                           for other in self.rotated(number, [name for name in names if name != unit])])

    def examine_protocol(self, unit, other):
        with Emulator(self.directory, "--motion", "rpm=20", protocol=unit, name=f"{unit}-as-{other}") as emulator:
            found = self.examine(f"{other}:{emulator.path}")
            # Two protocols may stay unproven: AMT21 has only two check bits, and Nikon's characters of 16 bits are
            # tried only if the protocol in the address has them, too.
            is_unproven = unit in ("amt21", "nikon")
            self.assert_first(found, "no_answer other_protocol" if is_unproven else "other_protocol", f"{unit} read as {other}")
            self.assertIn("absenc identify" if found["findings"][0]["id"] == "no_answer" else f"{unit}:", found["verdict"])
            return f"{unit:14} read as {other}: {found['verdict'][:100]}"

    def test_tcp(self):
        with socket.create_server(("127.0.0.1", 0)) as server:
            port = server.getsockname()[1]
            # The server accepts the connection and sends nothing.
            self.assert_first(self.examine(f"tformat:tcp:127.0.0.1:{port}"), "no_answer", "a silent server")
        self.assert_first(self.examine(f"tformat:tcp:127.0.0.1:{port}"), "port_missing", "nobody listens")
        with socket.create_server(("127.0.0.1", 0)) as server:
            def hang_up():
                with contextlib.suppress(OSError):
                    while True:
                        connection, _ = server.accept()
                        connection.recv(1)
                        connection.close()

            thread = threading.Thread(target=hang_up)
            thread.start()
            try:
                found = self.examine(f"tformat:tcp:127.0.0.1:{server.getsockname()[1]}")
                self.assert_first(found, "port_lost", "a server that hangs up")
                self.assertNotIn("USB", json.dumps(found))
            finally:
                server.shutdown(socket.SHUT_RDWR)
                thread.join()

    def test_no_port(self):
        self.assert_first(self.examine(f"esl:{self.directory}"), "port_unsuitable", "a directory")
        self.assert_first(self.examine("esl:/dev/null"), "port_unsuitable", "no terminal")
        loop = self.file("loop")
        os.symlink(loop, loop)
        self.assert_first(self.examine(f"esl:{loop}"), "port_missing port_failed", "a link to itself")


if __name__ == "__main__":
    if ALL:
        sys.argv.remove("--all")
    unittest.main()
