"""Proximity cloud: finds each cell's distance, in cells, to the nearest occupied cell of a grid.

F. Karlsson, C. J. Ljungstedt, "Ray tracing fully implemented on programmable graphics
hardware", Chalmers, 2004, after D. Cohen, Z. Sheffer, "Proximity clouds", The Visual Computer
11, 1994. The distance is the largest of the three coordinate differences (Chebyshev distance), so
all nearer cells are empty.
"""
from __future__ import annotations

import numpy as np

from .cells import Grid


def proximity_cloud(grid: Grid) -> np.ndarray:
    """Return the distance of each cell to the nearest cell with references.

    Returns
    -------
    (cells,) int32, 0 for a cell with references; in an empty grid, the grid's largest resolution
    """
    rx, ry, rz = (int(r) for r in grid.resolution)
    far = np.int32(max(rx, ry, rz))
    occupied = np.diff(grid.cell_start) > 0
    distance = np.where(occupied, np.int32(0), far).reshape(rz, ry, rx)
    # Propagate distances along x, then y, then z. A step along an axis may also move one cell
    # along each earlier axis, and counts as one step.
    for axis in (2, 1, 0):
        older = [other for other in range(axis + 1, 3)]
        before = distance.copy()
        _sweep(distance, axis, older)
        after = np.flip(before, axis)
        _sweep(after, axis, older)
        np.minimum(distance, np.flip(after, axis), out=distance)
    return distance.reshape(-1)


def _sweep(distance: np.ndarray, axis: int, older: list[int]) -> None:
    """Propagate distances forward along the axis; each step adds 1.

    ``older`` holds the axes that were processed before.
    """
    slices = np.moveaxis(distance, axis, 0)
    for i in range(1, len(slices)):
        carried = slices[i - 1]
        for other in older:
            # A slice lacks `axis`: the indices of later axes are lower by one.
            carried = _least_of_neighbours(carried, other - 1)
        np.minimum(slices[i], carried + 1, out=slices[i])


def _least_of_neighbours(values: np.ndarray, axis: int) -> np.ndarray:
    """Return the minimum of each cell's value and its two neighbours' values along the axis."""
    result = values.copy()
    inward, outward = np.moveaxis(values, axis, 0), np.moveaxis(result, axis, 0)
    np.minimum(outward[1:], inward[:-1], out=outward[1:])
    np.minimum(outward[:-1], inward[1:], out=outward[:-1])
    return result
