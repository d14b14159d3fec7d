"""The extremes: measures every method on every extreme case, in default and relaxed settings.

A relaxed setting may lose hits.
"""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.conform.families import FAMILIES
from gpgpu_rt.options import TRACER_OPTIONS

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished

PRECISIONS = ({"precision": "fp24"}, {"precision": "fp16"})
STORED = tuple({"storage": "fp16", "rounding": rounding} for rounding in ("nearest", "chop", "up"))
# The step cap in settings in which rays may loop forever. Most rays need far fewer steps.
CAP = 10_000
# The quick size measures these methods with all settings, and all other methods with defaults.
DETAIL = ("grid", "kd-restart", "bvh-threaded")
CATEGORIES = ("leak", "false hit", "wrong triangle", "wrong distance", "unfinished")


def settings_of(row: Any) -> list[dict[str, Any]]:
    """The measured settings: the defaults, and every setting that may lose hits."""
    kd = row.name.startswith("kd-")
    capped = {"step_cap": CAP} if kd else {}
    found: list[dict[str, Any]] = [{}, *({**p, **capped} for p in PRECISIONS)]
    found += [{**stored, **capped} for stored in STORED if kd]
    found += [{option.name: value, **capped} for option in row.options
              for value in option.relaxed]
    if row.name == "bvh-threaded":    # all methods use the same tests, so one method is enough
        tests = next(o for o in TRACER_OPTIONS if o.name == "intersection")
        found += [{tests.name: c} for c in tests.choices or () if c != tests.default]
    return found


def cells(full: bool) -> list[Cell]:
    """Return the cells of every setting of every method.

    The quick size omits methods without the schedule `loop`. For methods outside DETAIL, the quick
    size has only the defaults.
    """
    return [Cell("extremes", row.name, tuple(options.items()), 128 if full else 24, "extremes", 1)
            for row in rt.methods() if full or "loop" in row.schedules
            for options in settings_of(row)[:None if full or row.name in DETAIL else 1]]


def label(cell: Cell) -> str:
    return " ".join([cell.method, *(str(v) for k, v in cell.options if k != "step_cap")])


def draw(data: Path, out: Path, full: bool) -> None:
    results = dict(finished(cells(full), data))
    if not results:
        return
    renderer = next(iter(results.values()))["gpu"]["renderer"]
    write_csv(out / "extremes.csv",
              ("row", "case", "setting", "rays", "wrong", "upper limit at 95 %", *CATEGORIES,
               "within the bound", "missed where float64 hits", "t error, ulp", "t error, bounds",
               "steps a ray", "most steps", "cap", "capped"),
              [_csv_row(name, cell, result["cases"][name]) for cell, result in results.items()
               for name in FAMILIES if name in result["cases"]])
    plain = {cell.method: result["cases"] for cell, result in results.items() if not cell.options}
    write_text(out / "extremes.md", "\n".join([
        f"# The extremes\n\nRenderer: {renderer}. The column `row` is the row of the case in the "
        "catalogue of extreme cases (docs/extremes.md). A ray is wrong if its answer lies outside "
        "the error bound that is derived for float32 and the watertight test. In fp24 and fp16 "
        "most distances lie outside this bound, so the second table divides wrong rays by kind. "
        "The tables give the worst error of t in ulp, which are units in the last place, and in "
        "multiples of the bound.\n",
        "## float32, the defaults\n\nFor each method the table has the number of wrong rays and, "
        "after a semicolon, the largest number of steps of a ray. If the step cap stopped rays, "
        "their number follows.\n", _plain_table(plain),
        "## Every setting, over all cases\n\nThe table has the shares of wrong rays in percent. "
        "\"Through closed meshes\" is the share of misses among the rays that must hit a mesh. "
        "`ended` is `no` if the step cap stopped rays. These rays count as `unfinished`.\n",
        _settings_table(results)]))
    _chart(results, out / "extremes.png", renderer)


def _csv_row(name: str, cell: Cell, r: dict[str, Any]) -> list[Any]:
    return [FAMILIES[name].row, name, label(cell), r["rays"], r["wrong_share"], r["upper_95"],
            *(r["counts"][c] for c in CATEGORIES), r["within_bound"], r["missed"],
            r["t_ulps"]["max"], r["t_bounds"]["max"], r["steps"], r["most_steps"], r["cap"],
            r["capped"]]


def _plain_table(plain: dict[str, dict[str, Any]]) -> str:
    rows = []
    for name, kind in FAMILIES.items():
        mine = {method: cases[name] for method, cases in plain.items() if name in cases}
        if not mine:
            continue
        worst = max(mine.values(), key=lambda r: r["t_bounds"]["max"])
        cells = [_wrong(r) if r is not None else "-" for r in map(mine.get, plain)]
        rows.append([kind.row, kind.what, worst["rays"], number(worst["t_ulps"]["max"]),
                     number(worst["t_bounds"]["max"]), *cells])
    return markdown_table(("row", "case", "rays", "worst t, ulp", "worst t, bounds", *plain), rows)


def _wrong(r: dict[str, Any]) -> str:
    wrong = sum(r["counts"][c] for c in CATEGORIES)
    return f"{wrong}; {r['most_steps']}" + (f", {r['capped']} capped" if r["capped"] else "")


def _settings_table(results: dict[Cell, dict[str, Any]]) -> str:
    rows = []
    for cell, result in results.items():
        cases = list(result["cases"].values())
        rays = sum(r["rays"] for r in cases)
        shares = [number(100 * sum(r["counts"][c] for r in cases) / rays) for c in CATEGORIES]
        aimed = [r for r in cases if r["closed_leaks"] is not None]
        leaks = 100 * sum(r["closed_leaks"] for r in aimed) / max(1, sum(r["rays"] for r in aimed))
        worst = max(r["t_bounds"]["max"] for r in cases)
        rows.append([label(cell), *shares, number(leaks), number(worst),
                     number(sum(r["steps"] * r["rays"] for r in cases) / rays),
                     "no" if any(r["capped"] for r in cases) else "yes"])
    return markdown_table(("setting", *CATEGORIES, "through closed meshes", "worst t, bounds",
                           "steps a ray", "ended"), rows)


def _chart(results: dict[Cell, dict[str, Any]], path: Path, renderer: str) -> None:
    """Draw a map of settings and cases: the share of leaks, false hits and unfinished rays."""
    names = list(FAMILIES)
    shares = np.full((len(results), len(names)), np.nan)
    for i, result in enumerate(results.values()):
        for j, name in enumerate(names):
            r = result["cases"].get(name)
            if r is not None:
                bad = sum(r["counts"][c] for c in ("leak", "false hit", "unfinished"))
                shares[i, j] = bad / r["rays"] if r["rays"] else 0
    figure, axis = plt.subplots(figsize=(12, 1.8 + 0.24 * len(results)))
    shown = np.log10(np.maximum(shares, 1e-4))
    image = axis.imshow(shown, cmap="magma_r", vmin=-4, vmax=0, aspect="auto")
    axis.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=7)
    axis.set_yticks(range(len(results)), [label(cell) for cell in results], fontsize=7)
    bar = figure.colorbar(image, ax=axis, ticks=range(-4, 1))
    bar.ax.set_yticklabels(["none", "0.1 %", "1 %", "10 %", "100 %"])
    figure.tight_layout(rect=(0, 0.03, 1, 1))
    save_chart(figure, path, f"Renderer: {renderer}",
               "A map with a row for each setting and a column for each family of extreme "
               "rays; a dark field has many rays with a leak or a false hit, or stopped by the "
               "cap")
