"""The judge: decides which answers of a trace are right, and what is wrong with each wrong answer.

An answer is right if the watertight test could have given it, within the bounds of its rounding
errors (`error_bounds`). A hit is right if the ray possibly hits the answer's triangle, the error
of t is within its bound, and no other triangle is certainly hit at a nearer t. A t is nearer only
if the error intervals of the two t are disjoint. A miss is right if no triangle is certainly hit.
At an edge or a vertex, no triangle is certainly hit, so the judge accepts a miss of a ray aimed
there. `leaks` finds all rays that miss although the reference hits.
"""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import reference as oracle
from ..hits import INVALID, STACK_OVERFLOW, UNFINISHED, Hits
from ..numerics.error_bounds import PairBounds, bound_pairs
from ..reference.tree import ReferenceTree

CATEGORIES = ("right", "leak", "false hit", "wrong triangle", "wrong distance", "unfinished")
RIGHT, LEAK, FALSE_HIT, WRONG_TRIANGLE, WRONG_DISTANCE, UNFINISHED_RAY = range(len(CATEGORIES))

_PAIRS = 1 << 17    # largest number of pairs of a ray and a triangle that are tested at once


@dataclass
class Judgement:
    """The judgement of n rays.

    Attributes
    ----------
    category : (n,) uint8, an index into CATEGORIES
    within_bound : (n,) bool, whether the answer is right but names another triangle than the
        reference. A miss counts as a triangle
    t_ulps : (n,) float64, |t - exact t| on the answer's own triangle, in units in the last place
        (ulp) of the exact t as a float32; NaN for misses and false hits
    t_bounds : (n,) float64, |t - exact t| divided by the error bound of t (`error_bounds`)
    barycentric_error : (n,) float64, the larger of the errors of u and v; NaN for misses and false
        hits
    """

    category: np.ndarray
    within_bound: np.ndarray
    t_ulps: np.ndarray
    t_bounds: np.ndarray
    barycentric_error: np.ndarray

    def __len__(self) -> int:
        return len(self.category)

    @property
    def wrong(self) -> np.ndarray:
        """(n,) bool, whether the answer is not right."""
        return self.category != RIGHT

    @property
    def counts(self) -> dict[str, int]:
        """The number of rays in each category."""
        counted = np.bincount(self.category, minlength=len(CATEGORIES))
        return dict(zip(CATEGORIES, counted.tolist()))

    @property
    def shares(self) -> dict[str, float]:
        """The share of the rays in each category; zeros if there are no rays."""
        return {name: count / max(len(self), 1) for name, count in self.counts.items()}

    @property
    def wrong_share(self) -> float:
        return float(self.wrong.mean()) if len(self) else 0.0

    @property
    def upper_95(self) -> float:
        """The upper 95 % confidence bound of the share of wrong rays, for rays that were drawn
        independently from a single distribution."""
        return upper_confidence(int(self.wrong.sum()), len(self))

    def quantiles(self, errors: str = "t_ulps") -> dict[str, float]:
        """Return the median, 99.9 % quantile and maximum of an error array, without its NaN; zeros
        if no error is known.
        """
        values = getattr(self, errors)
        values = values[~np.isnan(values)]
        if not len(values):
            return {"median": 0.0, "99.9 %": 0.0, "max": 0.0}
        # "higher" avoids an interpolation with an infinite error.
        found = np.quantile(values, [0.5, 0.999, 1], method="higher")
        return dict(zip(("median", "99.9 %", "max"), found.tolist()))

    def to_dict(self) -> dict[str, Any]:
        """Return all numbers except the arrays, ready for JSON."""
        return {"rays": len(self), "counts": self.counts, "wrong_share": self.wrong_share,
                "upper_95": self.upper_95, "within_bound": int(self.within_bound.sum()),
                **{name: self.quantiles(name) for name in
                   ("t_ulps", "t_bounds", "barycentric_error")}}


