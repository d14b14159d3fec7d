"""The survey's own numbers, from ``figures/published/published.csv``."""
from __future__ import annotations

import csv
import functools
import importlib.resources


@functools.cache
def _rows() -> tuple[dict[str, str], ...]:
    file = importlib.resources.files("gpgpu_rt.figures") / "published" / "published.csv"
    with file.open(newline="") as lines:
        return tuple(csv.DictReader(lines))


def published(figure: str, scene: str, method: str, options: str = "") -> float | None:
    """A published time or rate, in the survey's unit, or None where it printed none."""
    for row in _rows():
        if (row["figure"], row["scene"], row["method"], row["options"]) == (figure, scene, method,
                                                                            options):
            return float(row["value"])
    return None


def published_triangles(figure: str, scene: str) -> int | None:
    """The triangle count that a figure states for a scene."""
    counts = {row["triangles"] for row in _rows()
              if row["figure"] == figure and row["scene"] == scene} - {""}
    return int(counts.pop()) if counts else None
