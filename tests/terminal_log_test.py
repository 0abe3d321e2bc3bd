# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc decode` with logs of terminal programs, and with damaged captures."""
import os
import subprocess
import unittest

from command_support import ABSENC, Case, absenc, json_lines


def plain(data):
    return data.hex(" ").upper()


def text_of(data):
    return "".join(chr(byte) if 0x20 <= byte < 0x7F else "." for byte in data)


# Functions that format a line of a terminal program's log from line number, port, direction and bytes.
STYLES = {
    "port": lambda n, port, rx, data: f"{port}: {plain(data)}",
    "brackets": lambda n, port, rx, data: f"[17:55:{n:02}.125] [{port}] {'RX' if rx else 'TX'}: {plain(data)}",
    "arrows": lambda n, port, rx, data: f"2026-11-21 17:55:{n:02}.125 {port} {'<-' if rx else '>>'} {data.hex(' ')}",
    "docklight": lambda n, port, rx, data: f"21.11.2026 17:55:{n:02}.125 {port} [{'RX' if rx else 'TX'}] - {plain(data)}",
    "prefixed": lambda n, port, rx, data: f"17:55:{n:02},125 {port} {'rx' if rx else 'tx'} "
                                          + ", ".join(f"0x{byte:02x}" for byte in data),
    "table": lambda n, port, rx, data: f"17:55:{n:02}.125;{port};{'IN' if rx else 'OUT'};{plain(data)}",
    "text beside": lambda n, port, rx, data: f"{n}: {port} {'recv' if rx else 'send'} {len(data)} bytes: {plain(data)}"
                                             f"  {text_of(data)}",
    "text in bars": lambda n, port, rx, data: f"17:55:{n:02} PM {port} | {'RX' if rx else 'TX'} | {plain(data)} "
                                              f"|{text_of(data)}|",
    "dashes": lambda n, port, rx, data: f"{port}{'<' if rx else '>'} {data.hex('-')}",
}


class Logs(Case):
    def exchanges(self, protocol):
        return [(bytes.fromhex(vector["request"]), bytes.fromhex(vector["response"]))
                for vector in json_lines(absenc("vectors", protocol, "--json").stdout)
                if vector["request"] and vector["response"] and "error" not in vector and not vector["options"]]

    def log(self, style, exchanges):
        lines = []
        for number, (request, reply) in enumerate(exchanges):
            lines.append(style(2 * number, "COM3", False, request))
            lines.append(style(2 * number, "COM4", True, b"\x55\xaa\x01"))
            lines.append(style(2 * number + 1, "COM3", True, reply))
        return self.file("terminal.log", "".join(line + "\n" for line in lines))

    def decode(self, protocol, path):
        shell = 'grep "COM3" "$1" | "$0" decode "$2" - --json'
        return subprocess.run(["sh", "-c", shell, ABSENC, path, protocol], capture_output=True, text=True, check=False,
                              timeout=60)

    def test_styles(self):
        for protocol in ("esl", "tformat"):
            exchanges = self.exchanges(protocol)[:25]
            self.assertGreaterEqual(len(exchanges), 3)
            for name, style in STYLES.items():
                with self.subTest(f"{protocol}, {name}"):
                    result = self.decode(protocol, self.log(style, exchanges))
                    found = json_lines(result.stdout)
                    self.assertEqual([one for one in found if one["ok"] is False and one["error"] != "sequence_mismatch"], [],
                                     # The sequence counters of test vectors do not advance, so sequence errors are
                                     # not counted.
                                     result.stderr)
                    self.assertEqual([(one["request"], one["reply"]) for one in found],
                                     [(request.hex(), reply.hex()) for request, reply in exchanges])

    def test_refuses_two_ports_in_one_log(self):
        path = self.log(STYLES["brackets"], self.exchanges("esl")[:3])
        self.assert_failed(absenc("decode", "esl", path), "damaged at byte", '"COM4", the first of "COM3"', "grep")

    def test_refuses_other_texts(self):
        for text, words in [("COM3 opened at 115200 8N1\n", ['"opened" before the bytes']),
                            ("17:55:24 hello\n", ['"hello" before the bytes']),
                            ("12:34:56\n", ["a time or bytes"]),
                            ("COM3: 1A 00  zz\n", ["neither bytes nor the text"])]:
            with self.subTest(text):
                result = absenc("decode", "esl", self.file("log.txt", text))
                self.assert_failed(result, "log.txt is no capture that is known", *words)


class Damage(Case):
    def capture(self, name):
        path = self.file(name)
        self.assert_good(absenc("wave", "tformat", path, "--count", "20"))
        return path

    def test_session_with_wrong_byte(self):
        path = self.capture("wrong.sr")
        with open(path, "r+b") as file:
            size = os.path.getsize(path)
            file.seek(size // 2)
            byte = file.read(1)[0]
            file.seek(size // 2)
            file.write(bytes([byte ^ 0x55]))
        for verb in (["decode", "tformat"], ["identify"]):
            with self.subTest(verb):
                result = absenc(*verb, path)
                self.assert_failed(result, "the capture is damaged at byte")
                self.assertNotIn("never changes its level", result.stderr)

    def test_times_that_go_backwards(self):
        path = self.capture("backwards.vcd")
        with open(path, encoding="utf-8") as file:
            lines = file.read().splitlines()
        times = [number for number, line in enumerate(lines) if line.startswith("#")]
        lines[times[1]], lines[times[2]] = lines[times[2]], lines[times[1]]
        self.file("backwards.vcd", "\n".join(lines) + "\n")
        for verb in (["decode", "tformat"], ["identify"]):
            with self.subTest(verb):
                result = absenc(*verb, path)
                self.assert_failed(result, "the time runs backwards")
                self.assertNotIn("its level", result.stderr)

    def test_identify_reports_damage_with_result(self):
        path = self.capture("cut.sr")
        os.truncate(path, os.path.getsize(path) // 2)
        result = absenc("identify", path, timeout=300)  # an emulated program takes minutes
        self.assert_good(result)
        self.assert_sentence(result.stderr, "note: the capture is damaged at byte", "cut off")

    def test_reports_missing_file(self):
        self.capture("drive.sr")
        for name, words in [("typo.sr", []), ("driv.sr", ["did you mean drive.sr?"]), ("folder/typo.vcd", []),
                            (self.file("driev.sr"), [f"did you mean {self.file('drive.sr')}?"])]:
            for more in ([], ["--channel", "D0"]):
                with self.subTest((name, more)):
                    result = absenc("identify", name, *more, cwd=self.directory)
                    self.assert_failed(result, f"there is no file {name}", *words)
                    self.assertNotIn("CAN", result.stderr)


if __name__ == "__main__":
    unittest.main()
