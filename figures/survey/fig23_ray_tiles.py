"""Figure 23: the hierarchical ray engine (Szécsi 2006), from observed passes of `ray-tiles`."""
from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import gpgpu_rt as rt
from gpgpu_rt.charts import HERE, PUBLISHED, log_axis

from ..diagrams.flow import HEADS, draw_flow, table_rows
from ..diagrams.issued_passes import Issued, issued
from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text

SCENE, SIDE, TILE = "boulder", 64, 8
WORDS = {"tile_spans": "middle of a tile's rays", "tile_cones": "enclosing cone of the tile",
         "tile_ends": "how far the tile still searches",
         "tile_pairs": "cone test (vertices), then ray-triangle: MIN of t",
         "tile_pairs, again": "lowest triangle index at the least t: MIN",
         "tile_hits": "u, v and state of each ray"}


@lru_cache(maxsize=None)
def passes() -> tuple[list[Issued], list[tuple[int, int]]]:
    """Return the passes of one image of eye rays, and two counts for each batch of triangles.

    The first counts all pairs of a triangle and a tile. The second counts the pairs whose triangle
    meets the tile's cone.
    """
    scene = rt.load_scene(SCENE)
    rays = scene.camera.rays((SIDE, SIDE))
    with rt.Tracer(scene, "ray-tiles", tile=TILE) as tracer, tracer.observe() as observed:
        tracer.trace(*rays)
        log = issued(observed)
    tiles, found = (SIDE // TILE) ** 2, []
    with rt.Tracer(scene, "ray-tiles", tile=TILE) as tracer:
        everything, before = tracer.accelerator.structure, 0.0
    for steps, (_, count) in enumerate(everything, 1):
        with rt.Tracer(scene, "ray-tiles", tile=TILE, statistics=True, step_cap=steps) as tracer:
            through = tracer.trace(*rays).nodes_visited.sum() / TILE ** 2
        found.append((count * tiles, round(through - before)))
        before = through
    return log, found


def cells(full: bool) -> list[Cell]:
    return []


def draw(data: Path, out: Path, full: bool) -> None:
    log, batches = passes()
    write_csv(out / "fig23.csv", ("batch", "pairs", "through"),
              [[at, *pair] for at, pair in enumerate(batches, 1)])
    pairs, through = (sum(column) for column in zip(*batches))
    write_text(out / "fig23.md", "# Figure 23: the hierarchical ray engine\n\nThe table lists the "
               f"passes of `ray-tiles` over {SIDE} x {SIDE} eye rays in tiles of {TILE} x {TILE}, "
               f"on the scene {SCENE}. The vertex stage tests each triangle against each tile's "
               f"cone and lets {through:,} of {pairs:,} pairs of a triangle and a tile "
               f"through ({number(100 * through / pairs)} %); only these reach the intersection. "
               "There is no structure over triangles.\n\n"
               + markdown_table(HEADS, table_rows(log, WORDS)))
    figure, (axis, strip) = plt.subplots(2, 1, figsize=(10, 8.5), height_ratios=(4, 1))
    draw_flow(axis, log, WORDS)
    for (colour, marker), name, counts in zip((PUBLISHED, HERE), (
            "all pairs of a triangle and a tile", "pairs whose triangle meets the tile's cone"),
            zip(*batches)):
        strip.plot(range(1, 1 + len(batches)), counts, marker, color=colour, label=name)
    log_axis(strip, "y")
    strip.set(xlabel="batch of triangles", ylabel="pairs (log)")
    strip.legend(frameon=False, fontsize=8, ncols=2, loc="lower left", bbox_to_anchor=(0, 1))
    strip.spines[["top", "right"]].set_visible(False)
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    save_chart(figure, out / "fig23.png", "Green: inputs, which are rays and the table of "
               "triangles. Vertical lines: streams. A blue dot means that the kernel writes the "
               "stream, a violet dot that it reads the stream.",
               "A list of the kernels of ray-tiles in their order, with the textures that each "
               "reads and writes. Below, dots show for each batch of triangles all pairs of a "
               "triangle and a tile, and the pairs that the cones let through")
