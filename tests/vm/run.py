# SPDX-License-Identifier: Apache-2.0
"""Tests the kernel's own interfaces in a virtual machine. Usage: run.py [part of a test's name...]

Exit status: 0 all tests passed, 1 not all passed, 77 the machine cannot be built on this computer."""
import os
import re
import signal
import subprocess
import sys
import tempfile
import time

import image

ABSENC = os.path.abspath(os.environ.get("ABSENC", "build/release/bin/absenc"))
# Time limit of one run of the virtual machine, in seconds. All tests take 8 minutes on two cores, most of it the searches
# of `identify`; on two slow cores with other tests beside them, 19 minutes.
PATIENCE = 2700
SKIPPED = 77
# kernel option against a panic: a busy computer delays the timer of the virtual machine too much for the kernel's
# check
BUSY = "no_timer_check"


def boot(kernel, initramfs, folder):
    """Runs the machine to its end. Returns its output, and why it is incomplete, or None."""
    line = os.path.join(folder, "line")
    command = [
        image.program("qemu-system-x86_64"), "-accel", "tcg", "-m", "512", "-no-reboot", "-nodefaults", "-display",
        "none",
        "-kernel", kernel, "-initrd", initramfs, "-append", f"console=ttyS0 quiet panic=-1 {BUSY}",
        "-serial", "stdio",
        # The serial ports ttyS1 and ttyS2 of the virtual machine are the two ends of one line.
        "-chardev", f"socket,id=one,path={line},server=on,wait=off", "-chardev", f"socket,id=two,path={line}",
        "-serial", "chardev:one", "-serial", "chardev:two",
    ]  # fmt: skip
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT) as machine:
        try:
            output, _ = machine.communicate(timeout=PATIENCE)
            trouble = f"qemu ended with status {machine.returncode}" if machine.returncode else None
        except subprocess.TimeoutExpired:
            machine.kill()
            output, _ = machine.communicate()
            trouble = f"the machine did not end within {PATIENCE} s"
        finally:
            machine.kill()  # ends the virtual machine if it still runs
    return output.decode(errors="replace").replace("\r", ""), trouble


def judge(output, trouble):
    """Prints the failed tests, and measured figures. Returns how many tests passed and how many failed."""
    good = re.findall(r"^ok (.*)$", output, re.MULTILINE)
    bad = re.findall(r"^not ok .*\n(?:#.*\n)*", output, re.MULTILINE)
    for report in bad + re.findall(r"^figures: .*\n", output, re.MULTILINE):
        print(report, end="")
    end = re.search(r"^end of (\d+) tests$", output, re.MULTILINE)
    failed = len(bad)
    if end is None or int(end[1]) != len(good) + len(bad) or int(end[1]) == 0:
        trouble = trouble or "the tests did not reach their end"
        failed += 1
    if trouble:
        print(f"{trouble}; the end of the machine's console:")
        print("\n".join(output.splitlines()[-60:]))
    return len(good), max(failed, 1 if trouble else 0)


def main(patterns):
    start = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="absenc-vm-") as folder:
        try:
            kernel, initramfs = image.build(ABSENC, patterns, folder)
            built = time.monotonic()
            output, trouble = boot(kernel, initramfs, folder)
        except image.Missing as missing:
            print(f"skipped: {missing}")
            return SKIPPED
    good, failed = judge(output, trouble)
    now = time.monotonic()
    print(f"{good} passed, {failed} failed in {now - start:.0f} s: "
          f"image {built - start:.1f} s, machine {now - built:.1f} s")
    return 1 if failed else 0


if __name__ == "__main__":
    # On SIGTERM the program exits by an exception, which also ends the virtual machine.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    sys.exit(main(sys.argv[1:]))
