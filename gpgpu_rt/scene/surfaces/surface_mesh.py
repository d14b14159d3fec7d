"""Surface mesh: an oriented mesh of half-edges, with its boundary, shortest paths and cuts.

Half-edge number 3 * f + k runs from corner k of face f to the next corner. Its twin runs in the
opposite direction along the same edge of the neighbouring face.
"""
from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...accel.runs import expand, run_starts
from ...errors import SceneError


@dataclass(frozen=True, eq=False)
class SurfaceMesh:
    """An oriented mesh.

    vertices : (v, 3) float64
    faces : (f, 3) int64, consistently oriented
    name : the mesh's name in errors
    """

    vertices: np.ndarray
    faces: np.ndarray
    name: str = "mesh"

    @classmethod
    def of_triangles(cls, triangles: np.ndarray, name: str = "mesh") -> SurfaceMesh:
        """Return the mesh of (n, 3, 3) triangles. Equal corners become one vertex; triangles with
        two equal corners are dropped."""
        vertices, index = np.unique(triangles.reshape(-1, 3) + np.float32(0), axis=0,
                                    return_inverse=True)    # adding 0 turns -0 into 0
        faces = index.reshape(-1, 3)
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
        used, faces = np.unique(faces, return_inverse=True)
        return cls(vertices[used].astype(np.float64), faces.reshape(-1, 3), name)

    @cached_property
    def start(self) -> np.ndarray:
        """(3 f,) int64, the start vertex of each half-edge."""
        return self.faces.reshape(-1)

    @cached_property
    def end(self) -> np.ndarray:
        """(3 f,) int64, the end vertex of each half-edge."""
        return np.roll(self.faces, -1, axis=1).reshape(-1)

    @cached_property
    def twin(self) -> np.ndarray:
        """(3 f,) int64, the twin of each half-edge; -1 on the boundary.

        Raises
        ------
        SceneError
            two triangles run along an edge in the same direction. This always happens if more
            than two triangles share an edge
        """
        key = self.start * len(self.vertices) + self.end
        order = np.argsort(key, kind="stable")
        ordered = key[order]
        if (ordered[1:] == ordered[:-1]).any():
            raise SceneError(f"{self.name}: two triangles run along one edge the same way; only a "
                             "surface whose triangles are oriented alike can be made an image")
        back = self.end * len(self.vertices) + self.start
        at = np.minimum(np.searchsorted(ordered, back), len(ordered) - 1)
        return np.where(ordered[at] == back, order[at], -1)

    @cached_property
    def lengths(self) -> np.ndarray:
        """(3 f,) float64, the length of each half-edge."""
        return np.linalg.norm(self.vertices[self.end] - self.vertices[self.start], axis=1)

    @cached_property
    def size(self) -> float:
        """The diagonal of the bounding box."""
        return float(np.linalg.norm(np.ptp(self.vertices, axis=0)))

    def loops(self) -> list[np.ndarray]:
        """Return the boundary's loops as arrays of half-edges, the longest loop first.

        Raises
        ------
        SceneError
            the boundary passes a vertex twice
        """
        edges = np.flatnonzero(self.twin < 0)
        leaving = np.full(len(self.vertices), -1, np.int64)
        leaving[self.start[edges]] = edges
        if (leaving[self.start[edges]] != edges).any():
            raise SceneError(f"{self.name}: its boundary passes a vertex twice; only a surface "
                             "whose triangles form a single fan around every vertex can be made "
                             "an image")
        found, left = [], set(edges.tolist())
        for edge in edges.tolist():
            loop = []
            while edge in left:
                left.remove(edge)
                loop.append(edge)
                edge = int(leaving[self.end[edge]])
            if loop:
                found.append(np.array(loop))
        return sorted(found, key=lambda loop: -self.lengths[loop].sum())

    def parts(self) -> int:
        """Return the number of connected components."""
        label = same_labels(len(self.vertices), self.start, self.end)
        return len(np.unique(label))

    def euler(self) -> int:
        """Return vertices - edges + faces: 2 for a closed surface of genus 0, 1 for a disc."""
        edges = len(self.start) - int((self.twin >= 0).sum()) // 2
        return len(self.vertices) - edges + len(self.faces)

    def filled(self, loops: list[np.ndarray]) -> SurfaceMesh:
        """Return the mesh with these boundary loops closed, each by a fan around its centre."""
        vertices, faces = [self.vertices], [self.faces]
        for k, loop in enumerate(loops):
            middle = np.full(len(loop), len(self.vertices) + k)
            vertices.append(self.vertices[self.start[loop]].mean(axis=0, keepdims=True))
            faces.append(np.stack([self.end[loop], self.start[loop], middle], axis=1))
        return SurfaceMesh(np.concatenate(vertices), np.concatenate(faces), self.name)

    # Paths ----------------------------------------------------------------------------------

    @cached_property
    def _neighbours(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """The neighbours of each vertex, in one list sorted by vertex. Four arrays: the index of
        each vertex's first entry, (v,); the number of its entries, (v,); and for each entry the
        neighbour and its distance."""
        lone = self.twin < 0
        here = np.concatenate([self.start, self.end[lone]])
        there = np.concatenate([self.end, self.start[lone]])
        far = np.concatenate([self.lengths, self.lengths[lone]])
        order = np.argsort(here, kind="stable")
        count = np.bincount(here, minlength=len(self.vertices))
        return run_starts(count), count, there[order], far[order]

    def distances(self, sources: np.ndarray) -> np.ndarray:
        """Return (v,) float64, the distance along edges from each vertex to the nearest of
        ``sources``."""
        first, count, there, far = self._neighbours
        distance = np.full(len(self.vertices), np.inf)
        distance[sources] = 0
        front = np.unique(sources)
        while len(front):
            edge = expand(first[front], count[front])
            reached = np.repeat(distance[front], count[front]) + far[edge]
            shorter = reached < distance[there[edge]]
            front = np.unique(there[edge][shorter])
            np.minimum.at(distance, there[edge][shorter], reached[shorter])
        return distance

    def path(self, distance: np.ndarray, end: int) -> list[int]:
        """Return the vertices of a shortest path from ``end`` to the nearest source. ``distance``
        is the result of `distances` for the sources."""
        first, count, there, far = self._neighbours
        way = [int(end)]
        while distance[way[-1]] > 0:
            edges = slice(first[way[-1]], first[way[-1]] + count[way[-1]])
            way.append(int(there[edges][np.argmin(distance[there[edges]] + far[edges])]))
        return way

    def edges_along(self, way: list[int]) -> np.ndarray:
        """Return (3 f,) bool, the half-edges along a path, in both directions."""
        size = len(self.vertices)
        one, two = np.array(way[:-1]), np.array(way[1:])
        wanted = np.concatenate([one * size + two, two * size + one])
        return np.isin(self.start * size + self.end, wanted)

    def cut(self, along: np.ndarray) -> tuple[SurfaceMesh, np.ndarray]:
        """Cut the mesh along the half-edges that ``along``, (3 f,) bool, marks. Return the new
        mesh and the original vertex of each new vertex, (w,) int64. Each side of the cut has its
        own vertices. Faces and half-edges keep their numbers.
        """
        kept = np.flatnonzero((self.twin >= 0) & ~along)
        after = np.arange(len(self.start)).reshape(-1, 3)
        after = np.roll(after, -1, axis=1).reshape(-1)
        # A corner has the number of the half-edge that starts there. At each end of an edge that
        # is not cut, the corners of the edge's two faces are the same vertex.
        label = same_labels(len(self.start), np.concatenate([kept, after[kept]]),
                            np.concatenate([after[self.twin[kept]], self.twin[kept]]))
        corner, faces = np.unique(label, return_inverse=True)
        was = self.start[corner]
        return SurfaceMesh(self.vertices[was], faces.reshape(-1, 3), self.name), was


def same_labels(count: int, one: np.ndarray, two: np.ndarray) -> np.ndarray:
    """Return (count,) int64, the lowest index in each item's connected component. Item one[i] is
    connected with item two[i]."""
    label = np.arange(count)
    while True:
        lowest = np.minimum(label[one], label[two])
        new = label.copy()
        np.minimum.at(new, label[one], lowest)
        np.minimum.at(new, label[two], lowest)
        new = new[new]
        if np.array_equal(new, label):
            return label
        label = new
