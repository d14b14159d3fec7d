"""Figure 15: a kd-tree with ropes, and a ray that follows them."""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..diagrams.plan import HIT, PALE, RAY, VISITED, draw_ground, draw_ray, label
from ..diagrams.small_world import Walk, World, walk, world
from ..framework.cell import Cell
from ..framework.output import markdown_table, plt, save_chart, write_csv, write_text

METHOD = "kd-ropes"
FACES = (("left", 0, False), ("right", 0, True), ("below", 1, False), ("above", 1, True))
HEADS = ("leaf", *(name for name, _, _ in FACES))


@dataclass(frozen=True)
class Followed:
    """A rope that the ray followed from a leaf to a node, and t where the ray left the leaf."""

    leaf: int
    node: int
    t: float


def cells(full: bool) -> list[Cell]:
    return []


def ropes_of(small: World) -> dict[tuple[int, str], int]:
    """Return the ropes: (leaf, face) -> the node behind the face.

    Faces on the outside of the scene's box have no rope.
    """
    ropes = small.ropes
    return {(int(leaf), name): int((ropes.rope_hi if upper else ropes.rope_lo)[at, axis])
            for at, leaf in enumerate(ropes.node) for name, axis, upper in FACES
            if (ropes.rope_hi if upper else ropes.rope_lo)[at, axis] >= 0}


def followed(found: Walk) -> list[Followed]:
    """The ropes that the ray followed, read from the ray's states."""
    return [Followed(step.before["node"], step.after["node"], step.after["t_min"])
            for step in found.steps if step.kernel == "follow_rope" and step.after["phase"] > 0]


def draw(data: Path, out: Path, full: bool) -> None:
    small, found = world(), walk(METHOD)
    ropes, taken = ropes_of(small), followed(found)
    leaves = [node for node in range(len(small.tree.axis)) if small.is_leaf(node)]
    table = [[small.name(leaf), *(small.name(ropes[leaf, name]) if (leaf, name) in ropes else "-"
                                  for name, _, _ in FACES)] for leaf in leaves]
    write_csv(out / "fig15.csv", HEADS, table)
    way = ", ".join(f"from {small.name(rope.leaf)} to {small.name(rope.node)} at t = {rope.t:.3f}"
                    for rope in taken)
    write_text(out / "fig15.md", "# Figure 15: a kd-tree with ropes\n\nA face of a leaf has "
               "a rope to the smallest node that touches the whole face from outside. The node is "
               "a leaf n if a single neighbour covers the face, and otherwise a split S, from "
               "which the ray descends again. Only faces on the outside of the scene's box have "
               "no rope.\n\n"
               + markdown_table(HEADS, table) + f"\nThe ray follows ropes {way}. It visits the "
               f"nodes {', '.join(map(small.name, found.visited))} "
               f"({len(found.visited)} in all) and hits triangle {found.hits.triangle[0]} at "
               f"t = {found.hits.t[0]:.3f}.\n")
    figure, (every, one) = plt.subplots(1, 2, figsize=(11.5, 7))
    draw_ground(every, small, central=True)
    for (leaf, name), node in ropes.items():
        draw_rope(every, small, leaf, name, node)
    every.set_title(f"all {len(ropes)} ropes", fontsize=10)
    draw_ground(one, small, {node: VISITED for node in found.visited if small.is_leaf(node)})
    draw_ray(one, small, float(found.hits.t[0]))
    for rope in taken:
        at = small.at(rope.t)[:2]
        one.plot(*at, "s", color=RAY, markersize=6, zorder=8)
        label(one, at + (0.0, -0.035), f"to {small.name(rope.node)}", color=RAY, fontsize=9,
              zorder=9)
    one.set_title(f"a ray along {len(taken)} ropes, {len(found.visited)} nodes visited",
                  fontsize=10)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save_chart(figure, out / "fig15.png", "Arrows: from a leaf's face to the node that its rope "
               "names, which is a split S if several leaves touch the face. Squares: where the "
               "ray leaves a leaf, with the node from which it continues.",
               "Two plans of a scene with the cells of a kd-tree: left the ropes of all "
               "leaves, right the ropes that a ray follows")


def draw_rope(axis: Any, small: World, leaf: int, face: str, node: int) -> None:
    """Draw a rope as an arrow across the leaf's face, with the name of the rope's node."""
    across, upper = next((a, u) for name, a, u in FACES if name == face)
    lo, hi = small.lo[leaf, :2].astype(float), small.hi[leaf, :2].astype(float)
    # Leaves that share a face have a rope each way. Draw both ropes side by side.
    along = (0.47, 0.7) if across == 0 else (0.42, 0.58)
    start = lo + (hi - lo) * np.where(np.arange(2) == across, 0.5, along[not upper])
    start[across] = (hi if upper else lo)[across] - (0.022 if upper else -0.022)
    end = start.copy()
    end[across] += 0.05 if upper else -0.05
    axis.annotate("", xy=end, xytext=start, zorder=6, arrowprops={
        "arrowstyle": "-|>", "color": PALE if small.is_leaf(node) else HIT, "lw": 1.6,
        "shrinkA": 0, "shrinkB": 0})
    label(axis, end + np.where(np.arange(2) == across, 0.016 if upper else -0.016, 0),
          small.name(node), fontsize=7.5, zorder=7,
          color="#777777" if small.is_leaf(node) else HIT)
