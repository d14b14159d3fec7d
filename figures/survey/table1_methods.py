"""Table 1: properties of our methods, beside the properties that the survey prints.

Our properties come from the method table and from measurements.
"""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from gpgpu_rt.report.verdict_words import WORDS

from ..framework import verdicts
from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import read
from . import fig26_all_methods as fig26
from .surveyed import (
    STANDS_FOR, SurveyedMethod, entries, published_speed, rays_of_columns, table1, updated
)

NONE = "none"       # no structure over triangles
# Class of the structure that a tracer built -> the papers' word.
STRUCTURES = {"Grid": "Uniform Grid", "Bvh": "BVH", "ImageTree": "BVH", "KdTree": "kD-tree",
              "tuple": NONE, "NoneType": NONE}
WITHOUT = ("Ray-Space", "N/A")      # the survey's words for methods without such a structure
COLUMNS = ("acceleration_structure", "dynamic_geometry", "packet_tracing", "stack",
           "implementation")
NOTES = (
    "Acceleration structure: what the tracer built over the triangles, in the survey's words.",
    "Dynamic geometry: Y if the method updates its structure without a rebuild when triangles "
    "move (it has `refit`, or nothing to build), as observed with `Tracer.update`. Zhou's method "
    "rebuilds fast enough for every frame; our build times are in the second table.",
    "Implementation: all methods are fragment programs here; none uses a streaming language.",
    "Packet tracing: Popov's method traces both single rays and packets, which are two methods "
    "here. If the survey says N/A, the property is not compared. As a structure, N/A counts as "
    "none.")


@dataclass(frozen=True)
class MethodProperties:
    """A paper's row: the survey's words and ours for each column, and the cost of updates.

    ``build`` and ``update`` are in seconds, ``size`` in bytes.
    """

    entry: SurveyedMethod
    theirs: dict[str, str]
    ours: dict[str, str]
    build: float
    update: float
    rebuilt: bool
    size: float

    def agrees(self, column: str) -> bool | None:
        """Whether the survey and this program agree; None if the survey says N/A.

        The column of the structure is always compared: there N/A means "none".
        """
        theirs, ours = self.theirs[column], self.ours[column]
        if column == "acceleration_structure":
            return ours == NONE if theirs.startswith(WITHOUT) else theirs.startswith(ours)
        if theirs == "N/A":
            return None
        return ours in theirs.split("/")


def cells(full: bool) -> list[Cell]:
    return [*fig26.cells(full), *(updated(entry) for entry in _surveyed())]


def _surveyed() -> list[SurveyedMethod]:
    return [entry for entry in entries() if entry.source]


def lines(data: Path, full: bool) -> Iterator[MethodProperties]:
    """Yield a row for each paper whose method is measured, in the survey's order."""
    for entry in _surveyed():
        timed, moved = read(entry.measured(full), data), read(updated(entry), data)
        if timed is None or moved is None:
            continue
        row, found = entry.row, moved["updates"]
        built = STRUCTURES.get(timed["structure"], timed["structure"])
        still = not found["rebuilt"] or built == NONE
        ours = {"acceleration_structure": built, "dynamic_geometry": "Y" if still else "N",
                "packet_tracing": "Packet" if row.packet else "Mono",
                "stack": "Stack-based" if row.stack else "Stackless", "implementation": "Shader"}
        yield MethodProperties(entry, table1()[entry.source or ""], ours, found["build"],
                               found["update"], found["rebuilt"], found["size"])


def judge(data: Path, full: bool) -> verdicts.Verdict:
    """The worse of two verdicts: on the properties, and on relative performance (Figure 26).

    Figure 26's verdict counts only if it rests on enough scenes and pairs.
    """
    found = list(lines(data, full))
    if not found:
        return verdicts.of_claims([])
    scores = [line.agrees(column) for line in found for column in COLUMNS]
    speed = fig26.judge(data, full)
    differ = [f"{line.entry.source}, {column.replace('_', ' ')}: {line.ours[column]}, not "
              f"{line.theirs[column]}" for column in COLUMNS[:-1] for line in found
              if line.agrees(column) is False]
    same, stated = scores.count(True), len(scores) - scores.count(None)
    words = [verdicts.word_of_claims(same, stated),
             *([speed.word] if speed.word not in (verdicts.TOO_LITTLE, verdicts.UNMEASURED)
               else [])]
    return replace(
        speed, word=max(words, key=WORDS.index), claims=stated, held=same,
        structure=stated, why=f"{same} of {stated} properties that the survey states are the same "
        "here"
        + (f"; these differ (implementation left out): {'; '.join(differ)}" if differ else "")
        + f". Relative performance, as in Figure 26: {speed.word}; {speed.why}")


