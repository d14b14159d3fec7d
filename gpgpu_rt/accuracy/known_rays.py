"""Known rays: random rays whose hits the float64 reference knows, to score a tracer's answers."""
from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from .. import reference
from ..errors import OptionError, nearest_names
from ..hits import Hits
from ..numerics.error_bounds import PairBounds, bound_pairs
from ..rays import ray_sets
from ..reference.acceptance import turned
from ..scene.scene import Scene
from ..tracer import Tracer
from .judge import CATEGORIES, RIGHT, WRONG_DISTANCE, judge, upper_confidence

KINDS = ("eye", "random", "vertices", "edges")
# The categories of wrong hits and misses. Errors of t ("wrong distance") have their own bound.
WRONG = ("leak", "false hit", "wrong triangle", "unfinished")
WITHIN_BOUND = "within bound"
FLIGHT = 1 << 18          # largest number of rays per call, as in a 512 x 512 picture
UNIT_ROUNDOFF = 2.0 ** -24
# `KnownRays._through_the_surface` traces a ring of rays around each ray that may have leaked.
# RINGS are the numbers of rays in a ring. The surface may have a gap between two rays of a small
# ring, which then reports a false leak. So larger rings test suspected rays again, if at most FEW
# rays are suspected. Among more suspected rays, a few false leaks do not matter.
RINGS = (8, 32, 256)
FEW = 200


@dataclass
class Score:
    """The errors of answers against the reference.

    Attributes
    ----------
    rays, hits : Number of judged rays, and number of hits with a right triangle, whose t can be
        compared.
    wrong : Number of rays with a wrong hit or miss.
    wrong_share, upper_95 : The share of wrong rays, and its upper 95 % confidence bound.
    counts : Number of rays by category. In the category "wrong distance", which does not count as
        wrong, the error of t exceeds its float32 error bound. In the category "within bound", the
        answer differs from the reference within float32's error bounds.
    t_ulps : The "median", "99.9 %" and "max" of the error of t in float32 ulps, over all hits with
        a right triangle. None without such hits.
    t_error, barycentric : The same three numbers for the relative error of t, and for the larger
        of the errors of u and v.
    """

    rays: int
    hits: int
    wrong: int
    wrong_share: float
    upper_95: float
    counts: dict[str, int]
    t_ulps: dict[str, float] | None
    t_error: dict[str, float] | None
    barycentric: dict[str, float] | None

    def to_dict(self) -> dict[str, Any]:
        return asdict(self)


@dataclass
class Answers:
    """Judged answers, an entry per ray.

    Attributes
    ----------
    categories : for each name of ``Score.counts``, the rays of the category, (n,) bool
    t_ulps, t_error, barycentric : (n,) float64, as in ``Score``; NaN where t is not compared
    """

    categories: dict[str, np.ndarray]
    t_ulps: np.ndarray
    t_error: np.ndarray
    barycentric: np.ndarray

    @property
    def wrong(self) -> np.ndarray:
        """(n,) bool, true for a wrong hit or miss."""
        return np.logical_or.reduce([self.categories[name] for name in WRONG])

    def over(self, bound: float) -> tuple[int, int]:
        """Return how many rays have a relative error of t above ``bound``, and for how many rays t
        is compared."""
        compared = ~np.isnan(self.t_error)
        return int((self.t_error[compared] > bound).sum()), int(compared.sum())

    def score(self, part: slice = slice(None)) -> Score:
        """Return the score of all rays, or of a part of them."""
        wrong, rays = int(self.wrong[part].sum()), len(self.t_error[part])
        return Score(rays, int((~np.isnan(self.t_error[part])).sum()), wrong,
                     wrong / max(rays, 1), upper_confidence(wrong, rays),
                     {name: int(mask[part].sum()) for name, mask in self.categories.items()},
                     *(_quantiles(values[part])
                       for values in (self.t_ulps, self.t_error, self.barycentric)))


