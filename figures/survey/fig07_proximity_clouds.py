"""Figure 7: a picture by Karlsson and Ljungstedt's grid with proximity clouds (2004)."""
from __future__ import annotations

from pathlib import Path
from typing import Any

from ..framework import verdicts
from ..framework.cell import Cell, timed_runs
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_numbers import published
from ..framework.results import read
from . import lit_pictures
from .lit_pictures import HEADS, picture

SCENE, METHOD, PLAIN = "soft-shadows", "grid-proximity", "grid"
METHODS = (METHOD, PLAIN, "bvh-threaded")
SURVEYED = "figure 7"     # the survey's scene, as the published numbers name it
# Label of a row of the survey's times -> name of the method in the published numbers.
PUBLISHED = {"survey: GeForce 6800 GTX": "grid", "survey: Autodesk 3ds Max, CPU": "cpu"}


def cell(method: str, full: bool) -> Cell:
    return lit_pictures.cell(SCENE, method, full, timed_runs(full))


def cells(full: bool) -> list[Cell]:
    return [cell(method, full) for method in METHODS]


def judge(data: Path, full: bool) -> verdicts.Verdict:
    """Judge the claim of the thesis's abstract that proximity clouds beat the plain grid.

    The claim is not decided if the two methods' times differ by no more than the slowest and the
    fastest run of one method. The thesis also compares its times with a renderer on the CPU. This
    comparison is not judged, because that renderer is not available.
    """
    clouds, plain = (read(cell(method, full), data) for method in (METHOD, PLAIN))
    if clouds is None or plain is None:
        return verdicts.of_claims([])
    ours, other = clouds["median_ms"] / 1e3, plain["median_ms"] / 1e3
    unsure = max(map(spread, (clouds, plain)))
    holds = None if abs(ours - other) <= unsure else ours < other
    return verdicts.of_claims([verdicts.Claim(
        f"proximity clouds are faster than the plain grid ({number(ours)} s against "
        f"{number(other)} s; the runs of one method differ by up to {number(unsure)} s)",
        holds, (SCENE,),
        (verdicts.Pair(SCENE, clouds["settings"]["work"], METHOD, PLAIN),),
        bool(clouds["scene"]["stand_in"]))])


def spread(result: dict[str, Any]) -> float:
    """Return the seconds between the slowest and the fastest run of a measurement."""
    return (max(result["samples_ms"]) - min(result["samples_ms"])) / 1e3


def draw(data: Path, out: Path, full: bool) -> None:
    rows = {c.method: row for c in cells(full)
            if (row := lit_pictures.row_of(c, data)) is not None}
    if METHOD not in rows:
        return
    known = read(cell(METHOD, full), data)
    assert known is not None
    size = cell(METHOD, full).size
    write_csv(out / "fig07.csv", HEADS, list(rows.values()))
    theirs = {words: published("text", SURVEYED, method) for words, method in PUBLISHED.items()}
    first = next(iter(theirs.values()))
    seconds = [[words, number(s), number(s / first)] for words, s in theirs.items()]
    seconds += [[f"here: {method}", number(row[3]), number(row[3] / rows[METHOD][3])]
                for method, row in rows.items()]
    write_text(out / "fig07.md", "# Figure 7: a picture by the grid with proximity clouds "
               f"(Karlsson and Ljungstedt 2004)\n\n{SCENE} at {size}x{size}, Whitted's ray "
               f"tracing; renderer: {known['gpu']['renderer']}. The thesis's picture shows a "
               "scene that is not available. The commercial renderer in the thesis's comparison "
               "is not available either. So the survey's seconds and ours are times of different "
               "pictures. Compare the survey's rows only with each other, and "
               "our rows only with each other. The last column is the time divided by the time of "
               "the first row of the same source.\n\n"
               + markdown_table(("picture by", "s", "s / s of the first row"), seconds)
               + "\n" + markdown_table(HEADS, [
                   [number(v) if isinstance(v, float) else v for v in row]
                   for row in rows.values()]))
    figure, axis = plt.subplots(figsize=(5.4, 5.6))
    axis.imshow(picture(cell(METHOD, full)))
    axis.set_axis_off()
    axis.set_title(f"{SCENE}, by {METHOD}", fontsize=9)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "fig07.png", f"Renderer: {known['gpu']['renderer']}",
               "A picture of the scene, traced by the grid with proximity clouds")
