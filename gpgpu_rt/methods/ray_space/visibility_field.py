"""Visibility field. Lines are grouped into beams, and each beam lists its triangles in order.

J. Mortensen, P. Khanna, I. Yu, M. Slater, "A Visibility Field for Ray Tracing", CGIV 2007 (survey,
Table 1). Three faces of the direction cube (frames.py) hold half of all directions, divided into
cells. Each cell has a plane through the scene's centre, perpendicular to the face's axis, with a
grid of tiles. A beam contains all lines that have a direction in a cell and cross a tile of this
cell.

In the paper, a beam lists the triangles that its central direction hits. Here, a beam lists all
triangles that any line of the beam may hit.

A triangle's near end is its lowest coordinate along the axis, and its far end is its highest. The
triangles of a beam are sorted by their near ends. Each entry also stores the largest far end up to
this entry. Near ends and stored far ends ascend, so a binary search finds the first triangle that
a ray of the beam may hit, whichever way the ray runs. The paper uses a tree for this search.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import as_triangles, largest
from ...accel.runs import chunks, expand, owners
from ...accel.sound import alike, are_runs, named, within
from ...errors import LimitError
from ...gl.record import EXACT_INTEGER
from .frames import RaySpace, in_frame, ray_space

AXES = 3
MIB = 1 << 20
ENTRY_BYTES, BEAM_BYTES = 16, 8      # bytes in float32 textures
SAMPLES = 2000          # triangles from which the size of a field is estimated
FINEST = (8, 24)        # default limits on `directions` and `tiles`
# The least ratio of tiles to directions, both counted along a side. With smaller ratios, rays test
# more triangles in fields of equal memory.
TILES = 2
# By default, the resolution for n triangles is lowered until an estimate of the number of entries
# is at most USUAL_ENTRIES * n + 4096.
USUAL_ENTRIES = 1024
CHUNK = 1 << 20         # entries processed together


@dataclass(frozen=True)
class VisibilityField:
    """The beams of a scene and their entries. An entry is a triangle in the list of a beam.

    The beams are in the order (axis, v, u, tile y, tile x). Three more beams follow, one for each
    axis, which list all triangles.

    Attributes
    ----------
    directions : number of cells along a side of a face
    tiles : number of tiles along a side of a cell's plane
    beam_start : (beams + 1,) int64, the first entry of each beam; the last element is m
    triangle : (m,) int32, the triangle of each entry, sorted by ``near`` within a beam
    near, far : (m,) float32, each triangle's extent along the beam's axis, world units
    reach : (m,) float32, the largest ``far`` of the beam's entries up to each entry
    """

    directions: int
    tiles: int
    beam_start: np.ndarray
    triangle: np.ndarray
    near: np.ndarray
    far: np.ndarray
    reach: np.ndarray

    def is_sound(self, triangles: int) -> bool:
        """Return whether the arrays fit ``triangles`` triangles; see ``accel/sound.py``."""
        m = len(self.triangle)
        if not (isinstance(self.directions, int) and isinstance(self.tiles, int)):
            return False
        beams = AXES * self.directions ** 2 * self.tiles ** 2 + AXES
        return (self.directions > 0 and self.tiles > 0
                and alike(named(self, "near far reach"), "f", m)
                and within(self.triangle, triangles) and are_runs(self.beam_start, m, beams)
                and bool((self.near <= self.far).all() and (self.far <= self.reach).all()))


def build_visibility_field(triangles: np.ndarray, *, directions: int | None = None,
                           tiles: int | None = None, budget: float = 64.0,
                           arithmetic: str = "fp32") -> VisibilityField:
    """Build a visibility field.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    directions, tiles : the largest numbers of cells along a side of a face, and of tiles along a
        side of a plane; None means 8 and 24. If both are None, the field is coarsened to about
        1024 n + 4096 entries at most
    budget : memory limit of entries and beams, MiB, above which the field is coarsened
    arithmetic : the number format to which kernels round

    Raises
    ------
    LimitError
        if even a single beam per axis exceeds the budget
    """
    triangles = as_triangles(triangles)
    space = ray_space(triangles, arithmetic)
    most = min(budget * MIB / ENTRY_BYTES, EXACT_INTEGER)
    usual = most if directions or tiles else min(most, USUAL_ENTRIES * len(triangles) + 4096)
    frames = [_Frame(triangles, space, axis) for axis in range(AXES)]
    cells, size = _resolution(frames, directions or FINEST[0], tiles or FINEST[1], usual)
    while cells * size > 1:
        field = _build(frames, cells, size, most)
        if field is not None:
            return field
        cells, size = (cells, size - 1) if size > 1 else (cells - 1, size)
    field = _build(frames, 1, 1, most)
    if field is None:
        raise LimitError(f"a visibility field of {len(triangles):,} triangles needs more than its "
                         f"budget of {budget:g} MiB; raise budget or use a smaller scene")
    return field


class _Frame:
    """The triangles in the frame of an axis.

    ``corners`` are relative to the scene's centre. ``near`` and ``far`` are world coordinates.
    """

    def __init__(self, triangles: np.ndarray, space: RaySpace, axis: int) -> None:
        self.space = space
        self.corners = in_frame(triangles.astype(np.float64) - space.centre, axis).swapaxes(0, 1)
        self.half = in_frame(half_size(space), axis)
        self.near = triangles[:, :, axis].min(axis=1)
        self.far = triangles[:, :, axis].max(axis=1)
        self.by_near = np.argsort(self.near, kind="stable")
        self.by_far = np.argsort(self.far, kind="stable")
        self.near_rank, self.far_rank = (np.argsort(order) for order in (self.by_near,
                                                                         self.by_far))

    def tiles(self, cell: tuple[int, int], directions: int, tiles: int, step: int = 1
              ) -> tuple[np.ndarray, np.ndarray]:
        """Return the tiles through which lines of a cell may hit each triangle.

        Parameters
        ----------
        cell : the u and v of the cell of directions
        directions, tiles : as in `VisibilityField`
        step : use only every step-th triangle

        Returns
        -------
        the first tile, (n, 2), and the number of tiles, (n, 2), along both axes of the plane
        """
        corners = self.corners[:, ::step]
        wide = 1 / directions + self.space.direction_pad
        middle = (2 * np.array(cell) + 1) / directions - 1
        depth = corners[:, :, 2:]
        # Project each corner onto the plane along the cell's central direction. For the cell's
        # other directions, the projection deviates in proportion to the corner's depth.
        crossing = corners[:, :, :2] - middle * depth
        reach = wide * np.abs(depth) + 3 * self.space.pad
        edge = self.half[:2] + (np.abs(middle) + 1 / directions) * self.half[2]
        first, last = (np.clip(np.floor((at / edge + 1) * (tiles / 2)), 0, tiles - 1).astype(int)
                       for at in (-largest(reach - crossing), largest(crossing + reach)))
        return first, last - first + 1


def half_size(space: RaySpace) -> np.ndarray:
    """Return half the size of the scene's padded box along each axis, (3,) float32."""
    size = (space.hi.astype(np.float64) - space.lo) / 2 + 8 * space.pad
    return size.astype(np.float32)


