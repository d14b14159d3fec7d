"""Figure 14: mirrors upon mirrors, with and without packets (Horn et al. 2007)."""
from __future__ import annotations

from itertools import accumulate
from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import mirror
from gpgpu_rt.charts import COLOURS, MARKERS, log_axis
from gpgpu_rt.text_format import titled

from ..framework import verdicts
from ..framework.cell import Cell, timed_runs
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import read
from .fig13_horn_improvements import size

SCENES = ("cornell", "robots", "kitchen", "conference")
SINGLE, PACKET = METHODS = ("kd-short-stack", "kd-packet")
LOOKS = dict(zip(METHODS, zip(COLOURS, MARKERS)))      # method -> colour and marker
BOUNCES = range(6)
# A scene can show the survey's claim only if `parted` is at least this number.
PARTED = 1.2


def cell(scene: str, method: str, bounces: int, full: bool) -> Cell:
    return Cell(scene, method, (), size(scene, full), mirror(bounces), timed_runs(full))


def cells(full: bool) -> list[Cell]:
    return [cell(scene, method, bounces, full) for scene in SCENES for bounces in BOUNCES
            for method in METHODS]


def judge(data: Path, full: bool) -> verdicts.Verdict:
    """Return the verdict on packets, judged on scenes whose mirrors scatter a packet's rays.

    One claim is that packets gain less at the last bounce than at the first. The other claim is
    that packets become slower than single rays. A scene whose packets stay together cannot test
    the claims and is named as an exception.
    """
    claims, exceptions = [], []
    for scene in SCENES:
        results = _results(scene, data, full)
        if any(r is None for pair in results for r in pair):
            continue
        rows = _table(results)
        if parted(rows) < PARTED:
            exceptions.append(exception(scene, results[0][0]["scene"]["triangles"], rows))
            continue
        gains = [row[4] for row in rows]
        pairs = tuple(verdicts.Pair(scene, mirror(bounces), SINGLE, PACKET) for bounces in BOUNCES)
        claims += [verdicts.Claim(says, holds, (scene,), pairs,
                                  bool(results[0][0]["scene"]["stand_in"])) for says, holds in (
            (f"on {scene} the rate of packets, divided by the rate of single rays, falls from "
             f"{number(gains[0])} before the mirrors to {number(gains[-1])} after them",
             gains[-1] < gains[0]),
            (f"packets become slower than single rays on {scene}", min(gains) < 1))]
    return verdicts.of_claims(claims, exceptions)


def parted(rows: list[list[float]]) -> float:
    """Return a packet's node visits after the last bounce, divided by the visits of one ray.

    The ratio is 1 if a packet's rays share all nodes, and 4 if they share none.
    """
    return rows[-1][10]


def exception(scene: str, triangles: int, rows: list[list[float]]) -> str:
    """Return a sentence that says why a scene cannot show the claim."""
    return (f"The scene {scene}, of {triangles:,} triangles, is an exception and is not judged: "
            f"after {BOUNCES[-1]} mirrors a packet visits {number(parted(rows))} times the nodes "
            "of one ray, so its rays have stayed together.")


def _results(scene: str, data: Path, full: bool) -> list[list[Any]]:
    """Return the results of single rays and of packets by bounce; None if not measured."""
    return [[read(cell(scene, method, bounces, full), data) for method in METHODS]
            for bounces in BOUNCES]


