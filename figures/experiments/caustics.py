"""Caustics mapping (Shah et al. 2007; survey, section 5), compared with traced photons."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gpgpu_rt.charts import COLOURS, log_axis

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished
from .caustic_errors import PHOTONS, SCENES

HEADS = ("scene", "triangles", "rasterised, ms", "photons traced, ms", "times as fast",
         "landing error, median", "landing error, 90 % quantile", "light lost", "map difference",
         "map difference, in squares of 8x8", "light, rasterised / traced")


def cells(full: bool) -> list[Cell]:
    return [Cell(name, "bvh-packet", (("packet", (4, 4)), ("octants", True)), 384 if full else 160,
                 "caustics", 5 if full else 1) for name in SCENES]


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/caustics.csv, .md and .png."""
    results = finished(cells(full), data)
    if not results:
        return
    rows = [_row(cell.scene, result["caustics"]) for cell, result in results]
    write_csv(out / "caustics.csv", HEADS, rows)
    shown = [[row[0], f"{row[1]:,}", *map(number, row[2:5]), f"{row[5]:.3f}", f"{row[6]:.3f}",
              *(f"{value:.1%}" for value in row[7:])] for row in rows]
    guesses = results[0][1]["caustics"]["iterations"]
    note = (f"{results[0][1]['gpu']['renderer']}, {PHOTONS} x {PHOTONS} photons; refractors and a "
            "mirror, 2 to 4 units wide, over a floor 10 units wide. The distance of each photon "
            f"to its receiver is estimated {guesses} times. Photons are traced by bvh-packet 4x4, "
            "and their time includes numpy's work between passes")
    write_text(out / "caustics.md", (
        "# Caustics mapping\n\n"
        "To find the point where a photon lands, caustics mapping searches an image of the scene "
        "as the light sees it. For comparison, the same photons are traced as rays through "
        "the same refractor and added to a second map of the same kind. Renderer and settings: "
        + note + ".\n\n"
        "* Times as fast: the time of the traced photons divided by the time of caustics mapping, "
        "as a median of the runs.\n"
        "* Landing error: the distance, in units of the scene, between the points where a mapped "
        "photon and its traced ray land. For 90 % of the photons the distance is at most the 90 % "
        "quantile.\n"
        "* Light lost: the share of the light whose photons land if they are traced, but not if "
        "they are mapped. Either the search fails, or the mapped photon finds no way out of the "
        "refractor.\n"
        "* Map difference: the sum of the absolute differences between the pixels of both maps, "
        "divided by the light in the traced map. In squares of 8x8, both maps are first summed "
        "over squares of 8x8 pixels, so smaller shifts do not count.\n"
        "* Light, rasterised / traced: the light in the rasterised map divided by the light in "
        "the traced map.\n\n"
        + markdown_table(HEADS, shown)))
    figure, axes = plt.subplots(len(results), 4, figsize=(13, 3 * len(results)), squeeze=False)
    for line, (cell, result) in zip(axes, results):
        _pictures(line, cell, result["caustics"])
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    save_chart(figure, out / "caustics.png", note,
               "Pictures of caustics by traced photons and by rasterised photons, their "
               "difference, and the error of where photons land")


def _row(name: str, result: dict[str, Any]) -> list[Any]:
    at = result["guesses"].index(result["iterations"])
    ours, theirs = (np.array(result["seconds"][way]) for way in ("rasterised", "traced"))
    return [name, result["triangles"], 1e3 * float(np.median(ours)),
            1e3 * float(np.median(theirs)), float(np.median(theirs / ours)),
            *(result["apart"][at] or (np.nan, np.nan)), max(result["lost"][at], 0.0),
            result["map_off"], result["blurred_off"], result["brighter"]]


def _pictures(line: Any, cell: Cell, result: dict[str, Any]) -> None:
    shade, hidden = np.array(result["shade"]), np.array(result["hidden"])
    caustic = {way: np.array(result[way]) for way in ("traced", "rasterised")}
    white = 1.6 * float(np.quantile(shade, 0.99))
    for axis, way in zip(line, caustic):
        light = np.clip((shade + caustic[way]) / white, 0, 1)[:, :, None] ** (1 / 2.2)
        veiled = 0.75 * light + 0.25 * np.array([0.45, 0.65, 0.85])
        axis.imshow(np.where(hidden[:, :, None], veiled, light * np.array([1.0, 0.97, 0.9])))
        axis.set_title(f"{cell.scene}: {way}", fontsize=9)
    off = (caustic["rasterised"] - caustic["traced"]) / white
    shown = line[2].imshow(off, cmap="RdBu_r", vmin=-0.5, vmax=0.5)
    line[2].figure.colorbar(shown, ax=line[2], shrink=0.8)
    line[2].set_title("rasterised minus traced, relative to white", fontsize=9)
    for axis in line[:3]:
        axis.set_xticks([])
        axis.set_yticks([])
    apart = np.array([pair or (np.nan, np.nan) for pair in result["apart"]])
    for k, (text, colour) in enumerate((("median", COLOURS[0]), ("90 % quantile", COLOURS[1]))):
        line[3].plot(result["guesses"], apart[:, k], "o-", markersize=3, color=colour, label=text)
    log_axis(line[3], "y")
    line[3].set(xlabel="estimates of each photon's\ndistance to its receiver",
                ylabel="landing error, units (log)")
    line[3].grid(alpha=0.3, which="both")
    line[3].legend(fontsize=8, frameon=False)
