# SPDX-License-Identifier: Apache-2.0
"""Tests that `absenc.load` loads recordings of `absenc record`."""
import csv
import json
import os
import signal
import subprocess
import warnings
from concurrent.futures import ThreadPoolExecutor

import absenc
import numpy as np
import pytest

FAULTY = "sim:tformat?motion=rpm=60&alarm=over_heat&fault=corrupt=0.3"


def record(path, address, count=50):
    subprocess.run([os.environ["ABSENC"], "record", address, "--output", str(path), "--rate", "0", "--count", str(count)],
                   # no check of the exit status, which is 1 if the last reading failed
                   check=False, capture_output=True)
    return path


@pytest.fixture
def json_lines(tmp_path):
    return record(tmp_path / "run.jsonl", FAULTY)


@pytest.fixture
def both(tmp_path, json_lines):
    """The same rows in both formats: the rows of the JSON lines with the header of a CSV recording."""
    header = record(tmp_path / "header.csv", FAULTY, 1).read_text().splitlines()
    names = next(line for line in header if not line.startswith("#"))
    path = tmp_path / "run.csv"
    with open(path, "w", encoding="utf-8", newline="") as file:
        file.write("\n".join(line for line in header if line.startswith("#")) + f"\n{names}\n")
        for line in json_lines.read_text().splitlines()[1:-1]:
            row = json.loads(line)
            cells = [row.get(name) for name in names.split(",")]
            csv.writer(file, lineterminator="\n").writerow(
                "" if cell is None else str(cell).lower() if isinstance(cell, bool)
                else " ".join(cell) if isinstance(cell, list) else cell for cell in cells)
    return absenc.load(path), absenc.load(json_lines)


def test_csv_and_json_lines_give_the_same(both):
    of_csv, of_json = both
    assert of_csv.columns == of_json.columns
    assert of_csv.rows.dtype == of_json.rows.dtype
    assert len(of_csv) == len(of_json) >= 50
    for name in of_csv.columns:
        assert list(np.ma.getmaskarray(of_csv[name])) == list(np.ma.getmaskarray(of_json[name])), name
        assert of_csv[name].compressed().tolist() == of_json[name].compressed().tolist(), name
    assert {name: of_csv.header[name] for name in of_json.header if name != "started"} == {
        name: value for name, value in of_json.header.items() if name != "started"}


def test_converts_to_dict(both):
    for recording in both:
        columns = dict(recording)
        assert list(columns) == list(recording.columns)
        assert np.ma.allequal(columns["time_s"], recording["time_s"])


def test_hdf5_has_the_columns_of_csv(tmp_path):
    of_csv, of_hdf5 = (absenc.load(record(tmp_path / name, FAULTY)) for name in ("run.csv", "run.h5"))
    assert of_hdf5.columns == of_csv.columns
    assert of_hdf5.rows.dtype == of_csv.rows.dtype
    assert {**of_hdf5.header, "started": ""} == {**of_csv.header, "started": ""}


@pytest.mark.parametrize("name", ["run.csv", "run.jsonl", "run.h5"])
def test_columns_have_types_units_and_masks(tmp_path, name):
    recording = absenc.load(record(tmp_path / name, FAULTY))
    good = recording.good()
    assert good.sum() == 50 and not good.all()
    assert set(recording["event"][~good]) <= {*absenc.errors.by_name, "gap"}
    for column in ("angle_deg", "singleturn", "position", "alarms"):
        assert list(np.ma.getmaskarray(recording[column])) == list(~good), column
    assert np.isnan(recording.rows.data["angle_deg"][~good]).all()
    assert [recording[column].dtype.kind for column in ("position", "singleturn", "singleturn_valid", "time_s")] == [
        "i", "u", "b", "f"]
    heat = absenc.protocol["tformat"].flag_names("alarms", int(recording["alarms"][good][0]))
    assert heat == ["over_heat"]
    assert recording["angle_deg"][good].tolist() == (360 * recording["singleturn"][good] / 2**17).tolist()
    assert (recording.columns["angle_deg"].unit, recording.columns["position"].unit) == ("deg", "counts")
    assert (recording.header["protocol"], recording.header["encoder"]) == ("tformat", FAULTY)
    assert recording.header["rate_hz"] == "0"


@pytest.mark.parametrize("name", ["run.csv", "run.jsonl", "run.h5"])
def test_distinguishes_clear_from_unreported_alarms(tmp_path, name):
    for encoder, reported in (("sim:tformat", True), ("sim:ssi", False)):
        recording = absenc.load(record(tmp_path / (encoder[4:] + name), encoder, 3))
        good = recording.good()
        assert set(np.ma.getmaskarray(recording["alarms"])[good]) == {not reported}, encoder
        assert set(recording.rows.data["alarms"][good]) == {0}


