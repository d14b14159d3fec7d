"""The index page: lists the verdict on each figure of the survey, and the verdict's reason."""
from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from gpgpu_rt.inspect.data_uris import description_of
from gpgpu_rt.report.verdict_badges import BADGE_STYLE, badge

from . import verdicts
from .contradictions import CONTRADICTIONS
from .output import markdown_table, write_text
from .verdicts import Verdict

RULES = (
    f"**{verdicts.REPRODUCED}**: the methods have the published order (tau-b is "
    f"{verdicts.HIGH:g} or more in every scored group; tau-b is 1 for the same order and -1 for "
    "the reverse). The ratios between the methods' times are off by less than a factor of "
    f"{verdicts.FACTOR:g} in the median. A group is a scene and a kind of rays. A figure that "
    "makes claims is reproduced if all claims hold. Table 1's properties are such claims",
    f"**{verdicts.ORDER}**: only the order agrees",
    f"**{verdicts.MOSTLY}**: more than half of a figure's claims hold, but not all",
    f"**{verdicts.CONTRADICTED}**: the order differs, whatever the ratios are; or at most half of "
    "a figure's claims hold. Our machine, cameras and sometimes scenes differ from the papers'; "
    "the figure's page shows the reasons",
    f"**{verdicts.REFUTED}**: at most half of a figure's claims hold, and every judged claim is "
    "about a method itself. Such a claim depends on no scene, so one counterexample is enough",
    f"**{verdicts.TOO_LITTLE}**: the verdict would rest on fewer than {verdicts.LEAST_SCENES} "
    f"scored scenes, or on fewer than {verdicts.LEAST_PAIRS} pairs of methods in all. A pair "
    "counts if the published numbers of its two methods, for the same scene and kind of rays, "
    "differ by more than 5 %. A claim that compares no methods needs only the scenes. A claim "
    "about a method itself, which depends on no scene, needs neither scenes nor pairs. "
    "Figure 7 compares the times of two methods. Its claim is judged only if the difference "
    "between the two times is larger than the difference between the slowest and the fastest run "
    "of each method",
    f"**{verdicts.REDRAWN}**: a diagram or a picture, made from this program's own passes and "
    "tables; the survey's figure has no numbers that could be scored",
    f"**{verdicts.UNMEASURED}**: the measurements that would decide the verdict are missing",
    "If a figure's paper measured on a card, the first verdict compares the published times with "
    "the times that are predicted for that card. A second verdict, by the same rules, compares "
    "the published times with the times measured on the present renderer",
    "If the mesh of a scene is missing, a procedural stand-in is measured, but never scored. "
    "After the verdict, the page says which verdict the same rules would give on the stand-ins")


@dataclass(frozen=True)
class IndexEntry:
    """A page: its name, its title, its verdict and the source of its numbers.

    ``verdict`` is None for a figure beyond the survey.
    """

    name: str
    title: str
    verdict: Verdict | None
    source: str


def write_index(out: Path, lines: Sequence[IndexEntry], opening: Sequence[str],
                remarks: Sequence[str]) -> None:
    """Write out/index.md and out/index.html.

    Parameters
    ----------
    opening : sentences that sum up which results of the survey are confirmed
    remarks : sentences on the run as a whole
    """
    of_survey = [line for line in lines if line.verdict]
    beyond = [line for line in lines if not line.verdict]
    pages = {line.name for line in lines}
    where = [(one.says, ", ".join(f"[{name}]({name}.md)" for name in one.pages if name in pages))
             for one in CONTRADICTIONS]
    write_text(out / "index.md", "\n".join((
        "# The survey's figures, made again\n", *(f"* {says}" for says in opening), "",
        *(f"{says}\n" for says in remarks),
        markdown_table(("figure", "verdict", "rests on", "why", "data"), [
            (f"[{line.title}]({line.name}.md)", f"**{line.verdict.word}**",
             verdicts.rests_on(line.verdict), _why(line.verdict), _links(line))
            for line in of_survey if line.verdict]),
        "The verdicts follow these rules:\n",
        *(f"* {rule}." for rule in RULES), "",
        *(["## Beyond the survey's figures\n"] if beyond else []),
        *(f"* [{line.title}]({line.name}.md): {_links(line)}" for line in beyond), "",
        "## Where the survey contradicts itself or its sources\n",
        *(f"{at}. {says}" + (f" ({links})" if links else "")
          for at, (says, links) in enumerate(where, 1)), "",
        "## Where the numbers come from\n",
        *(f"* [{line.name}.json]({line.name}.json): {line.source}" for line in lines), "")))
    write_text(out / "index.html", _html(out, opening, of_survey, beyond))


def _why(verdict: Verdict) -> str:
    return " ".join(filter(None, (verdict.why, verdicts.stand_ins_say(verdict),
                                  verdicts.renderer_says(verdict))))


def _links(line: IndexEntry) -> str:
    return " ".join(f"[{word}]({line.name}.{suffix})" for word, suffix in
                    (("chart", "png"), ("CSV", "csv"), ("JSON", "json")))


def _html(out: Path, opening: Sequence[str], of_survey: Sequence[IndexEntry],
          beyond: Sequence[IndexEntry]) -> str:
    cards = []
    for line in (*of_survey, *beyond):
        chart = out / f"{line.name}.png"
        picture = (f'<a href="{line.name}.md"><img src="{line.name}.png" loading="lazy" '
                   f'alt="{html.escape(description_of(chart), quote=True)}"></a>'
                   if chart.exists() else "")
        said = (f"<p>{badge(line.verdict.word)}</p>"
                f"<p>Rests on {html.escape(verdicts.rests_on(line.verdict))}.</p>"
                f"<p>{html.escape(_why(line.verdict))}</p>" if line.verdict else "")
        cards.append(f"<section><h2>{html.escape(line.title)}</h2>{picture}{said}"
                     f'<p class="source"><a href="{line.name}.json">{html.escape(line.source)}'
                     "</a></p></section>")
    style = ("body{font:15px/1.45 sans-serif;margin:2rem auto;max-width:90rem;padding:0 1rem;"
             "color:#222}main{display:grid;gap:1.5rem;"
             "grid-template-columns:repeat(auto-fill,minmax(26rem,1fr))}section{border:1px solid "
             "#ddd;padding:1rem;overflow-wrap:anywhere}h2{font-size:1rem;margin:0 0 .6rem}"
             f"img{{width:100%}}{BADGE_STYLE}"
             ".source{color:#777;font-size:.8rem}")
    return ('<!doctype html><html lang="en"><head><meta charset="utf-8">'
            '<meta name="viewport" content="width=device-width">'
            f"<title>The survey's figures, made again</title><style>{style}</style></head><body>"
            f"<h1>The survey's figures, made again</h1><ul>"
            + "".join(f"<li>{html.escape(says)}</li>" for says in opening) + "</ul><main>"
            + "\n".join(cards) + "</main></body></html>\n")
