# SPDX-License-Identifier: Apache-2.0
"""Tests the plots of python/examples/plots.py."""
import os
import subprocess
import sys
from pathlib import Path

import absenc
import matplotlib
import numpy as np
import pytest

matplotlib.use("Agg")
sys.path.insert(0, str(Path(os.environ["ABSENC_SOURCE_DIR"]) / "python" / "examples"))
import plots  # noqa: E402


@pytest.fixture
def turning(tmp_path):
    path = tmp_path / "run.csv"
    subprocess.run([os.environ["ABSENC"], "record", "sim:tformat?motion=rpm=60&alarm=over_heat", "--output", str(path),
                    "--rate", "200", "--count", "240"], check=True, capture_output=True)
    return absenc.load(path)


def test_plots_position_speed_and_alarms(turning):
    position, speed, alarms = plots.motion(turning).axes
    assert np.ma.allequal(position.lines[0].get_ydata(), turning["position"])
    assert np.nanmedian(np.ma.filled(speed.lines[0].get_ydata(), np.nan)) == pytest.approx(60, abs=1)
    assert {name for line in alarms.lines for name in line.get_ydata()} == {"over_heat"}
    assert len(alarms.lines[0].get_xdata()) == turning.good().sum()


def test_plots_distribution_of_counts(turning):
    turning.rows["position"] = 70000 + np.arange(len(turning)) % 3
    turning.rows["position"][turning.rows["event"] != ""] = np.ma.masked
    axis = plots.noise(turning).axes[0]
    assert [bar.get_x() + bar.get_width() / 2 for bar in axis.patches] == [-1, 0, 1]
    assert sum(bar.get_height() for bar in axis.patches) == turning.good().sum()


def test_plots_deviation_from_constant_speed(turning):
    good = turning.good()
    angle = np.radians(turning["angle_deg"][good].data)
    before = turning["position"][good].data.copy()
    turning.rows["position"][good] = turning["position"][good] + np.round(400 * np.sin(2 * angle)).astype(int)
    bump = turning["position"][good].data - before
    time = turning["time_s"][good].data
    deviation = plots.eccentricity(turning).axes[0].lines[0].get_ydata()
    # The expected curve is made from the readings themselves, because on a busy machine their times vary.
    expected = bump - np.polyval(np.polyfit(time, bump, 1), time)
    assert np.abs(deviation - expected).max() < 3
    assert np.ptp(deviation) > 600
