# SPDX-License-Identifier: Apache-2.0
"""Types of the arguments and results of absenc, and checks of arguments."""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from numbers import Real
from typing import Union

from .errors import UsageError

#: Value of an option; an iterable gives the option several times.
Value = Union[str, int, float, bool, None, Iterable[str]]

#: Value of a field. Flags are a tuple of names. None means that the value was not reported, or is invalid.
Field = Union[None, bool, int, float, str, bytes, tuple[str, ...]]


def natural(name: str, value: float, least: int = 0, most: int = 2**32 - 1) -> int:
    """Returns the argument `name` as int. Raises UsageError for no whole number within the limits."""
    if not isinstance(value, Real) or value != value // 1 or not least <= value <= most:
        raise UsageError(f"{name} is a whole number from {least} to {most}, not {value!r}")
    return int(value)


def texts(options: Mapping[str, Value]) -> list[str]:
    """Converts `alarm=["a", "b"]` to "alarm=a", "alarm=b"; None is omitted."""
    settings = []
    for name, value in options.items():
        if value is None:  # keyword arguments have the default None, which means that the option is not given
            continue
        if isinstance(value, bool):
            settings.append(f"{name}={str(value).lower()}")
        elif isinstance(value, (str, int, float)):
            settings.append(f"{name}={value}")
        else:
            settings.extend(f"{name}={one}" for one in value)
    return settings
