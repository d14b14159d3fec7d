"""Lit pictures: renders pictures with mirrors, glass and lamps, and lists the costs."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import gpgpu_rt as rt

from ..framework.cell import Cell
from ..framework.results import read

HEADS = ("picture", "method", "triangles", "s", "rays traced", "M rays/s", "passes", "MiB")


def cell(scene: str, method: str, full: bool, runs: int = 1, quick: int = 144) -> Cell:
    """The cell of a picture. ``quick`` is the side in pixels at the quick size."""
    return Cell(scene, method, (), 512 if full else quick, "picture", runs)


def row_of(cell: Cell, data: Path) -> list[Any] | None:
    """A row with the columns HEADS, or None if the picture was not measured.

    The number of rays includes the empty rays of pixels whose path has ended.
    """
    found = read(cell, data)
    if found is None:
        return None
    cost, seconds = found["statistics"], found["median_ms"] / 1e3
    rays = cost["waves"] * cell.size ** 2
    return [cell.scene, cell.method, found["scene"]["triangles"], seconds, rays,
            rays / seconds / 1e6, cost["passes"] + sum(cost["picture_passes"].values()),
            cost["texture_bytes"] / 2**20]


def picture(cell: Cell) -> np.ndarray:
    """The picture of a cell (framework/cell.py), (size, size, 3) uint8."""
    with rt.Tracer(cell.scene, cell.method) as tracer:
        return np.asarray(tracer.render(size=(cell.size, cell.size)))
