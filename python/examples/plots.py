# SPDX-License-Identifier: Apache-2.0
"""Plots a recording of a rotary encoder: plots.py log.csv motion|noise|eccentricity picture.png"""
import sys
from typing import Any

import absenc
import matplotlib.pyplot as plt  # type: ignore[import]
import numpy as np


def motion(recording: absenc.Recording) -> Any:
    """Plots position, speed and alarms over time. Invalid values are gaps in the line."""
    figure, axes = plt.subplots(3, sharex=True, layout="constrained")
    for axis, name in zip(axes, ("position", "speed_rpm")):
        axis.plot(recording["time_s"], recording[name])
        axis.set_ylabel(f"{name}, {recording.columns[name].unit}")
    unit = absenc.protocol[recording.header["protocol"]]
    named = [unit.flag_names("alarms", int(bits)) for bits in recording.rows.data["alarms"]]
    for alarm in unit.alarms:
        raised = np.array([alarm.name in names for names in named])
        if raised.any():
            axes[2].plot(recording["time_s"][raised], [alarm.name] * int(raised.sum()), "|")
    axes[2].set_ylabel("alarms")
    axes[2].set_xlabel("time, s")
    return figure


def noise(recording: absenc.Recording) -> Any:
    """Plots the distribution of the counts around their mean, at standstill."""
    counts = recording.rows.data["position"][~recording.rows.mask["position"]]
    deviation = counts - round(counts.mean())
    figure, axis = plt.subplots(layout="constrained")
    axis.hist(deviation, np.arange(deviation.min(), deviation.max() + 2) - 0.5)
    axis.set_title(f"standard deviation {counts.std():.2f} counts")
    axis.set_xlabel("counts from the mean")
    axis.set_ylabel("readings")
    return figure


def eccentricity(recording: absenc.Recording) -> Any:
    """Plots the deviation of the position from a constant speed, over the angle within the turn."""
    valid = ~recording.rows.mask["position"]
    time, position = recording["time_s"][valid], recording["position"][valid]
    deviation = position - np.polyval(np.polyfit(time, position, 1), time)
    figure, axis = plt.subplots(layout="constrained")
    axis.plot(recording["angle_deg"][valid], deviation, ".")
    axis.set_xlabel("angle, deg")
    axis.set_ylabel("deviation from constant speed, counts")
    return figure


if __name__ == "__main__":
    pictures = {"motion": motion, "noise": noise, "eccentricity": eccentricity}
    pictures[sys.argv[2]](absenc.load(sys.argv[1])).savefig(sys.argv[3])
