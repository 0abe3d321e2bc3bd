# SPDX-License-Identifier: Apache-2.0
import copy
import pickle
import asyncio
import os
import select
import signal
import subprocess
import sys
import threading
import tty

import absenc
import pytest

PATIENCE_MS = 500  # setting `latency` in milliseconds; it is long because a busy machine may delay replies


def test_error_has_sent_and_received_bytes_and_advice(absenc_emulate):
    virtual = absenc_emulate("tformat")
    with absenc.open(virtual.address, latency=PATIENCE_MS) as encoder:
        virtual.power_off()
        with pytest.raises(absenc.errors.Timeout) as raised:
            encoder.read()
    assert (raised.value.name, raised.value.sent, raised.value.received) == ("timeout", "1A", "")
    assert raised.value.message and raised.value.advice and raised.value.exchange


def test_every_error_has_a_class():
    assert set(absenc.errors.by_name) == set(absenc._absenc.error_names())


def test_damaged_reply_gives_no_position(absenc_emulate):
    virtual = absenc_emulate("tformat", singleturn=65536, faults={"corrupt": 1})
    with absenc.open(virtual.address, latency=PATIENCE_MS) as encoder:
        for sample in encoder.samples(count=2):
            assert sample.kind == "failed" and sample.reading is None and sample.position is None
            assert isinstance(sample.error, absenc.EncoderError)
        virtual.clear_faults()
        assert encoder.read().angle_deg == 180


def test_changes_condition_while_encoder_runs(absenc_emulate):
    virtual = absenc_emulate("tformat", conditions={"temperature": 40})
    with absenc.open(virtual.address, latency=PATIENCE_MS) as encoder:
        assert encoder.run("temperature")["temperature_c"] == 40
        virtual.set_condition("temperature", 71)
        assert encoder.run("temperature")["temperature_c"] == 71


def test_refuses_alarm_that_no_reply_reports(absenc_emulate):
    virtual = absenc_emulate("e201", carries="ssi", singleturn_bits=13)
    with pytest.raises(absenc.UsageError, match="the alarm error cannot be shown"):
        virtual.raise_alarm("error")
    absenc_emulate("e201", singleturn_bits=13).raise_alarm("error")


def test_wrong_name_suggests_the_most_similar(absenc_emulate):
    virtual = absenc_emulate("tformat")
    with pytest.raises(absenc.UsageError, match="over_heat"):
        virtual.raise_alarm("over_heet")
    with pytest.raises(absenc.UsageError, match="tformat"):
        absenc.open("tformta:/dev/null")
    with absenc.open(virtual.address, latency=PATIENCE_MS) as encoder:
        with pytest.raises(absenc.UsageError, match="address"):
            encoder.run("memory-read", adress=5)
    with pytest.raises(absenc.PortError) as raised:
        absenc.open("tformat:/dev/no-such-port")
    assert raised.value.kind == "not_found"


def test_refuses_invalid_numbers_and_options():
    with absenc.open("sim:tformat", model=None) as encoder:
        for numbers in [(0, 10**9), (0, 2**31), (10**6, 1)]:
            with pytest.raises(absenc.UsageError):
                encoder.memory.read(*numbers)  # a request to read too many bytes is refused before memory is allocated
        for argument in (2**80, -(2**80), "five", None, 1.5):
            with pytest.raises(absenc.UsageError, match="address is .*must be a whole number"):
                encoder.run("memory-read", argument)
            with pytest.raises(absenc.UsageError, match="address is .*must be a whole number"):
                encoder.run("memory-read", address=argument)
        with pytest.raises(absenc.UsageError, match="arguments"):
            encoder.run("memory-read", 1, 2, 3, 4, 5)


def policies_of_reading_threads(priority):
    """Reads in a thread that is not the one that opened the encoder. Returns the policies of both, or the failure."""
    policies = []

    def policy():
        policies.append(os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK)

    def read(encoder):
        policy()
        encoder.read()
        policy()

    def work():
        try:
            with absenc.open("sim:tformat", realtime=priority) as encoder:
                policy()
                other = threading.Thread(target=read, args=(encoder,))
                other.start()
                other.join()
        except absenc.Failure as failure:
            policies.append(str(failure))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    return policies


