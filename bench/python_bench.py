#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares the cost of the Python package with that of the command: bench/python_bench.py [build folder]"""
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
BUILD = pathlib.Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "build/release"
COMMAND = str(BUILD / "bin/absenc")
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(BUILD / "python")}
EXCHANGES, SAMPLES = 25_000, 5000
DECODE_ROUNDS, READ_ROUNDS = 9, 3
MEASURES = {"s": "time", "CPU s": "processor time", "MB": "peak memory"}


def program(text):
    return [sys.executable, "-c", text]


def measured(arguments):
    """Returns time, processor time and peak memory of a process. It must exit with status 0."""
    start = time.monotonic()
    with open(os.devnull, "wb") as nowhere:
        process = subprocess.Popen(arguments, stdout=nowhere, env=ENVIRONMENT)
    _, status, usage = os.wait4(process.pid, 0)
    took = time.monotonic() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{arguments} ended with {process.returncode}")
    return took, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1000


def compare(title, rounds, sides):
    """Measures the programs `sides` in turn and prints their ratios to the first program."""
    runs = {name: [] for name in sides}
    for _ in range(rounds):
        for name, arguments in sides.items():
            runs[name].append(measured(arguments))
    medians = {name: [statistics.median(values) for values in zip(*all_runs)] for name, all_runs in runs.items()}
    print(f"{title} (medians of {rounds} runs in turn)")
    first = next(iter(medians.values()))
    for name, values in medians.items():
        parts = (f"{value:.3g} {unit} ({value / base:.2f})" for unit, value, base in zip(MEASURES, values, first))
        print(f"  {name:34} {', '.join(parts)}", flush=True)


def main():
    with tempfile.TemporaryDirectory() as folder:
        capture = f"{folder}/wave.sr"
        subprocess.run([COMMAND, "wave", "tformat?motion=rpm=60", capture, "--count", str(EXCHANGES), "--rate", "10000",
                        "--samplerate", "40000000"], check=True, stderr=subprocess.DEVNULL)
        print(f"Each with its ratio to the command: {', '.join(MEASURES.values())}")
        start = program("import absenc")
        compare(f"decode of 100 million samples, {EXCHANGES} exchanges", DECODE_ROUNDS, {
            "absenc decode --csv": [COMMAND, "decode", "tformat", capture, "--csv"],
            "absenc.decode": program(
                f"import absenc; assert len(absenc.decode({capture!r}, 'tformat')) == {EXCHANGES}"),
            "import absenc": start})
    compare(f"{SAMPLES} samples of sim:tformat at 1000 a second", READ_ROUNDS, {
        "absenc read --csv": [COMMAND, "read", "sim:tformat", "--rate", "1000", "--count", str(SAMPLES), "--csv"],
        "for sample in encoder.samples": program(
            "import absenc\nwith absenc.open('sim:tformat') as encoder:\n"
            f"    for sample in encoder.samples(rate=1000, count={SAMPLES}): print(sample.time_s, sample.position)"),
        "import absenc": start})


if __name__ == "__main__":
    main()
