"""ray-engine: the host traverses cells, fragments test triangles (Carr, Hall and Hart 2002)."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...accel.cache import cached
from ...errors import OptionError
from ...options import OFF, Option
from ...traversal.accelerator import Accelerator
from ...traversal.method import Method, Part
from ...traversal.records import STATE
from ...traversal.triangle_table import TRIANGLE, triangle_table
from ..grid.cells import Grid, build_grid
from .driver import RayEngine
from .fixed_point import FIXED_POINT, fixed_uniforms
from .octree import Octree, build_octree


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    plain = (options["intersection"] == "woop-watertight" and options["storage"] == "fp32"
             and options["arithmetic"] == "fp32" and options["fixed_point"] is None)
    if options["cpu_below"] > 1 and not plain:
        raise OptionError(f"cpu_below={options['cpu_below']}: the host has only the watertight "
                          "test in fp32; with another triangle test or number format, leave "
                          "cpu_below at 0")
    grid = _cells(triangles, options)
    uniforms = {"scene_lo": tuple(grid.lo), "scene_hi": tuple(grid.hi),
                **fixed_uniforms(options["fixed_point"], triangles)}
    # A ray crosses each plane between cells, and tests each list, at most once.
    bound = (int(grid.resolution.sum()) + len(grid.references)
             + int((np.diff(grid.cell_start) > 0).sum()) + 3)
    return Accelerator(triangle_table(triangles), uniforms, bound, grid, automatic={
        "resolution": tuple(int(r) for r in grid.resolution)})


def _cells(triangles: np.ndarray, options: Mapping[str, Any]) -> Grid | Octree:
    if options["cells"] == "grid":
        return cached(build_grid, triangles, resolution=options["resolution"],
                      density=options["density"])
    return cached(build_octree, triangles, leaf_size=options["leaf_size"],
                  density=options["density"])


FAMILY = "ray engine"
ROWS = (Method(
    name="ray-engine",
    summary="traverses a grid or an octree on the host, which queues rays by cell; draws each "
            "triangle of a cell as a quad over the queued rays, and a fragment tests each ray",
    citation="Carr et al. 2002",
    glsl="methods/ray_engine/ray_engine.glsl",
    kernels=("intersect",),
    state=STATE,
    tables=(TRIANGLE,),
    prepare=_prepare,
    options=(
        Option("cells", "grid", "structure that the host walks", choices=("grid", "octree"),
               label="structure on the host"),
        Option("leaf_size", 8, "an octree cell with more triangles than this is split", int,
               minimum=1, goes_with=("cells", ("octree",)), label="triangles per cell"),
        Option("resolution", None, "cells per axis: a number or x,y,z; default: set by density",
               object, excludes=("density",), goes_with=("cells", ("grid",)),
               label="cells per axis"),
        Option("density", 2.0, "target number of cells per triangle, if no resolution is given",
               float, minimum=1e-6, label="cells per triangle"),
        Option("nearest", "blend", "how the nearest hit of a ray is kept: MIN blending of floats, "
               "or a 24-bit depth test, which may lose hits", choices=("blend", "depth"),
               relaxed=("depth",), label="nearest hit kept by"),
        Option("fixed_point", None, "test rays against triangles in the fixed-point numbers of a "
               "card: r200 (16 bits in [-8, 8)) or nv25 (9 bits in [-1, 1]); default: floats",
               choices=tuple(FIXED_POINT), optional=True, relaxed=tuple(FIXED_POINT),
               excludes=("intersection", "arithmetic", "precision"),
               label="fixed point of a card", unset=OFF),
        Option("batch", 16_384, "largest number of rays in a batch", int, minimum=1,
               label="rays per batch"),
        Option("queue", 64, "a cell's queue is intersected once it has this many rays; if no "
               "queue has this many rays, all queues are intersected", int, minimum=1,
               label="rays per full queue"),
        Option("cpu_below", 0, "the host itself intersects queues of fewer rays than this; hits "
               "are the same to the bit if the renderer rounds as IEEE 754 requires and flushes "
               "subnormal numbers", int, minimum=0, label="host tests queues below"),
    ),
    parts=(Part("pair_test", "fixed_point", "methods/ray_engine/float_point.glsl",
                {True: "methods/ray_engine/fixed_point.glsl"}),),
    schedules=("kernels",),
    drivers={"kernels": RayEngine},
),)
