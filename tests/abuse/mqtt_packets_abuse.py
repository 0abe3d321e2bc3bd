# SPDX-License-Identifier: Apache-2.0
"""Conversations in which a broker violates MQTT: no `absenc serve` may end. ABSENC_ABUSE_SEED=N sets the first seed."""
from abuse_support import often

import os
import random
import time
import unittest

from command_support import PATIENCE
from mqtt_fake import (CONNACK, CONNECT, DISCONNECT, PINGRESP, PUBACK, PUBCOMP, PUBLISH, PUBREC, Closed, FakeBroker, packet,
                       published)
from mqtt_support import numbers
from serve_support import BUSY, ServeCase

ONE = "sim:tformat?motion=rpm=60"
SEED = int(os.environ.get("ABSENC_ABUSE_SEED", "1"))
CONVERSATIONS = often(150, 10_000)
SERVERS = often(20, 60)  # number of processes `absenc serve`; each pauses for up to 5 s between two conversations
NOBODYS = 60_000  # a packet number that no message has, because packet numbers count from 1 in each conversation
KNOWN = [bytes.fromhex(one) for one in ("20050000027f00", "4006000100027f00", "e00487027f00", "30050001615859")]
# Types of the bad packets that the fake broker sends; 9 is SUBACK, 15 is AUTH.
KINDS = (CONNACK, PUBACK, 9, PUBLISH, DISCONNECT, PINGRESP, 15)


def properties(random_):
    """Returns a random list of MQTT 5 properties: known, unknown or truncated ones."""
    body = bytes(random_.choice((0x11, 0x12, 0x1F, 0x21, 0x26, 0x27, 0x7F, random_.randrange(256)))
                 for _ in range(random_.randrange(1, 4))) + random_.randbytes(random_.randrange(12))
    return bytes((random_.choice((len(body), random_.randrange(128))),)) + body


def body(random_, kind, number):
    """Returns a body, valid or nearly so, of a packet that a broker may send."""
    if kind == CONNACK:
        return bytes((0, 0, 0))
    if kind in (PUBACK, 9):
        return number.to_bytes(2, "big") + random_.choice((b"", b"\0", b"\0\0", b"\x87\0"))
    if kind == PUBLISH:
        return b"\0\3a/b" + random_.choice((b"\0", b"\0\1\0")) + b"{}"
    return random_.choice((b"", b"\x87\0")) if kind == DISCONNECT else b""


