"""Error targets: bounds that a tuned tracer must keep, and by how much a candidate (a method with
options) exceeds them."""
from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from ..errors import OptionError
from ..methods.choices import COHERENT, INCOHERENT
from .confidence import LEVEL, lower_confidence, rays_needed
from .judge import upper_confidence
from .known_rays import KINDS, Answers, Score, check_kinds

MOST_RAYS = 1 << 23
ALL = "all"
OWN_KIND = {COHERENT: "eye", INCOHERENT: "random"}    # candidates are timed on these rays


@dataclass(frozen=True)
class Promise:
    """The bounds that a tracer must keep, on rays of all ``kinds`` in equal shares.

    Attributes
    ----------
    max_wrong : Limit for the share of rays with a wrong hit or miss. The upper 95 % confidence
        bound of the measured share must keep this limit.
    max_t_error : Limit for the relative error of t. With 95 % confidence, at least a share
        ``t_quantile`` of the hits with a right triangle keeps this limit.
    max_bytes : Bound on texture bytes with 2^18 rays in flight, as in a 512 x 512 picture; None
        for no bound.
    """

    max_wrong: float
    max_t_error: float
    max_bytes: int | None = None
    t_quantile: float = 0.999
    kinds: tuple[str, ...] = KINDS

    def __post_init__(self) -> None:
        check_kinds(self.kinds)
        for name in ("max_wrong", "t_quantile"):
            if not 0 < getattr(self, name) < 1:
                raise OptionError(f"{name} is {getattr(self, name):g}; give a share between 0 "
                                  "and 1")
        if not self.max_t_error > 0:
            raise OptionError(f"max_t_error is {self.max_t_error:g}; give a number above 0")
        if self.max_bytes is not None and self.max_bytes < 1:
            raise OptionError(f"max_bytes is {self.max_bytes}; give a number above 0")
        if self.rays_needed() > MOST_RAYS:
            raise OptionError(
                f"a share of {self.max_wrong:g} wrong rays and a t quantile of "
                f"{self.t_quantile:g} need {self.rays_needed():,} rays for a proof, more than the "
                f"limit of {MOST_RAYS:,}; give a share of at least {3 / MOST_RAYS:.2g}, and a "
                f"quantile of at most 1 - {3 / MOST_RAYS:.2g}")

    def rays_needed(self, hit_share: float = 1.0) -> int:
        """Return the least number of rays that prove the bounds if no ray has an error.

        hit_share : the share of rays that hit a triangle; other rays have no t to compare
        """
        for_t = rays_needed(1 - self.t_quantile) / max(hit_share, 1e-3)
        return max(rays_needed(self.max_wrong), math.ceil(for_t))

    def split(self) -> dict[str, tuple[Promise, str | None]]:
        """Return the searches of `tune` by name: the bounds, and the kind of rays to time, or None
        for all kinds.

        If ``kinds`` contains eye rays and random rays, there are two searches: ``COHERENT``, timed
        on eye rays, and ``INCOHERENT``, timed on random rays. Both include rays aimed at vertices
        and edges. Otherwise a single search ``ALL`` is timed on all kinds. A bound on bytes also
        gives a single search, because two methods would hold two structures in memory.
        """
        if self.max_bytes is not None or not set(OWN_KIND.values()) <= set(self.kinds):
            return {ALL: (self, None)}
        return {rays: (replace(self, kinds=tuple(kind for kind in self.kinds if kind == own
                                                 or kind not in OWN_KIND.values())), own)
                for rays, own in OWN_KIND.items()}

    def to_dict(self) -> dict[str, Any]:
        return {**asdict(self), "kinds": list(self.kinds), "confidence": LEVEL,
                "t_decided_by": f"{self.t_quantile:g} quantile, at its upper confidence bound"}


@dataclass
class Finding:
    """The errors of a candidate on known rays, to compare with a promise.

    Attributes
    ----------
    score : Score
    t_error : relative error of t at the upper confidence bound of the quantile; inf if there are
        too few rays for this bound
    t_lower : relative error of t at the lower confidence bound of the quantile
    """

    score: Score
    t_error: float
    t_lower: float

    @classmethod
    def of(cls, answers: Answers, quantile: float) -> Finding:
        errors = np.sort(answers.t_error[~np.isnan(answers.t_error)])[::-1]
        above, below = _ranks(len(errors), 1 - quantile)
        return cls(answers.score(), float(errors[above]) if above >= 0 else math.inf,
                   float(errors[below]) if below < len(errors) else 0.0)

    def misses(self, promise: Promise, texture_bytes: int) -> dict[str, float]:
        """Return, for each bound that is not kept, the value divided by the bound."""
        # With too few rays, t_error is infinite. Report the finite t_lower instead if it also
        # exceeds the limit.
        t_error = self.t_error
        if math.isinf(t_error) and self.t_lower > promise.max_t_error:
            t_error = self.t_lower
        ratios = {"wrong": self.score.upper_95 / promise.max_wrong,
                  "t error": t_error / promise.max_t_error}
        if promise.max_bytes is not None:
            ratios["bytes"] = texture_bytes / promise.max_bytes
        return {name: ratio for name, ratio in ratios.items() if ratio > 1}

    def is_hopeless(self, promise: Promise) -> bool:
        """Return whether the errors already disprove the bounds. A disproof needs fewer rays than
        a proof."""
        return (lower_confidence(self.score.wrong, self.score.rays) > promise.max_wrong
                or self.t_lower > promise.max_t_error)


def _ranks(count: int, share: float) -> tuple[int, int]:
    """Return the ranks of two errors: an upper and a lower bound of a quantile, each with 95 %
    confidence.

    A rank is a position in the measured errors, sorted in descending order. At most ``share`` of
    all possible rays have a larger error than the error at ``above``, the largest such rank; -1
    if there is none. At least ``share`` of all possible rays have the error at ``below`` or a
    larger error. ``below`` is the smallest such rank; ``count`` if there is none.
    """
    end = min(count, 100 + int(3 * share * count))     # both ranks are near share * count
    above, high = -1, end
    while high - above > 1:
        middle = (above + high) // 2
        if upper_confidence(middle, count) <= share:
            above = middle
        else:
            high = middle
    below, low = end, 0
    while below > low:
        middle = (below + low) // 2
        if lower_confidence(middle + 1, count) >= share:
            below = middle
        else:
            low = middle + 1
    return above, below if below < end else count
