"""Options: checks options; the error for an unknown name suggests similar known names."""
from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable
from typing import Any

from ..errors import OptionError, nearest_names


def refuse_unknown(builder: Callable, unknown: Iterable[str]) -> None:
    """Raise OptionError for the first of the ``unknown`` names. The message suggests similar
    options of `builder`."""
    known = [name for name, parameter in inspect.signature(builder).parameters.items()
             if parameter.kind is parameter.KEYWORD_ONLY]
    for name in unknown:
        raise OptionError(f"{builder.__name__} has no option {name!r}{nearest_names(name, known)}")


def choose(what: str, name: Any, known: Iterable[str]) -> str:
    """Return the name if it is known; raise OptionError otherwise. ``what`` is the noun before the
    name in the message, such as "build"."""
    known = list(known)
    if name not in known:
        raise OptionError(f"unknown {what} {name!r}{nearest_names(str(name), known)}")
    return name


def in_range(what: str, value: Any, lowest: float, highest: float, kind: type = float) -> Any:
    """Return the value as `kind`; raise OptionError if it is not a number from lowest to highest.
    ``what`` is the value's name in the message."""
    try:
        number = kind(value)
    except (TypeError, ValueError, OverflowError):
        number = None
    if number is None or number != value or not lowest <= number <= highest:
        noun = "whole number" if kind is int else "number"
        raise OptionError(f"{what} is {value!r}; give a {noun} from {lowest} to {highest}")
    return number
