# SPDX-License-Identifier: Apache-2.0
from typing import Any, Optional, Union

import numpy as np
import numpy.typing as npt

from ._values import Field

__version__: str

class Reading:
    """One position as an encoder reported it."""

    @property
    def angle_deg(self) -> Optional[float]:
        """Position in degrees, 0 to below 360; None: not known to be valid, or the encoder is linear."""
    @property
    def position_mm(self) -> Optional[float]:
        """Position of a linear encoder in mm; None: not known to be valid, or the encoder is rotary."""
    @property
    def singleturn(self) -> Optional[int]:
        """Single-turn position in counts; None: not known to be valid."""
    @property
    def multiturn(self) -> Optional[int]:
        """Number of revolutions; None: not known to be valid, or the encoder has none."""
    @property
    def singleturn_bits(self) -> int: ...
    @property
    def singleturn_valid_bits(self) -> int:
        """Number of valid bits of the position, from the highest."""
    @property
    def multiturn_bits(self) -> int: ...
    @property
    def ready(self) -> bool:
        """Whether the encoder is ready; False while it reports that it is starting."""
    @property
    def valid(self) -> bool:
        """Whether the position is known to be valid."""
    @property
    def singleturn_valid(self) -> Optional[bool]:
        """Whether the single-turn position is valid; None: unknown."""
    @property
    def multiturn_valid(self) -> Optional[bool]:
        """Whether the revolutions are valid; None: unknown, or the encoder has none."""
    @property
    def alarms(self) -> Optional[list[str]]:
        """Names of the raised alarms; []: all are reported clear; None: not known."""
    @property
    def status(self) -> Optional[list[str]]:
        """Names of the status flags that are set; []: all are reported clear; None: not known."""
    @property
    def time_s(self) -> float:
        """Time at which the position was latched, in seconds of time.monotonic()."""

class Sample:
    """A reading, a failed attempt to read, or an event of the port."""

    @property
    def kind(self) -> str:
        """Kind of sample: "reading", "failed", "lost", "back" or "absent"."""
    @property
    def time_s(self) -> float:
        """Time of the sample, in seconds of time.monotonic()."""
    @property
    def reading(self) -> Optional[Reading]: ...
    @property
    def position(self) -> Optional[int]:
        """Position in counts, continued past the end of the counter; None: no valid position."""
    @property
    def speed(self) -> Optional[float]:
        """Speed in rpm, for linear encoders mm/s: `speed_rpm` or `speed_mm_s`."""
    @property
    def speed_rpm(self) -> Optional[float]:
        """Mean speed in rpm, as it was `speed_delay_s` before `time_s`; None: unknown, or not rotary."""
    @property
    def speed_uncertainty_rpm(self) -> Optional[float]:
        """Greatest difference of the true mean speed from `speed_rpm`, in rpm."""
    @property
    def speed_mm_s(self) -> Optional[float]:
        """Mean speed of a linear encoder in mm/s, like `speed_rpm`; None for a rotary encoder."""
    @property
    def speed_uncertainty_mm_s(self) -> Optional[float]:
        """Greatest difference of the true mean speed from `speed_mm_s`, in mm/s."""
    @property
    def speed_delay_s(self) -> Optional[float]: ...
    @property
    def joint_deg(self) -> Optional[float]:
        """Angle of the joint in degrees: direction * (continued degrees - offset_deg) / gear; None: unknown, or not
        set."""
    @property
    def joint_mm(self) -> Optional[float]:
        """Position of the joint of a linear encoder in mm: direction * (continued mm - offset_mm); None: unknown, or
        not set."""
    @property
    def joint_speed_rpm(self) -> Optional[float]:
        """Speed of the joint."""
    @property
    def joint_speed_uncertainty_rpm(self) -> Optional[float]:
        """Greatest difference of the true mean speed from the speed of the joint."""
    @property
    def joint_speed_mm_s(self) -> Optional[float]:
        """Speed of the joint of a linear encoder."""
    @property
    def joint_speed_uncertainty_mm_s(self) -> Optional[float]:
        """Greatest difference of the true mean speed from the speed of the joint."""
    @property
    def electrical_deg(self) -> Optional[float]:
        """Electrical angle of the motor in degrees, 0 to below 360; None: not known."""
    @property
    def confirmed(self) -> bool:
        """Whether another reading confirms the position."""
    @property
    def restarted(self) -> bool:
        """Whether `position` starts again instead of continuing."""
    @property
    def text(self) -> str:
        """Why the sample has no reading, or why `position` starts again; "" otherwise."""
    @property
    def error(self) -> Any:
        """The absenc.errors.EncoderError of a failed attempt; None for other samples."""

