# SPDX-License-Identifier: Apache-2.0
"""Loads recordings of `absenc record` as NumPy columns."""
from __future__ import annotations

import csv
import json
import os
import re
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from .captures import Column, Masked, Table
from .errors import Failure, UsageError
from .protocols import Protocol, protocol

FLAG_WORDS = "names, separated by spaces"  # a column whose meaning begins with these words contains names of flags
# text of a CSV cell for flags of which all are reported as clear; an empty cell means that not all flags were reported
ALL_CLEAR = "none"
# value of the attribute `rows` in an HDF5 file while the recording is still being written
NOT_ENDED = "18446744073709551615"

#: Values of one row, by column; None means that a value is missing or invalid.
Cells = Mapping[str, Any]


class Recording(Table):
    """Readings and events: `recording["angle_deg"]` is a column, `rows` has all columns as one structured masked array.
    A number that is missing or invalid is masked (and NaN in floats); a missing text is "".

    `event` is "" for a reading and "restarted" for one whose `position` starts again; the name of an error for a failed
    reading; "lost" and "back" concern the port; "gap" counts in `missed` the readings that were due but not taken.
    Flags are numbers: `Protocol.flag_names` names them.

    `is_whole`: the file has an end mark and as many rows as this states. `damage` describes an omitted last line that
    was truncated; it is "" otherwise."""

    def __init__(
        self, rows: Masked, columns: dict[str, Column], header: dict[str, str], is_whole: bool = False, damage: str = ""
    ) -> None:
        super().__init__(rows, columns)
        self.header = header
        self.is_whole = is_whole
        self.damage = damage

    def good(self) -> npt.NDArray[np.bool_]:
        """Returns which rows are readings."""
        return np.isin(self.rows.data["event"].astype(str), ["", "restarted"])


class _Kind(NamedTuple):
    dtype: str
    empty: Any
    of_text: Callable[[str], Any]


_REAL = _Kind("f8", np.nan, float)
_SIGNED = _Kind("i8", 0, int)
_UNSIGNED = _Kind("u8", 0, int)
_BOOLEAN = _Kind("?", False, {"true": True, "false": False}.__getitem__)
_TEXT = _Kind("O", "", str)
_WHOLE = {"position": _SIGNED, "singleturn": _UNSIGNED, "multiturn": _SIGNED, "missed": _UNSIGNED}
_UNITS = {"_mm_s": "mm/s", "_rpm": "rpm", "_deg": "deg", "_mm": "mm", "_um": "um", "_s": "s"}
_UNITS_BY_NAME = {"position": "counts", "singleturn": "counts", "multiturn": "revolutions"}


def _flags(unit: Protocol, field: str) -> _Kind:
    bits = {flag.name: 1 << flag.bit for flag in unit.flags if flag.field == field}
    return _Kind("u4", 0, lambda names: 0 if names == ALL_CLEAR else sum(bits[name] for name in names.split()))


def _kind(unit: Protocol, name: str, meaning: str) -> _Kind:
    if meaning.startswith(FLAG_WORDS):
        return _flags(unit, name)
    if name.endswith("_valid"):
        return _BOOLEAN
    return _TEXT if name == "event" else _WHOLE.get(name, _REAL)


def _unit_of(name: str) -> str:
    ending = next((ending for ending in _UNITS if name.endswith(ending)), "")
    return _UNITS_BY_NAME.get(name, _UNITS.get(ending, ""))


class _Parsed(NamedTuple):
    """A parsed text file whose cells are not converted yet."""

    header: dict[str, str]
    meanings: Mapping[str, str]
    names: Sequence[str]
    rows: Sequence[Cells]
    ends_after: Union[int, None]  # number of rows that the last line of the file states; None if there is no such line


def _recording(parsed: _Parsed, damage: str) -> Recording:
    unit = protocol[parsed.header["protocol"]]
    kinds = {name: _kind(unit, name, parsed.meanings.get(name, "")) for name in parsed.names}
    columns = {
        name: Column(name, _unit_of(name), kind.dtype, parsed.meanings.get(name, "")) for name, kind in kinds.items()
    }
    count = len(parsed.rows)
    rows = np.empty(count, [(name, kind.dtype) for name, kind in kinds.items()])
    missing = np.zeros(count, [(name, "?") for name in kinds])
    for name, kind in kinds.items():
        cells = [row.get(name) for row in parsed.rows]
        rows[name] = [
            kind.empty if value is None else kind.of_text(value) if isinstance(value, str) else value for value in cells
        ]
        if kind is not _TEXT:
            missing[name] = [value is None for value in cells]
    if parsed.ends_after not in (None, count):
        raise ValueError(f"it ended after {parsed.ends_after} rows, and {count} are there")
    is_whole = parsed.ends_after is not None and not damage
    masked: Masked = np.ma.MaskedArray(rows, mask=missing)  # type: ignore[no-untyped-call]
    return Recording(masked, columns, parsed.header, is_whole, damage)


