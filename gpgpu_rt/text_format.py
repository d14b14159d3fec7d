"""Words: how numbers, and numbers of things, are told."""
from __future__ import annotations


def counted(number: int, thing: str) -> str:
    """``1 pass``, ``1,281 passes``, ``2 rays``."""
    plural = thing + ("es" if thing.endswith(("s", "x", "ch", "sh")) else "s")
    return f"{number:,} {thing if number == 1 else plural}"


def shortened(value: object) -> str:
    """A value for a line: whole numbers can have thousands of digits."""
    try:
        words = repr(value)
    except ValueError:      # more digits than Python writes
        words = "a number of too many digits"
    return words if len(words) <= 80 else words[:77] + "..."


def printable(text: str) -> str:
    """A file's name as pictures and tables can hold it: a question mark for each byte that is not
    UTF-8."""
    return text.encode("utf-8", "replace").decode()


def titled(name: str, stand_in: str | None) -> str:
    """A scene's name, as pictures and tables have it: a stand-in is called one."""
    return f"{name} (stand-in)" if stand_in else name


def number(value: float | None, digits: int = 3) -> str:
    """To ``digits`` significant figures; a dash for None and NaN."""
    return "-" if value is None or value != value else f"{float(f'{value:.{digits}g}'):g}"
