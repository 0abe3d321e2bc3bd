# SPDX-License-Identifier: Apache-2.0
"""Identifies the encoder on a line."""
from __future__ import annotations

from typing import Any, NamedTuple

from . import _absenc


class Found(NamedTuple):
    """An encoder that explains the received frames."""

    unit: str
    settings: list[str]  #: the fewest settings that explain the frames: "model=23-bit"
    address: str  #: address for `absenc.open`
    encoder: str  #: which encoder, if several share the line: "address=3"
    line: str  #: kind of line: "RS-485 half duplex, 2.5 Mbit/s"
    tried: int  #: number of exchanges
    explained: int  #: number of exchanges that this encoder explains
    log10_chance: float  #: log10 of the probability that noise explains as many exchanges
    sure: bool  #: `log10_chance` is small enough to exclude chance
    identity: dict[str, Any]  #: identification read from the encoder, such as its serial number


class Identified(NamedTuple):
    """Result of `identify`."""

    found: list[Found]  #: most likely first
    notes: list[str]  #: attempts that were not possible, and identities that could not be read
    is_complete: bool  #: False: `limit_s` expired before all attempts


def identify(place: str, *, limit_s: float = 60) -> Identified:
    """Finds the encoder on a line, by reading only. `place` is a port: "/dev/ttyUSB0", ``tcp:HOST:PORT``,
    "spi:/dev/spidev0.0", "can0". Raises PortError, UsageError."""
    found, notes, is_complete = _absenc.identify(place, limit_s)
    return Identified([Found(**one) for one in found], notes, is_complete)
