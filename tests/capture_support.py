# SPDX-License-Identifier: Apache-2.0
"""Shared by the tests of `absenc decode`: captures of a conversation, in each format."""
import functools
import struct

from command_support import absenc, json_lines

FRAMES = "1A\n1A 00 45 23 01 11 34 12 00 00 4A\n1A\n1A 00 45 23 01 11 34 12 00 00 4B\n"  # the last one is damaged
BIT = 400  # bit time in ns at 2.5 Mbit/s


def exchange(position, turns=0, alarms=0):
    """Returns a request for T-format's data ID 3 and its reply."""
    status = 0x20 if alarms & 0xF0 else 0
    reply = [0x1A, status, *position.to_bytes(3, "little"), 0x11, *turns.to_bytes(3, "little"), alarms]
    reply.append(functools.reduce(lambda a, b: a ^ b, reply))
    return [0x1A], reply


class Wave:
    """A waveform: wires with their level changes; times in nanoseconds."""

    def __init__(self, **idle):
        self.changes = {name: [(0, level)] for name, level in idle.items()}
        self.now = 20_000

    def level(self, wire, value, at):
        if self.changes[wire][-1][1] != value:
            self.changes[wire].append((at, value))

    def send(self, wire, data, bit=BIT):
        """Appends asynchronous characters to a wire, from the current time on."""
        for byte in data:
            for level in [0, *((byte >> i) & 1 for i in range(8)), 1]:
                self.level(wire, level, self.now)
                self.now += bit

    def word(self, bits, half=2500):
        """Appends a word on a clocked link. `half` is half a clock period in nanoseconds."""
        self.level("clock", 0, self.now)
        for bit in bits:
            self.now += half
            self.level("clock", 1, self.now)
            self.level("data", bit, self.now)
            self.now += half
            self.level("clock", 0, self.now)
        self.now += half
        self.level("clock", 1, self.now)
        self.level("data", 1, self.now)
        self.now += 600_000

    def wait(self, time):
        self.now += time

    def vcd(self):
        text = "$timescale 1 ns $end\n$scope module test $end\n"
        names = {name: chr(ord("!") + i) for i, name in enumerate(self.changes)}
        for name, letter in names.items():
            text += f"$var wire 1 {letter} {name} $end\n"
        text += "$upscope $end\n$enddefinitions $end\n"
        every = sorted((at, f"{level}{names[name]}") for name, changes in self.changes.items() for at, level in changes)
        last = None
        for at, change in every:
            if at != last:
                text += f"#{at}\n"
            last = at
            text += f"{change}\n"
        return text + f"#{self.now + 20_000}\n"

    def samples(self, wire, period):
        """Returns the levels of a wire as one byte per sample."""
        changes = [*self.changes[wire], (self.now + 20_000, None)]
        return b"".join(bytes([level]) * (end // period - begin // period)
                        for (begin, level), (end, _) in zip(changes, changes[1:]))


def conversation(count=50, bad=(), silent=()):
    wave = Wave(D0=1)
    for i in range(count):
        request, reply = exchange(i * 100, i)
        if i in bad:
            reply[3] ^= 0x04
        wave.send("D0", request)
        if i not in silent:
            wave.wait(3000)
            wave.send("D0", reply)
        wave.wait(20_000 if i not in silent else 200_000)
    return wave


def write_each_format(folder):
    """Writes captures to the folder (a Path), one in each format that `decode` reads. One reply in some of them is damaged.
    Returns the path of each with the other arguments of `decode`: [(path, [protocol, *options])]."""
    wave = conversation(20, bad=(7,))
    can = next(unit["protocol"] for unit in json_lines(absenc("list", "--json").stdout) if unit["link"] == "can")
    text = folder / "Mitschnitt ä.txt"
    text.write_text(FRAMES)
    vcd = folder / "Mitschnitt ä.vcd"
    vcd.write_text(wave.vcd())
    samples = folder / "Werte ü.bin"
    samples.write_bytes(wave.samples("D0", 50))
    changes = [(at * 1e-9, level) for at, level in wave.changes["D0"]]
    export = b"<SALEAE>" + struct.pack("<iiIddQ", 0, 0, changes[0][1], 0, changes[-1][0] + 1e-4, len(changes) - 1)
    export += struct.pack(f"<{len(changes) - 1}d", *(at for at, _ in changes[1:]))
    saleae, exported = folder / "digital_0.bin", folder / "Export ö"
    exported.mkdir()
    for path in (saleae, exported / "digital_0.bin"):
        path.write_bytes(export)
    log = folder / "Mitschnitt ä.log"
    written = [absenc("read", f"sim:{can}?log={log}", "--count", "5")]
    csv, session = folder / "Mitschnitt ä.csv", folder / "Mitschnitt ä.sr"
    for path in (csv, session):
        written.append(absenc("wave", "sim:tformat?motion=rpm=60", path, "--count", "20"))
    for done in written:
        done.check_returncode()
    return [(text, ["tformat"]), (vcd, ["tformat"]), (csv, ["tformat"]), (session, ["tformat"]), (log, [can]),
            (samples, ["tformat", "--raw-channels", "1", "--rate", "20000000"]), (saleae, ["tformat"]), (exported, ["tformat"])]
