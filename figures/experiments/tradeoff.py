"""Tradeoff: compares speed with accuracy, for each precision and each option that changes hits."""
from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.accuracy.candidates import precisions
from gpgpu_rt.accuracy.known_rays import WRONG
from gpgpu_rt.charts import COLOURS, GREY, MARKERS, direct_labels, log_axis
from gpgpu_rt.methods import option_table

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import finished
from ..framework.works import picture_size

SCENES = ("bunny", "cornell")
# At the quick size, only these methods are measured with all options. Most other methods are
# measured in fp32 and fp16. Packets are measured in fp32 only, because their results equal the
# results of single rays, and their programs take seconds to compile.
DETAIL = ("kd-restart", "bvh-threaded")
# These methods get a quarter of the rays, like methods without the schedule `loop`. On the bunny
# they are measured with their defaults only, because every other precision takes minutes.
SLOW = ("ray-classification", "visibility-field")
LOOKS = dict(zip(("fp32", "fp24", "fp16"), zip(COLOURS, MARKERS)))   # colour and marker


def scenes(full: bool) -> tuple[str, ...]:
    """Return the figure's scenes; the quick size has one."""
    return SCENES if full else SCENES[:1]


def _options(row: rt.Method, scene: str, full: bool) -> list[dict[str, Any]]:
    """Return the settings: precisions, triangle tests, and values of options that may lose hits.

    Options vary only in full precision. On the bunny, methods in SLOW have their defaults only.
    At the quick size, methods outside DETAIL vary only the precision.
    """
    table = option_table(row.name)
    found: list[dict[str, Any]] = [{}]
    if row.name in SLOW and scene == SCENES[0]:
        return found
    brief = not full and row.name not in DETAIL
    found += [{"precision": word} for word in precisions(row.name)
              if word != "fp32" and (not brief or word == "fp16" and not row.packet)]
    if brief:
        return found
    for name, option in table.items():
        values = option.choices if name == "intersection" else option.relaxed
        found += [{name: value} for value in values or () if value != option.default]
    return found


def cells_of(scene: str, full: bool) -> list[Cell]:
    """Return the cells of a scene.

    Methods that take minutes are left out: ``brute-force``, which finds the same hits as the grid;
    and on the bunny, methods without the schedule `loop`.
    """
    found = []
    for row in rt.methods():
        if row.name == "brute-force" or (scene == SCENES[0] and "loop" not in row.schedules):
            continue
        slow = row.name in SLOW or "loop" not in row.schedules
        size = (192 if full else 64) // (2 if slow else 1)
        runs = 1 if slow and not full else 3
        found += [Cell(scene, row.name, tuple(options.items()), size, "accuracy", runs)
                  for options in _options(row, scene, full)]
    return found


def cells(full: bool) -> list[Cell]:
    return [cell for scene in scenes(full) for cell in cells_of(scene, full)]


def pareto(points: Sequence[tuple[float, float]]) -> list[int]:
    """Return the indices of (rate, error) points that no other point beats in both numbers.

    The indices are in order of the rate, the fastest first.
    """
    order = sorted(range(len(points)), key=lambda i: (-points[i][0], points[i][1]))
    kept: list[int] = []
    for i in order:
        if not kept or points[i][1] < points[kept[-1]][1]:
            kept.append(i)
    return kept


def draw(data: Path, out: Path, full: bool) -> None:
    rows, renderer, stand_ins, on_front = [], "?", [], []
    fronts: dict[str, list[dict[str, Any]]] = {}
    for scene in scenes(full):
        results = [result for _, result in finished(cells_of(scene, full), data)]
        if not results:
            continue
        renderer = results[0]["gpu"]["renderer"]
        if results[0]["scene"]["stand_in"]:
            stand_ins.append(f"{scene} is a procedural stand-in for "
                             f"{results[0]['scene']['stand_in']}.")
        mine = [_row(scene, r["accuracy"]) for r in results]
        rows += mine
        front = pareto([(row["rays_per_second"], row["upper_95"]) for row in mine])
        fronts[scene] = [mine[i] for i in front]
        on_front += [f"{scene}: " + ", ".join(_label(mine[i]) for i in front)]
    heads = list(rows[0]) if rows else []
    write_csv(out / "tradeoff.csv", heads, [list(row.values()) for row in rows])
    write_text(out / "tradeoff.md", _page(rows, renderer, stand_ins, on_front, full))
    if rows:
        _chart(rows, fronts, out / "tradeoff.png",
               f"Renderer: {renderer}. " + " ".join(stand_ins))


def _row(scene: str, found: dict[str, Any]) -> dict[str, Any]:
    score, image = found["all"], found["image"] or {}
    options = {name: value for name, value in found["options"].items()
               if name not in ("precision", "step_cap")}
    return {"scene": scene, "method": found["method"], "precision": found["precision"],
            "options": " ".join(f"{k}={v}" for k, v in options.items()), "rays": score["rays"],
            **{name.replace(" ", "_"): score["counts"][name] for name in WRONG},
            "wrong_share": score["wrong_share"], "upper_95": score["upper_95"],
            "drawn_wrong": score["wrong_share"] or score["upper_95"],
            "t_error_999": (score["t_error"] or {}).get("99.9 %"),
            "t_ulps_999": (score["t_ulps"] or {}).get("99.9 %"), "rmse": image.get("rmse"),
            "flip": image.get("flip"), "rays_per_second": score["rays_per_second"],
            "texture_bytes": found["texture_bytes"]}