def judge(scene_or_triangles: Any, origins: np.ndarray, directions: np.ndarray, hits: Hits,
          t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf,
          reference: Hits | None = None) -> Judgement:
    """Judge the answer of each ray.

    Parameters
    ----------
    scene_or_triangles, origins, directions, t_min, t_max : the traced scene and rays, as for
        `reference.trace`; the right answer for an invalid ray is a miss with the status INVALID
    hits : the answers, in the order of the rays
    reference : the result of `reference.trace` for the same rays; computed if None

    Raises
    ------
    ValueError
        if the arrays have different lengths
    """
    vertices = oracle.as_triangles(scene_or_triangles)
    origins, directions, t_min, t_max, valid = oracle.as_rays(origins, directions, t_min, t_max,
                                                              "miss")
    if reference is None:
        reference = oracle.trace(vertices, origins, directions, t_min, t_max, accelerated=True,
                                 invalid="miss")
    if not len(hits) == len(reference) == len(origins):
        raise ValueError(f"{len(origins)} rays, {len(hits)} hits and {len(reference)} hits of the "
                         "reference; give a hit for each ray")
    case = _PairTests(vertices, origins, directions, t_min, t_max)
    return case.verdict(hits, reference, valid)


def leaks(reference_hits: Hits, hits: Hits) -> np.ndarray:
    """Return whether each ray misses although the reference hits, (n,) bool.

    `judge` accepts a miss of a ray aimed at an edge or a vertex. But even such a ray must not
    escape from the inside of a closed mesh.
    """
    return reference_hits.hit & ~hits.hit


def upper_confidence(wrong: int, rays: int, confidence: float = 0.95) -> float:
    """Return the upper confidence bound of the share of wrong rays.

    If the true share p equals this bound, the probability of ``wrong`` or fewer wrong rays is
    exactly 1 - confidence (Clopper and Pearson's one-sided bound, Biometrika 26, 1934). If none of
    n rays is wrong, the bound is about 3/n. Without rays, the bound is 1.
    """
    if wrong >= rays:
        return 1.0
    k = np.arange(wrong + 1)
    choices = np.zeros(wrong + 1)       # logarithms of the binomial coefficients
    choices[1:] = np.cumsum(np.log((rays - k[1:] + 1) / k[1:]))
    # The probability decreases with p: bisect an interval of log p.
    low, high, goal = np.log(wrong / rays) if wrong else -700.0, 0.0, np.log1p(-confidence)
    while high - low > 1e-13 * -low:
        middle = (low + high) / 2
        terms = choices + k * middle + (rays - k) * np.log1p(-np.exp(middle))
        most = terms.max()
        low, high = ((middle, high) if most + np.log(np.exp(terms - most).sum()) > goal
                     else (low, middle))
    return float(np.exp(high))


