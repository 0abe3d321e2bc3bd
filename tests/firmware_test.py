#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs the programs of firmware/ on machines emulated by QEMU."""
import copy
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import unittest

from command_support import Emulator, absenc, end, read_line

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "firmware"))
import call_graph  # noqa: E402: the module is in the same folder as figures
import figures  # noqa: E402: the module is in the folder of the programs that it measures

FOLDER = os.path.abspath(os.environ.get("ABSENC_FIRMWARE", "build/arm/firmware"))
RISCV_FOLDER = os.path.abspath(os.environ.get("ABSENC_FIRMWARE_RISCV", "build/riscv/firmware"))
SOURCES = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
POSITIONS = int(os.environ.get("ABSENC_FIRMWARE_POSITIONS", "1000"))
CYCLES = int(os.environ.get("ABSENC_FIRMWARE_CYCLES", "20000"))
PATIENCE = 120 + POSITIONS / 20 + CYCLES / 100  # time limit of a QEMU run, in seconds
ALL = bool(os.environ.get("ABSENC_FIRMWARE_ALL"))
CORES = ("m0plus", "m4f") if ALL else ("m0plus",)
MACHINES = {"microbit": "microbit", "m0plus": "mps2-an385", "m4f": "mps2-an386", "rv32": "virt"}
SINGLETURN, MULTITURN = 74565, 4660
LATENCY = 250  # milliseconds; the latency is long, because a busy machine delays replies


def emulator_of(program, machine, *arguments, serial="null", more=()):
    """Returns the command line that runs a program in QEMU."""
    riscv = machine == MACHINES["rv32"]
    path = os.path.join(RISCV_FOLDER if riscv else FOLDER, program + ".elf")
    emulator = ["qemu-system-riscv32", "-bios", "none"] if riscv else ["qemu-system-arm"]
    semihosting = ",".join(["enable=on,target=native", f"arg={program}", *(f"arg={one}" for one in arguments)])
    serial = ["-serial", "null"] if serial == "null" else ["-chardev", serial, "-serial", "chardev:line"]
    return [*emulator, *more, "-M", machine, "-display", "none", "-monitor", "none", *serial,
            "-semihosting-config", semihosting, "-kernel", path]


def emulated(program, machine, *arguments, serial="null", more=()):
    """Runs a program to its end. Returns its exit status and output."""
    command = emulator_of(program, machine, *arguments, serial=serial, more=more)
    result = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                            timeout=PATIENCE, text=True, check=False)
    return result.returncode, result.stdout


class Vectors(unittest.TestCase):
    def test_all_are_decoded(self):
        for cpu in (*CORES, "rv32") if ALL else CORES:
            with self.subTest(cpu):
                status, output = emulated(f"vectors-{cpu}", MACHINES[cpu])
                self.assertEqual(status, 0, output)
                decoded = re.search(r"^decoded (\d+), wrong 0, ", output, re.MULTILINE)
                self.assertTrue(decoded, output)
                self.assertGreaterEqual(int(decoded[1]), 600)


