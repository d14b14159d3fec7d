"""CPU: compares ray tracing on the CPU with fragment programs, by rays per second and per GFLOP.

The survey compares the CPU and the card in section 4.2.
"""
from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gpgpu_rt.bench.engines import CORES, EMBREE
from gpgpu_rt.charts import COLOURS, MARKERS, Series, dot_rows, legend_of
from gpgpu_rt.gl.context import is_software
from gpgpu_rt.text_format import titled

from ..framework.cell import ON_CPU, Cell, timed_runs
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.published_numbers import published
from ..framework.results import read
from ..framework.trace_times import embree
from ..survey.fig22_large_scenes import FAST
from ..survey.fig22_large_scenes import FIGURE as PACKETS

SCENES = ("cornell", "shirley6", "bunny", "robots", "kitchen", "conference", "sodahall")
HUGE = ("sodahall",)     # only in full runs, because the stand-in for the scene builds slowly


@dataclass(frozen=True)
class EngineColumn:
    """An engine with options. ``threads`` is None for fragment programs."""

    label: str
    method: str
    options: tuple[tuple[str, Any], ...] = ()
    threads: int | None = None


def columns() -> list[EngineColumn]:
    """Return the columns: Embree on one thread and, with several cores, on all threads; then
    fragment programs, two with packets and one with single rays."""
    packets = next(column for column in PACKETS.columns if column.label == FAST)
    several = [EngineColumn(embree(CORES).name, ON_CPU, (("threads", CORES),), CORES)]
    return [EngineColumn(EMBREE, ON_CPU, (), 1), *(several if CORES > 1 else []),
            EngineColumn(packets.label, packets.method, packets.options),
            EngineColumn("kd-packet", "kd-packet", (("packet", (4, 2)),)),
            EngineColumn("bvh-threaded octants", "bvh-threaded", (("octants", True),))]


def cell(scene: str, column: EngineColumn, full: bool) -> Cell:
    return Cell(scene, column.method, column.options, 1024 if full else 512,
                runs=timed_runs(full))


def scenes(full: bool) -> list[str]:
    return [scene for scene in SCENES if full or scene not in HUGE]


def cells(full: bool) -> list[Cell]:
    return [cell(scene, column, full) for scene in scenes(full) for column in columns()]


def said_by_survey() -> dict[str, float]:
    """Section 4.2's numbers for CPU and card: Mrays/s on Soda Hall, and peak GFLOP/s."""
    values = {"cpu": published("text", "sodahall", "mlrta"),
              "gpu": published("text", "sodahall", "bvh-packet"),
              "cpu_peak": _peak("Intel Pentium 4 3.2 GHz"),
              "gpu_peak": _peak("NVIDIA GeForce 8800 GTX")}
    return {name: value for name, value in values.items() if value is not None}


def _peak(hardware: str) -> float | None:
    return published("text", "", "", quantity="peak arithmetic", hardware=hardware)


def rows(data: Path, full: bool) -> list[dict[str, Any]]:
    """Return a row for each scene and column: its rays per second, and its rays per GFLOP if the
    peak is known."""
    found = []
    for scene in scenes(full):
        results = [(column, read(cell(scene, column, full), data)) for column in columns()]
        peaks = [result["peak"] for column, result in results
                 if result is not None and column.threads == CORES]
        base = results[0][1]
        for column, result in results:
            if result is None:
                continue
            peak = result.get("peak")
            if column.threads is None and peaks:
                # A card's peak is not known. Use the rate that multiply-adds reach on the card.
                peak = peaks[0] if is_software(result["gpu"]["renderer"]) else {
                    "nominal": peaks[0]["fragments"]}
            nominal = peak["nominal"] if peak else None
            rate = 1e9 / result["ns_per_ray"]
            found.append({
                "scene": scene, "triangles": result["scene"]["triangles"],
                "stand_in": bool(result["scene"]["stand_in"]), "traced_by": column.label,
                "threads": column.threads, "rays_per_second": rate,
                "over_one_thread": base["ns_per_ray"] / result["ns_per_ray"] if base else None,
                "peak_flops": nominal, "rays_per_gflop": 1e9 * rate / nominal if nominal else None,
                "file": cell(scene, column, full).name})
    return found


def findings(found: list[dict[str, Any]]) -> list[str]:
    """Return sentences that compare the CPU with fragment programs, as section 4.2 does."""
    survey = said_by_survey()
    ratio = (survey["gpu"] / survey["gpu_peak"]) / (survey["cpu"] / survey["cpu_peak"])
    scaled = survey["cpu"] * survey["gpu_peak"] / survey["cpu_peak"]
    lines = [f"On Soda Hall, the survey reports {number(survey['cpu'])} Mrays/s for a CPU of "
             f"{number(survey['cpu_peak'])} GFLOP/s, and {number(survey['gpu'])} Mrays/s for a "
             f"card of {number(survey['gpu_peak'], 4)} GFLOP/s. For each GFLOP, the CPU traces "
             f"{number(1 / ratio)} times as many rays as the card. If a card's rate were "
             f"proportional to its GFLOP/s, this card would reach {number(scaled, 4)} Mrays/s."]
    for scene in dict.fromkeys(row["scene"] for row in found):
        mine = [row for row in found if row["scene"] == scene]
        on_cpu = [row for row in mine if row["threads"] is not None]
        ours = [row for row in mine if row["threads"] is None]
        if not on_cpu or not ours:
            continue
        best, cpu = (max(side, key=lambda row: row["rays_per_second"]) for side in (ours, on_cpu))
        line = (f"{scene}: {best['traced_by']} traces "
                f"{number(best['rays_per_second'] / cpu['rays_per_second'])} times as many rays "
                f"per second as {cpu['traced_by']}")
        if best["rays_per_gflop"] and cpu["rays_per_gflop"]:
            apart = cpu["rays_per_gflop"] / best["rays_per_gflop"]
            line += (f"; for each GFLOP, {cpu['traced_by']} traces {number(apart)} times as many "
                     f"rays as {best['traced_by']} (in the survey {number(1 / ratio)} times)")
        lines.append(line + ".")
    return lines


