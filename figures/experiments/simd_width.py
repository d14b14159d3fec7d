"""SIMD width (survey, section 4.3): how long rays that branch together wait for each other.

The waiting is measured by width, with and without packets, and with and without sorting.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import EYE, diffuse

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished, read
from .gap_work import DONE, WIDTHS

SCENE = "kitchen"
RAYS = (EYE, diffuse(2))
# Label -> method, its options, and the number of rays per fragment.
METHODS: dict[str, tuple[str, tuple[tuple[str, Any], ...], int]] = {
    "kd-short-stack": ("kd-short-stack", (), 1),
    "kd-packet 2x2": ("kd-packet", (("packet", (2, 2)),), 4),
    "bvh-stack": ("bvh-stack", (), 1),
    "bvh-packet 2x2": ("bvh-packet", (("packet", (2, 2)),), 4)}
ORDERS = {"as they come": (), "sorted": (("sort_rays", True),)}
COLOURS = {"kd-short-stack": "#7a4fa3", "kd-packet 2x2": "#c27bd1", "bvh-stack": "#3d8b57",
           "bvh-packet 2x2": "#8cc79d"}
HEADS = ("rays", "method", "order", "width", "utilisation", "instructions a ray")


def size(full: bool) -> int:
    """Pixels per side."""
    return 512 if full else 128


def _cell(rays: str, label: str, order: str, full: bool) -> Cell:
    method, options, _ = METHODS[label]
    return Cell(SCENE, method, (*options, *ORDERS[order]), size(full), DONE + rays, 1)


def cells(full: bool) -> list[Cell]:
    return [_cell(rays, label, order, full) for rays in RAYS for label in METHODS
            for order in ORDERS]


def lanes(one: dict[str, Any], width: int) -> float:
    """Vector instructions of all lanes, including the lanes that wait."""
    return sum(width * region["runs"][str(width)] * region["vector"] for region in one["regions"])


def rows(data: Path, full: bool) -> list[tuple[Any, ...]]:
    """The rows of the table whose columns are HEADS."""
    found = []
    for rays in RAYS:
        for label in METHODS:
            for order in ORDERS:
                result = read(_cell(rays, label, order, full), data)
                if result is None:
                    continue
                one = result["gap"]
                found += [(rays, label, order, width, lanes(one, 1) / lanes(one, width),
                           lanes(one, width) / one["count"]) for width in WIDTHS]
    return found


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/simd_width.csv, .md and .png."""
    found = rows(data, full)
    if not found:
        return
    _, heading = finished(cells(full), data)[0]
    note = (f"{SCENE}, squares of 32x32 out of {size(full)}x{size(full)} rays; programs emulated "
            f"instruction by instruction; {heading['gpu']['renderer']}, commit "
            f"{heading['commit']}."
            + (f" {SCENE} is a procedural stand-in." if heading["scene"]["stand_in"] else ""))
    write_csv(out / "simd_width.csv", HEADS, found)
    table = [(rays, label, order, *(number(100 * row[4], 2) for row in mine),
              number(mine[0][5]), number(mine[-1][5]))
             for rays in RAYS for label in METHODS for order in ORDERS
             if (mine := [row for row in found if row[:3] == (rays, label, order)])]
    write_text(out / "simd_width.md", "# Wide SIMD\n\n" + _paragraph(found) + "\n\n" + note
               + "\n\nThe columns with numbers as heads show the percentage of the lanes' time "
               "that is not spent waiting, by the number of fragments that branch together (the "
               "width). The last two columns show vector instructions per ray at widths 1 and "
               f"{WIDTHS[-1]}.\n\n" + markdown_table(
                   ("rays", "method", "order", *map(str, WIDTHS), "instructions at 1",
                    f"instructions at {WIDTHS[-1]}"),
                   table))
    figure, axes = plt.subplots(2, len(RAYS), figsize=(11, 7.6), sharex=True, sharey="row")
    for column, rays in enumerate(RAYS):
        for label, colour in COLOURS.items():
            for order, style in zip(ORDERS, ("-", "--")):
                mine = [row for row in found if row[:3] == (rays, label, order)]
                for line in (0, 1):
                    axes[line, column].plot(
                        [row[3] for row in mine],
                        [100 * row[4] if line == 0 else row[5] for row in mine], style,
                        color=colour, marker="o", markersize=3,
                        label=f"{label}, {order}" if mine else None)
        axes[0, column].set_title(rays, fontsize=10)
        axes[1, column].set(xlabel="fragments that branch together")
    axes[0, 0].set(ylabel="lanes' time not spent waiting, %", ylim=(0, 105))
    axes[1, 0].set(ylabel="vector instructions a ray, with waiting", yscale="log")
    for axis in axes.ravel():
        axis.set_xscale("log", base=2)
        axis.set_xticks(WIDTHS, map(str, WIDTHS), fontsize=8)
        axis.minorticks_off()
        axis.spines[["top", "right"]].set_visible(False)
    ticks = [digit * 10 ** power for power in range(2, 6) for digit in (1, 2, 5)]
    axes[1, 0].set_yticks(ticks, [f"{tick:,}" for tick in ticks])
    axes[1, 0].set_ylim(0.8 * min(row[5] for row in found), 1.2 * max(row[5] for row in found))
    axes[0, 0].legend(frameon=False, fontsize=8, loc="lower left")
    figure.suptitle("How long rays that branch together wait for each other, by their number",
                    fontsize=11)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "simd_width.png", note)


