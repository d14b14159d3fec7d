"""Ray bundles (survey, section 5), compared with traced bundles and path tracing.

Ray bundles gather light by parallel projections of the scene, in layers separated by depth
peeling.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gpgpu_rt.charts import COLOURS, linear_axis, log_axis

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished
from .bundle_errors import HUNG

SCENES = ("cornell-light", HUNG)
HEADS = ("scene", "pixels a side of a projection", "layers", "gathering, ms",
         "gathering by traced bundles, ms", "times as fast", "RMSE, traced bundles",
         "points more than 5 % off", "RMSE, path tracer", "median error, path tracer",
         "bias, path tracer")


def cells(full: bool) -> list[Cell]:
    options = {"patch": 0.1, "directions": 128 if full else 32, "between": 48 if full else 16,
               "resolutions": (64, 256) if full else (32, 128),
               "samples": 512 if full else 128, "packet": (4, 4), "octants": True}
    return [Cell(name, "bvh-packet", tuple(options.items()), 48 if full else 32, "ray bundles", 1)
            for name in SCENES]


def draw(data: Path, out: Path, full: bool) -> None:
    results = finished(cells(full), data)
    if not results:
        return
    rows = [_row(cell.scene, row) for cell, result in results
            for row in result["bundles"]["by_resolution"]]
    write_csv(out / "ray_bundles.csv", HEADS, rows)
    shown = [[row[0], row[1], row[2], *map(number, row[3:6]), f"{row[6]:.1%}", f"{row[7]:.1%}",
              f"{row[8]:.1%}", f"{row[9]:.1%}", f"{row[10]:+.1%}"] for row in rows]
    cell, result = results[0]
    bundles = result["bundles"]
    note = (f"{result['gpu']['renderer']}. Light is gathered at four points of each of "
            f"{cell.size} x {cell.size} pixels. For this, parallel rays run along "
            f"{bundles['directions']} directions and along their opposites. "
            f"{bundles['by_resolution'][0]['patches']:,} patches exchange light along "
            f"{bundles['between']} directions and their opposites. The path tracer has "
            f"{bundles['samples']} samples a pixel and a noise of {bundles['path_noise']:.1%}")
    write_text(out / "ray_bundles.md", (
        "# Ray bundles\n\n"
        "Parallel projections with peeled layers gather diffuse light. For comparison, the same "
        "bundles are traced ray by ray through the same patches. The difference from these traced "
        "bundles is the error that the projections' pixels cause. The difference from the path "
        "tracer also contains the errors of patches and of few directions.\n\n"
        "RMSE is the root of the mean squared difference. Against traced bundles it is divided by "
        "the root mean square of their light, and against the path tracer by the mean light of "
        "its picture. A point is "
        "more than 5 % off if it differs by more than 5 % of the mean light. The median error "
        "is the median over pixels of the relative difference, and the bias is the difference of "
        "the mean light, divided by the path tracer's mean light. The last three columns leave "
        "out the pixels of the lamp, the background and edges, and their neighbours.\n\n"
        "Renderer and settings: " + note + ".\n\n"
        + markdown_table(HEADS, shown)))
    figure, axes = plt.subplots(len(results), 4, figsize=(13, 3.3 * len(results)), squeeze=False)
    for line, (cell, result) in zip(axes, results):
        _pictures(line, cell, result["bundles"])
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "ray_bundles.png", note,
               "Pictures by a path tracer and by ray bundles, their difference, and the error "
               "of the bundles by resolution")


def _row(name: str, row: dict[str, Any]) -> list[Any]:
    ours, theirs = (float(np.median(row[way])) for way in ("gather", "traced"))
    pairs = float(np.median(np.array(row["traced"]) / np.array(row["gather"])))
    return [name, row["resolution"], row["layers"], 1e3 * ours, 1e3 * theirs, pairs, row["off"],
            row["apart"], row["rmse"], row["median"], row["bias"]]


def _pictures(line: Any, cell: Cell, result: dict[str, Any]) -> None:
    path, best = np.array(result["path"]), result["by_resolution"][-1]
    picture = np.array(best["picture"])
    for axis, image, title in ((line[0], path, "path tracer"),
                               (line[1], picture, f"bundles, {best['resolution']} pixels")):
        axis.imshow(np.clip(image, 0, 1) ** (1 / 2.2))
        axis.set_title(f"{cell.scene}: {title}", fontsize=9)
    off = (picture - path).sum(2) / np.maximum(path.sum(2), 1e-3)
    shown = line[2].imshow(np.where(np.array(result["out"]), np.nan, off), cmap="RdBu_r",
                           vmin=-0.5, vmax=0.5)
    line[2].set_title("relative difference (grey: left out)", fontsize=9)
    line[2].set_facecolor("0.8")
    line[2].figure.colorbar(shown, ax=line[2], shrink=0.8)
    for axis in line[:3]:
        axis.set_xticks([])
        axis.set_yticks([])
    pixels = [row["resolution"] for row in result["by_resolution"]]
    for word, text, colour in (("off", "against traced bundles", COLOURS[0]),
                               ("rmse", "against the path tracer", COLOURS[1])):
        line[3].plot(pixels, [100 * row[word] for row in result["by_resolution"]], "o-",
                     color=colour, label=text)
    line[3].axhline(100 * result["path_noise"], color="#8c8c8c", linewidth=0.8,
                    linestyle="--", label="noise of the path tracer")
    linear_axis(line[3], "y")
    log_axis(line[3], "x", base=2)
    line[3].set(xlabel="pixels a side of a projection (log)", ylabel="relative RMSE, %")
    line[3].legend(fontsize=8, frameon=False)
