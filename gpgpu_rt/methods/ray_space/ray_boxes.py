"""Five-dimensional boxes of rays with lists of candidates, made when rays first ask for them.

J. Arvo, D. Kirk, "Fast Ray Tracing by Ray Classification", SIGGRAPH 1987 (survey, Table 1). A ray
is a point: its origin, the face of the direction cube that it passes, and where. Boxes are halved
along all five axes from one level to the next. They halve a box until its candidates are few; here
the rays of a call decide: each cell of the finest level takes its list from the smallest box
around it that holds ``min_rays`` of them; more, where lists would come to more than the budget.
Candidates come from a BVH, not from the larger box: then no list is kept that no ray reads.

A directory says of every finest cell where its list begins, so that a ray finds it by one lookup.
Lists past the budget are not made: their rays read those of larger boxes, in the end all triangles
in the order of their face, which are always there.
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

SENTINEL = -1           # ends a list
MIB = 1 << 20
CANDIDATE_BYTES, CELL_BYTES = 8, 4     # as textures hold them in float32
SAMPLES = 48            # lists a level that the memory of all is estimated by
FILLED = 0.8            # of the budget: what an estimate may come to
RAISED = 4              # how much fuller boxes must be each time the estimate is past that
FACES = 6               # of the direction cube: twice the axis, and 1 against it


class RayBoxes:
    """The boxes of a scene; grows when it is asked.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    tree : a BVH of them
    origin_cells, direction_cells : finest cells an axis of the scene's box, and across a face of
        the direction cube; powers of two
    min_rays : rays of a call that a box must hold to get a list
    budget : MiB that directory and lists may take

    Attributes
    ----------
    directory : (cells + 6,) int64, first candidate of each cell's list; behind the cells each
        face's list of all triangles
    grow_seconds : what all lists made so far took
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
            raise LimitError(f"{self.cells:,} boxes of rays are past 2^24, the last index a float "
                             "texel holds exactly; lower origin_cells or direction_cells")
        free = budget * MIB - CELL_BYTES * (self.cells + FACES)
        self.most = int(min(free // CANDIDATE_BYTES, EXACT_INTEGER))
        if FACES * (len(triangles) + 1) > self.most:
            least = (CELL_BYTES * self.cells + CANDIDATE_BYTES *
                     FACES * (len(triangles) + 1)) / MIB
            raise LimitError(f"boxes of rays take {least:.1f} MiB before any ray has asked, past "
                             f"their budget of {budget:g}; raise budget, or lower origin_cells or "
                             "direction_cells, or take a smaller scene")
        self.faces = [Candidates(triangles, tree, face // 2, bool(face % 2))
                      for face in range(FACES)]
        self._triangle = np.empty(0, np.int32)
        self._near = np.empty(0, np.float32)
        self.grow_seconds = 0.0
        self.forget()

    # Lists ------------------------------------------------------------------------------------

    @property
    def triangle(self) -> np.ndarray:
        """(k,) int32: all lists after one another, each ended by -1."""
        return self._triangle[:self.used]

    @property
    def near(self) -> np.ndarray:
        """(k,) float32: where each candidate begins along its list's axis; see ``Candidates``."""
        return self._near[:self.used]

    def forget(self) -> None:
        """Drop every list but those of the six faces."""
        self.used = 0
        self._asked = np.zeros(0, np.int64), np.zeros(0, np.int64)
        self.first = [np.full(self._boxes(level), -1, np.int64) for level in range(self.levels)]
        n = len(self.faces[0].order)
        for face in range(FACES):
            self.first[0][face] = self._append(self.faces[face].order, np.array([n]), face)[0]
        roots = self.first[0]
        self.directory = np.concatenate([np.repeat(roots, self.cells // FACES), roots])

    def _append(self, triangle: np.ndarray, counts: np.ndarray, face: int) -> np.ndarray:
        """Take lists in, each with its sentinel; where each begins."""
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
        """Make lists for rays, given by the cell of each; others than finest cells are passed
        over. Whether anything changed."""
        began = time.perf_counter()
        chosen, rays = np.unique(cells[(cells >= 0) & (cells < self.cells)], return_counts=True)
        chosen = chosen.astype(np.int64)
        if np.array_equal(chosen, self._asked[0]) and np.array_equal(rays, self._asked[1]):
            return False                # the same rays again, or others like them
        before = self.directory[chosen]
        old = self.used
        wanted, expected = self._affordable(chosen, rays)
        earlier = old > FACES * (len(self.faces[0].order) + 1)
        full = earlier and old + expected * self._missing(chosen, wanted) > self.most
        if (full or not self._make(chosen, rays, wanted)) and earlier:
            self.forget()               # the lists of earlier calls leave no room for this one's
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
        """The level of each cell's box: the finest at which it holds ``min_rays`` rays, or as many
        times that as bring all lists within the budget, going by a few of them; and how many
        candidates these expect."""
        room = FILLED * (self.most - FACES * (len(self.faces[0].order) + 1))
        least = self.min_rays
        while True:
            wanted = self._wanted(cells, rays, least)
            expected = self._estimate(cells, wanted)
            if least > rays.sum() or expected <= room:
                return wanted, expected
            least *= RAISED

    def _missing(self, cells: np.ndarray, wanted: np.ndarray) -> float:
        """The share of the cells whose box has no list yet."""
        missing = sum(int((self.first[level][self._box(cells[wanted == level], level)] < 0).sum())
                      for level in range(1, self.levels))
        return missing / max(len(cells), 1)

    def _wanted(self, cells: np.ndarray, rays: np.ndarray, least: int) -> np.ndarray:
        """The finest level at which each cell's box holds so many rays."""
        wanted = np.zeros(len(cells), np.int64)
        for level in range(1, self.levels):
            _, inverse = np.unique(self._box(cells, level), return_inverse=True)
            enough = np.bincount(inverse, rays, 1) >= least
            wanted[enough[inverse]] = level
        return wanted

    def _estimate(self, cells: np.ndarray, wanted: np.ndarray) -> float:
        """How many candidates these lists hold together, from some evenly spread ones."""
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
        """Make the boxes that are missing, finest level and fullest box first; False where the
        budget ended."""
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
        """The boxes of a level that finest cells lie in."""
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
        """Face, (m,), u and v, (m, 2), and x, y and z, (m, 3), of boxes of a level."""
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
        """What it holds, for statistics."""
        return {"boxes": float(sum((first >= 0).sum() for first in self.first)),
                "candidates": float(self.used), "grow_seconds": self.grow_seconds}
