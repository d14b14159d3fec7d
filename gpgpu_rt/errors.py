"""The errors that this package raises; each message says what is wrong and what to do next."""
from __future__ import annotations

import difflib
import functools
import os
from collections.abc import Callable, Iterable
from typing import ParamSpec, TypeVar

Given = ParamSpec("Given")
Made = TypeVar("Made")


class Error(Exception):
    """Base class of this package's errors. A message may quote a long text, so a message with more
    than ``longest`` characters loses its middle."""

    longest: int | None = 900

    def __init__(self, message: str = "") -> None:
        if self.longest is not None and len(message) > self.longest:
            half = self.longest // 2
            message = f"{message[:half]} ... {message[-half:]}"
        super().__init__(message)


class ContextError(Error):
    """No OpenGL context could be created, or the context is too old."""


class ShaderError(Error):
    """A fragment program has an unresolved include, or does not compile."""

    longest = None      # keep the compiler's output whole


class SceneError(Error):
    """A scene is missing, unreadable or broken."""


class LimitError(Error):
    """A texture, an index or the memory exceeds the platform's limits, or a file exceeds the
    memory budget (``disk/budget.py``)."""


class OptionError(Error, ValueError):
    """An option, its value or a name is not valid."""


class MethodError(Error):
    """A folder or file of a user's own methods is missing or broken."""

    longest = None      # keep the compiler's output whole


class SettingsError(Error):
    """A settings file is unreadable, or was made for another scene or renderer."""


def memory_limited(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """Decorate a function: a MemoryError becomes a LimitError that says what to reduce."""
    @functools.wraps(function)
    def limited(*given: Given.args, **named: Given.kwargs) -> Made:
        try:
            return function(*given, **named)
        except MemoryError as failure:
            raise LimitError(f"{function.__name__}: not enough memory ({failure or 'all is used'})"
                             "; use fewer rays per call, a smaller picture or a smaller scene"
                             ) from failure
    return limited


def how_to_install(extra: str) -> str:
    """Return the command that installs an extra of setup.cfg. No package index serves this
    package, so the command installs from the checkout or from a wheel."""
    if os.path.exists(os.path.join(os.path.dirname(__file__), os.pardir, "setup.cfg")):
        return f"in the checkout's folder, pip install -e '.[{extra}]'"
    return f"pip install 'WHEEL[{extra}]', where WHEEL is the file of this package's wheel"


def nearest_names(name: str, known: Iterable[str]) -> str:
    """Return a clause with the nearest known names, "; did you mean a or b?", or with all names if
    none is near."""
    known = sorted(known)
    return did_you_mean(name, known) or f"; known: {', '.join(known)}"


def nearest_name(name: str, known: Iterable[str]) -> str:
    """Return a clause as `nearest_names` does. If ``name`` is a list of known names, the clause
    asks for one of them."""
    parts = [part.strip() for part in name.split(",") if part.strip()]
    if "," in name and parts and set(parts) <= set(known):
        return f"; this is a list, give one name: {' or '.join(parts)}"
    return nearest_names(name, known)


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """Return a clause with the nearest known names, "; did you mean a or b?", or "". Messages
    that already list all names use this function; other messages use `nearest_names`."""
    if not isinstance(name, str):       # a wrong type from the Python API
        return ""
    near = difflib.get_close_matches(name, sorted(known), n=3, cutoff=0.6)
    return f"; did you mean {' or '.join(near)}?" if near else ""
