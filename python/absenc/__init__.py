# SPDX-License-Identifier: Apache-2.0
"""Absolute encoders of servo motors: read them, emulate them, decode captures of their lines::

    import absenc

    with absenc.open("tformat:/dev/ttyUSB0") as encoder:
        print(encoder.read().angle_deg)
        for sample in encoder.samples(rate=100, count=1000):
            print(sample.time_s, sample.position, sample.speed_rpm)
        encoder.record("log.h5", seconds=60)   # other formats: .csv, .jsonl

    with absenc.emulate("tformat", motion="rpm=60") as virtual:
        virtual.raise_alarm("over_heat")       # the drive under test opens virtual.path
        virtual.set_fault("corrupt", 0.01)

    capture = absenc.decode("drive.sr", "tformat", channel="D0")
    capture["angle_deg"].mean()                # NumPy, masked where missing or invalid
    recording = absenc.load("log.h5")          # also files of `absenc record`; columns as in a capture
    recording["speed_rpm"][recording.good()]

Encoder addresses are those of the command: "tformat:/dev/ttyUSB0?model=23-bit", "raa38-can:can0", "sim:esl", or a name
in absenc.toml. Options may be given as keywords. An invalid position is None, or masked: never a number.
"""
from __future__ import annotations

from . import errors
from ._absenc import Reading, Sample, __version__
from .captures import Capture, Column, decode, decode_batches
from .emulation import Emulation, emulate
from .encoder import Alarm, Config, Encoder, Info, Memory, Recorded, Samples, open, scan
from .errors import AbsencError, EncoderError, Failure, PortError, UsageError
from .identification import Found, Identified, identify
from .protocols import Command, Flag, Protocol, crc, protocol
from .recordings import Recording, load
from .verdicts import (
    Clause,
    Conformance,
    Examination,
    Finding,
    OptionEvidence,
    Port,
    Probed,
    Waved,
    conform,
    doctor,
    ports,
    probe,
    wave,
)

__all__ = [
    "AbsencError",
    "Alarm",
    "Capture",
    "Clause",
    "Column",
    "Command",
    "Config",
    "Conformance",
    "Emulation",
    "Encoder",
    "EncoderError",
    "Examination",
    "Failure",
    "Finding",
    "Flag",
    "Found",
    "Identified",
    "Info",
    "Memory",
    "OptionEvidence",
    "Port",
    "PortError",
    "Probed",
    "Protocol",
    "Reading",
    "Recorded",
    "Recording",
    "Sample",
    "Samples",
    "UsageError",
    "Waved",
    "__version__",
    "conform",
    "crc",
    "decode",
    "decode_batches",
    "doctor",
    "emulate",
    "errors",
    "identify",
    "load",
    "open",
    "ports",
    "probe",
    "protocol",
    "scan",
    "wave",
]
