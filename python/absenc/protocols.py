# SPDX-License-Identifier: Apache-2.0
"""Descriptions of the protocols, and their frames as plain codecs, without a line."""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple, Union

import numpy as np
import numpy.typing as npt

from . import _absenc
from ._values import Field, Value, texts

#: A frame: bytes, or as text "1A 00"; on CAN "1FF:022B", on clocked links "0001".
Frame = Union[bytes, bytearray, memoryview, str]


class Flag(NamedTuple):
    """One bit of a field of alarms or status."""

    field: str
    bit: int
    name: str
    meaning: str
    action: str  #: required action of the operator; "": none


class Command(NamedTuple):
    """A command of an encoder."""

    name: str
    verb: str  #: purpose, independent of the name
    meaning: str
    changes_encoder: bool
    arguments: tuple[str, ...]


class Protocol:
    """One protocol: `absenc.protocol["tformat"]`."""

    def __init__(self, unit: str) -> None:
        description = _absenc.unit(unit)
        self.id: str = description["id"]
        self.name: str = description["name"]  #: maker and protocol, for people
        self.document: str = description["document"]  #: document that specifies the protocol
        self.link: str = description["link"]  #: kind of link: "half_duplex", "full_duplex", "exchange" (SPI), "clocked", "clocked_bidirectional" or "can"
        self.line: str = description["line"]  #: kind of line: "RS-485 half duplex, 2.5 Mbit/s"
        self.options: list[str] = description["options"]
        self.models: list[str] = description["models"]
        self.fields: list[str] = description["fields"]
        self.conditions: list[str] = description["conditions"]  #: names of the conditions of its virtual encoder
        self.flags: list[Flag] = [Flag(*flag) for flag in description["flags"]]  #: flags of all alarm and status fields
        # if a status flag and an alarm have the same name, `named` has the one that comes first in `flags`
        named = {flag.name: flag for flag in reversed(self.flags)}
        self.alarms: list[Flag] = [named[name] for name in description["alarms"]]
        self.commands: dict[str, Command] = {
            one["name"]: Command(
                one["name"], one["verb"], one["meaning"], one["changes_encoder"], tuple(one["arguments"])
            )
            for one in description["commands"]
        }

    def __repr__(self) -> str:
        return f"<absenc.Protocol {self.id}: {self.name}>"

    def decode(self, reply: Frame, *, request: Frame = b"", model: str = "", **options: Value) -> dict[str, Field]:
        """Returns the fields of a reply, or of the request for an empty reply. Raises EncoderError or UsageError."""
        return _absenc.decode_frame(self.id, _plain(reply), _plain(request), model, texts(options))

    def encode(self, command: str, *values: int, model: str = "", **options: Value) -> Union[bytes, str]:
        """Returns the request of a command: bytes; on CAN and clocked links text."""
        return _absenc.encode_request(self.id, command, list(values), model, texts(options))

    def flag_names(self, field: str, bits: int) -> list[str]:
        """Returns the names of the flags that are set in a number, as in captures."""
        return [flag.name for flag in self.flags if flag.field == field and bits >> flag.bit & 1]


def _plain(frame: Frame) -> Union[bytes, str]:
    return frame if isinstance(frame, str) else memoryview(frame).tobytes()


class Protocols(Mapping[str, Protocol]):
    """All protocols by name."""

    def __init__(self) -> None:
        self._created: dict[str, Protocol] = {}

    def __getitem__(self, unit: str) -> Protocol:
        if unit not in self._created:
            self._created[unit] = Protocol(unit)
        return self._created[unit]

    def __contains__(self, unit: object) -> bool:
        return unit in _absenc.units()

    def __iter__(self) -> Iterator[str]:
        return iter(_absenc.units())

    def __len__(self) -> int:
        return len(_absenc.units())


#: All protocols by name: protocol["tformat"]. An unknown name raises UsageError.
protocol = Protocols()


def crc(
    data: Union[bytes, npt.NDArray[np.uint8]],
    *,
    width: int,
    poly: int,
    init: int = 0,
    refin: bool = False,
    refout: bool = False,
    xorout: int = 0,
) -> Union[int, npt.NDArray[np.uint16]]:
    """Computes a CRC of 3 to 16 bits with the parameters of the Rocksoft model: a number for bytes, an array for an
    array of rows."""
    rows = np.frombuffer(data, np.uint8) if isinstance(data, (bytes, bytearray)) else np.asarray(data, np.uint8)
    sums = _absenc.crc(np.atleast_2d(rows), width, poly, init, refin, refout, xorout)
    return int(sums[0]) if rows.ndim == 1 else sums
