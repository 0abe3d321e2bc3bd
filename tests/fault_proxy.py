# SPDX-License-Identifier: Apache-2.0
"""A proxy between a host and an encoder that causes faults, for tests of doctor."""
import heapq
import os
import random
import select
import time

from command_support import FakeLine

GAP = 0.003  # time of silence that ends a reply, in seconds


class Fault:
    """Forwards all bytes unchanged; each derived class is one fault. Times are in seconds."""

    whole = False  # whether the function `reply` gets whole replies, which are collected until a silence of GAP
    chatter = None  # unsolicited bytes sent to the host, as (period in seconds, bytes); None: no such bytes

    def request(self, data, now):  # pylint: disable=unused-argument
        """Returns the bytes to forward to the encoder for the host's bytes `data`."""
        return data

    def returned(self, data, now):  # pylint: disable=unused-argument
        """Returns the bytes to send to the host at once when it sends `data`, such as an echo."""
        return b""

    def reply(self, data, now):  # pylint: disable=unused-argument
        """Yields (delay in seconds, bytes) for each piece that the host receives instead of `data`."""
        yield 0, data


class FaultProxy(FakeLine):
    """A pseudo-terminal for the host, with `fault` before the encoder at the path `encoder`; None: no encoder."""

    def __init__(self, fault, encoder=None):
        super().__init__()
        self.fault = fault
        self.encoder = os.open(encoder, os.O_RDWR | os.O_NOCTTY) if encoder else None
        os.set_blocking(self.master, False)
        self.requests = 0  # number of blocks of bytes read from the host; a request may arrive in several blocks
        self.unread = 0  # number of bytes for the host that were dropped, because the pseudo-terminal was full
        # number of blocks of bytes, from host or encoder, that the fault has changed, dropped, delayed or added
        self.changed = 0

    def __exit__(self, *_):
        super().__exit__(*_)
        if self.encoder is not None:
            os.close(self.encoder)

    def to_host(self, data):
        try:
            written = os.write(self.master, data) if data else 0
        except BlockingIOError:
            written = 0
        self.unread += len(data) - written

    def to_encoder(self, data):
        if data and self.encoder is not None:
            os.write(self.encoder, data)

    def serve(self):
        due = []  # heap of bytes to send to the host: (time to send, number that keeps the order, bytes)
        number = 0
        gathered = b""
        gathered_at = None
        chatter = time.monotonic()
        sources = [self.master, self.wake] + ([self.encoder] if self.encoder is not None else [])
        while True:
            now = time.monotonic()
            times = [due[0][0]] if due else []
            times += [gathered_at + GAP] if gathered_at is not None else []
            times += [chatter] if self.fault.chatter else []
            ready, _, _ = select.select(sources, [], [], max(min(times) - now, 0) if times else None)
            now = time.monotonic()
            if self.wake in ready:
                return
            replies = []
            if self.encoder in ready and self.encoder is not None:
                data = os.read(self.encoder, 4096)
                if self.fault.whole:
                    gathered, gathered_at = gathered + data, now
                else:
                    replies.append(data)
            if gathered_at is not None and self.encoder not in ready and now >= gathered_at + GAP:
                replies.append(gathered)
                gathered, gathered_at = b"", None
            if self.master in ready:
                data = os.read(self.master, 4096)
                self.requests += 1
                returned, passed = self.fault.returned(data, now), self.fault.request(data, now)
                self.changed += returned != b"" or passed != data
                self.to_host(returned)
                self.to_encoder(passed)
            for data in replies:
                parts = list(self.fault.reply(data, now))
                self.changed += parts != [(0, data)]
                for delay, part in parts:
                    number += 1
                    heapq.heappush(due, (now + delay, number, part))
            while due and due[0][0] <= now:
                self.to_host(heapq.heappop(due)[2])
            if self.fault.chatter and now >= chatter:
                period, data = self.fault.chatter
                chatter = max(chatter + period, now)
                self.changed += 1
                self.to_host(data)


# ---- Faults: no encoder on the line, or another device in its place


class Dead(Fault):
    """No request reaches the encoder, as with no supply or a broken wire."""

    def request(self, data, now):
        return b""

    def reply(self, data, now):
        yield from ()


class LineLow(Dead):
    """A and B are exchanged: the idle line is low, which a UART receives as bytes 00."""

    def returned(self, data, now):
        return bytes(9)


class OnlyEcho(Dead):
    """The adapter returns its own bytes as an echo; no encoder answers."""

    def returned(self, data, now):
        return data


class Console(Dead):
    """The port leads to a computer's login prompt instead of an encoder."""

    def returned(self, data, now):
        return b"\r\nDebian GNU/Linux 12 drive ttyS1\r\n\r\ndrive login: "


class Modem(Dead):
    """A modem in place of the encoder returns the received bytes and then "ERROR"."""

    def returned(self, data, now):
        return data + b"\r\nERROR\r\n"


class Nmea(Dead):
    """A satellite receiver in place of the encoder sends NMEA sentences."""

    chatter = (0.02, b"$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n")


class Chatter(Fault):
    """Noise of an open line, or another host, adds two bytes every 2 ms."""

    chatter = (0.002, b"\x55\x12")


