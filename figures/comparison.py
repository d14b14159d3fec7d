"""A table of times by scene and method beside the published one: the form of Figures 12 and 20."""
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .kendall import tau_b
from .measure import Cell, read
from .output import COLOURS, markdown_table, number, plt, save_chart, write_csv, write_text
from .published_numbers import published, published_triangles

PUBLISHED_RAYS = 512 * 512
LOW = 0.8   # tau-b below this is explained


@dataclass(frozen=True)
class Column:
    """A method of the table, and what the published numbers call it."""

    label: str
    method: str
    options: tuple[tuple[str, Any], ...] = ()
    published_options: str = ""


@dataclass(frozen=True)
class Comparison:
    """A figure: its scenes, its columns and how a cell is measured.

    ``cell`` makes the cell of (scene, column, full size or quick).
    """

    name: str
    title: str
    source: str
    scenes: tuple[str, ...]
    columns: tuple[Column, ...]
    cell: Callable[[str, Column, bool], Cell]
    notes: tuple[str, ...]

    def cells(self, full: bool) -> list[Cell]:
        return [self.cell(scene, column, full) for scene in self.scenes
                for column in self.columns]

    def draw(self, data: Path, out: Path, full: bool) -> None:
        """Write out/NAME.csv, .md and .png from the measured cells."""
        results = {(scene, column.label): read(self.cell(scene, column, full), data)
                   for scene in self.scenes for column in self.columns}
        rows = [self._row(scene, column, results[scene, column.label])
                for scene in self.scenes for column in self.columns
                if results[scene, column.label] is not None]
        taus = {scene: self._tau(scene, results) for scene in self.scenes}
        heads = list(rows[0]) if rows else []
        write_csv(out / f"{self.name}.csv", heads, [list(row.values()) for row in rows])
        write_text(out / f"{self.name}.md", self._markdown(rows, taus, results))
        self._chart(rows, taus, out, results)

    def _row(self, scene: str, column: Column, result: dict[str, Any]) -> dict[str, Any]:
        theirs = published(self.name, scene, column.method, column.published_options)
        counters = result["counters"]
        return {"scene": scene, "triangles": result["scene"]["triangles"],
                "stand_in": bool(result["scene"]["stand_in"]), "method": column.label,
                "size": result["settings"]["size"], "median_ms": result["median_ms"],
                "ns_per_ray": result["ns_per_ray"], "published_ms": theirs,
                "published_ns_per_ray": None if theirs is None else 1e6 * theirs / PUBLISHED_RAYS,
                "steps": counters["steps"], "nodes_visited": counters["nodes_visited"],
                "triangles_tested": counters["triangles_tested"],
                "passes": result["statistics"]["passes"]}

    def _tau(self, scene: str, results: dict[tuple[str, str], Any]) -> float:
        pairs = [(results[scene, c.label]["ns_per_ray"],
                  published(self.name, scene, c.method, c.published_options))
                 for c in self.columns if results[scene, c.label] is not None]
        pairs = [(ours, theirs) for ours, theirs in pairs if theirs is not None]
        return tau_b([a for a, _ in pairs], [b for _, b in pairs])

    def _explained(self, scene: str, results: dict[tuple[str, str], Any]) -> list[str]:
        """Pairs of methods that stand in the other order here than published, with what each
        does for a ray: sentences, the pair that the paper sets furthest apart first."""
        pairs = []
        for one in self.columns:
            for other in self.columns:
                ours = [results[scene, c.label] for c in (one, other)]
                theirs = [published(self.name, scene, c.method, c.published_options)
                          for c in (one, other)]
                if None in ours or None in theirs:
                    continue
                ratio, their_ratio = (b / a for a, b in ((ours[0]["ns_per_ray"],
                                                         ours[1]["ns_per_ray"]), theirs))
                if ratio > 1 and their_ratio < 1 / 1.05:   # published times this near are ties
                    pairs.append((their_ratio, ratio, one.label, other.label, *ours))
        return [f"{one} takes 1/{number(ratio)} of the time of {other} here, {number(1 / theirs)} "
                f"times it in the paper: {_work(one, ours)} against {_work(other, others)}."
                for theirs, ratio, one, other, ours, others in sorted(pairs, key=lambda p: p[0])]

    def _differences(self, results: dict[tuple[str, str], Any]) -> list[str]:
        """What is not as it was published, in sentences."""
        found = [r for r in results.values() if r is not None]
        lines = [f"Renderer: {found[0]['gpu']['renderer']} ({found[0]['gpu']['backend']}), "
                 f"measured {found[0]['date']}; published: {self.source}. Compare orders and "
                 "ratios within a scene, not milliseconds."] if found else []
        lines.append("Cameras are ours: the papers' are not published.")
        for scene in self.scenes:
            result = next((results[scene, c.label] for c in self.columns
                           if results[scene, c.label] is not None), None)
            if result is None:
                continue
            about, count = result["scene"], published_triangles(self.name, scene)
            if about["stand_in"]:
                lines.append(f"{scene} is a procedural stand-in for {about['stand_in']}.")
            elif count is not None and count != about["triangles"]:
                lines.append(f"{scene} has {about['triangles']:,} triangles here, {count:,} "
                             "in the paper.")
        return lines + list(self.notes)

    def _markdown(self, rows: list[dict[str, Any]], taus: dict[str, float],
                  results: dict[tuple[str, str], Any]) -> str:
        parts = [f"# {self.title}\n"]
        for scene in self.scenes:
            chosen = [row for row in rows if row["scene"] == scene]
            if not chosen:
                continue
            best = min(row["ns_per_ray"] for row in chosen)
            theirs = [row["published_ms"] for row in chosen if row["published_ms"] is not None]
            table = [[row["method"], f"{row['size']}x{row['size']}", number(row["median_ms"]),
                      number(row["ns_per_ray"]), number(row["ns_per_ray"] / best),
                      number(row["published_ms"], 4), "-" if row["published_ms"] is None
                      else number(row["published_ms"] / min(theirs)), number(row["steps"]),
                      number(row["nodes_visited"]), number(row["triangles_tested"]),
                      row["passes"]] for row in chosen]
            kind = " (stand-in)" if chosen[0]["stand_in"] else ""
            parts.append(f"## {scene}{kind}, {chosen[0]['triangles']:,} triangles: tau-b "
                         f"{number(taus[scene], 2)}\n")
            parts.append(markdown_table(
                ("method", "rays", "ms", "ns a ray", "over fastest", "published ms (512x512)",
                 "published over fastest", "steps a ray", "nodes a ray", "triangles a ray",
                 "passes"), table))
            if taus[scene] < LOW:
                parts.append("Where the order differs:\n\n" + "\n".join(
                    f"* {line}" for line in self._explained(scene, results)) + "\n")
        parts.append("tau-b: how far our order of the methods agrees with the published one, 1 "
                     "the same, -1 reversed; published times within 5 % count as ties.\n")
        parts.append("What differs:\n\n" + "\n".join(
            f"* {line}" for line in self._differences(results)) + "\n")
        return "\n".join(parts)

    def _chart(self, rows: list[dict[str, Any]], taus: dict[str, float], out: Path,
               results: dict[tuple[str, str], Any]) -> None:
        figure, axes = plt.subplots(1, len(self.scenes), figsize=(3.3 * len(self.scenes), 5.6),
                                    squeeze=False)
        for axis, scene in zip(axes[0], self.scenes):
            chosen = [row for row in rows if row["scene"] == scene]
            for at, row in enumerate(chosen):
                colour = COLOURS.get(row["method"], "#555555")
                pairs = ((at - 0.2, row["ns_per_ray"], {}),
                         (at + 0.2, row["published_ns_per_ray"], {"hatch": "///", "alpha": 0.45}))
                for x, height, style in pairs:
                    if height is not None:
                        axis.bar(x, height, 0.38, color=colour, edgecolor="white", **style)
                        axis.annotate(number(height), (x, height), ha="center", va="bottom",
                                      fontsize=6.5, rotation=90, xytext=(0, 2),
                                      textcoords="offset points")
            axis.set_yscale("log")
            axis.margins(y=0.22)
            axis.set_xticks(range(len(chosen)),
                            [row["method"].replace("bvh-threaded ", "bvh\n") for row in chosen],
                            rotation=35, ha="right", fontsize=8)
            kind = "\n(stand-in)" if chosen and chosen[0]["stand_in"] else "\n"
            axis.set_title(f"{scene}{kind} tau-b {number(taus[scene], 2)}", fontsize=10)
            axis.spines[["top", "right"]].set_visible(False)
        axes[0][0].set_ylabel("nanoseconds a ray (log)")
        figure.suptitle(f"{self.title}\nplain: measured here; hatched: published", fontsize=11)
        figure.tight_layout(rect=(0, 0.07, 1, 1))
        save_chart(figure, out / f"{self.name}.png", "  ".join(self._differences(results)[:2]))


def _work(label: str, result: dict[str, Any]) -> str:
    """What a method does for an eye ray, in words."""
    counters = result["counters"]
    return (f"{label} visits {number(counters['nodes_visited'])} nodes and tests "
            f"{number(counters['triangles_tested'])} triangles a ray")
