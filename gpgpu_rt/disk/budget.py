"""Budget: how much memory a small file may ask for.

A header of a few bytes can declare gigabytes. Readers therefore compare what a file declares with
this budget before they allocate it. A file may always decode to as many bytes as it has itself.

The budget is $GPGPU_RT_BUDGET in MiB, 1024 by default. All limits follow from it.
"""
from __future__ import annotations

import os

from ..errors import LimitError, OptionError

VARIABLE = "GPGPU_RT_BUDGET"
DEFAULT_MIB = 1024
TEXEL_BYTES = 16        # of a texture while it is converted: 3 decoded, 12 as float32, 1 to spare
TRIANGLE_BYTES = 64     # of a triangle with its colour and material; 1 GiB holds 2^24 triangles


def budget_bytes() -> int:
    """Bytes that a file may decode to.

    Raises
    ------
    OptionError
        where the environment variable holds no number above 0
    """
    text = os.environ.get(VARIABLE) or str(DEFAULT_MIB)
    try:
        mib = float(text)
    except ValueError:
        mib = -1.0
    if not 0 < mib < 1e9:
        raise OptionError(f"{VARIABLE} is {text[:40]!r}; give MiB, as in {DEFAULT_MIB}")
    return int(mib * (1 << 20))


def check_bytes(declared: int, stored: int, where: str) -> None:
    """Raise LimitError where ``stored`` bytes would decode to more than the budget.

    Parameters
    ----------
    declared : bytes that the file decodes to, by its headers
    stored : bytes of the file itself, which are always allowed
    where : the file, for the message
    """
    if declared > max(budget_bytes(), stored):
        raise LimitError(f"{where}: declares {_mib(declared)} of data; {_advice()}")


def check_texels(width: int, height: int, where: str) -> None:
    """Raise LimitError where an image has more texels than the budget."""
    if width * height > budget_bytes() // TEXEL_BYTES:
        raise LimitError(f"{where}: an image of {width} x {height} texels takes "
                         f"{_mib(width * height * TEXEL_BYTES)}; make it smaller, or {_advice()}")


def check_triangles(count: int, where: str) -> None:
    """Raise LimitError where instances, or shapes made by number, add up to too many triangles."""
    if count > budget_bytes() // TRIANGLE_BYTES:
        raise LimitError(f"{where}: adds up to {count:,} triangles, {_mib(count * TRIANGLE_BYTES)}"
                         f"; take fewer, or {_advice()}")


def _mib(size: int) -> str:
    return f"{size / (1 << 20):,.0f} MiB"


def _advice() -> str:
    return f"raise the budget of {_mib(budget_bytes())} by {VARIABLE} (in MiB)"
