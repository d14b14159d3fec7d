"""Sweep: cells measured by workers, of one machine or of several.

Cells run side by side, those first of which nothing is timed: they build what the others trace.
What is timed has its machine to itself meanwhile. Results come as they are there.
"""
from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any

from gpgpu_rt.errors import Error
from gpgpu_rt.workers import LOCAL, Workers
from gpgpu_rt.workers.machine import taken
from gpgpu_rt.workers.meshes import Files, mesh_files, take_mesh

from .aside import Result
from .cell import Cell
from .results import as_kept, settings
from .works import work_of


def results(cells: list[Cell], workers: Workers,
            measured: Callable[[Cell], Result]) -> Iterator[tuple[Cell, Result]]:
    """Each cell with what was measured, as it comes in.

    Raises
    ------
    Error
        where a worker has another renderer or version than this process, so that its numbers would
        stand for something else
    """
    ordered = by_scene(cells)
    here = workers.scheduler == LOCAL    # its processes find what this one finds
    meshes = {scene: workers.sent({} if here else mesh_files(scene))
              for scene in {cell.scene for cell in ordered}}
    # Before anything is timed: scenes are loaded for it.
    asked = {cell: as_kept(settings(cell)) for cell in ordered}
    for timed in (False, True):
        some = _dealt([cell for cell in ordered if work_of(cell).timed is timed])
        parts = [(cell, meshes[cell.scene], measured) for cell in some]
        for at, result in workers.map(_measured, parts):
            _check(some[at], asked[some[at]], result)
            yield some[at], result


def by_scene(cells: list[Cell]) -> list[Cell]:
    """Those of a scene one after another, so that a process makes its tree and its rays once."""
    return sorted(cells, key=lambda cell: (cell.scene, cell.size))


def _dealt(cells: list[Cell]) -> list[Cell]:
    """The first half and the second in turns, so that two neighbours in this order, which run at
    once, are not about to build the same tree."""
    half = -(-len(cells) // 2)
    pairs = itertools.zip_longest(cells[:half], cells[half:])
    return [cell for pair in pairs for cell in pair if cell is not None]


def _check(cell: Cell, asked: dict[str, Any], result: Result) -> None:
    """That a worker has what this process has."""
    found = as_kept(result["settings"])
    others = sorted(name for name in asked if asked[name] != found.get(name))
    if others:
        raise Error(f"a worker measured {cell.scene} with another {', '.join(others)}: "
                    f"{found.get(others[0])!r}, not {asked[others[0]]!r}; figures are of one, "
                    "so ask from a machine that has what the workers have")


def _measured(cell: Cell, files: Files, measured: Callable[[Cell], Result]) -> Result:
    """In a worker: measure a cell while nothing is timed on its machine."""
    take_mesh(cell.scene, files)
    with taken():
        return measured(cell)
