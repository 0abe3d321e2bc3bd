# SPDX-License-Identifier: Apache-2.0
"""Recordings of `absenc record` as columns of NumPy."""
from __future__ import annotations

import csv
import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Union

import numpy as np
import numpy.typing as npt

from .captures import Column, Masked, Table
from .errors import Failure, UsageError
from .protocols import Protocol, protocol

FLAG_WORDS = "names, separated by spaces"  # how a header begins what it says of flags
ALL_CLEAR = "none"  # of flags in CSV; an empty cell: they are not reported

#: What a file tells of one row, by column; None: not told, or it does not hold.
Cells = Mapping[str, Any]


class Recording(Table):
    """Readings in the order of their time, and what came between: `recording["angle_deg"]` is a column, `rows` all of
    them as one structured masked array. Where nothing was told, or a position does not hold, it is masked (and NaN in
    floats).

    `event` is "" of a reading and "restarted" of one whose `position` starts again; "lost" and "back" are of the port,
    "gap" has in `missed` how many readings were due and not taken, all others are errors that came in place of a
    reading. `header` has what the file begins with: "encoder", "protocol", "model", "options", "started" ... Flags are
    numbers: `Protocol.flag_names` names them; 0: all are reported clear, masked: not all are reported."""

    def __init__(self, rows: Masked, columns: dict[str, Column], header: dict[str, str]) -> None:
        super().__init__(rows, columns)
        self.header = header

    def good(self) -> npt.NDArray[np.bool_]:
        """Which rows are readings."""
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


def _recording(
    header: dict[str, str], meanings: Mapping[str, str], names: Iterable[str], lines: Sequence[Cells]
) -> Recording:
    unit = protocol[header["protocol"]]
    kinds = {name: _kind(unit, name, meanings.get(name, "")) for name in names}
    columns = {name: Column(name, _unit_of(name), kind.dtype, meanings.get(name, "")) for name, kind in kinds.items()}
    rows = np.empty(len(lines), [(name, kind.dtype) for name, kind in kinds.items()])
    missing = np.zeros(len(lines), [(name, "?") for name in kinds])
    for name, kind in kinds.items():
        told = [line.get(name) for line in lines]
        rows[name] = [
            kind.empty if value is None else kind.of_text(value) if isinstance(value, str) else value for value in told
        ]
        if kind is not _TEXT:
            missing[name] = [value is None for value in told]
    return Recording(np.ma.MaskedArray(rows, mask=missing), columns, header)  # type: ignore[no-untyped-call]


def _load_csv(text: str) -> Recording:
    lines = text.splitlines()
    head = [line[2:] for line in lines if line.startswith("# ")]
    notes = dict(line.split(": ", 1) for line in head if ": " in line)
    table = csv.DictReader(line for line in lines if not line.startswith("#"))
    names = list(table.fieldnames or [])
    header = {name: value for name, value in notes.items() if name not in names}
    cells = [{name: value or None for name, value in row.items()} for row in table]
    return _recording(header, notes, names, cells)


def _load_json_lines(text: str) -> Recording:
    head, *lines = [json.loads(line) for line in text.splitlines()]
    meanings: dict[str, str] = head.pop("units")
    names: list[str] = []
    for name in meanings:
        names.append(name)
        if name in ("singleturn", "multiturn"):  # these alone say beside them whether they hold
            names.append(name + "_valid")
    for line in lines:
        for name, value in line.items():
            if isinstance(value, list):
                line[name] = " ".join(value)
    header = {name: f"{value:g}" if isinstance(value, float) else str(value) for name, value in head.items()}
    del header["absenc_record"]
    return _recording(header, meanings, names, lines)


def _load_hdf5(path: Path) -> Recording:
    try:
        import h5py  # type: ignore[import]
    except ImportError as error:
        raise Failure("recordings in HDF5 need h5py: Debian's package is python3-h5py") from error
    with h5py.File(path, "r") as file:
        attributes = {
            name: value.decode() if isinstance(value, bytes) else f"{value:g}" for name, value in file.attrs.items()
        }
        if attributes.pop("absenc_record", "") != "1":
            raise Failure(f"{path} is HDF5, but no recording of absenc")
        names = attributes.pop("columns").split(",")
        count = len(file["time_s"])  # written after all others: of a killed recording they may have more
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
    return Recording(np.ma.MaskedArray(rows, mask=missing), columns, attributes)  # type: ignore[no-untyped-call]


def load(file: Union[str, os.PathLike[str]]) -> Recording:
    """A recording of `absenc record`, whose name ends in .csv, in .jsonl or .ndjson for JSON lines, or in .h5 or .hdf5.
    Columns have the same names and types whichever it is. Details that only JSON lines have (`message`, `sent` ...) are
    left out; and times have microseconds in CSV. Raises UsageError; Failure when the file is no recording; OSError."""
    path = Path(file)
    if path.suffix in (".h5", ".hdf5"):
        return _load_hdf5(path)
    loaders = {".csv": _load_csv, ".jsonl": _load_json_lines, ".ndjson": _load_json_lines}
    if path.suffix not in loaders:
        raise UsageError(f"{path} is no recording by its name: it must end in {', '.join(loaders)}, .h5 or .hdf5")
    text = path.read_text(encoding="utf-8")
    if not text.startswith(("# absenc record 1\n", '{"absenc_record":1,')):
        raise Failure(f"{path} does not begin as a recording does")
    try:
        return loaders[path.suffix](text)
    except (ValueError, KeyError, TypeError) as error:
        raise Failure(f"{path} is damaged: {error!r}") from error
