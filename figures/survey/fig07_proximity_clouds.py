"""Figure 7: a picture by Karlsson and Ljungstedt's grid with proximity clouds (2004)."""
from __future__ import annotations

from pathlib import Path

from ..framework import verdicts
from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import read
from . import lit_pictures
from .lit_pictures import HEADS, cell, picture

SCENE, METHOD = "soft-shadows", "grid-proximity"
METHODS = (METHOD, "grid", "bvh-threaded")
THEIRS, THEIRS_ON_CPU = 6.0, 6.2    # seconds, from the survey's caption


def cells(full: bool) -> list[Cell]:
    return [cell(SCENE, method, full) for method in METHODS]


def judge(data: Path, full: bool) -> verdicts.Verdict:
    """The verdict on what the thesis's abstract says of the clouds.

    The CPU renderer that the thesis compares with is not available.
    """
    seconds = {c.method: row[3] for c in cells(full)
               if (row := lit_pictures.row_of(c, data)) is not None}
    return verdicts.of_claims({
        f"proximity clouds are faster than the plain grid, {number(seconds['grid'])} s to "
        f"{number(seconds[METHOD])} s": seconds[METHOD] < seconds["grid"]}
        if {METHOD, "grid"} <= set(seconds) else {})


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/fig07.csv, .md and .png."""
    rows = {c.method: row for c in cells(full)
            if (row := lit_pictures.row_of(c, data)) is not None}
    if METHOD not in rows:
        return
    known = read(cell(SCENE, METHOD, full), data)
    assert known is not None
    size = cell(SCENE, METHOD, full).size
    write_csv(out / "fig07.csv", HEADS, list(rows.values()))
    others = ", ".join(f"{number(row[3] / rows[METHOD][3])} times as long by {method}"
                       for method, row in rows.items() if method != METHOD)
    write_text(out / "fig07.md", "# Figure 7: a picture by the grid with proximity clouds "
               f"(Karlsson and Ljungstedt 2004)\n\n{SCENE} at {size}x{size}, Whitted's ray "
               f"tracing; renderer: {known['gpu']['renderer']}. The thesis's picture shows a "
               f"scene that is not available. It took {THEIRS:g} s on a GeForce 6800 GTX and "
               f"{THEIRS_ON_CPU:g} s by a commercial renderer on a CPU of the time, "
               f"{number(THEIRS_ON_CPU / THEIRS)} times as long. Our picture took "
               f"{number(rows[METHOD][3])} s here" + (f"; {others}" if others else "") + ".\n\n"
               + markdown_table(HEADS, [[number(v) if isinstance(v, float) else v for v in row]
                                        for row in rows.values()]))
    figure, axis = plt.subplots(figsize=(5.4, 5.6))
    axis.imshow(picture(cell(SCENE, METHOD, full)))
    axis.set_axis_off()
    axis.set_title(f"{SCENE}, by {METHOD}", fontsize=9)
    figure.suptitle("Figure 7: a picture by the grid with proximity clouds", fontsize=11)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "fig07.png", f"Renderer: {known['gpu']['renderer']}")
