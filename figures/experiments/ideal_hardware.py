"""Ideal hardware: a cost model of hardware for rays (survey, sections 4.4 and 5).

The model computes how long the counted steps and tests of rays take on three kinds of machines: a
graphics card, with or without triangle or traversal units; the prototypes RPU and SaarCOR, which
have traversal units; and the Cell, which has explicit transfers.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

from gpgpu_rt.bench.workloads import EYE
from gpgpu_rt.charts import COLOURS, MARKERS, Series, dot_rows, legend_of, plain
from gpgpu_rt.hardware.cards import find_card
from gpgpu_rt.hardware.loop_costs import loop_costs
from gpgpu_rt.hardware.machines import (
    Least, machines, on_card, on_cell, on_prototype, runs, with_shading
)

from ..framework.cell import PERIOD_TEST, Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_numbers import published_range
from ..framework.results import finished, read
from .gap_work import COMPILED, DONE, SIDE

SCENES = ("kitchen", "conference")
# kd-texture-stack replaces kd-stack and visits the same nodes. The costs of kd-stack are unknown,
# because the compilers of the papers' cards cannot compile its kernels (docs/era.md).
METHODS = ("kd-restart", "kd-texture-stack", "bvh-threaded")
CARD, TREE = "G80", "kd-texture-stack"     # the prototypes are modelled with the work of TREE
BVH = "bvh-threaded"     # stands for the BVH that Benthin et al. used on the Cell
HEADS = ("scene", "method", "machine", "shader ns", "steps ns", "tests ns", "memory ns",
         "waiting ns", "ns a ray", "Mrays/s", "bound by", "published Mrays/s")


def size(full: bool) -> int:
    """Pixels per side."""
    return 1024 if full else 256


def _options(method: str) -> tuple[tuple[str, Any], ...]:
    return (("octants", True),) if method == BVH else ()


def _cell(scene: str, method: str, full: bool) -> Cell:
    return Cell(scene, method, (*_options(method), PERIOD_TEST), size(full), DONE + EYE, 1)


def cells(full: bool) -> list[Cell]:
    return [_cell(scene, method, full) for scene in SCENES for method in METHODS]


def leasts(method: str, work: dict[str, Any]) -> dict[str, Least]:
    """Return each machine's time for ``work`` (a result of `gap_work.measure`) at peak rates."""
    card, made = find_card(CARD), machines()
    costs = {name: loop_costs(name, method, **dict(_options(method)))
             for name in (CARD.lower(), made["RPU"].compiler, made["Cell"].compiler)}
    own, ideal = costs[CARD.lower()], made["ideal"]
    found = {
        f"{CARD}, shaders alone": on_card(card, work, own),
        f"{CARD}, if no ray waited": on_card(card, work, own, width=1),
        f"{CARD} and triangle units": on_card(card, work, own, ideal, "tests"),
        f"{CARD} and traversal units": on_card(card, work, own, ideal, "steps"),
        f"{CARD} and both": on_card(card, work, own, ideal, "both")}
    # SaarCOR's units also test triangles, so `on_prototype` does not use the costs of the RPU's
    # shaders for SaarCOR.
    if method == TREE:
        found |= {name: on_prototype(made[name], work, costs[made["RPU"].compiler])
                  for name in ("RPU", "SaarCOR 2002", "SaarCOR")}
    if method in (TREE, BVH):
        cell = made["Cell"]
        hidden, waited = (on_cell(cell, work, costs[cell.compiler], one) for one in (True, False))
        found |= {"Cell, transfers hidden": hidden, "Cell, transfers waited for": waited,
                  "Cell, hidden, and shading": with_shading(cell, hidden)}
    return found


def rows(data: Path, full: bool) -> list[list[Any]]:
    found = []
    for scene in SCENES:
        for method in METHODS:
            result = read(_cell(scene, method, full), data)
            if result is None:
                continue
            for name, least in leasts(method, result["gap"]).items():
                printed = (machines()["RPU"].published / 1e6
                           if (name, scene) == ("RPU", "conference") else None)
                found.append([scene, method, name, *(1e9 * part for part in (
                    least.shader, least.steps, least.tests, least.memory, least.waiting,
                    least.seconds)), 1e-6 / least.seconds, least.bound, printed])
    return found


