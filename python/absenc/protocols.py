# SPDX-License-Identifier: Apache-2.0
"""What is known of each unit, and its frames without a line: plain codecs."""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple, Union

import numpy as np
import numpy.typing as npt

from . import _absenc
from ._values import Field, Value, texts

#: Bytes, or text as people write frames: "1A 00", of CAN "1FF:022B", of clocked links "0001".
Frame = Union[bytes, bytearray, memoryview, str]


class Flag(NamedTuple):
    """One bit of a field of alarms or status."""

    field: str
    bit: int
    name: str
    meaning: str
    action: str  #: what the operator must do; "": nothing


class Command(NamedTuple):
    """What an encoder can be told."""

    name: str
    verb: str  #: what it is for
    meaning: str
    changes_encoder: bool
    arguments: tuple[str, ...]


class Protocol:
    """One unit: `absenc.protocol["tformat"]`."""

    def __init__(self, unit: str) -> None:
        told = _absenc.unit(unit)
        self.id: str = told["id"]
        self.name: str = told["name"]  #: maker and protocol, for people
        self.document: str = told["document"]  #: the source
        self.link: str = told["link"]  #: "half_duplex", "full_duplex", "exchange" (SPI), "clocked" or "can"
        self.line: str = told["line"]  #: "RS-485 half duplex, 2.5 Mbit/s"
        self.options: list[str] = told["options"]
        self.models: list[str] = told["models"]
        self.fields: list[str] = told["fields"]
        self.conditions: list[str] = told["conditions"]  #: of its virtual encoder
        self.flags: list[Flag] = [Flag(*flag) for flag in told["flags"]]  #: of alarms and status
        named = {flag.name: flag for flag in reversed(self.flags)}  # a status flag may have the name of an alarm
        self.alarms: list[Flag] = [named[name] for name in told["alarms"]]
        self.commands: dict[str, Command] = {
            one["name"]: Command(
                one["name"], one["verb"], one["meaning"], one["changes_encoder"], tuple(one["arguments"])
            )
            for one in told["commands"]
        }

    def __repr__(self) -> str:
        return f"<absenc.Protocol {self.id}: {self.name}>"

    def decode(self, reply: Frame, *, request: Frame = b"", model: str = "", **options: Value) -> dict[str, Field]:
        """The fields of a reply, checked as a host checks it; of an empty reply: those of the request. Raises
        EncoderError: the class says what is wrong. What does not hold is None."""
        return _absenc.decode_frame(self.id, _plain(reply), _plain(request), model, texts(options))

    def encode(self, command: str, *values: int, model: str = "", **options: Value) -> Union[bytes, str]:
        """The request of a command: bytes, on CAN text, on clocked links the bits that the host says."""
        return _absenc.encode_request(self.id, command, list(values), model, texts(options))

    def flag_names(self, field: str, bits: int) -> list[str]:
        """The names of the flags that are set in a number, as captures have it."""
        return [flag.name for flag in self.flags if flag.field == field and bits >> flag.bit & 1]


def _plain(frame: Frame) -> Union[bytes, str]:
    return frame if isinstance(frame, str) else memoryview(frame).tobytes()


class Protocols(Mapping[str, Protocol]):
    """All units by their names."""

    def __init__(self) -> None:
        self._made: dict[str, Protocol] = {}

    def __getitem__(self, unit: str) -> Protocol:
        if unit not in self._made:
            self._made[unit] = Protocol(unit)
        return self._made[unit]

    def __contains__(self, unit: object) -> bool:
        return unit in _absenc.units()

    def __iter__(self) -> Iterator[str]:
        return iter(_absenc.units())

    def __len__(self) -> int:
        return len(_absenc.units())


#: All units: protocol["tformat"]. A name that is none raises UsageError, which names the nearest.
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
    """A CRC of 3 to 16 bits in the parameters of the Rocksoft model: of bytes a number, of an array (n, length) of
    bytes an array of n."""
    rows = np.frombuffer(data, np.uint8) if isinstance(data, (bytes, bytearray)) else np.asarray(data, np.uint8)
    sums = _absenc.crc(np.atleast_2d(rows), width, poly, init, refin, refout, xorout)
    return int(sums[0]) if rows.ndim == 1 else sums
