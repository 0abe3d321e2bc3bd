# SPDX-License-Identifier: Apache-2.0
"""Virtual encoders, at ports that programs open like those of real encoders."""
from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import Optional

from . import _absenc
from ._values import Value, texts
from .protocols import Protocol, protocol


class Emulation:
    """A virtual encoder that replies in its own thread: the context manager that `emulate` returns."""

    def __init__(self, text: str, link: str, tcp: Optional[int]) -> None:
        self._native: Optional[_absenc.Emulation] = _absenc.Emulation(text, link, tcp)

    @property
    def _emulation(self) -> _absenc.Emulation:
        if self._native is None:
            raise RuntimeError("this virtual encoder has ended")
        return self._native

    def __enter__(self) -> Emulation:
        return self

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the virtual encoder and removes its port."""
        self._native = None

    @property
    def path(self) -> str:
        """Path of the pseudo-terminal or of the link to it; on CAN, of an emulated slcan adapter."""
        return self._emulation.path

    @property
    def tcp_port(self) -> int:
        """Number of the TCP port on 127.0.0.1; 0 without the argument `tcp`."""
        return self._emulation.tcp_port

    @property
    def address(self) -> str:
        """Address for `absenc.open`: "tformat:/dev/pts/3"."""
        return self._emulation.address

    @property
    def protocol(self) -> Protocol:
        """The protocol of the virtual encoder, with the names of its alarms and conditions."""
        return protocol[self._emulation.unit]

    def power_off(self) -> None:
        """Switches the encoder off: it no longer replies."""
        self._emulation.power_off()

    def power_on(self, *, real: bool = False) -> None:
        """Switches the encoder on. `real`: the encoder needs the start-up time of its document."""
        self._emulation.power_on(real)

    def raise_alarm(self, name: str) -> None:
        """Raises an alarm of `protocol.alarms`; UsageError if the encoder cannot report it."""
        self._emulation.raise_alarm(name)

    def lower_alarm(self, name: str) -> None:
        """Ends the cause of an alarm; a latched alarm is reported until a host clears it."""
        self._emulation.lower_alarm(name)

    def set_condition(self, name: str, value: int) -> None:
        """Sets one of `protocol.conditions`, such as "temperature", in the units of `absenc list`."""
        self._emulation.set_condition(name, value)

    def set_fault(self, kind: str, rate: float) -> None:
        """Sets the probability of a kind of fault, 0 to 1: "corrupt", "drop" ..."""
        self._emulation.set_fault(kind, rate)

    def clear_faults(self) -> None:
        """Ends faults of all kinds."""
        self._emulation.clear_faults()

    @property
    def answer_count(self) -> int:
        """Number of requests that the encoder replied to."""
        return self._emulation.answer_count()

    @property
    def violations(self) -> int:
        """Number of violations of the document by the host."""
        return self._emulation.violations()

    @property
    def first_violation(self) -> str:
        """The first violation of the document by the host, as words; "": none."""
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
    """Starts a virtual encoder, of a protocol with characters or CAN frames, on a pseudo-terminal.

    `motion` is "still", "rpm=R", "sine=DEGREES,HZ" or "file=CSV"; `conditions`, {"temperature": 80}, and `faults`,
    {"corrupt": 0.01}, apply from the start; `link` is the path of a symbolic link to the pseudo-terminal; with `tcp` it
    also listens on that port of 127.0.0.1, 0: any free port. Other keywords are options of the unit or of the virtual
    encoder, such as `model`, `alarm`, `seed`. Raises UsageError, PortError."""
    settings = [f"motion={motion}"]
    settings += [f"condition={name}={value}" for name, value in (conditions or {}).items()]
    settings += [f"fault={kind}={rate}" for kind, rate in (faults or {}).items()]
    settings += texts(options)
    return Emulation(unit + ("&" if "?" in unit else "?") + "&".join(settings), link, tcp)