def _paragraph(found: list[tuple[Any, ...]]) -> str:
    """Sentences on what the survey expects, and on what the rows show."""
    at = {row[:4]: row for row in found}
    widest = WIDTHS[-1]
    plain, ordered = ORDERS

    def used(rays: str, label: str, order: str) -> str:
        row = at.get((rays, label, order, widest))
        return f"{100 * row[4]:.0f} %" if row else "-"

    def cost(rays: str, label: str, order: str, width: int = widest) -> str:
        row = at.get((rays, label, order, width))
        return number(row[5]) if row else "-"
    eye, wild = RAYS
    single, packet = "kd-short-stack", "kd-packet 2x2"
    tree, packed = "bvh-stack", "bvh-packet 2x2"
    return (
        "The survey says that pixels which must run in lockstep waste time, unlike a CPU, that "
        "packets help where rays are coherent, and that sorting might help where they are not. If "
        f"{widest} eye rays branch together, {used(eye, single, plain)} of the lanes' time is "
        f"useful with {single}, and {used(eye, tree, plain)} with {tree}. For rays after two "
        f"diffuse bounces, {used(wild, single, plain)} and {used(wild, tree, plain)} are useful, "
        f"and after sorting {used(wild, single, ordered)} and {used(wild, tree, ordered)}.\n\n"
        f"For eye rays, packets of four rays issue {cost(eye, packet, plain)} instructions a ray "
        f"in a kd-tree, and single rays {cost(eye, single, plain)}; in a BVH the numbers are "
        f"{cost(eye, packed, plain)} and {cost(eye, tree, plain)}. After the bounces, packets "
        f"issue {cost(wild, packet, plain)} and single rays {cost(wild, single, plain)} "
        f"instructions (BVH: {cost(wild, packed, plain)} and {cost(wild, tree, plain)}). With "
        f"sorting these become {cost(wild, packet, ordered)} and {cost(wild, single, ordered)} "
        f"(BVH: {cost(wild, packed, ordered)} and {cost(wild, tree, ordered)}).\n\n"
        "At the same width, four times as many rays branch together in packets as without. On "
        f"{widest // 4} lanes, where packets also have {widest} rays, they issue "
        f"{cost(eye, packet, plain, widest // 4)} instructions for eye rays and "
        f"{cost(wild, packet, plain, widest // 4)} after the bounces "
        f"(BVH: {cost(eye, packed, plain, widest // 4)} and "
        f"{cost(wild, packed, plain, widest // 4)}). A packet also wastes time when it tests a "
        "node for rays that need not visit the node. Here this counts as work, so only the "
        "instructions per ray show it.")
