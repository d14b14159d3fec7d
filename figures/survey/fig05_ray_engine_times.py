"""Figure 5: a picture by the Ray Engine, its rate, and where the time goes (Carr et al. 2002)."""
from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.charts import COLOURS, plain

from ..experiments import sheets
from ..framework import verdicts
from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_numbers import published, published_range
from ..framework.results import read

METHOD, SCENES, SHOWN = "ray-engine", ("cornell", "bunny", "kitchen"), "bunny"
AS_IT_IS, ALL_ON_HOST = "as it is", 1 << 30
# SETTINGS are measured on every scene, BATCHES only on the scene SHOWN.
SETTINGS: dict[str, dict[str, Any]] = {
    AS_IT_IS: {}, "nearest by depth": {"nearest": "depth"},
    "short queues on the host": {"cpu_below": 32}, "all on the host": {"cpu_below": ALL_ON_HOST}}
BATCHES = {f"batches of {rays:,}": {"batch": rays} for rays in (256, 4096, 65_536)}
PARTS = (("traversal_seconds", "walking and queueing (host)", COLOURS[0]),
         ("host_intersection_seconds", "intersection (host)", COLOURS[5]),
         ("transfer_seconds", "transfers", COLOURS[1]),
         ("intersection_seconds", "intersection (passes)", COLOURS[2]))
# Nominal bus rates of the paper's time, in bytes per second: uploads by AGP 4x, readback as slow
# as PCI at 66 MHz.
AGP_UP, AGP_DOWN = 1066e6, 266e6
HEADS = ("scene", "setting", "rays/s", "rays/s, infinitely fast passes", "rays/s, transfers alone",
         "rays/s, AGP 4x bus alone", "bytes up a ray", "bytes down a ray",
         "extra bytes a ray if quads carried corners", "pairs a ray", "pairs a quad",
         "million pairs/s of the passes")


def cell(scene: str, setting: str, full: bool) -> Cell:
    options = {**SETTINGS, **BATCHES}[setting]
    return Cell(scene, METHOD, tuple(options.items()), 512 if full else 128, runs=2)


def _settings(scene: str) -> list[str]:
    return [*SETTINGS, *(BATCHES if scene == SHOWN else ())]


def cells(full: bool) -> list[Cell]:
    return [cell(scene, setting, full) for scene in SCENES for setting in _settings(scene)]


def row_of(scene: str, setting: str, result: dict[str, Any]) -> list[Any]:
    """Return a row with the columns HEADS, from the last run of a measurement."""
    cost, rays = result["statistics"], result["rays"]
    split, total = cost["split"], cost["trace_seconds"]
    up, down = split["bytes_up"] / rays, split["bytes_down"] / rays
    return [scene, setting, rays / total, rays / (total - split["intersection_seconds"]),
            rays / split["transfer_seconds"], 1 / bus_seconds(result), up, down,
            36 * split["quads"] / rays, split["pairs"] / rays,
            split["pairs"] / split["quads"] if split["quads"] else None,
            split["pairs"] / split["intersection_seconds"] / 1e6 if split["quads"] else None]


def bus_seconds(result: dict[str, Any]) -> float:
    """Return the seconds that a ray's bytes take on a bus of the paper's time."""
    split = result["statistics"]["split"]
    return (split["bytes_up"] / AGP_UP + split["bytes_down"] / AGP_DOWN) / result["rays"]


def card_seconds(result: dict[str, Any]) -> float:
    """Return the seconds that a ray's intersections take at the R200's published rate."""
    return result["statistics"]["split"]["pairs"] / INTERSECTIONS / result["rays"]


def verdict(scene: str, result: dict[str, Any], row: list[Any]) -> str:
    """Return sentences that say whether transfers limit the Ray Engine's speed on a scene."""
    split, total = result["statistics"]["split"], result["statistics"]["trace_seconds"]
    bus, card = bus_seconds(result), card_seconds(result)
    says = ("transfers cost more, as the survey says" if bus > card
            else "transfers cost less, contrary to the survey")
    return (f"{scene}: on a bus of the paper's time, a ray's transfers take {number(1e6 * bus)} "
            f"microseconds, and on an ATI R200 its intersections take "
            f"{number(1e6 * card)} microseconds; {says}. On this renderer, where a transfer is a "
            f"copy in memory, transfers take {number(100 * split['transfer_seconds'] / total)} % "
            f"of the time. With infinitely fast passes the rate here would be "
            f"{number(row[3] / row[2])} times as high; in the paper it would be "
            f"{number(FREE / RATE)} times as high.")


def judge(data: Path, full: bool) -> verdicts.Verdict:
    """Return the verdict on the survey's claim that transfers cost more than intersections.

    Both costs are computed for the paper's hardware, from counted bytes and ray-triangle pairs,
    because the present renderer may have no bus.
    """
    found = [(scene, result) for scene in SCENES
             if (result := read(cell(scene, AS_IT_IS, full), data)) is not None]
    return verdicts.of_claims(verdicts.Claim(
        f"on {scene} a ray's transfers ({number(1e6 * bus_seconds(result))} microseconds on an "
        f"AGP 4x bus) take longer than its intersections "
        f"({number(1e6 * card_seconds(result))} microseconds at the published rate of "
        f"{INTERSECTIONS / 1e6:g} million a second)",
        bus_seconds(result) > card_seconds(result), (scene,),
        stand_in=bool(result["scene"]["stand_in"])) for scene, result in found)


def _published(scene: str, method: str, quantity: str = "rate") -> float:
    value = published("text", scene, method, quantity=quantity)
    assert value is not None
    return value


