# SPDX-License-Identifier: Apache-2.0
"""Tests BiSS with the absenc command."""
import bisect
import json
import os
import random
import subprocess
import tempfile
import unittest

from command_support import Case, absenc, json_lines
from command_test import option_arguments

FORMS = {"biss", "biss-safety", "biss-chain", "biss-control", "biss-control-request"}


def vectors():
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "vectors2.json"), encoding="utf-8") as file:
        return [vector for vector in json.load(file)["vectors"] if vector["protocol"] in FORMS]


def decode(unit, *arguments):
    return json.loads(absenc("decode", unit, "--json", *arguments).stdout)


def numbers(text):
    return [int(number) for number in text.split()]


class Vectors(Case):
    """Compares every BiSS vector with the output of `decode`."""

    def check(self, vector, answer, fields):
        if "error" in vector:
            self.assertEqual((answer["ok"], answer.get("error")), (False, vector["error"]), vector["id"])
            return
        self.assertTrue(answer["ok"], (vector["id"], answer))
        for name, value in fields.items():
            self.assertEqual(answer["fields"].get(name), value, (vector["id"], name))

    def check_word(self, vector):
        options = dict(vector["options"])
        options.pop("configuration", None)
        if vector["protocol"] == "biss-chain":
            options = {"slaves": len(options["channels"])}
            for index, channel in enumerate(vector["options"]["channels"]):
                options |= {f"channel{index}_{name}": value for name, value in channel.items()}
        arguments = option_arguments(options)
        fields = {}
        for name, value in vector.get("fields", {}).items():
            if isinstance(value, dict):
                fields |= {f"{name}_{inner}": one for inner, one in value.items()}
            elif name == "channels":
                for index, channel in enumerate(value):
                    fields |= {f"channel{index}_{inner}": one for inner, one in channel.items()}
            else:
                fields[name] = value
        self.check(vector, decode(vector["protocol"], "--hex", vector["response"], *arguments), fields)

    def check_control(self, vector):
        arguments = ["--request", vector["cdm"]]
        if "cds" in vector:
            arguments += ["--hex", vector["cds"]]
        fields = dict(vector.get("fields", {}))
        answer = decode("biss", *arguments)
        if "data" in fields:
            self.assertEqual(bytes.fromhex(answer["fields"]["data"]), bytes(fields.pop("data")), vector["id"])
        for name in ("start_delay", "slave_ids", "acknowledged"):
            if name in fields:
                self.assertEqual(numbers(answer["fields"].get(name, "")), fields.pop(name), (vector["id"], name))
        self.check(vector, answer, fields)

    def test_decodes_all_vectors(self):
        seen = set()
        for vector in vectors():
            with self.subTest(vector["id"]):
                seen.add(vector["protocol"])
                if "cdm" in vector:
                    self.check_control(vector)
                else:
                    self.check_word(vector)
        self.assertEqual(seen, FORMS)


def crc6(bits):
    """Returns the inverted CRC of the polynomial x^6 + x + 1."""
    rest = 0
    for bit in bits + "000000":
        rest = rest << 1 | int(bit)
        rest ^= 0x43 if rest & 0x40 else 0
    return f"{rest ^ 0x3F:06b}"


