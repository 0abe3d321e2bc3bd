# SPDX-License-Identifier: Apache-2.0
"""Tests `absenc memory` and `absenc config`."""
import json
import os
import pty
import re
import select
import signal
import subprocess
import time
import unittest

from command_support import ABSENC, PATIENCE, Case, Emulator, absenc, end, wait_for_handler

PAGES, ADDRESSES = 6, 127
HEADER = "absenc dump 1\nprotocol: tformat\nmodel: TS5700N8500\n"
EMPTY = {(page, address): 0 for page in range(PAGES) for address in range(ADDRESSES)}


def crc(text):
    """Returns the CRC-16 that docs/dump-format.md defines for a dump."""
    register = 0xFFFF
    for byte in text.encode():
        register ^= byte << 8
        for _ in range(8):
            register = (register << 1 ^ (0x1021 if register & 0x8000 else 0)) & 0xFFFF
    return f"{register:04X}"


def parse(dump):
    """Checks a dump's checksum. Returns its bytes by page and address."""
    lines = [line for line in dump.splitlines() if line and not line.startswith("#")]
    assert lines.pop() == "checksum: " + crc("".join(line + "\n" for line in lines)), dump
    image = {}
    for line in lines[3:]:
        page, address, data = re.fullmatch(r"page (\d+) address 0x([0-9A-F]{2}): ([0-9A-F ]+)", line).groups()
        for offset, byte in enumerate(bytes.fromhex(data)):
            image[int(page), int(address, 16) + offset] = byte
    return image


def addresses(words):
    """Returns the (page, address) pairs in a text such as "page 0 to 2: 0x05 to 0x07, 0x10"."""
    found = set()
    for part in words.split("; "):
        first, last, ranges = re.fullmatch(r"page (\d+)(?: to (\d+))?: (.*)", part).groups()
        for page in range(int(first), int(last or first) + 1):
            for one in ranges.split(", "):
                begin, *rest = [int(number, 16) for number in one.split(" to ")]
                found |= {(page, address) for address in range(begin, (rest or [begin])[0] + 1)}
    return found


class MemoryCase(Case):
    def emulator(self, *arguments, **settings):
        emulator = Emulator(self.directory, "--memory", self.file("memory"), *arguments, **settings)
        self.addCleanup(emulator.end)
        return emulator

    def encoder(self, *arguments, latency=300):
        """Returns the address of a new emulator, with a latency that allows for a busy machine."""
        return f"tformat:{self.emulator(*arguments).path}?latency={latency}"

    def stored(self):
        """Returns the bytes in the file in which the emulator saves its memory."""
        with open(self.file("memory"), encoding="ascii") as file:
            lines = file.read().splitlines()[4:]
        data = bytes.fromhex("".join(line.split(": ")[1] for line in lines))
        return {(page, address): data[page * ADDRESSES + address] for page, address in EMPTY}

    def dump(self, address):
        result = absenc("memory", "dump", address)
        self.assert_good(result)
        return parse(result.stdout)

    def partial(self, image):
        """Writes a dump of these bytes alone, and returns its path."""
        lines = [f"page {page} address {address}: {value:02x}\n" for (page, address), value in image.items()]
        return self.file("partial.dump", HEADER + "".join(lines) + "checksum: edited\n")


