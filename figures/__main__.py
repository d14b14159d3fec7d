"""``python -m gpgpu_rt.figures``: measure what is missing, then draw every figure."""
from __future__ import annotations

import argparse
import contextlib
import sys
from importlib import import_module
from pathlib import Path
from typing import Any

from gpgpu_rt.errors import Error
from gpgpu_rt.files import check_writable
from gpgpu_rt.workers import Workers

NEEDED = ("distributed", "flip_evaluator", "matplotlib", "tqdm")     # what the extra brings
try:
    for name in NEEDED:
        import_module(name)
    from . import provenance, verdicts
    from .contradictions import of_page
    from .index_page import Line, write_index
    from .measure import measure, spent
    from .output import number, write_text
except ModuleNotFoundError as missing:
    if missing.name not in NEEDED:
        raise
    sys.exit(f"figures: {missing.name} is not installed; pip install 'gpgpu_rt[figures]'")

# A module of this folder -> its title.
FIGURES = {
    "fig01": "Figure 1: reflections, soft shadows, refraction",
    "fig02": "Figure 2: the shader pipeline, as a pass of this program goes through it",
    "fig03": "Figure 3: a pass as stream processing",
    "fig04": "Figure 4: the organisation of the Ray Engine",
    "fig05": "Figure 5: a picture by the Ray Engine, and where the time goes",
    "fig06": "Figure 6: ray tracing in a grid as streams and kernels",
    "fig07": "Figure 7: a picture by the grid with proximity clouds",
    "fig08": "Figure 8: a teapot in a stadium",
    "fig09": "Figure 9: a kd-tree, and its nodes",
    "fig10": "Figure 10: the traversal of a kd-tree, step by step",
    "fig11": "Figure 11: kd-restart against kd-backtrack",
    "fig12": "Figure 12: eye rays by brute force, grid and kd-trees",
    "fig13": "Figure 13: restart, packets, push-down, short stack",
    "fig14": "Figure 14: mirrors upon mirrors, with and without packets",
    "fig15": "Figure 15: a kd-tree with ropes",
    "fig16": "Figure 16: ropes for single rays and packets",
    "fig17": "Figure 17: what ropes add to a kd-tree's size",
    "fig18": "Figure 18: a bounding volume hierarchy of boxes",
    "fig19": "Figure 19: the same hierarchy, threaded",
    "fig20": "Figure 20: whole images by grid, kd-trees and threaded BVHs",
    "fig21": "Figure 21: a geometry image, and the pyramids over it",
    "fig22": "Figure 22: packets over a BVH and along ropes, to very large scenes",
    "fig23": "Figure 23: the hierarchical ray engine, tiles of rays against triangles",
    "fig24": "Figure 24: the hierarchy of cones over rays",
    "fig25": "Figure 25: the traversal of a ray hierarchy",
    "fig26": "Figure 26: every method at 10,000 triangles, relative to the Ray Engine",
    "table1": "Table 1: what the methods are, and do",
    "cpu": "Ray tracing on the CPU: rays a second, and a GFLOP (section 4.2)",
    "entry_points": "Entry points and rasterised bounds",
    "period": "Period hardware: predicted against published",
    "retention": "Data retention: bytes that no pass keeps for the next",
    "simd_width": "Wide SIMD: what rays that branch alike make each other wait",
    "stacks": "Stack against stackless: rays in flight that fit",
    "ideal_hardware": "Hardware for rays: triangle and traversal units, explicit transfers",
    "ray_sorting": "Ray sorting: its price, what it buys, and how alike rays are",
    "rasterised": "First hits from the rasteriser: what their proof costs",
    "refraction": "Refraction by two passes of the rasteriser, beside the truth",
    "caustics": "Caustics mapping, beside traced photons",
    "ray_bundles": "Ray bundles by peeled projections, beside traced ones and the path tracer",
    "frames": "Time a frame of moving scenes: refitted, rebuilt, and kd-trees",
    "needs": "What a scene needs: renderers derived from ten scenes, beside one for all",
    "path_noise": "Path tracing: what is off after how many samples, Sobol' and random",
    "reduction": "Stream reduction by blocks, beside a scan",
    "ray_space": "Tables over rays: ray classification and the visibility field",
    "schedules": "The three schedules: what being literal costs",
    "extremes": "The extremes: what is wrong where, and how each method ends",
    "tradeoff": "Speed against accuracy: precision, intersection tests, intervals",
}


