"""Five-dimensional boxes of rays. A box gets its list of triangles when rays need the list.

J. Arvo, D. Kirk, "Fast Ray Tracing by Ray Classification", SIGGRAPH 1987 (survey, Table 1). A ray
is a five-dimensional point: its origin, and its direction's (u, v) on a face of the direction cube
(frames.py). From level to level, a box is halved along its axes, down to the finest cells. The
candidates of a box are the triangles that its rays may hit.

The paper halves a box until the box has few candidates. Here, a box may have a list if it holds at
least ``min_rays`` rays of a trace. A finest cell uses the list of the smallest box around it that
has a list. If the lists exceed the budget, ``min_rays`` is raised for the trace. The paper finds
candidates in the list of the next larger box; here, a BVH finds them.

A directory holds the start of each finest cell's list. The largest box of each face of the
direction cube always has a list, which holds all triangles in order along the face's axis.
"""
from __future__ import annotations

import time

import numpy as np

from ...accel.runs import run_starts
from ...errors import LimitError, OptionError
from ...gl.record import EXACT_INTEGER
from ..bvh.tree import Bvh
from .beam import PAIRS, Beams, Candidates
from .frames import ORDERS, RaySpace

SENTINEL = -1           # the entry that ends a list
MIB = 1 << 20
CANDIDATE_BYTES, CELL_BYTES = 8, 4     # bytes in float32 textures
SAMPLES = 48            # a level's memory is estimated from at most this many lists
FILLED = 0.8            # share of the budget that an estimate may reach
RAISED = 4              # factor by which ``min_rays`` is raised if an estimate exceeds FILLED
FACES = 6               # cube faces: 2 * axis for positive directions, 2 * axis + 1 for negative


