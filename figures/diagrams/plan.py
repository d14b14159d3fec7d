"""Plan: draws the scene of small_world.py from above, and the scene's kd-tree."""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from matplotlib import patheffects
from matplotlib.patches import Rectangle

from .small_world import World

INK, PALE, RAY, HIT = "#333333", "#b9b9b9", "#b33a3a", "#e08a1e"
TRIANGLE, VISITED, SPLITS = "#3d8b57", "#cfe0f3", ("#2f6db3", "#7a4fa3")
_HALO = [patheffects.withStroke(linewidth=3, foreground="white")]


def draw_ground(axis: Any, small: World, shaded: Mapping[int, str] | None = None,
                central: bool = False) -> None:
    """Draw the boxes of the leaves, the split planes and the triangles, seen from above.

    Parameters
    ----------
    shaded : leaf -> colour
    central : if set, write each leaf's name in the leaf's middle, and no triangle numbers
    """
    tree = small.tree
    for node in range(len(tree.axis)):
        lo, hi = small.lo[node, :2], small.hi[node, :2]
        if small.is_leaf(node):
            axis.add_patch(Rectangle(lo, *(hi - lo), facecolor=(shaded or {}).get(node, "white"),
                                     edgecolor="none", zorder=0))
            label(axis, (lo + hi) / 2 if central else _clearest(small, lo, hi), small.name(node),
                  color=INK)
            continue
        across, plane = tree.axis[node], tree.split[node]
        ends = np.array([lo, hi])
        ends[:, across] = plane
        axis.plot(*ends.T, color=SPLITS[across], linewidth=1.6, zorder=2)
        at = ends[0] + (0.08, 0.16)[across] * (ends[1] - ends[0])
        label(axis, at, small.name(node), color=SPLITS[across], fontsize=8)
    lo, hi = small.lo[0, :2], small.hi[0, :2]
    axis.add_patch(Rectangle(lo, *(hi - lo), fill=False, edgecolor=INK, linewidth=1.6, zorder=3))
    for number, corners in enumerate(small.triangles):
        axis.plot(*corners[:2, :2].T, color=TRIANGLE, linewidth=3.2, solid_capstyle="butt",
                  zorder=4)
        if not central:
            along = corners[1, :2] - corners[0, :2]
            aside = np.array([-along[1], along[0]]) / np.linalg.norm(along)
            label(axis, corners[:2, :2].mean(axis=0) + 0.024 * aside, str(number),
                  color=TRIANGLE, fontsize=8)
    axis.set(xlim=(lo[0] - 0.03, hi[0] + 0.03), ylim=(lo[1] - 0.03, hi[1] + 0.03),
             aspect="equal")
    axis.axis("off")


