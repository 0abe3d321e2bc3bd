# SPDX-License-Identifier: Apache-2.0
"""What is given to the library, and what it tells."""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from numbers import Real
from typing import Union

from .errors import UsageError

#: Of an option; several of one name where it may be given more than once.
Value = Union[str, int, float, bool, None, Iterable[str]]

#: A number, a text, bytes, the names of flags; None: not told or not reported, or it does not hold.
Field = Union[None, bool, int, float, str, bytes, tuple[str, ...]]


def natural(name: str, value: float, least: int = 0, most: int = 2**32 - 1) -> int:
    """The argument `name`, 24e6 as well as 24000000. Raises UsageError where it is no whole number in these limits."""
    if not isinstance(value, Real) or value != value // 1 or not least <= value <= most:
        raise UsageError(f"{name} is a whole number from {least} to {most}, not {value!r}")
    return int(value)


def texts(options: Mapping[str, Value]) -> list[str]:
    """`singleturn=5, alarm=["a", "b"]` as "singleturn=5", "alarm=a", "alarm=b"; None as nothing."""
    settings = []
    for name, value in options.items():
        if value is None:  # as if it were not there
            continue
        if isinstance(value, bool):
            settings.append(f"{name}={str(value).lower()}")
        elif isinstance(value, (str, int, float)):
            settings.append(f"{name}={value}")
        else:
            settings.extend(f"{name}={one}" for one in value)
    return settings