class LongChains(Case):
    def test_decodes_eight_words(self):
        places = [(12 + index, 0x5A5A5A * (index + 1) % (1 << 12 + index)) for index in range(8)]
        words = [f"{place:0{bits}b}" + ("10" if bits == 14 else "11") for bits, place in places]
        frame = "11000010" + "".join(word + crc6(word) for word in words)
        options = {"slaves": 8, "slave": 2} | {f"channel{i}_singleturn_bits": bits for i, (bits, _) in enumerate(places)}
        answer = decode("biss-chain", "--hex", frame, *option_arguments(options))
        self.assertTrue(answer["ok"], answer)
        fields = answer["fields"]
        for i, (bits, place) in enumerate(places):
            self.assertEqual((fields[f"channel{i}_singleturn"], fields[f"channel{i}_warning"]), (place, bits == 14))
        self.assertEqual(fields["singleturn"], places[5][1])
        damaged = decode("biss-chain", "--hex", frame[:-1] + str(1 - int(frame[-1])), *option_arguments(options))
        self.assertEqual(damaged["error"], "bad_checksum")


    def test_word_option_applies_to_every_slave(self):
        chain = "sim:biss-chain?slaves=5&word=skip:3 position:24 temperature=value:8 error:1! warning:1!"
        for slave in (0, 4):
            result = absenc("read", f"{chain}&slave={slave}&unit_um=0.05", "--json")
            self.assert_good(result)
            self.assertIn("position_um", json.loads(result.stdout))
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "chain.vcd")
            self.assert_good(absenc("wave", chain.removeprefix("sim:") + "&motion=rpm=600", path, "--count", "5"))
            rows = json_lines(absenc("decode", "biss-chain", path, "--option", "slaves=5", "--option",
                                     chain.split("&")[1], "--json").stdout)
        self.assertEqual([row["ok"] for row in rows], [True] * 5)
        for fields in (row["fields"] for row in rows):
            self.assertEqual({fields[f"channel{index}_singleturn"] for index in range(5)}, {fields["singleturn"]})
            self.assertIn("temperature", fields)
        beside = absenc("read", f"{chain}&channel0_singleturn_bits=12")
        self.assertEqual(beside.returncode, 2)


class Registers(Case):
    def info(self, encoder):
        result = absenc("info", encoder, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        return json_lines(result.stdout)[0]["answers"]["info"]["fields"]

    def test_reads_and_writes_register(self):
        info = self.info("sim:biss")
        self.assertEqual(info["serial_number"], 1)
        self.assertEqual(info["slaves"], 1)
        self.assertEqual(bytes.fromhex(info["device_id"]), b"Absenc")
        bank = absenc("memory", "read", "sim:biss", "0", "--json")
        self.assertEqual((bank.returncode, bank.stderr), (0, ""))
        written = absenc("memory", "write", "sim:biss", "3", "0x5A", "--yes", "--json")
        self.assertEqual(written.returncode, 0, written.stderr)

    def test_unused_slave_id_is_reported(self):
        result = absenc("memory", "read", "sim:biss?slave=3", "0")
        self.assertEqual(result.returncode, 1)
        self.assertIn("no encoder answers", result.stderr)

    def test_each_encoder_of_chain_has_own_registers(self):
        for slave in (0, 1, 2):
            info = self.info(f"sim:biss-chain?slaves=3&slave={slave}")
            self.assertEqual((info["slave_id"], info["serial_number"], info["slaves"]), (slave, slave + 1, 3))

    def test_reads_emulates_and_decodes_eight_encoders(self):
        """A BiSS frame carries data of eight encoders at most."""
        bits = {index: 12 + index for index in range(8)}
        chain = "slaves=8&" + "&".join(f"channel{index}_singleturn_bits={count}" for index, count in bits.items())
        for slave in (0, 4, 7):
            info = self.info(f"sim:biss-chain?{chain}&slave={slave}")
            self.assertEqual((info["slave_id"], info["serial_number"], info["slaves"]), (slave, slave + 1, 8))
            read = json.loads(absenc("read", f"sim:biss-chain?{chain}&slave={slave}", "--json").stdout)
            self.assertEqual(read["singleturn_bits"], bits[7 - slave])
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "chain.vcd")
            self.assert_good(absenc("wave", f"biss-chain?{chain}&motion=rpm=600", path,
                                    "--command", "memory-read 68 0 4"))
            options = [word for option in chain.split("&") for word in ("--option", option)]
            rows = json_lines(absenc("decode", "biss-chain", path, *options, "--json").stdout)
        words = [row["fields"] for row in rows if row["kind"] == "reply"]
        self.assertGreater(len(words), 20)
        for word in words:
            places = [word[f"channel{index}_singleturn"] / 2 ** count for index, count in bits.items()]
            self.assertTrue(all(abs(place - places[-1]) <= 2 ** -12 for place in places), places)
        asked = [row["fields"] for row in rows if row["kind"] == "exchange"]
        self.assertEqual([(one["slaves"], one["data"]) for one in asked], [(8, "00000001")])

    def test_safety_encoder_has_registers(self):
        self.assertEqual(self.info("sim:biss-safety")["slaves"], 2)

    def test_capture_shows_register_access_beside_positions(self):
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "drive.vcd")
            result = absenc("wave", "biss?motion=rpm=600", path, "--command", "memory-read 68 0 4",
                            "--command", "memory-write 3 0x5A 0 0")
            self.assertEqual(result.returncode, 0, result.stderr)
            rows = json_lines(absenc("decode", "biss", path, "--json").stdout)
        control = [row["fields"] for row in rows if row["kind"] == "exchange"]
        positions = [row for row in rows if row["kind"] == "reply"]
        self.assertTrue(all(row["ok"] for row in rows if "ok" in row))
        self.assertGreater(len(positions), 200)
        times = [row["time_s"] for row in positions]
        self.assertTrue(all(after - before < 100e-6 for before, after in zip(times, times[1:])))
        self.assertEqual(bytes.fromhex(control[0]["data"]), bytes([0, 0, 0, 1]))
        written = [one for one in control if one["operation"] == "write"]
        self.assertEqual([(one["address"], one["data"]) for one in written], [(3, "5a")])
        self.assertEqual((control[-1]["operation"], control[-1]["address"], control[-1]["data"]), ("read", 3, "5a"))


    def test_sigrok_decodes_same_positions(self):
        """sigrok's SPI decoder reads the same bits."""
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "drive.vcd")
            self.assert_good(absenc("wave", "biss?motion=rpm=600", path, "--command", "memory-read 68 0 4"))
            rows = json_lines(absenc("decode", "biss", path, "--json").stdout)
            # sigrok-cli prints one bit with its time in each line. A frame ends where the clock pauses.
            seen = subprocess.run(["sigrok-cli", "-I", "vcd", "-i", path, "--protocol-decoder-samplenum", "-P",
                                   "spi:clk=clock:miso=data:cpol=1:cpha=1:wordsize=1", "-A", "spi=miso-data"],
                                  capture_output=True, text=True, timeout=60, check=True).stdout.splitlines()
        frames, before = [], 0
        for line in seen:
            at = int(line.split("-")[0])
            if at - before > 20_000:
                frames.append("")
            frames[-1] += line[-1]
            before = at
        positions = []
        for bits in frames:
            data = bits.index("1", bits.index("0")) + 2
            self.assertEqual(crc6(bits[data:data + 21]), bits[data + 21:data + 27])
            self.assertEqual(bits[data + 19:data + 21], "11")
            positions.append(int(bits[data:data + 19], 2))
        self.assertGreater(len(set(positions)), 50)
        self.assertEqual(positions, [row["fields"]["singleturn"] for row in rows if row["kind"] == "reply"])


