# SPDX-License-Identifier: Apache-2.0
"""Decodes captures of an encoder's line to NumPy columns."""
from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _absenc
from ._values import Value, natural, texts

if TYPE_CHECKING:
    import pandas  # type: ignore[import]

Masked = np.ma.MaskedArray[Any, np.dtype[Any]]


class Column(NamedTuple):
    """Description of a column of a capture or recording."""

    name: str
    unit: str  #: unit of the values: "s", "deg", "us" ...; "": none
    dtype: str
    meaning: str


class Table:
    """A table: columns by name, or all `rows` as one structured masked array."""

    def __init__(self, rows: Masked, columns: dict[str, Column]) -> None:
        self.rows = rows
        self.columns = columns  #: descriptions of the columns, by name

    def __len__(self) -> int:
        return len(self.rows)

    def keys(self) -> list[str]:
        """Returns the names of the columns, so that `dict(recording)` has the values of each column."""
        return list(self.columns)

    def __getitem__(self, column: str) -> Masked:
        if column not in self.columns:
            raise KeyError(f"{column}: there are {', '.join(self.columns)}")
        return self.rows[column]  # type: ignore[no-any-return]

    def __repr__(self) -> str:
        return f"<absenc.{type(self).__name__} of {len(self)} rows: {', '.join(self.columns)}>"

    def to_pandas(self) -> pandas.DataFrame:
        """Returns the columns as a DataFrame; masked values become NaN or <NA>. Needs pandas."""
        import pandas

        nullable = {"i": "Int64", "u": "UInt64", "b": "boolean"}
        frame = {}
        for name in self.columns:
            values, missing = self.rows.data[name], np.asarray(self.rows.mask[name])
            series = pandas.Series(values, copy=False)
            if values.dtype.kind in nullable:
                series = series.astype(nullable[values.dtype.kind])
                series[missing] = pandas.NA
            frame[name] = series
        return pandas.DataFrame(frame)


class Capture(Table):
    """The exchanges on a line: `capture["angle_deg"]` is a column, `rows` has all columns as one structured masked
    array. A value that is missing or invalid is masked (and NaN in floats); texts and bytes are empty instead.

    Columns: `time_s`, `end_s`, `kind` ("exchange", "request", "reply", "noise"), `request` and `reply` (bytes; for CAN
    and clocked links text), `turnaround_us`, `angle_deg` (for linear encoders `position_mm`), each field of the unit,
    and `error` with `message`. Flags are numbers: `Protocol.flag_names` names them."""

    def __init__(self, rows: Masked, columns: dict[str, Column], notes: list[str]) -> None:
        super().__init__(rows, columns)
        self.notes = notes  #: damage of the file, and settings that were detected

    def good(self) -> npt.NDArray[np.bool_]:
        """Returns which rows have no error."""
        return np.asarray(self.rows.data["error"] == "", np.bool_)


def _masked(chunks: list[list[tuple[Any, npt.NDArray[np.bool_]]]], columns: list[Column]) -> Masked:
    count = sum(len(chunk[0][1]) for chunk in chunks)
    rows = np.empty(count, [(column.name, column.dtype) for column in columns])
    missing = np.zeros(count, [(column.name, "?") for column in columns])
    at = 0
    for i, chunk in enumerate(chunks):
        end = at + len(chunk[0][1])
        for column, (values, absent) in zip(columns, chunk):
            rows[column.name][at:end] = values
            if column.dtype != "O":
                missing[column.name][at:end] = absent
        chunks[i] = []  # releases the memory of the chunk, whose values are now in `rows`
        at = end
    return np.ma.MaskedArray(rows, mask=missing)  # type: ignore[no-untyped-call]


def _open(
    file: Union[str, os.PathLike[str]],
    unit: str,
    channel: Union[str, Iterable[str]],
    raw_channels: int,
    rate: int,
    baud: float,
    parity: str,
    model: str,
    options: dict[str, Value],
) -> _absenc.Rows:
    named = [one for one in ([channel] if isinstance(channel, str) else channel) if one]
    channels = natural("raw_channels", raw_channels)
    samples = natural("rate", rate, most=2**63 - 1)
    return _absenc.Rows(os.fspath(file), unit, named, channels, samples, baud, parity, model, texts(options))


def decode(
    file: Union[str, os.PathLike[str]],
    unit: str,
    *,
    channel: Union[str, Iterable[str]] = "",
    raw_channels: int = 0,
    rate: int = 0,
    baud: float = 0,
    parity: str = "",
    model: str = "",
    **options: Value,
) -> Capture:
    """Decodes a whole capture: a sigrok session, VCD, CSV or binary export of a logic analyser, a candump log, or bytes
    as text.

    `channel` is "D0", "clock=D0", or several of these; `raw_channels` is the number of channels of a file with raw
    samples, `rate` its samples per second; `baud` and `parity` ("none", "odd", "even") describe the line. Other
    keywords are options of the unit. Raises UsageError, Failure."""
    source = _open(file, unit, channel, raw_channels, rate, baud, parity, model, options)
    columns = [Column(*column) for column in source.columns()]
    chunks = list(iter(lambda: source.take(65536), None))
    by_name = {column.name: column for column in columns}
    return Capture(_masked([one for one in chunks if one is not None], columns), by_name, source.notes())


def decode_batches(
    file: Union[str, os.PathLike[str]],
    unit: str,
    *,
    rows: int = 65536,
    channel: Union[str, Iterable[str]] = "",
    raw_channels: int = 0,
    rate: int = 0,
    baud: float = 0,
    parity: str = "",
    model: str = "",
    **options: Value,
) -> Iterator[Capture]:
    """Decodes like `decode`, in captures of at most `rows` rows. The last capture has the notes."""
    most = natural("rows", rows, least=1)
    return _batches(_open(file, unit, channel, raw_channels, rate, baud, parity, model, options), most)


def _batches(source: _absenc.Rows, rows: int) -> Iterator[Capture]:
    columns = [Column(*column) for column in source.columns()]
    by_name = {column.name: column for column in columns}
    chunk = source.take(rows)
    while chunk is not None:
        following: Optional[list[tuple[Any, npt.NDArray[np.bool_]]]] = source.take(rows)
        notes = source.notes() if following is None else []
        yield Capture(_masked([chunk], columns), by_name, notes)
        chunk = following