def draw(data: Path, out: Path, full: bool) -> None:
    found = rows(data, full)
    if not found:
        return
    results = [result for _, result in finished(cells(full), data)]
    heading = results[0]
    note = (f"An image has {size(full)}x{size(full)} eye rays, of which sample squares of "
            f"{SIDE}x{SIDE} are traced. A time is the time of the kernels that the rays "
            "run, at the machine's peak rates. The set-up of rays is left out, and nothing "
            "is fitted. The total is the longest of the times of shaders, traversal steps, "
            "triangle tests and memory, plus the waiting. "
            f"{heading['gpu']['renderer']}, commit {heading['commit']}."
            + (" Some scenes are procedural stand-ins."
               if any(r["scene"]["stand_in"] for r in results) else ""))
    write_csv(out / "ideal_hardware.csv", HEADS, found)
    sources = [(one.chip, name.replace("_", " "), _spelled(figure),
                figure["source"] + ("" if figure["read"] else " *"))
               for one in machines().values() for name, figure in one.figures.items()]
    write_text(out / "ideal_hardware.md", "# Hardware for rays\n\n"
               + _paragraph(found, data, full)
               + "\n\n" + note + f"\n\n{TREE} visits the same nodes as kd-stack. A push or a pop "
               "is part of the step before it and accesses the stack on the chip. A shader's "
               "instructions are counted in the output of Mesa's compiler for a card. " + COMPILED
               + " For a machine without a compiler, the compiler that is named below was "
               "used.\n\n"
               + markdown_table(HEADS, [
                   [number(v) if isinstance(v, float) else "-" if v is None else v for v in row]
                   for row in found])
               + "\n## The machines' numbers\n\nNumbers marked * are recalled from memory or "
               "assumed, and were not read in the source. `gpgpu-rt hardware --sources` prints "
               "the numbers of the card.\n\n"
               + markdown_table(("machine", "figure", "value", "source"), sources))
    scenes = list(dict.fromkeys(row[0] for row in found))
    chosen = {scene: [row for row in found if row[0] == scene and row[1] == TREE]
              + [[*row[:2], f"{row[2]} (BVH)", *row[3:]] for row in found
                 if row[:2] == [scene, BVH] and row[2].startswith("Cell")] for scene in scenes}
    figure, axes = plt.subplots(
        len(scenes), squeeze=False, layout="constrained",
        figsize=(9, 1.6 + 0.9 * sum(map(len, chosen.values()))))
    for axis, scene in zip(axes[:, 0], scenes):
        series = _draw_machines(axis, chosen[scene])
        axis.set_title(f"{scene}, {TREE}", fontsize=10)
    figure.legend(handles=legend_of(series), frameon=False, fontsize=8, ncols=7,
                  loc="outside upper left")
    figure.get_layout_engine().set(rect=(0, 0.05, 1, 0.95))
    save_chart(figure, out / "ideal_hardware.png", note, "Dots show nanoseconds per ray "
               "on each machine: for each part of the counted work at the machine's peak rates, "
               "in total, and as published")


def _spelled(figure: dict[str, Any]) -> str:
    value = figure["value"]
    return f"{value if isinstance(value, str) else format(value, ',')} {figure['unit']}".strip()


PARTS = ("shader", "steps", "tests", "memory", "waiting")     # columns 3 to 7 of HEADS
LOOKS = tuple(zip(COLOURS, MARKERS))


def _draw_machines(axis: Any, mine: list[list[Any]]) -> list[Series]:
    series = [Series(name, [row[3 + part] for row in mine], LOOKS[part])
              for part, name in enumerate(PARTS)]
    series.append(Series("total", [row[8] for row in mine], LOOKS[6], texts=[
        f"{plain(row[8])}: {plain(row[9])} Mrays/s" for row in mine]))
    series.append(Series("published", [1e3 / row[11] if row[11] else None for row in mine],
                         LOOKS[5]))
    dot_rows(axis, [row[2] for row in mine], series, "nanoseconds a ray (log)")
    return series