class KnownRays:
    """Rays of several kinds in equal shares, and their hits as the float64 reference finds them.

    Parameters
    ----------
    scene : Scene
    count : number of rays of all kinds together
    seed : seed of all rays, including eye rays
    kinds : names from ``KINDS``

    Attributes
    ----------
    origins, directions : (count, 3) float32
    truth : Hits in float64, computed at the first use.
    shape : The image's (h, w) if all rays are eye rays and fill a square of at most FLIGHT
        pixels. Otherwise None.
    parts : The slice of the rays of each kind.
    """

    def __init__(self, scene: Scene, count: int, seed: int,
                 kinds: Sequence[str] = KINDS) -> None:
        check_kinds(kinds)
        self.scene, self.seed = scene, seed
        seeds = np.random.SeedSequence(seed).generate_state(len(KINDS))
        ends = np.linspace(0, count, len(kinds) + 1).astype(int)
        self.parts = {kind: slice(int(a), int(b))
                      for kind, a, b in zip(kinds, ends[:-1], ends[1:])}
        drawn = [_draw(scene, kind, part.stop - part.start, int(seeds[KINDS.index(kind)]))
                 for kind, part in self.parts.items()]
        self.origins, self.directions = (np.concatenate(arrays) for arrays in zip(*drawn))
        side = math.isqrt(count)
        alone = tuple(kinds) == ("eye",) and side * side == count <= FLIGHT
        self.shape = (side, side) if alone else None

    @functools.cached_property
    def truth(self) -> Hits:
        return reference.trace(self.scene, self.origins, self.directions, accelerated=True)

    def __len__(self) -> int:
        return len(self.origins)

    def trace(self, tracer: Tracer, part: slice = slice(None)) -> tuple[Hits, float]:
        """Return the tracer's hits, and the time of its passes in seconds."""
        origins, directions = self.origins[part], self.directions[part]
        shape = self.shape if len(origins) == len(self) else None
        hits, seconds = [], 0.0
        for start in range(0, len(origins), FLIGHT):
            flight = slice(start, start + FLIGHT)
            hits.append(tracer.trace(origins[flight], directions[flight], shape=shape))
            seconds += tracer.statistics.trace_seconds
        names = ("t", "u", "v", "triangle", "status")
        return Hits(*(np.concatenate([getattr(h, name) for h in hits])
                      for name in names)), seconds

    def most_steps(self, method: str, options: Mapping[str, Any]) -> int:
        """Return the largest number of kernel runs of any ray."""
        with Tracer(self.scene, method, **{**options, "statistics": True}) as tracer:
            steps = tracer.trace(self.origins, self.directions).steps
        assert steps is not None
        return int(steps.max(initial=1))

    def judge(self, hits: Hits) -> Answers:
        """Judge the hits of all rays against the truth."""
        truth = self.truth
        verdict = judge(self.scene, self.origins, self.directions, hits, reference=truth)
        category, excused = verdict.category.copy(), verdict.within_bound.copy()
        # Some answers have a wrong distance and a triangle other than the truth's. Judge these
        # answers again with the exact distance of their triangles: the new category then depends
        # only on the triangle.
        other = np.flatnonzero((category == WRONG_DISTANCE) & (hits.triangle != truth.triangle))
        category[other] = self._choice(hits, other)
        excused[other] = category[other] == RIGHT
        past = self._through_the_surface(hits, excused)
        categories = {name: category == i for i, name in enumerate(CATEGORIES) if i != RIGHT}
        categories["leak"] |= past
        categories["wrong distance"] = verdict.category == WRONG_DISTANCE
        categories[WITHIN_BOUND] = excused & ~past
        # Compare the t of an excused answer with the exact t of its own triangle.
        own = np.flatnonzero(excused & ~past & hits.hit)
        exact = truth.t.copy()
        exact[own] = self._pairs(own, hits.triangle[own]).t
        compared = (hits.triangle == truth.triangle) & truth.hit
        compared[own] = True
        with np.errstate(invalid="ignore", divide="ignore"):
            error = np.abs(hits.t.astype(np.float64) - exact)
            t_error = np.where(error == 0, 0.0, error / exact)
        return Answers(categories, *(np.where(compared, values, np.nan) for values in (
            verdict.t_ulps, t_error, verdict.barycentric_error)))

    def _pairs(self, rays: np.ndarray, triangles: np.ndarray) -> PairBounds:
        return bound_pairs(*(a.astype(np.float64) for a in (
            self.scene.triangles[triangles], self.origins[rays], self.directions[rays])))

    def _choice(self, hits: Hits, rays: np.ndarray) -> np.ndarray:
        """Return the categories, (k,), that the answers of ``rays`` would have with the exact t of
        their triangles."""
        corrected = _part(hits, rays)
        corrected.t = self._pairs(rays, corrected.triangle).t
        return judge(self.scene, self.origins[rays], self.directions[rays], corrected,
                     reference=_part(self.truth, rays)).category

    def _through_the_surface(self, hits: Hits, excused: np.ndarray) -> np.ndarray:
        """Return which rays passed through an edge of a closed surface, (n,) bool.

        If a ray is aimed at an edge, rounding decides which of the edge's two triangles the ray
        hits. But a ray that misses both triangles is a leak, unless the edge is a silhouette edge.
        To decide, trace a ring of rays around the ray: the answer is a leak if all rays of the
        ring hit nearer than the answer.

        The ring must be wider than the rounding errors of float32. The watertight test shears the
        vertices; a sheared coordinate is the difference of two terms. The shear's slopes are at
        most 1, so each term is at most M, the largest |vertex - origin|. A term has at most 5
        roundings, and the edge functions add 3. So the error across the ray is below 2 (5 + 3) u
        M, where u is the unit roundoff. The radius of the ring is twice this bound.
        """
        past = np.zeros(len(hits), bool)
        left = np.flatnonzero(self.truth.hit & (hits.triangle != self.truth.triangle)
                              & (hits.t > self.truth.t) & excused)
        corners = self.scene.triangles[self.truth.triangle[left]].astype(np.float64)
        origins, directions = (a.astype(np.float64) for a in (self.origins, self.directions))
        reach = np.abs(corners - origins[left, None]).max(axis=(1, 2))
        length = np.linalg.norm(directions[left], axis=1)
        # Rounding can make the answer's t too large: subtract a bound of the error.
        nearest = hits.t[left] - 64 * UNIT_ROUNDOFF * reach / length
        with np.errstate(divide="ignore"):
            width = 32 * UNIT_ROUNDOFF * reach / (self.truth.t[left] * length)
        # Where the origin nearly touches the surface, the ring is too wide to prove a leak.
        usable = (self.truth.t[left] < nearest) & (width < 1e-2)
        left, nearest, width = left[usable], nearest[usable], width[usable]
        for ring in RINGS:
            if len(left) > FEW and ring != RINGS[0]:
                break
            # Trace two opposite rays first: at a silhouette edge, one of them usually misses.
            for turns in (np.arange(2) / 2, np.arange(ring) / ring):
                if not len(left):
                    return past
                around = np.concatenate([turned(directions[left], width, turn + 0.01)
                                         for turn in turns])
                t = reference.trace(self.scene, np.tile(origins[left], (len(turns), 1)), around,
                                    accelerated=True).t
                stays = t.reshape(len(turns), -1).max(axis=0) < nearest
                left, nearest, width = left[stays], nearest[stays], width[stays]
        past[left] = True
        return past


