# SPDX-License-Identifier: Apache-2.0
"""Virtual encoders that whoever opens them finds as real ones."""
from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import Optional

from . import _absenc
from ._values import Value, texts
from .protocols import Protocol, protocol


class Emulation:
    """A virtual encoder that serves in a thread of its own, as `emulate` makes it: a context manager. What is done to
    it is so when the call returns."""

    def __init__(self, text: str, link: str, tcp: Optional[int]) -> None:
        self._one: Optional[_absenc.Emulation] = _absenc.Emulation(text, link, tcp)

    @property
    def _emulation(self) -> _absenc.Emulation:
        if self._one is None:
            raise RuntimeError("this virtual encoder has ended")
        return self._one

    def __enter__(self) -> Emulation:
        return self

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    def close(self) -> None:
        """Nobody answers any more, and its port goes away."""
        self._one = None

    @property
    def path(self) -> str:
        """The pseudo-terminal, or the link to it: of an encoder on a CAN bus that of an slcan adapter."""
        return self._emulation.path

    @property
    def tcp_port(self) -> int:
        """On 127.0.0.1; 0 without."""
        return self._emulation.tcp_port

    @property
    def address(self) -> str:
        """What `absenc.open` takes: "tformat:/dev/pts/3"."""
        return self._emulation.address

    @property
    def protocol(self) -> Protocol:
        """The unit: the names of its alarms and conditions are there."""
        return protocol[self._emulation.unit]

    def power_off(self) -> None:
        """It answers no more."""
        self._emulation.power_off()

    def power_on(self, *, real: bool = False) -> None:
        """`real`: with the document's start-up time."""
        self._emulation.power_on(real)

    def raise_alarm(self, name: str) -> None:
        """One of `protocol.alarms`. Raises UsageError, which names the nearest."""
        self._emulation.raise_alarm(name)

    def lower_alarm(self, name: str) -> None:
        """Its cause is over."""
        self._emulation.lower_alarm(name)

    def set_condition(self, name: str, value: int) -> None:
        """One of `protocol.conditions`, as "temperature" in degC or "battery", in the units of `absenc list`."""
        self._emulation.set_condition(name, value)

    def set_fault(self, kind: str, rate: float) -> None:
        """How often replies are damaged from now on, 0 to 1: "corrupt", "drop" ... The other kinds stay."""
        self._emulation.set_fault(kind, rate)

    def clear_faults(self) -> None:
        """None of any kind."""
        self._emulation.clear_faults()

    @property
    def answer_count(self) -> int:
        """Requests that were answered."""
        return self._emulation.answer_count()

    @property
    def violations(self) -> int:
        """Rules of the document that the host broke."""
        return self._emulation.violations()

    @property
    def first_violation(self) -> str:
        """The first of them; "": none."""
        return self._emulation.first_violation()


def emulate(
    unit: str,
    *,
    motion: str = "still",
    conditions: Optional[Mapping[str, int]] = None,
    faults: Optional[Mapping[str, float]] = None,
    link: str = "",
    tcp: Optional[int] = None,
    **options: Value,
) -> Emulation:
    """A virtual encoder of what goes over characters or CAN, on a pseudo-terminal.

    `motion` is "still", "rpm=R", "sine=DEGREES,HZ" or "file=CSV"; `conditions` as {"temperature": 80} and `faults` as
    {"corrupt": 0.01} are there from the start; `link` is a path that shall lead to the pseudo-terminal; with `tcp` it
    also listens on that port of 127.0.0.1, 0: a free one. Other keywords are options of the unit, `model` and
    `singleturn`, `multiturn`, `alarm`, `seed`, `echo`. Raises UsageError, PortError."""
    settings = [f"motion={motion}"]
    settings += [f"condition={name}={value}" for name, value in (conditions or {}).items()]
    settings += [f"fault={kind}={rate}" for kind, rate in (faults or {}).items()]
    settings += texts(options)
    return Emulation(unit + ("&" if "?" in unit else "?") + "&".join(settings), link, tcp)