def draw(data: Path, out: Path, full: bool) -> None:
    parts, rows, renderer, stand_ins = [], [], "?", []
    figure, axes = plt.subplots(-(-len(SCENES) // 2), 2, figsize=(9, 7.6), squeeze=False)
    for axis, scene in zip(axes.flat, SCENES):
        results = _results(scene, data, full)
        if any(result is None for pair in results for result in pair):
            axis.remove()
            continue
        about, renderer = results[0][0]["scene"], results[0][0]["gpu"]["renderer"]
        if about["stand_in"]:
            stand_ins.append(f"{scene} is a procedural stand-in for {about['stand_in']}.")
        mine = _table(results)
        rows += [[scene, *row] for row in mine]
        parts += [f"## {titled(scene, about['stand_in'])}, "
                  f"{about['triangles']:,} triangles\n",
                  markdown_table(HEADS, [[row[0], f"{row[1]:,}", *map(number, row[2:])]
                                         for row in mine]),
                  verdict(scene, about["triangles"], mine) + "\n"]
        for at, (colour, marker) in enumerate(LOOKS.values()):
            axis.plot(BOUNCES, [size(scene, full) ** 2 / row[7 + at] / 1e3 for row in mine],
                      f"{marker}-", color=colour)
        log_axis(axis, "y")
        axis.set(xlabel="bounces", title=scene)
        axis.spines[["top", "right"]].set_visible(False)
    write_csv(out / "fig14.csv", ("scene", *HEADS), rows)
    write_text(out / "fig14.md", "\n".join((
        "# Figure 14: mirrors, with and without packets (Horn et al. 2007)\n",
        f"Renderer: {renderer}. Every surface is a mirror and reflects each ray that hits it. The "
        "survey's chart has no numbers, so its text is tested instead: \"the packet optimization "
        "actually decreases the performance as we increase the number of bounces\". Packets are "
        "2x2 neighbouring pixels; the ray of a pixel may have ended at an earlier bounce. A "
        "packet's nodes are divided among four rays. \"So far\" means the sum over all bounces "
        "up to the bounce of the row. At the quick size rays are two to four times as far apart "
        "as at 1024x1024.", *stand_ins, "", *parts)))
    for axis in axes[:, 0]:
        axis.set_ylabel("million pixels a second,\nall bounces so far (log)")
    figure.legend(handles=[plt.Line2D([], [], marker=marker, color=colour, label=method)
                           for method, (colour, marker) in LOOKS.items()],
                  frameon=False, fontsize=8, ncols=2, loc="upper left")
    figure.tight_layout(rect=(0, 0.03, 1, 0.97))
    save_chart(figure, out / "fig14.png", f"Renderer: {renderer}. " + " ".join(stand_ins),
               "Lines show the pixels per second of single rays and of packets, by the number of "
               "bounces between mirrors")


HEADS = ("bounce", "rays", "single: ns a ray", "packets: ns a ray", "rate of packets / single",
         "single: nodes a ray", "packets: nodes a ray", "single: ms so far", "packets: ms so far",
         "rate of packets / single so far", "nodes of a packet / nodes of one ray")


def _table(results: list[list[dict[str, Any]]]) -> list[list[float]]:
    sums = list(zip(*(accumulate(r["median_ms"] for r in column) for column in zip(*results))))
    rows = []
    for bounces, ((single, packet), (so_far, packets_so_far)) in enumerate(zip(results, sums)):
        nodes = [r["counters"]["nodes_visited"] for r in (single, packet)]
        rows.append([bounces, single["rays"], single["ns_per_ray"], packet["ns_per_ray"],
                     single["median_ms"] / packet["median_ms"], *nodes, so_far, packets_so_far,
                     so_far / packets_so_far, 4 * nodes[1] / nodes[0] if nodes[0] else 1.0])
    return rows


def verdict(scene: str, triangles: int, rows: list[list[float]]) -> str:
    """Return sentences that say whether the measurements support the survey's claim."""
    first, last = rows[0], rows[-1]
    if parted(rows) < PARTED:
        return exception(scene, triangles, rows)
    behind = [row[0] for row in rows if row[4] < 1]
    says = "The claim holds in part" if last[4] < first[4] else "The claim does not hold"
    if behind and last[4] < first[4]:
        says = "The claim holds"
    return (f"{says} on {scene}: packets have {number(first[4])} times the rate of single rays "
            f"for eye rays and {number(last[4])} times at bounce {last[0]}"
            + (f", and are slower than single rays at bounce {', '.join(map(str, behind))}"
               if behind else ", and are never slower than single rays")
            + f". A packet visits {number(first[10])} times the nodes of one ray for eye rays and "
            f"{number(last[10])} times at bounce {last[0]}. If it were 4 times, the packet's rays "
            "would share no node.")