class Samples:
    def next(self) -> Sample: ...

class Encoder:
    def __init__(self, text: str, settings: list[str]) -> None: ...
    def close(self) -> None: ...
    def stop(self, stopping: bool) -> None: ...
    def read(self) -> Reading: ...
    def read_alarms(self) -> Reading: ...
    def samples(self, rate: float, count: int) -> Samples: ...
    def run(self, command: str, *values: int, **named: int) -> dict[str, Field]: ...
    def scan(self) -> list[dict[str, Field]]: ...
    def questions(self) -> list[str]: ...
    def settings_names(self) -> list[str]: ...
    def settings_get(self, name: str) -> dict[str, Field]: ...
    def settings_set(self, name: str, *values: int, **named: int) -> dict[str, Field]: ...
    def memory_read(self, address: int, count: int, page: int) -> bytes: ...
    def memory_dump(self) -> list[tuple[int, int, int]]: ...
    def memory_write(self, address: int, data: bytes, page: int, force: bool) -> int: ...
    def record(
        self,
        path: str,
        rate: float,
        every: int,
        count: int,
        seconds: Optional[float],
        part_bytes: Optional[int],
        part_seconds: Optional[float],
    ) -> tuple[list[str], int, int, int, int, int]: ...
    def counters(self) -> dict[str, int]: ...
    @property
    def change(self) -> str: ...
    @property
    def unit(self) -> str: ...
    @property
    def model(self) -> Optional[str]: ...
    @property
    def address(self) -> str: ...
    @property
    def options(self) -> list[str]: ...
    @property
    def notes(self) -> list[str]: ...

class Emulation:
    def __init__(self, text: str, link: str, tcp: Optional[int]) -> None: ...
    @property
    def path(self) -> str: ...
    @property
    def tcp_port(self) -> int: ...
    @property
    def address(self) -> str: ...
    @property
    def unit(self) -> str: ...
    def power_off(self) -> None: ...
    def power_on(self, real: bool) -> None: ...
    def raise_alarm(self, name: str) -> None: ...
    def lower_alarm(self, name: str) -> None: ...
    def set_condition(self, name: str, value: int) -> None: ...
    def set_fault(self, kind: str, rate: float) -> None: ...
    def clear_faults(self) -> None: ...
    def answer_count(self) -> int: ...
    def violations(self) -> int: ...
    def first_violation(self) -> str: ...

class Rows:
    def __init__(
        self,
        path: str,
        unit: str,
        channels: list[str],
        raw_channels: int,
        samples_per_second: int,
        baud: float,
        parity: str,
        model: str,
        options: list[str],
    ) -> None: ...
    def columns(self) -> list[tuple[str, str, str, str]]: ...
    def take(self, most: int) -> Optional[list[tuple[Any, npt.NDArray[np.bool_]]]]: ...
    def notes(self) -> list[str]: ...

def identify(place: str, limit_s: float) -> tuple[list[dict[str, Any]], list[str], bool]: ...
def doctor(text: str, settings: list[str], seconds: float, readings: int, turning_s: float) -> str: ...
def conform(text: str, settings: list[str], readings: int, changes: bool, resets: bool) -> str: ...
def probe(
    protocol: str, model: str, settings: list[str], replies: list[str], requests: list[str]
) -> str: ...
def wave(
    text: str,
    settings: list[str],
    file: str,
    commands: list[str],
    count: int,
    rate: float,
    samples_per_second: int,
    replaces: bool,
) -> tuple[int, int, float, list[str]]: ...
def ports() -> list[str]: ...
def units() -> list[str]: ...
def unit(name: str) -> dict[str, Any]: ...
def error_names() -> list[str]: ...
def decode_frame(
    unit: str, reply: Union[bytes, str], request: Union[bytes, str], model: str, options: list[str]
) -> dict[str, Field]: ...
def encode_request(
    unit: str, command: str, values: list[int], model: str, options: list[str]
) -> Union[bytes, str]: ...
def crc(
    rows: npt.NDArray[np.uint8], width: int, poly: int, init: int, refin: bool, refout: bool, xorout: int
) -> npt.NDArray[np.uint16]: ...