class Bytes(MemoryCase):
    def test_write_and_read(self):
        address = self.encoder()
        result = absenc("memory", "write", address, "0x0E", "0x41", "66", "0x43", "--page", "2", "--yes")
        self.assert_good(result)
        self.assertIn("page 2 address 0x0E  00 00 00  41 42 43\n", result.stdout)
        self.assertIn("3 bytes written and read back", result.stdout)
        self.assertIn("3 of 3 bytes differ; each byte takes one of 100000 writes in total", result.stderr)
        result = absenc("memory", "read", address, "0", "--page", "2", "--count", "18")
        self.assertEqual(result.stdout, "0x00  " + "00 " * 14 + "41 42  ..............AB\n0x10  43 00" + " " * 44 + "C.\n")
        answer = json.loads(absenc("memory", "read", address, "14", "--page", "2", "--count", "3", "--json").stdout)
        self.assertEqual(answer, {"ok": True, "page": 2, "address": 14, "data": "414243"})

    def test_writes_only_changed_bytes(self):
        address = self.encoder()
        self.assert_good(absenc("memory", "write", address, "5", "1", "2", "--yes"))
        result = absenc("memory", "write", address, "5", "1", "3", "--yes", "--json")
        self.assertEqual(json.loads(result.stdout),
                         {"ok": True, "compared": 2, "written": [{"page": 0, "address": 6, "count": 1}],
                          "differences": [{"page": 0, "address": 6, "encoder": 2, "wanted": 3}],
                          "change": "confirmed"})
        result = absenc("memory", "write", address, "5", "1", "3", "--yes")
        self.assertEqual((result.stdout, result.stderr), ("all 2 bytes are so already: nothing to write\n", ""))

    def test_dry_run(self):
        address = self.encoder()
        result = absenc("memory", "write", address, "5", "1", "--dry-run")
        self.assert_good(result)
        self.assertIn("page 0 address 0x05  00       01\n", result.stdout)
        self.assertNotIn("written", result.stdout)
        self.assertEqual(self.dump(address), EMPTY)

    def test_reads_across_two_areas(self):
        self.assertEqual(absenc("memory", "read", self.encoder(), "4", "--page", "7", "--count", "2").stdout,
                         "0x04  DA 23  .#\n")

    def test_refuses_wrong_usage(self):
        emulator = self.emulator()
        encoder = f"tformat:{emulator.path}"
        for arguments, words in [(["read", encoder, "127"], ["no page 0 address 0x7F", "page 0 to 5: 0x00 to 0x7E"]),
                                 (["read", encoder, "120", "--count", "8"], ["address 0x7F"]),
                                 (["read", encoder, "0", "--page", "6"], ["no page 6", "page 7: 0x04 to 0x05"]),
                                 (["read", encoder, "ten"], ["address", '"ten"']),
                                 (["read", encoder, "0", "--count", "0"], ["--count", "from 1"]),
                                 (["write", encoder, "5", "--page", "7", "1", "--yes"], ["temperature", "only be read"]),
                                 (["write", encoder, "0", "256", "--yes"], ['"256"', "0 to 255"]),
                                 (["write", encoder, "0", "1", "x", "--yes"], ['"x"']),
                                 (["write", encoder, "126", "1", "2", "--yes"], ["address 0x7F"]),
                                 (["write", encoder, "0"], ["<values> is missing"]),
                                 (["write", encoder, "0", "1"], ["nobody is there to be asked", "--yes"]),
                                 (["dump"], ["<encoder> is missing"]),
                                 (["load", encoder], ["<file> is missing"])]:
            with self.subTest(arguments):
                self.assert_wrong_usage(absenc("memory", *arguments), *words)
        self.assertIn("0 requests answered", emulator.end()[2])

    def test_failures_as_json(self):
        address = self.encoder("--fault", "silence=1", latency=0)
        for arguments in (["read", address, "0"], ["write", address, "0", "1", "--yes"]):
            result = absenc("memory", *arguments, "--json")
            self.assertEqual(result.returncode, 1)
            answer = json.loads(result.stdout)
            self.assertEqual((answer["ok"], answer["error"]), (False, "timeout"))

    def ask(self, address, answer):
        """Runs `memory write` on a terminal and gives `answer`. Returns the exit status and the text."""
        terminal, ours = pty.openpty()
        process = subprocess.Popen([ABSENC, "memory", "write", address, "5", "0x5A"], stdin=ours,
                                   stdout=subprocess.DEVNULL, stderr=ours)
        os.close(ours)
        shown = b""
        while b"[y/N] " not in shown:
            self.assertTrue(select.select([terminal], [], [], PATIENCE)[0], shown)
            shown += os.read(terminal, 1024)
        os.write(terminal, answer)
        try:
            while True:
                shown += os.read(terminal, 1024)
        # reading fails when the process has closed its end of the terminal, after all its output was read
        except OSError:
            os.close(terminal)
        return process.wait(PATIENCE), shown.decode()

    def test_question_and_progress(self):
        address = self.encoder()
        status, shown = self.ask(address, b"n\n")
        self.assertEqual(status, 1)
        self.assertIn("1 of 1 byte differs; each byte takes one of 100000 writes in total", shown)
        self.assertIn("nothing was changed", shown)
        self.assertEqual(self.dump(address), EMPTY)
        status, shown = self.ask(address, b"y\n")
        self.assertEqual(status, 0)
        for word in ("reading 1 of 1", "writing 1 of 1"):
            self.assertIn(word, shown)
        self.assertEqual(self.dump(address)[0, 5], 0x5A)

    def test_writes_nothing_without_standard_output(self):
        emulator = self.emulator()
        result = subprocess.run(["sh", "-c", '"$0" memory write "tformat:$1?latency=300" 5 1 --yes >&-', ABSENC,
                                 emulator.path], capture_output=True, text=True, timeout=PATIENCE, check=False)
        self.assert_failed(result, "standard output cannot be written", "nothing was written")
        self.assertEqual(self.stored(), EMPTY)