def bad_packet(random_, kind, number):
    way = random_.randrange(8)
    good = body(random_, kind, number)
    if way == 0:
        return random_.choice(KNOWN)
    if way == 1:
        return random_.randbytes(random_.randrange(1, 64))
    if way == 2:  # the bad packet has random properties
        start = {CONNACK: b"\0\0", PUBACK: number.to_bytes(2, "big") + b"\0", PUBLISH: b"\0\1a", 9: b"\0\1"}
        return packet(kind, start.get(kind, b"\0") + properties(random_))
    if way == 3:  # the bad packet is truncated, so that the client takes the next packet for the end of the bad one
        whole = packet(kind, good + properties(random_))
        return whole[:random_.randrange(1, len(whole))]
    if way == 4:  # the size field of the bad packet is wrong: too large, 256 MB, five bytes long, or 0
        size = random_.choice((b"\x7f", b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff\x7f", b"\0"))
        return bytes((kind << 4,)) + size + good
    if way == 5:  # the bad packet has random flags, which are mostly wrong
        return packet(kind, good, random_.randrange(16))
    if way == 6:  # the packet is good, but sent 2 to 1999 times
        return packet(kind, good) * random_.randrange(2, 2000)
    mutated = bytearray(packet(kind, good + random_.choice((b"", properties(random_)))))
    for _ in range(random_.randrange(1, 4)):
        mutated[random_.randrange(len(mutated))] ^= 1 << random_.randrange(8)
    return bytes(mutated)


def acknowledged(stream):
    """Returns the acknowledged numbers in `stream`, and the incomplete packet at its end."""
    found = []
    while True:
        sizes = next((stream[1:end] for end in range(2, 6) if end <= len(stream) and stream[end - 1] < 128), None)
        if sizes is None:  # the size field of the packet has five bytes, so the client refuses it
            return found, stream if len(stream) < 5 else b""
        body_at = 1 + len(sizes)
        end = body_at + sum((byte & 127) << 7 * place for place, byte in enumerate(sizes))
        if len(stream) < end:
            return found, stream
        if stream[0] >> 4 in (PUBACK, PUBREC, PUBCOMP):
            found.append(int.from_bytes(stream[body_at:body_at + 2], "big"))
        stream = stream[end:]


class Conversation:
    def __init__(self, seed):
        self.random = random.Random(seed)
        # Number of good packets sent to the client before the bad one. If it is 0, the bad packet replaces the CONNACK
        # or follows it.
        self.good_packets = self.random.choice((0, 0, 0, 1, 2, 3, 5, 8))
        self.seen = 0
        self.ends = None
        self.received = set()  # packet numbers of the messages received from the client
        self.rest = b""  # begin of a packet to the client whose end was not sent yet

    def numbers(self):
        return [*sorted(self.received), NOBODYS]

    def truthful(self, data):
        """Returns `data`. Raises Closed if `data` acknowledges a message, other than NOBODYS, that was not received."""
        found, self.rest = acknowledged(self.rest + data)
        if any(number != NOBODYS and number not in self.received for number in found):
            raise Closed
        return data


class Packets(ServeCase):
    def setUp(self):
        super().setUp()
        self.good = False
        self.broker = FakeBroker(self.answer)
        self.addCleanup(self.broker.end)

    def answer(self, _broker, connection, kind, flags, body_, usual):
        if self.good and not hasattr(connection, "conversation"):
            return usual
        if not hasattr(connection, "conversation"):
            connection.conversation = Conversation(SEED + connection.index)
            connection.socket.settimeout(1)  # the conversation ends if the client sends nothing for 1 s
        conversation = connection.conversation
        if kind == PUBLISH and (number := published(flags, body_)[1]) is not None:
            conversation.received.add(number)
        return conversation.truthful(self.reply_in_conversation(conversation, kind, usual))

    def reply_in_conversation(self, conversation, kind, usual):
        if conversation.ends is not None:
            if time.monotonic() > conversation.ends:
                raise Closed
            return b"" if conversation.random.random() < 0.5 else usual
        conversation.seen += 1
        if conversation.seen <= conversation.good_packets:
            return usual
        conversation.ends = time.monotonic() + 0.3
        expected = {CONNECT: CONNACK, PUBLISH: PUBACK}.get(kind, PINGRESP)
        wrong = expected if conversation.random.random() < 0.5 else conversation.random.choice(KINDS)
        bad = b"".join(bad_packet(conversation.random, wrong, conversation.random.choice(conversation.numbers()))
                       for _ in range(conversation.random.choice((1, 1, 1, 2, 5))))
        return conversation.random.choice((bad, usual + bad))

    def test_no_server_ends_and_no_reading_is_lost(self):
        servers = [self.without_history(ONE, "--rate", "10", "--mqtt", self.broker.url, "--mqtt-prefix", f"plant/{index}",
                                        "--mqtt-spool", os.path.join(self.directory, f"spool{index}"))
                   for index in range(SERVERS)]
        deadline = time.monotonic() + CONVERSATIONS * 6 / SERVERS + PATIENCE
        while self.broker.connections < CONVERSATIONS:
            self.assertLess(time.monotonic(), deadline, f"{self.broker.connections} conversations")
            for server in servers:
                self.assertIsNone(server.process.poll(), f"a server ended; seeds {SEED} to {SEED + self.broker.connections}")
            time.sleep(0.1)  # polling interval in seconds; the result of the test does not depend on it
        self.good = True
        conversations = self.broker.connections
        deaths = sum(server.json("/api/mqtt")["client_deaths"] for server in servers)
        self.assertGreater(deaths, CONVERSATIONS / 20, "some of them end a client, or this tests nothing")
        for index, server in enumerate(servers):
            self.assertIsNone(server.process.poll())
            self.assertEqual(server.encoder()["state"], "live")
            goal = server.json("/api/mqtt")["taken"][ONE]
            readings = f"plant/{index}/{ONE.replace(':', '%3A').replace('?', '%3F').replace('=', '%3D')}/readings"
            messages = self.wait_for(readings, goal, server)
            found = sorted(set(numbers(messages, ONE)))
            self.assertEqual(found, list(range(1, found[-1] + 1)), "numbers of readings")
            self.assertEqual(server.json("/api/mqtt")["dropped"], 0)
            times = sorted({reading[0] for one in messages for reading in one["readings"]})
            gap = max(later - earlier for earlier, later in zip(times, times[1:]))
            self.assertLess(gap, 1_000_000 * BUSY, "microseconds without a reading")
        print(f"{conversations} conversations, {deaths} ended a client, no server", flush=True)

    def wait_for(self, topic, goal, server):
        """Returns all messages of the topic as soon as they include the reading with the number `goal`."""
        messages = []
        last = 0
        while last < goal:
            # After the broker has refused a topic, a client may wait for up to a minute before it tries the topic
            # again.
            late = time.monotonic() + 90 + PATIENCE
            while not (new := self.broker.after(topic, len(messages))):
                self.assertLess(time.monotonic(), late, f"reading {goal} comes after {last}: {server.json('/api/mqtt')}")
                time.sleep(0.05)  # polling interval in seconds; the result of the test does not depend on it
            messages += new
            last = max([last, *numbers(new, ONE)])
        return messages


if __name__ == "__main__":
    unittest.main()
