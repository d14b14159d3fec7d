"""Conformance: compares this project and other installed ray tracers with exact answers."""
from __future__ import annotations

from pathlib import Path
from typing import Any

from gpgpu_rt.conform.chart import draw as draw_chart
from gpgpu_rt.conform.families import FAMILIES
from gpgpu_rt.conform.suite import KINDS, Row, installed

from ..framework.cell import Cell
from ..framework.output import markdown_table, write_csv, write_text
from ..framework.results import finished
from .conformance_runs import WORK


def cells(full: bool) -> list[Cell]:
    """Return the single measurement of the figure."""
    return [Cell("extremes", "bvh-threaded", (), 45 if full else 17, WORK, 1)]


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/conformance.csv, .md and .png."""
    rows = [Row(**row) for _, result in finished(cells(full), data) for row in result["rows"]]
    if not rows:
        return
    write_csv(out / "conformance.csv", ("engine", "version", "family", "rays", "undecidable",
                                        *KINDS, "seconds", "note"),
              [[row.engine, row.version, row.family, row.rays, row.undecidable,
                *(row.wrong[kind] for kind in KINDS), row.seconds, row.note] for row in rows])
    engines = list(dict.fromkeys(row.engine for row in rows))
    missing = [f"* {name}: {why}." for name, why in installed()[1].items()]
    write_text(out / "conformance.md", "\n".join([
        "# Conformance of ray tracers\n\nThe rays are aimed at difficult places: edges, vertices "
        "and the limits of float32. The right answers are exact. If float32 cannot decide a ray, "
        "the ray counts neither for nor against an engine. docs/conformance.md defines the kinds "
        "of errors. The numbers say nothing about ordinary rays. A wrapper is an engine that "
        "calls another engine. The "
        "wrapper's own errors are the errors that the other engine does not make.\n",
        markdown_table(("engine", "rays", "undecidable", "wrong", *KINDS,
                        "wrapper's own"),
                       [_sums([row for row in rows if row.engine == name]) for name in engines]),
        *(["Engines that were not run:\n", *missing, ""] if missing else []),
        "## By family\n\nFor each engine the table has the number of wrong rays out of the rays "
        "cast. A dash means that the engine was not run: it does not accept the family's t_min or "
        "t_max, or gave no answer in an earlier family.\n",
        _families(rows, engines)]))
    draw_chart(rows, str(out / "conformance.png"))


def _sums(rows: list[Row]) -> list[Any]:
    own = [row.own for row in rows if row.own is not None]
    return [f"{rows[0].engine} {rows[0].version}".strip(), sum(row.rays for row in rows),
            sum(row.undecidable for row in rows), sum(row.wrong_rays for row in rows),
            *(sum(row.wrong[kind] for row in rows) for kind in KINDS), sum(own) if own else "-"]


def _families(rows: list[Row], engines: list[str]) -> str:
    cells = {(row.engine, row.family): row for row in rows}
    return markdown_table(("family", *engines), [
        [name, *(_cell(cells.get((engine, name))) for engine in engines)] for name in FAMILIES])


def _cell(row: Row | None) -> str:
    if row is None or not row.rays:
        return "-"
    return f"{'crash, ' if row.wrong['crash'] else ''}{row.wrong_rays} of {row.rays}"