def test_threads_that_use_an_encoder_become_real_time():
    policies = policies_of_reading_threads(7)
    if policies == [os.SCHED_FIFO, os.SCHED_OTHER, os.SCHED_FIFO]:
        return
    # If the kernel refuses a real-time thread, `open` fails instead of reading without one.
    assert len(policies) == 1 and "the kernel refuses" in policies[0] and "Try: " in policies[0]


def test_refused_real_time_is_a_failure():
    script = ("import absenc\n"
              "try:\n    absenc.open('sim:tformat', realtime=7)\n"
              "except absenc.Failure as failure:\n    print(failure)\n")
    capabilities = ["setpriv", "--bounding-set=-sys_nice"] if os.geteuid() == 0 else []
    command = [*capabilities, "prlimit", "--rtprio=0:0", sys.executable, "-c", script]
    printed = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True).stdout
    assert "the kernel refuses" in printed and "Try: " in printed
    with pytest.raises(absenc.UsageError, match="realtime"):
        absenc.open("sim:tformat", realtime=100)


def test_copies_and_pickles_readings():
    for address in ("sim:tformat?singleturn=70000&multiturn=5&alarm=over_heat", "sim:ssi", "sim:esl"):
        with absenc.open(address) as encoder:
            reading = encoder.read()
            sample = next(encoder.samples(count=1))
        parts = [name for name in dir(reading) if not name.startswith("_")]
        for other in (copy.copy(reading), copy.deepcopy(reading), pickle.loads(pickle.dumps(reading))):
            assert {name: getattr(other, name) for name in parts} == {name: getattr(reading, name) for name in parts}
            assert str(other) == str(reading)
        assert str(copy.deepcopy(sample)) == str(copy.copy(sample)) == str(sample)


def test_writes_memory_and_reads_it_back(absenc_emulate):
    virtual = absenc_emulate("tformat")
    with absenc.open(virtual.address, latency=PATIENCE_MS) as encoder:
        assert encoder.memory.write(5, b"\x42\x43") == 2
        assert encoder.memory.read(5, 2) == b"\x42\x43"
        assert encoder.memory.write(5, b"\x42\x43") == 0
        assert encoder.memory.dump()[(0, 5)] == 0x42
        assert encoder.run("memory-read", address=6)["value"] == 0x43


def test_sample_has_repr_and_invalid_rates_are_refused():
    with absenc.open("sim:tformat", singleturn=65536) as encoder:
        assert "angle_deg=180" in repr(next(encoder.samples(count=1)))
        for rate in (-1, float("nan")):
            with pytest.raises(absenc.UsageError, match="rate"):
                encoder.samples(rate=rate)
        for count in (-1, 1.5, float("nan"), "3", 2**40):
            with pytest.raises(absenc.UsageError, match="count is a whole number from 0"):
                encoder.samples(count=count)
        with pytest.raises(absenc.UsageError, match="address is a whole number"):
            encoder.memory.read(-1)
        with pytest.raises(absenc.UsageError, match="every is a whole number from 1 "):
            encoder.record("never.csv", every=0)
        assert next(encoder.samples(count=1.0)).kind == "reading"
    with pytest.raises(absenc.UsageError, match="rows is a whole number from 1 "):
        absenc.decode_batches("drive.sr", "tformat", rows=0)


def test_reports_alarm_once(absenc_emulate):
    """The protocol tformat has a status flag of the same name as the alarm counting_error."""
    virtual = absenc_emulate("tformat")
    with absenc.open(virtual.address, latency=PATIENCE_MS) as encoder:
        virtual.raise_alarm("counting_error")
        assert [(alarm.field, alarm.name) for alarm in encoder.alarms()] == [("alarms", "counting_error")]


