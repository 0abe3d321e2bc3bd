# SPDX-License-Identifier: Apache-2.0
"""Reads a turning virtual encoder, records it, and shows an error."""
import os
import tempfile

import absenc

with absenc.emulate("tformat", motion="rpm=60") as virtual, absenc.open(virtual.address) as encoder:
    for sample in encoder.samples(rate=100, count=10):
        if sample.reading is None or sample.reading.angle_deg is None:
            print(sample.text)
            continue
        print(f"{sample.time_s:.3f} s: {sample.reading.angle_deg:.3f} degrees")
        if sample.speed_rpm is not None:
            print(f"    {sample.speed_rpm:.1f} ± {sample.speed_uncertainty_rpm:.1f} rpm")
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "log.h5")
        recorded = encoder.record(path, rate=100, seconds=0.5)
        recording = absenc.load(path)
        print(f"{recorded.readings} readings recorded; columns: {', '.join(recording.columns)}")
    virtual.power_off()
    try:
        encoder.read()
    except absenc.errors.Timeout as error:
        print(error.advice)
