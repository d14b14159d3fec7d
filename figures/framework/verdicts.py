"""Verdicts: rules that decide from numbers whether a figure came out as the survey prints it.

A group is a scene and a kind of rays, with the times of several methods.

* reproduced: The order agrees: tau-b (kendall.py) is at least HIGH in every group. The ratios
  agree: the median of `off_by` over the groups is less than FACTOR.
* reproduced in order, not in ratio: Only the order agrees.
* contradicted: The order differs.
* refuted by a counterexample: At most half of the judged claims hold, and no judged claim depends
  on a scene.
* too little to judge: There are fewer than LEAST_SCENES scored scenes or LEAST_PAIRS pairs of
  methods. Pairs whose published numbers tie do not count.

A claim in words is judged only if the measurements decide it. A figure with claims is reproduced
if every judged claim holds, mostly reproduced if more than half hold, and contradicted or refuted
otherwise. The scenes and pairs of a figure's claims are counted together. Claims on scenes need
LEAST_SCENES scenes and, if a claim compares methods, LEAST_PAIRS pairs. A claim about a method
itself, which depends on no scene, needs neither scenes nor pairs.

A stand-in replaces a scene whose mesh is missing, and is never scored. A `Verdict` holds a
separate verdict on the stand-ins.
"""
from __future__ import annotations

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple

from gpgpu_rt.report.verdict_words import (
    CONTRADICTED, MOSTLY, ORDER, REDRAWN, REFUTED, REPRODUCED, TOO_LITTLE, UNMEASURED
)
from gpgpu_rt.text_format import counted

from .kendall import PairCounts, pair_counts
from .output import number

HIGH, FACTOR = 0.8, 2.0        # orders agree if tau-b >= HIGH; ratios agree if off by < FACTOR
LEAST_SCENES, LEAST_PAIRS = 2, 4
MISSING = "the measurements that would decide are missing."
RENDERER = "By the same rules the verdict on the times of the present renderer"


@dataclass(frozen=True)
class Verdict:
    """A verdict's word, its reason with the deciding numbers, and the counts that it rests on.

    scenes : The scored scenes, each once.
    pairs : Number of pairs of methods compared on the scored scenes.
    agreed : Number of pairs in the published order. None for claims.
    claims : Number of claims that the measurements decide.
    held : Number of decided claims that hold.
    structure : Number of decided claims that depend on no scene.
    stand_ins : The verdict on the stand-ins by the same rules. Its `scenes` are the stand-ins.
    renderer : The verdict on the present renderer's times by the same rules, if this verdict is on
        the times predicted for the paper's card.
    """

    word: str
    why: str
    scenes: tuple[str, ...] = ()
    pairs: int = 0
    agreed: int | None = None
    claims: int = 0
    held: int = 0
    structure: int = 0
    stand_ins: Verdict | None = None
    renderer: Verdict | None = None

    @classmethod
    def from_json(cls, found: Any) -> Verdict | None:
        """Return the verdict from `dataclasses.asdict`'s output; None if the fields differ."""
        if not isinstance(found, dict) or set(found) != {one.name for one in fields(cls)}:
            return None
        return cls(**{**found, "scenes": tuple(found["scenes"]),
                      **{name: cls.from_json(found[name]) for name in ("stand_ins", "renderer")}})


@dataclass(frozen=True)
class MethodTimes:
    """Our times and the published times of the same methods, on one scene and kind of rays."""

    scene: str
    label: str      # the scene and the kind of rays, as the reason of a verdict names them
    ours: Sequence[float]
    theirs: Sequence[float]
    stand_in: bool = False


class Pair(NamedTuple):
    """Two methods that a claim compares on one scene and kind of rays."""

    scene: str
    rays: str
    one: str
    other: str


@dataclass(frozen=True)
class Claim:
    """A claim in words, and whether it holds.

    Attributes
    ----------
    says : The claim.
    holds : None if the measurements cannot decide.
    scenes : The scenes that were measured for the claim; empty if the claim depends on no scene.
    pairs : The pairs of measured methods that the claim compares.
    stand_in : Whether the scenes are stand-ins.
    """

    says: str
    holds: bool | None
    scenes: tuple[str, ...] = ()
    pairs: tuple[Pair, ...] = ()
    stand_in: bool = False


