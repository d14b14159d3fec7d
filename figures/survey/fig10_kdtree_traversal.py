"""Figure 10: the standard traversal of a kd-tree, step by step for one ray.

The steps are the passes of kd-texture-stack. This method follows `CODE`, the survey's pseudocode
with a correction. A table row shows the ray's state, read from textures, after a pass.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ..diagrams.plan import HIT, PALE, VISITED, draw_ground, draw_marks, draw_ray, draw_tree
from ..diagrams.small_world import Step, Walk, World, walk, world
from ..framework import verdicts
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text

METHOD = "kd-texture-stack"
HEADS = ("pass", "kernel", "node", "t_split", "t_min", "t_max", "what it does", "stack")
CODE = """\
(t_min, t_max) = where the ray crosses the tree's box
node = root
loop:
    while node is no leaf:
        t_split = (plane - origin[axis]) / direction[axis]
        (near, far) = children, in the order of direction[axis]
        if t_split <= t_min:   node = far       # also t_split < 0: the plane lies behind
        elif t_split >= t_max: node = near
        else:                  push (far, t_max); node = near; t_max = t_split
    test the leaf's triangles
    if a hit lies before t_max: succeed
    if the stack is empty: fail
    t_min = t_max; (node, t_max) = pop
"""


def cells(full: bool) -> list[Cell]:
    return []


def rows(small: World, found: Walk) -> list[list[str]]:
    """Return the table: a row for each pass, with the stack after the pass, lowest entry first."""
    stack: list[str] = []
    result = []
    for number, step in enumerate(found.steps, 1):
        before, after = step.before, step.after
        node, t_split = int(before["node"]), ""
        if step.kernel == "push":
            stack.append(f"({small.name(after['far'])}, {after['far_t_max']:.3f})")
            text, node = f"push {small.name(after['far'])}", int(after["far"])
        elif step.kernel == "pop":
            stack.pop()
            text, node = f"pop {small.name(after['node'])}", int(after["node"])
        elif step.kernel == "intersect":
            triangle = small.inside(node)[before["cursor"] - small.tree.left[node]]
            text = f"test triangle {triangle}: {_tested(step)}"
        elif small.is_leaf(node):
            count = len(small.inside(node))
            text = f"leaf: {count} triangle{'s' * (count != 1)}"
        else:
            t = small.plane_t(node)
            t_split, text = f"{t:.3f}", _chosen(small, step, t)
        result.append([str(number), step.kernel, small.name(node), t_split,
                       f"{after['t_min']:.3f}", f"{after['t_max']:.3f}", text,
                       " ".join(stack) or "-"])
    return result


def _tested(step: Step) -> str:
    if step.after["phase"] == 0:
        return f"hit at t = {step.hit['t']:.3f}, done"
    return "missed"


def _chosen(small: World, step: Step, t_split: float) -> str:
    before, after = step.before, step.after
    child = small.name(after["node"])
    if t_split <= before["t_min"]:
        return f"t_split <= t_min: far, {child}"
    if t_split >= before["t_max"]:
        return f"t_split >= t_max: near, {child}"
    return f"between: near, {child}; keep {small.name(after['far'])}"


@dataclass
class Printed:
    """What the ray does under the survey's printed rule.

    visited : the nodes, in the order of the visits
    wrong : nodes with t_split < 0 where the rule descends into the near child
    hit : triangle, or -1
    """

    visited: list[int] = field(default_factory=list)
    wrong: list[int] = field(default_factory=list)
    hit: int = -1


def printed_rule(small: World, t_min: float, t_max: float) -> Printed:
    """Trace the ray by the printed rule, which tests `thit >= tmax or thit < 0` first."""
    tree, result = small.tree, Printed()
    stack = [(0, t_min, t_max)]
    hits = _triangle_hits(small)
    while stack:
        node, t_min, t_max = stack.pop()
        while not small.is_leaf(node):
            result.visited.append(node)
            left, t = int(tree.left[node]), small.plane_t(node)
            near, far = (left, left + 1)[::1 if small.direction[tree.axis[node]] >= 0 else -1]
            if t >= t_max or t < 0:
                result.wrong += [node] if t < 0 else []
                node = near
            elif t <= t_min:
                node = far
            else:
                stack.append((far, t, t_max))
                node, t_max = near, t
        result.visited.append(node)
        inside = [(hits[k], k) for k in small.inside(node) if hits[k] < t_max]
        if inside:
            result.hit = min(inside)[1]
            break
    return result


def _triangle_hits(small: World) -> np.ndarray:
    """Return (n,) t of the ray's hit with each triangle; inf for a miss."""
    v0, one, two = (small.triangles[:, k].astype(np.float64) for k in range(3))
    one, two, d = one - v0, two - v0, small.direction.astype(np.float64)
    from_v0 = small.origin.astype(np.float64) - v0
    across = np.cross(d, two)
    det = (one * across).sum(axis=1)
    u, other = (from_v0 * across).sum(axis=1) / det, np.cross(from_v0, one)
    v, t = (other * d).sum(axis=1) / det, (other * two).sum(axis=1) / det
    return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0), t, np.inf)


