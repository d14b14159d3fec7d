"""Frames: measures frame times of moving scenes whose structures are refitted or rebuilt."""
from __future__ import annotations

import statistics
from pathlib import Path
from typing import Any

import gpgpu_rt as rt
from gpgpu_rt.charts import COLOURS
from gpgpu_rt.scene import catalogue

from ..framework.cell import Cell
from ..framework.output import markdown_table, number, plt, save_chart, write_csv, write_text
from ..framework.results import read
from .frame_times import AHEAD

SCENES = {"cloth": "a cloth waves", "walker": "an animal walks", "explosion": "a mesh flies apart",
          "robots-moving": "ten robots walk through a city",
          "kitchen-moving": "a toy car drives through a kitchen", "bunny": "nothing moves"}
# Builds that are fast enough for frames, and their devices. Other builds on the GPU need seconds
# per frame on a software renderer.
BUILDS = {"sah": ("cpu",), "lbvh": ("cpu", "gpu"), "hybrid": ("cpu",)}
REBUILT = ("bih", "kd-short-stack", "kd-stack")    # cannot refit: rebuilt each frame
BUDGE = "kd-stack"    # Budge et al. 2008: stack traversal while the CPU builds the next tree
IN_TURN, OVERLAPPED = f"{BUDGE} rebuilt", f"{BUDGE} rebuilt, a frame ahead"
# Scenes that are measured at full size only.
FULL_ONLY = ("explosion", "robots-moving", "kitchen-moving", "bunny")
FRAMES, FULL_FRAMES = 3, 12


def columns() -> list[tuple[str, str, tuple[tuple[str, Any], ...]]]:
    """Label, method and options of each column. Every method that can refit has a column."""
    found = []
    for row in rt.methods():
        own = {option.name: option for option in row.options}
        best = (("octants", True),) if "octants" in own else ()
        if row.refit is not None:
            found.append((f"{row.name} refitted", row.name, best))
        if row.name == "bvh-threaded":
            for build, device in ((b, d) for b, devices in BUILDS.items() for d in devices):
                found.append((f"{row.name} rebuilt, {build} ({device})", row.name, (
                    *best, ("build", build), ("build_device", device), ("rebuild_ratio", 0.0))))
        if row.name in REBUILT:
            found.append((f"{row.name} rebuilt", row.name, ()))
        if row.name == BUDGE:
            found.append((OVERLAPPED, row.name, (AHEAD,)))
    return sorted(found, key=lambda column: "rebuilt" in column[0])   # refitting methods first


def cell(scene: str, method: str, options: tuple[tuple[str, Any], ...], full: bool) -> Cell:
    return Cell(scene, method, options, 512 if full else 256, "frames",
                FULL_FRAMES if full else FRAMES)


def cells(full: bool) -> list[Cell]:
    return [cell(scene, method, options, full) for scene in SCENES
            if (full or scene not in FULL_ONLY) and is_there(scene)
            for _, method, options in columns()]


def is_there(scene: str) -> bool:
    """Whether the scene is built in or its file is found."""
    return catalogue.ROWS[scene].file is None or catalogue.mesh_path(scene) is not None


def draw(data: Path, out: Path, full: bool) -> None:
    rows, notes = [], []
    for scene in filter(is_there, SCENES):
        for label, method, options in columns():
            result = read(cell(scene, method, options, full), data)
            if result is not None:
                rows.append(_row(scene, label, result))
                about = result["scene"]
                notes.append(f"Renderer: {result['gpu']['renderer']}, {result['settings']['size']}"
                             f"x{result['settings']['size']} eye rays.")
                if about["stand_in"]:
                    notes.append(f"{scene} is a procedural stand-in for {about['stand_in']}.")
    write_csv(out / "frames.csv", list(rows[0]) if rows else [],
              [list(row.values()) for row in rows])
    write_text(out / "frames.md", _markdown(rows, list(dict.fromkeys(notes))))
    if rows:
        _chart(rows, out)


def _row(scene: str, label: str, result: dict[str, Any]) -> dict[str, Any]:
    times = result["frames"]
    whole = sum(times["update"]) + sum(times["trace"])
    return {"scene": scene, "triangles": result["scene"]["triangles"], "method": label,
            "frames": len(times["update"]), "rebuilt": times["rebuilt"],
            "update_ms": 1e3 * statistics.median(times["update"]),
            "trace_ms": 1e3 * statistics.median(times["trace"]),
            "frames_a_second": len(times["update"]) / whole, "differing": times["differing"]}


