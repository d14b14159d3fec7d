"""Measuring: runs cells and keeps each as a JSON file; figures only read those.

A cell that was finished with the same settings on the same renderer is not measured again.
"""
from __future__ import annotations

import datetime
import functools
import json
import multiprocessing
import signal
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from tqdm import tqdm

from gpgpu_rt.bench.engines import CORES
from gpgpu_rt.bench.workloads import load
from gpgpu_rt.files import replacing
from gpgpu_rt.gpu import open_gpu

from .cell import Cell
from .results import commit, finished, read, settings
from .works import work_of


def measure(cells: Iterable[Cell], data: Path, again: bool = False) -> None:
    """Measure every cell that is not finished, in order, each written when it is done."""
    data.mkdir(parents=True, exist_ok=True)
    todo = [cell for cell in dict.fromkeys(cells) if again or read(cell, data) is None]
    counts = [cell for cell in todo if not work_of(cell).timed]
    with tqdm(total=len(todo), unit="cell", dynamic_ncols=True) as progress:
        for cell in todo:
            if cell in counts and len(counts) > 1:
                continue
            progress.set_description(_words(cell))
            _keep(cell, data)
            progress.update()
        if len(counts) > 1:
            _keep_side_by_side(counts, data, progress)


def _keep_side_by_side(cells: list[Cell], data: Path, progress: Any) -> None:
    """Measure cells in which nothing is timed, one a processor at once, each in a process of its
    own context; interrupting loses those that run."""
    progress.set_description("counting what cards would do")
    # Those of a scene one after another, so that a process makes its tree and its rays once.
    ordered = sorted(cells, key=lambda cell: (cell.scene, cell.size))
    with multiprocessing.get_context("spawn").Pool(
            min(CORES, len(cells)), _ignore_interrupts) as pool:
        for _ in pool.imap_unordered(functools.partial(_keep, data=data), ordered):
            progress.update()


def _ignore_interrupts() -> None:
    """The process that started this one ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _keep(cell: Cell, data: Path) -> None:
    """Measure a cell and write its file, with the seconds that all of it took."""
    began = time.perf_counter()
    result = run(cell)
    result["seconds_spent"] = time.perf_counter() - began
    with replacing(data / cell.name) as path:
        path.write_text(json.dumps(result, indent=1, default=str))


def _words(cell: Cell) -> str:
    return " ".join((cell.scene, cell.method, *(f"{k}={v}" for k, v in cell.options)))


def spent(cells: Iterable[Cell], data: Path) -> float:
    """Seconds that measuring the finished ones of these cells took, all together."""
    return sum(result.get("seconds_spent", 0.0) for _, result in finished(cells, data))


def run(cell: Cell) -> dict[str, Any]:
    """Measure one cell: of what, on what, when, and what was found."""
    work = work_of(cell)
    found = work.measure(cell, cell.work.removeprefix(work.name))
    heading = {"settings": settings(cell), "gpu": open_gpu().info(), "commit": commit(),
               "date": datetime.date.today().isoformat()}
    if work.catalogued:
        scene = load(cell.scene)
        heading["scene"] = {"name": scene.name, "triangles": len(scene),
                            "stand_in": scene.stand_in, "file": Path(scene.source).name,
                            "camera": scene.camera.to_dict()}
    return {**heading, **found}
