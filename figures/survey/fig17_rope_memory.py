"""Figure 17: what ropes add to a kd-tree's size (Popov et al. 2007)."""
from __future__ import annotations

from pathlib import Path

from gpgpu_rt.charts import HERE, PUBLISHED, Series, dot_rows, legend_of, plain
from gpgpu_rt.text_format import titled

from ..framework import verdicts
from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_numbers import published, published_triangles
from ..framework.results import read
from .fig16_ropes_and_packets import LEFT_OUT, SCENES, STAND_IN
from .tree_sizes import NODE_BYTES, REFERENCE_BYTES

# Columns of the table: (key in a tree's record, name in the published numbers, divisor of the
# values, heading).
QUANTITIES = (("leaves", "leaves", 1, "leaves"),
              ("empty_leaves", "empty leaves", 1, "empty leaves"),
              ("references_per_leaf", "references per triangle", 1,
               "references per leaf that is not empty"),
              ("bytes", "kd-tree size", 2 ** 20, "MiB"),
              ("bytes_ropes", "kd-tree size with ropes", 2 ** 20, "MiB with ropes"),
              ("overhead", "rope overhead", 1, "overhead"))
# Scene -> depth limit that gives about as many leaves as in the paper. Other scenes have the
# default limit.
DEPTH = {"conference": 34}
# The lowest and highest published overhead, and the relative tolerance for the measured overheads.
LOWEST, HIGHEST, SLACK = 3.06, 3.30, 0.1


def cell(scene: str, **options: int) -> Cell:
    return Cell(scene, "kd-ropes", tuple(options.items()), work="tree", size=0)


def _trees(full: bool) -> list[tuple[str, dict[str, int]]]:
    """Return pairs of a scene and build options: each scene with the default options, and each
    scene of DEPTH also with its depth."""
    return [(scene, options) for scene in SCENES if full or scene not in STAND_IN
            for options in ({}, *([{"max_depth": DEPTH[scene]}] if scene in DEPTH else ()))]


def cells(full: bool) -> list[Cell]:
    return [cell(scene, **options) for scene, options in _trees(full)]


def judge(data: Path, full: bool) -> verdicts.Verdict:
    """Judge whether ropes enlarge the trees as much as published."""
    claims = []
    for scene, options in _trees(full):
        result = read(cell(scene, **options), data)
        if result is None or scene in DEPTH and not options:
            continue    # a scene in DEPTH is judged at that depth only
        tree, leaves = result["tree"], _published(scene)[0]
        chosen = "chosen" if options else "the default"
        claims.append(verdicts.Claim(
            f"ropes make {scene}'s tree {number(tree['overhead'])} times as large, within "
            f"{SLACK:.0%} of the published {LOWEST:.2f} to {HIGHEST:.2f} (depth {tree['depth']}, "
            f"{chosen}; {number(tree['leaves'] / leaves)} times the published leaves)",
            _within(tree["overhead"]), (scene,), stand_in=bool(result["scene"]["stand_in"])))
    return verdicts.of_claims(claims)


def _within(overhead: float) -> bool:
    return LOWEST * (1 - SLACK) <= overhead <= HIGHEST * (1 + SLACK)


