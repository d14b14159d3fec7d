"""Image-space refraction (Wyman 2005; survey, section 5), compared with rays in float64."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished

SCENES = ("ball", "bunny")
HEADS = ("scene", "triangles", "rasterised, ms", "two rays traced, ms",
         "light that enters and leaves", "of these, also when rasterised",
         "error, median, degrees", "error, 90 % quantile, degrees")
LEFT = 1      # a pixel whose light leaves the mesh (render/image_space/refraction.py)


def cells(full: bool) -> list[Cell]:
    return [Cell(name, "bvh-packet", (("packet", (4, 4)), ("octants", True)), 192 if full else 96,
                 "refraction", 5 if full else 3) for name in SCENES]


def draw(data: Path, out: Path, full: bool) -> None:
    results = finished(cells(full), data)
    if not results:
        return
    rows = [_row(cell.scene, result["refraction"]) for cell, result in results]
    write_csv(out / "refraction.csv", HEADS, rows)
    shown = [[row[0], f"{row[1]:,}", *map(number, row[2:4]), f"{row[4]:.1%}", f"{row[5]:.1%}",
              *map(number, row[6:])] for row in rows]
    size = results[0][0].size
    note = (f"{results[0][1]['gpu']['renderer']}, {size} x {size} pixels, index 1.5, surrounded "
            "by a distant chequered sphere. Grey pixels: at least one of the two methods finds "
            "no light that enters and leaves the mesh.")
    write_text(out / "refraction.md", (
        "# Image-space refraction\n\n"
        "A mesh refracts light. Two passes of the rasteriser estimate where the light leaves "
        "the mesh. The estimates are compared with float64 rays that enter and leave the mesh. "
        "The estimate is right for slabs and good inside convex shapes. It is wrong towards "
        "silhouettes, where it assumes total reflection, and wherever the mesh folds in front "
        "of itself.\n\n"
        "\"Light that enters and leaves\" is the share of the mesh's pixels whose float64 ray "
        "enters and leaves the mesh. \"Of these, also when rasterised\" is the share of these "
        "pixels in which the rasterised light also leaves the mesh. The error is measured where "
        "both the float64 ray and the rasterised light leave the mesh: it is the angle "
        "between them.\n\n"
        "Renderer and settings: " + note + "\n\n"
        + markdown_table(HEADS, shown)))
    figure, axes = plt.subplots(len(results), 3, figsize=(9.6, 3.3 * len(results)), squeeze=False)
    for line, (cell, result) in zip(axes, results):
        _pictures(line, cell, result["refraction"])
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "refraction.png", note,
               "Pictures of refraction by two passes of the rasteriser and by traced rays, and "
               "their difference")


def _row(name: str, result: dict[str, Any]) -> list[Any]:
    kind, right = np.array(result["kind"]), np.array(result["right"])
    off = np.array([v for v in result["off"] if v is not None])
    through = right == LEFT
    return [name, result["triangles"],
            *(1e3 * float(np.median(result["seconds"][way])) for way in ("rasterised", "traced")),
            through.sum() / max(1, (right > 0).sum()),
            (through & (kind == LEFT)).sum() / max(1, through.sum()),
            float(np.median(off)), float(np.quantile(off, 0.9))]


def _pictures(line: Any, cell: Cell, result: dict[str, Any]) -> None:
    shape = (cell.size, cell.size)
    for axis, way, kind in ((line[0], "truth", "right"), (line[1], "found", "kind")):
        directions = np.array(result[way]).reshape(*shape, 3)
        drawn = np.array(result[kind]).reshape(shape) > 0
        axis.imshow(np.where(drawn[:, :, None], _chequers(directions), 1.0))
        axis.set_title(f"{cell.scene}, {'float64' if way == 'truth' else 'rasterised'}",
                       fontsize=9)
    off = np.array([np.nan if v is None else v for v in result["off"]], float).reshape(shape)
    outside = np.array(result["right"]).reshape(shape) == 0
    line[2].imshow(np.where(outside[:, :, None], 1.0, 0.75) * np.ones(3))
    shown = line[2].imshow(off, cmap="magma_r", vmin=0, vmax=20)
    line[2].figure.colorbar(shown, ax=line[2], shrink=0.8, label="degrees off")
    for axis in line:
        axis.set_xticks([])
        axis.set_yticks([])


def _chequers(directions: np.ndarray) -> np.ndarray:
    """Return the surroundings' colours, (h, w, 3), in squares of 15 degrees."""
    x, y, z = np.moveaxis(directions, 2, 0)
    squares = (np.floor(np.degrees(np.arctan2(x, -z)) / 15)
               + np.floor(np.degrees(np.arcsin(np.clip(y, -1, 1))) / 15)) % 2
    dark, light = np.array([0.16, 0.33, 0.55]), np.array([0.93, 0.88, 0.76])
    return np.where(squares[:, :, None] > 0, dark, light)