class _PairTests:
    """Triangles and rays in float64, and the tests of (ray, triangle) pairs."""

    def __init__(self, vertices: np.ndarray, origins: np.ndarray, directions: np.ndarray,
                 t_min: np.ndarray, t_max: np.ndarray) -> None:
        self.vertices, self.solid = vertices, oracle.has_area(vertices)
        self.origins, self.directions = origins, directions
        self.t_min, self.t_max = t_min, t_max

    def verdict(self, hits: Hits, reference: Hits, valid: np.ndarray) -> Judgement:
        n = len(hits)
        none = np.full(n, np.nan)
        verdict = Judgement(np.full(n, RIGHT, np.uint8), np.zeros(n, bool), none, none.copy(),
                            none.copy())
        category = verdict.category
        broken = hits.hit & ((hits.triangle >= len(self.vertices)) | ~valid)
        # Test for each answer whether its ray hits its triangle, and whether t, u and v are right.
        answered = np.flatnonzero(hits.hit & ~broken)
        t_exact, t_bound = np.full(n, np.nan), np.full(n, np.nan)
        may_hit, t_right = np.zeros(n, bool), np.zeros(n, bool)
        for part in _parts(answered):
            triangle = hits.triangle[part]
            pair = self._pairs(part, triangle)
            t_exact[part], t_bound[part] = pair.t, pair.t_bound
            t = hits.t[part].astype(np.float64)
            with np.errstate(over="ignore", invalid="ignore"):
                error = np.abs(t - pair.t)
                # If the exact t is beyond the range of float32, an infinite t has no error.
                error[(t == pair.t.astype(np.float32)) & np.isinf(t)] = 0
                in_range = ((pair.t + pair.t_bound >= self.t_min[part])
                            & (pair.t - pair.t_bound <= self.t_max[part]))
                ulp = np.spacing(np.abs(np.minimum(pair.t, 3.4e38)).astype(np.float32))
            may_hit[part] = pair.possible & self.solid[triangle] & in_range
            t_right[part] = error <= pair.t_bound
            verdict.t_ulps[part] = error / np.maximum(ulp.astype(np.float64), 2.0 ** -149)
            verdict.t_bounds[part] = error / pair.t_bound
            verdict.barycentric_error[part] = np.maximum(np.abs(hits.u[part] - pair.u),
                                                         np.abs(hits.v[part] - pair.v))
        # A NaN in an answer is an infinite error. In the error arrays, NaN means unknown.
        for errors in (verdict.t_ulps, verdict.t_bounds, verdict.barycentric_error):
            errors[answered[np.isnan(errors[answered])]] = np.inf

        hit = hits.hit & ~broken
        category[hit & ~t_right] = WRONG_DISTANCE
        category[hit & ~may_hit] = FALSE_HIT
        category[hit & ~t_right & ~reference.hit] = FALSE_HIT
        category[broken] = FALSE_HIT
        # The remaining answers are right where the reference has the same triangle. Otherwise, a
        # hit is wrong if a triangle is certainly hit before it, and a miss is wrong if a triangle
        # is certainly hit at all.
        other = (category == RIGHT) & (hits.triangle != reference.triangle) & reference.hit & valid
        with np.errstate(invalid="ignore"):
            last = np.where(hits.hit, np.fmin(t_exact - t_bound, self.t_max), self.t_max)
        beaten = np.zeros(n, bool)
        rays = np.flatnonzero(other)
        beaten[rays] = self._certain_before(rays, last[rays], reference)
        category[beaten] = np.where(hits.hit[beaten], WRONG_TRIANGLE, LEAK)
        # The only right answer for an invalid ray (NaN, infinite, or with zero direction) is
        # INVALID.
        category[~valid & (hits.status != INVALID)] = FALSE_HIT
        category[(hits.status == UNFINISHED) | (hits.status == STACK_OVERFLOW)] = UNFINISHED_RAY
        for errors in (verdict.t_ulps, verdict.t_bounds, verdict.barycentric_error):
            errors[category == FALSE_HIT] = np.nan
        verdict.within_bound = (category == RIGHT) & (hits.triangle != reference.triangle)
        return verdict

    def _pairs(self, rays: np.ndarray, triangles: np.ndarray) -> PairBounds:
        return bound_pairs(self.vertices[triangles], self.origins[rays], self.directions[rays])

    def _certain(self, rays: np.ndarray, triangles: np.ndarray, last: np.ndarray) -> np.ndarray:
        """Return which pairs are certain hits whose t plus error bound is below ``last``; (k,)
        bool."""
        pair = self._pairs(rays, triangles)
        return (pair.inside & self.solid[triangles] & (pair.t - pair.t_bound >= self.t_min[rays])
                & (pair.t + pair.t_bound < last) & (pair.t + pair.t_bound <= self.t_max[rays]))

    def _certain_before(self, rays: np.ndarray, last: np.ndarray, reference: Hits) -> np.ndarray:
        """Return whether each ray certainly hits a triangle before ``last``, (k,) bool.

        Test the reference's triangle first. If a ray does not certainly hit this triangle, test
        all triangles that the exact ray meets before ``last``: they include every certain hit.

        Parameters
        ----------
        rays : (k,) int, indices of rays
        last : (k,) float, for each ray the t before which a certain hit counts
        """
        found = np.zeros(len(rays), bool)
        for part in _parts(np.arange(len(rays))):
            found[part] = self._certain(rays[part], reference.triangle[rays[part]], last[part])
        # If the reference's hit lies beyond `last`, no triangle is hit before `last`. The margin
        # covers the rounding errors of float64.
        with np.errstate(invalid="ignore"):
            near = reference.t[rays] - 2.0 ** -40 * np.abs(reference.t[rays]) <= last
        left = np.flatnonzero(~found & near)
        solid = np.flatnonzero(self.solid)
        if not len(left) or not len(solid):
            return found
        tree = ReferenceTree.of(self.vertices[solid])
        some = rays[left]
        for ray, triangle in tree.pairs(self.origins[some], self.directions[some],
                                        self.t_min[some], last[left]):
            for part in _parts(np.arange(len(ray))):
                one = left[ray[part]]
                certain = self._certain(rays[one], solid[triangle[part]], last[one])
                found[one[certain]] = True
        return found


def _parts(indices: np.ndarray) -> list[np.ndarray]:
    """Return the indices in parts of a bounded size."""
    return [indices[i:i + _PAIRS] for i in range(0, len(indices), _PAIRS)]
