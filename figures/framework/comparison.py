"""Comparison: compares the published, the predicted and the measured time of each method.

The predicted time is for the paper's card. Figures 12, 13, 16, 20 and 22 are such comparisons.
"""
from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from gpgpu_rt.charts import HERE, PREDICTED, PUBLISHED, Series, dot_rows, legend_of
from gpgpu_rt.text_format import titled

from . import predicted_times, verdicts
from .cell import ON_CPU, PERIOD_TEST, Cell
from .kendall import tau_b
from .output import markdown_table, number, plt, save_chart, write_csv, write_text
from .predicted_times import PaperCard, PredictedRow
from .published_numbers import nanoseconds, published_row, published_triangles
from .results import read

LOW = 0.8    # if tau-b (kendall.py) of our times is lower, the page lists the pairs out of order
ACROSS = 2   # number of panels in a row of a chart
TIE = 1.05   # published numbers within this factor count as equal
TESTED_BY = ("Our methods test triangles as Möller and Trumbore 1997 do, because this test was in "
             "use when the compared papers were written. "
             "The survey does not say which test a paper used. If a paper used precomputed "
             "projections, as Wald et al. 2001 do, ours is the nearest test that is available. "
             "The default of this program, the watertight test of Woop, Benthin and Wald 2013, is "
             "not used here.")
TAU_B = ("tau-b says how well an order of the methods agrees with the published order: 1 for the "
         "same order, -1 for the reverse. Ties between published numbers make the highest value "
         "smaller than 1. Published numbers within 5 % count as ties.\n")
HOW_PREDICTED = (
    "No constant is fitted. If the mesh of a scene is missing, no time is predicted. If the rays "
    "of a packet are the lanes of a warp, a lane is assumed to run the kernels of a single ray. "
    "A fragment that traces a packet of 2x2 rays is assumed to compute with vectors of four "
    "components, one component per ray.")


@dataclass(frozen=True)
class Panel:
    """A scene and a kind of rays, named as in ``published.csv``."""

    scene: str
    rays: str | None = None   # None if the figure has one kind of rays

    @property
    def label(self) -> str:
        return self.scene if self.rays is None else f"{self.scene}, {self.rays}"


@dataclass(frozen=True)
class MethodColumn:
    """A measured method with its options, and the method's name in ``published.csv``."""

    label: str
    method: str
    options: tuple[tuple[str, Any], ...] = ()
    published_options: str = ""
    # The paper's method, if it differs from ours. Tau-b then skips this column.
    published_method: str | None = None
    only: str | None = None               # the only kind of rays that is measured, if not None
    skips: tuple[str, ...] = ()           # scenes on which the method is not measured


Results = dict[tuple[Panel, str], dict[str, Any]]   # (panel, label of the column) -> result
Rows = dict[Panel, list[dict[str, Any]]]
Taus = dict[Panel, tuple[float, float]]   # tau-b of the predicted and of the measured times


