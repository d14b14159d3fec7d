"""Era machine page: writes the tables, the sentences on targets and the chart of era_machine."""
from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from gpgpu_rt.hardware.machine_model import SHARES

from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_views import VIEWS

if TYPE_CHECKING:
    from ..framework.predicted_times import PredictedRow

# The bars (targets). The median of |log2(predicted / published)| should be at most MEDIAN, and at
# most VARIED with one assumption changed. tau-b should be at least TAU in every scene, and at
# least HIGH_TAU in the share MANY of the scenes.
MEDIAN, VARIED, TAU, HIGH_TAU, MANY = 0.32, 0.6, 0.6, 0.8, 0.8
FAR = 1.0     # |log2 ratio| of a prediction that is off by a factor of two
HEADS = ("figure", "card", "scene", "method", "form", "scored", "published_ns", "predicted_ns",
         "ratio", *SHARES, "view")
ABOUT = """# The papers' cards: predicted times without fitted constants

Mesa's compiler for the card compiles the era form of each kernel: the form that cards of the
papers' time can run (`docs/era.md`). Traces of the rays show how often the card issues each
kernel, and how many lanes wait meanwhile. `gpgpu-rt hardware` prints the card's rates, which the
model uses. No constant is fitted. A ratio is the predicted time divided by the published time.
Figures 12, 13, 16, 20 and 22 hold the same predictions beside the times measured here. Scenes
whose mesh is missing are left out; `gpgpu-rt scenes --fetch` loads the papers' meshes. Without
them, the page covers only scenes that need no mesh, such as cornell.

The model leaves out misses of the texture cache, shading, transfers, and passes that make rays or
set them up. A card's limit on loop iterations adds passes, which the model leaves out, too. It
also leaves out latency that is exposed when too few fragments are in flight. The vendors'
compilers may have needed fewer instructions than Mesa's; on NV40, Mesa needs three instructions
to select one of two values. An instruction of NV40 on this page means a clock of a pipe. In a
clock, the pipe's two units may issue several operations. Each kernel of a loop was compiled as a
separate program. The instructions that move the state to this program's outputs therefore count,
although the loop does not need them. Kernels of packets of 2x2 rays write only the fields that
they change, so fewer moves count: about one in 30 instructions is such a move. Each of these
points can make predictions wrong, and published numbers do not show how much each contributes. So
if predictions miss a bar (a target below), the page cannot say why.

A *program form* is an order of the kernels in a card's program. Most papers do not publish the
order of their loops, so the choice of a form is an assumption too. The table lists several forms
of a figure's programs, and the first of these forms is scored. In
`step` the program is a loop, and an iteration runs one step of each ray. In `while-while` the loop
has an inner loop for each kernel. In `step, 256 pixels` only about 256 pixels branch together on
NV40, as on its successor. The reason for this form: a program that needs many registers probably
has fewer pixels in flight, so fewer pixels can branch together. In `while-while, uncoalesced` each
lane of G80 loads nodes and triangles in a memory transaction of its own. These loads bypass the
texture cache. In `passes` each pass runs one kernel, and the early depth test rejects each quad of
pixels without a waiting ray. In `packets` the 32 rays of a packet are the lanes of a warp. Each
lane runs the kernels of a single ray at every node of its packet, and the warp loads a node or a
triangle once. No packet of 32 rays was traced: the nodes come from traces of its two halves of 4x4
rays, which do not tell in which order the whole packet visits the nodes. Votes and the shared
stack are left out. On R580 a fragment traces a packet of 2x2 rays. Each component of a vector
belongs to one of the four rays, and 48 packets branch together.
"""
PARTS = """The survey shows the papers' images only as small pictures and does not state their
views. Cornell University's data and BART's files publish a view. Our images of cornell, kitchen
and robots have these views; their lights are chosen here. So shadow rays, and the whole images of
Figure 20, do not count as rays of a published view. The views of bunny and conference are
chosen here, and our conference room is another edition. A row of the table leaves out published
times of brute force that are too short to test every triangle. All eye rays start at the same
point, so a part of the test can be computed once for each triangle. Even then a test needs three
dot products. A time is too short if the card cannot issue these dot products within it.
"""
BY_METHOD = """A median of 1 means that the predicted times are twice the published times, and a
median of -1 that they are half the published times.
"""


def write_page(found: Sequence[PredictedRow], misses: Mapping[str, float],
               taus: Mapping[tuple[str, str], float],
               parts: Mapping[str, tuple[int, float]], out: Path) -> None:
    """Write the page, its table and its chart.

    Parameters
    ----------
    misses : assumption -> the median of |log2 ratio|; the first entry changes no assumption
    taus : (figure, panel) -> tau-b
    parts : part of the rows -> the number of predictions, and the median of |log2 ratio|
    """
    times = [row.time() for row in found]
    lines = [(*_words(row), row.scored, row.published, 1e9 * time.seconds, row.ratio(),
              *(1e9 * time.parts[name] for name in SHARES), _view(row))
             for row, time in zip(found, times)]
    write_csv(out / "era_machine.csv", HEADS, lines)
    heads = (*HEADS[:5], "published ns", "predicted ns", "ratio", "bound by", "view")
    table = markdown_table(heads, [
        (*_words(row), number(row.published), number(1e9 * time.seconds), number(row.ratio()),
         max(SHARES, key=time.parts.__getitem__), _view(row)) for row, time in zip(found, times)])
    write_text(out / "era_machine.md", "\n".join([
        ABOUT, f"{_sizes(found)}\n",
        "## Bars\n", *(f"* {line}" for line in bars(misses, taus)), "",
        "## Parts of the predictions\n", PARTS,
        markdown_table(("predictions", "number", "median of abs log2 ratio"),
                       [(name, count, number(miss)) for name, (count, miss) in parts.items()]),
        "## Deviations by method\n", BY_METHOD,
        markdown_table(("figure", "card", "method", "form", "number", "median of log2 ratio",
                        "least", "most"), by_method(found)),
        "## Assumptions halved and doubled\n",
        markdown_table(("assumption", "median of abs log2 ratio"),
                       [(name, number(miss)) for name, miss in misses.items()]),
        "## Order of the methods\n",
        markdown_table(("figure", "scene", "tau-b"),
                       [(*group, number(tau)) for group, tau in taus.items()]),
        "## Predictions off by more than a factor of two\n",
        *(f"* {line}" for line in far_off(found)), "",
        "## Times\n", table]))
    if found:
        _chart(found, out)


