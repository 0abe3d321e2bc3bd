# SPDX-License-Identifier: Apache-2.0
"""Diagnosis, conformance tests, options found from frames, ports, and waveform files."""
from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import NamedTuple, Optional, Union

from . import _absenc
from ._values import Value, natural, texts
from .errors import UsageError


class Finding(NamedTuple):
    """A fault, a warning or a note about an encoder or its line."""

    id: str  #: kind of finding: "reply_late", see docs/doctor.md
    severity: str  #: "note"; "warning": may fail soon; "fault": does not work
    evidence: str  #: observation that led to the finding
    cause: str  #: most likely cause
    action: str  #: recommended action


class Examination(NamedTuple):
    """The verdict of `absenc doctor --json`."""

    ok: bool  #: the examination is complete, and no finding needs a repair
    findings: list[Finding]  #: in the order in which to fix them
    readings: int
    good: int  #: readings without an error
    complete: bool  #: False: the examination was interrupted
    seconds: float  #: time from the first to the last reading
    failures_below: float  #: upper limit of the share of failures, at 95 % confidence
    verdict: str  #: "good: ..." with the checks, "first: ..." with what to fix first, or "interrupted: ..."
    readings_per_second: Optional[float] = None
    echo: Optional[str] = None  #: text: whether the adapter receives its own transmission; None: unknown
    latency_ms: Optional[float] = None  #: latency that adapter and driver add, if known
    computer_late_ms: Optional[float] = None  #: greatest delay of this computer itself, if measured
    quickest_reply_ms: Optional[float] = None  #: shortest time from a request to the end of its reply
    slowest_reply_ms: Optional[float] = None  #: longest time from a request to the end of its reply
    not_looked_at: Sequence[str] = ()  #: possible faults that the readings could not show, with the reason


class Clause(NamedTuple):
    """A clause of the encoder's document, with its verdict."""

    id: str
    document: str
    paragraph: str
    words: str
    verdict: str  #: verdict on the clause: "kept", "broken", "untested"
    evidence: str  #: observations and their number, or why it is untested


class Conformance(NamedTuple):
    """The verdict of `absenc conform --json`."""

    ok: bool  #: the verdict is "kept"
    protocol: str
    verdict: str  #: "broken" if any clause is, else "kept" if any is, else "untested"
    kept: int
    broken: int
    untested: int
    clauses: list[Clause]
    left: list[str]  #: commands to restore values that could not be restored automatically


class OptionEvidence(NamedTuple):
    """Evidence for or against one value of an option."""

    option: str
    value: Union[bool, int, str]
    possible: bool
    why: str
    frame: Optional[int] = None  #: number, from 1, of the frame that excludes the value


class Probed(NamedTuple):
    """The result of `absenc probe --json`."""

    protocol: str
    ok: bool  #: a combination of options explains all frames
    evidence: list[OptionEvidence]
    settled: list[str]  #: "name=value": options that the frames require; empty: the defaults, or not `ok`


class Waved(NamedTuple):
    """Summary of a waveform file."""

    results: int
    failures: int  #: failed results
    seconds: float  #: duration of the waveform
    wires: list[str]


class Port(NamedTuple):
    """A port of this computer. None: unknown, or not applicable."""

    port: str  #: name of the port: "/dev/ttyUSB0", "can0", "/dev/spidev0.0"
    kind: str  #: kind of port: "serial", "can", "spi"
    lasting_name: Optional[str] = None  #: name that does not depend on other adapters: "/dev/serial/by-id/..."
    maker: Optional[str] = None
    adapter: Optional[str] = None
    serial_number: Optional[str] = None
    chip: Optional[str] = None
    driver: Optional[str] = None
    latency_timer_ms: Optional[int] = None  #: how long the adapter may delay received bytes
    highest_rate: Optional[int] = None  #: highest bit rate, bits per second
    may_open: Optional[bool] = None
    refusal: Optional[str] = None  #: why the port may not be opened
    in_use_by: Optional[str] = None  #: process that uses the port: "absenc serve (process 4711)"


def doctor(
    text: str, *, seconds: float = 3, readings: int = 100_000, turning_s: float = 0, **options: Value
) -> Examination:
    """Examines port, line and encoder; changes nothing. It reads for `seconds` or until it has `readings`; with
    `turning_s` also while the user turns the shaft. Text and options are as for `open`. Raises UsageError."""
    if not seconds > 0:
        raise UsageError(f"seconds is greater than 0, not {seconds!r}")
    found = json.loads(
        _absenc.doctor(text, texts(options), seconds, natural("readings", readings, 1), max(turning_s, 0))
    )
    found["findings"] = [Finding(**one) for one in found["findings"]]
    return Examination(**found)


def conform(
    text: str, *, readings: int = 100, changes: bool = False, resets: bool = False, **options: Value
) -> Conformance:
    """Tests an encoder against the clauses of its document. `changes` permits writing; `resets` also permits tests that
    lose zero, turns and alarms. Raises UsageError, PortError, Failure."""
    if resets and not changes:
        raise UsageError("resets needs changes: give both, or neither")
    found = json.loads(_absenc.conform(text, texts(options), natural("readings", readings, 1), changes, resets))
    found["clauses"] = [Clause(**one) for one in found["clauses"]]
    return Conformance(**found)


def probe(
    protocol: str, replies: Sequence[str], requests: Sequence[str] = (), *, model: str = "", **options: Value
) -> Probed:
    """Finds options that the protocol's document leaves open, from captured frames. `replies` and `requests`: texts in
    the same order, "" for a missing frame. Raises UsageError."""
    found = json.loads(_absenc.probe(protocol, model, texts(options), list(replies), list(requests)))
    found["evidence"] = [OptionEvidence(**one) for one in found["evidence"]]
    return Probed(**found)


def wave(
    text: str,
    file: Union[str, os.PathLike[str]],
    *,
    commands: Sequence[str] = (),
    count: int = 1,
    rate: float = 1000,
    samples_per_second: int = 0,
    replaces: bool = False,
    **options: Value,
) -> Waved:
    """Writes a conversation with a virtual encoder ("tformat", "sim:esl?fault=corrupt=0.1") as a waveform: .vcd, .sr
    (sigrok) or .csv (Saleae Logic 2), by the end of the name. Without commands it reads `count` results at `rate` per
    second. `replaces` permits an existing file. Raises UsageError, Failure, PortError."""
    return Waved(
        *_absenc.wave(
            text,
            texts(options),
            os.fspath(file),
            list(commands),
            natural("count", count, 1),
            rate,
            natural("samples_per_second", samples_per_second),
            replaces,
        )
    )


def ports() -> list[Port]:
    """Returns the ports of this computer that an encoder may be connected to."""
    return [Port(**json.loads(one)) for one in _absenc.ports()]