def draw(data: Path, out: Path, full: bool) -> None:
    found = list(lines(data, full))
    speeds = {row.entry.source: row for row in fig26.rows(data, full)}
    heads = ("source", "method", *(f"{who}_{column}" for column in COLUMNS
                                   for who in ("survey", "here")),
             "survey_relative", "measured_relative", "predicted_relative", "build_seconds",
             "update_seconds", "rebuilt", "table_bytes")
    write_csv(out / "table1.csv", heads, [
        (line.entry.source, line.entry.label,
         *(words[column] for column in COLUMNS for words in (line.theirs, line.ours)),
         published_speed(line.entry.source), speeds[line.entry.source].measured,
         speeds[line.entry.source].predicted, line.build, line.update, line.rebuilt, line.size)
        for line in found])
    parts = [
        "# Table 1: properties of the methods\n",
        "An entry of the table is what the survey says. If the property of our method differs, or "
        "if the survey says N/A, our property follows after a slash. The acceleration structure "
        "of our method always follows after a semicolon.\n",
        markdown_table(("source", "method here", *(c.replace("_", " ") for c in COLUMNS),
                        "relative performance", "measured here", "predicted, 8800 GTX"),
                       [[line.entry.source, line.entry.label,
                         *(_cell(line, column) for column in COLUMNS),
                         number(published_speed(line.entry.source)),
                         number(speeds[line.entry.source].measured),
                         number(speeds[line.entry.source].predicted)] for line in found]),
        "The next table shows the time for building a structure, and the time for updating it "
        "after triangles have moved, measured here:\n",
        markdown_table(("source", "method here", "build, ms", "update, ms", "update", "tables, "
                        "KiB"), [[line.entry.source, line.entry.label, number(1e3 * line.build),
                                  number(1e3 * line.update),
                                  "nothing to build" if line.ours[COLUMNS[0]] == NONE
                                  else "rebuilt" if line.rebuilt else "refitted",
                                  number(line.size / 1024)] for line in found]),
        "## What must be known\n", *(f"* {note}" for note in (rays_of_columns(full), *NOTES)), ""]
    write_text(out / "table1.md", "\n".join(parts))
    if found:
        _chart(found, out)


def _cell(line: MethodProperties, column: str) -> str:
    theirs, ours = line.theirs[column], line.ours[column]
    if column == "acceleration_structure":
        return f"{theirs}; {ours}"
    return theirs if line.agrees(column) else f"{theirs} / {ours}"


def _chart(found: list[MethodProperties], out: Path) -> None:
    # Colour-blind readers can tell blue from orange, and the word "not" says the same as orange.
    colours = {True: "#cfe2f3", False: "#f8d3b0", None: "#eeeeee"}
    figure, axis = plt.subplots(figsize=(12, 0.42 * len(found) + 1.6))
    for y, line in enumerate(found):
        for x, column in enumerate(COLUMNS):
            axis.add_patch(plt.Rectangle((x, y), 1, 1, facecolor=colours[line.agrees(column)],
                                         edgecolor="white"))
            theirs, ours = line.theirs[column], line.ours[column]
            words = {True: ours, False: f"{ours}, not {theirs}", None: f"{ours} (survey: N/A)"}
            axis.text(x + 0.5, y + 0.5, words[line.agrees(column)], ha="center", va="center",
                      fontsize=7.5)
    axis.set(xlim=(0, len(COLUMNS)), ylim=(len(found), 0))
    axis.set_xticks([x + 0.5 for x in range(len(COLUMNS))],
                    [column.replace("_", " ") for column in COLUMNS])
    axis.xaxis.tick_top()
    axis.set_yticks([y + 0.5 for y in range(len(found))],
                    [f"{line.entry.source}: {line.entry.label}" for line in found], fontsize=8)
    axis.tick_params(length=0)
    axis.spines[:].set_visible(False)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "table1.png", "Ours: from the method table, the structures that were "
               "built, and the updates that were timed. Blue: our method has the property that "
               "the survey says. Orange: our method has another property. Grey: the survey says "
               "nothing.",
               "A table of the properties of each paper's method here; colours and words say "
               "where the survey's word differs")


assert set(STANDS_FOR) == set(table1()), "every row of Table 1 has a method that stands for it"
