"""Pages: draws the pages of figures, in parallel if there are many."""
from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from gpgpu_rt.methods.references import cited
from gpgpu_rt.threads import cores
from gpgpu_rt.workers import Workers

from . import provenance, verdicts
from .aside import worth_workers
from .catalogue import figure_of, of_survey
from .contradictions import of_page
from .output import write_text


def draw(names: Sequence[str], data: Path, out: Path, full: bool) -> None:
    """Draw these figures' pages from measured cells, and record the source of each page."""
    with tqdm(total=len(names), unit="page", dynamic_ncols=True) as progress:
        if not worth_workers(len(names)):
            for name in names:
                progress.set_description(name)
                _draw(name, data, out, full)
                progress.update()
            return
        with Workers(count=cores()) as workers:
            parts = [(name, data, out, full) for name in names]
            for at, _ in workers.map(_draw, parts):
                progress.set_description(names[at])
                progress.update()


def _draw(name: str, data: Path, out: Path, full: bool) -> None:
    figure = figure_of(name)
    page = out / f"{name}.md"
    figure.draw(data, out, full)
    _add_notes(name, out)
    _add_works(page)
    judged = None
    if of_survey(name):
        judged = figure.judge(data, full) if hasattr(figure, "judge") else verdicts.DIAGRAM
        _add_verdict(page, judged)
    provenance.record(name, figure.cells(full), data, out, full, judged)


def _add_verdict(page: Path, judged: verdicts.Verdict) -> None:
    """Write the verdict and its basis below the title of a page."""
    if page.exists():
        title, _, rest = page.read_text().partition("\n")
        says = (f"**{judged.word}**: {judged.why}",
                f"The verdict rests on {verdicts.rests_on(judged)}.",
                verdicts.stand_ins_say(judged), verdicts.renderer_says(judged))
        write_text(page, "\n\n".join((title, *filter(None, says), rest.lstrip())))


def _add_notes(name: str, out: Path) -> None:
    """Append to a figure's page the survey's contradictions that concern the figure."""
    page, notes = out / f"{name}.md", of_page(name)
    if notes and page.exists():
        lines = "\n".join(f"* {says}" for says in notes)
        write_text(page, page.read_text().rstrip() + "\n\n## Where the survey contradicts itself "
                   f"or its sources\n\n{lines}\n")


def _add_works(page: Path) -> None:
    """Append the full citations of the works that a page cites."""
    text = page.read_text() if page.exists() else ""
    works = cited(text)
    if works:
        lines = "\n".join(f"* {work}." for work in works)
        write_text(page, f"{text.rstrip()}\n\n## Works\n\n{lines}\n")