class Files(MemoryCase):
    def test_dump_and_load(self):
        address = self.encoder()
        result = absenc("memory", "dump", address, "--output", self.file("empty.dump"))
        self.assertEqual(result.stdout, f"762 bytes are in {self.file('empty.dump')}\n")
        with open(self.file("empty.dump"), encoding="ascii") as file:
            text = file.read()
        self.assertTrue(text.startswith(HEADER), text)
        self.assertEqual(parse(text), EMPTY)
        wanted = {(0, 0): 1, (0, 126): 2, (5, 126): 3, (3, 16): 0xFF, (3, 17): 0xFE}
        result = absenc("memory", "load", address, self.partial(wanted), "--yes")
        self.assert_good(result)
        self.assertIn("5 of 5 bytes differ", result.stderr)
        self.assertEqual(self.dump(address), EMPTY | wanted)
        self.assert_good(absenc("memory", "verify", address, self.file("partial.dump")))
        result = absenc("memory", "verify", address, self.file("empty.dump"))
        self.assertEqual(result.returncode, 1)
        self.assertIn("page 3 address 0x10  FF FE    00 00\n", result.stdout)
        self.assertIn("5 of 762 bytes differ\n", result.stdout)
        self.assert_good(absenc("memory", "load", address, self.file("empty.dump"), "--yes"))
        self.assertEqual(self.dump(address), EMPTY)

    def test_verify_as_json(self):
        address = self.encoder()
        result = absenc("memory", "verify", address, self.partial({(1, 2): 3, (1, 3): 0}), "--json")
        self.assertEqual(result.returncode, 1)
        self.assertEqual(json.loads(result.stdout),
                         {"ok": True, "same": False, "compared": 2,
                          "differences": [{"page": 1, "address": 2, "encoder": 0, "wanted": 3}]})

    def test_loaded_bytes_are_in_memory_file(self):
        emulator = self.emulator()
        wanted = {(page, address): 0x10 * page + address % 16 for page in (0, 5) for address in (7, 8, 99)}
        self.assert_good(absenc("memory", "load", f"tformat:{emulator.path}?latency=300", self.partial(wanted), "--yes"))
        emulator.end()
        self.assertEqual(self.stored(), EMPTY | wanted)

    def test_loads_threshold(self):
        address = self.encoder()
        self.assert_good(absenc("memory", "load", address, self.partial({(7, 4): 0x80 + 70}), "--yes"))
        self.assertIn("70 degC", absenc("config", "get", address).stdout)

    def test_refuses_truncated_dump(self):
        emulator = self.emulator()
        good = absenc("memory", "dump", "sim:tformat").stdout
        for size in (900, good.index("checksum"), good.index("checksum") - 1):
            path = self.file("cut.dump", good[:size])
            for verb, more in (("load", ["--yes"]), ("load", ["--dry-run"]), ("verify", [])):
                with self.subTest(size=size, verb=verb):
                    result = absenc("memory", verb, f"tformat:{emulator.path}", path, *more)
                    self.assert_failed(result, path, "has no checksum", "cut off", "checksum: edited", "--force")
                    self.assertEqual(result.stdout, "")
        self.assertIn("0 requests answered", emulator.end()[2])

    def test_force_accepts_truncated_dump(self):
        path = self.file("cut.dump", HEADER + "page 0 address 0x00: 00 00\n")
        for verb in ("load", "verify"):
            result = absenc("memory", verb, "sim:tformat", path, "--force")
            self.assert_good(result)
            self.assertIn(f"note: {path} has no checksum", result.stderr)
            self.assertIn("2 bytes of it", result.stderr)

    def test_refuses_invalid_files(self):
        emulator = self.emulator()
        good = absenc("memory", "dump", "sim:tformat").stdout
        self.file("memory file", "absenc memory 1\nprotocol: tformat\n")
        for text, words in [(good.replace("page 2 address 0x10: 00", "page 2 address 0x10: 01"),
                             ["line 53", "damaged, or edited", "checksum: edited"]),
                            (good.replace("TS5700N8500", "23-bit"), ["line 3", "model: 23-bit", "model: TS5700N8500"]),
                            (good.replace("tformat", "esl"), ["line 2", "protocol: esl", "protocol: tformat"]),
                            (good.replace("page 5 address 0x00: 00", "page 5 address 0x00: 0"), ["line 44", "hexadecimal"]),
                            (good.replace("page 5 address 0x00:", "page 4 address 0x00:"), ["line 44", "line 36"]),
                            (HEADER + "page 0 address 0x7F: 00\n", ["line 4", "no page 0 address 0x7F"]),
                            (HEADER + "page 7 address 0x05: 00\n", ["line 4", "temperature", "only be read"]),
                            (HEADER, ["no bytes"]), ("precious\n", ["no dump"]), ("", ["no dump"])]:
            with self.subTest(words):
                path = self.file("bad.dump", text)
                result = absenc("memory", "load", f"tformat:{emulator.path}", path, "--yes")
                self.assert_failed(result, path, *words)
                self.assertEqual(result.stdout, "")
        for path, words in [(self.file("memory file"), ["memory file of a virtual encoder", "emulate --memory"]),
                            (self.file("missing"), ["cannot be read", "No such file"]), (self.directory, ["directory"])]:
            with self.subTest(path):
                self.assert_failed(absenc("memory", "load", f"tformat:{emulator.path}", path, "--yes"), path, *words)
        self.assertIn("0 requests answered", emulator.end()[2])

    def test_refuses_endless_file(self):
        for verb in ("load", "verify"):
            self.assert_failed(absenc("memory", verb, "sim:tformat", "/dev/zero"), "/dev/zero", "16 MiB")

    def test_dump_is_no_memory_file(self):
        path = self.file("some.dump", absenc("memory", "dump", "sim:tformat").stdout)
        result = absenc("emulate", "tformat", "--memory", path, "--for", "60")
        self.assert_failed(result, path, "is a dump", "absenc memory load")

    def test_detects_other_model(self):
        emulator = self.emulator("--model", "23-bit")
        for arguments in (["dump"], ["load", self.partial({(0, 0): 1}), "--yes"], ["verify", self.partial({(0, 0): 1})]):
            arguments.insert(1, f"tformat:{emulator.path}?latency=300")
            self.assert_failed(absenc("memory", *arguments), "unexpected_reply", "set model=23-bit")
        self.assert_good(absenc("memory", "dump", f"tformat:{emulator.path}?latency=300&model=23-bit"))
        emulator.end()
        self.assertEqual(self.stored(), EMPTY)

    def test_refuses_unwritable_output(self):
        emulator = self.emulator()
        for path, words in [(self.file("nowhere/dump"), ["no directory"]), (self.directory, ["no regular file"]),
                            ("/dev/null", ["no regular file"])]:
            with self.subTest(path):
                result = absenc("memory", "dump", f"tformat:{emulator.path}", "--output", path)
                self.assert_failed(result, path, *words)
        self.assertIn("0 requests answered", emulator.end()[2])

    def test_failed_dump_keeps_old_file(self):
        path = self.file("old.dump", "old")
        result = absenc("memory", "dump", "sim:tformat?fault=silence=1", "--output", path)
        self.assert_failed(result, "timeout")
        with open(path, encoding="ascii") as file:
            self.assertEqual(file.read(), "old")
        os.symlink(path, self.file("link"))
        self.assert_good(absenc("memory", "dump", "sim:tformat", "--output", self.file("link")))
        self.assertTrue(os.path.islink(self.file("link")))
        with open(path, encoding="ascii") as file:
            self.assertEqual(parse(file.read()), EMPTY)