def draw(data: Path, out: Path, full: bool) -> None:
    results, rows, lines = {}, [], []
    for scene, options in _trees(full):
        result = read(cell(scene, **options), data)
        if result is None:
            continue
        tree, about, triangles = result["tree"], result["scene"], published_triangles(
            "fig17", scene)
        if not options:
            results[scene] = result
            rows.append([scene, "published", triangles, *_published(scene)])
            if about["stand_in"]:
                lines.append(f"{scene} is a procedural stand-in for {about['stand_in']}.")
            elif triangles != about["triangles"]:
                lines.append(f"{scene} has {about['triangles']:,} triangles here and "
                             f"{triangles:,} in the paper, because this program uses another "
                             "edition of the model.")
        words = ", ".join(("here", *(f"{k}={v}" for k, v in options.items())))
        rows.append([scene, words, about["triangles"],
                     *(tree[key] / scale for key, _, scale, _ in QUANTITIES)])
        lines.append(_verdict(scene, words, tree))
    lines += [] if full else [LEFT_OUT]
    heads = ("scene", "tree", "triangles", *(head for *_, head in QUANTITIES))
    write_csv(out / "fig17.csv", heads, rows)
    table = [[*row[:2], *(f"{value:,}" if isinstance(value, int) else f"{value:,.0f}"
                          for value in row[2:5]), *(number(value) for value in row[5:])]
             for row in rows]
    write_text(out / "fig17.md", "\n".join((
        "# Figure 17: what ropes add to a kd-tree (Popov et al. 2007)\n",
        f"Bytes are counted as in the paper's records: {NODE_BYTES} per node, {REFERENCE_BYTES} "
        "per reference, and 48 per leaf for six ropes and a box. The paper's table has a column "
        "\"references\" but does not say what the number counts. The sizes in the paper's table "
        "are right if the number counts references per leaf that is not empty. Our table "
        "therefore counts such references. The "
        "survey says that each node has six ropes, but the sizes are right "
        "only if inner nodes have none. The paper does not print the depths of its trees. "
        + " ".join(f"For the mesh of {scene} the depth {depth} was chosen so that the tree has "
                   "about as many leaves as the paper's." for scene, depth in DEPTH.items())
        + " The other trees have the default depth. The verdict judges the overhead, and not the "
        "number of leaves.\n",
        markdown_table(heads, table), "\n".join(f"* {line}" for line in lines), "")))
    _chart(results, out)


def _published(scene: str) -> list[float]:
    """Return the survey's numbers for a scene, with the divisors of QUANTITIES applied."""
    values = [published("fig17", scene, "kd-ropes", quantity=name) for _, name, *_ in QUANTITIES]
    return [(value or float("nan")) / scale
            for value, (_, _, scale, _) in zip(values, QUANTITIES)]


def _verdict(scene: str, words: str, tree: dict[str, float]) -> str:
    leaves, triangles_a_leaf = _published(scene)[0], tree["references"] / tree["leaves"]
    return (f"{scene}, {words} (depth {tree['depth']}): ropes make the tree "
            f"{number(tree['overhead'])} times as large, "
            f"{'within' if _within(tree['overhead']) else 'not within'} "
            f"{SLACK:.0%} of the published {LOWEST:.2f} to {HIGHEST:.2f}. The tree has "
            f"{number(tree['leaves'] / leaves)} times the published leaves and "
            f"{number(triangles_a_leaf)} references per leaf, empty leaves included. The more "
            "references a tree has, the smaller is the ropes' share of its bytes.")


def _chart(results: dict[str, dict], out: Path) -> None:
    ours = [(result["tree"]["bytes"], result["tree"]["bytes_ropes"])
            for result in results.values()]
    series = [_series("published", [_published_bytes(scene) for scene in results], PUBLISHED),
              _series("here", ours, HERE)]
    figure, axis = plt.subplots(figsize=(9, 1.4 + 0.6 * len(results)), layout="constrained")
    dot_rows(axis, [titled(scene, result["scene"]["stand_in"])
                    for scene, result in results.items()], series,
             "MiB (log); a line begins at the kd-tree alone, and its dot is the tree with ropes")
    figure.legend(handles=legend_of(series), frameon=False, fontsize=8, ncols=2,
                  loc="outside upper left")
    figure.get_layout_engine().set(rect=(0, 0.06, 1, 0.94))
    save_chart(figure, out / "fig17.png", "Records as in Popov et al. 2007.",
               "Lines show the size of each scene's kd-tree without and with ropes, here and as "
               "published")


def _published_bytes(scene: str) -> tuple[float, float]:
    """Return the published bytes of a kd-tree without and with ropes, or zeros."""
    bare, whole = (published("fig17", scene, "kd-ropes", quantity=name) or 0
                   for name in ("kd-tree size", "kd-tree size with ropes"))
    return bare, whole


def _series(name: str, sizes: list[tuple[float, float]], look: tuple[str, str]) -> Series:
    """Return a series in MiB. A line per tree joins its sizes without and with ropes.

    ``sizes`` are in bytes; a pair of zeros gets no line.
    """
    pairs = [(bare / 2 ** 20, whole / 2 ** 20) for bare, whole in sizes]
    return Series(name, [whole for _, whole in pairs], look,
                  [pair if all(pair) else None for pair in pairs],
                  [f"{plain(bare)} to {plain(whole)} MiB, {number(whole / bare)} times"
                   if bare else "" for bare, whole in pairs])
