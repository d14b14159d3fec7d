"""Figure 4: the organisation of the Ray Engine, drawn from the passes of an observed trace."""
from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.rays.records import HIT, RAY_TEXELS
from gpgpu_rt.traversal.records import FOUND, NEAREST

from ..diagrams.plan import INK, PALE, RAY, SPLITS, TRIANGLE, VISITED
from ..diagrams.small_world import world
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text
from .fig03_stream_processing import arrow, box, heading, rays, texels_of

METHOD, SIDE = "ray-engine", 16
SETTINGS = {"resolution": (4, 4, 1), "batch": 128, "queue": 4}
HEADS = ("pass", "program", "samples", "writes", "how fragments of a ray are merged", "drawn as")
QUADS, LEFT = "methods/ray_engine/quads.frag", "methods/ray_engine/quad_hits.frag"
KEPT = {NEAREST.name: "KEEP_NEAREST", FOUND.name: "KEEP_FIRST", HIT.name: "hits"}
TITLES = {"KEEP_NEAREST": "nearest t", "KEEP_FIRST": "lowest index at that t",
          "hits": "hits of the batch"}


@dataclass(frozen=True)
class BatchPass:
    """A pass of the tracer over a batch of rays.

    Attributes
    ----------
    name : a key of TITLES, which describes the values that the pass keeps.
    program : the files of the pass's shaders.
    samples : textures that the program samples, in any stage.
    targets : textures that the pass draws into.
    blends : how fragments of the same ray are merged.
    batch : the number of the batch.
    quads : number of quads drawn; 0 if the pass draws a rectangle over the batch.
    """

    name: str
    program: str
    samples: tuple[str, ...]
    targets: tuple[str, ...]
    blends: str
    batch: int
    quads: int


