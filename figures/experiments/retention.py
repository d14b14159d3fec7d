"""Data retention (survey, section 4.3): counts the bytes that passes move.

A pass keeps no ray on the chip for the next pass, so each pass moves rays and states again.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import EYE
from gpgpu_rt.charts import COLOURS
from gpgpu_rt.hardware.cards import cards, find_card

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_numbers import TIMES, nanoseconds, rows_of
from ..framework.results import read
from .gap_work import MOVED

SCENE = "kitchen"
METHODS = ("kd-restart", "kd-short-stack", "bvh-threaded")
SCHEDULES = {"kernels": {"schedule": "kernels"}, "step, K = 1": {"schedule": "step"},
             "step, K = 16": {"schedule": "step", "steps_per_pass": 16},
             "loop": {"schedule": "loop"}}
PARTS = {"rays": ("rays, which never change", COLOURS[1]),
         "state": ("state and hits read", COLOURS[0]),
         "written": ("written", COLOURS[5])}
CARD = "G80"
HEADS = ("method", "schedule", "rays", "draws", "queries", "fragments a ray", "rays read",
         "state read", "written", "bytes a ray", "bytes / bytes of loop",
         "ns a ray on the card's bus")


def size(full: bool) -> int:
    """Pixels per side."""
    return 512 if full else 128


def _cell(method: str, schedule: str, full: bool) -> Cell:
    return Cell(SCENE, method, tuple(SCHEDULES[schedule].items()), size(full), MOVED + EYE, 1)


def cells(full: bool) -> list[Cell]:
    return [_cell(method, schedule, full) for method in METHODS for schedule in SCHEDULES]


def rows(data: Path, full: bool) -> list[list[Any]]:
    """Return the table's rows for the methods that are measured under ``loop``."""
    card, found = find_card(CARD), []
    for method in METHODS:
        results = {s: read(_cell(method, s, full), data) for s in SCHEDULES}
        if results["loop"] is None:
            continue
        alone = _bytes(results["loop"]["gap"])
        for schedule, result in results.items():
            if result is None:
                continue
            one = result["gap"]
            rays, total = one["count"], _bytes(one)
            found.append([method, schedule, rays, one["draws"], one["queries"],
                          one["fragments"] / rays, *(one["bytes"][p] / rays for p in PARTS),
                          total / rays, total / alone, 1e9 * total / rays / card.bandwidth])
    return found


def _bytes(one: dict[str, Any]) -> int:
    return sum(one["bytes"][part] for part in PARTS)


def draw(data: Path, out: Path, full: bool) -> None:
    found = rows(data, full)
    if not found:
        return
    heading = read(_cell(found[0][0], found[0][1], full), data)
    assert heading is not None
    note = (f"{SCENE}, {size(full)}x{size(full)} eye rays; the pass log counts the bytes of "
            f"streams, not of tables; K is the number of steps per pass; "
            f"{heading['gpu']['renderer']}, commit {heading['commit']}."
            + (f" {SCENE} is a procedural stand-in." if heading["scene"]["stand_in"] else ""))
    write_csv(out / "retention.csv", HEADS, found)
    write_text(out / "retention.md", "# Data retention\n\n" + _paragraph(found) + "\n\n" + note
               + "\n\n" + markdown_table(HEADS, [[number(v) if isinstance(v, float) else v
                                                  for v in row] for row in found]))
    figure, axes = plt.subplots(1, len(METHODS), figsize=(11, 4.6), sharey=True)
    for axis, method in zip(axes, METHODS):
        mine = [row for row in found if row[0] == method]
        for at, row in enumerate(mine):
            below = 0.0
            for part, (label, colour) in enumerate(PARTS.values()):
                axis.bar(at, row[6 + part], bottom=below, color=colour, width=0.65,
                         label=label if at == 0 else None)
                below += row[6 + part]
            axis.annotate(f"{number(row[10])} x", (at, below), ha="center", fontsize=8,
                          xytext=(0, 3), textcoords="offset points")
        axis.set_xticks(range(len(mine)), [row[1].replace(", ", "\n") for row in mine], fontsize=8)
        axis.set_title(method, fontsize=10)
        axis.spines[["top", "right"]].set_visible(False)
    axes[0].set(ylabel="bytes a ray, of streams")
    axes[-1].legend(frameon=False, fontsize=8)
    figure.tight_layout(rect=(0, 0.06, 1, 1))
    save_chart(figure, out / "retention.png", note + " Numbers above the bars: bytes divided by "
               "the bytes of `loop`.",
               "Bars show the bytes that the streams of a ray move under each schedule, split "
               "into rays, state and written values")


def _published() -> tuple[float, float]:
    """Return the shortest and longest time (ns) of an eye or shadow ray on a card, from Figures
    13, 16 and 22."""
    on_cards = {card.name for card in cards()}
    times = [nanoseconds(row) for name in ("fig13", "fig16", "fig22") for row in rows_of(name)
             if row["rays"] in ("primary", "shadow") and row["unit"] in TIMES
             and row["hardware"] in on_cards]
    return min(filter(None, times)), max(filter(None, times))


def _paragraph(found: list[list[Any]]) -> str:
    worst = max(found, key=lambda row: row[10])
    shares = [row[6] / row[9] for row in found if row[1] == "kernels"]
    sixteen = [row[10] for row in found if row[1] == "step, K = 16"]
    parts = ["The survey says that a streaming processor retains no data from kernel to kernel, "
             "so a ray is loaded again for every kernel although it never changes. "
             + ("This is true: " if worst[10] > 2 else "Here this matters little: ") +
             f"under `{worst[1]}`, {worst[0]} moves {number(worst[10])} times the bytes of "
             "`loop`, which reads each ray and writes each hit once."]
    if shares:
        parts.append(f"But rays are only {100 * min(shares):.0f} to "
                     f"{100 * max(shares):.0f} % of the bytes that `kernels` moves. A step "
                     "also reads and writes the state that it changes. Sorting rays, the survey's "
                     "remedy, saves no bytes of the state.")
    if sixteen:
        parts.append("Several steps per pass do save such bytes: with 16 steps, passes move "
                     f"{number(min(sixteen))} to {number(max(sixteen))} times the bytes of "
                     "`loop`.")
    slow = max(found, key=lambda row: row[11])
    parts.append(f"At the {find_card(CARD).name}'s bandwidth, the bytes of the costliest row take "
                 f"{number(slow[11])} ns a ray. Cards of the papers' time took "
                 f"{' to '.join(map(number, _published()))} ns in total for an eye or a shadow "
                 "ray (Figures 13, 16 and 22).")
    return " ".join(parts)
