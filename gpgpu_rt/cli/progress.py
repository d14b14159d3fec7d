"""Progress: shows a bar in a terminal or a notebook if tqdm is installed; else prints lines."""
from __future__ import annotations

import contextlib
import warnings
from collections.abc import Callable, Iterator
from typing import Any

from ..text_format import counted
from ..views import in_notebook
from .shared import say

Lines = Callable[[int, int, str], None]     # gets the number done, the total, and a note


@contextlib.contextmanager
def show_progress(unit: str, lines: Lines) -> Iterator[Callable[..., None]]:
    """Yield a function ``report(done, total, note)`` that shows progress; the note may be ""."""
    bars: list[Any] = []

    def tell(done: int, of: int, note: str = "") -> None:
        if not bars:
            bars.append(_bar(unit, of))
        if bars[0] is None:
            lines(done, of, note)
        else:
            bars[0].set_postfix_str(note, refresh=False)
            bars[0].update(done - bars[0].n)

    try:
        yield tell
    finally:
        for bar in bars:
            if bar is not None:
                bar.close()


def tenths(unit: str) -> Lines:
    """Return a function that prints a line per tenth of the work."""
    printed = 0

    def tell(done: int, of: int, note: str) -> None:
        nonlocal printed
        if 10 * done // of > printed:
            printed = 10 * done // of
            say(f"{done:,} of {counted(of, unit)}")

    return tell


def doublings(unit: str) -> Lines:
    """Return a function that prints a line at each doubling of the work done, and at the end."""
    told_of = 0

    def tell(done: int, of: int, note: str) -> None:
        nonlocal told_of
        if done >= 2 * told_of or done == of:
            told_of = done
            say(f"{done:,} of {counted(of, unit)} per pixel" + (f", {note}" if note else ""))

    return tell


def _bar(unit: str, of: int) -> Any:
    """Return a tqdm bar; None without tqdm, or outside of notebooks and terminals."""
    try:
        with warnings.catch_warnings():
            # In a notebook without widgets, tqdm warns and draws text.
            warnings.simplefilter("ignore")
            from tqdm.auto import tqdm
    except ImportError:
        return None
    # With ``disable=None``, tqdm shows a bar only in a terminal, so a notebook needs False.
    bar = tqdm(total=of, unit=unit, dynamic_ncols=True, disable=False if in_notebook() else None)
    return None if bar.disable else bar
