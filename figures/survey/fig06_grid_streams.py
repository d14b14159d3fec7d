"""Figure 6: streaming ray tracing in a grid (Purcell et al. 2002), drawn from observed passes."""
from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import gpgpu_rt as rt

from ..diagrams.flow import HEADS, draw_flow, table_rows
from ..diagrams.issued_passes import Issued, issued
from ..diagrams.small_world import world
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text

SIDE = 16     # pixels
WORDS = {"eye_rays": "generate eye rays", "init": "a ray enters the grid, or misses it",
         "traverse": "one step from cell to cell",
         "intersect": "one triangle of the cell's list",
         "surfaces": "shade hits, make shadow rays",
         "picture": "add unshadowed direct light"}
# Programs that only count rays or mask them.
COUNTING = ("classify", "mask", "tile_counts", "everywhere")


@lru_cache(maxsize=None)
def passes() -> list[Issued]:
    """Return the passes of one picture of the scene of `world`, with eye and shadow rays."""
    with rt.Tracer(world().scene, "grid", schedule="kernels", mask_interval=2) as tracer:
        with tracer.observe() as observed:
            tracer.render(size=(SIDE, SIDE))
        return issued(observed, COUNTING)


def cells(full: bool) -> list[Cell]:
    return []


def draw(data: Path, out: Path, full: bool) -> None:
    log = passes()
    write_csv(out / "fig06.csv", ("pass", "kernel"),
              [[at, one.kernel] for at, one in enumerate(log, 1)])
    write_text(out / "fig06.md", "# Figure 6: ray tracing in a grid as streams and kernels\n\n"
               f"The table lists the passes of one picture of {SIDE} x {SIDE} pixels by `grid` "
               "under the schedule `kernels`, without the passes that only count or mask rays.\n\n"
               + markdown_table(HEADS, table_rows(log, WORDS)))
    figure, axis = plt.subplots(figsize=(10, 6.5))
    draw_flow(axis, log, WORDS)
    save_chart(figure, out / "fig06.png", "Boxes: kernels, each with its number of passes. Green: "
               "tables, read at computed positions. Vertical lines: streams. A blue dot means "
               "that the kernel writes the stream, a violet dot that it reads the stream.",
               "A diagram: the kernels of ray tracing in a grid below each other, with the "
               "tables and streams that each kernel reads and writes")
