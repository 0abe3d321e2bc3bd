# SPDX-License-Identifier: Apache-2.0
"""An encoder by its name."""
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

#: What is set and what was said of it: the document's words.
Alarm = Flag


class Info(NamedTuple):
    """Which encoder it is and what it tells of itself."""

    address: str  #: "tformat:/dev/ttyUSB0"
    unit: str  #: "tformat"
    name: str  #: maker and protocol, for people
    model: Optional[str]  #: None: none with these options
    options: list[str]  #: "name=value"
    answers: dict[str, dict[str, Field]]  #: what it answered, by command
    failures: dict[str, EncoderError]  #: which commands it did not answer


class Recorded(NamedTuple):
    """What a recording wrote."""

    paths: list[str]  #: the file, or its parts in their order
    readings: int
    failures: int  #: attempts to read
    gaps: int
    missed: int  #: readings that were due and not taken, in these gaps
    bytes: int


class Samples:
    """Samples at equal distances, for `for` and `async for`; one that was missed is left out. It goes on when the port
    is lost and comes back: look at `Sample.kind`."""

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
            self._encoder.stop(True)  # what waits in the thread ends
            self._thread.shutdown(wait=True)
            self._encoder.stop(False)
            raise
        if sample is None:
            self._thread.shutdown(wait=False)
            raise StopAsyncIteration
        return sample


class Memory:
    """The bytes of an encoder's memory. Whatever is written is read back."""

    def __init__(self, encoder: _absenc.Encoder) -> None:
        self._encoder = encoder

    def read(self, address: int, count: int = 1, *, page: int = 0) -> bytes:
        """`count` bytes from `address` on."""
        return self._encoder.memory_read(
            natural("address", address), natural("count", count), natural("page", page)
        )

    def write(self, address: int, data: bytes, *, page: int = 0, force: bool = False) -> int:
        """Writes those bytes that differ, each read back, and all of them once more at the end; returns how many
        differed. `force` writes also what is protected."""
        return self._encoder.memory_write(natural("address", address), data, natural("page", page), force)

    def dump(self) -> dict[tuple[int, int], int]:
        """All that a copy of the memory has: (page, address) to value."""
        return {(page, address): value for page, address, value in self._encoder.memory_dump()}


class Config:
    """What an encoder is set to."""

    def __init__(self, encoder: _absenc.Encoder) -> None:
        self._encoder = encoder

    @property
    def names(self) -> list[str]:
        """The settings that can be read."""
        return self._encoder.settings_names()

    def get(self, name: str) -> dict[str, Field]:
        """The values of one setting."""
        return self._encoder.settings_get(name)

    def set(self, name: str, *values: int, **named: int) -> dict[str, Field]:
        """Writes it, unless it is so already, and returns what the encoder says when it is asked anew. Nobody is
        asked. What reaches the encoder by this setting reaches it by the new one."""
        return self._encoder.settings_set(name, *values, **named)


class Encoder:
    """An open encoder, as `open` makes it: a context manager. Any thread may use it, one at a time; `close` ends what
    waits in others."""

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
        """Closes the port. What waits in another thread ends with Cancelled."""
        self._encoder.close()

    def read(self) -> Reading:
        """The position with all alarms. One that no second reading confirmed is not valid: `Reading.angle_deg` is None.
        Raises EncoderError, PortError."""
        return self._encoder.read()

    def samples(self, *, rate: float = 0, count: int = 0) -> Samples:
        """Readings with position beyond the end of the counter, and speed. `rate` in readings a second, 0: as fast as
        can be; `count` 0: without end."""
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
        """Writes readings to a new file for `load`: "log.csv", "log.jsonl" (JSON lines), "log.h5" (HDF5). `rate`
        readings a second, 0: as fast as can be; of `every` so many one is written, and each with other alarms than the
        one before. Ends after `count` of them or `seconds`, by `close` in another thread, or by Ctrl-C, which is raised
        once all is on the disk. Losses of the port and readings that could not be taken are rows. After `part_bytes` or
        `part_seconds` another file is begun: "log-0001.csv", "log-0002.csv". Raises UsageError, PortError."""
        size = None if part_bytes is None else natural("part_bytes", part_bytes, most=2**63 - 1)
        recorded = self._encoder.record(
            os.fspath(path), rate, natural("every", every, least=1), natural("count", count), seconds, size, part_seconds
        )
        return Recorded(*recorded)

    def run(self, command: str, *values: int, **arguments: int) -> dict[str, Field]:
        """A command of the unit (`commands`), what it told by field. Nobody is asked, even if it changes the encoder;
        what is written is read back."""
        return self._encoder.run(command, *values, **arguments)

    def alarms(self) -> Optional[list[Alarm]]:
        """The alarms that are raised now, each with what it means and what must be done; []: all are reported clear;
        None: the encoder does not report them all."""
        names = self._encoder.read_alarms().alarms
        return None if names is None else [flag for flag in self.protocol.alarms if flag.name in names]

    def info(self) -> Info:
        """Asks all that can be asked without an argument: who it is, its temperature, its settings."""
        answers: dict[str, dict[str, Field]] = {}
        failures: dict[str, EncoderError] = {}
        for name in self._encoder.questions():
            try:
                answers[name] = self._encoder.run(name)
            except EncoderError as error:
                failures[name] = error
        one = self._encoder
        return Info(one.address, one.unit, self.protocol.name, one.model, one.options, answers, failures)

    def scan(self) -> list[dict[str, Field]]:
        """Who answers on the line of an encoder with addresses."""
        return self._encoder.scan()

    @property
    def commands(self) -> dict[str, Command]:
        """What `run` takes, by name."""
        return self.protocol.commands

    @property
    def memory(self) -> Memory:
        """Its bytes."""
        return Memory(self._encoder)

    @property
    def change(self) -> Optional[str]:
        """The state of the last call that was to change the encoder: "not_sent", "confirmed", "refused", or "unknown":
        it was sent, and nothing good came back. None: there was none. What such a call raises has it too."""
        return self._encoder.change or None

    @property
    def config(self) -> Config:
        """What it is set to."""
        return Config(self._encoder)

    @property
    def protocol(self) -> Protocol:
        """The unit."""
        return protocol[self._encoder.unit]

    @property
    def address(self) -> str:
        """Without the options: "tformat:/dev/ttyUSB0"."""
        return self._encoder.address

    @property
    def options(self) -> list[str]:
        """ "name=value" of each that counts."""
        return self._encoder.options

    @property
    def notes(self) -> list[str]:
        """What could be better about the port, a sentence each."""
        return self._encoder.notes

    @property
    def counters(self) -> dict[str, int]:
        """Exchanges so far: "good", and errors by their names."""
        return self._encoder.counters()


def open(text: str, **options: Value) -> Encoder:
    """Opens "tformat:/dev/ttyUSB0?model=23-bit", "sim:esl", or a name of absenc.toml; keywords count as if they stood
    behind it. Raises PortError; UsageError, which names what is wrong and what is nearest."""
    return Encoder(text, texts(options))


def scan(text: str, **options: Value) -> list[dict[str, Field]]:
    """Opens, asks every address who is there, and closes."""
    with open(text, **options) as encoder:
        return encoder.scan()