def _label(row: dict[str, Any]) -> str:
    return " ".join(filter(None, (row["method"], row["precision"], row["options"])))


def _chart(rows: list[dict[str, Any]], fronts: dict[str, list[dict[str, Any]]], path: Path,
           footnote: str) -> None:
    figure, axes = plt.subplots(2, len(fronts), squeeze=False,
                                figsize=(2.5 + 7.5 * len(fronts), 12))
    named = []
    for column, (scene, front) in zip(axes.T, fronts.items()):
        mine = [row for row in rows if row["scene"] == scene]
        named += [(column[0], _plot(column[0], mine, "drawn_wrong", 100.0, front)),
                  (column[1], _plot(column[1], [row for row in mine if row["t_error_999"]
                                                is not None], "t_error_999", 1e6, []))]
        column[0].set_title(scene, fontsize=10)
        column[1].set_xlabel("million rays a second (log)")
    axes[0][0].set_ylabel("rays with a wrong hit or miss, % (log)")
    axes[1][0].set_ylabel("relative error of t, 99.9 % quantile, parts per million (log)")
    handles = [plt.Line2D([], [], marker=marker, linestyle="", color=colour, label=word)
               for word, (colour, marker) in LOOKS.items()]
    handles += [plt.Line2D([], [], marker="o", linestyle="", color="#555555", fillstyle="none",
                           label="none wrong: 95 % bound"),
                plt.Line2D([], [], color="#bbbbbb", label="no setting beats these in both")]
    figure.legend(handles=handles, frameon=False, fontsize=9, ncols=5, loc="upper left")
    figure.tight_layout(rect=(0, 0.03, 1, 0.96))
    for axis, points in named:
        direct_labels(axis, points, size=6.5, avoid=[point[:2] for point in points])
    save_chart(figure, path, footnote, "Marks show the wrong rays and the error of t of each "
               "setting, against its rate. The name of the method stands beside a mark")


def _plot(axis: Any, rows: list[dict[str, Any]], key: str, unit: float,
          front: list[dict[str, Any]]) -> list[tuple[float, float, str]]:
    """Draw an error against the rate. Return marks and labels, with the front's marks first.

    ``front`` are the rows that no other row beats in both rate and error. A label is the method's
    name and the options that are not the default. The colour of a mark shows the precision.
    """
    def place(row: dict[str, Any]) -> tuple[float, float]:
        return row["rays_per_second"] / 1e6, unit * max(row[key], 1e-9)

    for row in rows:
        colour, marker = LOOKS.get(row["precision"], (GREY, "X"))
        none_wrong = key == "drawn_wrong" and not row["wrong_share"]
        axis.plot(*place(row), marker, color=colour, markersize=5,
                  fillstyle="none" if none_wrong else "full")
    steps = sorted(map(place, front))
    axis.plot([x for x, _ in steps], [y for _, y in steps], "-", color="#bbbbbb", zorder=0)
    log_axis(axis, "x")
    log_axis(axis, "y")
    axis.margins(0.12)
    axis.spines[["top", "right"]].set_visible(False)
    ordered = sorted(rows, key=lambda row: (row not in front, bool(row["options"]),
                                            -row["rays_per_second"]))
    return [(*place(row), " ".join([row["method"], *(word.split("=")[-1] for word in
                                                     row["options"].split())]))
            for row in ordered]


def _page(rows: list[dict[str, Any]], renderer: str, stand_ins: list[str],
          on_front: list[str], full: bool) -> str:
    heads = ("scene", "method", "precision", "options", "rays", *WRONG, "wrong share",
             "upper 95 % bound of the share", "t error, 99.9 % quantile", "RMSE", "FLIP",
             "Mrays/s", "MB")
    table = [[row["scene"], row["method"], row["precision"], row["options"] or "-",
              f"{row['rays']:,}", *(row[name.replace(" ", "_")] for name in WRONG),
              number(row["wrong_share"], 2), number(row["upper_95"], 2),
              number(row["t_error_999"], 2), number(row["rmse"], 2), number(row["flip"], 2),
              number(row["rays_per_second"] / 1e6), number(row["texture_bytes"] / 1e6)]
             for row in rows]
    picture = picture_size(next(iter(cells(full))).size)
    parts = ["# Speed against accuracy\n", f"Renderer: {renderer}. Eye, random, vertex-aimed and "
             "edge-aimed rays are traced in equal shares, and compared with the float64 "
             f"reference. RMSE and FLIP compare a picture of {picture} pixels a side (fewer for "
             "slow methods) with the reference's picture. The error of t is relative, and MB is "
             "the size of all textures. In the chart, a hollow mark is a setting without a "
             "wrong ray. Its height is the upper 95 % confidence bound of the wrong share. Rays "
             "that a step cap stopped count as unfinished."
             + ("" if full else " FULL=1 also measures fp24 and the options of every method. For "
                + ", ".join(SLOW) + " and packets it also measures low precision; this takes "
                "minutes."),
             *stand_ins, "", markdown_table(heads, table),
             "No other setting beats these settings in both the rate and the bound of the wrong "
             "share:\n",
             "\n".join(f"* {line}" for line in on_front), ""]
    return "\n".join(parts)
