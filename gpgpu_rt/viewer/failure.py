"""Failure: writes the viewer's line for an error."""
from __future__ import annotations

from ..errors import Error


def line_of_failure(failure: BaseException) -> str:
    """Return an error in one line. An unexpected error begins with its class."""
    text = " ".join(str(failure).split()) or "no details are known"
    known = isinstance(failure, (Error, ValueError, OSError))
    return text if known else f"{type(failure).__name__}: {text}"