def _clearest(small: World, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """Return a place in a box, near the corner that is farthest from all triangles.

    Corners more than 0.1 from all triangles count as equally far; the first such corner wins.
    """
    inset = np.minimum(0.03, (hi - lo) / 2)
    places = np.array([[x, y] for x in (lo[0] + inset[0], hi[0] - inset[0])
                       for y in (hi[1] - inset[1], lo[1] + inset[1])])
    share = np.linspace(0, 1, 9)[:, None, None]
    corners = small.triangles[:, :2, :2]
    points = (corners[:, 0] + share * (corners[:, 1] - corners[:, 0])).reshape(-1, 2)
    apart = np.linalg.norm(places[:, None] - points, axis=2).min(axis=1)
    return places[np.argmax(np.minimum(apart, 0.1))]


def draw_ray(axis: Any, small: World, until: float, hit: bool = True) -> None:
    """Draw the ray from its origin to t = ``until``. If ``hit`` is set, mark the end by a dot."""
    start, end = small.at(0)[:2], small.at(until)[:2]
    axis.annotate("", xy=end, xytext=start, zorder=6,
                  arrowprops={"arrowstyle": "-|>", "color": RAY, "lw": 1.8, "shrinkA": 0,
                              "shrinkB": 0})
    axis.plot(*start, "o", color=RAY, markersize=5, zorder=7)
    if hit:
        axis.plot(*end, "o", color=HIT, markeredgecolor=RAY, markersize=8, zorder=8)


def draw_marks(axis: Any, small: World, marks: Mapping[float, str], side: float = 1.0) -> None:
    """Draw ticks across the ray at given t, each with a text.

    The text stands on the left of the ray if ``side`` is 1, and on its right if ``side`` is -1.
    """
    along = small.direction[:2] / np.linalg.norm(small.direction[:2])
    across = side * np.array([-along[1], along[0]])
    for t, text in marks.items():
        at = small.at(t)[:2]
        axis.plot(*np.array([at - 0.012 * across, at + 0.012 * across]).T, color=RAY,
                  linewidth=1.5, zorder=7)
        label(axis, at + 0.03 * across, text, color=RAY, fontsize=8, zorder=9)


def tree_places(small: World) -> np.ndarray:
    """Return (nodes, 2) positions: x counts leaves from left to right, y is minus the depth."""
    tree, places = small.tree, np.zeros((len(small.tree.axis), 2))
    column = 0.0

    def place(node: int, depth: int) -> float:
        nonlocal column
        if small.is_leaf(node):
            x, column = column, column + 1
        else:
            x = (place(tree.left[node], depth + 1) + place(tree.left[node] + 1, depth + 1)) / 2
        places[node] = x, -depth
        return x
    place(0, 0)
    return places


def draw_tree(axis: Any, small: World, shaded: Mapping[int, str] | None = None,
              edges: Iterable[tuple[int, int]] = (), notes: Mapping[int, str] | None = None,
              planes: bool = True) -> None:
    """Draw the kd-tree.

    Parameters
    ----------
    shaded : node -> colour
    edges : (parent, child) pairs whose edges are drawn thick
    notes : node -> text beside an inner node or below a leaf
    planes : if set, write the split plane of each inner node and the triangles of each leaf
    """
    places, tree = tree_places(small), small.tree
    heavy = set(edges)
    for child, parent in enumerate(small.parents):
        if parent >= 0:
            strong = (int(parent), child) in heavy
            axis.plot(*places[[parent, child]].T, color=RAY if strong else PALE,
                      linewidth=2.2 if strong else 1.2, zorder=1)
    for node, (x, y) in enumerate(places):
        leaf = small.is_leaf(node)
        box = {"boxstyle": "square,pad=0.35" if leaf else "circle,pad=0.3",
               "facecolor": (shaded or {}).get(node, "white"),
               "edgecolor": INK if leaf else SPLITS[tree.axis[node]], "linewidth": 1.4}
        axis.text(x, y, small.name(node), ha="center", va="center", fontsize=9, bbox=box, zorder=3)
        if planes and leaf:
            inside = small.inside(node)
            axis.text(x, y - 0.27, ", ".join(map(str, inside)) if inside else "empty",
                      ha="center", va="top", fontsize=8, zorder=4,
                      color=TRIANGLE if inside else PALE)
        elif planes:
            axis.text(x, y + 0.25, f"{'xy'[tree.axis[node]]} = {tree.split[node]:.2f}",
                      ha="center", va="bottom", fontsize=7.5, color=SPLITS[tree.axis[node]],
                      path_effects=_HALO, zorder=4)
        if notes and node in notes:
            # Write beside an inner node, on the side away from the edge to its parent.
            side = -1 if node % 2 else 1
            axis.text(*((x, y - 0.24) if leaf else (x + 0.3 * side, y + 0.1)), notes[node],
                      ha="center" if leaf else "right" if side < 0 else "left",
                      va="top" if leaf else "center", fontsize=8, color=RAY,
                      path_effects=_HALO, zorder=4)
    axis.set(xlim=(-0.6, places[:, 0].max() + 0.6), ylim=(places[:, 1].min() - 0.6, 0.6))
    axis.axis("off")


def label(axis: Any, at: Any, text: str, **more: Any) -> None:
    """Write a text. Its white halo covers the lines behind the text."""
    axis.text(*at, text, **{"ha": "center", "va": "center", "fontsize": 9, "zorder": 5,
                            "path_effects": _HALO, **more})
