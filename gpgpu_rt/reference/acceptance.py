"""Acceptance: finds the answers to a ray that are right for an engine that rounds to float32.

Exact arithmetic gives a single answer to each ray. An engine that rounds may rightly return
another answer: either triangle at an edge that the ray meets, or the farther of two surfaces that
nearly touch.

A fair engine rounds like float32, but its operations together may lose up to four more bits. The
bounds of `error_bounds` are therefore computed with a unit roundoff of 2^-20 instead of 2^-24. The
bounds tell which triangles a fair engine may hit, and which triangles it certainly hits.

A triangle is acceptable if it may be hit, and if no triangle is certainly hit before it.

A ray must hit if it certainly hits a triangle. A ray near an edge or a vertex must also hit if two
conditions are met. First, the ray hits in exact arithmetic, and all its neighbours hit, too.
Neighbours have the same origin and slightly turned directions; the outer neighbours are turned
further than rounding errors can move the ray. Second, the triangles that these rays hit meet at
the edge or the vertex, where their corners are equal to the bit. If an engine misses a ray that
must hit, the miss is a leak.

A ray may hit if some triangle is acceptable. A ray that may hit but need not is undecidable: a hit
and a miss are both right.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..hits import Hits
from ..numerics.error_bounds import FLOAT32, Arithmetic, bound_pairs
from ..numerics.public_call import public_call
from .exact import nearest_of_pairs
from .nearest import as_rays, as_triangles, has_area, settle, trace
from .tree import ReferenceTree

FAIR = Arithmetic(2.0 ** -20, 4 * FLOAT32.tiny, FLOAT32.huge)
# The reach is the largest |vertex - origin|. Each coordinate of a sheared vertex is the difference
# of two terms that do not exceed the reach. Each term has at most 5 roundings, and the edge
# functions add 3. So rounding moves a ray sideways by less than 2 * (5 + 3) * unit * reach, where
# unit is the unit roundoff. The outer ring's radius is twice this bound.
RADIUS = 32 * FAIR.unit
_RINGS = ((RADIUS, 12), (RADIUS / 3, 4))    # ring's radius / reach, neighbours on the ring
# Do not judge a ray by neighbours that would be turned by this angle (radians) or more.
_WIDEST = 0.05
# A ray that certainly hits a triangle needs no neighbours if the largest possible t of the hit
# exceeds the exact t by at most this share of t.
_SAME = 1e-4


@dataclass
class Acceptance:
    """The answers that fair engines may give to n rays.

    Attributes
    ----------
    exact : the answers of exact arithmetic; t is correctly rounded to float64
    must_hit, may_hit : (n,) bool, whether the ray must hit, and whether it may hit
    starts : (n + 1,) int; entries starts[i] to starts[i + 1] - 1 of `triangle`, `t_low` and
        `t_high` belong to ray i
    triangle : (k,) int32, acceptable triangles; equal triangles are listed once, by their lowest
        index (``copy_of``)
    copy_of : (m,) int, for each triangle the lowest index of a triangle with the same corners in
        the same order
    t_low, t_high : (k,) float64, the smallest and the largest acceptable t on each element of
        `triangle`
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
        """(n,) bool, whether only one answer is right: a hit, or a miss."""
        return self.must_hit | ~self.may_hit

    def entry(self, triangle: np.ndarray) -> np.ndarray:
        """Return for each ray the entry of its reported ``triangle``, (n,) int; -1 if the triangle
        is not acceptable."""
        ray = np.repeat(np.arange(len(self)), np.diff(self.starts))
        found = np.full(len(self), -1)
        first = np.full(len(self), -1)
        known = np.flatnonzero((triangle >= 0) & (triangle < len(self.copy_of)))
        first[known] = self.copy_of[triangle[known]]
        same = np.flatnonzero(self.triangle == first[ray])
        found[ray[same]] = same
        return found