def off_by(ours: Sequence[float], theirs: Sequence[float]) -> float:
    """The factor by which our ratios between methods differ from the published ratios.

    2 ** m, where m is the median of |log2(our ratio / published ratio)| over all pairs of methods.
    Ratios do not depend on the machine's speed.
    """
    logs = [math.log2(a / b) for a, b in zip(ours, theirs)]
    apart = [abs(x - y) for at, x in enumerate(logs) for y in logs[:at]]
    return 2 ** statistics.median(apart) if apart else math.nan


def of_groups(groups: Iterable[MethodTimes]) -> Verdict:
    """The verdict on a table of times; groups with fewer than two methods are left out."""
    compared = [group for group in groups if len(group.ours) > 1]
    return _beside_stand_ins(_of_groups([g for g in compared if not g.stand_in]),
                             _of_groups([g for g in compared if g.stand_in]))


def of_claims(claims: Iterable[Claim], exceptions: Sequence[str] = ()) -> Verdict:
    """The verdict on claims in words.

    The reason ends with ``exceptions``: sentences on measured scenes that cannot test the claims.
    """
    found = list(claims)
    said = _beside_stand_ins(_of_claims([c for c in found if not c.stand_in]),
                             _of_claims([c for c in found if c.stand_in]))
    if not found and exceptions:
        said = Verdict(TOO_LITTLE, "no measured scene can show whether the claims hold.")
    return replace(said, why=" ".join((said.why, *exceptions)))


def word_of_claims(held: int, claims: int) -> str:
    """Return the verdict's word if ``held`` of ``claims`` claims hold and the scenes suffice."""
    return REPRODUCED if held == claims else MOSTLY if 2 * held > claims else CONTRADICTED


def _beside_stand_ins(scored: Verdict, stand_ins: Verdict) -> Verdict:
    if stand_ins.word == UNMEASURED:
        return scored
    if scored.word == UNMEASURED:
        scored = Verdict(TOO_LITTLE, "all scenes that could be judged are stand-ins.")
    return replace(scored, stand_ins=stand_ins)


def _of_groups(groups: Sequence[MethodTimes]) -> Verdict:
    if not groups:
        return Verdict(UNMEASURED, MISSING)
    counts = [(group, pair_counts(group.ours, group.theirs)) for group in groups]
    ordered = [(group, count) for group, count in counts if count.ordered]
    scenes = tuple(dict.fromkeys(group.scene for group, _ in ordered))
    pairs = sum(count.ordered for _, count in ordered)
    agreed = sum(count.concordant for _, count in ordered)
    few = _too_few(scenes, pairs)
    factor = statistics.median(off_by(group.ours, group.theirs)
                               for group, _ in ordered or counts)
    low = [f"{group.label} {number(count.tau_b, 2)}" for group, count in ordered
           if not count.tau_b >= HIGH]     # tau-b is nan if all of our times tie
    why = [*([few] if few else []), *([_order(ordered, low, agreed, pairs)] if ordered else []),
           f"ratios between methods are off by a factor of {number(factor)} in the median",
           *_ties([group for group, count in counts if not count.ordered])]
    word = (TOO_LITTLE if few else CONTRADICTED if low
            else REPRODUCED if factor < FACTOR else ORDER)
    return Verdict(word, "; ".join(why) + ".", scenes, pairs, agreed)


def _order(ordered: Sequence[tuple[MethodTimes, PairCounts]], low: Sequence[str], agreed: int,
           pairs: int) -> str:
    return (f"tau-b is {HIGH:g} or more in {len(ordered) - len(low)} of "
            f"{counted(len(ordered), 'group')}" + (f" (below: {', '.join(low)})" if low else "")
            + f"; {agreed} of {counted(pairs, 'pair')} of methods have the published order")


def _ties(tied: Sequence[MethodTimes]) -> list[str]:
    return [] if not tied else ["no order can be reproduced in groups whose published numbers "
                                f"all tie: {', '.join(group.label for group in tied)}"]


