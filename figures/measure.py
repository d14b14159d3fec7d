"""Measuring: runs cells and keeps each as a JSON file; figures only read those.

A cell that was finished with the same settings on the same renderer is not measured again.
"""
from __future__ import annotations

import datetime
import json
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


def measure(cells: Iterable[Cell], data: Path, again: bool = False,
            workers: Workers | None = None) -> None:
    """Measure every cell that is not finished, each written when it is done: interrupting loses
    those that run. By ``workers``, or without in this process."""
    data.mkdir(parents=True, exist_ok=True)
    todo = unfinished(cells, data, again)
    with tqdm(total=len(todo), unit="cell", dynamic_ncols=True) as progress:
        found = _here(todo, progress) if workers is None or not todo else sweep.results(
            todo, workers, measured)
        for cell, result in found:
            progress.set_description(_words(cell))
            _write(cell, result, data)
            progress.update()


def unfinished(cells: Iterable[Cell], data: Path, again: bool = False) -> list[Cell]:
    """The cells that are to be measured, each once; all of them ``again``."""
    return [cell for cell in dict.fromkeys(cells) if again or read(cell, data) is None]


def _here(cells: list[Cell], progress: tqdm) -> Iterator[tuple[Cell, dict[str, Any]]]:
    for cell in cells:
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
