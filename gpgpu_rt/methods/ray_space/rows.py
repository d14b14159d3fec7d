"""ray-classification (Arvo and Kirk 1987) and visibility-field (Mortensen et al. 2007)."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...accel.cache import cached
from ...options import Option
from ...traversal.accelerator import Accelerator
from ...traversal.method import SCHEDULES, Method
from ...traversal.records import LIST_STATE
from ...traversal.triangle_table import TRIANGLE, triangle_table
from ..bvh.build import build_bvh
from .driver import RayClasses
from .frames import ray_space
from .ray_boxes import RayBoxes
from .records import BEAM, BEAM_ENTRY, BEAM_STATE, CANDIDATE, RAY_BOX
from .visibility_field import AXES, build_visibility_field, half_size


def _prepare_boxes(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    space = ray_space(triangles, options["arithmetic"])
    tree = cached(build_bvh, triangles)
    boxes = RayBoxes(triangles, tree, space, options["origin_cells"], options["direction_cells"],
                     options["min_rays"], options["budget"])
    tables = {**triangle_table(triangles), RAY_BOX.name: {"first": boxes.directory},
              CANDIDATE.name: {"triangle": boxes.triangle, "near": boxes.near}}
    cell = (space.hi.astype(np.float64) - space.lo) / options["origin_cells"]
    uniforms = {"scene_lo": tuple(space.lo), "scene_hi": tuple(space.hi),
                "origin_cells": options["origin_cells"],
                "direction_cells": options["direction_cells"], "box_count": boxes.cells,
                "origin_cell_size": tuple(cell.tolist()), "scene_centre": tuple(space.centre),
                "far_origin": space.far}
    return Accelerator(tables, uniforms, len(triangles) + 1, boxes)


def _prepare_field(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    space = ray_space(triangles, options["arithmetic"])
    field = cached(build_visibility_field, triangles, budget=options["budget"],
                   directions=options["directions"], tiles=options["tiles"],
                   arithmetic=options["arithmetic"])
    start = field.beam_start
    tables = {**triangle_table(triangles),
              BEAM.name: {"first": start[:-1], "entries": np.diff(start)},
              BEAM_ENTRY.name: {"triangle": field.triangle, "near": field.near, "far": field.far,
                                "reach": field.reach}}
    uniforms = {"scene_lo": tuple(space.lo), "scene_hi": tuple(space.hi),
                "directions": field.directions, "tiles": field.tiles,
                "beam_count": len(start) - 1 - AXES, "scene_centre": tuple(space.centre),
                "half_size": tuple(half_size(space)), "far_origin": space.far}
    return Accelerator(tables, uniforms, len(triangles) + SEARCH_STEPS, field,
                       automatic={"directions": field.directions, "tiles": field.tiles})


SEARCH_STEPS = 32   # upper bound on the steps of a ray's binary search

FAMILY = "ray space"
ROWS = (
    Method(
        name="ray-classification",
        summary="finds a ray's box by one lookup; the box lists the triangles that its rays may "
                "hit, nearest first",
        citation="Arvo and Kirk 1987",
        glsl="methods/ray_space/ray_classification.glsl",
        kernels=("intersect",),
        state=LIST_STATE,
        tables=(TRIANGLE, RAY_BOX, CANDIDATE),
        prepare=_prepare_boxes,
        options=(
            Option("origin_cells", 8, "number of origin boxes per axis at the finest level, a "
                   "power of two", int, minimum=1, label="origin boxes per axis"),
            Option("direction_cells", 16, "number of direction boxes along a side of a face of "
                   "the direction cube at the finest level, a power of two", int, minimum=1,
                   label="direction boxes per side"),
            Option("min_rays", 1, "a box gets a list of candidates only if it holds at least this "
                   "many rays of a call", int, minimum=1, label="fewest rays per list"),
            Option("budget", 128.0, "memory for all candidate lists, in MiB; rays whose "
                   "list does not fit use larger boxes with longer lists", float, minimum=0.0,
                   label="memory (MiB)"),
        ),
        drivers=dict.fromkeys(SCHEDULES, RayClasses),
    ),
    Method(
        name="visibility-field",
        summary="finds a ray's beam of parallel lines by one lookup, then tests the beam's "
                "triangles in order",
        citation="Mortensen et al. 2007",
        glsl="methods/ray_space/visibility_field.glsl",
        kernels=("search", "intersect"),
        state=BEAM_STATE,
        tables=(TRIANGLE, BEAM, BEAM_ENTRY),
        prepare=_prepare_field,
        options=(
            Option("directions", None, "number of direction cells along a side of a face of the "
                   "direction cube; default: set by the budget", int, minimum=1,
                   label="directions per side"),
            Option("tiles", None, "number of tiles along a side of the plane of a direction "
                   "cell; default: set by the budget", int, minimum=1,
                   label="beams per side"),
            Option("budget", 64.0, "memory for all beams and their lists, in MiB; a "
                   "smaller budget gives fewer and thicker beams", float, minimum=0.0,
                   label="memory (MiB)"),
        ),
        no_era_form="it needs a ray's dominant axis, which the era form does not compute",
    ),
)