class Settings(Case):
    def test_timeout_applies_to_host_and_encoder(self):
        for timeout in ("timeout_us=12.5", "timeout_us=40", "adaptive_timeout=true"):
            for unit in ("biss", "biss-safety", "biss-chain"):
                with self.subTest(timeout=timeout, unit=unit):
                    self.assert_good(absenc("read", f"sim:{unit}?{timeout}"))
        times = {}
        for timeout in ("timeout_us=0", "timeout_us=12.5", "adaptive_timeout=true&ma_khz=10000"):
            path = self.file(f"{len(times)}.vcd")
            self.assert_good(absenc("wave", f"biss?latency_us=1&{timeout}", path, "--count", "3", "--rate", "1000000"))
            rows = json_lines(absenc("decode", "biss", path, "--json").stdout)
            starts = [row["time_s"] for row in rows if "time_s" in row]
            times[timeout] = starts[1] - starts[0]
        at_40, at_12, adaptive = times.values()
        self.assertAlmostEqual(at_40 - at_12, 27.5e-6, 7)
        self.assertLess(adaptive, at_12 / 4)
        for wrong in ("12", "12.7", "41"):
            refused = absenc("read", f"sim:biss?timeout_us={wrong}")
            self.assertIn("0 or 12.5 to 40.0 in steps of 0.5", refused.stderr)

    def test_banks_up_to_255_are_pages(self):
        page = f"sim:biss?singleturn_bits=24"
        read = absenc("memory", "read", page, "0", "--page", "3", "--json")
        self.assertEqual(json.loads(read.stdout)["page"], 3)
        for bank in ("4", "255"):
            refused = absenc("memory", "read", page, "0", "--page", bank)
            self.assert_failed(refused, "request_rejected")
        self.assert_wrong_usage(absenc("memory", "read", page, "0", "--page", "256"), "page 1 to 255: 0x00 to 0x3F")
        self.assertIn("page 1 to 255: 0x00 to 0x3F", absenc("list", "biss").stdout)

    def test_models_with_24_turn_bits(self):
        for model, bits in (("RLM", 16), ("RLH", 24)):
            reading, = json_lines(absenc("read", f"sim:biss-safety?model={model}&multiturn=16777215", "--json").stdout)
            self.assertEqual((reading["multiturn"], reading["multiturn_bits"], reading["singleturn_bits"]),
                             (16777215, 24, bits))