class Interruptions(MemoryCase):
    wanted = {(page, address): 1 + address for page in (0, 4) for address in range(30)}

    def progress_of(self, err):
        """Returns the addresses that an interrupted load calls written, unknown and not written."""
        listed = []
        for words in ("written and read back", "not known whether written", "not written"):
            found = re.search(rf"^  {words}: (.*)$", err, re.MULTILINE)
            listed.append(addresses(found.group(1)) if found else set())
        return listed

    def assert_progress_is_true(self, err, image):
        """Checks that the lists of the message are disjoint and agree with `image`. Returns them."""
        written, unknown, left = self.progress_of(err)
        self.assertEqual({at for at in written if image[at] != self.wanted[at]}, set(), err)
        self.assertEqual({at for at in left if image[at] == self.wanted[at]}, set(), err)
        self.assertFalse(written & left or written & unknown or unknown & left, err)
        return written, unknown, left

    def start(self, address):
        process = subprocess.Popen([ABSENC, "memory", "load", address, self.partial(self.wanted), "--yes"], bufsize=0,
                                   stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.addCleanup(lambda: end(process, signal.SIGKILL) if process.poll() is None else None)
        return process

    def wait_until_stored(self, count):
        deadline = time.monotonic() + PATIENCE
        while sum(value != 0 for value in self.stored().values()) < count:
            self.assertLess(time.monotonic(), deadline)
            select.select([], [], [], 0.003)

    def test_interrupted_load_reports_progress_and_can_continue(self):
        address = self.encoder()
        done = set()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGINT):
            before = len(done)
            process = self.start(address)
            self.wait_until_stored(before + 1)
            status, _, err = end(process, number)
            self.assertEqual(status, 1, err)
            self.assertTrue(err.split("\n")[1] == "absenc: interrupted", err)
            written, unknown, left = self.assert_progress_is_true(err, self.dump(address))
            self.assertEqual(unknown, set())
            self.assertEqual(done | written | left, set(self.wanted), err)
            self.assertTrue(written and left, err)
            self.assertFalse(written & done, "what was there already is not written again")
            self.assertIn("The same command again", err)
            done |= written
        result = absenc("memory", "load", address, self.file("partial.dump"), "--yes")
        self.assert_good(result)
        self.assertIn(f"{len(self.wanted) - len(done)} bytes written", result.stdout)
        self.assertEqual(self.dump(address), EMPTY | self.wanted)

    def test_interrupted_before_first_write(self):
        emulator = self.emulator("--fault", "silence=1")
        process = self.start(f"tformat:{emulator.path}?latency=60000")
        wait_for_handler(process)
        status, _, err = end(process, signal.SIGINT)
        self.assertEqual(status, 1)
        self.assertIn("nothing was written", err)

    def test_unplugged(self):
        emulator = self.emulator()
        process = self.start(f"tformat:{emulator.path}?latency=300")
        self.wait_until_stored(1)
        emulator.end()
        _, err = process.communicate(timeout=PATIENCE)
        err = err.decode()
        self.assertEqual(process.returncode, 1)
        self.assertIn("went away", err)
        written, unknown, left = self.assert_progress_is_true(err, self.stored())
        self.assertEqual(written | unknown | left, set(self.wanted))
        self.assertEqual(len(unknown), 1)
        again = self.encoder()
        self.assert_good(absenc("memory", "load", again, self.file("partial.dump"), "--yes"))
        self.assertEqual(self.dump(again), EMPTY | self.wanted)

    def test_killed_emulator(self):
        emulator = self.emulator()
        process = self.start(f"tformat:{emulator.path}?latency=300")
        self.wait_until_stored(1)
        emulator.kill()
        _, err = process.communicate(timeout=PATIENCE)
        self.assertEqual(process.returncode, 1)
        written, unknown, left = self.progress_of(err.decode())
        self.assertEqual(written | unknown | left, set(self.wanted), err)
        again = self.encoder()
        self.assert_good(absenc("memory", "load", again, self.file("partial.dump"), "--yes"))
        self.assertEqual(self.dump(again), EMPTY | self.wanted)

    def test_progress_as_json(self):
        emulator = self.emulator()
        process = subprocess.Popen([ABSENC, "memory", "load", f"tformat:{emulator.path}?latency=300",
                                    self.partial(self.wanted), "--yes", "--json"], bufsize=0, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)
        self.wait_until_stored(1)
        status, out, _ = end(process, signal.SIGINT)
        self.assertEqual(status, 1)
        answer = json.loads(out)
        counts = [sum(run["count"] for run in answer[name]) for name in ("written", "unknown", "not_written")]
        self.assertEqual((answer["ok"], answer["message"], sum(counts)), (False, "interrupted", len(self.wanted)))
        self.assertGreater(counts[0], 0)

    def test_load_over_bad_line(self):
        """A load over a bad line may fail, but repeated loads must succeed in the end."""
        emulator = self.emulator("--fault", "corrupt=0.25", "--fault", "drop=0.25", "--seed", "3")
        address = f"tformat:{emulator.path}?latency=30"
        self.wanted = {(2, at): 0xA0 + at for at in range(40, 52)}
        failures = 0
        deadline = time.monotonic() + PATIENCE
        while True:
            result = absenc("memory", "load", address, self.partial(self.wanted), "--yes")
            if result.returncode == 0:
                break
            failures += 1
            self.assertLess(time.monotonic(), deadline, result.stderr)
            written, unknown, left = self.progress_of(result.stderr)
            self.assertLessEqual(written | unknown | left, set(self.wanted))
            self.assertFalse(written & left or written & unknown or unknown & left, result.stderr)
        self.assertGreater(failures, 0, "the line was not bad enough to test anything")
        emulator.end()
        self.assertEqual(self.stored(), EMPTY | self.wanted)


