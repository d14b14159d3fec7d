"""Beams. A beam is the volume that the rays of a five-dimensional box can reach.

J. Arvo, D. Kirk, "Fast Ray Tracing by Ray Classification", SIGGRAPH 1987. A beam has five bounding
planes: a plane behind its origins, and four planes with the extreme slopes of its directions (the
paper's "linear separation"). Tests in float64 find the boxes and triangles that a padded beam may
overlap.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import largest
from ...accel.runs import expand
from ..bvh.tree import Bvh
from .frames import RaySpace, in_frame

PAIRS = 1 << 22      # limit on the pairs of beam and triangle that are tested together


@dataclass(frozen=True)
class Beams:
    """m beams in the frame of an axis (frames.py), as (m,) float64 bounds with padding.

    z is the coordinate along this axis; x is either of the two other coordinates.

    Attributes
    ----------
    behind : the lowest z of the origins
    slopes : for each x, (low, high): the lowest and the highest slope of the directions
    limits : for each x, the least x - low * z and the greatest x - high * z of the origins
    """

    behind: np.ndarray
    slopes: tuple[tuple[np.ndarray, np.ndarray], ...]
    limits: tuple[tuple[np.ndarray, np.ndarray], ...]

    @classmethod
    def of(cls, lo: np.ndarray, hi: np.ndarray, first: np.ndarray, last: np.ndarray,
           space: RaySpace) -> Beams:
        """Return the beams of m boxes of rays.

        Parameters
        ----------
        lo, hi : (m, 3), the corners of the boxes of origins, in the frame
        first, last : (m, 2), the corners of the boxes of directions
        """
        pad, slopes, limits = 3 * space.pad, [], []
        for a in (0, 1):
            low, high = first[:, a] - space.direction_pad, last[:, a] + space.direction_pad
            slopes.append((low, high))
            limits.append((lo[:, a] - np.maximum(low * lo[:, 2], low * hi[:, 2]) - pad,
                           hi[:, a] - np.minimum(high * lo[:, 2], high * hi[:, 2]) + pad))
        return cls(lo[:, 2] - pad, tuple(slopes), tuple(limits))

    def meet_boxes(self, beam: np.ndarray, lo: np.ndarray, hi: np.ndarray,
                   box: np.ndarray) -> np.ndarray:
        """Return whether beam[i] may overlap box[i], (k,) bool.

        ``lo`` and ``hi``, (n, 3), are the corners of all boxes in the frame.
        """
        z_lo, z_hi = lo[box, 2], hi[box, 2]
        kept = z_hi >= self.behind[beam]
        for a in (0, 1):
            (low, high), (least, most) = self.slopes[a], self.limits[a]
            slope = low[beam]
            kept &= hi[box, a] - np.minimum(slope * z_lo, slope * z_hi) >= least[beam]
            slope = high[beam]
            kept &= lo[box, a] - np.maximum(slope * z_lo, slope * z_hi) <= most[beam]
        return kept

    def meet_triangles(self, beam: np.ndarray, corners: np.ndarray,
                       triangle: np.ndarray) -> np.ndarray:
        """Return whether beam[i] may overlap triangle[i], (k,) bool.

        ``corners``, (3 axes, 3 corners, n), are all triangles in the frame.
        """
        depth = corners[2][:, triangle]
        kept = largest(depth) >= self.behind[beam]
        for a in (0, 1):
            (low, high), (least, most) = self.slopes[a], self.limits[a]
            across = corners[a][:, triangle]
            kept &= largest(across - low[beam] * depth) >= least[beam]
            kept &= -largest(high[beam] * depth - across) <= most[beam]
        return kept


class Candidates:
    """The triangles of a scene, sorted along an axis in one of its two directions.

    Attributes
    ----------
    corners : (3 axes, 3 corners, n), the triangles' corners in the frame
    near : (n,) float32, each triangle's lowest coordinate along the axis, without padding; with
        ``negative``, the negated highest coordinate
    order : (n,) int64, the triangles in ascending order of ``near``
    """

    def __init__(self, triangles: np.ndarray, tree: Bvh, axis: int, negative: bool) -> None:
        self.tree = tree
        self.corners = in_frame(triangles, axis, negative).transpose(2, 1, 0).copy()
        lo, hi = in_frame(tree.lo, axis, negative), in_frame(tree.hi, axis, negative)
        self.lo, self.hi = np.minimum(lo, hi), np.maximum(lo, hi)
        along = triangles[:, :, axis]
        self.near = -along.max(axis=1) if negative else along.min(axis=1)
        self.order = np.argsort(self.near, kind="stable")
        self.rank = np.empty(len(self.order), np.int64)
        self.rank[self.order] = np.arange(len(self.order))

    def of(self, beams: Beams) -> tuple[np.ndarray, np.ndarray]:
        """Find the triangles that each of m beams may hit.

        Returns
        -------
        the triangles, beam by beam, in ascending order of ``near``; each beam's number of
        triangles, (m,) int64
        """
        m, n = len(beams.behind), len(self.order)
        if not n:
            return np.zeros(0, np.int64), np.zeros(m, np.int64)
        beam, triangle = self._descend(beams)
        kept = beams.meet_triangles(beam, self.corners, triangle)
        keys = beam[kept] * n + self.rank[triangle[kept]]
        keys.sort()
        return self.order[keys % n], np.bincount(keys // n, minlength=m)

    def _descend(self, beams: Beams) -> tuple[np.ndarray, np.ndarray]:
        """Return (beam, triangle) pairs whose beam may overlap the box of the triangle's leaf."""
        tree, found = self.tree, []
        beam = np.arange(len(beams.behind))
        node = np.zeros(len(beam), np.int64)
        while len(node):
            kept = beams.meet_boxes(beam, self.lo, self.hi, node)
            beam, node = beam[kept], node[kept]
            leaf = tree.count[node] > 0
            count = tree.count[node[leaf]]
            found.append((np.repeat(beam[leaf], count),
                          tree.order[expand(tree.first[node[leaf]], count)]))
            left = node[~leaf] + 1
            beam = np.concatenate([beam[~leaf], beam[~leaf]])
            node = np.concatenate([left, tree.escape[left].astype(np.int64)])
        pairs = [np.concatenate(part) for part in zip(*found)]
        return pairs[0], pairs[1]
