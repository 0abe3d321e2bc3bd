# SPDX-License-Identifier: Apache-2.0
"""Which encoder is on a line."""
from __future__ import annotations

from typing import Any, NamedTuple

from . import _absenc


class Found(NamedTuple):
    """An encoder that explains what came."""

    unit: str
    settings: list[str]  #: the fewest that explain it: "model=23-bit"
    address: str  #: what `absenc.open` takes
    encoder: str  #: "address=3": which of several on the line
    line: str  #: "RS-485 half duplex, 2.5 Mbit/s"
    tried: int  #: exchanges that were looked at
    explained: int  #: of them
    log10_chance: float  #: of the probability that noise explains as many
    sure: bool  #: it is small enough
    identity: dict[str, Any]  #: of a line: what it says of itself, as its serial number


class Identified(NamedTuple):
    """The likeliest first."""

    found: list[Found]
    notes: list[str]  #: what could not be tried
    is_complete: bool  #: False: the time was over before all was tried


def identify(place: str, *, limit_s: float = 60) -> Identified:
    """Asks in every protocol that fits, at its rates and addresses, by reads that change nothing. `place` is a port:
    "/dev/ttyUSB0", "tcp:HOST:PORT", "spi:/dev/spidev0.0", "can0". Raises PortError, UsageError."""
    found, notes, is_complete = _absenc.identify(place, limit_s)
    return Identified([Found(**one) for one in found], notes, is_complete)
