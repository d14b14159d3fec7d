"""SIMD width (survey, section 4.3): how long rays wait for each other if they branch together."""
from __future__ import annotations

from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import EYE, diffuse
from gpgpu_rt.charts import COLOURS, log_axis
from gpgpu_rt.hardware.issue import WITHIN

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished, read
from .gap_work import DONE, SIDE, WIDTHS

SCENE = "kitchen"
RAYS = (EYE, diffuse(2))
PACKET = (("packet", (2, 2)),)
# Label -> method and its options.
METHODS: dict[str, tuple[str, tuple[tuple[str, Any], ...]]] = {
    "kd-short-stack": ("kd-short-stack", ()), "kd-packet 2x2": ("kd-packet", PACKET),
    "bvh-stack": ("bvh-stack", ()), "bvh-packet 2x2": ("bvh-packet", PACKET)}
ORDERS = {"as they come": (), "sorted": (("sort_rays", True),)}
HEADS = ("rays", "method", "order", "width", "utilisation", "kernel runs per ray")


def size(full: bool) -> int:
    """Return the image's pixels per side."""
    return 512 if full else 128


def _cell(rays: str, label: str, order: str, full: bool) -> Cell:
    method, options = METHODS[label]
    return Cell(SCENE, method, (*options, *ORDERS[order]), size(full), DONE + rays, 1)


def cells(full: bool) -> list[Cell]:
    return [_cell(rays, label, order, full) for rays in RAYS for label in METHODS
            for order in ORDERS]


def lanes(one: dict[str, Any], width: int) -> int:
    """Return the number of lanes, summed over all runs of kernels that visit nodes or test
    triangles. A run counts all lanes of its group, working or waiting."""
    return sum(count for kernel, count in one["lanes"][str(width)].items() if kernel not in WITHIN)


def rows(data: Path, full: bool) -> list[tuple[Any, ...]]:
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
    found = rows(data, full)
    if not found:
        return
    _, heading = finished(cells(full), data)[0]
    note = (f"{SCENE}, sample squares of {SIDE}x{SIDE} rays from {size(full)}x{size(full)} rays; "
            f"each step of each sampled ray recorded; {heading['gpu']['renderer']}, "
            f"commit {heading['commit']}."
            + (f" {SCENE} is a procedural stand-in." if heading["scene"]["stand_in"] else ""))
    write_csv(out / "simd_width.csv", HEADS, found)
    table = [(rays, label, order, *(number(100 * row[4], 2) for row in mine),
              number(mine[0][5]), number(mine[-1][5]))
             for rays in RAYS for label in METHODS for order in ORDERS
             if (mine := [row for row in found if row[:3] == (rays, label, order)])]
    write_text(out / "simd_width.md", "# Wide SIMD\n\n" + _paragraph(found) + "\n\n" + note
               + "\n\nA kernel visits a node or tests a triangle. The program has an outer loop, "
               "and in it a loop for each kernel. Fragments that branch together form a group. A "
               "group runs a kernel while any of its fragments waits for the kernel. A fragment "
               "is a lane of its group. In a kernel run, each lane either works or waits. The "
               "number in a column's head is the width: how many fragments branch together. The "
               "column shows the share of lanes that work, in %, over all kernel runs. A packet "
               "is one fragment. The last two columns show kernel runs per ray at widths 1 and "
               f"{WIDTHS[-1]}, including the runs in which the ray waits.\n\n"
               + markdown_table(
                   ("rays", "method", "order", *map(str, WIDTHS), "runs at 1",
                    f"runs at {WIDTHS[-1]}"),
                   table))
    figure, axes = plt.subplots(2, len(RAYS), figsize=(11, 7.6), sharex=True, sharey="row")
    for column, rays in enumerate(RAYS):
        for label, colour in zip(METHODS, COLOURS):
            for order, style in zip(ORDERS, ("-", "--")):
                mine = [row for row in found if row[:3] == (rays, label, order)]
                for line in (0, 1):
                    axes[line, column].plot(
                        [row[3] for row in mine],
                        [100 * row[4] if line == 0 else row[5] for row in mine], style,
                        color=colour, marker="o", markersize=3)
        axes[0, column].set_title(rays, fontsize=10)
        axes[1, column].set(xlabel="fragments that branch together (log)")
    axes[0, 0].set(ylabel="share of lanes that work, %", ylim=(0, 105))
    axes[1, 0].set(ylabel="kernel runs per ray, waiting included (log)")
    log_axis(axes[1, 0], "y")
    for axis in axes.ravel():
        log_axis(axis, "x", base=2)
        axis.spines[["top", "right"]].set_visible(False)
    axes[1, 0].set_ylim(0.8 * min(row[5] for row in found), 1.2 * max(row[5] for row in found))
    handles = [plt.Line2D([], [], color=colour, marker="o", markersize=3, label=label)
               for label, colour in zip(METHODS, COLOURS)]
    handles += [plt.Line2D([], [], color="#555555", linestyle=style, label=order)
                for order, style in zip(ORDERS, ("-", "--"))]
    axes[0, 0].legend(handles=handles, frameon=False, fontsize=8, loc="lower left")
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "simd_width.png", note, "Lines show two quantities over the "
               "number of fragments that branch together: the share of lanes that work instead of "
               "waiting, and the kernel runs per ray")


def _paragraph(found: list[tuple[Any, ...]]) -> str:
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
        "The survey makes three statements. Pixels that run in lockstep waste time, and rays on a "
        "CPU do not. Packets help where rays are coherent. Sorting might help where rays are "
        "incoherent. If "
        f"{widest} eye rays branch together, {used(eye, single, plain)} of the lanes work with "
        f"{single}, and {used(eye, tree, plain)} with {tree}. For rays after two diffuse bounces, "
        f"{used(wild, single, plain)} and {used(wild, tree, plain)} of the lanes work, and after "
        f"sorting {used(wild, single, ordered)} and {used(wild, tree, ordered)}.\n\n"
        f"For eye rays, packets of four rays need {cost(eye, packet, plain)} kernel runs per ray "
        f"in a kd-tree, and single rays {cost(eye, single, plain)}; in a BVH the numbers are "
        f"{cost(eye, packed, plain)} and {cost(eye, tree, plain)}. After the bounces, packets "
        f"need {cost(wild, packet, plain)} and single rays {cost(wild, single, plain)} runs (BVH: "
        f"{cost(wild, packed, plain)} and {cost(wild, tree, plain)}). With sorting these become "
        f"{cost(wild, packet, ordered)} and {cost(wild, single, ordered)} (BVH: "
        f"{cost(wild, packed, ordered)} and {cost(wild, tree, ordered)}). A run of a packet "
        "fetches a node or a triangle once, but does the arithmetic of four rays. Packets "
        "therefore save fetches if they need fewer runs, and save arithmetic if they need less "
        "than a quarter of the runs.\n\n"
        "At the same width, four times as many rays branch together in packets as without. If "
        f"{widest // 4} packets of four rays branch together, {widest} rays branch together, as "
        f"without packets at width {widest}. At width {widest // 4}, packets need "
        f"{cost(eye, packet, plain, widest // 4)} runs per ray for eye rays and "
        f"{cost(wild, packet, plain, widest // 4)} after the bounces "
        f"(BVH: {cost(eye, packed, plain, widest // 4)} and "
        f"{cost(wild, packed, plain, widest // 4)}). A packet also wastes time when it tests a "
        "node for rays that need not visit the node. These tests count as work: they raise the "
        "kernel runs per ray, but do not lower the share of lanes that work.")
