"""Verdict words: the words of the verdicts on the survey's figures, and their outcomes."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..text_format import counted

REPRODUCED = "reproduced"
ORDER = "reproduced in order, not in ratio"
MOSTLY = "mostly reproduced"   # only for claims that the survey makes in words
CONTRADICTED = "contradicted"
REFUTED = "refuted by a counterexample"    # for claims about a method itself
TOO_LITTLE = "too little to judge"
REDRAWN = "redrawn"            # a diagram or a picture: the survey prints nothing to score
UNMEASURED = "not measured"
WORDS = (REPRODUCED, ORDER, MOSTLY, CONTRADICTED, REFUTED, TOO_LITTLE, REDRAWN, UNMEASURED)


@dataclass(frozen=True)
class Outcome:
    """Verdicts that mean the same for a reader.

    Attributes
    ----------
    words : the words of these verdicts
    paper, ink : colours of a badge and of its text; "confirmed" and "contradicted" differ also in
        lightness, for colour-blind readers
    """

    name: str
    words: tuple[str, ...]
    paper: str
    ink: str


OUTCOMES = (Outcome("confirmed", (REPRODUCED,), "#0b5394", "#ffffff"),
            Outcome("confirmed in part", (ORDER, MOSTLY), "#cfe2f3", "#0b2c4d"),
            Outcome("contradicted", (CONTRADICTED, REFUTED), "#f6b26b", "#3d1f00"),
            Outcome("not judged", (TOO_LITTLE, REDRAWN, UNMEASURED), "#e6e6ea", "#33333b"))


def outcome_of(word: str) -> Outcome:
    """Return the outcome of a verdict's word; the last outcome for an unknown word."""
    return next((one for one in OUTCOMES if word in one.words), OUTCOMES[-1])


def score(verdict: Mapping[str, Any]) -> str:
    """Return a clause such as "3 of 4 claims, on 2 scenes"; "" if nothing was compared.

    Count the claims, or else the pairs of methods, that agree with the survey.

    Parameters
    ----------
    verdict : the fields of a verdict in a figure's JSON file
    """
    scenes = f", on {counted(len(verdict['scenes']), 'scene')}"
    if verdict["claims"]:
        says = f"{verdict['held']} of {counted(verdict['claims'], 'claim')}"
        return says + (", none of which depends on a scene"
                       if verdict["structure"] == verdict["claims"] else scenes)
    if not verdict["pairs"]:
        return ""
    return (f"{verdict['agreed']} of {counted(verdict['pairs'], 'pair')} of methods in the "
            f"published order{scenes}")
