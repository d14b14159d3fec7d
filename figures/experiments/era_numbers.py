"""Era numbers: counts the rays that go wrong in the number formats of the papers' cards.

The Ray Engine computes in the fixed point of R200 and NV25. Other methods run in the era form
(docs/era.md), in fp24 and fp32.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.accel.bounds import unit_normals
from gpgpu_rt.bench.workloads import load

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished, read
from .lost_rays import EXACT, WORK, wrong_pixels

SCENES = ("cornell", "bunny", "robots", "kitchen")
# Label -> method and options.
FORMATS: dict[str, tuple[str, tuple[tuple[str, Any], ...]]] = {
    "Ray Engine, R200": ("ray-engine", (("fixed_point", "r200"),)),
    "Ray Engine, NV25": ("ray-engine", (("fixed_point", "nv25"),)),
    "grid, fp24": ("grid", (("era", "r420"),)),
    "kd-restart, fp24": ("kd-restart", (("era", "r420"),)),
    "bvh-threaded, fp24": ("bvh-threaded", (("era", "r420"),)),
    "bvh-threaded, fp32": ("bvh-threaded", (("era", "nv40"),))}
HEADS = ("scene", "method and format", "rays that hit", "no hit", "another triangle", "false hit",
         "median error of t")
ABOUT = """# Number formats of the papers' cards: what fixed point and fp24 lose

R200 and NV25 computed in fixed point, R300 and R420 in fp24, NV40 and R580 in fp32. Each row
compares the eye rays of an image with the exact hits: the hits in fp32 with the watertight test,
which are the same for all methods of this program. Some rays with an exact hit have *no hit* in
the row's format, and some hit *another triangle*. Where two surfaces meet, both triangles may lie
at the same distance, and rounding then decides which triangle is hit. A *false hit* is the hit of
a ray that has no exact hit. Shares are of the rays with an exact hit. The error of t is divided by
the exact t. Its median is over the rays that hit the right triangle.

NV25's numbers have about 64 steps across a scene. The fixed point of the Ray Engine is a
reconstruction (`glsl/methods/ray_engine/fixed_point.glsl`).
The era form has the triangle test of the papers and no slack around boxes. `docs/era.md` says
which hits its kd-trees lose.
"""


def _cell(scene: str, label: str, full: bool) -> Cell:
    method, options = FORMATS[label]
    return Cell(scene, method, options, 512 if full else 256, WORK, 1)


def cells(full: bool) -> list[Cell]:
    return [_cell(scene, label, full) for scene in SCENES for label in FORMATS]


def rows(data: Path, full: bool) -> list[tuple[Any, ...]]:
    return [(scene, label, *(result["numbers"][key]
                             for key in ("hit", "lost", "other", "false", "t_error")))
            for scene in SCENES for label in FORMATS
            if (result := read(_cell(scene, label, full), data))]


def draw(data: Path, out: Path, full: bool) -> None:
    found = rows(data, full)
    if not found:
        return
    write_csv(out / "era_numbers.csv", HEADS, found)
    results = [result for _, result in finished(cells(full), data)]
    stand_ins = sorted({one["scene"]["name"] for one in results if one["scene"]["stand_in"]})
    lines = [(scene, label, f"{hit:,}",
              *(f"{100 * count / max(hit, 1):.3g} %" for count in wrong), number(error))
             for scene, label, hit, *wrong, error in found]
    write_text(out / "era_numbers.md", ABOUT + "\n" + markdown_table(HEADS, lines)
               + (f"\nThese scenes are procedural stand-ins: {', '.join(stand_ins)}.\n"
                  if stand_ins else ""))
    scenes = list(dict.fromkeys(row[0] for row in found))
    figure, axes = plt.subplots(len(scenes), len(FORMATS), squeeze=False, layout="constrained",
                                figsize=(2.1 * len(FORMATS), 0.9 + 2.3 * len(scenes)))
    for axis in axes.flat:
        axis.set_axis_off()
    for line, scene in zip(axes, scenes):
        for axis, label in zip(line, FORMATS):
            result = read(_cell(scene, label, full), data)
            if result is not None:
                axis.imshow(_picture(scene, result["numbers"], _cell(scene, label, full).size))
                axis.set_title(f"{scene}: {label}", fontsize=7)
    save_chart(figure, out / "era_numbers.png", f"{results[0]['gpu']['renderer']}, commit "
               f"{results[0]['commit']}. Red: no hit; blue: a wrong hit.",
               "Pictures of the scenes in each number format of the papers' cards; marked "
               "pixels have no hit or a wrong hit")


def _picture(scene: str, result: dict[str, Any], size: int) -> np.ndarray:
    """Return the scene in grey with its wrong pixels in colour, (size, size, 3) float."""
    loaded = load(scene)
    origins, directions = loaded.camera.rays((size, size))
    with rt.Tracer(loaded, EXACT) as tracer:
        hits = tracer.trace(origins, directions)
    towards = directions / np.linalg.norm(directions, axis=-1, keepdims=True)
    normals = unit_normals(loaded.triangles)[np.maximum(hits.image("triangle"), 0)]
    facing = np.abs((normals * towards).sum(axis=-1))
    grey = np.where(hits.image("hit"), 0.35 + 0.5 * facing, 0.95)
    picture = np.repeat(grey[..., None], 3, axis=2)
    lost, wrong = wrong_pixels(result, size)
    picture[lost], picture[wrong] = (0.85, 0.1, 0.1), (0.1, 0.3, 0.9)
    return picture