@lru_cache(maxsize=1)
def passes() -> tuple[tuple[BatchPass, ...], dict[str, float], rt.Hits]:
    """Trace Figure 3's rays. Return the passes, `Statistics.split` (bytes and seconds), and the
    hits."""
    found: list[BatchPass] = []
    with rt.Tracer(world().scene, METHOD, statistics=True, **SETTINGS) as tracer:
        with tracer.observe(fragments=True) as observed:
            hits = tracer.trace(*rays(), shape=(SIDE, SIDE))
        split = dict(tracer.statistics.split)
    for one in observed:
        if one.name not in (QUADS, LEFT):
            continue
        batch = 1 + sum(earlier.name == "hits" for earlier in found)
        files = (one.vertex, one.name) if one.name == QUADS else (one.name,)
        found.append(BatchPass(
            KEPT[one.target.record.name], ", ".join(file.split("/")[-1] for file in files),
            tuple(sorted(one.inputs)), tuple(one.target.samplers()),
            "MIN blending" if one.name == QUADS else "-", batch,
            one.primitives // 2 if one.name == QUADS else 0))
    return tuple(found), split, hits


def cells(full: bool) -> list[Cell]:
    return []


def draw(data: Path, out: Path, full: bool) -> None:
    every, split, hits = passes()
    write_csv(out / "fig04.csv", ("batch", "pass", "samples", "writes", "quads"),
              [[one.batch, one.name, " ".join(one.samples), " ".join(one.targets), one.quads]
               for one in every])
    kinds = {one.name: one for one in reversed(every)}
    lines = [[TITLES[name], kinds[name].program, ", ".join(kinds[name].samples),
              ", ".join(kinds[name].targets), kinds[name].blends,
              "a quad per pair of queue and triangle" if kinds[name].quads else
              "one rectangle over the batch"] for name in TITLES]
    write_text(out / "fig04.md", (
        "# Figure 4: the organisation of the Ray Engine (Carr et al. 2002)\n\n"
        f"`{METHOD}` traces {SIDE * SIDE} rays in {int(split['batches'])} batches of at most "
        f"{SETTINGS['batch']} rays. The rays visit {int(hits.leaves_visited.sum())} cells that "
        f"list triangles. For these visits the passes draw {int(split['quads'])} quads, which "
        f"test {int(split['pairs'])} pairs of a ray and a triangle. The host walks the rays "
        "through the grid, queues them by cell and keeps each ray's nearest hit; graphics "
        "hardware only intersects. In the paper a quad carries its triangle's corners. Here the "
        "triangles lie on the graphics hardware, and a quad carries its triangle's number. "
        "The corners would add 36 bytes to the 20 bytes of a quad.\n\n"
        + markdown_table(HEADS, lines)
        + f"\n{int(split['bytes_up']):,} bytes were uploaded and {int(split['bytes_down']):,} "
        f"bytes were read back. These are {split['bytes_up'] / len(hits):.0f} and "
        f"{split['bytes_down'] / len(hits):.0f} bytes per ray.\n"))
    figure, (axis, strip) = plt.subplots(2, 1, figsize=(12, 8.6), height_ratios=(5, 1.2))
    draw_engine(axis, kinds, split)
    draw_batches(strip, every)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "fig04.png", "The textures are those that the linked programs sample "
               "and draw into. The bytes are sums over all batches of this trace.",
               "A diagram: the host sorts rays into cells, sends them to the card in batches, "
               "and reads the hits back. Bars below show the quads of each batch")


def draw_engine(axis: Any, kinds: dict[str, BatchPass], split: dict[str, float]) -> None:
    """Draw the host on the left, graphics hardware on the right, and bytes between them."""
    axis.set(xlim=(0, 112), ylim=(0, 72))
    axis.axis("off")
    for x, width, name in ((1, 30, "host"), (46, 65, "graphics hardware")):
        axis.add_patch(plt.Rectangle((x, 1), width, 66, fill=False, edgecolor=PALE,
                                     linestyle="--"))
        heading(axis, x + width / 2, 69.5, name)
    steps = (("rays", "origin, direction, interval;\nthe nearest hit so far", 52),
             ("walk", "each ray through the grid to the\nnext cell that lists triangles", 36),
             ("queues", "a cell's rays side by side;\nlong queues form a batch", 20),
             ("nearest", "keep the nearest hit; at equal t,\nthe triangle of the lowest index", 4))
    for name, meaning, y in steps:
        box(axis, 3, y, 26, 10, name, meaning, VISITED)
    arrow(axis, (16, 52), (16, 46))
    arrow(axis, (16, 36), (16, 30))
    axis.annotate("", xy=(3, 57), xytext=(3, 9), arrowprops={
        "arrowstyle": "-|>", "color": INK, "lw": 1.2, "connectionstyle": "arc3,rad=-0.13"})
    held = {**texels_of(RAY_TEXELS), "triangle_table": "corners and indices of triangles",
            "quads": "rectangle over a queue, triangle's number"}
    places = {}
    for at, (name, holds) in enumerate(held.items()):
        y = 56 - 9 * at
        box(axis, 48, y, 27, 7, name, holds, "white", TRIANGLE if name == "triangle_table" else
            INK)
        places[name] = y + 3.5
    for at, (name, one) in enumerate((name, kinds[name]) for name in TITLES):
        y = 53 - 17 * at
        box(axis, 82, y, 27, 11, TITLES[name], f"{one.program}\nwrites {', '.join(one.targets)}\n"
            f"{one.blends if one.blends != '-' else 'one fragment a ray'}", VISITED)
        for source in (*one.samples, *(("quads",) if one.quads else ())):
            if source in places:
                axis.plot([75, 82], [places[source], y + 5.5], color=PALE, lw=0.9, zorder=0)
        if at:
            arrow(axis, (95.5, y + 17), (95.5, y + 11))
    axis.annotate("", xy=(48, 40), xytext=(29, 26), arrowprops={"arrowstyle": "-|>", "color": RAY,
                                                                "lw": 2.2})
    axis.text(38.5, 41, f"up\n{int(split['bytes_up']):,}\nbytes", ha="center", color=RAY,
              fontsize=9)
    axis.annotate("", xy=(29, 9), xytext=(82, 22), arrowprops={"arrowstyle": "-|>", "color": RAY,
                                                               "lw": 2.2})
    axis.text(38.5, 15, f"down\n{int(split['bytes_down']):,}\nbytes", ha="center", color=RAY,
              fontsize=9)


def draw_batches(axis: Any, every: tuple[BatchPass, ...]) -> None:
    """Draw the number of quads of each batch, in order."""
    quads = {one.batch: one.quads for one in every if one.quads}
    axis.bar(list(quads), list(quads.values()), color=SPLITS[0], width=0.85)
    axis.set(xlabel="batch", ylabel="quads", xticks=list(quads))
    axis.tick_params(labelsize=6)
    axis.spines[["top", "right"]].set_visible(False)
    axis.set_title("each batch is uploaded, drawn in three passes and read back", fontsize=9)
