"""Sweep: measures cells (cell.py) with workers, on one machine or several.

Untimed cells run first, several at a time, and build structures that timed cells also need. A
timed cell has its machine to itself.
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
    """Yield each cell with its result, as results arrive.

    Raises
    ------
    Error
        if a worker has another renderer, version or mesh than this process: then the worker's
        numbers are not comparable
    """
    ordered = by_scene(cells)
    here = workers.scheduler == LOCAL    # local processes find the same meshes as this process
    meshes = {scene: workers.sent({} if here else mesh_files(scene))
              for scene in {cell.scene for cell in ordered}}
    # Get the settings before anything is timed, because getting them loads the scenes.
    asked = {cell: as_kept(settings(cell)) for cell in ordered}
    for timed in (False, True):
        some = _dealt([cell for cell in ordered if work_of(cell).timed is timed])
        parts = [(cell, meshes[cell.scene], measured) for cell in some]
        for at, result in workers.map(_measured, parts):
            _check(some[at], asked[some[at]], result)
            yield some[at], result


def by_scene(cells: list[Cell]) -> list[Cell]:
    """Return the cells sorted by scene and size, so that a process builds trees and rays once."""
    return sorted(cells, key=lambda cell: (cell.scene, cell.size))


def _dealt(cells: list[Cell]) -> list[Cell]:
    """Alternate between the first and the second half of the cells.

    Adjacent cells run at the same time. In the given order, adjacent cells often need the same
    tree, and two processes would both build this tree.
    """
    half = -(-len(cells) // 2)
    pairs = itertools.zip_longest(cells[:half], cells[half:])
    return [cell for pair in pairs for cell in pair if cell is not None]


def _check(cell: Cell, asked: dict[str, Any], result: Result) -> None:
    """Raise an error unless the worker measured with the settings of this process."""
    found = as_kept(result["settings"])
    others = sorted(name for name in asked if asked[name] != found.get(name))
    if others:
        raise Error(f"a worker measured {cell.scene} with another {', '.join(others)}: "
                    f"{found.get(others[0])!r}, not {asked[others[0]]!r}; a figure must not mix "
                    "different settings, so run the figures on a machine like the workers'")


def _measured(cell: Cell, files: Files, measured: Callable[[Cell], Result]) -> Result:
    """Measure a cell in a worker, while no other process on this machine measures a time."""
    take_mesh(cell.scene, files)
    with taken():
        return measured(cell)