@dataclass(frozen=True)
class Comparison:
    """A figure: its panels, its columns, and a cell (cell.py) for each panel and column.

    ``asked(panel, column, full)`` returns the cell without the option for the triangle test.
    ``source`` names the paper and the hardware of the published times. ``remarks`` returns
    sentences on the results.
    """

    name: str
    title: str
    source: str
    panels: tuple[Panel, ...]
    columns: tuple[MethodColumn, ...]
    asked: Callable[[Panel, MethodColumn, bool], Cell]
    notes: tuple[str, ...]
    remarks: Callable[[Results], list[str]] = lambda results: []
    full_only: tuple[str, ...] = ()       # scenes that the quick size leaves out
    paper_card: PaperCard | None = None   # the card on which the paper measured

    def pairs(self, full: bool) -> list[tuple[Panel, MethodColumn]]:
        """Return the measured pairs of a panel and a column."""
        return [(panel, column) for panel in self.panels for column in self._columns_of(panel)
                if full or panel.scene not in self.full_only]

    def _columns_of(self, panel: Panel) -> list[MethodColumn]:
        return [column for column in self.columns
                if column.only in (None, panel.rays) and panel.scene not in column.skips]

    def cell(self, panel: Panel, column: MethodColumn, full: bool) -> Cell:
        """Return the cell of a panel and a column, with the triangle test PERIOD_TEST."""
        cell = self.asked(panel, column, full)
        if cell.method == ON_CPU:
            return cell
        return replace(cell, options=(*cell.options, PERIOD_TEST))

    def cells(self, full: bool) -> list[Cell]:
        """Return the cells that time methods, and the cells that count kernels for a card."""
        return [*(self.cell(panel, column, full) for panel, column in self.pairs(full)),
                *predicted_times.cells(self, full)]

    def draw(self, data: Path, out: Path, full: bool) -> None:
        """Write out/NAME.csv, .md and .png from the measured cells."""
        results = self._results(data, full)
        rows: Rows = {}
        for panel, column in self.pairs(full):
            if (panel, column.label) in results:
                rows.setdefault(panel, []).append(
                    self._row(panel, column, results[panel, column.label]))
        predicted = self._predicted(data, full)
        for panel, chosen in rows.items():
            for row in chosen:
                one = predicted.get((panel, row["method"]))
                row["predicted_ns_per_ray"] = None if one is None else one.nanoseconds()
        taus = {panel: (_tau_on_card(panel, predicted), self._tau(panel, results))
                for panel in rows}
        flat = [row for chosen in rows.values() for row in chosen]
        heads = list(flat[0]) if flat else []
        write_csv(out / f"{self.name}.csv", heads, [list(row.values()) for row in flat])
        write_text(out / f"{self.name}.md", self._markdown(
            rows, taus, results, predicted))
        if rows:
            self._chart(rows, taus, out, results)

    def judge(self, data: Path, full: bool) -> verdicts.Verdict:
        """Return the verdict on the order of the methods and on the ratios between their times.

        With a ``paper_card``, the verdict is on the times that are predicted for this card. The
        verdict's ``renderer`` is then the verdict on the present renderer's times. Without a
        ``paper_card``, the verdict is on the present renderer's times.
        """
        here = self._judge_renderer(data, full)
        if self.paper_card is None:
            return here
        rows: dict[Panel, list[PredictedRow]] = {}
        for (panel, _), row in self._predicted(data, full).items():
            rows.setdefault(panel, []).append(row)
        said = verdicts.of_groups([
            verdicts.MethodTimes(panel.scene, panel.label, [row.nanoseconds() for row in some],
                                 [row.published for row in some], some[0].stand_in)
            for panel, some in rows.items()])
        said = verdicts.on_card(self.paper_card.card.name, said, here)
        return replace(said, why=said.why + self._not_predicted())

    def _not_predicted(self) -> str:
        """Return a sentence that lists the methods without predicted times, or ""."""
        assert self.paper_card is not None
        names = list(dict.fromkeys(
            column.label for column in self.columns
            if column.method != ON_CPU and not self.paper_card.forms_of(column.method)
            and any(self.published_row(panel, column) for panel in self.panels)))
        return "" if not names else (" No time is predicted for these methods, because they have "
                                     "no era form (docs/era.md), or because the model has no "
                                     f"packets on this card: {', '.join(names)}.")

    def _predicted(self, data: Path, full: bool) -> dict[tuple[Panel, str], PredictedRow]:
        """Return the predictions that the verdict uses."""
        return {(row.panel, row.column.label): row
                for row in predicted_times.rows(self, data, full) if row.judged}

    def _judge_renderer(self, data: Path, full: bool) -> verdicts.Verdict:
        results = self._results(data, full)
        groups = []
        for panel in dict.fromkeys(panel for panel, _ in results):
            ordered = self._ordered(panel, results)
            groups.append(verdicts.MethodTimes(
                panel.scene, panel.label, [ours["ns_per_ray"] for _, ours, _ in ordered],
                [theirs for _, _, theirs in ordered],
                any(ours["scene"]["stand_in"] for _, ours, _ in ordered)))
        return verdicts.of_groups(groups)

    def _results(self, data: Path, full: bool) -> Results:
        found = {(panel, column.label): read(self.cell(panel, column, full), data)
                 for panel, column in self.pairs(full)}
        return {key: result for key, result in found.items() if result is not None}

    def published_row(self, panel: Panel, column: MethodColumn) -> dict[str, str] | None:
        """Return the row of ``published.csv`` for a panel and a column, or None."""
        return published_row(self.name, panel.scene, column.published_method or column.method,
                             column.published_options, panel.rays)

    def _row(self, panel: Panel, column: MethodColumn, result: dict[str, Any]) -> dict[str, Any]:
        theirs = self.published_row(panel, column)
        counters, samples = result["counters"], result["samples_ms"]
        return {"scene": panel.scene, "rays": panel.rays,
                "triangles": result["scene"]["triangles"],
                "stand_in": bool(result["scene"]["stand_in"]), "method": column.label,
                "size": result["settings"]["size"], "median_ms": result["median_ms"],
                "min_ms": min(samples), "max_ms": max(samples), "runs": len(samples),
                "ns_per_ray": result["ns_per_ray"],
                "published": None if theirs is None else float(theirs["value"]),
                "published_unit": None if theirs is None else theirs["unit"],
                "published_ns_per_ray": nanoseconds(theirs), "predicted_ns_per_ray": None,
                **{name: counters.get(name) for name in ("steps", "nodes_visited",
                                                         "triangles_tested")},
                "passes": result["statistics"].get("passes")}

    def _ordered(self, panel: Panel, results: Results
                 ) -> list[tuple[MethodColumn, dict[str, Any], float]]:
        """Return the columns that tau-b compares, with our result and the published ns per ray."""
        found = [(column, results.get((panel, column.label)),
                  nanoseconds(self.published_row(panel, column)))
                 for column in self._columns_of(panel) if column.published_method is None]
        return [(c, ours, theirs) for c, ours, theirs in found if ours and theirs]

    def _tau(self, panel: Panel, results: Results) -> float:
        ordered = self._ordered(panel, results)
        return tau_b([ours["ns_per_ray"] for _, ours, _ in ordered],
                     [theirs for _, _, theirs in ordered])

    def _explained(self, panel: Panel, results: Results) -> list[str]:
        """Return a sentence for each pair of methods whose order differs from the published order.

        Each sentence gives the counters of both methods. The pair with the largest published
        ratio is first.
        """
        pairs = []
        ordered = self._ordered(panel, results)
        for one, ours, theirs in ordered:
            for other, others, their_others in ordered:
                ratio = others["ns_per_ray"] / ours["ns_per_ray"]
                if ratio > 1 and their_others / theirs < 1 / TIE:
                    pairs.append((their_others / theirs, ratio, one.label, other.label, ours,
                                  others))
        return [f"{one} takes 1/{number(ratio)} of the time of {other} here, but "
                f"{number(1 / theirs)} times the time of {other} in the paper. Here "
                f"{_work(one, ours)}, while {_work(other, others)}."
                for theirs, ratio, one, other, ours, others in sorted(pairs, key=lambda p: p[0])]

    def _differences(self, results: Results) -> list[str]:
        first = next(iter(results.values()), None)
        lines = [] if first is None else [
            f"Renderer: {first['gpu']['renderer']} ({first['gpu']['backend']}), measured "
            f"{first['date']}; published: {self.source}. Compare orders and ratios within a "
            "scene, not absolute numbers."]
        lines += ["The papers do not publish their cameras. The cameras here are those of the "
                  "scenes' data sets or of this program.",
                  TESTED_BY]
        scenes = {panel.scene: result["scene"] for (panel, _), result in results.items()}
        for scene, about in scenes.items():
            count = published_triangles(self.name, scene)
            if about["stand_in"]:
                lines.append(f"{scene} is a procedural stand-in for {about['stand_in']}.")
            elif count is not None and count != about["triangles"]:
                lines.append(f"{scene} has {about['triangles']:,} triangles here and {count:,} "
                             "in the paper, because this program uses another edition of the "
                             "model.")
        return lines + list(self.notes)

    def _markdown(self, rows: Rows, taus: Taus, results: Results,
                  predicted: Mapping[tuple[Panel, str], PredictedRow]) -> str:
        parts = [f"# {self.title}\n", TAU_B]
        for panel, chosen in rows.items():
            best = min(row["ns_per_ray"] for row in chosen)
            theirs = [row for row in chosen if row["published"] is not None]
            their_best = min((row["published_ns_per_ray"] for row in theirs), default=1.0)
            unit = theirs[0]["published_unit"] if theirs else ""
            table = [[row["method"], number(row["published"], 4), "-" if row["published"] is None
                      else number(row["published_ns_per_ray"] / their_best),
                      *(number(row[name]) for name in ("published_ns_per_ray",
                                                       "predicted_ns_per_ray")),
                      "-" if row["predicted_ns_per_ray"] is None else number(
                          row["predicted_ns_per_ray"] / row["published_ns_per_ray"]),
                      number(row["ns_per_ray"]),
                      number(row["ns_per_ray"] / best), f"{row['size']}x{row['size']}",
                      number(row["median_ms"]),
                      *(number(row[name]) for name in ("steps", "nodes_visited",
                                                       "triangles_tested")),
                      row["passes"] or "-"] for row in chosen]
            title = titled(panel.label, chosen[0]["stand_in"])
            parts.append(f"## {title}, {chosen[0]['triangles']:,} triangles: "
                         f"{_says(taus[panel])}\n")
            parts.append(markdown_table(
                ("method", f"published {unit}", "published time / fastest published time",
                 "published ns a ray", "predicted ns a ray", "predicted / published",
                 "ns a ray here",
                 "time / fastest time here", "rays here", "ms here", "steps a ray", "nodes a ray",
                 "triangles a ray", "passes"), table))
            turned = _turned([row for (one, _), row in predicted.items() if one == panel])
            if turned:
                parts.append("Where the predicted order differs from the published order:\n\n"
                             + "\n".join(f"* {line}" for line in turned) + "\n")
            explained = self._explained(panel, results) if taus[panel][1] < LOW else []
            if explained:
                parts.append("Where the order differs here from the published order:\n\n"
                             + "\n".join(f"* {line}" for line in explained) + "\n")
        if self.paper_card is not None:
            size = self.paper_card.size
            parts.append(f"Predicted: the time that the {self.paper_card.card.name} would have "
                         f"taken for {size}x{size} pixels, by the machine model of "
                         "[era_machine](era_machine.md), from kernels that Mesa compiled for the "
                         f"card. {HOW_PREDICTED}\n")
        for head, lines in (("What the counters show", self.remarks(results)),
                            ("What differs", self._differences(results))):
            if lines:
                parts.append(f"{head}:\n\n" + "\n".join(f"* {line}" for line in lines) + "\n")
        return "\n".join(parts)

    def _chart(self, rows: Rows, taus: Taus, out: Path, results: Results) -> None:
        kinds = list(dict.fromkeys(panel.rays for panel in rows))
        ordered = sorted(rows, key=lambda panel: kinds.index(panel.rays))
        lines = -(-len(ordered) // ACROSS)
        high = 1 + lines * (1 + 0.48 * max(map(len, rows.values())))
        figure, axes = plt.subplots(lines, ACROSS, squeeze=False, layout="constrained",
                                    figsize=(4.6 * ACROSS, high))
        for panel, axis in zip(ordered, axes.flat):
            _draw_panel(axis, panel, rows[panel], taus[panel])
        for axis in axes.flat[len(ordered):]:
            axis.remove()
        shown = _series([row for chosen in rows.values() for row in chosen])
        figure.legend(handles=legend_of(shown), frameon=False, fontsize=9, ncols=3,
                      loc="outside upper left")
        figure.get_layout_engine().set(rect=(0, 0.4 / high, 1, 1 - 0.4 / high))
        save_chart(figure, out / f"{self.name}.png", "  ".join(self._differences(results)[:2]),
                   "Dots show the nanoseconds that each method takes for a ray: published, "
                   "predicted for the paper's card, and measured here")


def _draw_panel(axis: Any, panel: Panel, chosen: list[dict[str, Any]],
                taus: tuple[float, float]) -> None:
    dot_rows(axis, [row["method"].replace("bvh-threaded ", "bvh-threaded\n") for row in chosen],
             _series(chosen), "nanoseconds a ray (log)")
    kind = titled(panel.label, chosen[0]["stand_in"])
    axis.set_title(f"{kind}\n{_says(taus)}", fontsize=9)


def _series(rows: Sequence[dict[str, Any]]) -> list[Series]:
    left_out = "; none for stand-ins" if any(row["stand_in"] for row in rows) else ""
    return [Series(name, [row[key] for row in rows], look) for name, key, look in (
        ("published", "published_ns_per_ray", PUBLISHED),
        (f"predicted for the paper's card{left_out}", "predicted_ns_per_ray", PREDICTED),
        ("measured here", "ns_per_ray", HERE))]


def _tau_on_card(panel: Panel, predicted: Mapping[tuple[Panel, str], PredictedRow]) -> float:
    some = [row for (one, _), row in predicted.items() if one == panel]
    return tau_b([row.nanoseconds() for row in some], [row.published for row in some])


def _turned(some: Sequence[PredictedRow]) -> list[str]:
    """Return a sentence for each pair of methods whose predicted and published orders differ."""
    return [f"{one.column.label} is predicted to take "
            f"{number(one.nanoseconds() / other.nanoseconds())} times the time of "
            f"{other.column.label}, but takes "
            f"{number(one.published / other.published)} times as long as that method in the paper."
            for one in some for other in some
            if one.published / other.published < 1 / TIE
            and one.nanoseconds() > other.nanoseconds()]


def _says(taus: tuple[float, float]) -> str:
    predicted, here = taus
    on_card = "" if math.isnan(predicted) else f"tau-b predicted {number(predicted, 2)}, "
    return f"{on_card}tau-b here {number(here, 2)}"


def _work(label: str, result: dict[str, Any]) -> str:
    counters = result["counters"]
    return (f"{label} visits {number(counters['nodes_visited'])} nodes and tests "
            f"{number(counters['triangles_tested'])} triangles a ray")