class RayBoxes:
    """The boxes of rays of a scene, with lists made on demand.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    tree : a BVH of the triangles
    origin_cells, direction_cells : number of finest cells along each axis of the scene's box, and
        across a face of the direction cube; powers of two
    min_rays : a box gets a list only if it holds at least this many rays of a trace
    budget : memory limit of the directory and all lists, MiB

    Attributes
    ----------
    directory : (cells + 6,) int64, the start of each finest cell's list in ``triangle``. The last
        six elements are the starts of the faces' lists
    grow_seconds : seconds spent on making lists so far

    Raises
    ------
    OptionError
        if a number of cells is no power of two
    LimitError
        if a float texel cannot index all boxes exactly, or the budget is too small
    """

    def __init__(self, triangles: np.ndarray, tree: Bvh, space: RaySpace, origin_cells: int,
                 direction_cells: int, min_rays: int, budget: float) -> None:
        for name, cells in (("origin_cells", origin_cells), ("direction_cells", direction_cells)):
            if cells & (cells - 1):
                raise OptionError(f"{name} is {cells}; give a power of two")
        self.space, self.min_rays = space, min_rays
        self.origin_bits = origin_cells.bit_length() - 1
        self.direction_bits = direction_cells.bit_length() - 1
        self.levels = max(self.origin_bits, self.direction_bits) + 1
        self.cells = FACES * direction_cells ** 2 * origin_cells ** 3
        if self.cells + FACES > EXACT_INTEGER:
            raise LimitError(f"{self.cells:,} boxes of rays are more than 2^24, the largest index "
                             "that a float texel holds exactly; lower origin_cells or "
                             "direction_cells")
        free = budget * MIB - CELL_BYTES * (self.cells + FACES)
        self.most = int(min(free // CANDIDATE_BYTES, EXACT_INTEGER))
        if FACES * (len(triangles) + 1) > self.most:
            least = (CELL_BYTES * self.cells + CANDIDATE_BYTES *
                     FACES * (len(triangles) + 1)) / MIB
            raise LimitError(f"boxes of rays need at least {least:.1f} MiB, more than the budget "
                             f"of {budget:g} MiB; raise budget, lower origin_cells or "
                             "direction_cells, or use a smaller scene")
        self.faces = [Candidates(triangles, tree, face // 2, bool(face % 2))
                      for face in range(FACES)]
        self._triangle = np.empty(0, np.int32)
        self._near = np.empty(0, np.float32)
        self.grow_seconds = 0.0
        self.forget()

    # Lists ------------------------------------------------------------------------------------

    @property
    def triangle(self) -> np.ndarray:
        """The triangles of all lists in one array, (k,) int32. -1 ends each list."""
        return self._triangle[:self.used]

    @property
    def near(self) -> np.ndarray:
        """The ``near`` of each element of ``triangle``, (k,) float32; see ``Candidates``."""
        return self._near[:self.used]

    def forget(self) -> None:
        """Drop all lists except the six faces' lists."""
        self.used = 0
        self._asked = np.zeros(0, np.int64), np.zeros(0, np.int64)
        self.first = [np.full(self._boxes(level), -1, np.int64) for level in range(self.levels)]
        n = len(self.faces[0].order)
        for face in range(FACES):
            self.first[0][face] = self._append(self.faces[face].order, np.array([n]), face)[0]
        roots = self.first[0]
        self.directory = np.concatenate([np.repeat(roots, self.cells // FACES), roots])

    def _append(self, triangle: np.ndarray, counts: np.ndarray, face: int) -> np.ndarray:
        """Append lists, each with its sentinel. Return the start of each list."""
        starts = self.used + run_starts(counts + 1)
        end = self.used + len(triangle) + len(counts)
        if end > len(self._triangle):
            room = min(max(end, 2 * len(self._triangle)), max(self.most, end))
            self._triangle, self._near = (np.concatenate([old[:self.used], np.empty(
                room - self.used, old.dtype)]) for old in (self._triangle, self._near))
        ends = starts - self.used + counts
        listed = np.ones(end - self.used, bool)
        listed[ends] = False
        for array, values, last in ((self._triangle, triangle, SENTINEL),
                                    (self._near, self.faces[face].near[triangle], np.inf)):
            part = array[self.used:end]
            part[listed], part[ends] = values, 0.0 if last == np.inf else last
        self.used = end
        return starts

    # Growing ----------------------------------------------------------------------------------

    def ask(self, cells: np.ndarray) -> bool:
        """Make the lists that rays need. Return whether the directory changed.

        ``cells`` holds the number of each ray's finest cell. Numbers of no cell are ignored: such
        rays miss the scene, or use a face's list.
        """
        began = time.perf_counter()
        chosen, rays = np.unique(cells[(cells >= 0) & (cells < self.cells)], return_counts=True)
        chosen = chosen.astype(np.int64)
        if np.array_equal(chosen, self._asked[0]) and np.array_equal(rays, self._asked[1]):
            return False                # the last call asked for the same lists
        before = self.directory[chosen]
        old = self.used
        wanted, expected = self._affordable(chosen, rays)
        earlier = old > FACES * (len(self.faces[0].order) + 1)
        full = earlier and old + expected * self._missing(chosen, wanted) > self.most
        if (full or not self._make(chosen, rays, wanted)) and earlier:
            self.forget()               # drop the lists of earlier calls to free the budget
            self._make(chosen, rays, wanted)
            before = np.full(len(chosen), -1)
        for level in range(1, self.levels):
            first = self.first[level][self._box(chosen, level)]
            made = first >= 0
            self.directory[chosen[made]] = first[made]
        self._asked = chosen, rays
        self.grow_seconds += time.perf_counter() - began
        return bool((self.directory[chosen] != before).any())

    def _affordable(self, cells: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, float]:
        """Return the level of each cell's box, and an estimate of all lists' candidates.

        The level is the finest at which the cell's box holds ``min_rays`` rays. ``min_rays`` is
        raised while the estimate exceeds the budget.
        """
        room = FILLED * (self.most - FACES * (len(self.faces[0].order) + 1))
        least = self.min_rays
        while True:
            wanted = self._wanted(cells, rays, least)
            expected = self._estimate(cells, wanted)
            if least > rays.sum() or expected <= room:
                return wanted, expected
            least *= RAISED

    def _missing(self, cells: np.ndarray, wanted: np.ndarray) -> float:
        """Return the share of cells whose box at the ``wanted`` level has no list yet."""
        missing = sum(int((self.first[level][self._box(cells[wanted == level], level)] < 0).sum())
                      for level in range(1, self.levels))
        return missing / max(len(cells), 1)

    def _wanted(self, cells: np.ndarray, rays: np.ndarray, least: int) -> np.ndarray:
        """Return the finest level at which each cell's box holds at least ``least`` rays."""
        wanted = np.zeros(len(cells), np.int64)
        for level in range(1, self.levels):
            _, inverse = np.unique(self._box(cells, level), return_inverse=True)
            enough = np.bincount(inverse, rays, 1) >= least
            wanted[enough[inverse]] = level
        return wanted

    def _estimate(self, cells: np.ndarray, wanted: np.ndarray) -> float:
        """Estimate the number of candidates in all lists from a sample of lists."""
        total = 0.0
        for level in range(1, self.levels):
            boxes = np.unique(self._box(cells[wanted == level], level))
            if len(boxes):
                some = boxes[::-(-len(boxes) // SAMPLES)]
                face = some // (self._boxes(level) // FACES)
                sampled = sum(self.faces[f].of(self._beams(some[face == f], level, f))[1].sum()
                              for f in np.unique(face).tolist())
                total += len(boxes) * (1 + float(sampled) / len(some))
        return total

    def _make(self, cells: np.ndarray, rays: np.ndarray, wanted: np.ndarray) -> bool:
        """Make the missing lists. Return False if the budget does not suffice for all of them.

        Finer levels come first. In each face of a level, boxes with more rays come first.
        """
        for level in range(self.levels - 1, 0, -1):
            mine = wanted == level
            boxes, inverse = np.unique(self._box(cells[mine], level), return_inverse=True)
            order = np.argsort(-np.bincount(inverse, rays[mine], len(boxes)), kind="stable")
            if not len(boxes):
                continue
            boxes = boxes[order]
            boxes = boxes[self.first[level][boxes] < 0]
            face = boxes // (self._boxes(level) // FACES)
            for number in np.unique(face):
                if not self._make_boxes(boxes[face == number], level, int(number)):
                    return False
        return True

    def _make_boxes(self, boxes: np.ndarray, level: int, face: int) -> bool:
        at_once = max(1, PAIRS // max(len(self.faces[face].order), 1))
        for start in range(0, len(boxes), at_once):
            part = boxes[start:start + at_once]
            triangle, counts = self.faces[face].of(self._beams(part, level, face))
            ends = np.cumsum(counts + 1)
            fit = int(np.searchsorted(ends, self.most - self.used, side="right"))
            if fit:
                taken = int(ends[fit - 1]) - fit
                self.first[level][part[:fit]] = self._append(triangle[:taken], counts[:fit], face)
            if fit < len(part):
                return False
        return True

    # Boxes ------------------------------------------------------------------------------------

    def _bits(self, level: int) -> tuple[int, int]:
        return min(level, self.origin_bits), min(level, self.direction_bits)

    def _boxes(self, level: int) -> int:
        origin, direction = self._bits(level)
        return FACES << (3 * origin + 2 * direction)

    def _box(self, cells: np.ndarray, level: int) -> np.ndarray:
        """Return the boxes of a level that contain the given finest cells."""
        face, direction, origin = self._coordinates(cells, self.levels - 1)
        origin_bits, direction_bits = self._bits(level)
        box = face
        for values, bits, finest in ((direction, direction_bits, self.direction_bits),
                                     (origin, origin_bits, self.origin_bits)):
            for axis in range(values.shape[1] - 1, -1, -1):
                box = (box << bits) | (values[:, axis] >> (finest - bits))
        return box

    def _coordinates(self, boxes: np.ndarray, level: int
                     ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the coordinates of m boxes.

        Returns
        -------
        face, (m,); direction cell (u, v), (m, 2); origin cell (x, y, z), (m, 3)
        """
        origin_bits, direction_bits = self._bits(level)
        parts, rest = [], boxes
        for bits in 3 * (origin_bits,) + 2 * (direction_bits,):
            parts.append(rest & ((1 << bits) - 1))
            rest = rest >> bits
        return rest, np.stack(parts[3:], 1), np.stack(parts[:3], 1)

    def _beams(self, boxes: np.ndarray, level: int, face: int) -> Beams:
        origin_bits, direction_bits = self._bits(level)
        _, direction, origin = self._coordinates(boxes, level)
        size = (self.space.hi.astype(np.float64) - self.space.lo) / (1 << origin_bits)
        order = list(ORDERS[face // 2])
        lo = (self.space.lo + size * origin)[:, order]
        hi = (self.space.lo + size * (origin + 1))[:, order]
        if face % 2:
            lo[:, 2], hi[:, 2] = -hi[:, 2], -lo[:, 2].copy()
        width = 2.0 / (1 << direction_bits)
        return Beams.of(lo, hi, width * direction - 1, width * (direction + 1) - 1, self.space)

    def to_dict(self) -> dict[str, float]:
        """Return the statistics: the numbers of lists and candidates, and the seconds spent."""
        return {"boxes": float(sum((first >= 0).sum() for first in self.first)),
                "candidates": float(self.used), "grow_seconds": self.grow_seconds}