@public_call
def acceptance(scene_or_triangles: Any, origins: np.ndarray, directions: np.ndarray,
               t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf) -> Acceptance:
    """Return the answers that fair engines may give to each ray.

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
    with np.errstate(invalid="ignore"):     # a ray that misses gives inf - inf
        doubtful = np.flatnonzero(exact.hit & ~(limit - exact.t <= _SAME * np.abs(exact.t)))
    limit[doubtful] = np.minimum(limit[doubtful],
                                 _behind_neighbours(vertices, exact, doubtful, *rays))
    # A ray whose t exceeds the range of float32 need not hit: no engine can report such a t.
    must_hit = limit <= np.finfo(np.float32).max
    kept = np.flatnonzero(t - bound <= limit[ray])
    kept = kept[np.lexsort((triangle[kept], ray[kept]))]
    counts = np.bincount(ray[kept], minlength=len(origins))
    return Acceptance(exact, must_hit, counts > 0, np.append(0, np.cumsum(counts)),
                      triangle[kept].astype(np.int32), (t - bound)[kept], (t + bound)[kept],
                      copy_of)


@public_call
def exact_hits(vertices: np.ndarray, origins: np.ndarray, directions: np.ndarray,
               t_min: np.ndarray, t_max: np.ndarray) -> Hits:
    """Return the exact hits, with t, u and v correctly rounded to float64.

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
    """Return the pairs (ray, triangle) that a fair engine may accept, for triangles of ``solid``.

    Returns
    -------
    ray, triangle, t and the bound on the error of t : (k,) each
    nearest : (n,) the largest t that the nearest hit of each ray can have; inf if the ray does not
        certainly hit
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
    """Return for each of ``rays`` the largest t that its neighbours' hits can have, (k,).

    The result is inf unless all neighbours certainly hit within the interval, and their triangles
    meet at the edge or vertex through which the ray passes.
    """
    # Scale directions by powers of two: `trace` rounds the turned directions to float32, where
    # very long or very short directions would overflow or become denormal.
    exponent = np.frexp(np.abs(directions[rays]).max(axis=1, initial=0))[1]
    o, d = origins[rays], np.ldexp(directions[rays], -exponent[:, None])
    t, first, last = (np.ldexp(end[rays], exponent) for end in (exact.t, t_min, t_max))
    corners = vertices[exact.triangle[rays]]
    bound = bound_pairs(corners, o, d, FAIR).t_bound
    reach = np.abs(corners - o[:, None]).max(axis=(1, 2))
    length = np.sqrt((d * d).sum(axis=1))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        width = reach / (t * length)
        usable = (t > 0) & (width * RADIUS < _WIDEST)
    farthest, hit = np.where(usable, t, np.inf), []
    for radius, count in _RINGS:
        for turn in np.arange(count) / count + 0.01:
            left = np.flatnonzero(farthest < np.inf)
            around = turned(d[left], radius * width[left], turn)
            hits = trace(vertices, o[left], around, first[left], last[left], accelerated=True)
            certain = (hits.hit & (hits.t - bound[left] >= first[left])
                       & (hits.t + bound[left] <= last[left]))
            farthest[left] = np.where(certain, np.maximum(farthest[left], hits.t), np.inf)
            triangle = np.full(len(rays), -1)
            triangle[left] = hits.triangle
            hit.append(triangle)
    left = np.flatnonzero(farthest < np.inf)
    meet = _meet(vertices, exact.triangle[rays[left]], np.stack(hit, 1)[left], o[left], d[left],
                 RADIUS * reach[left])
    farthest[left[~meet]] = np.inf
    return np.ldexp(farthest + bound, -exponent)


def _meet(vertices: np.ndarray, triangle: np.ndarray, around: np.ndarray, origins: np.ndarray,
          directions: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Return whether a ray's own triangle shares corners with all triangles that its neighbours
    hit: the same two corners, or one corner nearer to the ray than ``radius``.

    Parameters
    ----------
    triangle : (k,) the triangle that each ray hits
    around : (k, r) the triangles that its r neighbours hit
    radius : (k,) world units

    Returns
    -------
    (k,) bool
    """
    # Adding 0.0 turns -0 into +0, so that equal corners are equal to the bit.
    _, corner = np.unique(vertices.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)
    corner = corner.reshape(-1, 3)
    mine, theirs = corner[triangle], corner[around]
    common = (theirs[:, :, None] == mine[:, None, :, None]).any(axis=3).all(axis=1)
    aside = np.cross(vertices[triangle] - origins[:, None], directions[:, None])
    distance = (np.linalg.norm(aside, axis=2)
                / np.linalg.norm(directions, axis=1)[:, None])
    return (common.sum(axis=1) >= 2) | (common & (distance < radius[:, None])).any(axis=1)


def turned(directions: np.ndarray, width: np.ndarray, turn: float) -> np.ndarray:
    """Return (n, 3) directions, each moved sideways by ``width`` times its length.

    ``turn`` chooses the sideways direction: its angle around the given direction, in full turns.
    """
    length = np.linalg.norm(directions, axis=1)
    side = np.cross(directions, np.eye(3)[np.abs(directions).argmin(axis=1)])
    side *= (length / np.linalg.norm(side, axis=1))[:, None]
    other = np.cross(directions, side) / length[:, None]
    angle = 2 * np.pi * turn
    return directions + width[:, None] * (np.cos(angle) * side + np.sin(angle) * other)
