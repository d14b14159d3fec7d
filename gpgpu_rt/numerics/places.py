"""Places: points where a ray passes through a mesh. A place at an edge or a vertex has several
hits.

Two hits of a ray belong to the same place if their t are equal within the float32 error bounds of
``error_bounds.py``. There are three exceptions.

First: hits at equal t belong to two places if float64 proves both hits, and that their t differ.
Second: the same holds if float64 disproves one hit, and the surface does not continue from the
other triangle into the missed triangle. The ray then passes beside the missed triangle, which
belongs to another part of the mesh. Third: hits at different t belong to the same place if float64
disproves one hit, and the surface continues from one triangle to the other.
"""
from __future__ import annotations

import numpy as np

from .error_bounds import FLOAT32, FLOAT64, bound_pairs, gamma
from .plane import plane_distance


def first_hits_of_places(ray: np.ndarray, t: np.ndarray, corners: np.ndarray,
                         origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return the row of the first hit of each place, (k,) int, ray by ray, nearest places first.

    Parameters
    ----------
    ray : (m,) int, the ray of each hit, ascending
    t : (m,) float32, for each ray ascending, in units of the direction's length
    corners : (m, 3, 3), float32 values, the triangle of each hit
    origins, directions : (m, 3), float32 values, the ray of each hit; directions of length near 1
    """
    t = t.astype(np.float64)
    lo, hi = _ends(corners, origins, directions)
    # The error of t is at most the triangle's extent along the ray, plus rounding.
    far = np.maximum(np.abs(lo), np.abs(hi))
    begins = _begins(ray, t, hi - lo + 4 * gamma(4) * far + 64 * FLOAT32.tiny)
    # A hit whose t differs from all others by more than this cheap bound is a place of its own.
    # Only the other hits need the exact bounds.
    alone = begins & np.r_[begins[1:], True][:len(begins)]
    rows = np.flatnonzero(~alone)
    if not len(rows):
        return np.arange(len(t))
    pairs = corners[rows], origins[rows], directions[rows]
    blurred, sharp = (bound_pairs(*pairs, arithmetic) for arithmetic in (FLOAT32, FLOAT64))
    t = t[rows]
    reach = np.where(np.isfinite(blurred.t_bound), blurred.t_bound, 0)
    exact = np.clip(np.where(np.isfinite(blurred.t), blurred.t, t), t - reach, t + reach)
    new = _begins(np.cumsum(begins)[rows], t, reach)
    # Near the edge of a long thin triangle, float32 may report hits on both triangles of the edge,
    # although the ray crosses only one of them. Float64 disproves the other hit.
    shared, beyond = _neighbours(corners[rows[1:]], corners[rows[:-1]], directions[rows[1:]])
    new[1:] &= ~((np.diff(ray[rows]) == 0) & (sharp.possible[1:] != sharp.possible[:-1])
                 & (shared == 2) & beyond)
    group = np.cumsum(new)
    first = rows[_nearest_first(group, exact, np.where(sharp.possible, sharp.t_bound, np.inf),
                                *pairs[::2])]
    # Merge the lone hits with the first hits of the other places. The places of a ray stay in the
    # order of t.
    found = np.concatenate([np.flatnonzero(alone), first])
    return found[np.argsort(np.cumsum(begins)[found], kind="stable")]


def exact_t(corners: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return where rays meet the planes of triangles, (m,) float64, in units of the directions'
    lengths. A t outside the range of the triangle's corners is moved to the range's end.

    Parameters
    ----------
    corners : (m, 3, 3) float64
    origins, directions : (m, 3) float64
    """
    lo, hi = _ends(corners, origins, directions)
    by_axis = np.ascontiguousarray(corners.transpose(1, 2, 0))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        t = plane_distance(by_axis, by_axis - origins.T, np.ascontiguousarray(directions.T))
    return np.clip(np.where(np.isfinite(t), t, (lo + hi) / 2), lo, hi)


def _ends(corners: np.ndarray, origins: np.ndarray, directions: np.ndarray
          ) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest t of each triangle's corners along the direction's largest
    axis, (m,) float64 each."""
    axis = np.abs(directions).argmax(axis=1)[:, None]
    along, start = (np.take_along_axis(values, axis, 1).astype(np.float64)
                    for values in (directions, origins))
    # Compute corner by corner, because numpy is slow along short axes.
    a, b, c = ((np.take_along_axis(corners[:, k], axis, 1) - start) / along for k in range(3))
    return (np.minimum(np.minimum(a, b), c)[:, 0], np.maximum(np.maximum(a, b), c)[:, 0])


def _neighbours(some: np.ndarray, others: np.ndarray, directions: np.ndarray
                ) -> tuple[np.ndarray, np.ndarray]:
    """Compare pairs of triangles, seen along rays. The winding of the triangles does not matter.

    Parameters
    ----------
    some, others : (m, 3, 3), the triangles of each pair
    directions : (m, 3), the direction of each pair's ray

    Returns
    -------
    shared : (m,) int, the number of corners that the two triangles share
    beyond : (m,) bool, whether the two triangles lie on different sides of their common edge, so
        that the surface continues across the edge; else the edge is on the outline. Undefined for
        pairs without a common edge
    """
    same = (some[:, :, None] == others[:, None]).all(axis=3)
    own, theirs = same.any(axis=2), same.any(axis=1)
    at = np.arange(len(some))
    third, start = some[at, own.argmin(axis=1)], some[at, own.argmax(axis=1)]
    end = some[at, 2 - own[:, ::-1].argmax(axis=1)]
    across = np.cross(end.astype(np.float64) - start, directions)
    beside = ((third - start) * across).sum(axis=1)
    opposite = ((others[at, theirs.argmin(axis=1)] - start) * across).sum(axis=1)
    return same.sum(axis=(1, 2)), beside * opposite < 0


def _shows_front(corners: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Return whether each triangle shows its front to its ray, (m,) bool."""
    corners = corners.astype(np.float64)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return (normals * directions).sum(axis=1) < 0


def _begins(group: np.ndarray, t: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Return whether each hit begins a new place, (m,) bool.

    A hit begins a place if the previous hit has another ``group``, or if the two hits' intervals
    from t - reach to t + reach are disjoint.
    """
    new = np.ones(len(t), bool)
    new[1:] = (np.diff(group) > 0) | (t[1:] - reach[1:] > t[:-1] + reach[:-1])
    return new


def _nearest_first(group: np.ndarray, t: np.ndarray, sharp: np.ndarray, corners: np.ndarray,
                   directions: np.ndarray) -> np.ndarray:
    """Return the rows of the first hits of places, (k,), group by group, nearest places first.

    Parameters
    ----------
    group : (m,) int, ascending; hits that float32 cannot separate have the same number
    t : (m,) float64, where the ray of a hit meets the triangle's plane
    sharp : (m,) float64, error bound of t; inf where float64 proves a miss
    corners, directions : The triangle and the direction of each hit, (m, 3, 3) and (m, 3).

    A disproved hit joins the nearest proved hit on the same side of the surface in its group. If
    there is none, it joins the group's nearest hit if the surface continues from there into its
    triangle, or if float64 disproves the whole group. The other disproved hits on a side form a
    place of their own.
    """
    order = np.lexsort((t, ~np.isfinite(sharp), group))
    group, t, sharp = group[order], t[order], sharp[order]
    corners, directions = corners[order], directions[order]
    known, side = np.isfinite(sharp), 2 * group + _shows_front(corners, directions)
    first = np.r_[True, np.diff(group) > 0]
    place = np.cumsum(first | known & _begins(group, t, np.where(known, sharp, 0))) - 1
    nearest = np.flatnonzero(first)[np.cumsum(first) - 1]     # the group's first hit
    # The first hit of each hit's group and side: a proved hit, if there is one.
    _, leader, member = np.unique(side, return_index=True, return_inverse=True)
    alike = leader[member]
    # The side is wrong if neighbours are wound differently, or if the mesh contains a triangle
    # twice. So also test whether the surface continues from the nearest hit.
    shared, beyond = _neighbours(corners, corners[nearest], directions)
    lost = ~known & ~known[alike] & known[nearest] & (shared < 3) & ~((shared == 2) & beyond)
    joined = place[np.where(known[alike], alike, nearest)]
    place = np.where(lost, len(order) + member, np.where(known, place, joined))
    _, lead, place = np.unique(place, return_index=True, return_inverse=True)
    rows = np.full(len(lead), len(order))
    np.minimum.at(rows, place, order)
    return rows[np.lexsort((t[lead], group[lead]))]
