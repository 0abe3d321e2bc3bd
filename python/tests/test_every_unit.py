# SPDX-License-Identifier: Apache-2.0
"""Tests the virtual encoder of each unit, over a pseudo-terminal if its link permits."""
import json
import os
import re
import subprocess

import absenc
import pytest

# milliseconds to wait for a reply, because a busy machine may delay it; a test that waits for silence takes this long
PATIENCE_MS = 500
# links whose frames are texts: of identifier and data, or of bits
TEXT_LINKS = ("can", "clocked", "clocked_bidirectional")
UNITS = sorted(absenc.protocol)


@pytest.fixture(params=UNITS)
def unit(request):
    return absenc.protocol[request.param]


@pytest.fixture
def address(unit, absenc_emulate):
    if unit.link in ("exchange", "clocked", "clocked_bidirectional"):
        return f"sim:{unit.id}"
    return absenc_emulate(unit.id).address + f"?latency={PATIENCE_MS}"


def test_reads_valid_position(unit, address):
    with absenc.open(address) as encoder:
        reading = encoder.read()
        assert reading.ready
        if reading.singleturn_bits:
            assert reading.valid
            assert (reading.angle_deg is None) != (reading.position_mm is None)
            assert 0 <= reading.singleturn < 2**reading.singleturn_bits
        assert encoder.counters["good"] >= 1
        assert encoder.protocol is unit


def test_samples_have_ascending_times(address):
    with absenc.open(address) as encoder:
        samples = list(encoder.samples(count=3))
    assert [sample.kind for sample in samples] == ["reading"] * 3
    assert samples[0].time_s <= samples[1].time_s <= samples[2].time_s


def test_info_has_no_failures(address):
    with absenc.open(address) as encoder:
        info = encoder.info()
    assert info.unit in absenc.protocol
    assert not info.failures


def test_encodes_and_decodes_requests(unit):
    """Encodes requests and decodes them; requests with changed bytes must be refused."""
    requests = []
    for command in unit.commands.values():
        if command.arguments:
            continue
        try:
            request = unit.encode(command.name)
        except absenc.UsageError:
            continue  # with the options of the first model the command cannot be encoded
        if request:
            requests.append(request)
    # an encoder on a clocked link has no request, because the clock itself requests a position
    assert requests or unit.link == "clocked"
    for request in requests:
        assert isinstance(request, bytes if unit.link not in TEXT_LINKS else str)
        unit.decode("", request=request)
        if unit.link == "clocked":
            continue  # the request of a clocked link is only a sequence of bits, so none is invalid
        if unit.link == "can":
            other = "7" + request[1:]
        elif unit.link == "clocked_bidirectional":
            other = "1111 1111"  # no mode command of EnDat begins with 1
        else:
            other = b"\xff" + request[1:] + b"\xff"
        with pytest.raises(absenc.EncoderError):
            unit.decode("", request=other)


def json_value(value):
    """Converts a field to its form in JSON."""
    if isinstance(value, bytes):
        return value.hex()
    return list(value) if isinstance(value, tuple) else value


def test_decodes_every_vector(unit):
    done = subprocess.run([os.environ["ABSENC"], "vectors", unit.id, "--json"], check=True, capture_output=True)
    valid, invalid = set(), set()
    for vector in map(json.loads, done.stdout.splitlines()):
        is_text = unit.link in TEXT_LINKS
        reply, request = (text if is_text else bytes.fromhex(text) for text in (vector["response"], vector["request"]))
        options = dict(vector["options"])
        model = options.pop("model", "")
        try:
            fields = unit.decode(reply, request=request, model=model, **options)
        except absenc.EncoderError as error:
            assert vector.get("error") == error.name, vector
            continue
        assert "error" not in vector, vector
        for name, value in vector["fields"].items():
            if fields[name] is None and re.search("angle|turn|position|temperature", name):
                invalid.add(name)
                continue
            valid.add(name)
            assert json_value(fields[name]) == value, (name, vector)
    assert invalid <= valid  # each field that is invalid in one vector is valid in another vector of the unit


def test_reads_alarm_of_virtual_encoder(unit, absenc_emulate):
    if unit.link in ("exchange", "clocked", "clocked_bidirectional") or not unit.alarms:
        pytest.skip("no pseudo-terminal or no alarms")
    virtual = absenc_emulate(unit.id)
    with absenc.open(virtual.address, latency=PATIENCE_MS) as encoder:
        before = set(encoder.read().alarms)
        virtual.raise_alarm(unit.alarms[0].name)
        for _ in range(3):
            reading = encoder.read()
        assert unit.alarms[0].name in reading.alarms
        assert unit.alarms[0].name not in before
        assert [alarm for alarm in encoder.alarms() if alarm.name == unit.alarms[0].name][0].meaning
    assert virtual.violations == 0
