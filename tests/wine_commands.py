#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs tests of the command with absenc.exe under wine: wine_commands.py [MODULE...]. ABSENC is the command for Linux,
whose virtual encoders are at the other end, and ABSENC_EXE the one for Windows."""
import os
import sys
import unittest

from wine_support import WINE, Prefix

PORTS = "names a port, a device or a folder of Linux"
FILES = "is about files that Windows does not have: pipes, devices, links"
SIGNALS = "ends by a signal that Windows does not have, or looks at a terminal of Linux"
SPEED = "reads a shaft so fast that a pause of wine on a busy machine leaves a position unconfirmed"
# For each module the tests that do not apply to absenc.exe, by their reasons.
MODULES = {
    "amt21": {},
    "campaign": {},
    "change": {
        PORTS: ["Journal.test_empty_journal_is_reported", "Journal.test_every_kind_of_change_can_be_put_back",
                "Journal.test_serve_records_changes", "Journal.test_truncated_line_does_not_damage_next_one"],
    },
    "clocked": {
        PORTS: ["SpiAddress.test_device_in_absenc_toml", "SpiAddress.test_refuses_file_that_is_no_spi_device",
                "SpiAddress.test_refuses_wrong_link"],
    },
    "config": {
        PORTS: ["FileSearch.test_example_of_message_is_valid",
                "FileSearch.test_missing_file_is_reported_with_example", "FileSearch.test_search_order",
                "Names.test_every_verb_accepts_name", "Names.test_protocol_with_port_needs_no_file"],
        FILES: ["WrongFiles.test_refuses_dangling_link", "WrongFiles.test_refuses_endless_file",
                "WrongFiles.test_refuses_fifo"],
        SIGNALS: ["ManyEncoders.test_serve_with_many_encoders_ends_by_signal"],
    },
    "conform": {},
    "crc_find": {},
    "decode_file": {},
    "e201": {SIGNALS: ["ClockSweep.test_interrupt_restores_clock"]},
    "encolink_command": {},
    "hiperface": {},
    "info": {PORTS: ["Info.test_all_fields_as_text", "Info.test_json"]},
    "joint": {},
    "linear": {SPEED: ["Recording.test_csv", "Recording.test_json_lines"]},
    "memory": {
        PORTS: ["Files.test_dump_and_load"],
        FILES: ["Files.test_failed_dump_keeps_old_file", "Files.test_refuses_unwritable_output"],
        SIGNALS: ["Bytes.test_question_and_progress", "Interruptions.test_interrupted_before_first_write",
                  "Interruptions.test_interrupted_load_reports_progress_and_can_continue"],
    },
    "raa38_can": {
        PORTS: ["CanBus.test_log", "CanBus.test_monitors_two_nodes", "Usage.test_refuses_wrong_addresses",
                "Usage.test_reports_missing_interface"],
    },
    "raa38_modbus": {PORTS: ["Reading.test_read_record_and_monitor", "SharedLine.test_monitors_several_encoders"]},
    "word": {},
}


def tests_of(suite):
    for test in suite:
        if isinstance(test, unittest.TestSuite):
            yield from tests_of(test)
        else:
            yield test


def chosen(modules):
    """Returns the tests of these modules that apply. A name in MODULES that no test has is an error."""
    suite = unittest.TestSuite()
    for module in modules:
        left_out = {name: reason for reason, names in MODULES[module].items() for name in names}
        for test in tests_of(unittest.defaultTestLoader.loadTestsFromName(f"{module}_test")):
            name = test.id().partition(".")[2]
            reason = left_out.pop(name, None)
            if reason is None:
                suite.addTest(test)
            else:
                print(f"left out: {module}: {name} {reason}", file=sys.stderr)
        if left_out:
            raise SystemExit(f"{module}_test.py has no such tests: {', '.join(left_out)}")
    return suite


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    with Prefix() as prefix:
        os.environ.update(prefix.environment)
        os.environ.update({
            "ABSENC_LINUX": os.path.abspath(os.environ["ABSENC"]), "ABSENC": os.path.join(here, "absenc_exe.sh"),
            "ABSENC_EXE": os.path.abspath(os.environ["ABSENC_EXE"]), "WINE": WINE})
        result = unittest.TextTestRunner().run(chosen(sys.argv[1:] or MODULES))
    return 0 if result.wasSuccessful() else 1


if __name__ == "__main__":
    sys.exit(main())