def _too_few(scenes: Sequence[str], pairs: int | None) -> str:
    """Why the scenes and pairs are too few for a verdict, or "" if they are enough.

    ``pairs`` is None if no pairs are needed.
    """
    if len(scenes) >= LEAST_SCENES and (pairs is None or pairs >= LEAST_PAIRS):
        return ""
    needed, there = counted(LEAST_SCENES, "scene"), counted(len(scenes), "scene")
    if pairs is not None:
        needed += f" and {counted(LEAST_PAIRS, 'pair')} of methods"
        there += f" and {counted(pairs, 'pair')}"
    return f"a verdict needs {needed}, not {there}"


def _of_claims(claims: Sequence[Claim]) -> Verdict:
    if not claims:
        return Verdict(UNMEASURED, MISSING)
    on_scenes = [claim for claim in claims if claim.scenes]
    scenes = tuple(dict.fromkeys(scene for claim in on_scenes for scene in claim.scenes))
    pairs = len({pair for claim in on_scenes for pair in claim.pairs})
    few = _too_few(scenes, pairs if pairs else None) if on_scenes else ""
    answered = [claim for claim in claims if claim.holds is not None]
    judged = [claim for claim in answered if not (few and claim.scenes)]
    held = sum(claim.holds is True for claim in answered)
    why = [*([few] if few else []),
           (f"{held} of {counted(len(answered), 'claim')} "
            f"{'holds' if len(answered) == 1 else 'hold'}: " if answered
            else "the measurements decide no claim: ")
           + "; ".join(f"{claim.says} ({_answer(claim.holds)})" for claim in claims)]
    word = TOO_LITTLE if not judged else word_of_claims(
        sum(claim.holds is True for claim in judged), len(judged))
    if word == CONTRADICTED and not any(claim.scenes for claim in judged):
        word = REFUTED
    return Verdict(word, "; ".join(why) + ".", scenes, pairs, claims=len(answered), held=held,
                   structure=sum(not claim.scenes for claim in answered))


def _answer(holds: bool | None) -> str:
    return "not decided" if holds is None else "yes" if holds else "no"


def rests_on(verdict: Verdict) -> str:
    """A clause that counts the scored scenes, the pairs of methods, and the claims that depend on
    no scene."""
    if verdict.word == REDRAWN:
        return "no number of the survey"
    parts = []
    if verdict.structure:
        parts.append(f"{counted(verdict.structure, 'claim')} about a method itself, not about a "
                     "scene")
    if verdict.scenes or not parts:
        parts.append(_counts(verdict, "scored scene"))
    return "; ".join(parts)


def stand_ins_say(verdict: Verdict) -> str:
    """A sentence on the stand-ins' verdict, or "" without stand-ins."""
    aside = verdict.stand_ins
    if aside is None:
        return ""
    return ("Stand-ins are never scored. By the same rules the verdict on "
            f"{_counts(aside, 'stand-in')} would be \"{aside.word}\": {aside.why}")


def on_card(card: str, said: Verdict, here: Verdict) -> Verdict:
    """The verdict on times predicted for a card, with the verdict on the times measured here."""
    if said.word == UNMEASURED and here.word != UNMEASURED:
        said = Verdict(TOO_LITTLE, "no scored scene has two methods with a predicted time.")
    return replace(said, why=f"Times predicted for the {card}: {said.why}", renderer=here)


def renderer_says(verdict: Verdict) -> str:
    """A sentence about the verdict on the times measured here, or "" without such a verdict."""
    here = verdict.renderer
    if here is None:
        return ""
    return " ".join(filter(None, (
        f"{RENDERER} is \"{here.word}\": {here.why} It rests on {rests_on(here)}.",
        "" if here.stand_ins is None else "On the renderer's times the verdict on "
        f"{_counts(here.stand_ins, 'stand-in')} would be \"{here.stand_ins.word}\": "
        f"{here.stand_ins.why}")))


def _counts(verdict: Verdict, scene: str) -> str:
    names = f" ({', '.join(verdict.scenes)})" if verdict.scenes else ""
    none = verdict.scenes and verdict.agreed is None and not verdict.pairs
    return (f"{counted(len(verdict.scenes), scene)}{names} and {counted(verdict.pairs, 'pair')} "
            "of methods" + (" (the claims compare none)" if none else ""))


DIAGRAM = Verdict(REDRAWN, "a diagram or a picture, drawn from this program's passes and tables; "
                  "the survey's figure has no numbers.")
