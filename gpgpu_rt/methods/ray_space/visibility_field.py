"""Visibility field: parallel beams for cells of directions, each with what it crosses in order.

J. Mortensen, P. Khanna, I. Yu, M. Slater, "A Visibility Field for Ray Tracing", CGIV 2007 (survey,
Table 1). Directions over half the sphere are cells of three faces of the direction cube, as a
line is followed either way; over each lies a grid of tiles in the plane through the scene's
middle across the face's axis. A beam is a cell and a tile: the lines of such a direction that
cross the plane there. Theirs holds what the middle direction meets; ours whatever any line of
the cell may meet, however far from the middle, so that a ray of any direction finds its hit.

Candidates of a beam are sorted by where they begin along the axis. Beside each stands where the
last one of those up to it ends: so a search by halves finds the first that a ray from the middle
of the beam may meet, both up and down the axis, which is what their tree along the beam is for.
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
ENTRY_BYTES, BEAM_BYTES = 16, 8      # as textures hold them in float32
SAMPLES = 2000          # triangles by which the size of a field is estimated
FINEST = (8, 24)        # directions and tiles where nothing is given
TILES = 2               # a direction, at least: fewer of them test more in as much memory
USUAL_ENTRIES = 1024    # a triangle, at most, where nothing is given
CHUNK = 1 << 20         # entries at a time


@dataclass(frozen=True)
class VisibilityField:
    """Beams, (axis, v, u, tile y, tile x), then one an axis with all triangles.

    directions, tiles : cells across a face, and across the plane of a beam
    beam_start : (beams + 1,) int64, the run of entries of each
    triangle : (m,) int32, by ``near`` within a beam
    near, far : (m,) float32, where each begins and ends along its axis, world units
    reach : (m,) float32, the largest ``far`` of its beam's entries up to each
    """

    directions: int
    tiles: int
    beam_start: np.ndarray
    triangle: np.ndarray
    near: np.ndarray
    far: np.ndarray
    reach: np.ndarray

    def is_sound(self, triangles: int) -> bool:
        """Whether the arrays are valid for this number of triangles; see ``accel/sound.py``."""
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
    directions, tiles : None: as fine as the budget and 1024 entries a triangle allow
    budget : MiB that entries and beams may take; what is given is made coarser until it does
    arithmetic : what kernels round to

    Raises
    ------
    LimitError
        where even one beam an axis is past the budget.
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
        cells, size = (cells, size - 1) if size > 1 else (cells - 1, size)   # estimated too low
    field = _build(frames, 1, 1, most)
    if field is None:
        raise LimitError(f"a visibility field of {len(triangles):,} triangles takes more than its "
                         f"budget of {budget:g} MiB; raise budget or take a smaller scene")
    return field


class _Frame:
    """The triangles along an axis; coordinates from the middle of the scene."""

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
        """First tile, (n, 2), and number of tiles, (n, 2), along both axes of the plane that
        every ``step``th triangle may be met through by lines of a cell of directions."""
        corners = self.corners[:, ::step]
        wide = 1 / directions + self.space.direction_pad
        middle = (2 * np.array(cell) + 1) / directions - 1
        depth = corners[:, :, 2:]
        # Where the line of the middle direction through each corner crosses the plane; others
        # of the cell, further off by the corner's depth.
        crossing = corners[:, :, :2] - middle * depth
        reach = wide * np.abs(depth) + 3 * self.space.pad
        edge = self.half[:2] + (np.abs(middle) + 1 / directions) * self.half[2]
        first, last = (np.clip(np.floor((at / edge + 1) * (tiles / 2)), 0, tiles - 1).astype(int)
                       for at in (-largest(reach - crossing), largest(crossing + reach)))
        return first, last - first + 1


def half_size(space: RaySpace) -> np.ndarray:
    """(3,) float32: how far the planes of beams reach, straight ahead, from the middle."""
    size = (space.hi.astype(np.float64) - space.lo) / 2 + 8 * space.pad
    return size.astype(np.float32)


def _resolution(frames: list[_Frame], directions: int, tiles: int, usual: float
                ) -> tuple[int, int]:
    """As many directions as leave each ``TILES`` times as many tiles, then as many tiles as
    the entries allow; no more of either than given."""
    while directions > 1 and _estimate(frames, directions, min(TILES * directions, tiles)) > usual:
        directions -= 1
    low, high = 1, tiles
    while low < high:
        middle = (low + high + 1) // 2
        fits = _estimate(frames, directions, middle) <= usual
        low, high = (middle, high) if fits else (low, middle - 1)
    return directions, low


def _cells(directions: int) -> list[tuple[int, int]]:
    """u and v of the cells of a face, in the order of the beams."""
    return [(u, v) for v in range(directions) for u in range(directions)]


def _estimate(frames: list[_Frame], directions: int, tiles: int) -> float:
    """Entries of such a field, from some of its triangles and directions."""
    n = len(frames[0].near)
    step = max(1, n // SAMPLES)
    some = _cells(directions)[::max(1, directions ** 2 // 4)]
    found = sum(float(frame.tiles(cell, directions, tiles, step)[1].prod(axis=1).sum())
                for frame in frames for cell in some)
    return found * step * directions ** 2 / len(some) + AXES * n


def _build(frames: list[_Frame], directions: int, tiles: int, most: float
           ) -> VisibilityField | None:
    """The field, or None where it is past ``most`` entries, beams counted in."""
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
    """tile * n + place by near, of all triangles in all their tiles of a direction, sorted."""
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
    """Triangle, near, far and reach of sorted entries of one direction."""
    n = max(n, 1)
    triangle = frame.by_near[keys % n] if len(keys) else keys
    # The largest far so far in each tile: later tiles' numbers begin above all of those before.
    above = np.maximum.accumulate((keys // n) * n + frame.far_rank[triangle]) % n
    far = frame.far[triangle]
    reach = frame.far[frame.by_far[above]] if len(keys) else far
    return [triangle.astype(np.int32), frame.near[triangle], far, reach]
