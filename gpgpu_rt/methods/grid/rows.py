"""grid and grid-proximity: uniform grids (Purcell et al. 2002; Karlsson and Ljungstedt 2004).

The method grid also traces packets (Wald et al. 2006)."""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ...accel.cache import cached
from ...gl.textures import TABLE_WIDTH
from ...options import TEXEL_POINTERS, Option
from ...traversal.accelerator import Accelerator
from ...traversal.method import CULLING, PACKET, Method
from ...traversal.packets import PacketTraversal
from ...traversal.records import STATE
from ...traversal.triangle_table import REFERENCE, TRIANGLE, triangle_table
from .cells import build_grid
from .proximity import proximity_cloud
from .records import GRID_CELL, GRID_STATE

SENTINEL = -1   # the entry that ends a cell's list


def _prepare(triangles: np.ndarray, options: Mapping[str, Any], proximity: bool) -> Accelerator:
    grid = cached(build_grid, triangles, resolution=options["resolution"],
                  density=options["density"])
    counts = np.diff(grid.cell_start)
    occupied = counts > 0
    # The sentinel adds an entry to the list of each occupied cell.
    first = grid.cell_start[:-1] + np.cumsum(occupied) - occupied
    references = np.insert(grid.references, grid.cell_start[1:][occupied], SENTINEL)
    empty = -proximity_cloud(grid) if proximity else np.full(len(counts), -1)
    cells, slice_step = _slices(np.where(occupied, first, empty), grid.resolution, options)
    tables = {**triangle_table(triangles), GRID_CELL.name: {"first": cells},
              REFERENCE.name: {"triangle": references}}
    uniforms = {"scene_lo": tuple(grid.lo), "scene_hi": tuple(grid.hi),
                "grid_resolution": tuple(int(r) for r in grid.resolution),
                "cell_size": tuple(grid.cell_size), "slice_step": slice_step}
    # A ray crosses each plane between cells at most once, and reads each list at most once.
    bound = int(grid.resolution.sum()) + len(references) + 3
    return Accelerator(tables, uniforms, bound, grid,
                       automatic={"resolution": tuple(int(r) for r in grid.resolution)},
                       pointers=("slice_step",), numbered=slice_step)


def _slices(first: np.ndarray, resolution: np.ndarray, options: Mapping[str, Any]
            ) -> tuple[np.ndarray, int]:
    """Return the field ``first`` of the cells' table, and the number of entries per z slice.

    In the era form with fp24, each slice begins in a new row of texels, because fp24 cannot hold
    the indices of all cells.
    """
    cells = int(resolution[0]) * int(resolution[1])
    if options["era"] not in TEXEL_POINTERS:
        return first, cells
    step = -(-cells // TABLE_WIDTH) * TABLE_WIDTH
    padded = np.full((int(resolution[2]), step), -1)
    padded[:, :cells] = first.reshape(-1, cells)
    return padded.reshape(-1), step


_GRID_OPTIONS = (
    Option("resolution", None, "cells per axis: a number or x,y,z; default: set by density",
           object, excludes=("density",), label="cells per axis"),
    Option("density", 5.0, "target number of cells per triangle, if no resolution is given", float,
           minimum=1e-6, label="cells per triangle"),
)


_PACKET = replace(PACKET, default=(1, 1), help="rays per fragment; several rays walk the grid "
                  "together, slice by slice (Wald et al. 2006)")
_CULLING = replace(CULLING, option="intersection", files={
    "woop-watertight": "drivers/vertex_culling.glsl"})    # culling is exact only for this test


def _prepare_packets(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    prepared = _prepare(triangles, options, False)
    # Each walk of a packet through the grid completes at least one ray, and visits each slice,
    # cell and list entry at most once.
    grid, (width, height) = prepared.structure, options["packet"]
    once = len(grid.cell_start) + len(prepared.tables[REFERENCE.name]["triangle"])
    prepared.step_bound = (once + int(grid.resolution.max()) + 2) * width * height
    return prepared


def _row(name: str, summary: str, citation: str, proximity: bool, **more: Any) -> Method:
    return Method(
        name=name, summary=summary, citation=citation,
        glsl="methods/grid/grid.glsl",
        kernels=("traverse", "intersect"),
        state=GRID_STATE,
        tables=(TRIANGLE, GRID_CELL, REFERENCE),
        prepare=lambda triangles, options: _prepare(triangles, options, proximity),
        fixed_defines={"PROXIMITY": proximity}, **more)


def _form(single: Method, options: Mapping[str, Any]) -> Method:
    if options["packet"] == (1, 1):
        return single
    return replace(
        single, glsl="methods/grid/coherent_grid.glsl", kernels=("step_packet",),
        parts=(_CULLING,),
        state=STATE, prepare=_prepare_packets,
        schedules=("loop",), drivers={"loop": PacketTraversal}, packet=True,
        single="grid")


FAMILY = "grid"
ROWS = (
    _row("grid", "traverses a uniform grid: a single ray visits a cell or a list entry per step; "
         "packets go slice by slice",
         "Purcell et al. 2002", False, options=(*_GRID_OPTIONS, _PACKET), form=_form),
    _row("grid-proximity", "traverses a uniform grid with proximity clouds, which skip empty "
         "cells in one jump",
         "Karlsson and Ljungstedt 2004", True, options=_GRID_OPTIONS),
)
