"""Figure 1: reflections on a statue, soft shadows, refraction through a teapot."""
from __future__ import annotations

from pathlib import Path

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished
from . import lit_pictures
from .lit_pictures import HEADS, cell, picture

METHOD = "bvh-threaded"
QUICK = 288     # pixels per side at the quick size: enough to see the effects
PANELS = {"statue": "reflections", "soft-shadows": "soft shadows", "glass-teapot": "refraction"}


def cells(full: bool) -> list[Cell]:
    return [cell(scene, METHOD, full, quick=QUICK) for scene in PANELS]


def draw(data: Path, out: Path, full: bool) -> None:
    rows = [row for c in cells(full) if (row := lit_pictures.row_of(c, data)) is not None]
    if not rows:
        return
    _, known = finished(cells(full), data)[0]
    size = cells(full)[0].size
    write_csv(out / "fig01.csv", HEADS, rows)
    write_text(out / "fig01.md", "# Figure 1: reflections, soft shadows and refraction\n\n"
               f"Whitted's ray tracing at {size}x{size}, all rays by {METHOD}; renderer: "
               f"{known['gpu']['renderer']}. The survey's pictures show other scenes; ours are "
               "built-in stand-ins with the same effects. A picture is traced in waves of one ray "
               "per pixel. Once a pixel's path has ended, each later wave has an empty ray for "
               "the pixel. The number of rays includes empty rays. The column s is the time of "
               "the picture, and MiB is the size of all textures.\n\n" + markdown_table(
                   HEADS, [[number(v) if isinstance(v, float) else v for v in r] for r in rows]))
    figure, axes = plt.subplots(1, len(PANELS), figsize=(13, 4.9))
    for axis, one, (scene, says) in zip(axes, cells(full), PANELS.items()):
        axis.imshow(picture(one))
        axis.set_axis_off()
        axis.set_title(f"{says}: {scene}", fontsize=9)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "fig01.png", f"Renderer: {known['gpu']['renderer']}",
               "Three pictures: a statue that reflects its surroundings, soft shadows under "
               "area lights, and a glass teapot that refracts the scene behind it")