def crc(bits, polynomial, width):
    """Returns the inverted CRC of a text of bits."""
    remainder = 0
    for bit in bits:
        top = (remainder >> (width - 1) & 1) != int(bit)
        remainder = (remainder << 1 & ((1 << width) - 1)) ^ (polynomial if top else 0)
    return format(remainder ^ ((1 << width) - 1), f"0{width}b")


def safety_words(position, counter):
    """Returns a position's control position word (CPW) and safety position word (SPW)."""
    cpw = format(position, "024b") + "11"
    spw = format(position >> 8, "016b") + "11" + format(counter, "06b")
    return cpw + crc(cpw, 0x03, 6) + spw + crc(spw, 0x90D9, 16)


def counted_word(position, counter):
    word = format(position, "019b") + "11" + format(counter, "06b")
    return word + crc(word, 0x03, 6)


def control_crc(bits):
    return crc(bits, 0x3, 4)


def register_frame(slave, address, data, write=False, delays=None):
    """Returns the CDM and CDS bits of a register access. `delays`: frames before each start bit."""
    delays = delays or [0] * len(data)
    header = "1" + format(slave, "03b") + format(address, "07b")
    cdm = "0" * 14 + "1" + header + control_crc(header) + ("011" if write else "101")
    cds = "0" * 15 + "1" * (slave + 1) + "0" * (8 - slave - 1) + "0" * 8 + ("01" if write else "10")
    for index, (byte, delay) in enumerate(zip(data, delays)):
        bits = format(byte, "08b") + control_crc(format(byte, "08b"))
        cdm += "1" * delay + (bits + "0" if write else "0" * 13) + ("1" if index + 1 < len(data) else "0")
        cds += "0" * delay + "1" + bits + "0"
    return cdm + "0" * 14, cds + "0" * 14


def command_frame(slaves, command):
    """Returns the CDM and CDS bits of a command."""
    header = "0" + "".join("1" if slaves >> i & 1 else "0" for i in range(8)) + format(command, "02b")
    there = max(slaves.bit_length(), 1)
    cdm = "0" * 14 + "1" + header + control_crc(header) + "1"
    cds = "0" * 15 + "1" * there + "0" * (8 - there) + "0" * 8
    if slaves:
        cdm += "0" * 7 + "1"
        cds += "".join("1" if slaves >> i & 1 else "0" for i in range(8))
    else:
        cdm += "1"
        cds += "0"
    size = max(len(cdm), len(cds)) + 14
    return cdm.ljust(size, "0"), cds.ljust(size, "0")


def plain_word(position):
    word = format(position, "019b") + "11"
    return word + crc(word, 0x03, 6)


def draw_frames(words, cdm="", cds=""):
    """Returns a VCD of position frames at 1 MHz, with one bit of `cdm` and `cds` per frame."""
    lines = ["$timescale 1 ns $end", "$var wire 1 c clock $end", "$var wire 1 d data $end", "$enddefinitions $end",
             "#0", "1c", "1d"]
    now = 100_000
    for index, word in enumerate(words):
        samples = "11" + "0000" + "1" + (cds[index] if cds else "0") + word + "0"
        for sample in samples[1:]:
            lines += [f"#{now}", "0c", f"#{now + 500}", "1c", f"#{now + 510}", f"{sample}d"]
            now += 1000
        held = cdm[index:index + 1] == "1"
        lines += [f"#{now}", "0c"] if held else []
        lines += [f"#{now + 19_500}", "1d"]
        lines += [f"#{now + 99_500}", "1c"] if held else []
        now += 100_000
    return "\n".join([*lines, f"#{now}", ""])