def test_unreported_values_are_none():
    with absenc.open("sim:ssi") as encoder:
        reading = encoder.read()
        assert (reading.alarms, reading.status, encoder.alarms()) == (None, None, None)
        assert reading.singleturn_valid is True
    with absenc.open("sim:tformat") as encoder:
        reading = encoder.read()
        assert (reading.alarms, reading.status, encoder.alarms()) == ([], [], [])
        assert (reading.singleturn_valid, reading.multiturn_valid) == (True, True)
    with absenc.open("sim:tformat", alarm="battery_error") as encoder:
        reading = encoder.read()
        assert (reading.alarms, reading.singleturn_valid, reading.multiturn_valid) == (["battery_error"], True, False)
    with absenc.open("sim:encolink", singleturn=77, has_ch2=False) as encoder:
        reading = encoder.read()
        assert (reading.alarms, reading.status, encoder.alarms()) == (None, [], None)


def test_scan_returns_encoders_on_line():
    assert [one["clash"] for one in absenc.scan("sim:esl")] == [False]
    with absenc.open("sim:tformat") as encoder, pytest.raises(absenc.UsageError, match="no addresses"):
        encoder.scan()


def test_reads_over_tcp(absenc_emulate):
    virtual = absenc_emulate("tformat", tcp=0)
    with absenc.open(f"tformat:tcp:127.0.0.1:{virtual.tcp_port}", latency=PATIENCE_MS) as encoder:
        assert encoder.read().valid


def test_async_samples_do_not_block_the_event_loop(absenc_emulate):
    virtual = absenc_emulate("tformat", motion="rpm=60")
    turns = 0

    async def count_turns():
        nonlocal turns
        while True:
            turns += 1
            await asyncio.sleep(0)

    async def read():
        other = asyncio.create_task(count_turns())
        with absenc.open(virtual.address, latency=PATIENCE_MS) as encoder:
            positions = [sample.position async for sample in encoder.samples(rate=100, count=10)]
        other.cancel()
        return positions

    positions = asyncio.run(read())
    assert len(positions) == 10 and positions == sorted(positions)
    assert turns > 10


def test_asyncio_timeout_cancels_wait(absenc_emulate):
    virtual = absenc_emulate("tformat")

    async def read():
        with absenc.open(virtual.address, latency=PATIENCE_MS) as encoder:
            with pytest.raises(asyncio.TimeoutError):
                async with asyncio.timeout(0.2):
                    async for _ in encoder.samples(rate=0.001):
                        pass
            return encoder.read().valid  # after the cancelled wait the encoder can still be read

    assert asyncio.run(read())


def test_close_ends_samples_in_another_thread(absenc_emulate):
    virtual = absenc_emulate("tformat")
    encoder = absenc.open(virtual.address, latency=PATIENCE_MS)
    samples = iter(encoder.samples(rate=0.001))
    next(samples)
    ended = []
    thread = threading.Thread(target=lambda: ended.extend(samples))
    thread.start()
    encoder.close()
    thread.join(60)
    assert not thread.is_alive()
    with pytest.raises(absenc.UsageError, match="closed"):
        encoder.read()


def test_ctrl_c_ends_wait_for_reply():
    """Ctrl-C ends the wait long before the timeout of 50 s."""
    master, slave = os.openpty()
    program = f"""
import absenc
with absenc.open("tformat:{os.ttyname(slave)}?latency=50000") as encoder:
    try:
        encoder.read()
    except KeyboardInterrupt:
        print("interrupted", flush=True)
"""
    tty.setraw(slave)
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert select.select([master], [], [], 40)[0]  # waits until the program has sent its request
            os.kill(process.pid, signal.SIGINT)
            assert process.communicate(timeout=40)[0] == "interrupted\n"
        finally:
            process.kill()
            os.close(master)
            os.close(slave)


