"""Verdict badges: HTML that says which results of the survey are confirmed or contradicted."""
from __future__ import annotations

import html
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..disk.files import read_json
from ..text_format import counted
from .verdict_words import OUTCOMES, Outcome, outcome_of, score

BADGE_STYLE = (".badge { display: inline-block; padding: .05rem .55rem; border-radius: .7rem; "
               "font-size: .85rem; white-space: nowrap }")


@dataclass(frozen=True)
class JudgedFigure:
    """A figure of the survey with its verdict.

    Attributes
    ----------
    verdict : the fields of the verdict in the figure's JSON file
    """

    name: str
    title: str
    verdict: dict[str, Any]

    @property
    def outcome(self) -> Outcome:
        return outcome_of(self.verdict["word"])

    def says(self) -> str:
        """Return a clause with the counts behind the verdict; "" without counts."""
        aside = self.verdict["stand_ins"]
        return "; ".join(filter(None, (
            score(self.verdict),
            f'with stand-in scenes the verdict would be "{aside["word"]}" ({score(aside)})'
            if aside else "")))


def judged_figure(name: str, title: str, folder: Path) -> JudgedFigure | None:
    """Return a figure with its verdict from the file NAME.json; None if there is no verdict."""
    try:
        found = JudgedFigure(name, title, read_json(folder / f"{name}.json")["verdict"])
        found.says()
        badge(found.verdict["word"])
        return found
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None     # there is no such file, or another version of the project wrote it


def badge(word: str, text: str | None = None) -> str:
    """Return a badge in the colours of a verdict's outcome. It shows ``text``, by default the
    verdict's word."""
    outcome = outcome_of(word)
    return (f'<span class="badge" style="background:{outcome.paper};color:{outcome.ink}">'
            f"{html.escape(text or word)}</span>")


def verdict_line(one: JudgedFigure) -> str:
    """Return the badge of a figure's verdict, and the counts behind the verdict."""
    says = one.says()
    return (f'<p class="verdict">{badge(one.verdict["word"])}'
            + (f" {html.escape(says)}" if says else "") + "</p>")


def overview(figures: Iterable[JudgedFigure]) -> str:
    """Return the section that counts the figures of each outcome and links to the figures."""
    every = list(figures)
    parts, counts = [], []
    for outcome in OUTCOMES:
        some = [one for one in every if one.outcome is outcome]
        counts.append(badge(outcome.words[0], f"{len(some)} {outcome.name}"))
        if some:
            parts.append(f"<h3>{badge(outcome.words[0], outcome.name)} "
                         f"{counted(len(some), 'figure')}</h3><ul>"
                         + "".join(map(_item, some)) + "</ul>")
    if not every:
        return ('<section id="verdicts"><h2>What came out</h2><p class="missing">No figure of '
                "the survey is judged yet: <code>make figures</code> measures and judges them."
                "</p></section>")
    return ('<section id="verdicts"><h2>What came out</h2>'
            f"<p>This page makes {len(every)} of the survey’s figures and tables again. Fixed "
            "rules compare the measured numbers with the published numbers. The outcomes: "
            f"{' '.join(counts)}</p>{''.join(parts)}</section>")


def _item(one: JudgedFigure) -> str:
    says = one.says()
    words = one.verdict["word"] if one.verdict["word"] != one.outcome.name else ""
    aside = html.escape("; ".join(filter(None, (words, says))))
    return (f'<li><a href="#{html.escape(one.name)}">{html.escape(one.title)}</a>'
            + (f": {aside}" if aside else "") + "</li>")