def _part(hits: Hits, rays: np.ndarray) -> Hits:
    return Hits(hits.t[rays], hits.u[rays], hits.v[rays], hits.triangle[rays], hits.status[rays])


def check_kinds(kinds: Sequence[str]) -> None:
    """Raise OptionError unless ``kinds`` is a list of different names from KINDS."""
    if isinstance(kinds, str) or not isinstance(kinds, Sequence):
        raise OptionError(f"kinds is {kinds!r}; give a list of names from {', '.join(KINDS)}")
    for kind in kinds:
        if not isinstance(kind, str) or kind not in KINDS:
            raise OptionError(f"no rays of kind {kind!r}{nearest_names(kind, KINDS)}")
    if not kinds or len(set(kinds)) < len(kinds):
        raise OptionError("give at least one kind of rays, and each kind only once")


def bytes_in_flight(tracer: Tracer, rays: int = FLIGHT) -> int:
    """Estimate the texture bytes for ``rays`` rays in flight by scaling the tracer's last call."""
    tables = sum(tracer.statistics.table_bytes.values())
    texels = max(1, tracer.statistics.rays)
    return tables + round((tracer.statistics.texture_bytes - tables) * rays / texels)


def _draw(scene: Scene, kind: str, count: int, seed: int) -> ray_sets.Rays:
    if kind == "eye":
        return _jittered_eye_rays(scene, count, seed)
    if kind == "random":
        return ray_sets.random_rays(scene, count, seed)
    return ray_sets.aimed_rays(scene, count, seed, at=kind)


def _jittered_eye_rays(scene: Scene, count: int, seed: int) -> ray_sets.Rays:
    """Return camera rays at a random position in each pixel, row by row from the top."""
    rng = np.random.default_rng(seed)
    width = max(1, int(np.sqrt(count)))
    height = max(1, -(-count // width))
    right, up, forward = scene.camera.basis((width, height))
    row, column = np.divmod(np.arange(count), width)
    x = 2 * (column + rng.random(count)) / width - 1
    y = 1 - 2 * (row + rng.random(count)) / height
    directions = forward + x[:, None] * right + y[:, None] * up
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = np.broadcast_to(np.asarray(scene.camera.eye, np.float32), (count, 3))
    return origins.copy(), directions.astype(np.float32)


def _quantiles(values: np.ndarray) -> dict[str, float] | None:
    known = values[~np.isnan(values)]
    if not len(known):
        return None
    median, high = np.quantile(known, (0.5, 0.999), method="higher")
    return {"median": float(median), "99.9 %": float(high), "max": float(known.max())}