def wires_of(path):
    """Returns the changes of clock and data in a VCD, each as (time in nanoseconds, level)."""
    wires = {'!': [], '"': []}
    now = 0
    with open(path, encoding="utf-8") as file:
        for line in file.read().split("$enddefinitions $end\n")[1].splitlines():
            if line.startswith("#"):
                now = int(line[1:])
            else:
                wires[line[1]].append((now, line[0]))
    return wires['!'], wires['"']


def level_at(wire, time):
    """Returns the level of a wire just before the time `time` in nanoseconds."""
    return wire[bisect.bisect_left(wire, (time, "")) - 1][1]


def read_frames(path):
    """Returns position, CDM and CDS of each frame in a VCD."""
    clock, data = wires_of(path)
    ends = [at for at, level in data[1:] if level == "1"]
    edges = [at for at, level in clock[1:] if level == "1"]
    frames, samples = [], ""
    for edge, following in zip(edges, edges[1:] + [clock[-1][0] + 10**9]):
        samples += level_at(data, edge)
        falls = clock[bisect.bisect_right(clock, (edge, "1"))][0] if edge < clock[-1][0] else 10**12
        end = next((at for at in ends[bisect.bisect_right(ends, edge + 1000):][:1] if at < following), None)
        if end is None or (falls < end and level_at(clock, end) == "1"):
            continue
        head = samples.find("1", samples.find("0"))
        if samples.startswith("1") and head > 0:
            word = samples[head + 2:head + 29]
            assert crc(word[:21], 0x03, 6) == word[21:], samples
            frames.append((int(word[:19], 2), "1" if level_at(clock, end) == "0" else "0", samples[head + 1]))
        samples = ""
    return frames


def registers_in(frames):
    """Returns the register accesses in position frames: (slave, address, bytes, whether written)."""
    cdm, cds = ("".join(frame[which] for frame in frames) for which in (1, 2))
    found, at = [], cdm.find("0" * 14 + "1")
    while at >= 0:
        at += 14
        assert cdm[at + 1] == "1" and control_crc(cdm[at + 1:at + 12]) == cdm[at + 12:at + 16], cdm[at:]
        slave, address = int(cdm[at + 2:at + 5], 2), int(cdm[at + 5:at + 12], 2)
        assert cds[at + 1:at + 9] == "1" + "0" * 7, cds[at:]
        write = cdm[at + 16:at + 19] == "011"
        assert cds[at + 17:at + 19] == cdm[at + 16:at + 18], cds[at:]
        values, start = [], at + 19
        while True:
            start = cds.index("1", start)
            byte = cds[start + 1:start + 9]
            assert control_crc(byte) == cds[start + 9:start + 13], cds[start:]
            assert not write or cdm[start:start + 12] == cds[start + 1:start + 13], cdm[start:]
            values.append(int(byte, 2))
            if cdm[start + 13] == "0":
                break
            start += 14
        found.append((slave, address, values, write))
        at = cdm.find("0" * 14 + "1", start)
    return found


class LifeCounter(Case):
    def errors(self, unit, words):
        options = {"biss": ["--option", "life_counter=true"], "biss-safety": []}[unit]
        path = self.file("frames.vcd", draw_frames(words))
        return [row.get("error") for row in json_lines(absenc("decode", unit, path, "--json", *options).stdout)]

    def test_capture_reports_stuck_or_jumping_life_counter(self):
        wrong = "sequence_mismatch"
        for unit, word in (("biss", counted_word), ("biss-safety", safety_words)):
            with self.subTest(unit):
                def of(counters):
                    return [word(1000 + 300 * i, counter) for i, counter in enumerate(counters)]
                self.assertEqual(self.errors(unit, of([62, 63, 0, 1])), [None] * 4)
                self.assertEqual(self.errors(unit, of([7] * 24)), [None] + [wrong] * 23)
                self.assertEqual(self.errors(unit, of([1, 2, 5, 6, 6, 7])), [None, None, wrong, None, wrong, None])
                # The frame after a damaged one may have any life counter except that of the last good frame.
                damaged = of([1, 2, 3, 5])
                damaged[2] = damaged[2][:3] + ("0" if damaged[2][3] == "1" else "1") + damaged[2][4:]
                self.assertEqual(self.errors(unit, damaged), [None, None, "bad_checksum", None])

    def test_reports_different_positions_in_both_words(self):
        words = [safety_words(5000, 1), safety_words(5000, 2)]
        other = safety_words(5000 + (3 << 11), 2)
        mixed = words[1][:32] + other[32:]
        self.assertEqual(self.errors("biss-safety", words), [None, None])
        self.assertEqual(self.errors("biss-safety", [words[0], mixed]), [None, "cross_check_failed"])


