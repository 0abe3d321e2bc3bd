# SPDX-License-Identifier: Apache-2.0
"""Tests that the package returns the same verdicts as the command."""
from __future__ import annotations

import json
import os
import signal
import subprocess
from pathlib import Path

import pytest

import absenc

REPLY, REQUEST = "084000efcdab341255277e086000abd57f67", "0857"


def command(*arguments: str) -> dict[str, object]:
    done = subprocess.run([os.environ["ABSENC"], *arguments, "--json"], capture_output=True, text=True, check=False)
    printed: dict[str, object] = json.loads(done.stdout)
    return printed


def known(values: tuple[object, ...], names: tuple[str, ...]) -> set[str]:
    return {name for name, value in zip(names, values) if value is not None}


def test_doctor_finds_nothing_on_good_encoder() -> None:
    found = absenc.doctor("sim:tformat", seconds=0.2)
    assert found.ok and not found.findings
    assert found.verdict.startswith("good: ")
    assert known(found, found._fields) == set(command("doctor", "sim:tformat", "--for", "0.2"))


def test_doctor_reports_alarm() -> None:
    found = absenc.doctor("sim:tformat", readings=50, alarm="over_heat")
    assert not found.ok
    assert found.readings == 50
    assert found.findings[0].id == "alarm"
    assert "over_heat" in found.findings[0].evidence
    printed = command("doctor", "sim:tformat?alarm=over_heat", "--readings", "50")["findings"]
    assert isinstance(printed, list)
    assert found.findings[0]._asdict() == printed[0]


def test_doctor_reports_missing_port() -> None:
    found = absenc.doctor("tformat:/dev/nothing")
    assert [one.id for one in found.findings] == ["port_missing"]
    with pytest.raises(absenc.UsageError):
        absenc.doctor("tfromat:/dev/nothing")


def test_signal_ends_doctor() -> None:
    def end(*_: object) -> None:
        raise InterruptedError

    before = signal.signal(signal.SIGALRM, end)
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(InterruptedError):
            absenc.doctor("sim:tformat", seconds=3600)
    finally:
        signal.signal(signal.SIGALRM, before)


def test_conform_returns_verdict_of_each_clause() -> None:
    kept = absenc.conform("sim:tformat", readings=10)
    assert (kept.ok, kept.verdict, kept.broken, kept.left) == (True, "kept", 0, [])
    assert kept.kept == sum(clause.verdict == "kept" for clause in kept.clauses) > 0
    assert set(kept._fields) == set(command("conform", "sim:tformat", "--readings", "10"))
    silent = absenc.conform("sim:tformat", readings=10, fault="silence=1")
    assert not silent.ok and silent.kept == 0
    with pytest.raises(absenc.UsageError):
        absenc.conform("sim:tformat", resets=True)


def test_probe_excludes_options() -> None:
    found = absenc.probe("esl", [REPLY], [REQUEST])
    assert found.ok
    printed = command("probe", "esl", "--hex", REPLY, "--request", REQUEST)
    assert set(found._fields) == set(printed)
    assert found.settled == printed["settled"]
    excluded = [one for one in found.evidence if not one.possible]
    assert excluded and all(one.frame == 1 for one in excluded)
    assert not absenc.probe("esl", ["00" * 18]).ok
    with pytest.raises(absenc.UsageError):
        absenc.probe("e201", ["3D"])


def test_wave_can_be_decoded(tmp_path: Path) -> None:
    file = tmp_path / "line.sr"
    drawn = absenc.wave("tformat", file, count=20, motion="rpm=60")
    assert (drawn.results, drawn.failures, drawn.wires) == (20, 0, ["line"])
    assert len(absenc.decode(str(file), "tformat", channel="line")["angle_deg"]) == 20
    with pytest.raises(absenc.UsageError, match="replaces=True"):
        absenc.wave("tformat", file)
    assert absenc.wave("sim:tformat", file, replaces=True, fault="silence=1").failures == 1


def test_ports_equal_those_of_the_command() -> None:
    done = subprocess.run([os.environ["ABSENC"], "ports", "--json"], capture_output=True, text=True, check=True)
    printed = [json.loads(line) for line in done.stdout.splitlines() if line]
    assert [port.port for port in absenc.ports()] == [one["port"] for one in printed]
    for port, one in zip(absenc.ports(), printed):
        assert known(port, port._fields) <= set(one) <= set(port._fields)
