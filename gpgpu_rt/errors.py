"""The errors a caller may meet; each message says what happened and what to do next."""
from __future__ import annotations

import difflib
from collections.abc import Iterable


class Error(Exception):
    """Base of every error this package raises on purpose."""


class ContextError(Error):
    """No OpenGL context could be made, or the one at hand is too old."""


class ShaderError(Error):
    """A fragment program does not resolve or compile."""


class SceneError(Error):
    """A scene is missing, unreadable or broken."""


class LimitError(Error):
    """A texture, an index or the memory is past what the platform holds."""


class OptionError(Error, ValueError):
    """An option or a name is not one that exists."""


class MethodError(Error):
    """A folder or file of a user's own methods is missing or broken."""


class SettingsError(Error):
    """A settings file is unreadable, or made for another scene or renderer."""


def nearest_names(name: str, known: Iterable[str]) -> str:
    """A clause that suggests the nearest known names: "; did you mean a or b?"; else all."""
    known = sorted(known)
    return did_you_mean(name, known) or f"; known: {', '.join(known)}"


def did_you_mean(name: str, known: Iterable[str]) -> str:
    """The same, empty where no name is near: for messages that list the known ones anyway."""
    near = difflib.get_close_matches(name, sorted(known), n=3, cutoff=0.6)
    return f"; did you mean {' or '.join(near)}?" if near else ""
