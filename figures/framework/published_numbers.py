"""Published numbers: reads the survey's numbers from ``figures/published/published.csv``."""
from __future__ import annotations

import csv
import functools
import importlib.resources
import math


@functools.cache
def _rows() -> tuple[dict[str, str], ...]:
    file = importlib.resources.files("gpgpu_rt.figures") / "published" / "published.csv"
    with file.open(newline="", encoding="utf-8") as lines:
        return tuple(csv.DictReader(lines))


def published_row(figure: str, scene: str, method: str, options: str = "",
                  rays: str | None = None, quantity: str | None = None,
                  hardware: str | None = None) -> dict[str, str] | None:
    """Return the row of a published number, or None if the survey prints none.

    Parameters
    ----------
    rays : the kind of rays, such as "primary"; needed if the figure has several kinds
    quantity : what is counted, such as "leaves"; needed if the figure has several quantities
    hardware : the hardware, as the survey names it; needed if a figure has numbers for several
        cards or CPUs
    """
    asked = {"figure": figure, "scene": scene, "method": method, "options": options,
             "rays": rays, "quantity": quantity, "hardware": hardware}
    return next((row for row in _rows() if all(value is None or row[name] == value
                                               for name, value in asked.items())), None)


def published(*names: str, **more: str | None) -> float | None:
    """Return a published number in the survey's unit, or None if the survey prints none.

    The parameters are those of `published_row`.

    Raises
    ------
    ValueError
        if the survey prints a range; use `published_range` then
    """
    row = published_row(*names, **more)
    if row is None:
        return None
    if row["high"]:
        raise ValueError(f"the survey prints a range for {names} {more}; use published_range")
    return float(row["value"])


def published_range(*names: str, **more: str | None) -> tuple[float, float]:
    """Return the lower and the upper end of a printed range, in the survey's unit.

    The parameters are those of `published_row`. The caller ensures that the number exists. For a
    single number both ends are equal.
    """
    row = published_row(*names, **more)
    assert row is not None, (names, more)
    low = float(row["value"])
    return low, float(row["high"] or low)


TIMES = ("ms", "Mrays/s", "frames/s")    # the units in which the survey prints times and rates


def rows_of(figure: str) -> list[dict[str, str]]:
    """Return the rows of all published numbers of a figure."""
    return [row for row in _rows() if row["figure"] == figure]


def nanoseconds(row: dict[str, str] | None) -> float | None:
    """Return a published time or rate in nanoseconds per ray; per pixel for a whole image."""
    if row is None:
        return None
    value, pixels = float(row["value"]), math.prod(map(int, row["resolution"].split("x")))
    return {"ms": 1e6 * value / pixels, "Mrays/s": 1e3 / value,
            "frames/s": 1e9 / (value * pixels)}[row["unit"]]


def published_triangles(figure: str, scene: str) -> int | None:
    """Return the triangle count that a figure states for a scene, or None."""
    counts = {row["triangles"] for row in _rows()
              if row["figure"] == figure and row["scene"] == scene} - {""}
    return int(counts.pop()) if counts else None
