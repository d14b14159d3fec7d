"""Text format: formats numbers, counts and names for messages and tables."""
from __future__ import annotations


def counted(number: int, thing: str) -> str:
    """Return a count with its noun: ``1 pass``, ``1,281 passes``."""
    plural = thing + ("es" if thing.endswith(("s", "x", "ch", "sh")) else "s")
    return f"{number:,} {thing if number == 1 else plural}"


def shortened(value: object) -> str:
    """Return a value's text in at most 80 characters."""
    try:
        words = repr(value)
    except ValueError:      # Python refuses to write so many digits
        words = "a number of too many digits"
    return words if len(words) <= 80 else words[:77] + "..."


def printable(text: str) -> str:
    """Return a file name with a question mark for each byte that is not UTF-8."""
    return text.encode("utf-8", "replace").decode()


def titled(name: str, stand_in: str | None) -> str:
    """Return a scene's name; a stand-in gets the suffix " (stand-in)"."""
    return f"{name} (stand-in)" if stand_in else name


def number(value: float | None, digits: int = 3) -> str:
    """Return a number with ``digits`` significant digits; a dash for None and NaN."""
    return "-" if value is None or value != value else f"{float(f'{value:.{digits}g}'):g}"
