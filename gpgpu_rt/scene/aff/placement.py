"""Placement: the vertices of a document at any time."""
from __future__ import annotations

import numpy as np

from .document import Document
from .geometry import Keys
from .keyframes import KeyedMotion


class Placement:
    """The vertices of all instances under their transforms; can be pickled.

    All arithmetic is in float64, and products are summed in a fixed order. So all machines get the
    same bits.

    Attributes
    ----------
    points : (3, v) float64 vertices in the coordinates of their instances
    first : (i + 1,) int, the index of the first vertex of each instance, and v at the end
    node : (i,) int, the index of each instance's transform
    """

    def __init__(self, document: Document) -> None:
        nodes, instances = document.nodes, document.instances
        count = len(nodes)
        self._parent = np.array([node.parent for node in nodes])
        self._local = np.stack([np.eye(3, 4) if isinstance(node.transform, str)
                                else node.transform for node in nodes])
        self._motions: list[tuple[int, KeyedMotion]] = [
            (k, document.motions[node.transform]) for k, node in enumerate(nodes)
            if isinstance(node.transform, str) and node.transform in document.motions]
        depth, moving = [0] * count, [False] * count
        own = {k for k, _ in self._motions}
        for k in range(1, count):
            depth[k] = depth[nodes[k].parent] + 1
            moving[k] = k in own or moving[nodes[k].parent]
        order = np.argsort(depth, kind="stable")
        self._levels = np.split(order, np.flatnonzero(np.diff(np.array(depth)[order])) + 1)[1:]
        self._moving_node = np.array(moving)
        vertices = [instance.geometry.vertices.T for instance in instances]
        self.points = np.concatenate([np.zeros((3, 0)), *vertices], axis=1)
        self.first = np.cumsum([0, *(v.shape[1] for v in vertices)])
        self.node = np.array([instance.node for instance in instances], np.int64)
        self._keys: dict[int, Keys] = {
            k: instance.geometry.keys for k, instance in enumerate(instances)
            if instance.geometry.keys is not None}
        self._moving = self._blocks(moving=True)
        # World positions of the vertices that never move; 0 for moving vertices.
        self._still = np.zeros(self.points.shape[::-1], np.float32)
        with np.errstate(over="ignore", invalid="ignore"):
            transform, _ = self.transforms(0.0)
            for first, last, k in self._blocks(moving=False):
                self._still[first:last] = _moved(transform[self.node[k]],
                                                 self.points[:, first:last]).T

    def transforms(self, time: float) -> tuple[np.ndarray, np.ndarray]:
        """Return each node's transform to world coordinates at ``time``, (k, 3, 4), and whether
        each node is visible, (k,) bool."""
        local, visible = self._local.copy(), np.ones(len(self._local), bool)
        for k, motion in self._motions:
            local[k], visible[k] = motion.at(time), motion.visible(time)
        for level in self._levels:
            parent = self._parent[level]
            local[level] = _product(local[parent], local[level])
            visible[level] &= visible[parent]
        return local, visible

    def vertices(self, time: float) -> np.ndarray:
        """Return the vertices at ``time``, (v, 3) float32, world units. Vertices of an invisible
        instance coincide, so that its triangles have no area."""
        with np.errstate(over="ignore", invalid="ignore"):  # `check_vertices` reports overflow
            transform, visible = self.transforms(time)
            made = self._still.copy()
            for first, last, k in self._moving:
                points = self.points[:, first:last]
                if k in self._keys:
                    points = self._keys[k].at(time).T
                node = self.node[k]
                made[first:last] = _moved(transform[node], points).T
                if not visible[node]:
                    made[first:last] = made[first]
        return made

    @property
    def group(self) -> np.ndarray:
        """A number for each vertex, (v,). Vertices with the same number share a transform."""
        made = np.repeat(self.node, np.diff(self.first))
        for k in self._keys:    # each of these vertices moves on its own
            some = slice(self.first[k], self.first[k + 1])
            made[some] = -1 - np.arange(some.start, some.stop)
        return made

    def _blocks(self, moving: bool) -> list[tuple[int, int, int]]:
        """Return the ranges of vertices that move; or, if ``moving`` is false, the ranges that do
        not move. A range is (first vertex, vertex after the last, an instance in it). Consecutive
        instances under one transform form one range, unless their geometry has ``keys``.
        """
        blocks: list[tuple[int, int, int]] = []
        for k, node in enumerate(self.node.tolist()):
            if (self._moving_node[node] or k in self._keys) != moving:
                continue
            first, last = int(self.first[k]), int(self.first[k + 1])
            before = blocks[-1] if blocks else None
            if (before and before[1] == first and self.node[before[2]] == node
                    and not {k, before[2]} & self._keys.keys()):
                blocks[-1] = before[0], last, k
            elif last > first:
                blocks.append((first, last, k))
        return blocks


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the transforms that apply first b and then a, (k, 3, 4) each."""
    made = (a[:, :, 0:1] * b[:, 0:1] + a[:, :, 1:2] * b[:, 1:2] + a[:, :, 2:3] * b[:, 2:3])
    made[:, :, 3] += a[:, :, 3]
    return made


def _moved(transform: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return (3, n) points moved by a transform, (3, 4)."""
    x, y, z = points
    a, b, c, d = transform.T[:, :, None]
    return a * x + b * y + c * z + d
