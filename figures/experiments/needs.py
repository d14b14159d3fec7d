"""Needs: compares two renderers on ten scenes, by time, memory and passes.

The first renderer has only the features that a scene needs. The second has all features.
"""
from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.charts import COLOURS

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished
from .growing import STEPS, scenes
from .needs_times import BOUNCES, LIGHT_SAMPLES

SCENE, METHOD = "bunny", "bvh-threaded"
HEADS = ("scene", "ms", "ms, all features", "time ratio", "MiB", "MiB, all features",
         "texel fetches a pixel", "texel fetches, all features", "passes", "passes, all features",
         "waves", "pixels that differ")


def _cell(step: int, full: bool, scene: str = SCENE) -> Cell:
    return Cell(scene, METHOD, (("step", step),), 512 if full else 128, "needs",
                9 if full else 5)


def cells(full: bool) -> list[Cell]:
    return [_cell(step, full) for step in range(len(STEPS))]


def row_of(step: int, found: dict[str, Any]) -> list[Any]:
    one, other = found["derived"], found["all"]
    return [STEPS[step], 1e3 * one["seconds"], 1e3 * other["seconds"], found["ratio"],
            one["texture_bytes"] / 2**20, other["texture_bytes"] / 2**20, one["texel_fetches"],
            other["texel_fetches"], sum(one["passes_by_name"].values()),
            sum(other["passes_by_name"].values()), one["waves"], found["differing"]]


def _agreement(rows: list[list[Any]]) -> str:
    """Say whether the renderers' pictures agree. A row's last value counts differing pixels."""
    worst = max(row[-1] for row in rows)
    return ("The two pictures of each scene are the same to the bit." if worst == 0 else
            f"The two pictures of a scene differ in up to {worst:,} pixels.")


def draw(data: Path, out: Path, full: bool) -> None:
    results = finished(cells(full), data)
    rows = [row_of(dict(cell.options)["step"], r["needs"]) for cell, r in results]
    if not rows:
        return
    _, known = results[0]
    size = _cell(0, full).size
    write_csv(out / "needs.csv", HEADS, rows)
    write_text(out / "needs.md", f"# What a scene needs\n\nThe scene is {known['scene']['name']}, "
               f"to which each step adds something; {size}x{size} pixels, {METHOD}, "
               f"{LIGHT_SAMPLES} shadow rays to the lamp, {BOUNCES} bounces; renderer: "
               f"{known['gpu']['renderer']}. Two renderers draw each scene alternately. The "
               "programs, textures and passes of the first renderer are derived from the scene. "
               "The second renderer has every feature on. The time ratio is the median, over the "
               "pairs of pictures, of the first renderer's time divided by the second's. The "
               "passes of traversal are not counted; a wave is a set of rays that are traced "
               f"together. {_agreement(rows)}\n\n" + markdown_table(HEADS, [
                   [number(v) if isinstance(v, float) else v for v in row] for row in rows]))
    figure = plt.figure(figsize=(11, 5.6))
    grid = figure.add_gridspec(2, len(STEPS), height_ratios=(3, 1), hspace=0.35)
    axis = figure.add_subplot(grid[0, :])
    places = range(len(rows))
    axis.bar([p - 0.2 for p in places], [row[3] for row in rows], 0.36, color=COLOURS[4],
             label="time")
    axis.bar([p + 0.2 for p in places], [row[4] / row[5] for row in rows], 0.36, color=COLOURS[0],
             label="texture bytes")
    for place, row in zip(places, rows):
        axis.annotate(f"{row[1]:.0f} ms", (place - 0.2, row[3]), ha="center", va="bottom",
                      fontsize=7)
        axis.annotate(f"{row[4]:.0f} MiB", (place + 0.2, row[4] / row[5]), ha="center",
                      va="bottom", fontsize=7)
    axis.axhline(1, color="#8c8c8c", linewidth=0.8)
    axis.set(ylabel="derived / all features on", ylim=(0, 1.3), xlim=(-0.6, len(STEPS) - 0.4))
    axis.set_xticks(list(places), [textwrap.fill(row[0], 13) for row in rows], fontsize=7)
    axis.legend(frameon=False, loc="upper left", ncols=2)
    axis.spines[["top", "right"]].set_visible(False)
    for step, scene in enumerate(scenes(SCENE)):
        with rt.Tracer(scene, METHOD) as tracer:
            image = tracer.render(size=(112, 112), bounces=BOUNCES, light_samples=LIGHT_SAMPLES)
        picture = figure.add_subplot(grid[1, step])
        picture.imshow(image)
        picture.axis("off")
    figure.subplots_adjust(left=0.06, right=0.99, top=0.93, bottom=0.05)
    save_chart(figure, out / "needs.png", f"Renderer: {known['gpu']['renderer']}",
               "Bars show the time and the texture bytes of a renderer derived from a scene, "
               "divided by the time and the bytes of a renderer with all features. Below, a "
               "picture of each scene")