# ---- Faults: late replies, and times without replies


class AlwaysLate(Fault):
    """Every reply is delayed by `delay`, as by a network."""

    whole = True

    def __init__(self, delay=0.12):
        self.delay = delay

    def reply(self, data, now):
        yield self.delay, data


class SometimesLate(Fault):
    """One reply of ten is delayed by 0.12 s."""

    whole = True

    def __init__(self, seed=1):
        self.random = random.Random(seed)

    def reply(self, data, now):
        yield (0.12 if self.random.random() < 0.1 else 0), data


class LooseContact(Fault):
    """The line is open for 0.15 s of every 0.5 s, in both directions."""

    def __init__(self):
        self.start = time.monotonic()

    def is_open(self, now):
        return (now - self.start) % 0.5 < 0.15

    def request(self, data, now):
        return b"" if self.is_open(now) else data

    def reply(self, data, now):
        if not self.is_open(now):
            yield 0, data


class Starting(Fault):
    """The encoder ignores requests for `seconds` after the first one, because it is starting."""

    def __init__(self, seconds=0.4):
        self.ready = None
        self.seconds = seconds

    def request(self, data, now):
        self.ready = self.ready or now + self.seconds
        return data if now >= self.ready else b""


# ---- Faults: bytes lost or damaged on the line


class Lost(Fault):
    """One reply of ten does not reach the host."""

    whole = True

    def __init__(self, share=0.1, seed=1):
        self.share = share
        self.random = random.Random(seed)

    def reply(self, data, now):
        if self.random.random() >= self.share:
            yield 0, data


class LostRequests(Lost):
    """One request of ten does not reach the encoder."""

    whole = False

    def request(self, data, now):
        return b"" if self.random.random() < self.share else data

    def reply(self, data, now):
        yield 0, data


class Corrupt(Lost):
    """One bit of one reply of fifty is flipped."""

    def __init__(self, share=0.02, seed=1):
        super().__init__(share, seed)

    def reply(self, data, now):
        changed = bytearray(data)
        if self.random.random() < self.share:
            changed[self.random.randrange(len(changed))] ^= 1 << self.random.randrange(8)
        yield 0, bytes(changed)


class Bursts(Lost):
    """Half of the bytes of one reply of ten are random."""

    def reply(self, data, now):
        changed = bytearray(data)
        if self.random.random() < self.share:
            for at in range(len(changed) // 4, len(changed) // 4 + len(changed) // 2):
                changed[at] = self.random.randrange(256)
        yield 0, bytes(changed)


class BytesLost(Lost):
    """One byte of one reply of ten is missing, as after an overrun of the receiver."""

    def reply(self, data, now):
        if self.random.random() < self.share:
            at = self.random.randrange(len(data))
            data = data[:at] + data[at + 1:]
        yield 0, data


class Cut(Fault):
    """The last byte of every reply is missing, because the direction is switched too early."""

    whole = True

    def reply(self, data, now):
        yield 0, data[:-1]


class Twice(Fault):
    """Every reply arrives twice."""

    whole = True

    def reply(self, data, now):
        yield 0, data + data


class Split(Fault):
    """Every reply arrives in two parts, as USB packets split it. This is no fault."""

    whole = True

    def reply(self, data, now):
        yield 0, data[:3]
        yield 0.002, data[3:]


class Repeats(Fault):
    """Every reply is a copy of the first one, as from a gateway with a cache."""

    whole = True

    def __init__(self):
        self.first = b""

    def reply(self, data, now):
        self.first = self.first or data
        yield 0, self.first


class OneBehind(Fault):
    """Every reply answers the previous request; the first one is empty."""

    whole = True

    def __init__(self):
        self.last = b""

    def reply(self, data, now):
        yield 0, self.last
        self.last = data


# ---- Faults: bytes changed by adapters and drivers


class Echo(Fault):
    """The adapter returns each request as an echo, as is usual on two wires."""

    def returned(self, data, now):
        return data


class ByteBefore(Fault):
    """The direction is switched late: an extra byte 00 precedes each reply."""

    whole = True

    def reply(self, data, now):
        yield 0, b"\x00" + data


class ByteAfter(Fault):
    """The direction is switched late: an extra byte 00 follows each reply."""

    whole = True

    def reply(self, data, now):
        yield 0, data + b"\x00"


class Translated(Fault):
    """A driver replaces the bytes `old` by `new` in replies, not in requests."""

    def __init__(self, old, new):
        self.old, self.new = old, new

    def reply(self, data, now):
        yield 0, data.replace(self.old, self.new)


class FlowControl(Fault):
    """Software flow control removes the bytes 11 and 13 (XON, XOFF) from replies."""

    def reply(self, data, now):
        yield 0, data.replace(b"\x11", b"").replace(b"\x13", b"")


class SevenBits(Fault):
    """The port clears the highest bit of each byte of a reply."""

    def reply(self, data, now):
        yield 0, bytes(byte & 0x7F for byte in data)


class ParityMarks(Fault):
    """The driver replaces FF by FF FF in replies (termios PARMRK), as telnet does too."""

    def reply(self, data, now):
        yield 0, data.replace(b"\xff", b"\xff\xff")
