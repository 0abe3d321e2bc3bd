# SPDX-License-Identifier: Apache-2.0
import csv
import io
import os
import subprocess
from pathlib import Path

import absenc
import numpy as np
import pytest

SOURCE = Path(os.environ["ABSENC_SOURCE_DIR"])
TEXT = SOURCE / "examples" / "tformat.txt"


@pytest.fixture(params=["", "&alarm=counting_error"], ids=["valid", "invalid"])
def wave(tmp_path, request):
    path = tmp_path / "wave.vcd"
    subprocess.run(
        [os.environ["ABSENC"], "wave", f"tformat?motion=rpm=60{request.param}", str(path), "--count", "300"],
        check=True, capture_output=True,
    )
    return path


def test_masks_position_of_rows_with_errors():
    capture = absenc.decode(TEXT, "tformat")
    assert list(capture["error"]) == ["", "bad_checksum", ""]
    assert list(capture.good()) == [True, False, True]
    assert list(np.ma.getmaskarray(capture["singleturn"])) == [False, True, False]
    assert np.isnan(capture.rows.data["angle_deg"][1])
    assert capture["request"][0] == b"\x1a" and capture["reply"][0][:1] == b"\x1a"
    assert capture.columns["angle_deg"].unit == "deg"


def test_decodes_like_the_command(wave, request):
    printed = subprocess.run([os.environ["ABSENC"], "decode", "tformat", str(wave), "--csv"], capture_output=True, text=True)
    rows = list(csv.DictReader(io.StringIO(printed.stdout)))
    capture = absenc.decode(wave, "tformat")
    assert len(rows) == len(capture) >= 300
    # A position that an alarm makes invalid is masked in NumPy and empty in CSV.
    absent = [row["angle_deg"] == "" for row in rows]
    assert all(absent) == any(absent) == (request.node.callspec.id == "invalid")
    assert absent == list(np.ma.getmaskarray(capture["angle_deg"]))
    assert absent == [row["singleturn_valid"] == "false" for row in rows] == list(np.ma.getmaskarray(capture["singleturn"]))
    assert len(set(capture["reply"])) > 250  # the encoder turns, so most replies differ
    assert [[] if row["alarms"] == "none" else row["alarms"].split() for row in rows] == [
        absenc.protocol["tformat"].flag_names("alarms", int(bits)) for bits in capture["alarms"]]
    assert [float(row["angle_deg"]) for row in rows if row["angle_deg"]] == pytest.approx(capture["angle_deg"].compressed())
    for name in ("singleturn", "multiturn"):
        valid = [int(row[name]) for row in rows if row[f"{name}_valid"] == "true"]
        assert valid == capture[name].compressed().tolist()
    assert [bytes.fromhex(row["reply"]) for row in rows] == list(capture["reply"])


def test_uses_alarms_of_earlier_replies(tmp_path):
    text = tmp_path / "bytes.txt"
    alone, whole, alarm = "02 02 00 CD AB 01 65", "1A 1A 00 45 23 01 11 34 12 00 00 4A", "02 02 20 CD AB 01 45"
    text.write_text("\n".join((alone, whole, alone, alarm)) + "\n")
    capture = absenc.decode(text, "tformat")
    assert list(np.ma.getmaskarray(capture["singleturn"])) == [True, False, False, False]
    assert list(np.ma.getmaskarray(capture["alarms"])) == [True, False, False, True]


def test_batches_contain_all_rows(wave):
    whole = absenc.decode(wave, "tformat")
    batches = list(absenc.decode_batches(wave, "tformat", rows=7))
    assert {len(batch) for batch in batches[:-1]} == {7}
    for name in ("time_s", "singleturn", "reply"):
        assert list(np.concatenate([batch.rows.data[name] for batch in batches])) == list(whole.rows.data[name])


def test_converts_to_pandas(wave):
    pytest.importorskip("pandas")
    frame = absenc.decode(TEXT, "tformat").to_pandas()
    assert list(frame["singleturn"].isna()) == [False, True, False]
    assert frame["angle_deg"].isna()[1]


def test_refuses_missing_files_and_unknown_columns(tmp_path):
    with pytest.raises(absenc.AbsencError):
        absenc.decode(tmp_path / "none.sr", "tformat")
    with pytest.raises(absenc.AbsencError):
        # `decode_batches` raises the exception at once, although no batch of rows has been requested yet.
        absenc.decode_batches(tmp_path / "none.sr", "tformat")
    with pytest.raises(KeyError, match="angle_deg"):
        absenc.decode(TEXT, "tformat")["angel"]


def test_encodes_and_decodes_frames():
    tformat = absenc.protocol["tformat"]
    reply = bytes.fromhex("1A0045230111341200004A")
    assert tformat.encode("position") == b"\x1a"
    assert tformat.decode(reply, request=b"\x1a")["singleturn"] == 74565
    with pytest.raises(absenc.errors.BadChecksum) as raised:
        tformat.decode(reply[:-1] + b"\x4b", request=b"\x1a")
    assert raised.value.sent == "1A"
    assert tformat.flag_names("alarms", 1 << 4) == ["over_heat"]
    with pytest.raises(TypeError):
        # the bytes() of Python would convert the number 3 to three zero bytes, so `decode` must refuse numbers
        tformat.decode(3)


def test_computes_crc_of_bytes_and_arrays():
    assert absenc.crc(b"123456789", width=16, poly=0x1021, init=0xFFFF) == 0x29B1
    rows = np.frombuffer(b"123456789" * 3, np.uint8).reshape(3, 9)
    assert list(absenc.crc(rows, width=8, poly=0x07)) == [0xF4] * 3
    with pytest.raises(absenc.UsageError, match="highest term"):
        absenc.crc(b"123456789", width=8, poly=0x107)
