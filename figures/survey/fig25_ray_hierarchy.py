"""Figure 25: the traversal of a ray hierarchy, with the stream of pairs at each level."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.inspect.observe import ObservedPass
from gpgpu_rt.methods.ray_hierarchy.cones import level_sizes

from ..diagrams.small_rays import PAIR_CHILDREN, RAYS, TRIANGLES, Round, tested, traversal
from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text

HEADS = ("level", "pairs", "slots written", "empty slots", "pairs after the reduction",
         "share of all pairs")
SCENE, SIDE = "bunny", 64    # for the counts on a mesh


def cells(full: bool) -> list[Cell]:
    return []


def rows() -> list[list[Any]]:
    """The table with the columns HEADS and a row for each round (a level of the traversal)."""
    _, rounds, _ = traversal()
    return [[one.level, len(one.pairs), one.slots[..., 0].size,
             int((one.slots[..., 0] < 0).sum()), one.kept,
             number(one.kept / (TRIANGLES * RAYS / 4 ** (one.level - 1)))] for one in rounds]


def counted(scene: rt.Scene, side: int) -> list[list[Any]]:
    """The table of pairs for side x side eye rays, with a row for each level.

    A row has the level, the number n of nodes of the level below, and the number of pairs before
    and after the reduction. The last entry divides the number of pairs after the reduction by
    n times the number of triangles.
    """
    sizes, _ = level_sizes((side, side))
    nodes = [width * height for width, height in sizes]
    found: dict[int, list[int]] = {}

    def look(one: ObservedPass) -> None:
        if one.name == PAIR_CHILDREN:
            at = found.setdefault(1 + sizes.index(one.uniforms["below"]), [0, 0])
            _, slots = tested(one)
            at[0], at[1] = at[0] + len(slots), at[1] + int((slots[..., 0] >= 0).sum())
    with rt.Tracer(scene, "ray-hierarchy") as tracer, tracer.observe(look):
        tracer.trace(*scene.camera.rays((side, side)))
    return [[level, nodes[level - 1], pairs, kept, number(kept / (nodes[level - 1] * len(scene)))]
            for level, (pairs, kept) in sorted(found.items(), reverse=True)]


def draw(data: Path, out: Path, full: bool) -> None:
    _, rounds, hits = traversal()
    scene = rt.load_scene(SCENE)
    write_csv(out / "fig25.csv", HEADS, rows())
    write_text(out / "fig25.md", (
        "# Figure 25: the traversal of a ray hierarchy\n\n"
        f"{TRIANGLES} triangles are paired with the root over Figure 24's {RAYS} rays. Each pair "
        "of a triangle and a node writes the node's four children to four targets. A target "
        "stays empty if the child's bounds show that none of its rays can hit the triangle. "
        "Stream reduction compacts the other children, which are the pairs of the next level. "
        "The last column divides the number of these pairs by the number of all pairs of a "
        "triangle and a node of the next level. The last level "
        f"is the rays: {int(hits.hit.sum())} of them hit something after "
        f"{int(hits.triangles_tested.sum())} tests.\n\n"
        + markdown_table(HEADS, rows())
        + f"\nThe same for {SIDE} x {SIDE} eye rays of {SCENE}, {len(scene):,} triangles"
        + (f" (a stand-in for {scene.stand_in})" if scene.stand_in else "") + ":\n\n"
        + markdown_table(("level", "nodes below", "pairs", "pairs after the reduction",
                          "share of all pairs"), counted(scene, SIDE))))
    figure, axes = plt.subplots(2 * len(rounds), 1, figsize=(10.4, 7.2), height_ratios=[
        1, 2.2] * len(rounds))
    for k, one in enumerate(rounds):
        stream(axes[2 * k], one)
        targets(axes[2 * k + 1], one)
    figure.tight_layout(rect=(0, 0.04, 1, 0.99), h_pad=0.4)
    save_chart(figure, out / "fig25.png", "Colours are triangles, numbers are nodes; "
               "white slots are empty. All values were read from the passes' own textures.",
               "Strips for each level of the hierarchy: the pairs of a triangle and a node, and "
               "their children in four targets, most of whose slots are empty")


def stream(axis: Any, one: Round) -> None:
    strip(axis, one.pairs[None], f"level {one.level}: {len(one.pairs)} pairs of a triangle and a "
          "node (its number)")


def targets(axis: Any, one: Round) -> None:
    strip(axis, one.slots.transpose(1, 0, 2),
          f"their children in four targets: {one.slots[..., 0].size} slots, {one.kept} kept")


def strip(axis: Any, pairs: np.ndarray, title: str) -> None:
    """Draw (h, n, 2) slots in their triangles' colours, with the numbers of their nodes."""
    rows, columns = np.nonzero(pairs[..., 0] >= 0)
    shown = np.ones((*pairs.shape[:2], 3))
    triangles, nodes = pairs[rows, columns].T
    shown[rows, columns] = plt.cm.tab10(triangles % 10)[:, :3]
    axis.imshow(shown, aspect="auto", interpolation="nearest")
    for row, column, node in zip(rows, columns, nodes):
        axis.text(column, row, str(node), ha="center", va="center", fontsize=7, color="white")
    for edge in range(1, pairs.shape[1]):
        axis.axvline(edge - 0.5, color="#dddddd", lw=0.6)
    axis.set_title(title, fontsize=8, loc="left", pad=2)
    axis.set_xticks([])
    axis.set_yticks([])
