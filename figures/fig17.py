"""Figure 17: what ropes add to a kd-tree's size (Popov et al. 2007)."""
from __future__ import annotations

from pathlib import Path

from .measure import Cell, read
from .output import markdown_table, number, plt, save_chart, write_csv, write_text
from .published_numbers import published, published_triangles
from .tree_sizes import NODE_BYTES, REFERENCE_BYTES

SCENES = ("shirley6", "bunny", "fairyforest", "conference")
# Ours, what the published numbers call it, and the scale and name of the table's column.
QUANTITIES = (("leaves", "leaves", 1, "leaves"),
              ("empty_leaves", "empty leaves", 1, "empty leaves"),
              ("references_per_leaf", "references per triangle", 1,
               "references a leaf that has any"),
              ("bytes", "kd-tree size", 2 ** 20, "MiB"),
              ("bytes_ropes", "kd-tree size with ropes", 2 ** 20, "MiB with ropes"),
              ("overhead", "rope overhead", 1, "overhead"))
LOWEST, HIGHEST, SLACK = 3.06, 3.30, 0.1   # the published overheads, and how near ours shall be


def cell(scene: str) -> Cell:
    return Cell(scene, "kd-ropes", work="tree", size=0)


def cells(full: bool) -> list[Cell]:
    return [cell(scene) for scene in SCENES]


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/fig17.csv, .md and .png."""
    results = {scene: read(cell(scene), data) for scene in SCENES}
    results = {scene: result for scene, result in results.items() if result is not None}
    rows, lines = [], []
    for scene, result in results.items():
        tree, about = result["tree"], result["scene"]
        ours = [tree[key] / scale for key, _, scale, _ in QUANTITIES]
        theirs = [(published("fig17", scene, "kd-ropes", quantity=name) or float("nan")) / scale
                  for _, name, scale, _ in QUANTITIES]
        triangles = published_triangles("fig17", scene)
        rows += [[scene, "here", about["triangles"], *ours],
                 [scene, "published", triangles, *theirs]]
        if about["stand_in"]:
            lines.append(f"{scene} is a procedural stand-in for {about['stand_in']}.")
        elif triangles != about["triangles"]:
            lines.append(f"{scene} has {about['triangles']:,} triangles here, {triangles:,} in "
                         "the paper: another edition of the model.")
        else:
            lines.append(f"{scene}: {number(ours[0] / theirs[0])} times the published leaves.")
        lines.append(_verdict(scene, tree["overhead"]))
    heads = ("scene", "tree", "triangles", *(head for *_, head in QUANTITIES))
    write_csv(out / "fig17.csv", heads, rows)
    table = [[*row[:2], *(f"{value:,}" if isinstance(value, int) else f"{value:,.0f}"
                          for value in row[2:5]), *(number(value) for value in row[5:])]
             for row in rows]
    write_text(out / "fig17.md", "\n".join((
        "# Figure 17: what ropes add to a kd-tree (Popov et al. 2007)\n",
        f"Bytes as in the paper's records: {NODE_BYTES} a node, {REFERENCE_BYTES} a reference, "
        "and 48 a leaf for six ropes and a box. Its table says \"references\" without saying to "
        "what; its sizes come out if it counts references a leaf that is not empty, and so does "
        "this one. The survey says that each node has six ropes; the sizes say that leaves alone "
        "have.\n", markdown_table(heads, table), "\n".join(f"* {line}" for line in lines), "")))
    _chart(results, out)


def _verdict(scene: str, overhead: float) -> str:
    low, high = LOWEST * (1 - SLACK), HIGHEST * (1 + SLACK)
    return (f"{scene}: ropes make it {number(overhead)} times as large, "
            f"{'within' if low <= overhead <= high else 'not within'} {SLACK:.0%} of the "
            f"published {LOWEST:.2f} to {HIGHEST:.2f}.")


def _chart(results: dict[str, dict], out: Path) -> None:
    figure, axis = plt.subplots(figsize=(7.5, 4.6))
    for at, (scene, result) in enumerate(results.items()):
        theirs = [published("fig17", scene, "kd-ropes", quantity=name) or 0
                  for name in ("kd-tree size", "kd-tree size with ropes")]
        pairs = ((-0.2, (result["tree"]["bytes"], result["tree"]["bytes_ropes"]), 1.0, ""),
                 (0.2, theirs, 0.45, "///"))
        for shift, (bare, whole), alpha, hatch in pairs:
            for height, colour in ((whole, "#df8a6a"), (bare, "#2f6db3")):
                axis.bar(at + shift, height / 2 ** 20, 0.38, color=colour, alpha=alpha,
                         hatch=hatch, edgecolor="white")
            axis.annotate(f"x {number(whole / bare)}", (at + shift, whole / 2 ** 20),
                          ha="center", va="bottom", fontsize=8)
    axis.set_xticks(range(len(results)), [
        f"{scene}{' (stand-in)' if result['scene']['stand_in'] else ''}"
        for scene, result in results.items()], fontsize=9)
    axis.set(yscale="log", ylabel="MiB (log)")
    axis.margins(y=0.15)
    axis.spines[["top", "right"]].set_visible(False)
    figure.suptitle("Figure 17: a kd-tree (blue) and what ropes add (red)\nplain: here; hatched: "
                    "published", fontsize=11)
    figure.tight_layout(rect=(0, 0.05, 1, 1))
    save_chart(figure, out / "fig17.png", "Records as in Popov et al. 2007.")