def _paragraph(found: list[list[Any]], data: Path, full: bool) -> str:
    times = {(row[0], row[1], row[2]): row for row in found}
    scene = next((s for s in reversed(SCENES) if (s, TREE, f"{CARD} and both") in times), None)
    if scene is None:
        return "Not measured yet."
    result = read(_cell(scene, TREE, full), data)
    assert result is not None
    mine = {row[2]: row for row in found if row[:2] == [scene, TREE]}
    alone = mine[f"{CARD}, shaders alone"][8]

    def gain(name: str) -> str:
        return number(alone / mine[name][8])
    steps, tests = runs(result["gap"], "steps"), runs(result["gap"], "tests")
    rpu, hidden = mine["RPU"], mine["Cell, transfers hidden"]
    rays = rpu[9] * alone / 1e3
    low, high = published_range("text", "", "rpu", quantity="speed over GPU ray tracing")
    clocks = find_card(CARD).clock / machines()["RPU"].clock
    text = (
        "The survey proposes units for the triangle test, and then units for traversal with a "
        "programmable criterion. Shaders would only shade. The survey calls the RPU "
        f"{low:g} to {high:g} times as fast as graphics hardware. A ray of {scene} takes "
        f"{number(steps)} steps and {number(tests)} tests ({TREE}). With triangle units, "
        f"tracing is {gain(f'{CARD} and triangle units')} times as fast as with shaders alone. "
        f"With traversal units, it is {gain(f'{CARD} and traversal units')} times as fast; with "
        "both kinds of units, "
        f"{gain(f'{CARD} and both')} times. With both kinds of units, the rate is limited by "
        f"{mine[f'{CARD} and both'][10]}. Shaders alone would be "
        f"{gain(f'{CARD}, if no ray waited')} times as fast if no ray waited for another. The RPU "
        f"at {number(machines()['RPU'].clock / 1e6)} MHz could trace "
        f"{number(rpu[9])} Mrays/s, bound by {rpu[10]}")
    text += f"; its published rate is {number(rpu[11])} Mrays/s. " if rpu[11] else ". "
    return text + (
        f"The RPU could trace {number(rays)} times as many rays as the card's shaders at their "
        f"peak, and {number(rays * clocks)} times as many at equal clock"
        + (", which is below the multiple that the survey quotes. On "
           if rays * clocks < low else ". On ")
        + "the Cell, a ray takes "
        f"{number(mine['Cell, transfers waited for'][8] / hidden[8])} "
        "times as long if it waits for its transfers. If another packet continues meanwhile, "
        "transfers are assumed to cost no time, as Benthin et al. found; the Cell is then bound "
        f"by {hidden[10]}, at {number(hidden[9])} Mrays/s. " + _cell_sentence(times, scene)
        + " SaarCOR's design of 2002 was simulated; its published rates were not available to "
        "this project, so the chart shows no published rate for it.")


def _cell_sentence(times: dict[tuple[str, str, str], list[Any]], scene: str) -> str:
    if (scene, BVH, "Cell, transfers hidden") not in times:
        return ""
    row, cell = times[scene, BVH, "Cell, transfers hidden"], machines()["Cell"]
    traced = Least(*(1e-9 * part for part in row[3:8]))
    half, share, twice = (1 - traced.seconds / with_shading(cell, traced, transfers).seconds
                          for transfers in (0.5, 1, 2))
    return (f"With a BVH ({BVH}) the Cell traces {number(row[9])} Mrays/s. If shading runs on "
            f"the same processors and waits for its transfers, {share:.0%} of the time is "
            f"shading. The share is {half:.0%} or {twice:.0%} if a hit needs half or twice the "
            "transfers that are assumed below. The survey reports that shading became the "
            "bottleneck.")
