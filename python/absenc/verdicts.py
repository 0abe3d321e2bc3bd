# SPDX-License-Identifier: Apache-2.0
"""Whether an encoder is well, whether it keeps to its document, what frames tell of its options; which ports there are;
and the wires of a virtual encoder as a file."""
from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import NamedTuple, Optional, Union

from . import _absenc
from ._values import Value, natural, texts
from .errors import UsageError


class Finding(NamedTuple):
    """A defect, or a fact that is good to know."""

    id: str  #: "reply_late", as docs/doctor.md lists them
    severity: str  #: "note", "warning": it works, but not for long; "fault": it does not work
    evidence: str  #: what was seen
    cause: str  #: the most likely one
    action: str  #: what to do


class Examination(NamedTuple):
    """The verdict of `absenc doctor --json`."""

    ok: bool  #: nothing is to be mended
    findings: list[Finding]  #: in the order in which they are to be mended
    readings: int
    good: int  #: of them
    complete: bool  #: False: it was interrupted
    seconds: float  #: from the first to the last reading
    failures_below: float  #: the share of failures is below it, at 95 % confidence
    verdict: str  #: "good: ..." with what was looked at, or "first: ..." with what to mend first
    readings_per_second: Optional[float] = None
    echo: Optional[str] = None  #: whether the adapter hears what it sends
    latency_ms: Optional[float] = None  #: that the way to the line adds, where it is known
    quickest_reply_ms: Optional[float] = None  #: from the end of the request to the end of the reply; None: not known
    slowest_reply_ms: Optional[float] = None


class Clause(NamedTuple):
    """A rule of the encoder's document."""

    id: str
    document: str
    paragraph: str
    words: str
    verdict: str  #: "kept", "broken", "untested"
    evidence: str  #: what was seen and how often, or why nothing was


class Conformance(NamedTuple):
    """The verdict of `absenc conform --json`."""

    ok: bool  #: the verdict is "kept"
    protocol: str
    verdict: str  #: "broken" where any clause is, else "kept" where any is, else "untested"
    kept: int
    broken: int
    untested: int
    clauses: list[Clause]
    left: list[str]  #: commands that put back by hand what could not be: the encoder is changed


class OptionEvidence(NamedTuple):
    """Whether frames allow a value of an option that the document leaves open."""

    option: str
    value: Union[bool, int, str]
    possible: bool
    why: str
    frame: Optional[int] = None  #: the number, from 1 on, of the frame that excludes the value


class Probed(NamedTuple):
    """The result of `absenc probe --json`."""

    protocol: str
    ok: bool  #: some options explain all frames
    evidence: list[OptionEvidence]
    settled: list[str]  #: "name=value": the options to go on with; none: the defaults will do


class Waved(NamedTuple):
    """A waveform that was drawn."""

    results: int
    failures: int  #: of them
    seconds: float  #: of the whole waveform
    wires: list[str]


class Port(NamedTuple):
    """A port of this computer, as `absenc ports --json` prints it. None: not known, or not of this kind."""

    port: str  #: "/dev/ttyUSB0", "can0", "/dev/spidev0.0"
    kind: str  #: "serial", "can", "spi"
    lasting_name: Optional[str] = None  #: "/dev/serial/by-id/...", whatever else is plugged in
    maker: Optional[str] = None
    adapter: Optional[str] = None
    serial_number: Optional[str] = None
    chip: Optional[str] = None
    driver: Optional[str] = None
    latency_timer_ms: Optional[int] = None  #: so long the adapter holds back what it has received
    highest_rate: Optional[int] = None  #: bits a second
    may_open: Optional[bool] = None
    refusal: Optional[str] = None  #: why it may not
    in_use_by: Optional[str] = None  #: "absenc serve (process 4711)"


def doctor(
    text: str, *, seconds: float = 3, readings: int = 100_000, turning_s: float = 0, **options: Value
) -> Examination:
    """Looks from the port up and reads for so long; changes nothing. A port that does not open is a finding. With
    `turning_s` it then reads for so long while somebody turns the shaft. Text and options as for `open`. Raises
    UsageError."""
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
    """Tests an encoder against the clauses of its document. Nothing is written to it without `changes`, which puts back
    what it writes; `resets` loses its zero, turns and alarms as well. Raises UsageError, PortError, Failure."""
    if resets and not changes:
        raise UsageError("resets says what changes may lose: give both, or neither")
    found = json.loads(_absenc.conform(text, texts(options), natural("readings", readings, 1), changes, resets))
    found["clauses"] = [Clause(**one) for one in found["clauses"]]
    return Conformance(**found)


def probe(
    protocol: str, replies: Sequence[str], requests: Sequence[str] = (), *, model: str = "", **options: Value
) -> Probed:
    """Finds the options that the document of the protocol leaves open from captured frames. `replies` and `requests` are
    hexadecimal, in the same order; "" where one did not come or is not known. Raises UsageError."""
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
    (sigrok) or .csv (Saleae Logic 2), by the end of the name. Without commands it reads, `count` results at `rate` a
    second. Time is virtual and exact to the nanosecond. Raises UsageError, also where the file is there already,
    unless it `replaces` it."""
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
    """The ports of this computer behind which an encoder may be. None of them is opened."""
    return [Port(**json.loads(one)) for one in _absenc.ports()]