def _parse_csv(lines: list[str]) -> _Parsed:
    end = re.fullmatch("# end: ([0-9]+) rows", lines[-1])
    if end:
        lines = lines[:-1]
    head = [line[2:] for line in lines if line.startswith("# ")]
    notes = dict(line.split(": ", 1) for line in head if ": " in line)
    names, *table = csv.reader(line for line in lines if not line.startswith("#"))
    for number, cells in enumerate(table, len(lines) - len(table) + 1):
        if len(cells) != len(names):
            raise ValueError(f"line {number} has {len(cells)} cells for {len(names)} columns")
    header = {name: value for name, value in notes.items() if name not in names}
    rows = [{name: value or None for name, value in zip(names, cells)} for cells in table]
    return _Parsed(header, notes, names, rows, int(end[1]) if end else None)


def _parse_json_lines(lines: list[str]) -> _Parsed:
    head, *rows = [json.loads(line) for line in lines]
    ends_after = int(rows.pop()["rows"]) if rows and "absenc_end" in rows[-1] else None
    meanings: dict[str, str] = head.pop("units")
    names: list[str] = []
    for name in meanings:
        names.append(name)
        # `singleturn` and `multiturn` are the only columns with a further column that states whether the value is valid
        if name in ("singleturn", "multiturn"):
            names.append(name + "_valid")
    for row in rows:
        for name, value in row.items():
            if isinstance(value, list):
                row[name] = " ".join(value)
    header = {name: f"{value:g}" if isinstance(value, float) else str(value) for name, value in head.items()}
    del header["absenc_record"]
    return _Parsed(header, meanings, names, rows, ends_after)


def _open_hdf5(h5py: Any, path: Path) -> Any:
    try:
        return h5py.File(path, "r")
    except FileNotFoundError:
        raise
    except OSError as error:
        if not os.access(path, os.R_OK):
            raise
        if path.stat().st_size == 0:
            raise Failure(f"{path} is empty: its recording ended before it began") from error
        raise Failure(f"{path} cannot be opened as HDF5, it is damaged or something else: {error}") from error


def _load_hdf5(path: Path) -> Recording:
    try:
        import h5py  # type: ignore[import]
    except ImportError as error:
        raise Failure("recordings in HDF5 need h5py: Debian's package is python3-h5py") from error
    with _open_hdf5(h5py, path) as file:
        attributes = {
            name: value.decode() if isinstance(value, bytes) else f"{value:g}" if value.dtype.kind == "f" else str(value)
            for name, value in file.attrs.items()
        }
        if attributes.pop("absenc_record", "") != "1":
            raise Failure(f"{path} is HDF5, but no recording of absenc")
        names = attributes.pop("columns").split(",")
        ended = attributes.pop("rows", NOT_ENDED)
        # `time_s` is written last: if the program was killed, the other columns may have more rows
        count = len(file["time_s"])
        dtypes = {
            name: "O" if type.kind == "S" else "?" if type == np.int8 else f"{type.kind}{type.itemsize}"
            for name, type in ((name, file[name].dtype) for name in names)
        }
        rows = np.empty(count, [(name, dtype) for name, dtype in dtypes.items()])
        missing = np.zeros(count, [(name, "?") for name in names])
        columns = {}
        for name in names:
            data, about = file[name][:count], file[name].attrs
            empty = about["missing_value"]
            if dtypes[name] == "O":
                rows[name] = np.char.decode(data, "utf-8")
            else:
                missing[name] = np.isnan(data) if data.dtype.kind == "f" else data == empty
                rows[name] = np.where(missing[name], np.nan if data.dtype.kind == "f" else 0, data)
            unit, meaning = (about.get(key, b"").decode() for key in ("unit", "meaning"))
            columns[name] = Column(name, unit, dtypes[name], meaning)
    if ended not in (NOT_ENDED, str(count)):
        raise Failure(f"{path} is damaged: it ended after {ended} rows, and {count} are there")
    masked: Masked = np.ma.MaskedArray(rows, mask=missing)  # type: ignore[no-untyped-call]
    return Recording(masked, columns, attributes, ended != NOT_ENDED)


def load(file: Union[str, os.PathLike[str]]) -> Recording:
    """Loads a recording of `absenc record`, whose name ends in .csv, .jsonl, .ndjson, .h5 or .hdf5.

    A last line without a line end is omitted, which a warning and `Recording.damage` report. Raises UsageError,
    Failure, OSError."""
    path = Path(file)
    if path.suffix in (".h5", ".hdf5"):
        try:
            return _load_hdf5(path)
        except (ValueError, KeyError, TypeError, RuntimeError) as error:
            raise Failure(f"{path} is damaged: {error!r}") from error
    parsers = {".csv": _parse_csv, ".jsonl": _parse_json_lines, ".ndjson": _parse_json_lines}
    if path.suffix not in parsers:
        raise UsageError(f"{path} is no recording by its name: it must end in {', '.join(parsers)}, .h5 or .hdf5")
    content = path.read_bytes()
    if not content.startswith((b"# absenc record 1\n", b'{"absenc_record":1,')):
        raise Failure(f"{path} does not begin as a recording does")
    whole, _, cut = content.rpartition(b"\n")
    damage = f"the last line has no end ({len(cut)} bytes) and is left out" if cut else ""
    try:
        recording = _recording(parsers[path.suffix](whole.decode().split("\n")), damage)
    except (ValueError, KeyError, TypeError, IndexError, AttributeError, OverflowError, csv.Error) as error:
        raise Failure(f"{path} is damaged: {error!r}") from error
    if damage:
        warnings.warn(f"{path}: {damage}", stacklevel=2)
    return recording