RATE = _published("figure 5", METHOD)
FREE = _published("", METHOD + ", infinitely fast GPU")
INTERSECTIONS = _published("", METHOD, "ray-triangle intersections")   # per second, on an R200
# Published ranges for CPUs of that time: rays/s and tests/s.
ON_CPU = published_range("text", "", "cpu packets", quantity="rate")
TESTS_ON_CPU = published_range("text", "", "cpu", quantity="ray-triangle intersections")


def draw(data: Path, out: Path, full: bool) -> None:
    rows, lines, bars, renderer = [], [], [], "?"
    for scene in SCENES:
        for setting in _settings(scene):
            result = read(cell(scene, setting, full), data)
            if result is None:
                continue
            renderer, about = result["gpu"]["renderer"], result["scene"]
            rows.append(row_of(scene, setting, result))
            bars.append((f"{scene}, {setting}", result["statistics"], result["rays"]))
            if setting == AS_IT_IS:
                lines.append(verdict(scene, result, rows[-1]))
                if about["stand_in"]:
                    lines.append(f"{scene} is a procedural stand-in for {about['stand_in']}.")
    write_csv(out / "fig05.csv", HEADS, rows)
    write_text(out / "fig05.md", "\n".join((
        "# Figure 5: a picture by the Ray Engine, and where the time goes (Carr et al. 2002)\n",
        f"Renderer: {renderer}. All rays are eye rays. The paper's picture of 34,000 triangles "
        f"ran at {RATE:,.0f} rays/s on a GeForce4 Ti. With an infinitely fast GPU, transfers "
        f"alone would have limited the rate to {FREE:,.0f} rays/s. The survey compares this with "
        f"{ON_CPU[0]:,.0f} to {ON_CPU[1]:,.0f} rays/s of a CPU core (Wald et al. 2001). It prints "
        f"the rate of intersections as {INTERSECTIONS / 1e6:g} million tests/s on the R200, and "
        f"as {TESTS_ON_CPU[0] / 1e6:.0f} to {TESTS_ON_CPU[1] / 1e6:.0f} million on a CPU.\n",
        "On a software renderer a transfer is a copy in memory. The time of transfers on a bus of "
        "the paper's time is therefore computed from the bytes and the bus's nominal rates, "
        "without latencies. These rates are 1,066 MB/s for uploads (AGP 4x) and 266 MB/s for "
        "readback (as PCI at 66 MHz). The bytes include the rays that the host fetches from the "
        "tracer's textures, 32 bytes each, and the results that it writes back, 32 bytes each. "
        "The verdict compares this time with the time of the intersections at the R200's rate. "
        f"Without latencies the computed rate is only an upper bound, so the {FREE:,.0f} rays/s "
        "are not judged. The host's walk is numpy over whole arrays, not the paper's C.\n",
        "In the table, a pair is a ray and a triangle that are tested against each other. A quad "
        "covers the rays of a queue and tests them against one triangle. A rate with infinitely "
        "fast passes leaves out the time of the passes. Rates of transfers or of a bus \"alone\" "
        "count no other time.\n",
        markdown_table(HEADS, [[number(v) if isinstance(v, float) else v if v is not None else "-"
                                for v in row] for row in rows]), *lines, "",
        "## Errors of 24 bits of depth\n",
        "With `nearest by depth` a depth buffer of 24 bits keeps each ray's nearest hit, and hits "
        f"at nearly equal distances may be confused. In this test {sheets.COUNT} sheets lie one "
        "above another. The range of depth ends at a floor far below the sheets. Rays hit the "
        "sheets from above. For each gap between sheets, the table shows the share of rays for "
        "which another sheet than the topmost is found. All lengths are divided by the height of "
        "the highest ray's origin over the floor.\n",
        markdown_table(sheets.HEADS, [[row[0], *map(number, row[1:])] for row in sheets.rows()])
    )))
    figure, (left, right) = plt.subplots(1, 2, figsize=(12.4, 5.4), width_ratios=(1, 1.5))
    left.imshow(picture(full))
    left.set_axis_off()
    left.set_title(f"{SHOWN}, by {METHOD}", fontsize=9)
    _draw_bars(right, bars)
    figure.tight_layout(rect=(0, 0.04, 1, 1))
    save_chart(figure, out / "fig05.png", f"Renderer: {renderer}.",
               "A picture traced by the Ray Engine. Bars divide the microseconds per ray among "
               "host, transfers and passes")


def picture(full: bool) -> np.ndarray:
    side = 512 if full else 160
    with rt.Tracer(SHOWN, METHOD) as tracer:
        return np.asarray(tracer.render(size=(side, side)))


def _draw_bars(axis: Any, bars: list[tuple[str, dict[str, Any], int]]) -> None:
    for at, (_, cost, rays) in enumerate(bars):
        begin = 0.0
        for key, name, colour in PARTS:
            width = 1e6 * cost["split"][key] / rays
            axis.barh(at, width, left=begin, color=colour, label=name if not at else None)
            begin += width
        axis.text(begin, at, f" {plain(rays / cost['trace_seconds'])} rays/s", va="center",
                  fontsize=7)
    axis.set(yticks=range(len(bars)), yticklabels=[name for name, *_ in bars],
             xlabel="microseconds a ray")
    axis.margins(x=0.16)
    axis.tick_params(labelsize=7)
    axis.invert_yaxis()
    axis.spines[["top", "right"]].set_visible(False)
    if bars:
        axis.legend(frameon=False, fontsize=7, ncols=4, loc="lower left", bbox_to_anchor=(0, 1))
