"""Reference tree: a bounding volume tree in float64 for the reference tracer.

The builder repeatedly sorts a list of triangles along an axis and halves the list. It chooses the
axis for which the boxes of the halves have the least total area. Node i of level l contains the
triangles from floor(i m / 2^l) to floor((i + 1) m / 2^l) - 1 of the ordered list of m triangles.
So no child pointers are stored. Traversal works on batches of pairs (ray, node), nearer children
first. A pair is dropped only if the ray misses the node's box within the ray's interval, so no hit
is lost.
"""
from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Iterator

import numpy as np

_LEAF = 3               # largest number of triangles in a leaf
_PAIRS = 1 << 18        # largest number of pairs in a batch
# Widen boxes by this share of the coordinates. The share is far above float64's rounding, but too
# small to add a noticeable number of tests.
_PADDING = 1e-12
_TINY = 1e-300
_MOST_KEPT, _LARGEST_KEPT = 3, 1 << 20      # trees to keep; largest tree to keep, in triangles


class ReferenceTree:
    """A tree of boxes over m > 0 triangles, given as (m, 3, 3) float64 vertices.

    Attributes
    ----------
    count : m
    order : (m,) the triangles in the order of the leaves
    boxes : for each level l, from the root, a pair of (3, 2^l) float64: lo and hi
    """

    _kept: OrderedDict[bytes, ReferenceTree] = OrderedDict()

    @classmethod
    def of(cls, vertices: np.ndarray) -> ReferenceTree:
        """Return the tree over these vertices, from the kept trees if possible."""
        if len(vertices) > _LARGEST_KEPT:
            return cls(vertices)
        content = hashlib.blake2b(np.ascontiguousarray(vertices).data).digest()
        if content not in cls._kept:
            cls._kept[content] = cls(vertices)
        cls._kept.move_to_end(content)
        while len(cls._kept) > _MOST_KEPT:
            cls._kept.popitem(last=False)
        return cls._kept[content]

    def __init__(self, vertices: np.ndarray) -> None:
        lo, hi = vertices.min(axis=1), vertices.max(axis=1)
        self.count = len(vertices)
        levels = max(0, int(np.ceil(np.log2(self.count / _LEAF))))
        self.order = np.arange(self.count)
        for level in range(levels):
            self._halve(lo, hi, level)
        lo, hi = lo[self.order], hi[self.order]
        starts = self._starts(levels)[:-1]
        boxes = [(np.minimum.reduceat(lo, starts).T, np.maximum.reduceat(hi, starts).T)]
        for _ in range(levels):
            low, high = boxes[-1]
            boxes.append((np.minimum(low[:, ::2], low[:, 1::2]),
                          np.maximum(high[:, ::2], high[:, 1::2])))
        self.boxes = boxes[::-1]

    def _starts(self, level: int) -> np.ndarray:
        """Return (2^level + 1,): for each node, the position of its first triangle in the ordered
        list; then the number of triangles."""
        return np.arange((1 << level) + 1) * self.count >> level

    def _halve(self, lo: np.ndarray, hi: np.ndarray, level: int) -> None:
        """Sort each node's triangles along the axis whose halves have the least total area."""
        node = np.repeat(np.arange(1 << level), np.diff(self._starts(level)))
        starts = self._starts(level + 1)[:-1]
        orders, areas = [], []
        for axis in range(3):
            centre = lo[self.order, axis] + hi[self.order, axis]
            order = self.order[np.lexsort((centre, node))]
            size = np.maximum.reduceat(hi[order], starts) - np.minimum.reduceat(lo[order], starts)
            area = size[:, 0] * size[:, 1] + size[:, 1] * size[:, 2] + size[:, 2] * size[:, 0]
            orders.append(order)
            areas.append(area[::2] + area[1::2])
        best = np.argmin(areas, axis=0)[node]
        self.order = np.stack(orders)[best, np.arange(self.count)]

    def pairs(self, origins: np.ndarray, directions: np.ndarray, t_min: np.ndarray,
              t_max: np.ndarray, margin: np.ndarray | float = 0.0
              ) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Yield, in batches, all pairs (ray, triangle) whose ray meets the triangle's leaf box.

        The traversal reads ``t_max`` again for each batch of nodes, nearer nodes first. A caller
        may reduce ``t_max`` between batches, to prune further nodes.

        Parameters
        ----------
        origins, directions : (n, 3) float64
        t_min, t_max : (n,) float64
        margin : (n,) float64, or a number: boxes grow on each side by this length, world units
        """
        self._set_rays(origins, directions, t_min, t_max, margin)
        starts = self._starts(len(self.boxes) - 1)
        work = []
        for i in reversed(range(0, len(origins), _PAIRS)):
            ray = np.arange(i, min(i + _PAIRS, len(origins)))
            enter, keep = self._meets(0, ray, np.zeros(len(ray), np.int64))
            work.append((0, ray[keep], np.zeros(keep.sum(), np.int64), enter[keep]))
        while work:
            level, ray, node, enter = work.pop()
            near = enter <= t_max[ray]
            if not near.all():
                ray, node = ray[near], node[near]
            if not len(ray):
                continue
            if level == len(self.boxes) - 1:
                count = starts[node + 1] - starts[node]
                offset = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
                yield np.repeat(ray, count), self.order[np.repeat(starts[node], count) + offset]
                continue
            level, left = level + 1, 2 * node
            enter, keep = self._meets(level, ray, left)
            other, keep_other = self._meets(level, ray, left + 1)
            # Push the farther children, then the nearer children, which are popped first. Join the
            # two batches if they are small.
            swap = other < enter
            first = np.where(swap, keep_other, keep), left + swap, np.minimum(enter, other)
            second = np.where(swap, keep, keep_other), left + ~swap, np.maximum(enter, other)
            halves = [[a[half[0]] for a in (ray, *half[1:])] for half in (second, first)]
            if sum(len(half[0]) for half in halves) <= _PAIRS // 2:
                halves = [[np.concatenate(pair) for pair in zip(*halves[::-1])]]
            work += [(level, *half) for half in halves]

    def _set_rays(self, origins: np.ndarray, directions: np.ndarray, t_min: np.ndarray,
                  t_max: np.ndarray, margin: np.ndarray | float) -> None:
        """Store the inverse directions and the origins for the slab test. Instead of widening
        boxes, move the origins: in opposite directions for lower and upper corners."""
        scale = np.abs(self.boxes[0]).max() + np.abs(origins).max(axis=1, initial=0)
        padding = (_PADDING * scale + _TINY + margin)[:, None]
        self._inv_dir = (1.0 / np.where(directions == 0, _TINY, directions)).T.copy()
        self._lo_origins, self._hi_origins = ((origins + side * padding).T.copy()
                                              for side in (1, -1))
        self._interval = t_min, t_max

    def _meets(self, level: int, ray: np.ndarray, node: np.ndarray
               ) -> tuple[np.ndarray, np.ndarray]:
        """Return for p pairs the t, at least t_min, at which the ray enters the node's widened
        box, (p,); and whether the box meets the ray's interval, (p,) bool."""
        t_min, t_max = self._interval
        enter, leave = t_min[ray], t_max[ray]
        lo, hi = self.boxes[level]
        with np.errstate(over="ignore"):
            for axis in range(3):
                inv_dir = self._inv_dir[axis][ray]
                t0 = (lo[axis][node] - self._lo_origins[axis][ray]) * inv_dir
                t1 = (hi[axis][node] - self._hi_origins[axis][ray]) * inv_dir
                np.maximum(enter, np.minimum(t0, t1), out=enter)
                np.minimum(leave, np.maximum(t0, t1), out=leave)
        return enter, enter <= leave