class Waveforms(Case):
    def changes(self, encoder):
        path = self.file("wires.vcd")
        self.assert_good(absenc("wave", encoder, path, "--force"))
        return wires_of(path)

    def test_draws_timeout_and_monoflop(self):
        for encoder, low in (("biss", 20_000), ("biss?timeout_us=12.5", 12_500), ("biss?timeout_us=40", 40_000),
                             ("biss?adaptive_timeout=true", 1500), ("biss?adaptive_timeout=true&ma_khz=100", 15_000),
                             ("biss-chain?slaves=8", 20_000), ("biss-safety", 20_000),
                             ("ssi", 500_000), ("ssi?monoflop_us=9", 9000), ("ssi?monoflop_us=41", 41_000)):
            with self.subTest(encoder):
                clock, data = self.changes(encoder)
                last_edge = clock[-1][0]
                self.assertEqual((clock[-1][1], data[-1]), ("1", (last_edge + low, "1")))

    def test_slo_is_low_after_crc(self):
        """SLO must be low after the CRC until the timeout."""
        path = self.file("wires.vcd")
        self.assert_good(absenc("wave", "biss?line_delay_ns=4300&singleturn=275087", path))
        rows = json_lines(absenc("decode", "biss", path, "--json").stdout)
        for row in rows[1:]:
            samples = row["reply"].replace(" ", "")
            self.assertEqual((samples[:45].rstrip("0"), set(samples[45:])),
                             ("111111" + "0" * 10 + "10" + plain_word(275087).rstrip("0"), {"0"}), row)
            self.assertGreater(len(samples), 100)

    def test_each_slave_of_chain_uses_one_clock(self):
        for slaves in (1, 2, 8):
            answer, = json_lines(absenc("read", f"sim:biss-chain?slaves={slaves}", "--json").stdout)
            self.assertTrue(answer["singleturn_valid"])
            path = self.file(f"{slaves}.vcd")
            self.assert_good(absenc("wave", f"biss-chain?slaves={slaves}", path))
            row, = json_lines(absenc("decode", "biss-chain", path, "--option", f"slaves={slaves}", "--json").stdout)
            self.assertEqual(row["fields"]["ack_bits"], 10 + slaves - 1)


class StartSequence(Case):
    def test_starts_encoder_that_waits_for_start(self):
        for encoder in ("sim:biss?start_sequence=true", "sim:biss-safety?start_sequence=true",
                        "sim:biss-chain?slaves=8&start_sequence=true"):
            with self.subTest(encoder):
                self.assert_good(absenc("read", encoder, "--count", "3", "--json"))
                self.assert_good(absenc("config", "get", encoder, "serial-number"))

    def test_capture_shows_two_pulses_before_frames(self):
        with tempfile.TemporaryDirectory() as directory:
            path = os.path.join(directory, "start.vcd")
            self.assert_good(absenc("wave", "biss?start_sequence=true", path, "--count", "2"))
            rows = json_lines(absenc("decode", "biss", path, "--json").stdout)
        self.assertEqual([(len(row["reply"]), row["ok"]) for row in rows],
                         [(41, False), (2, False), (41, True), (41, True)])
        # The clock rests for 40 us between two frames; another 0.5 us, half a clock period, pass from the first clock
        # edge of a frame to its first sample.
        for before, after in zip(rows[:2], rows[1:]):
            self.assertAlmostEqual(after["time_s"] - before["end_s"], 40.5e-6, delta=0.1e-6)


