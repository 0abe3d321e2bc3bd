# SPDX-License-Identifier: Apache-2.0
"""Opens encoders by address or name."""
from __future__ import annotations

import asyncio
import os
from collections.abc import AsyncIterator, Iterator
from concurrent.futures import ThreadPoolExecutor
from types import TracebackType
from typing import NamedTuple, Optional, Union

from . import _absenc
from ._absenc import Reading, Sample
from ._values import Field, Value, natural, texts
from .errors import EncoderError
from .protocols import Command, Flag, Protocol, protocol

#: A raised alarm, with its meaning and action from the document.
Alarm = Flag


class Info(NamedTuple):
    """Identification of an encoder, and its replies to commands that only read."""

    address: str  #: address: "tformat:/dev/ttyUSB0"
    unit: str  #: id of the protocol: "tformat"
    name: str  #: maker and protocol, for people
    model: Optional[str]  #: name of the model; None: no model has these options
    options: list[str]  #: options in effect: "name=value"
    answers: dict[str, dict[str, Field]]  #: replies, by command
    failures: dict[str, EncoderError]  #: errors of commands that failed, by command


class Recorded(NamedTuple):
    """Summary of a recording that `Encoder.record` has written."""

    paths: list[str]  #: path of the recording, or of its parts in order
    readings: int
    failures: int  #: failed attempts to read
    gaps: int
    missed: int  #: readings that were due but not taken, in all gaps
    bytes: int


class Samples:
    """Samples of an encoder, for `for` and `async for`. They continue when the port is lost: check `Sample.kind`."""

    def __init__(self, encoder: _absenc.Encoder, rate: float, count: int) -> None:
        self._encoder = encoder
        encoder.stop(False)
        self._samples = encoder.samples(rate, count)
        self._thread: Optional[ThreadPoolExecutor] = None

    def __iter__(self) -> Iterator[Sample]:
        return self

    def __next__(self) -> Sample:
        return self._samples.next()

    def __aiter__(self) -> AsyncIterator[Sample]:
        return self

    def _next(self) -> Optional[Sample]:
        try:
            return self._samples.next()
        except StopIteration:
            return None

    async def __anext__(self) -> Sample:
        if self._thread is None:
            self._thread = ThreadPoolExecutor(1, "absenc samples")
        try:
            sample = await asyncio.get_running_loop().run_in_executor(self._thread, self._next)
        except asyncio.CancelledError:
            self._encoder.stop(True)  # makes the thread, which waits for the next sample, return at once
            self._thread.shutdown(wait=True)
            self._encoder.stop(False)
            raise
        if sample is None:
            self._thread.shutdown(wait=False)
            raise StopAsyncIteration
        return sample


class Memory:
    """Access to the memory of an encoder. Written bytes are read back."""

    def __init__(self, encoder: _absenc.Encoder) -> None:
        self._encoder = encoder

    def read(self, address: int, count: int = 1, *, page: int = 0) -> bytes:
        """Returns the bytes at `count` addresses: one each, or a word, low byte first."""
        return self._encoder.memory_read(
            natural("address", address), natural("count", count), natural("page", page)
        )

    def write(self, address: int, data: bytes, *, page: int = 0, force: bool = False) -> int:
        """Writes the bytes that differ and reads them back. Returns the number of addresses at which they differed.
        `force` also writes protected bytes."""
        return self._encoder.memory_write(natural("address", address), data, natural("page", page), force)

    def dump(self) -> dict[tuple[int, int], int]:
        """Reads all memory that belongs to a dump, and returns the values by (page, address)."""
        return {(page, address): value for page, address, value in self._encoder.memory_dump()}


class Config:
    """Access to the settings of an encoder."""

    def __init__(self, encoder: _absenc.Encoder) -> None:
        self._encoder = encoder

    @property
    def names(self) -> list[str]:
        """Names of the settings that can be read."""
        return self._encoder.settings_names()

    def get(self, name: str) -> dict[str, Field]:
        """Reads one setting and returns its values by name."""
        return self._encoder.settings_get(name)

    def set(self, name: str, *values: int, **named: int) -> dict[str, Field]:
        """Writes a setting without asking for confirmation, and returns its values."""
        return self._encoder.settings_set(name, *values, **named)


