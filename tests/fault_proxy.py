# SPDX-License-Identifier: Apache-2.0
"""A proxy between a host and an encoder, each on a pseudo-terminal of its own, that does what adapters, cables, drivers
and other people's devices do."""
import heapq
import os
import random
import select
import time

from command_support import FakeLine

GAP = 0.003  # seconds of silence after which a reply is whole; longer than a pause that a busy emulator makes within one


class Fault:
    """Passes everything on. A fault overrides what it changes; times are in seconds, of time.monotonic()."""

    whole = False  # True: `reply` gets whole replies, gathered until a pause; otherwise pieces as they come
    chatter = None  # (period, bytes) of somebody who sends unasked

    def request(self, data, now):  # pylint: disable=unused-argument
        """Returns the bytes that go on to the encoder."""
        return data

    def returned(self, data, now):  # pylint: disable=unused-argument
        """Returns the bytes that the host gets back at once, before any reply."""
        return b""

    def reply(self, data, now):  # pylint: disable=unused-argument
        """Yields what the host gets in place of the encoder's bytes: (delay, bytes), any number of them."""
        yield 0, data


class FaultProxy(FakeLine):
    """`path` leads through the fault to the encoder; without an encoder nobody is at the far end."""

    def __init__(self, fault, encoder=None):
        super().__init__()
        self.fault = fault
        self.encoder = os.open(encoder, os.O_RDWR | os.O_NOCTTY) if encoder else None
        os.set_blocking(self.master, False)
        self.requests = 0  # pieces that came from the host
        self.unread = 0  # bytes that the host did not take
        self.changed = 0  # requests and replies that the fault altered, held up, or added

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
        due = []  # (time, number, bytes) for the host
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


# ---- Nobody, or somebody else


class Dead(Fault):
    """Requests do not arrive: no supply, a broken wire."""

    def request(self, data, now):
        return b""

    def reply(self, data, now):
        yield from ()


class LineLow(Dead):
    """A and B are exchanged: the idle line is low, which a UART reads as 00."""

    def returned(self, data, now):
        return bytes(9)


class OnlyEcho(Dead):
    """The adapter hears itself; no encoder answers."""

    def returned(self, data, now):
        return data


class Console(Dead):
    """A computer's login behind the port."""

    def returned(self, data, now):
        return b"\r\nDebian GNU/Linux 12 drive ttyS1\r\n\r\ndrive login: "


class Modem(Dead):
    """A modem, which returns what it was sent and complains."""

    def returned(self, data, now):
        return data + b"\r\nERROR\r\n"


class Nmea(Dead):
    """A receiver of satellite navigation, which sends its sentences whoever asks what."""

    chatter = (0.02, b"$GPGGA,092750.000,5321.6802,N,00630.3372,W,1,8,1.03,61.7,M,55.2,M,,*76\r\n")


class Chatter(Fault):
    """Noise of an open line, or another host: bytes all the time."""

    chatter = (0.002, b"\x55\x12")


# ---- In time


class AlwaysLate(Fault):
    """Every reply is held up for longer than a host waits, as by a network."""

    whole = True

    def __init__(self, delay=0.12):
        self.delay = delay

    def reply(self, data, now):
        yield self.delay, data


class SometimesLate(Fault):
    """One reply of ten is held up."""

    whole = True

    def __init__(self, seed=1):
        self.random = random.Random(seed)

    def reply(self, data, now):
        yield (0.12 if self.random.random() < 0.1 else 0), data


class LooseContact(Fault):
    """Nothing passes for 0.15 s of every 0.5 s."""

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
    """The encoder needs a moment before it answers at all."""

    def __init__(self, seconds=0.4):
        self.ready = None
        self.seconds = seconds

    def request(self, data, now):
        self.ready = self.ready or now + self.seconds
        return data if now >= self.ready else b""


# ---- Some of the bytes


class Lost(Fault):
    """One reply of ten does not arrive."""

    whole = True

    def __init__(self, share=0.1, seed=1):
        self.share = share
        self.random = random.Random(seed)

    def reply(self, data, now):
        if self.random.random() >= self.share:
            yield 0, data


class LostRequests(Lost):
    """One request of ten does not arrive."""

    whole = False

    def request(self, data, now):
        return b"" if self.random.random() < self.share else data

    def reply(self, data, now):
        yield 0, data


class Corrupt(Lost):
    """One bit of one reply of fifty is wrong."""

    def __init__(self, share=0.02, seed=1):
        super().__init__(share, seed)

    def reply(self, data, now):
        changed = bytearray(data)
        if self.random.random() < self.share:
            changed[self.random.randrange(len(changed))] ^= 1 << self.random.randrange(8)
        yield 0, bytes(changed)


class Bursts(Lost):
    """Half of the bytes of one reply of ten are random: a motor's bridge switches nearby."""

    def reply(self, data, now):
        changed = bytearray(data)
        if self.random.random() < self.share:
            for at in range(len(changed) // 4, len(changed) // 4 + len(changed) // 2):
                changed[at] = self.random.randrange(256)
        yield 0, bytes(changed)


class BytesLost(Lost):
    """One byte of one reply of ten is lost: a receiver that overran."""

    def reply(self, data, now):
        if self.random.random() < self.share:
            at = self.random.randrange(len(data))
            data = data[:at] + data[at + 1:]
        yield 0, data


class Cut(Fault):
    """The end of every reply is missing: the direction is switched too early."""

    whole = True

    def reply(self, data, now):
        yield 0, data[:-1]


class Twice(Fault):
    """Every reply comes twice."""

    whole = True

    def reply(self, data, now):
        yield 0, data + data


class Split(Fault):
    """A reply comes in two parts, 2 ms apart, as USB packets cut it: that is no fault."""

    whole = True

    def reply(self, data, now):
        yield 0, data[:3]
        yield 0.002, data[3:]


class Repeats(Fault):
    """Every reply is that to the first request: a gateway with a cache."""

    whole = True

    def __init__(self):
        self.first = b""

    def reply(self, data, now):
        self.first = self.first or data
        yield 0, self.first


class OneBehind(Fault):
    """Every reply is that to the request before."""

    whole = True

    def __init__(self):
        self.last = b""

    def reply(self, data, now):
        yield 0, self.last
        self.last = data


# ---- What adapters and drivers do to bytes


class Echo(Fault):
    """The adapter hears what it sends: usual on two wires."""

    def returned(self, data, now):
        return data


class ByteBefore(Fault):
    """The direction is switched late: one byte that nobody sent stands before each reply."""

    whole = True

    def reply(self, data, now):
        yield 0, b"\x00" + data


class ByteAfter(Fault):
    """The same behind each reply."""

    whole = True

    def reply(self, data, now):
        yield 0, data + b"\x00"


class Translated(Fault):
    """A driver replaces bytes, in replies alone."""

    def __init__(self, old, new):
        self.old, self.new = old, new

    def reply(self, data, now):
        yield 0, data.replace(self.old, self.new)


class FlowControl(Fault):
    """Software flow control takes 11 and 13 out of replies."""

    def reply(self, data, now):
        yield 0, data.replace(b"\x11", b"").replace(b"\x13", b"")


class SevenBits(Fault):
    """The port takes seven bits of each byte."""

    def reply(self, data, now):
        yield 0, bytes(byte & 0x7F for byte in data)


class ParityMarks(Fault):
    """The driver marks FF as FF FF (termios PARMRK), and telnet does the same."""

    def reply(self, data, now):
        yield 0, data.replace(b"\xff", b"\xff\xff")
