"""Figure 11: the nodes that kd-restart and kd-backtrack visit for the same ray."""
from __future__ import annotations

from collections import defaultdict
from pathlib import Path

from ..diagrams.plan import VISITED, draw_ground, draw_marks, draw_ray, draw_tree
from ..diagrams.small_world import Walk, World, walk, world
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text

METHODS = ("kd-restart", "kd-backtrack")
HEADS = ("method", "visit", "kernel", "node", "t_min", "t_max")


def cells(full: bool) -> list[Cell]:
    return []


def rows(small: World, found: Walk) -> list[list[str]]:
    """Return the table: a row for each visit of a node, with the interval after the visit."""
    visits = [step for step in found.steps if step.visited is not None]
    return [[found.method, str(number), step.kernel, small.name(step.visited),
             f"{step.after['t_min']:.3f}", f"{step.after['t_max']:.3f}"]
            for number, step in enumerate(visits, 1)]


def turns(found: Walk) -> dict[int, list[int]]:
    """Return node -> positions, from 1, of the node's visits in the walk."""
    numbers = defaultdict(list)
    for turn, node in enumerate(found.visited, 1):
        numbers[node].append(turn)
    return dict(numbers)


def intervals(found: Walk) -> list[float]:
    """Return the values of t at which the walk left a leaf without a hit."""
    return sorted({step.after["t_min"] for step in found.steps} - {found.steps[0].before["t_min"]})


def draw(data: Path, out: Path, full: bool) -> None:
    small = world()
    walks = [walk(method) for method in METHODS]
    table = [row for found in walks for row in rows(small, found)]
    write_csv(out / "fig11.csv", HEADS, table)
    counts = {found.method: len(found.visited) for found in walks}
    text = ["# Figure 11: kd-restart against kd-backtrack\n",
            "Both methods trace the same ray. After a leaf without a hit, kd-restart starts again "
            "at the root with the rest of the ray's interval. kd-backtrack climbs, one parent per "
            "step, to the first ancestor whose box the rest of the ray crosses, and descends from "
            "there. The visited nodes, in order:\n"]
    for found in walks:
        text.append(f"* {found.method}, {counts[found.method]} visits: "
                    + " ".join(map(small.name, found.visited)))
    least = min(counts, key=lambda name: counts[name])
    why = (f"Here {least} needs fewer visits, because in so low a tree the way from the root is "
           "as short as a climb.")
    text.append(f"\nBoth methods visit the same leaves. {why} kd-backtrack reads each node on its "
                "way up, and reads the topmost of these nodes again on its way down.\n")
    write_text(out / "fig11.md", "\n".join(text) + "\n" + markdown_table(HEADS, table))
    figure, axes = plt.subplots(1, 3, figsize=(14, 6), width_ratios=(0.75, 1, 1))
    leaves = {node: VISITED for node in walks[0].visited if small.is_leaf(node)}
    draw_ground(axes[0], small, leaves)
    draw_ray(axes[0], small, float(walks[0].hits.t[0]))
    draw_marks(axes[0], small, {t: f"{t:.3f}" for t in intervals(walks[0])})
    parents = small.parents
    for axis, found in zip(axes[1:], walks):
        edges = {pair for one, two in zip(found.visited, found.visited[1:])
                 for pair in ((one, two), (two, one)) if parents[pair[1]] == pair[0]}
        draw_tree(axis, small, {node: VISITED for node in found.visited}, edges,
                  {node: _wrapped(numbers) for node, numbers in turns(found).items()},
                  planes=False)
        axis.set_title(f"{found.method}: {counts[found.method]} visits", fontsize=10)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save_chart(figure, out / "fig11.png", "Red numbers at a node: the positions of the node's "
               "visits in the walk, from 1. Descents and climbs both count. Numbers along "
               f"the ray: the values of t at which kd-restart starts again at the root. {why}",
               "A scene with a ray, and two trees with the order in which kd-restart and "
               "kd-backtrack visit the nodes")


def _wrapped(numbers: list[int]) -> str:
    return "\n".join(", ".join(map(str, numbers[at:at + 2])) for at in range(0, len(numbers), 2))
