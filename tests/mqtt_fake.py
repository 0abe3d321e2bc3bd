# SPDX-License-Identifier: Apache-2.0
"""A fake MQTT broker (5 and 3.1.1) for clients that publish with QoS 0 or 1."""
import json
import socket
import threading

from command_support import PATIENCE

CONNECT, CONNACK, PUBLISH, PUBACK, PUBREC, PUBCOMP, PINGREQ, PINGRESP, DISCONNECT = 1, 2, 3, 4, 5, 7, 12, 13, 14
NOT_AUTHORIZED = 0x87


def packet(kind, body, flags=0):
    size, left = b"", len(body)
    while True:
        left, low = left >> 7, left & 127
        size += bytes((low | (128 if left else 0),))
        if not left:
            return bytes((kind << 4 | flags,)) + size + body


class Closed(Exception):
    pass


class Connection:
    """One TCP connection of a client to the fake broker."""

    def __init__(self, connection):
        self.socket = connection
        self.old = False  # whether the client speaks MQTT 3.1.1; otherwise MQTT 5
        self.socket.settimeout(PATIENCE)

    def read(self, count):
        data = b""
        while len(data) < count:
            try:
                piece = self.socket.recv(count - len(data))
            except OSError as error:
                raise Closed from error
            if not piece:
                raise Closed
            data += piece
        return data

    def packet(self):
        """Returns (kind, flags, body) of the next packet. Raises Closed at the end of the connection."""
        first, size, shift = self.read(1)[0], 0, 0
        while True:
            byte = self.read(1)[0]
            size |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                return first >> 4, first & 15, self.read(size)

    def send(self, data):
        try:
            self.socket.sendall(data)
        except OSError as error:
            raise Closed from error

    def close(self):
        try:
            self.socket.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass
        self.socket.close()


def published(flags, body, old=False):
    """Returns (topic, packet number or None, payload) of a PUBLISH packet without properties."""
    size = int.from_bytes(body[:2], "big")
    topic, rest = body[2:2 + size].decode(), body[2 + size:]
    number = None
    if flags & 6:
        number, rest = int.from_bytes(rest[:2], "big"), rest[2:]
    return topic, number, rest if old else rest[1:]


class FakeBroker:
    """An MQTT broker in a thread. `answer` may replace the bytes that it sends in reply."""

    def __init__(self, answer=None):
        self.answer = answer
        # payloads of the received messages in the order of arrival, by topic; each is parsed JSON, or None if empty
        self.payloads = {}
        self.connections = 0
        self.lock = threading.Lock()
        self.open = set()
        self.listener = socket.create_server(("127.0.0.1", 0), backlog=100)
        self.port = self.listener.getsockname()[1]
        self.url = f"mqtt://127.0.0.1:{self.port}"
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            try:
                connection = Connection(self.listener.accept()[0])
            except OSError:
                return
            with self.lock:
                connection.index = self.connections
                self.connections += 1
                self.open.add(connection)
            threading.Thread(target=self.talk, args=(connection,), daemon=True).start()

    def talk(self, connection):
        try:
            while True:
                kind, flags, body = connection.packet()
                if kind == CONNECT:
                    connection.old = body[6] < 5
                if kind == PUBLISH:
                    self.keep(*published(flags, body, connection.old))
                usual = self.usual(kind, flags, body, connection.old)
                if self.answer is not None:
                    usual = self.answer(self, connection, kind, flags, body, usual)
                if usual:
                    connection.send(usual)
                if kind == DISCONNECT:
                    raise Closed
        except Closed:
            pass
        finally:
            connection.close()
            with self.lock:
                self.open.discard(connection)

    def keep(self, topic, _number, payload):
        with self.lock:
            self.payloads.setdefault(topic, []).append(json.loads(payload) if payload else None)

    @staticmethod
    def usual(kind, flags, body, old):
        if kind == CONNECT:
            return packet(CONNACK, bytes(2 if old else 3))
        if kind == PUBLISH and flags & 6:
            return packet(PUBACK, published(flags, body)[1].to_bytes(2, "big"))
        return packet(PINGRESP, b"") if kind == PINGREQ else b""

    def all(self, ending):
        """Returns the payloads received so far in all topics whose names end with `ending`."""
        with self.lock:
            return [payload for topic, payloads in self.payloads.items() if topic.endswith(ending)
                    for payload in payloads]

    def after(self, topic, count):
        """Returns the payloads received in the topic, without the first `count`."""
        with self.lock:
            return self.payloads.get(topic, [])[count:]

    def drop_all(self):
        with self.lock:
            for one in self.open:
                one.close()

    def end(self):
        self.listener.close()
        self.drop_all()