class Config(MemoryCase):
    def test_get(self):
        address = self.encoder()
        for arguments in ([], ["overheat-threshold"]):
            result = absenc("config", "get", address, *arguments)
            self.assert_good(result)
            self.assertRegex(result.stdout, r"overheat-threshold +overheat_enabled +yes +whether")
            self.assertRegex(result.stdout, r"overheat_threshold_c +90 degC")
            self.assertEqual(json.loads(absenc("config", "get", address, *arguments, "--json").stdout),
                             {"ok": True, "settings": {"overheat-threshold": {"overheat_enabled": True,
                                                                              "overheat_threshold_c": 90}}})

    def test_set(self):
        address = self.encoder()
        result = absenc("config", "set", address, "overheat-threshold", "80", "--yes")
        self.assert_good(result)
        self.assertRegex(result.stdout, r"overheat_threshold_c +90 degC +80 degC\n")
        result = absenc("config", "set", address, "overheat-threshold", "0", "--yes", "--json")
        self.assertEqual(json.loads(result.stdout),
                         {"ok": True, "setting": "overheat-threshold",
                          "old": {"overheat_enabled": True, "overheat_threshold_c": 80}, "new": {"overheat_enabled": False},
                          "change": "confirmed"})
        self.assertEqual(absenc("memory", "read", address, "4", "--page", "7").stdout, "0x04  00  .\n")

    def test_refuses_threshold_of_zero_degrees(self):
        """`memory write` must refuse 0 degC, as `config set` does."""
        address = self.encoder()
        refused = absenc("memory", "write", address, "4", "0x80", "--page", "7", "--yes")
        self.assertEqual(refused.returncode, 1)
        for words in ("invalid_argument", "0 degC", "0x81 to 0xFF", "0x00 for off", "nothing was written"):
            self.assertIn(words, refused.stderr)
        self.assertEqual(absenc("memory", "read", address, "4", "--page", "7").stdout, "0x04  DA  .\n")
        for byte in ("0x81", "0x00"):
            self.assert_good(absenc("memory", "write", address, "4", byte, "--page", "7", "--yes"))

    def test_refuses_wrong_usage(self):
        emulator = self.emulator()
        encoder = f"tformat:{emulator.path}"
        for arguments, words in [(["get", encoder, "overheat"], ['"overheat"', "did you mean overheat-threshold?"]),
                                 (["set", encoder, "overheat_treshold", "1"], ["did you mean overheat-threshold?"]),
                                 (["set", encoder, "overheat-threshold"], ["<values> is missing"]),
                                 (["set", encoder, "overheat-threshold", "128", "--yes"], ["0 to 127", '"128"']),
                                 (["set", encoder, "overheat-threshold", "80", "90", "--yes"], ['"90" is too much']),
                                 (["set", encoder, "overheat-threshold", "80"], ["nobody is there", "--yes"])]:
            with self.subTest(arguments):
                self.assert_wrong_usage(absenc("config", *arguments), *words)
        self.assertIn("0 requests answered", emulator.end()[2])

    def test_failure(self):
        address = self.encoder("--fault", "silence=1", latency=0)
        self.assert_failed(absenc("config", "get", address), "timeout")
        answer = json.loads(absenc("config", "set", address, "overheat-threshold", "80", "--yes", "--json").stdout)
        self.assertEqual((answer["ok"], answer["error"]), (False, "timeout"))


if __name__ == "__main__":
    unittest.main()