def judge(data: Path, full: bool) -> verdicts.Verdict:
    """Return the verdict on whether the printed pseudocode finds the triangle that the ray hits.

    The claim is about every ray, so one wrong ray refutes it.
    """
    found = walk(METHOD)
    start = found.steps[0].before
    printed = printed_rule(world(), start["t_min"], start["t_max"])
    return verdicts.of_claims([verdicts.Claim(
        "the traversal as printed finds the triangle that the ray hits",
        printed.hit == int(found.hits.triangle[0]))])


def draw(data: Path, out: Path, full: bool) -> None:
    small, found = world(), walk(METHOD)
    table, start = rows(small, found), found.steps[0].before
    printed = printed_rule(small, start["t_min"], start["t_max"])
    write_csv(out / "fig10.csv", HEADS, table)
    names = ", ".join(map(small.name, printed.visited))
    ends = f"hits triangle {printed.hit}" if printed.hit >= 0 else "misses"
    hit = f"triangle {found.hits.triangle[0]} at t = {found.hits.t[0]:.3f}"
    slip = (f"The survey's Figure 10 tests `thit >= tmax or thit < 0` first, and then descends "
            "into the near child. The figure's function `order` chooses the near child by the "
            "direction's sign. With this order, the test is a mistake. If t_split < 0, the plane "
            "lies behind the ray's origin, so only the far child lies ahead. Under the printed "
            f"rule this ray goes wrong at {' and '.join(map(small.name, printed.wrong))}, visits "
            f"{names}, and {ends}. Under the corrected rule it hits {hit}. (The printed rule "
            "would be right if near were the side of the plane that the origin is on.) If the "
            "plane lies exactly at t_min, the corrected rule sends the ray into the far child "
            "only. So a ray that left a leaf through a plane never returns to this leaf.")
    write_text(out / "fig10.md", "# Figure 10: the traversal of a kd-tree\n\n```\n" + CODE
               + f"```\n\nThe table follows one ray, which `{METHOD}` traces with one kernel per "
               "pass. It shows t_min, t_max and the stack that the textures hold after the "
               "pass.\n\n"
               + markdown_table(HEADS, table)
               + "\n" + slip + "\n")
    figure = plt.figure(figsize=(12.5, 10))
    grid = figure.add_gridspec(2, 2, width_ratios=(1, 1.35), height_ratios=(1, 1.25))
    ground, tree, steps = (figure.add_subplot(grid[0, 0]), figure.add_subplot(grid[0, 1]),
                           figure.add_subplot(grid[1, :]))
    leaves = [node for node in found.visited if small.is_leaf(node)]
    draw_ground(ground, small, {node: VISITED for node in leaves})
    draw_ray(ground, small, float(found.hits.t[0]))
    draw_marks(ground, small, {step.after["t_min"]: f"{step.after['t_min']:.3f}"
                               for step in found.steps if step.kernel == "pop"})
    draw_tree(tree, small, {**{node: VISITED for node in found.visited},
                            **{node: "#f3cfcf" for node in set(printed.visited)
                               - set(found.visited)}})
    draw_table(steps, table)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save_chart(figure, out / "fig10.png", "Blue: nodes visited. Red: nodes visited only under the "
               "rule that the survey prints (t_split < 0: near). This rule goes wrong at "
               f"{' and '.join(map(small.name, printed.wrong))}; under it the ray {ends}.",
               "The traversal of a kd-tree by a ray: the scene with the ray, the tree with the "
               "nodes that it visits, and a table of the stack after each step")


def draw_table(axis: plt.Axes, table: list[list[str]]) -> None:
    axis.axis("off")
    drawn = axis.table(cellText=table, colLabels=HEADS, loc="center", cellLoc="left",
                       colWidths=(0.05, 0.08, 0.06, 0.08, 0.07, 0.07, 0.36, 0.23))
    drawn.auto_set_font_size(False)
    drawn.set_fontsize(8.5)
    drawn.scale(1, 1.15)
    for (row, _), cell in drawn.get_celld().items():
        cell.set_edgecolor(PALE)
        cell.set_linewidth(0.5)
        cell.PAD = 0.006 / cell.get_width()
        if row and float(table[row - 1][3] or 0) < 0:
            cell.set_facecolor("#fdeeee")
        elif row == len(table):
            cell.get_text().set_color(HIT)
