"""Numbers of all options: finite, and small enough for what they count."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import wraps
from typing import Any

LARGEST = 2**63 - 1  # what a layer, a manifest and a tensor can hold


def bound_numbers(command: Any) -> None:
    """Have a command (a click group too) and those below it refuse NaN, infinities and huge numbers in any option."""
    if command.callback is not None:
        command.callback = _checked(command.callback)
    for below in getattr(command, "commands", {}).values():
        bound_numbers(below)


def _checked(callback: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(callback)
    def call(*values: Any, **options: Any) -> Any:
        for name, value in options.items():
            for number in value if isinstance(value, tuple | list) else (value,):
                check_number(f"--{name.replace('_', '-')}", number)
        return callback(*values, **options)

    return call


def check_number(name: str, value: Any) -> None:
    """Raises ValueError for a NaN, an infinity, a seed below 0 or an integer beyond `LARGEST`; other values pass."""
    if name == "--seed" and isinstance(value, int) and not 0 <= value <= LARGEST:
        raise ValueError(f"seed is {value}, allowed: 0 to {LARGEST}")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{name} is {value}, allowed: a finite number")
    if isinstance(value, int) and abs(value) > LARGEST:
        raise ValueError(f"{name} is {value}, allowed: -{LARGEST} to {LARGEST}")