class ChangedRegisters(Case):
    def test_loads_and_verifies_dump(self):
        with tempfile.TemporaryDirectory(prefix="absenc-test-") as folder:
            dump = os.path.join(folder, "bank.dump")
            self.assert_good(absenc("memory", "dump", "sim:biss", "--output", dump))
            self.assert_good(absenc("memory", "load", "sim:biss", dump, "--yes"))
            self.assert_good(absenc("memory", "verify", "sim:biss", dump))
            with open(dump, encoding="ascii") as file:
                lines = file.read().splitlines()
            edited = [line.replace(": 00", ": 5a") if line.startswith("page 0 address 0x00") else line for line in lines]
            with open(dump, "w", encoding="ascii") as file:
                file.write("\n".join([*edited[:-1], "checksum: edited", ""]))
            verified = absenc("memory", "verify", "sim:biss", dump)
            self.assertEqual(verified.returncode, 1)
            self.assertIn("1 of 64 bytes differ", verified.stdout)
            loaded = absenc("memory", "load", "sim:biss", dump, "--yes")
            self.assert_good(loaded)
            self.assertIn("1 byte written and read back", loaded.stdout)

    def test_bank_is_a_setting(self):
        answer = json.loads(absenc("config", "set", "sim:biss", "bank", "2", "--yes", "--json").stdout)
        self.assertEqual((answer["old"]["bank"], answer["new"]["bank"]), (0, 2))

    def test_named_registers_are_settings(self):
        for chain, slave in (("sim:biss", 0), ("sim:biss-chain?slaves=3&slave=2", 2), ("sim:biss-safety?slave=1", 1)):
            result = absenc("config", "get", chain, "--json")
            self.assert_good(result)
            settings = json.loads(result.stdout)["settings"]
            self.assertEqual({name: fields[name.replace("-", "_")] for name, fields in settings.items()},
                             {"bank": 0, "eds-bank": 0, "profile": 0, "serial-number": slave + 1,
                              "device-id": b"Absenc".hex(), "manufacturer": "ve"})
            self.assertEqual({fields["slave_id"] for fields in settings.values()}, {slave})

    def test_identity_registers_are_read_only(self):
        for name in ("eds-bank", "profile", "serial-number", "device-id", "manufacturer"):
            refused = absenc("config", "set", "sim:biss", name, "1", "--yes")
            self.assert_wrong_usage(refused, f"{name} of biss can only be read")

    def test_info_shows_each_register_once(self):
        shown = absenc("info", "sim:biss", "--all").stdout
        for name in ("serial_number", "eds_bank", "device_id", "manufacturer", "profile"):
            self.assertEqual(shown.count(f"  {name} "), 1, shown)
        self.assertNotIn("serial-number", shown)
        self.assertIn("\n  bank ", shown)
        silent = absenc("info", "sim:biss?slave=3", "--all")
        self.assertEqual((silent.returncode, silent.stdout.count("FAILED")), (1, 2), silent.stdout)
        self.assertIn("say slave=N", silent.stderr)

    def test_command_is_acknowledged(self):
        answer = json.loads(absenc("run", "sim:biss", "control-command", "1", "0", "--yes", "--json").stdout)
        self.assertEqual((answer["fields"]["acknowledged"], answer["fields"]["executed"]), ("0", True), answer)



class Requests(Case):
    def test_encodes_and_decodes_control_request(self):
        for unit in ("biss", "biss-safety", "biss-chain"):
            cdm = absenc("encode", unit, "memory-write", "5", "0x42").stdout.strip()
            self.assertEqual(set(cdm), {"0", "1", " "})
            asked = json.loads(absenc("decode", unit, "--request", cdm, "--json").stdout)["fields"]
            self.assertEqual((asked["operation"], asked["address"], asked["data"]), ("write", 5, "42"))


