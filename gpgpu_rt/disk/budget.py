"""Budget: a limit on the memory that a small file may require.

A header of a few bytes can declare gigabytes, so readers check the declared size before they
allocate memory. The environment variable GPGPU_RT_BUDGET gives the budget in MiB.
"""
from __future__ import annotations

import os

from ..errors import LimitError, OptionError

VARIABLE = "GPGPU_RT_BUDGET"
DEFAULT_MIB = 1024
TEXEL_BYTES = 16        # per texel during conversion: 3 decoded, 12 as float32, 1 spare
TRIANGLE_BYTES = 64     # per triangle with colour and material: 2^24 triangles per GiB


def budget_bytes() -> int:
    """Return the number of bytes that a file may decode to.

    Raises
    ------
    OptionError
        if the environment variable is not a number above 0
    """
    text = os.environ.get(VARIABLE) or str(DEFAULT_MIB)
    try:
        mib = float(text)
    except ValueError:
        mib = -1.0
    if not 0 < mib < 1e9:
        raise OptionError(f"{VARIABLE} is {text[:40]!r}; give a number of MiB, e.g. {DEFAULT_MIB}")
    return int(mib * (1 << 20))


def check_bytes(declared: int, stored: int, where: str) -> None:
    """Raise LimitError if a file would decode to more than the budget.

    Parameters
    ----------
    declared : number of bytes that the file decodes to, according to its headers
    stored : size of the file in bytes; data up to this size are always allowed
    where : the file, for the message
    """
    if declared > max(budget_bytes(), stored):
        raise LimitError(f"{where}: declares {_mib(declared)} of data; {_advice()}")


def check_texels(width: int, height: int, where: str) -> None:
    """Raise LimitError if an image has too many texels for the budget."""
    if width * height > budget_bytes() // TEXEL_BYTES:
        raise LimitError(f"{where}: an image of {width} x {height} texels takes "
                         f"{_mib(width * height * TEXEL_BYTES)}; make it smaller, or {_advice()}")


def check_triangles(count: int, where: str) -> None:
    """Raise LimitError if a scene has too many triangles for the budget."""
    if count > budget_bytes() // TRIANGLE_BYTES:
        raise LimitError(f"{where}: has {count:,} triangles in all, {_mib(count * TRIANGLE_BYTES)}"
                         f"; use fewer, or {_advice()}")


def _mib(size: int) -> str:
    return f"{size / (1 << 20):,.0f} MiB"


def _advice() -> str:
    return f"set {VARIABLE} (in MiB) to raise the budget of {_mib(budget_bytes())}"
