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
    max_t_error : Limit for the ``t_quantile`` quantile of the relative error of t over the right
        hits. The upper 95 % confidence bound of this quantile must keep the limit.
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
        """Return the searches of `tune`: name -> (bounds, kind of rays for timing; None for all
        kinds).

        If ``kinds`` contains eye rays and random rays, the result has two entries: ``COHERENT``,
        timed on eye rays, and ``INCOHERENT``, timed on random rays. Both entries include rays
        aimed at vertices and edges. Otherwise the result has a single entry ``ALL``, timed on all
        kinds. A bound on bytes also gives the single entry, because two methods would hold two
        structures in memory.
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
        # With too few rays, the upper confidence bound of the error is infinite. Then report the
        # lower confidence bound, if this bound also exceeds the promised bound.
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
    """Return the ranks of the two errors that bound a quantile, from above and from below.

    A rank is a position in the measured errors, sorted in descending order. Both results have 95 %
    confidence. ``above`` is the largest rank whose error at most ``share`` of all possible rays
    exceed; -1 if there is none. ``below`` is the smallest rank whose error at least ``share`` of
    all possible rays reach or exceed; ``count`` if there is none.
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