class Encoder:
    """An open encoder: the context manager that `open` returns. Threads may share it."""

    def __init__(self, text: str, settings: list[str]) -> None:
        self._encoder = _absenc.Encoder(text, settings)

    def __enter__(self) -> Encoder:
        return self

    def __exit__(
        self, kind: Optional[type[BaseException]], error: Optional[BaseException], trace: Optional[TracebackType]
    ) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<absenc.Encoder {self.address}>"

    def close(self) -> None:
        """Closes the port and ends calls in other threads."""
        self._encoder.close()

    def read(self) -> Reading:
        """Reads the position with its alarms; an unconfirmed position is None. Raises EncoderError, Failure, PortError,
        Cancelled or UsageError."""
        return self._encoder.read()

    def samples(self, *, rate: float = 0, count: int = 0) -> Samples:
        """Returns samples with speed and a position that continues past the end of the counter. `rate`: readings per
        second, 0: as fast as possible; `count`: 0 without limit."""
        return Samples(self._encoder, rate, natural("count", count))

    def record(
        self,
        path: Union[str, os.PathLike[str]],
        *,
        rate: float = 100,
        every: int = 1,
        count: int = 0,
        seconds: Optional[float] = None,
        part_bytes: Optional[int] = None,
        part_seconds: Optional[float] = None,
    ) -> Recorded:
        """Writes readings to a new file for `load`: "log.csv", "log.jsonl" (JSON lines), "log.h5" (HDF5). `rate`:
        readings per second, 0: as fast as possible. Writes every `every`th reading, and each change of the alarms. Ends
        after `count` readings or `seconds`, or by `close` in another thread. After `part_bytes` or `part_seconds` the
        next file is started: "log-0001.csv", "log-0002.csv". Raises UsageError, Failure, PortError."""
        size = None if part_bytes is None else natural("part_bytes", part_bytes, most=2**63 - 1)
        recorded = self._encoder.record(
            os.fspath(path), rate, natural("every", every, least=1), natural("count", count), seconds, size, part_seconds
        )
        return Recorded(*recorded)

    def run(self, command: str, *values: int, **arguments: int) -> dict[str, Field]:
        """Runs a command of the unit, without asking for confirmation, and returns the fields of its reply."""
        return self._encoder.run(command, *values, **arguments)

    def alarms(self) -> Optional[list[Alarm]]:
        """Reads the raised alarms, with meaning and action; []: all are reported clear; None: not known."""
        names = self._encoder.read_alarms().alarms
        return None if names is None else [flag for flag in self.protocol.alarms if flag.name in names]

    def info(self) -> Info:
        """Runs commands that only read and need no arguments, and returns their replies."""
        answers: dict[str, dict[str, Field]] = {}
        failures: dict[str, EncoderError] = {}
        for name in self._encoder.questions():
            try:
                answers[name] = self._encoder.run(name)
            except EncoderError as error:
                failures[name] = error
        native = self._encoder
        return Info(native.address, native.unit, self.protocol.name, native.model, native.options, answers, failures)

    def scan(self) -> list[dict[str, Field]]:
        """Polls all addresses on the line and returns the encoders that reply."""
        return self._encoder.scan()

    @property
    def commands(self) -> dict[str, Command]:
        """Commands of the protocol that `run` accepts, by name."""
        return self.protocol.commands

    @property
    def memory(self) -> Memory:
        """Access to the memory of the encoder."""
        return Memory(self._encoder)

    @property
    def change(self) -> Optional[str]:
        """State of the last call that changes the encoder: "not_sent", "confirmed", "refused" or "unknown". None: no
        such call."""
        return self._encoder.change or None

    @property
    def config(self) -> Config:
        """Access to the settings of the encoder."""
        return Config(self._encoder)

    @property
    def protocol(self) -> Protocol:
        """The protocol of the encoder."""
        return protocol[self._encoder.unit]

    @property
    def address(self) -> str:
        """Address of the encoder without options: "tformat:/dev/ttyUSB0"."""
        return self._encoder.address

    @property
    def options(self) -> list[str]:
        """Options in effect, as "name=value"."""
        return self._encoder.options

    @property
    def notes(self) -> list[str]:
        """Recommendations for the port, one sentence each."""
        return self._encoder.notes

    @property
    def counters(self) -> dict[str, int]:
        """Number of exchanges so far: "good", and each error that occurred, by its name."""
        return self._encoder.counters()


def open(text: str, **options: Value) -> Encoder:
    """Opens "tformat:/dev/ttyUSB0?model=23-bit", "sim:esl", or a name in absenc.toml. Keywords are options. With
    realtime=PRIORITY, 1 to 99, each thread that uses the encoder becomes a real-time thread (SCHED_FIFO) and stays one,
    and the memory of the process is locked. Raises PortError, UsageError, or Failure if the kernel refuses that."""
    return Encoder(text, texts(options))


def scan(text: str, **options: Value) -> list[dict[str, Field]]:
    """Opens a line, polls all addresses, closes it, and returns the encoders that reply."""
    with open(text, **options) as encoder:
        return encoder.scan()
