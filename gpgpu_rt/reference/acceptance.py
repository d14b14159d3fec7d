"""Acceptance: which answers to a ray are right for every engine that rounds to float32.

Exact arithmetic has a single answer to each ray. An engine that rounds may return another answer
without a fault: a ray through an edge meets one triangle or the other, and two surfaces that
nearly touch change places. This module bounds what a fair engine may answer.

A fair engine rounds like float32, with up to four bits lost to the number of its operations. The
bounds of `error_bounds` are evaluated with a unit roundoff of 2^-20 in place of 2^-24. They tell
which triangles such an engine may hit, which it certainly hits, and by how much its t may be off.

A triangle is acceptable if it may be hit, and if no triangle is certainly hit before it. A ray
must hit if it certainly hits a triangle. It must also hit if exact arithmetic says that it hits
and all its neighbours hit. The neighbours are rays around it, farther away than rounding errors
reach. Such a ray meets an edge or a vertex inside a surface, and a miss is a leak.

A ray may hit if some triangle is acceptable. A ray that may hit but need not is undecidable: a hit
and a miss are both right.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..hits import Hits
from ..numerics.error_bounds import FLOAT32, Arithmetic, bound_pairs
from .exact import nearest_of_pairs
from .nearest import as_rays, as_triangles, has_area, settle, trace
from .tree import ReferenceTree

FAIR = Arithmetic(2.0 ** -20, 4 * FLOAT32.tiny, FLOAT32.huge)
# A sheared vertex is off by at most 5 roundings of each of two terms; the edge functions add 3.
# Terms are at most the largest |vertex - origin|, the reach. So rounding moves a ray sideways by
# less than 16 unit roundoffs of the reach, and the outer neighbours lie twice as far away.
RADIUS = 32 * FAIR.unit
_RINGS = ((RADIUS, 12), (RADIUS / 3, 4))    # radius over reach, and number of neighbours
_WIDEST = 0.05      # no neighbours are judged beyond this angle, in radian


@dataclass
class Acceptance:
    """What fair engines may answer to n rays.

    Attributes
    ----------
    exact : the answers of exact arithmetic; t is correctly rounded to float64
    must_hit, may_hit : (n,) bool
    starts : (n + 1,) int; the acceptable triangles of ray i are entries starts[i] to
        starts[i + 1] - 1 of the following arrays
    triangle : (k,) int32, acceptable triangles; of equal triangles, the one with the lowest index
        stands for all
    copy_of : (m,) int, the lowest index of the triangles that are equal to each triangle
    t_low, t_high : (k,) float64, the acceptable t on each of these triangles
    """

    exact: Hits
    must_hit: np.ndarray
    may_hit: np.ndarray
    starts: np.ndarray
    triangle: np.ndarray
    t_low: np.ndarray
    t_high: np.ndarray
    copy_of: np.ndarray

    def __len__(self) -> int:
        return len(self.must_hit)

    @property
    def decided(self) -> np.ndarray:
        """(n,) bool, whether a hit, or a miss, is the only right answer."""
        return self.must_hit | ~self.may_hit

    def entry(self, triangle: np.ndarray) -> np.ndarray:
        """Return for the reported triangle of each ray, (n,) int, the index of its entry, or -1 if
        the triangle is not acceptable."""
        ray = np.repeat(np.arange(len(self)), np.diff(self.starts))
        found = np.full(len(self), -1)
        known = (triangle >= 0) & (triangle < len(self.copy_of))
        first = np.where(known, self.copy_of[np.where(known, triangle, 0)], -1)
        same = np.flatnonzero(self.triangle == first[ray])
        found[ray[same]] = same
        return found


def acceptance(scene_or_triangles: Any, origins: np.ndarray, directions: np.ndarray,
               t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf) -> Acceptance:
    """Return what fair engines may answer to each ray.

    Parameters
    ----------
    scene_or_triangles, origins, directions, t_min, t_max : as for `trace`, rounded to float32; all
        rays must be valid

    Raises
    ------
    ValueError
        shapes do not match, or a ray is invalid
    """
    vertices = as_triangles(scene_or_triangles)
    origins, directions, t_min, t_max, _ = as_rays(origins, directions, t_min, t_max, "raise")
    rays = origins, directions, t_min, t_max
    exact = exact_hits(vertices, *rays)
    _, first, copies = np.unique(vertices.reshape(-1, 9), axis=0, return_index=True,
                                 return_inverse=True)
    copy_of = first[copies.ravel()]
    single = (copy_of == np.arange(len(vertices))) & has_area(vertices)
    ray, triangle, t, bound, limit = _candidates(vertices, np.flatnonzero(single), *rays)
    must_hit = limit < np.inf
    doubtful = np.flatnonzero(exact.hit & ~must_hit)
    farthest = _behind_neighbours(vertices, exact, doubtful, *rays)
    limit[doubtful] = np.minimum(limit[doubtful], farthest)
    must_hit[doubtful] = np.isfinite(farthest)
    kept = np.flatnonzero(t - bound <= limit[ray])
    kept = kept[np.lexsort((triangle[kept], ray[kept]))]
    counts = np.bincount(ray[kept], minlength=len(origins))
    return Acceptance(exact, must_hit, counts > 0, np.append(0, np.cumsum(counts)),
                      triangle[kept].astype(np.int32), (t - bound)[kept], (t + bound)[kept],
                      copy_of)


def exact_hits(vertices: np.ndarray, origins: np.ndarray, directions: np.ndarray,
               t_min: np.ndarray, t_max: np.ndarray) -> Hits:
    """Return the exact hits, with t, u and v correctly rounded to float64.

    Bounds on the errors of float64 decide most rays, and integers the others.

    Parameters
    ----------
    vertices : (m, 3, 3) float64, as `as_triangles` returns them, world units
    origins, directions, t_min, t_max : float64 arrays of n valid rays, as `as_rays` returns them
    """
    hits, _ = settle(vertices, origins, directions, trace(
        vertices, origins, directions, t_min, t_max, accelerated=True), t_min, t_max)
    hit = np.flatnonzero(hits.hit)
    known = nearest_of_pairs(vertices, np.arange(len(hit)), hits.triangle[hit], origins[hit],
                             directions[hit], t_min[hit], t_max[hit])
    for name in ("t", "u", "v", "triangle"):
        getattr(hits, name)[hit] = getattr(known, name)
    return hits


def _candidates(vertices: np.ndarray, solid: np.ndarray, origins: np.ndarray,
                directions: np.ndarray, t_min: np.ndarray, t_max: np.ndarray
                ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return the pairs of a ray and a triangle of ``solid`` that a fair engine may hit.

    Returns
    -------
    ray, triangle, t and the bound on the error of t : (k,) each
    nearest : (n,) the largest t that the nearest hit of each ray can have; inf for a ray that need
        not hit
    """
    limit, nearest = t_max.copy(), np.full(len(origins), np.inf)
    kept: list[tuple[np.ndarray, ...]] = [(np.zeros(0, np.int64),) * 2 + (np.zeros(0),) * 2]
    if len(solid):
        corners = vertices[solid].reshape(-1, 3)
        reach = np.maximum(np.abs(corners.min(axis=0) - origins),
                           np.abs(corners.max(axis=0) - origins)).max(axis=1)
        for ray, some in ReferenceTree.of(vertices[solid]).pairs(
                origins, directions, t_min, limit, RADIUS * reach):
            triangle = solid[some]
            pair = bound_pairs(vertices[triangle], origins[ray], directions[ray], FAIR)
            first, last = pair.t - pair.t_bound, pair.t + pair.t_bound
            may = pair.possible & (last >= t_min[ray]) & (first <= t_max[ray])
            sure = pair.inside & (first >= t_min[ray]) & (last <= t_max[ray])
            np.minimum.at(nearest, ray[sure], last[sure])
            np.minimum(limit, nearest, out=limit)
            kept.append((ray[may], triangle[may], pair.t[may], pair.t_bound[may]))
    return *map(np.concatenate, zip(*kept)), nearest


