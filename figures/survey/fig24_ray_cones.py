"""Figure 24: the hierarchy of cones over rays, bottom-up."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ..diagrams.small_rays import RAYS, ConeLevel, rays, traversal
from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text

HEADS = ("level", "node", "sphere's centre", "sphere's radius", "axis", "half-angle, degrees")
SHOWN = 2.4     # length of the drawn rays


def cells(full: bool) -> list[Cell]:
    return []


def rows() -> list[list[Any]]:
    """The table, with a row for each node above the level of the rays."""
    levels, _, _ = traversal()
    return [[height, node, point(level.centre[node]), number(float(level.radius[node])),
             point(level.axis[node]), number(float(np.degrees(level.angle[node])))]
            for height, level in enumerate(levels) if height for node in range(len(level.radius))]


def point(at: np.ndarray) -> str:
    return f"({at[0]:.3f}, {at[1]:.3f})"


def draw(data: Path, out: Path, full: bool) -> None:
    levels, _, _ = traversal()
    write_csv(out / "fig24.csv", HEADS, rows())
    sizes = [[height, len(level.radius), number(float(level.radius.mean())),
              number(float(np.degrees(level.angle).mean()))]
             for height, level in enumerate(levels)]
    write_text(out / "fig24.md", (
        "# Figure 24: the hierarchy of cones over rays\n\n"
        f"{RAYS} rays leave a wavy mirror. A node is a sphere around its rays' origins and a cone "
        "of their directions. A fragment pass per level merges four neighbours into a node, as in "
        "a mipmap. The values were read from the textures of these passes.\n\n"
        + markdown_table(("level", "nodes", "radius, mean", "half-angle, degrees, mean"), sizes)
        + "\n" + markdown_table(HEADS, rows())))
    figure, axes = plt.subplots(2, 2, figsize=(10.4, 6.6))
    origins, directions = rays()
    for height, (axis, level) in enumerate(zip(axes.flat, levels)):
        for o, d in zip(origins, directions):
            axis.plot(*zip(o[:2], (o + SHOWN * d)[:2]), color="#9a9a9a" if height else "#2f6db3",
                      lw=0.4)
        if height:
            cones(axis, level)
        axis.plot(origins[:, 0], origins[:, 1], color="black", lw=1)
        axis.set_title(f"level {height}: {len(level.radius)} " + ("nodes" if height else "rays")
                       if len(level.radius) > 1 else f"level {height}: the root", fontsize=9)
        axis.set_aspect("equal")
        axis.set_axis_off()
        axis.set_xlim(-3.0, 3.0)
        axis.set_ylim(-1.05, 2.6)
    figure.tight_layout(rect=(0, 0.04, 1, 0.98))
    save_chart(figure, out / "fig24.png", "The spheres and cones are those that the passes wrote. "
               "Grey, or blue in the first plan: the rays, which all lie in the plane shown. A "
               "cone is drawn from its sphere's rim.",
               "Four plans of the same rays: the rays alone, and with the cones of 16 nodes, of "
               "four nodes and of the root around them")


def cones(axis: Any, level: ConeLevel) -> None:
    """Draw each node's sphere. Two lines from the sphere's rim bound the node's rays."""
    for node in range(len(level.radius)):
        colour = plt.cm.tab10(node % 10)
        centre, radius = level.centre[node, :2], float(level.radius[node])
        axis.add_patch(plt.Circle(centre, radius, color=colour, alpha=0.25, lw=0))
        turn = np.arctan2(level.axis[node, 1], level.axis[node, 0])
        rim = []
        for side in (1, -1):
            along = turn + side * min(float(level.angle[node]), np.pi / 2)
            square = along + side * np.pi / 2
            start = centre + radius * np.array([np.cos(square), np.sin(square)])
            end = start + SHOWN * np.array([np.cos(along), np.sin(along)])
            axis.plot(*zip(start, end), color=colour, lw=1)
            rim += [start, end] if side == 1 else [end, start]
        axis.fill(*np.array(rim).T, color=colour, alpha=0.12, lw=0)
