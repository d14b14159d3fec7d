"""Measuring: runs cells and keeps each as a JSON file; figures only read those.

A cell that was finished with the same settings on the same renderer is not measured again.
"""
from __future__ import annotations

import datetime
import json
import os
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from tqdm import tqdm

from gpgpu_rt.bench.workloads import load
from gpgpu_rt.files import replacing
from gpgpu_rt.gpu import open_gpu
from gpgpu_rt.workers import Workers
from gpgpu_rt.workers.machine import taken

from . import sweep
from .cell import Cell
from .results import commit, finished, read, settings
from .works import work_of

WORTH_WORKERS = 8     # cells: for fewer, starting processes takes longer than it saves


def measure(cells: Iterable[Cell], data: Path, again: bool = False,
            workers: Workers | None = None) -> None:
    """Measure every cell that is not finished, each written when it is done: interrupting loses
    those that run. By ``workers``; or without, what is timed in this process, and before it the
    rest by a process a core, where there is enough of it."""
    data.mkdir(parents=True, exist_ok=True)
    todo = [cell for cell in dict.fromkeys(cells) if again or read(cell, data) is None]
    with tqdm(total=len(todo), unit="cell", dynamic_ncols=True) as progress:
        for cell, result in _results(todo, workers, progress):
            progress.set_description(_words(cell))
            _write(cell, result, data)
            progress.update()


def _results(todo: list[Cell], workers: Workers | None,
             progress: tqdm) -> Iterator[tuple[Cell, dict[str, Any]]]:
    here = todo if workers is None else []
    aside = [cell for cell in here if not work_of(cell).timed]
    cores = os.cpu_count() or 1
    if workers is not None and todo:
        yield from sweep.results(todo, workers, measured)
    elif len(aside) >= WORTH_WORKERS and cores > 1:
        here = [cell for cell in here if work_of(cell).timed]
        with Workers(count=min(cores, len(aside))) as them:
            yield from sweep.results(aside, them, measured)
    for cell in here:
        progress.set_description(_words(cell))
        with taken():
            result = measured(cell)
        yield cell, result


def measured(cell: Cell) -> dict[str, Any]:
    """What `run` finds, and the seconds that all of it took."""
    began = time.perf_counter()
    result = run(cell)
    result["seconds_spent"] = time.perf_counter() - began
    return result


def _write(cell: Cell, result: dict[str, Any], data: Path) -> None:
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