class Drive(unittest.TestCase):
    """Tests of the drive program."""

    def drive(self, cpu):
        with tempfile.TemporaryDirectory(prefix="absenc-test-") as folder:
            memory = os.path.join(folder, "memory.dump")
            with Emulator(folder, "--tcp", "0", "--memory", memory, "--alarm", "over_heat",
                          "--singleturn", str(SINGLETURN), "--multiturn", str(MULTITURN),
                          "--fault", "corrupt=0.01", "--fault", "drop=0.01") as emulator:
                port = emulator.line().rsplit(":", 1)[1].strip()
                line = f"socket,id=line,host=127.0.0.1,port={port},nodelay=on"
                status, output = emulated(f"drive-{cpu}", MACHINES[cpu], POSITIONS, SINGLETURN, MULTITURN, LATENCY,
                                        serial=line)
                _, _, summary = emulator.end()
            with open(memory, encoding="utf-8") as file:
                return status, output, summary, file.read()

    def check(self, cpu):
        status, output, summary, memory = self.drive(cpu)
        everything = output + summary
        self.assertEqual(status, 0, everything)
        counted = {name: int(number) for name, number in re.findall(r"^([a-z_]+) (\d+)$", output, re.MULTILINE)}
        self.assertGreaterEqual(counted["good"], POSITIONS, everything)
        self.assertEqual(counted["wrong"], 0, everything)
        self.assertEqual(counted["unasked"], 0, everything)
        answered = int(re.search(r"(\d+) requests answered", summary)[1])
        # One request may be unanswered: the program ends during a cycle.
        self.assertIn(counted["requests"] - answered, (0, 1), everything)
        damaged = int(re.search(r"replies with faults: (\d+)", summary)[1])
        noticed = counted["silences"] + counted["implausible"]
        # The program may notice more faults than the emulator made: a reply that a busy machine delays counts as
        # missing.
        self.assertGreaterEqual(noticed, damaged, everything)
        self.assertLessEqual(noticed, damaged + 3 + POSITIONS // 400, everything)
        if POSITIONS >= 1000:
            self.assertGreater(damaged, 0, everything)
        self.assertNotIn("rules that the host broke", summary)
        page, address, value = 2, 5, "42"
        stored = re.findall(r"^[0-9A-F]{4}: (.*)$", memory, re.MULTILINE)
        self.assertEqual(" ".join(stored).split()[page * 127 + address], value)

    def test_reads_positions_and_alarms_resets_and_writes(self):
        for cpu in ("microbit", *CORES):
            with self.subTest(cpu):
                self.check(cpu)


class Cycles(unittest.TestCase):
    """Tests of the programs that are a drive and its encoder, in the machine's own time: an instruction takes 1 ns."""

    def check(self, protocol, cpu):
        status, output = emulated(f"cycles_{protocol}-{cpu}", MACHINES[cpu], CYCLES,
                                  more=("-icount", "shift=0,sleep=off"))
        counted = {name: int(number) for name, number in re.findall(r"^([a-z_]+) (\d+)$", output, re.MULTILINE)}
        self.assertEqual(status, 0, output)
        self.assertGreaterEqual(sum(counted[kind] for kind in ("fresh", "invalid", "missing", "repeated")), CYCLES)
        self.assertEqual((counted["wrong"], counted["far"], counted["rules"], counted["left_out"]), (0, 0, 0, 0), output)
        self.assertGreater(counted["faults"], CYCLES // 200, output)
        # A damaged reply costs one cycle, or two if the line must be silent before the next request.
        self.assertLessEqual(counted["missing"], 2 * counted["faults"], output)
        self.assertGreater(counted["bytes"], 0, output)
        # Few positions are counted as invalid or implausible: the first one, because no earlier one confirms it, and
        # those in damaged replies that the check of the frame has accepted.
        self.assertLessEqual(counted["implausible"] + counted["invalid"], 1 + counted["faults"] // 100, output)
        return counted, output

    def test_tformat(self):
        for cpu in ("microbit", *CORES):
            with self.subTest(cpu):
                counted, output = self.check("tformat", cpu)
                # Each request of a command takes a cycle in which no position is requested ("repeated"). Between two of
                # these cycles a position is requested, except between the ten requests of a reset.
                self.assertGreater(counted["repeated"], 0, output)
                self.assertEqual(counted["invalid"], 0, output)  # the exclusive OR notices each single wrong bit
                self.assertLessEqual(counted["longest_stale"], 16, output)
                self.assertGreater(counted["temperatures"], 0, output)

    def test_biss(self):
        for cpu in ("microbit", *CORES):
            with self.subTest(cpu):
                counted, output = self.check("biss", cpu)
                self.assertEqual(counted["repeated"], 0, output)
                self.assertLessEqual(counted["longest_stale"], 4, output)
                self.assertGreater(counted["alarmed"], 0, output)


class Encoder(unittest.TestCase):
    """Tests of the program that is an encoder."""

    PAGE, ADDRESS, VALUE = 2, 7, 0x5A

    def start(self, cpu, rpm, silence=LATENCY, latency=LATENCY):
        """Starts the encoder program. Returns the process and the encoder's address. `silence` is in ms."""
        command = emulator_of(f"encoder-{cpu}", MACHINES[cpu], SINGLETURN, MULTITURN, rpm, silence,
                              serial="socket,id=line,host=127.0.0.1,port=0,nodelay=on,server=on,wait=on")
        process = subprocess.Popen(command, bufsize=0, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
        self.addCleanup(lambda: process.poll() is None and end(process))
        waiting = read_line(process.stderr, time.monotonic() + PATIENCE)
        port = re.search(r"tcp:127\.0\.0\.1:([1-9]\d*)", waiting or "")
        self.assertTrue(port, waiting)
        return process, f"tformat:tcp:127.0.0.1:{port[1]}?latency={latency}"

    def run_well(self, *arguments):
        done = absenc(*arguments)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def readings(self, encoder, count):
        return [json.loads(line) for line in
                self.run_well("read", encoder, "--count", str(count), "--rate", "0", "--json").splitlines()]

    def test_positions_alarm_and_memory(self):
        for cpu in ("microbit", *CORES):
            with self.subTest(cpu):
                process, encoder = self.start(cpu, 0)
                read = self.readings(encoder, 200)
                self.assertEqual({(one["singleturn"], one["multiturn"], *one["alarms"]) for one in read},
                                 {(SINGLETURN, MULTITURN, "over_heat")})
                self.run_well("clear-alarms", encoder, "--yes")
                self.assertEqual(self.readings(encoder, 1)[0]["alarms"], [])
                self.run_well("memory", "write", encoder, str(self.ADDRESS), str(self.VALUE), "--page",
                              str(self.PAGE), "--yes")
                output = self.run_well("memory", "read", encoder, str(self.ADDRESS), "--page", str(self.PAGE))
                self.assertIn("5A", output.upper())
                _, _, rules = end(process)
                self.assertNotIn("memory access", rules)

    def test_keeps_clauses_of_document(self):
        # The host's timeout is set longer than the silence that ends an invalid request.
        process, encoder = self.start("m0plus", 0, LATENCY // 5, 8 * LATENCY)
        output = self.run_well("conform", encoder)
        self.assertRegex(output, r"\b[1-9]\d* kept, 0 broken, 2 untested")
        # Over a network the 3 us of the document cannot be measured.
        self.assertRegex(output, r"untested: answer-time: ")
        self.assertRegex(output, r"untested: bad-delimiter: (.*\n){2} *this kind of port cannot change to")
        end(process)

    def test_turning_shaft(self):
        process, encoder = self.start("m0plus", 1)
        read = self.readings(encoder, 200)
        positions = [one["multiturn"] << 17 | one["singleturn"] for one in read]
        self.assertEqual(positions, sorted(positions))
        self.assertGreater(positions[-1], positions[0])
        end(process)


class FloatingPoint(unittest.TestCase):
    """Tests which functions of the compiler's library the readers link."""

    # Matches soft-float functions: those of ARM's run-time ABI (__aeabi_dadd, __aeabi_i2f) and of libgcc (__adddf3,
    # __fixdfdi).
    SOFT = re.compile(r" (__aeabi_c?[df]\w+|__aeabi_u?[il]2[df]|__\w+[sd]f\w*[23i]\w*|__float\w+)$", re.MULTILINE)

    def soft_functions(self, program):
        symbols = subprocess.run(["arm-none-eabi-nm", os.path.join(FOLDER, program + ".elf")], check=True,
                                 capture_output=True, text=True).stdout
        self.assertIn(" main", symbols)
        return self.SOFT.findall(symbols)

    def test_readers_link_none(self):
        readers = re.findall(r"(reader-\w+-(?:m0plus|m4f))\.elf", " ".join(sorted(os.listdir(FOLDER))))
        for part in ("extrapolation", "first_reading", "unwrapper", "velocity"):
            self.assertIn(f"reader-host_{part}-m0plus", readers)
            self.assertIn(f"reader-host_{part}-m4f", readers)
        for reader in readers:
            with self.subTest(reader):
                self.assertEqual(self.soft_functions(reader), [])

    def test_all_units_together_link_some(self):
        # Checks the search for soft-float functions itself: it must find some in a program of units that have
        # real-number fields.
        found = self.soft_functions("vectors-m0plus")
        self.assertIn("__aeabi_dmul", found)
        self.assertIn("__floatdidf", found)


class CallGraph(unittest.TestCase):
    """Tests the stack that firmware/call_graph.py computes."""

    PROGRAM = """
        .syntax unified
        .thumb
        .cpu cortex-m0plus
        .macro function name
        .thumb_func
        .type \\name, %function
        \\name:
        .endm
        function leaf
            push {r4, r5, lr}
            sub sp, #20
            add sp, #20
            pop {r4, r5, pc}
        function branches
            push {r4, lr}
            cmp r0, #0
            beq 1f
            sub sp, #40
            bl leaf
            add sp, #40
        1:  bl leaf
            pop {r4, pc}
        function tail
            b leaf
        function large
            push {r4, lr}
            ldr r4, 2f
            add sp, r4
            bl leaf
            movs r4, #0
            pop {r4, pc}
            .align 2
        2:  .word -1000
        function returns_by_register
            sub sp, #8
            push {r4, lr}
            bl leaf
            pop {r4}
            pop {r3}
            add sp, #8
            bx r3
        function recursive
            push {r4, lr}
            bl recursive
            pop {r4, pc}
        function indirect
            push {r4, lr}
            blx r3
            pop {r4, pc}
        .cpu cortex-m4
        function jumps_by_table
            push {r4, lr}
            adr r2, 3f
            ldr pc, [r2, r3, lsl #2]
            .align 2
        3:  .word 4f + 1
            .word 5f + 1
        4:  pop {r4, pc}
        5:  sub sp, #48
            bl leaf
            add sp, #48
            pop {r4, pc}
        """

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="absenc-test-")
        self.addCleanup(folder.cleanup)
        self.path = os.path.join(folder.name, "program.o")
        subprocess.run(["arm-none-eabi-as", "-o", self.path, "-"], input=self.PROGRAM.replace("\\\\", "\\"), text=True,
                       check=True)

    def depth(self, name, *calls):
        graph = call_graph.Graph(self.path, calls)
        return graph.depth(graph.find(f"^{name}$")[0])

    def test_frames_and_calls_are_added(self):
        self.assertEqual(self.depth("leaf"), 12 + 20)
        self.assertEqual(self.depth("branches"), 8 + 40 + 32)
        self.assertEqual(self.depth("tail"), 32)
        self.assertEqual(self.depth("returns_by_register"), 8 + 8 + 32)
        self.assertEqual(self.depth("large"), 8 + 1000 + 32)
        self.assertEqual(self.depth("jumps_by_table"), 8 + 48 + 32)

    def test_recursion_is_an_error(self):
        with self.assertRaisesRegex(call_graph.Recursion, "recursive calls itself"):
            self.depth("recursive")

    def test_indirect_calls_have_their_observed_targets(self):
        graph = call_graph.Graph(self.path, [])
        site = graph.find("^indirect$")[0].code[1][0]
        self.assertEqual(self.depth("indirect"), 8)
        self.assertEqual(self.depth("indirect", (site, graph.find("^branches$")[0].address)), 8 + 80)

    def test_computed_stack_covers_measured_stack(self):
        with tempfile.TemporaryDirectory(prefix="absenc-test-") as folder:
            plugin = figures.build_plugin(folder)
            for reader in ("tformat", "biss", "esl", "raa38_can", "host_unwrapper", "tformat_cyclic"):
                for cpu in figures.MACHINES:
                    with self.subTest(reader=reader, cpu=cpu):
                        program = os.path.join(FOLDER, f"reader-{reader}-{cpu}.elf")
                        printed, measured = figures.run(plugin, program, cpu, "count")
                        graph = figures.graph_of(program, printed)
                        # the functions of the namespace absenc::machine run before or after the measurement, so their
                        # stack does not count
                        for function in graph.find("machine"):
                            graph.depths[function.address] = 0
                        computed = graph.depth(graph.find("^start$")[0])
                        self.assertLessEqual(measured, computed)
                        self.assertLess(computed, 1.5 * measured)


class Figures(unittest.TestCase):
    TABLE = os.path.join(SOURCES, "docs/firmware-figures.json")

    def test_figures_are_within_3_percent_of_table(self):
        command = [sys.executable, "-B", os.path.join(SOURCES, "firmware/figures.py"), FOLDER, self.TABLE, "--check"]
        result = subprocess.run(command, capture_output=True, timeout=4 * PATIENCE, text=True, check=False)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)

    def test_bounds_are_of_many_inputs(self):
        with open(self.TABLE, encoding="utf-8") as file:
            inputs = json.load(file)["inputs"]
        self.assertGreaterEqual(len(inputs), 15)
        for reader, count in inputs.items():
            self.assertGreaterEqual(count, 100, reader)

    def test_growth_by_10_percent_is_reported(self):
        with open(self.TABLE, encoding="utf-8") as file:
            table = json.load(file)
        for reader, cores in table["figures"].items():
            for cpu, values in cores.items():
                for name, value in values.items():
                    found = copy.deepcopy(table)
                    found["figures"][reader][cpu][name] = value and value + max(1, value // 10)
                    differences = figures.differences(table, found)
                    self.assertEqual(len(differences), 1 if value else 0, differences)
                    self.assertTrue(all(f"{reader} {cpu} {name}" in one for one in differences), differences)


if __name__ == "__main__":
    unittest.main()
