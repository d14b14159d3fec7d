"""The errors a caller may meet; each message says what happened and what to do next."""
from __future__ import annotations

import difflib
import functools
from collections.abc import Callable, Iterable
from typing import ParamSpec, TypeVar

Given = ParamSpec("Given")
Made = TypeVar("Made")


class Error(Exception):
    """Base of every error this package raises on purpose.

    A message quotes what a file or a caller gave. The middle of one that gets too long is left
    out.
    """

    longest: int | None = 900

    def __init__(self, message: str = "") -> None:
        if self.longest is not None and len(message) > self.longest:
            half = self.longest // 2
            message = f"{message[:half]} ... {message[-half:]}"
        super().__init__(message)


class ContextError(Error):
    """No OpenGL context could be made, or the one at hand is too old."""


class ShaderError(Error):
    """A fragment program does not resolve or compile."""

    longest = None      # it holds the compiler's lines


class SceneError(Error):
    """A scene is missing, unreadable or broken."""


class LimitError(Error):
    """A texture, an index or the memory is past what the platform holds."""


class OptionError(Error, ValueError):
    """An option or a name is not one that exists."""


class MethodError(Error):
    """A folder or file of a user's own methods is missing or broken."""

    longest = None      # it may hold the compiler's lines


class SettingsError(Error):
    """A settings file is unreadable, or made for another scene or renderer."""


def memory_limited(function: Callable[Given, Made]) -> Callable[Given, Made]:
    """A public function whose MemoryError becomes a LimitError, which says how much was asked
    for."""
    @functools.wraps(function)
    def limited(*given: Given.args, **named: Given.kwargs) -> Made:
        try:
            return function(*given, **named)
        except MemoryError as failure:
            raise LimitError(f"{function.__name__}: not enough memory ({failure or 'all is used'})"
                             "; take fewer rays at a time, a smaller picture or a smaller scene"
                             ) from failure
    return limited


def how_to_install(extra: str) -> str:
    """The command that installs what an extra of setup.cfg lists. No package index serves this
    package, so the command names the checkout's own folder."""
    return f"in the checkout's folder, pip install -e '.[{extra}]'"


def nearest_names(name: str, known: Iterable[str]) -> str:
    """A clause that suggests the nearest known names: "; did you mean a or b?"; else all."""
    known = sorted(known)
    return did_you_mean(name, known) or f"; known: {', '.join(known)}"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The same, empty where no name is near: for messages that list the known ones anyway."""
    if not isinstance(name, str):       # a wrong type, through the Python API
        return ""
    near = difflib.get_close_matches(name, sorted(known), n=3, cutoff=0.6)
    return f"; did you mean {' or '.join(near)}?" if near else ""
