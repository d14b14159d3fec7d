"""Verdicts: whether an engine's answers are right, wrong or undecidable; and the error of t."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..numerics.error_bounds import bound_pairs
from ..numerics.public_call import public_call
from .acceptance import FAIR, Acceptance, acceptance
from .nearest import as_rays, as_triangles, has_area

KINDS = ("right", "undecidable", "leak", "false hit", "wrong nearest", "wrong t", "not finite",
         "any hit disagrees")
(RIGHT, UNDECIDABLE, LEAK, FALSE_HIT, WRONG_NEAREST, WRONG_T, NOT_FINITE,
 ANY_HIT_DISAGREES) = range(len(KINDS))
WRONG_KINDS = KINDS[LEAK:]


@dataclass
class Verdicts:
    """Verdicts on the answers to n rays.

    Attributes
    ----------
    kind : (n,) uint8, an index into KINDS:

        right : a right answer to a ray for which only a hit is right, or only a miss
        undecidable : a right answer to a ray for which a hit and a miss are both right
        leak : a miss where every fair engine (acceptance.py) hits
        false hit : a triangle that no fair engine hits
        wrong nearest : a triangle that lies behind a triangle that every fair engine hits
        wrong t : the right triangle at a wrong distance
        not finite : a hit whose t is NaN, or is infinite although float32 holds the right t
        any hit disagrees : the nearest hit is right, but the answer to "is there any hit" is not
    t_error : (n,) float64, |t - exact t| on the reported triangle; NaN for a miss or a triangle
        that is not acceptable
    t_allowed : (n,) float64, the largest error of a fair engine; NaN as for ``t_error``
    """

    kind: np.ndarray
    t_error: np.ndarray
    t_allowed: np.ndarray

    @property
    def wrong(self) -> np.ndarray:
        """(n,) bool, whether the answer is wrong."""
        return self.kind >= LEAK

    @property
    def counts(self) -> dict[str, int]:
        """The number of rays of each kind."""
        return dict(zip(KINDS, np.bincount(self.kind, minlength=len(KINDS)).tolist()))


@public_call
def check(scene_or_triangles: Any, origins: np.ndarray, directions: np.ndarray,
          t: np.ndarray | None, triangle: np.ndarray, any_hit: np.ndarray | None = None,
          t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf,
          known: Acceptance | None = None) -> Verdicts:
    """Judge whether each answer of an engine is right, wrong, or undecidable in float32.

    Triangles and rays are rounded to float32. An engine that computes in float64 must trace the
    rounded arrays; otherwise, its right answers may count as wrong.

    Parameters
    ----------
    scene_or_triangles, origins, directions, t_min, t_max : the traced scene and rays, as for
        `trace`
    t : (n,) float, the reported distance in units of |direction|; None if the engine gives none
    triangle : (n,) int, the reported triangle; -1 or less for a miss
    any_hit : (n,) bool, the answers to "is there any hit"; None if they were not asked for
    known : the result of `acceptance` for the same rays; computed if None

    Returns
    -------
    Verdicts
        if several wrong kinds apply to a ray, its kind is the first in this order: leak, false hit
        or wrong nearest; wrong t or not finite; any hit disagrees

    Raises
    ------
    ValueError
        shapes do not match, triangles are not integers, or a ray is invalid
    """
    if known is None:
        known = acceptance(scene_or_triangles, origins, directions, t_min, t_max)
    n = len(known)
    triangle, t, any_hit = (None if given is None else np.asarray(given).reshape(-1)
                            for given in (triangle, t, any_hit))
    assert triangle is not None
    if not (np.isfinite(triangle) & (triangle == np.floor(triangle))).all():
        raise ValueError("triangle must hold integers; are t and triangle swapped?")
    triangle = np.clip(triangle, -1, 2 ** 62).astype(np.int64)
    for name, given in (("triangle", triangle), ("t", t), ("any_hit", any_hit)):
        if given is not None and np.shape(given) != (n,):
            raise ValueError(f"{name} has shape {np.shape(given)}; expected ({n},)")
    hit = triangle >= 0
    kind = np.where(known.decided, RIGHT, UNDECIDABLE).astype(np.uint8)
    if any_hit is not None:
        kind[known.decided & (np.asarray(any_hit, bool) != known.may_hit)] = ANY_HIT_DISAGREES
    entry = known.entry(triangle)
    found = np.flatnonzero(hit & (entry >= 0))
    low, high = (np.full(n, np.nan) for _ in range(2))
    low[found], high[found] = known.t_low[entry[found]], known.t_high[entry[found]]
    t_error = np.full(n, np.nan)
    if t is not None:
        t = np.asarray(t, np.float64)
        # A t beyond the range of float32 may be infinite.
        beyond = (high > np.finfo(np.float32).max) & np.isinf(t) & (t > 0)
        with np.errstate(invalid="ignore"):
            t_error[found] = np.abs(t - (low + high) / 2)[found]
            kind[hit & np.isfinite(t) & ((t < low) | (t > high))] = WRONG_T
        kind[hit & ~np.isfinite(t) & ~beyond] = NOT_FINITE
    elsewhere = np.flatnonzero(hit & (entry < 0))
    kind[elsewhere] = np.where(
        _may_hit(scene_or_triangles, origins, directions, triangle, t_min, t_max, elsewhere),
        WRONG_NEAREST, FALSE_HIT)
    kind[~hit & known.must_hit] = LEAK
    return Verdicts(kind, t_error, (high - low) / 2)


def _may_hit(scene_or_triangles: Any, origins: np.ndarray, directions: np.ndarray,
             triangle: np.ndarray, t_min: float | np.ndarray, t_max: float | np.ndarray,
             rays: np.ndarray) -> np.ndarray:
    """Return (k,) bool: whether a fair engine may hit the triangle that was reported for each of
    ``rays``."""
    vertices = as_triangles(scene_or_triangles)
    origins, directions, first, last, _ = as_rays(origins, directions, t_min, t_max, "raise")
    if not len(vertices):
        return np.zeros(len(rays), bool)
    exists = triangle[rays] < len(vertices)
    some = vertices[np.where(exists, triangle[rays], 0)]
    pair = bound_pairs(some, origins[rays], directions[rays], FAIR)
    return (exists & pair.possible & has_area(some) & (pair.t + pair.t_bound >= first[rays])
            & (pair.t - pair.t_bound <= last[rays]))
