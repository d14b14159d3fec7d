"""Verdicts: rules that decide from numbers whether a figure came out as the survey prints it.

* reproduced: the order and the ratios agree. The order agrees if tau-b of every scored group is at
  least HIGH. The ratios agree if they are off by less than FACTOR in the median.
* reproduced in order, not in ratio: only the order agrees.
* contradicted: the order differs, whatever the ratios are.

A claim in words has neither order nor ratio. A figure that makes claims is reproduced if every
claim holds, mostly reproduced if more than half hold, and contradicted otherwise.
"""
from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from .kendall import tau_b
from .output import number

REPRODUCED = "reproduced"
ORDER = "reproduced in order, not in ratio"
MOSTLY = "mostly reproduced"   # for claims in words
CONTRADICTED = "contradicted"
REDRAWN = "redrawn"            # a diagram or a picture: the survey prints nothing to score
UNSCORED = "not scored"        # measured, but the published numbers tie and have no order
UNMEASURED = "not measured"
WORDS = (REPRODUCED, ORDER, MOSTLY, CONTRADICTED, REDRAWN, UNSCORED, UNMEASURED)
HIGH, FACTOR = 0.8, 2.0        # the lowest tau-b of equal orders; ratios must be off by less


@dataclass(frozen=True)
class Verdict:
    """One of WORDS, and the reason, with the numbers that decided."""

    word: str
    why: str


def off_by(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """The factor by which our ratios between methods differ from the published ratios.

    It is the median over all pairs of methods of |log2(our ratio / published ratio)|, as a factor.
    A ratio does not depend on the speed of the machine.
    """
    logs = [math.log2(a / b) for a, b in zip(ours, theirs)]
    apart = [abs(x - y) for at, x in enumerate(logs) for y in logs[:at]]
    return 2 ** statistics.median(apart) if apart else math.nan


def of_groups(groups: Mapping[str, tuple[Sequence[float], Sequence[float]]],
              stand_ins: Iterable[str] = ()) -> Verdict:
    """The verdict on a table of times.

    Parameters
    ----------
    groups : our times and the published times of each scene and kind of rays
    stand_ins : groups that are shown but not scored, because their scenes are stand-ins
    """
    left_out = set(stand_ins)
    real = {name: (tau_b(*pair), off_by(*pair)) for name, pair in groups.items()
            if name not in left_out and len(pair[0]) > 1}
    scored = {name: pair for name, pair in real.items() if pair[0] == pair[0]}
    if real and not scored:
        factor = statistics.median(off for _, off in real.values())
        return Verdict(UNSCORED, f"the published times of {', '.join(real)} tie, so there is no "
                       "order to reproduce (stand-ins are not scored); ratios are off by a "
                       f"factor of {number(factor)} in the median.")
    if not scored:
        return Verdict(UNMEASURED, "all measured scenes are stand-ins"
                       if groups else "none of its cells is measured")
    low = [f"{name} {number(tau, 2)}" for name, (tau, _) in scored.items() if tau < HIGH]
    factor = statistics.median(off for _, off in scored.values())
    right = len(scored) - len(low)
    why = (f"tau-b is {HIGH:g} or more in {right} of {len(scored)} scored groups"
           + (f" (below: {', '.join(low)})" if low else "")
           + f"; ratios between methods are off by a factor of {number(factor)} in the median"
           + (f"; stand-ins left out: {', '.join(sorted(left_out & set(groups)))}"
              if left_out & set(groups) else ""))
    word = CONTRADICTED if low else REPRODUCED if factor < FACTOR else ORDER
    return Verdict(word, why + ".")


def of_claims(claims: Mapping[str, bool]) -> Verdict:
    """The verdict on claims, given whether each holds."""
    if not claims:
        return Verdict(UNMEASURED, "none of its cells is measured")
    failed = [claim for claim, holds in claims.items() if not holds]
    why = f"{len(claims) - len(failed)} of {len(claims)} claims hold: " + "; ".join(
        f"{claim} ({'yes' if holds else 'no'})" for claim, holds in claims.items()) + "."
    if not failed:
        return Verdict(REPRODUCED, why)
    return Verdict(MOSTLY if 2 * len(failed) < len(claims) else CONTRADICTED, why)


DIAGRAM = Verdict(REDRAWN, "A diagram or a picture, drawn from this program's passes and tables; "
                  "the survey prints no numbers in it.")