def test_refuses_files_that_are_no_recordings(tmp_path):
    with pytest.raises(absenc.UsageError, match="csv"):
        absenc.load(tmp_path / "run.txt")
    other = tmp_path / "other.csv"
    other.write_text("a,b\n1,2\n")
    with pytest.raises(absenc.Failure, match="other.csv"):
        absenc.load(other)
    damaged = record(tmp_path / "run.csv", "sim:tformat", 1)
    damaged.write_text(damaged.read_text() + "0.1,x\n")
    with pytest.raises(absenc.Failure, match="run.csv is damaged"):
        absenc.load(damaged)
    for name in ("empty.h5", "text.h5"):
        (tmp_path / name).write_text("" if name == "empty.h5" else "no HDF5\n" * 200)
        with pytest.raises(absenc.Failure, match=name):
            absenc.load(tmp_path / name)


def rows_of(recording):
    return [tuple(row) for row in recording.rows.filled().tolist()]


@pytest.mark.parametrize("name", ["run.csv", "run.jsonl", "run.h5"])
def test_truncated_recording_has_only_written_rows(tmp_path, name):
    path = record(tmp_path / name, "sim:tformat?motion=rpm=60&fault=corrupt=0.1&seed=4", 8)
    content = path.read_bytes()
    whole = absenc.load(path)
    assert whole.is_whole and not whole.damage
    rows = rows_of(whole)
    cut_path = tmp_path / ("cut" + path.suffix)
    step = 499 if name == "run.h5" else 1
    for size in range(0, len(content), step):
        cut_path.write_bytes(content[:size])
        try:
            with warnings.catch_warnings(record=True) as warned:
                warnings.simplefilter("always")
                cut = absenc.load(cut_path)
        except absenc.Failure as error:
            assert cut_path.name in str(error), size
            continue
        assert not cut.is_whole, size
        assert rows_of(cut) == rows[:len(cut)], size
        if name != "run.h5":
            assert bool(cut.damage) == (content[size - 1:size] != b"\n") == bool(warned), size
            assert len(cut) == content[:size].count(b"\n") - content.count(b"\n") + len(rows) + 1, size


def test_missing_line_is_damage(tmp_path):
    for name in ("run.csv", "run.jsonl"):
        path = record(tmp_path / name, "sim:tformat", 8)
        lines = path.read_text().splitlines(keepends=True)
        path.write_text("".join(lines[:-4] + lines[-3:]))
        with pytest.raises(absenc.Failure, match=f"{name} is damaged.*8 rows, and 7"):
            absenc.load(path)


@pytest.mark.parametrize("name", ["run.csv", "run.jsonl", "run.h5"])
def test_records_from_python(tmp_path, name):
    with absenc.open("sim:tformat", motion="rpm=60") as encoder:
        recorded = encoder.record(tmp_path / name, rate=1000, count=20)
        assert recorded.paths == [str(tmp_path / name)]
        assert (recorded.readings, recorded.failures) == (20, 0)
        assert recorded.bytes == (tmp_path / name).stat().st_size
        assert next(encoder.samples(count=1)).kind == "reading"  # after the recording the encoder can still be read
    recording = absenc.load(tmp_path / name)
    assert recording.good().sum() == 20
    assert recording.header["rate_hz"] == "1000"
    assert (np.diff(recording["position"][recording.good()]) > 0).all()


def test_recording_ends_by_time_close_or_ctrl_c(tmp_path):
    with absenc.open("sim:tformat") as encoder:
        timed = encoder.record(tmp_path / "timed.csv", rate=50, seconds=0.2)
        assert timed.readings + timed.missed == 10
        before = signal.signal(signal.SIGALRM, signal.default_int_handler)
        try:
            with pytest.raises(KeyboardInterrupt):
                signal.setitimer(signal.ITIMER_REAL, 0.2)
                encoder.record(tmp_path / "stopped.csv", rate=50)
        finally:
            signal.signal(signal.SIGALRM, before)
        assert absenc.load(tmp_path / "stopped.csv").good().any()
        with ThreadPoolExecutor(1) as other:
            closed = other.submit(encoder.record, tmp_path / "closed.csv", rate=50)
            while not (tmp_path / "closed.csv").exists():
                assert not closed.done()
            encoder.close()
            assert closed.result().paths == [str(tmp_path / "closed.csv")]


def test_writes_parts_and_refuses_invalid_arguments(tmp_path):
    with absenc.open("sim:tformat") as encoder:
        recorded = encoder.record(tmp_path / "log.csv", rate=0, count=300, part_bytes=10_000)
        assert len(recorded.paths) > 1
        assert sum(len(absenc.load(path)) for path in recorded.paths) == 300
        for path, choices, words in [
                ("log.txt", {}, ".csv"), ("x.csv", {"every": 0}, "every"), ("x.csv", {"rate": -1}, "rate"),
                ("x.csv", {"seconds": 0}, "seconds")]:
            with pytest.raises(absenc.UsageError, match=words):
                encoder.record(tmp_path / path, **choices)
        (tmp_path / "there.csv").touch()
        with pytest.raises(absenc.PortError, match="there.csv"):
            encoder.record(tmp_path / "there.csv")
        with pytest.raises(absenc.UsageError, match="another recording"):
            encoder.record(tmp_path / "log.csv", part_bytes=10_000)
