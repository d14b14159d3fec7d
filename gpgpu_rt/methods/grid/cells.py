"""Uniform grid: the structure and its build.

T. J. Purcell, I. Buck, W. R. Mark, P. Hanrahan, "Ray tracing on programmable graphics hardware",
SIGGRAPH 2002. A cell lists a triangle only if the triangle, not just its box, overlaps the cell.
The build tests overlap by separating axes (T. Akenine-Moeller, "Fast 3D triangle-box overlap
testing", 2001). A column is a line of cells along the dominant axis of the triangle's normal. In
each column, the build first finds the cells that the triangle's plane crosses. It then tests the
triangle's edges in the three projections along the axes. Cells are widened by `bounds.padding`.
"""
from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...accel.bounds import as_triangles, padding, scene_box
from ...accel.options import in_range, refuse_unknown
from ...accel.runs import chunks, expand, owners
from ...accel.sound import alike, are_runs, named, within
from ...errors import LimitError, OptionError

MOST_CELLS_AN_AXIS = 512
MOST_REFERENCES = 1 << 27           # 0.5 GiB of int32
# An automatic resolution is halved while the grid of n triangles holds more than
# USUAL_REFERENCES * n + 4096 references.
USUAL_REFERENCES = 64
# Smallest side of a cell, in units of the padding. Smaller cells would list many triangles that
# only the padding touches.
FINEST_CELL = 8
CHUNK = 1 << 18                     # columns in a chunk; a chunk of cells is four times as large


@dataclass(frozen=True)
class Grid:
    """A uniform grid; cell (x, y, z) has the index x + rx * (y + ry * z).

    Attributes
    ----------
    lo, hi : (3,) float32, the padded scene box, world units
    resolution : (3,) int32, the number of cells along each axis
    cell_size : (3,) float32, world units
    cell_start : (cells + 1,) int32, each cell's first reference; the last entry is m
    references : (m,) int32, triangles, ascending within a cell
    """

    lo: np.ndarray
    hi: np.ndarray
    resolution: np.ndarray
    cell_size: np.ndarray
    cell_start: np.ndarray
    references: np.ndarray

    def is_sound(self, triangles: int) -> bool:
        """Whether the arrays are valid for ``triangles`` triangles; see ``accel/sound.py``."""
        return (alike(named(self, "lo hi cell_size"), "f", 3)
                and within(self.resolution, 1 << 10, 1)
                and len(self.resolution) == 3 and within(self.references, triangles)
                and are_runs(self.cell_start, len(self.references),
                             int(np.prod(self.resolution, dtype=np.int64))))