def _markdown(rows: list[dict[str, Any]], notes: list[str]) -> str:
    parts = ["# Time per frame of moving scenes\n"]
    for scene, what in SCENES.items():
        some = [row for row in rows if row["scene"] == scene]
        if not some:
            continue
        parts.append(f"## {scene}, {some[0]['triangles']:,} triangles: {what}\n")
        parts.append(markdown_table(
            ("method", "update, ms", "trace, ms", "frames a second", "rebuilt", "wrong distances"),
            [[row["method"], number(row["update_ms"]), number(row["trace_ms"]),
              number(row["frames_a_second"]), f"{row['rebuilt']} of {row['frames']}",
              row["differing"]] for row in some]))
    absent = [scene for scene in SCENES if all(row["scene"] != scene for row in rows)]
    left = [f"{scene} ({SCENES[scene]})" for scene in absent if is_there(scene)]
    notes = [*notes, "An update is the time from new vertices to finished tables in textures. It "
             "includes the refit or the build of the structure, on the CPU unless the "
             "name of a build says gpu. (ray-tiles and ray-hierarchy have no structure "
             "over triangles and only write the triangles.) Update and trace are medians over "
             "frames. Frames a second count all frames, including frames that rebuilt a "
             "refitted tree.",
             "A frame ahead: as in Budge et al. 2008, another process builds the next frame's "
             "kd-tree while this frame is traced. An update then waits for the build and writes "
             "the tables.",
             *_overlap(rows),
             *([f"Measured with FULL=1 only: {', '.join(left)}."] if left else []),
             *(f"Not measured: {catalogue.how_to_get(catalogue.ROWS[scene])}."
               for scene in absent if not is_there(scene)),
             "Wrong distances: the number of rays, over all frames, whose t is not exactly the t "
             "found with a tree built for the frame."]
    return "\n".join([*parts, *(f"* {note}" for note in notes), ""])


def _overlap(rows: list[dict[str, Any]]) -> list[str]:
    """A sentence for each scene: what the overlap of build and trace gains."""
    lines = []
    for scene in SCENES:
        both = {row["method"]: row for row in rows if row["scene"] == scene}
        if IN_TURN in both and OVERLAPPED in both:
            turn, ahead = both[IN_TURN], both[OVERLAPPED]
            parts = turn["update_ms"], turn["trace_ms"]
            lines.append(
                f"{scene}, {BUDGE}: {number(ahead['frames_a_second'])} frames a second with the "
                f"overlap and {number(turn['frames_a_second'])} without overlap, "
                f"{number(ahead['frames_a_second'] / turn['frames_a_second'])} times as many. "
                "If the overlap hid the shorter of update and trace completely, it would give "
                f"{number(sum(parts) / max(parts))} times as many. On a software renderer the "
                "build and the trace share the cores.")
    return lines


def _chart(rows: list[dict[str, Any]], out: Path) -> None:
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    lines = -(-len(scenes) // 2)
    figure, axes = plt.subplots(lines, 2, squeeze=False, figsize=(10, 0.5 + 4 * lines))
    for axis in axes.flat[len(scenes):]:
        axis.remove()
    for axis, scene in zip(axes.flat, scenes):
        some = [row for row in rows if row["scene"] == scene][::-1]
        for at, row in enumerate(some):
            axis.barh(at, row["update_ms"], color=COLOURS[4], label=None if at else "update")
            axis.barh(at, row["trace_ms"], left=row["update_ms"], color=COLOURS[0],
                      label=None if at else "eye rays")
            axis.annotate(f" {number(row['frames_a_second'])} /s",
                          (row["update_ms"] + row["trace_ms"], at), va="center", fontsize=8)
        axis.set_yticks(range(len(some)), [row["method"] for row in some], fontsize=8)
        axis.set(title=f"{scene}: {SCENES[scene]}", xlabel="milliseconds a frame")
        axis.margins(x=0.2)
        axis.spines[["top", "right"]].set_visible(False)
    figure.legend(*axes[0, 0].get_legend_handles_labels(), frameon=False, fontsize=8, ncols=2,
                  loc="upper left")
    figure.tight_layout(rect=(0, 0.03, 1, 0.97))
    save_chart(figure, out / "frames.png",
               "Times are medians over frames; frames a second count all frames.",
               "Bars show the milliseconds of a frame by method, divided into the update of "
               "the structure and the tracing of eye rays")
