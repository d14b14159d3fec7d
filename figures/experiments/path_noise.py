"""Path noise: plots the error of path tracing against the number of samples, by sampler."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.charts import COLOURS, log_axis

from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text
from ..framework.results import finished
from .path_errors import cornell_truth

SCENE, METHOD, SIZE, ROULETTE = "cornell-light", "bvh-threaded", 64, 16
SAMPLERS = {"random": COLOURS[1], "sobol": COLOURS[0]}
# Targets: upper limits of the mean relative error.
BARS = {"scene": 0.01, "furnace_mean": 0.005}
HEADS = ("sampler", "samples", "Cornell box, mean relative error", "furnace, pixels",
         "furnace, mean")


def cells(full: bool) -> list[Cell]:
    return [Cell(SCENE, METHOD, (("roulette", ROULETTE), ("sampler", sampler),
                                 ("samples", 4096 if full else 128)), SIZE, "path errors", 1)
            for sampler in SAMPLERS]


def rows(data: Path, full: bool) -> list[list[Any]]:
    found = []
    for cell, result in finished(cells(full), data):
        errors = result["errors"]
        found += [[dict(cell.options)["sampler"], int(samples), error, errors["furnace"][samples],
                   errors["furnace_mean"][samples]] for samples, error in errors["scene"].items()]
    return found


def draw(data: Path, out: Path, full: bool) -> None:
    found = rows(data, full)
    if not found:
        return
    _, result = finished(cells(full), data)[0]
    write_csv(out / "path_noise.csv", HEADS, found)
    note = (f"{SCENE} at {SIZE}x{SIZE}, Russian roulette from vertex {ROULETTE}, by {METHOD}; "
            f"renderer: {result['gpu']['renderer']}.")
    write_text(out / "path_noise.md", (
        "# Path tracing: the error by number of samples\n\n" + note + " The picture of the "
        "Cornell box is compared with a picture by Mitsuba 3 (Jakob et al. 2022; "
        "`figures/measured`), in each channel of each pixel that is not black. The "
        f"noise of Mitsuba's picture, {result['errors']['truth_noise']:.2%}, is subtracted under "
        "the assumption that the errors of the two pictures are independent. The furnace is "
        "a closed box whose walls emit and reflect evenly, so a formula gives its radiance. "
        "The furnace's error is shown for single pixels and for the mean of all pixels.\n\n"
        + markdown_table(HEADS, [[row[0], row[1], *(f"{error:.3%}" for error in row[2:])]
                                 for row in found])))
    figure, (left, right, *pictures) = plt.subplots(
        1, 4, figsize=(15, 4.2), width_ratios=(3, 3, 2, 2), layout="constrained")
    figure.get_layout_engine().set(rect=(0, 0.06, 1, 0.94))
    for sampler, colour in SAMPLERS.items():
        some = [row for row in found if row[0] == sampler]
        samples = [row[1] for row in some]
        left.plot(samples, [100 * row[2] for row in some], "o-", color=colour, label=sampler)
        right.plot(samples, [100 * row[3] for row in some], "o-", color=colour,
                   label=f"{sampler}, pixels")
        right.plot(samples, [100 * row[4] for row in some], "s--", color=colour,
                   label=f"{sampler}, mean")
        if some and sampler == "random":
            slope = 100 * some[0][2] * np.sqrt(samples[0] / np.array(samples))
            left.plot(samples, slope, ":", color="#8c8c8c", label="1 / sqrt(samples)")
    for axis, title, bar in ((left, "Cornell box, mean relative error, % (log)", BARS["scene"]),
                             (right, "furnace, relative error, % (log)", BARS["furnace_mean"])):
        axis.axhline(100 * bar, color="#333333", linewidth=0.8, label="target")
        log_axis(axis, "x", base=2)
        log_axis(axis, "y")
        axis.set(title=title, xlabel="samples a pixel (log)")
        axis.legend(fontsize=8, frameon=False)
        axis.spines[["top", "right"]].set_visible(False)
        axis.title.set_fontsize(9)
    truth = cornell_truth()[0]
    for axis, sampler in zip(pictures, SAMPLERS):
        with rt.Tracer(SCENE, METHOD) as tracer:
            tracer.render(size=(SIZE, SIZE), integrator="path", samples=64, sampler=sampler,
                          roulette=ROULETTE)
            off = np.abs(tracer.radiance - truth) / np.where(truth > 0, truth, 1)
        shown = axis.imshow(off.mean(axis=2), vmin=0, vmax=0.3, cmap="magma")
        axis.set_title(f"{sampler}, 64 samples: relative error", fontsize=9)
        axis.axis("off")
    figure.colorbar(shown, ax=pictures, fraction=0.05)
    save_chart(figure, out / "path_noise.png", note, "Lines show how the error of path-traced "
               "pictures falls with the number of samples, for Sobol' points and for random "
               "numbers. Two pictures show where the error lies")