def build_grid(triangles: np.ndarray, *, resolution: int | Sequence[int] | None = None,
               density: float = 5.0, **unknown: object) -> Grid:
    """Build a uniform grid.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    resolution : number of cells along each axis, one number or three, 1 to 512; by default from
        `density`
    density : target number of cells per triangle. A flat scene has one cell across its thin axis.
        The default resolution is halved until the grid holds at most 64 n + 4096 references

    Raises
    ------
    LimitError
        if the grid would hold more than 2^27 references
    OptionError, SceneError
    """
    refuse_unknown(build_grid, unknown)
    density = in_range("density", density, 1e-9, 1e9)
    triangles = as_triangles(triangles)
    lo, hi = scene_box(triangles)
    if resolution is not None:
        resolution = _given_resolution(resolution)
        keys = _keys(triangles, lo, hi, resolution, MOST_REFERENCES)
        if keys is None:
            raise LimitError(f"a grid of {' x '.join(map(str, resolution))} cells holds more "
                             f"than {MOST_REFERENCES} references; lower resolution")
    else:
        resolution = _resolution(triangles, hi.astype(np.float64) - lo, density)
        usual = USUAL_REFERENCES * len(triangles) + 4096
        while (keys := _keys(triangles, lo, hi, resolution, usual)) is None:
            resolution = np.maximum(resolution // 2, 1)    # a single cell never exceeds `usual`
    cell_size = ((hi.astype(np.float64) - lo) / resolution).astype(np.float32)
    cells = int(np.prod(resolution.astype(np.int64)))
    key = np.concatenate(keys)
    key.sort()
    cell_start = np.zeros(cells + 1, np.int32)
    used, count = np.unique(key >> 32, return_counts=True)
    cell_start[used + 1] = count
    np.cumsum(cell_start, out=cell_start)
    return Grid(lo, hi, resolution.astype(np.int32), cell_size, cell_start,
                (key & 0xffffffff).astype(np.int32))


def _keys(triangles: np.ndarray, lo: np.ndarray, hi: np.ndarray, resolution: np.ndarray,
          most: int) -> list[np.ndarray] | None:
    """Return keys ``cell << 32 | triangle`` of overlaps; None for more than ``most`` overlaps."""
    keys = [np.zeros(0, np.int64)]
    total = 0
    for triangle, cell in _overlaps(triangles, lo, hi, resolution):
        index = cell[:, 0] + resolution[0] * (cell[:, 1] + resolution[1] * cell[:, 2])
        keys.append(index << 32 | triangle)
        total += len(triangle)
        if total > most:
            return None
    return keys


def _given_resolution(resolution: int | Sequence[int]) -> np.ndarray:
    values = np.ravel(np.asarray(resolution, dtype=object)).tolist()
    if len(values) not in (1, 3):
        raise OptionError(f"resolution has {len(values)} numbers; give one number or three")
    return np.array([in_range("resolution", value, 1, MOST_CELLS_AN_AXIS, int)
                     for value in values * (3 // len(values))], np.int64)


def _resolution(triangles: np.ndarray, size: np.ndarray, density: float) -> np.ndarray:
    """Return the number of cells along each axis i: n_i = L_i (density * n / V)^(1/3).

    The box has the sides L_i, the volume V and n triangles. An axis with less than one cell gets
    one cell, and the formula is applied to the other axes.
    """
    if len(triangles) == 0:
        return np.ones(3, np.int64)
    finest = np.clip(size / (FINEST_CELL * float(padding(triangles))), 1, MOST_CELLS_AN_AXIS)
    cells = density * len(triangles)
    exact = np.ones(3)
    axes = np.argsort(size)             # the thinnest axis first
    for used in range(3):
        thick = axes[used:]
        scale = (cells / np.prod(size[thick] / size[thick[-1]])) ** (1 / len(thick))
        if scale * size[thick[0]] / size[thick[-1]] >= 1 or len(thick) == 1:
            exact[thick] = scale * size[thick] / size[thick[-1]]
            break
    return np.clip(np.rint(exact), 1, np.floor(finest)).astype(np.int64)


def _overlaps(triangles: np.ndarray, lo: np.ndarray, hi: np.ndarray,
              resolution: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield chunks of all overlapping pairs: triangles, (m,) int64, and cells, (m, 3) int64."""
    shape = Shapes(triangles, lo, hi, resolution)
    columns = np.take_along_axis(shape.cell_count, shape.across, 1).prod(axis=1)
    for part in chunks(columns, CHUNK):
        triangle = owners(columns[part]) + part.start
        rank = expand(np.zeros(part.stop - part.start, np.int64), columns[part])
        cell = shape.column(triangle, rank)
        first, height = shape.plane_range(triangle, cell)
        for inner in chunks(height, 4 * CHUNK):
            tall = height[inner]
            who = np.repeat(triangle[inner], tall)
            where = np.repeat(cell[inner], tall, axis=0)
            up = expand(first[inner], tall)
            np.put_along_axis(where, shape.axis[who, None], up[:, None], 1)
            kept = np.flatnonzero(shape.edges_overlap(who, where))
            yield who[kept], where[kept]


class Shapes:
    """Data of each triangle for the overlap tests, relative to the grid's lower corner."""

    def __init__(self, triangles: np.ndarray, lo: np.ndarray, hi: np.ndarray,
                 resolution: np.ndarray) -> None:
        self.vertex = triangles.astype(np.float64) - lo
        self.cell_size = (hi.astype(np.float64) - lo) / resolution
        pad = float(padding(triangles))
        self.half = self.cell_size / 2 + pad
        first = np.floor((self.vertex.min(axis=1) - pad) / self.cell_size).astype(np.int64)
        last = np.floor((self.vertex.max(axis=1) + pad) / self.cell_size).astype(np.int64)
        self.first = np.clip(first, 0, resolution - 1)
        self.cell_count = np.clip(last, 0, resolution - 1) - self.first + 1
        self.edge = np.roll(self.vertex, -1, axis=1) - self.vertex
        self.normal = np.cross(self.edge[:, 0], self.edge[:, 1])
        self.axis = np.abs(self.normal).argmax(axis=1)
        self.across = (self.axis[:, None] + [1, 2]) % 3

    def column(self, triangle: np.ndarray, rank: np.ndarray) -> np.ndarray:
        """Return the first cell, (m, 3), of column number rank[i] of triangle[i]."""
        cell = self.first[triangle]
        u, v = self.across[triangle].T
        across_u = self.cell_count[triangle, u]
        row = np.arange(len(triangle))
        cell[row, u] += rank % across_u
        cell[row, v] += rank // across_u
        return cell

    def plane_range(self, triangle: np.ndarray,
                    cell: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return each column's first cell that the triangle's plane crosses, and their count."""
        normal, axis, row = self.normal[triangle], self.axis[triangle], np.arange(len(triangle))
        first, count = self.first[triangle, axis], self.cell_count[triangle, axis]
        along = normal[row, axis]
        flat = along == 0                   # a triangle without area gets the whole column
        slope = normal / np.where(flat, 1, along)[:, None]
        slope[row, axis] = 0
        offset = self.vertex[triangle, 0] - (cell + 0.5) * self.cell_size
        centre = self.vertex[triangle, 0, axis] + (offset * slope).sum(axis=1)
        reach = (np.abs(slope) * self.half).sum(axis=1) + self.half[axis]
        size = self.cell_size[axis]
        # The plane crosses the cells whose centres lie within `reach` of it, along `axis`.
        low = np.ceil((centre - reach) / size - 0.5).astype(np.int64)
        high = np.floor((centre + reach) / size - 0.5).astype(np.int64)
        low = np.where(flat, first, np.maximum(low, first))
        high = np.where(flat, first + count - 1, np.minimum(high, first + count - 1))
        return low, np.maximum(high - low + 1, 0)

    def overlap(self, triangle: np.ndarray, cell: np.ndarray) -> np.ndarray:
        """Return (m,) bool, whether triangle[i] overlaps cell[i], (m, 3).

        The caller ensures that the box of triangle[i] overlaps cell[i].
        """
        low, height = self.plane_range(triangle, cell)
        up = cell[np.arange(len(cell)), self.axis[triangle]]
        found = (up >= low) & (up < low + height)
        some = np.flatnonzero(found)
        found[some] = self.edges_overlap(triangle[some], cell[some])
        return found

    def edges_overlap(self, triangle: np.ndarray, cell: np.ndarray) -> np.ndarray:
        """Return whether no edge separates triangle and cell in any of the three projections."""
        centre = (cell + 0.5) * self.cell_size
        result = np.ones(len(triangle), bool)
        for a in range(3):
            b, c = (a + 1) % 3, (a + 2) % 3
            facing = np.sign(self.normal[triangle, a])
            for i in range(3):
                edge_b, edge_c = self.edge[triangle, i, b], self.edge[triangle, i, c]
                inside = edge_b * (centre[:, c] - self.vertex[triangle, i, c]) \
                    - edge_c * (centre[:, b] - self.vertex[triangle, i, b])
                reach = np.abs(edge_b) * self.half[c] + np.abs(edge_c) * self.half[b]
                # A triangle seen edge-on is a line, and both of its sides are outside.
                result &= np.where(facing == 0, np.abs(inside), -facing * inside) <= reach
        return result
