# SPDX-License-Identifier: Apache-2.0
"""Pytest fixtures for programs that read encoders.

    def test_drive(absenc_emulate):
        encoder = absenc_emulate("tformat", motion="rpm=60")
        encoder.set_fault("corrupt", 0.1)
        assert my_drive(encoder.path).stops_safely()
"""
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest

from .emulation import Emulation, emulate


@pytest.fixture
def absenc_emulate() -> Iterator[Callable[..., Emulation]]:
    """Calls `absenc.emulate`, any number of times; the virtual encoders end with the test."""
    with ExitStack() as running:
        yield lambda *arguments, **options: running.enter_context(emulate(*arguments, **options))