def _resolution(frames: list[_Frame], directions: int, tiles: int, usual: float
                ) -> tuple[int, int]:
    """Choose the numbers of directions and tiles of a field with at most ``usual`` entries.

    First, reduce ``directions`` until TILES times as many tiles keep this limit. Then find the
    largest number of tiles, up to ``tiles``, that keeps it.
    """
    while directions > 1 and _estimate(frames, directions, min(TILES * directions, tiles)) > usual:
        directions -= 1
    low, high = 1, tiles
    while low < high:
        middle = (low + high + 1) // 2
        fits = _estimate(frames, directions, middle) <= usual
        low, high = (middle, high) if fits else (low, middle - 1)
    return directions, low


def _cells(directions: int) -> list[tuple[int, int]]:
    """Return the (u, v) of all cells of a face, in the order of the beams."""
    return [(u, v) for v in range(directions) for u in range(directions)]


def _estimate(frames: list[_Frame], directions: int, tiles: int) -> float:
    """Estimate the number of entries of a field from a sample of its triangles and directions."""
    n = len(frames[0].near)
    step = max(1, n // SAMPLES)
    some = _cells(directions)[::max(1, directions ** 2 // 4)]
    found = sum(float(frame.tiles(cell, directions, tiles, step)[1].prod(axis=1).sum())
                for frame in frames for cell in some)
    return found * step * directions ** 2 / len(some) + AXES * n


def _build(frames: list[_Frame], directions: int, tiles: int, most: float
           ) -> VisibilityField | None:
    """Return the field, or None if entries and beams need more memory than ``most`` entries."""
    n = len(frames[0].near)
    beams = AXES * directions ** 2 * tiles ** 2
    room = most - (beams + AXES) * BEAM_BYTES / ENTRY_BYTES
    counts: list[np.ndarray] = []
    parts: list[list[np.ndarray]] = []
    total = AXES * n
    for frame in frames:
        for cell in _cells(directions):
            keys = _entries(frame, *frame.tiles(cell, directions, tiles), tiles)
            total += len(keys)
            if total > room:
                return None
            parts.append(_sorted(frame, keys, n))
            counts.append(np.bincount(keys // max(n, 1), minlength=tiles ** 2))
    for frame in frames:
        parts.append(_sorted(frame, np.arange(n, dtype=np.int64), n))
        counts.append(np.array([n]))
    start = np.concatenate([[0], np.cumsum(np.concatenate(counts))])
    return VisibilityField(directions, tiles, start, *map(np.concatenate, zip(*parts)))


def _entries(frame: _Frame, first: np.ndarray, count: np.ndarray, tiles: int) -> np.ndarray:
    """Return the sorted keys of all entries of a cell of directions.

    A key is tile * n + near rank. The near rank is the triangle's place in the order of near ends.
    """
    n = len(first)
    keys = [np.zeros(0, np.int64)]
    every = count.prod(axis=1)
    for part in chunks(every, CHUNK):
        triangle = owners(every[part]) + part.start
        at = expand(np.zeros(part.stop - part.start, np.int64), every[part])
        x, y = first[triangle].T
        tile = (y + at // count[triangle, 0]) * tiles + x + at % count[triangle, 0]
        keys.append(tile * n + frame.near_rank[triangle])
    key = np.concatenate(keys)
    key.sort()
    return key


def _sorted(frame: _Frame, keys: np.ndarray, n: int) -> list[np.ndarray]:
    """Return the triangle, near, far and reach of the entries with these sorted keys."""
    n = max(n, 1)
    triangle = frame.by_near[keys % n] if len(keys) else keys
    # The running maximum of the far rank restarts at each tile: tile numbers are the high digits.
    above = np.maximum.accumulate((keys // n) * n + frame.far_rank[triangle]) % n
    far = frame.far[triangle]
    reach = frame.far[frame.by_far[above]] if len(keys) else far
    return [triangle.astype(np.int32), frame.near[triangle], far, reach]