def _behind_neighbours(vertices: np.ndarray, exact: Hits, rays: np.ndarray, origins: np.ndarray,
                       directions: np.ndarray, t_min: np.ndarray, t_max: np.ndarray
                       ) -> np.ndarray:
    """Return for some rays the largest t of their neighbours' hits, (k,); inf unless all
    neighbours certainly hit within the interval."""
    o, d, t = origins[rays], directions[rays], exact.t[rays]
    corners = vertices[exact.triangle[rays]]
    bound = bound_pairs(corners, o, d, FAIR).t_bound
    reach = np.abs(corners - o[:, None]).max(axis=(1, 2))
    length = np.sqrt((d * d).sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        width = reach / (t * length)
    farthest = np.where(t > 0, t, np.inf)
    for radius, count in _RINGS:
        for turn in np.arange(count) / count + 0.01:
            left = np.flatnonzero((width * radius < _WIDEST) & (farthest < np.inf))
            around = turned(d[left], radius * width[left], turn)
            hits = trace(vertices, o[left], around, t_min[rays[left]], t_max[rays[left]],
                         accelerated=True)
            certain = (hits.hit & (hits.t - bound[left] >= t_min[rays[left]])
                       & (hits.t + bound[left] <= t_max[rays[left]]))
            farthest[left] = np.where(certain, np.maximum(farthest[left], hits.t), np.inf)
    return np.where(width * RADIUS < _WIDEST, farthest + bound, np.inf)


def turned(directions: np.ndarray, width: np.ndarray, turn: float) -> np.ndarray:
    """Return (n, 3) directions, each moved sideways by ``width`` times its length.

    ``turn``, in full turns, is the angle of the movement around the direction.
    """
    length = np.linalg.norm(directions, axis=1)
    side = np.cross(directions, np.eye(3)[np.abs(directions).argmin(axis=1)])
    side *= (length / np.linalg.norm(side, axis=1))[:, None]
    other = np.cross(directions, side) / length[:, None]
    angle = 2 * np.pi * turn
    return directions + width[:, None] * (np.cos(angle) * side + np.sin(angle) * other)