def draw(data: Path, out: Path, full: bool) -> None:
    """Write out/cpu.csv, .md and .png."""
    found = rows(data, full)
    write_csv(out / "cpu.csv", list(found[0]) if found else [], [list(r.values()) for r in found])
    results = (read(c, data) for c in cells(full))
    known = max((r for r in results if r is not None and "peak" in r), default=None,
                key=lambda r: r["peak"]["threads"])     # the result with the most threads
    peak = known["peak"] if known else {}
    table = [[titled(row["scene"], row["stand_in"]), f"{row['triangles']:,}",
              row["traced_by"], number(row["rays_per_second"] / 1e6),
              number(row["over_one_thread"]), number((row["peak_flops"] or 0) / 1e9)
              if row["peak_flops"] else "-",
              number((row["rays_per_gflop"] or 0) / 1e6) if row["rays_per_gflop"] else "-"]
             for row in found]
    clock_is = peak.get("clock_is", "the clock when this was measured")
    side = cell(SCENES[0], columns()[0], full).size
    parts = ["# Ray tracing on the CPU, beside fragment programs (section 4.2)\n",
             "" if known is None else f"Renderer: {known['gpu']['renderer']}; processor: "
             f"{peak['model']}; measured {known['date']}. {side}x{side} eye rays.\n",
             markdown_table(("scene", "triangles", "traced by", "Mrays/s",
                             f"rate / rate of {EMBREE}", "peak GFLOP/s",
                             "Mrays/s per GFLOP/s of peak"), table),
             *(f"* {line}" for line in findings(found)), "", "Notes:\n",
             "* The peak is nominal, in single precision: "
             + ("not known here." if not peak.get("nominal") else
                f"{number(peak['clock'] / 1e9)} GHz ({clock_is}) times {peak['a_clock']} "
                "operations per clock (from the processor's flags) times the number of cores, "
                f"which is {peak.get('cores', peak['threads'])} for {peak['threads']} threads. "
                "numpy's matrix product on all threads reaches "
                f"{number(peak['attained'] / 1e9)} GFLOP/s; multiply-adds in fragment programs "
                f"reach {number(peak.get('fragments', float('nan')) / 1e9)} GFLOP/s."),
             "* On a software renderer fragment programs run on the same processor, with all its "
             "threads, so only the code differs, not the hardware. On a card, the peak is the "
             "rate that multiply-adds in fragment programs reach.",
             "* Embree is a present-day tracer. It traces single rays through a BVH, and a vector "
             "instruction tests the boxes of several nodes. Reshetov's CPU tracer of 2005 traced "
             "packets through a kd-tree. Soda Hall is measured at full size only.", ""]
    write_text(out / "cpu.md", "\n".join(parts))
    if found:
        _chart(found, out, known)


def _chart(found: list[dict[str, Any]], out: Path, known: dict[str, Any] | None) -> None:
    labels = list(dict.fromkeys(row["traced_by"] for row in found))
    places = list(dict.fromkeys(row["scene"] for row in found))
    figure, axes = plt.subplots(2, 1, figsize=(9, 2 + 1.7 * len(places)),
                                layout="constrained")
    survey = said_by_survey()
    for side, style in (("cpu", "--"), ("gpu", ":")):
        axes[1].axvline(survey[side] / survey[f"{side}_peak"], color="#555555", linestyle=style,
                        linewidth=1, label=f"the survey's {side.upper()}, Soda Hall")
    for axis, key, unit in zip(axes, ("rays_per_second", "rays_per_gflop"), (
            "million rays a second (log)", "million rays per GFLOP of peak (log)")):
        rates = {(row["scene"], row["traced_by"]): row[key] and row[key] / 1e6 for row in found}
        series = [Series(label, [rates.get((place, label)) for place in places], look)
                  for label, look in zip(labels, zip(COLOURS, MARKERS))]
        dot_rows(axis, places, series, unit)
    figure.legend(handles=legend_of(series) + axes[1].get_legend_handles_labels()[0],
                  frameon=False, fontsize=8, ncols=3, loc="outside upper left")
    figure.get_layout_engine().set(rect=(0, 0.03, 1, 0.97))
    save_chart(figure, out / "cpu.png", "" if known is None else
               f"Renderer: {known['gpu']['renderer']}; {known['peak']['model']}.",
               "Dots show the rays per second and the rays per GFLOP of the CPU's own ray "
               "tracing and of fragment programs, by scene")