def bars(misses: Mapping[str, float], taus: Mapping[tuple[str, str], float]) -> list[str]:
    """Return a sentence for each bar: whether it is met, or by how much it is missed."""
    stated, *changed = misses.values()
    low = [f"{figure} {panel} ({number(tau)})" for (figure, panel), tau in taus.items()
           if not tau >= TAU]
    high, wanted = sum(tau >= HIGH_TAU for tau in taus.values()), round(MANY * len(taus))
    return [
        _bar("The median of |log2(predicted / published)|", stated, MEDIAN),
        _bar("With one assumption halved or doubled, the largest median", max(changed), VARIED),
        f"tau-b is below {TAU} in {len(low)} of {len(taus)} scenes"
        + (": missed in " + ", ".join(low) + "." if low else ": met."),
        f"tau-b is {HIGH_TAU} or more in {high} of {len(taus)} scenes; the bar is {wanted}: "
        + ("met." if high >= wanted else f"missed by {wanted - high} scenes.")]


def by_method(found: Sequence[PredictedRow]) -> list[tuple[Any, ...]]:
    """Return the number, median, minimum and maximum of the scored log2 ratios by method."""
    groups: dict[tuple[str, ...], list[float]] = {}
    for row in found:
        if row.scored:
            figure, chip, _, method, form = _words(row)
            groups.setdefault((figure, chip, method, form), []).append(math.log2(row.ratio()))
    return [(*group, len(logs), *map(number, (statistics.median(logs), min(logs), max(logs))))
            for group, logs in groups.items()]


def far_off(found: Sequence[PredictedRow]) -> list[str]:
    """Return a sentence for each scored row that is off by more than FAR, the farthest first.

    The sentence compares two numbers for a run of a kernel: the instructions that the published
    time of a ray leaves for each run, and the instructions that the run takes.
    """
    far = sorted((row for row in found if row.scored and abs(math.log2(row.ratio())) > FAR),
                 key=lambda row: -abs(math.log2(row.ratio())))
    return [f"{row.figure.name}, {row.panel.label}, {row.column.label}: predicted "
            f"{number(row.ratio())} times the published time. {row.per.capitalize()} runs "
            f"{number(row.runs)} kernels. The published time leaves {number(row.allowed)} "
            f"instructions for each run; the compiled kernels take {number(row.instructions)}, "
            f"and waiting lanes raise this to {number(row.issued_instructions)}." for row in far]


def _bar(what: str, value: float, most: float) -> str:
    ending = "met" if value <= most else f"missed by {number(value - most)}"
    return f"{what} is {number(value)}; the bar is {most}: {ending}."


def _sizes(found: Sequence[PredictedRow]) -> str:
    sizes = {row.figure.name: row.paper_card.size for row in found}
    return ("A prediction depends on the image size, and is for the size of the paper's images: "
            + ", ".join(f"{size}x{size} pixels in {name}" for name, size in sizes.items()) + ".")


def _view(row: PredictedRow) -> str:
    if row.panel.scene not in VIEWS:
        return "chosen"
    return "published" if row.published_view else "published; light chosen"


def _words(row: PredictedRow) -> tuple[str, ...]:
    return (row.figure.name, row.paper_card.chip, row.panel.label, row.column.label,
            row.form)


def _chart(found: Sequence[PredictedRow], out: Path) -> None:
    """Draw a chart for each card: the mean share of each resource in a ray's predicted time, by
    method."""
    cards: dict[str, dict[str, list[PredictedRow]]] = {}
    for row in found:
        label = f"{row.column.label}, {row.form}"
        cards.setdefault(row.paper_card.card.name, {}).setdefault(label, []).append(row)
    figure, axes = plt.subplots(
        len(cards), squeeze=False, sharex=True, figsize=(8, 1.4 + 0.5 * len(cards) + 0.24 * sum(
            map(len, cards.values()))), height_ratios=[len(rows) + 1 for rows in cards.values()])
    for axis, (card, rows) in zip(axes[:, 0], cards.items()):
        shares = np.array([np.mean([[part / row.time().seconds
                                     for part in row.time().parts.values()] for row in some],
                                   axis=0) for some in rows.values()])
        starts = np.cumsum(shares, axis=1) - shares
        for at, name in enumerate(SHARES):
            axis.barh(list(rows), shares[:, at], left=starts[:, at], label=name)
        axis.invert_yaxis()
        axis.set_title(card, fontsize=10, loc="left")
        axis.tick_params(axis="y", labelsize=8)
        axis.spines[["top", "right"]].set_visible(False)
    axes[-1, 0].set(xlim=(0, 1), xlabel="share of the predicted time")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), frameon=False, ncols=len(SHARES),
                  loc="upper center", fontsize=8)
    figure.tight_layout(rect=(0, 0.04, 1, 0.97))
    save_chart(figure, out / "era_machine.png", "The time of idle lanes is shown as waiting "
               "lanes. A kernel's other time counts for the resource that bounds the kernel.",
               "For each method, bars divide the predicted time into the shares that the "
               "resources of a card bound")
