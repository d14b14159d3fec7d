"""Measuring: measures cells (cell.py) and writes each result to a JSON file, which figures read.

A finished cell with the same settings and renderer is not measured again.
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
from gpgpu_rt.disk.files import replacing
from gpgpu_rt.gl.context import is_software, open_gpu
from gpgpu_rt.gl.environment import commit
from gpgpu_rt.threads import cores
from gpgpu_rt.workers import Workers
from gpgpu_rt.workers.machine import helped, taken

from . import sweep
from .aside import Aside, Result, worth_workers
from .cell import Cell
from .results import read, settings
from .works import work_of


def measure(cells: Iterable[Cell], data: Path, again: bool = False,
            workers: Workers | None = None) -> None:
    """Measure every unfinished cell.

    An interrupt loses only the cells in progress. If ``workers`` are given, they measure all
    cells. Otherwise this process measures the timed cells, and a worker process on each of the
    remaining cores measures untimed cells. While this process times nothing, it also measures
    untimed cells. If there are few untimed cells, this process measures all cells.
    """
    data.mkdir(parents=True, exist_ok=True)
    todo = [cell for cell in dict.fromkeys(cells) if again or read(cell, data) is None]
    with tqdm(total=len(todo), unit="measurement", dynamic_ncols=True,
              disable=not todo) as progress:
        for cell, result in _results(todo, workers, progress):
            progress.set_description(_words(cell))
            _write(cell, result, data)
            progress.update()


def _results(todo: list[Cell], workers: Workers | None,
             progress: tqdm) -> Iterator[tuple[Cell, Result]]:
    rest = [cell for cell in todo if not work_of(cell).timed]
    if workers is not None:
        if todo:
            yield from sweep.results(todo, workers, measured)
    elif not worth_workers(len(rest)):
        with taken(lambda: _say_waiting(progress)):
            yield from _here(todo, progress)
    else:
        os.environ.setdefault("MESA_DISK_CACHE_MULTI_FILE", "1")     # see `helped` for the reason
        timed = [cell for cell in todo if work_of(cell).timed]
        with Workers(count=min(cores() - 1, len(rest))) as them, helped(
                them.processes), taken(lambda: _say_waiting(progress)):
            yield from _beside(Aside(sweep.by_scene(rest), them, measured), timed, progress)


def _beside(aside: Aside, timed: list[Cell],
            progress: tqdm) -> Iterator[tuple[Cell, Result]]:
    """Yield the results of ``timed`` and of ``aside``.

    On a software renderer, this process measures the timed cells, then cells of ``aside``. On a
    card, it measures the timed cells last.
    """
    others = iter(aside.take, None)
    order = (timed, others) if is_software(open_gpu().renderer) else (others, timed)
    for cells in order:
        for found in _here(cells, progress):
            yield found
            yield from aside.done()
        if cells is others:
            yield from aside.done(wait=True)


def _say_waiting(progress: tqdm) -> None:
    progress.set_description("waiting: another process times something on this machine")


def _here(cells: Iterable[Cell], progress: tqdm) -> Iterator[tuple[Cell, Result]]:
    for cell in cells:
        progress.set_description(_words(cell))
        yield cell, measured(cell)


def measured(cell: Cell) -> Result:
    """Return the result of `run`, with the processor seconds that this process spent."""
    began = time.process_time()
    result = run(cell)
    result["processor_seconds"] = time.process_time() - began
    return result


def _write(cell: Cell, result: dict[str, Any], data: Path) -> None:
    with replacing(data / cell.name) as path:
        path.write_text(json.dumps(result, indent=1, default=str))


def _words(cell: Cell) -> str:
    return " ".join((cell.scene, cell.method, *(f"{k}={v}" for k, v in cell.options)))


def run(cell: Cell) -> dict[str, Any]:
    """Measure a cell.

    The result also holds the settings, the renderer, the commit, the date and the scene.
    """
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