def test_close_ends_wait_for_reply():
    master, slave = os.openpty()
    tty.setraw(slave)
    ended = []

    def read(encoder):
        with pytest.raises(absenc.errors.Cancelled):
            encoder.read()
        ended.append(True)

    try:
        encoder = absenc.open(f"tformat:{os.ttyname(slave)}?latency=50000")
        thread = threading.Thread(target=read, args=(encoder,))
        thread.start()
        assert select.select([master], [], [], 40)[0]
        encoder.close()
        thread.join(40)
        assert ended
    finally:
        os.close(master)
        os.close(slave)


@pytest.mark.parametrize("wait", ["list(encoder.samples(rate=0.001))", "list(encoder.samples(rate=1000))"])
def test_ctrl_c_ends_wait_for_sample(wait):
    program = f"""
import absenc
with absenc.open("sim:tformat") as encoder:
    try:
        encoder.read()
        print("ready", flush=True)
        {wait}
    except KeyboardInterrupt:
        encoder.read()
        print("interrupted", flush=True)
"""
    with subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline() == "ready\n"
            os.kill(process.pid, signal.SIGINT)
            assert process.communicate(timeout=60)[0] == "interrupted\n"
            assert process.returncode == 0
        finally:
            process.kill()


def test_reports_state_of_change() -> None:
    with absenc.open("sim:tformat") as encoder:
        assert encoder.change is None
        encoder.run("memory-write", 5, 0x42)
        assert encoder.change == "confirmed"
        with pytest.raises(absenc.errors.EncoderError) as refused:
            encoder.run("memory-write", 0, 1, page=6)
        assert refused.value.change == encoder.change == "not_sent"
        assert pickle.loads(pickle.dumps(refused.value)).change == "not_sent"
    with absenc.open("sim:tformat?fault=silence=1") as encoder:
        with pytest.raises(absenc.errors.Timeout) as read:
            encoder.read()
        assert read.value.change is None
        with pytest.raises(absenc.errors.Timeout) as written:
            encoder.memory.write(5, b"\x42")
        assert written.value.change == "not_sent"


def test_writes_changes_to_journal(absenc_emulate, monkeypatch, tmp_path) -> None:
    journal = tmp_path / "changes.tsv"
    monkeypatch.setenv("ABSENC_CHANGES", str(journal))
    with absenc.open(absenc_emulate("tformat").address, latency=PATIENCE_MS) as encoder:
        encoder.memory.write(5, b"\x42")
        encoder.config.set("overheat-threshold", 80)
    entries = [line.split("\t")[2:6] for line in journal.read_text().splitlines()]
    assert entries == [["memory write 0x05", "0x00", "0x42", "confirmed"],
                       ["config set overheat-threshold", "90", "80", "confirmed"]]


def test_speeds_and_joint_angles_have_the_unit_of_their_name():
    settings = "&gear=50/3&direction=-1&offset_deg=10&pole_pairs=7"
    with absenc.open("sim:tformat?multiturn=3&motion=rpm=60" + settings) as encoder:
        last = list(encoder.samples(rate=100, count=20))[-1]
        turned = 360 * last.position / 2**17
        assert last.joint_deg == pytest.approx(-(turned - 10) * 3 / 50)
        assert last.electrical_deg == pytest.approx(-(turned - 10) * 7 % 360)
        assert abs(last.speed_rpm - 60) <= last.speed_uncertainty_rpm < 1
        assert last.joint_speed_rpm == pytest.approx(-last.speed_rpm * 3 / 50)
        assert last.joint_speed_uncertainty_rpm == pytest.approx(last.speed_uncertainty_rpm * 3 / 50)
        assert last.speed_mm_s is None and last.joint_mm is None
    with absenc.open("sim:biss?model=linear-26-1um&singleturn=30000&offset_mm=10&pole_pair_mm=24") as encoder:
        last = list(encoder.samples(rate=100, count=20))[-1]
        assert (last.joint_mm, last.speed_mm_s, last.speed_rpm, last.joint_deg) == (20, 0, None, None)
        assert last.electrical_deg == pytest.approx(300)
    with absenc.open("sim:tformat") as encoder:
        plain = next(encoder.samples(count=1))
        assert (plain.joint_deg, plain.electrical_deg, plain.speed_rpm) == (None, None, None)