class ControlFrames(Case):
    """Compares control frames of the absenc command with frames made from the document alone."""

    def control(self, cdm, cds):
        return decode("biss", "--request", cdm, "--hex", cds)

    def test_encodes_documented_request(self):
        for slave, address, value in ((0, 5, 0x42), (7, 127, 0xFF), (3, 64, 0)):
            unit = ["biss", "--option", f"slave={slave}"]
            written, _ = register_frame(slave, address, [value], write=True)
            force = ["0", "1"]
            self.assertEqual(absenc("encode", unit[0], "memory-write", str(address), hex(value), *force, *unit[1:])
                             .stdout.replace(" ", "").strip(), written)
            for count in (1, 2, 64 if address < 64 else 1):
                if address + count > 128:
                    continue
                read, _ = register_frame(slave, address, [0] * count)
                reported = absenc("encode", unit[0], "memory-read", str(address), "0", str(count), *unit[1:]).stdout
                self.assertEqual(reported.replace(" ", "").strip(), read, (slave, address, count))

    def test_decodes_documented_reply(self):
        chosen = random.Random(7)
        for _ in range(60):
            count = chosen.choice((1, 1, 2, 5, 64))
            slave, address = chosen.randrange(8), chosen.randrange(128 - count)
            data = bytes(chosen.randrange(256) for _ in range(count))
            write = chosen.random() < 0.5
            delays = [chosen.choice((0, 0, 1, 9)) for _ in data]
            if write:
                delays = [0] * count
            answer = self.control(*register_frame(slave, address, data, write, delays))
            self.assertTrue(answer["ok"], answer)
            fields = answer["fields"]
            self.assertEqual((fields["operation"], fields["slave_id"], fields["address"], fields["data"]),
                             ("write" if write else "read", slave, address, data.hex()))
            # the field start_delay lists the delays before the data bytes: all of them, or at least the first 48 of
            # more
            reported = numbers(fields["start_delay"])
            self.assertEqual(reported, delays[:max(48, len(reported))])
            self.assertTrue(fields["next_address_accepted"])
        for slaves, command in ((0, 0), (0, 1), (1, 0), (0b101, 1), (0xFF, 3)):
            fields = self.control(*command_frame(slaves, command))["fields"]
            self.assertEqual((fields["operation"], fields["command"], fields["broadcast"], fields["executed"]),
                             ("command", command, slaves == 0, True))
            self.assertEqual(numbers(fields.get("acknowledged", "")), [i for i in range(8) if slaves >> i & 1])

    def test_wave_draws_documented_control_frames(self):
        for settings in ("", "&timeout_us=12.5", "&timeout_us=40&ma_khz=250", "&adaptive_timeout=true",
                         "&adaptive_timeout=true&ma_khz=100", "&register_delay_us=700"):
            with self.subTest(settings):
                path = self.file("drawn.vcd")
                self.assert_good(absenc("wave", f"biss?motion=rpm=600{settings}", path, "--force",
                                        "--command", "memory-read 68 0 4", "--command", "memory-write 3 0x5A 0 0"))
                frames = read_frames(path)
                rows = json_lines(absenc("decode", "biss", path, "--json").stdout)
                self.assertEqual([frame[0] for frame in frames],
                                 [row["fields"]["singleturn"] for row in rows if row["kind"] == "reply"])
                self.assertGreater(len({frame[0] for frame in frames}), 100)
                read, *written = registers_in(frames)
                self.assertEqual(read, (0, 68, [0, 0, 0, 1], False))
                self.assertIn((0, 3, [0x5A], True), written)
                self.assertEqual(written[-1], (0, 3, [0x5A], False))

    def test_capture_shows_control_frames_beside_positions(self):
        cdm, cds = register_frame(0, 68, [1, 2, 0xFE], delays=[0, 4, 0])
        path = self.file("control.vcd", draw_frames([plain_word(100 + i) for i in range(len(cdm))], cdm, cds))
        rows = json_lines(absenc("decode", "biss", path, "--json").stdout)
        self.assertEqual([row["fields"]["singleturn"] for row in rows if row["kind"] == "reply"],
                         list(range(100, 100 + len(cdm))))
        control, = [row for row in rows if row["kind"] == "exchange"]
        self.assertEqual((control["ok"], control["fields"]["address"], control["fields"]["data"]), (True, 68, "0102fe"))


if __name__ == "__main__":
    unittest.main()
