"""Checks the rules of `gpgpu_rt.charts` on each chart when the chart is written to a file."""
from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import pytest

MOST_ENTRIES = 8     # largest number of entries of a legend
MOST_DIGITS = 3      # largest number of significant digits of a number at a tick
NUMBER = re.compile(r"[−-]?\d[\d,]*(\.\d+)?")


def faults(figure: Any) -> list[str]:
    """Returns a sentence for each place where a chart breaks a rule."""
    figure.canvas.draw()
    found = [f"the chart has the title {figure.get_suptitle()!r}"] if figure.get_suptitle() else []
    for axis in figure.axes:
        found += [*_bars(axis), *_ticks(axis)]
    for legend in (*figure.legends, *(axis.get_legend() for axis in figure.axes)):
        if legend is not None and len(legend.get_texts()) > MOST_ENTRIES:
            found.append(f"a legend has {len(legend.get_texts())} entries")
    return found


def _bars(axis: Any) -> Iterator[str]:
    """Yields a sentence for each fault of an axis with bars or filled areas. Such an axis must be
    linear and contain zero."""
    from matplotlib.collections import FillBetweenPolyCollection
    from matplotlib.container import BarContainer
    from matplotlib.patches import StepPatch
    bars = [container for container in axis.containers if isinstance(container, BarContainer)]
    across = {"x" if bar.orientation == "horizontal" else "y" for bar in bars}
    if any(isinstance(one, FillBetweenPolyCollection) for one in axis.collections) or any(
            isinstance(one, StepPatch) and one.get_fill() for one in axis.patches):
        across.add("y")
    for which in across:
        low, high = sorted(getattr(axis, f"get_{which}lim")())
        if getattr(axis, f"get_{which}scale")() != "linear":
            yield f"bars lie on a logarithmic {which} axis"
        elif not low <= 0 <= high:
            yield f"bars lie on an {which} axis from {low:g} to {high:g}, without zero"


def _ticks(axis: Any) -> Iterator[str]:
    """Yields a sentence for each fault of the ticks. A tick's number must be round and have no
    exponent. An axis must not show a common factor such as 1e6. A logarithmic axis must have at
    least two numbers."""
    if not axis.axison:
        return
    for one in (axis.xaxis, axis.yaxis):
        low, high = sorted(one.get_view_interval())
        shown = [tick.label1.get_text() for tick in (*one.get_major_ticks(),
                                                     *one.get_minor_ticks())
                 if low <= tick.get_loc() <= high and tick.label1.get_visible()]
        if one.get_offset_text().get_text():
            yield f"an axis is multiplied by {one.get_offset_text().get_text()}"
        numbers = [text for text in shown if NUMBER.fullmatch(text)]
        yield from (f"the tick {text!r} is not a plain number" for text in shown
                    if "mathdefault" in text or re.fullmatch(r"[\d.]+e[+-]?\d+", text))
        yield from (f"the tick {text!r} is not round" for text in numbers if not _round(text))
        ticks = one.get_major_ticks()      # inner axes that share a scale hide their numbers
        hidden = bool(ticks) and not any(tick.label1.get_visible() for tick in ticks)
        if one.get_scale() == "log" and len(numbers) < 2 and not hidden:
            yield f"a logarithmic axis from {low:g} to {high:g} has {len(numbers)} numbers"


def _round(text: str) -> bool:
    """Returns whether a number is a power of two or has at most MOST_DIGITS significant digits."""
    digits = re.sub(r"[^\d]", "", text).strip("0")
    whole = re.sub(r"[^\d]", "", text) if "." not in text else ""
    return len(digits) <= MOST_DIGITS or bool(whole) and int(whole).bit_count() == 1


@pytest.fixture(scope="session", autouse=True)
def checked_charts() -> Iterator[None]:
    """Makes a test or a fixture fail if it writes a chart that breaks a rule."""
    try:
        from matplotlib.figure import Figure
    except ImportError:
        yield
        return
    write = Figure.savefig

    def savefig(figure: Any, *arguments: Any, **more: Any) -> None:
        found = faults(figure)
        assert not found, found
        write(figure, *arguments, **more)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", savefig)
        yield