def main(arguments: list[str] | None = None) -> int:
    """Exit status: 0, 1 for a user's mistake (one line on stderr), 130 when interrupted."""
    parser = argparse.ArgumentParser(prog="python -m gpgpu_rt.figures", description=__doc__)
    parser.add_argument("--full", action="store_true", help="the papers' resolutions")
    parser.add_argument("--only", nargs="+", choices=FIGURES, default=list(FIGURES))
    parser.add_argument("--again", action="store_true", help="measure finished cells again")
    parser.add_argument("--scheduler", metavar="local|ADDRESS", help="measure by a process a "
                        "core, or by the workers of a Dask scheduler; what is timed has its "
                        "machine to itself")
    parser.add_argument("--data", type=Path, default=Path("figures/data"))
    parser.add_argument("--out", type=Path, default=Path("figures/out"))
    chosen = parser.parse_args(arguments)
    try:
        for folder in (chosen.data, chosen.out):
            _make(folder)
        figures = [_figure(name) for name in chosen.only]
        with contextlib.nullcontext() if chosen.scheduler is None else Workers(
                chosen.scheduler) as workers:
            measure([cell for figure in figures for cell in figure.cells(chosen.full)],
                    chosen.data, chosen.again, workers)
        for name, figure in zip(chosen.only, figures):
            figure.draw(chosen.data, chosen.out, chosen.full)
            _add_notes(name, chosen.out)
        _index(chosen.data, chosen.out, chosen.full)
    except KeyboardInterrupt:
        print("figures: interrupted; finished cells are kept, run again to go on", file=sys.stderr)
        return 130
    except Error as failure:
        print(f"figures: {' '.join(str(failure).split())}", file=sys.stderr)
        return 1
    print(f"wrote {chosen.out / 'index.md'}")
    return 0


def _add_notes(name: str, out: Path) -> None:
    """Put on a page where the survey contradicts itself about it."""
    page, notes = out / f"{name}.md", of_page(name)
    if notes and page.exists():
        lines = "\n".join(f"* {says}" for says in notes)
        write_text(page, page.read_text().rstrip() + "\n\n## Where the survey contradicts itself "
                   f"or its sources\n\n{lines}\n")


def _index(data: Path, out: Path, full: bool) -> None:
    """Record where each page's numbers come from, and write the index of all that there are."""
    lines, cells = [], []
    for name, title in FIGURES.items():
        if not (out / f"{name}.md").exists():
            continue
        figure = _figure(name)
        mine = figure.cells(full)
        cells += mine
        held = provenance.record(name, mine, data, out, full)
        judged = None
        if _of_survey(name):
            judged = figure.judge(data, full) if hasattr(figure, "judge") else verdicts.DIAGRAM
        lines.append(Line(name, title, judged, provenance.summary(held)))
    seconds = spent(cells, data)
    write_index(out, lines, sum(map(_of_survey, FIGURES)), [
        f"Size: {'the papers' if full else 'quick'}. Measuring all cells took "
        f"{number(seconds / 60)} minutes of machine time."
        + ("" if full else " The quick size traces fewer rays than the papers did, fewest with "
           "the methods that take longest (brute force, those of many passes, tables over rays): "
           "compare times a ray. `FULL=1` takes the papers' sizes and goes on where it was "
           "interrupted.")])


def _of_survey(name: str) -> bool:
    """Whether it is one of the survey's own figures and tables."""
    return name.startswith(("fig", "table"))


def _figure(name: str) -> Any:
    """What has ``cells(full)`` to measure and ``draw(data, out, full)``."""
    module = import_module(f"{__package__}.{name}")
    return getattr(module, "FIGURE", module)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise Error(f"cannot make the folder {folder}: {failure.strerror}; choose another with "
                    "--data or --out") from failure
    check_writable(folder / "index.md")


if __name__ == "__main__":
    sys.exit(main())
