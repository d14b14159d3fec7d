"""sweep, an example: sorts triangles along an axis and cuts them into runs, each with a box.

Boxes around parts of a scene go back to Rubin and Whitted (1980). A ray visits the runs in
ascending or descending order, by the sign of its direction along the axis. The ray stops when
its hit is nearer than all remaining runs. ../../docs/how-to/add-a-method.md explains this file
step by step.
"""
from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gpgpu_rt.gl.record import Record
from gpgpu_rt.methods import Accelerator, Method
from gpgpu_rt.options import Option
from gpgpu_rt.traversal.triangle_table import TRIANGLE, box_uniforms, triangle_table

# A run has a box (lo, hi) and a first triangle. `least` is the lowest coordinate along `axis` in
# this run and all later runs; `most` is the highest coordinate in this run and all earlier runs.
RUN = Record("sweep_run", "lo:vec3 first:int | hi:vec3 | least most")


def prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    """Build the tables and uniforms for (n, 3, 3) float32 triangles."""
    axis, length = options["axis"], options["run"]
    order = np.argsort(triangles[:, :, axis].astype(np.float64).sum(axis=1), kind="stable")
    first = np.arange(0, len(order), length)
    lo, hi = np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    if len(order):
        lo = np.minimum.reduceat(triangles[order].min(axis=1), first)
        hi = np.maximum.reduceat(triangles[order].max(axis=1), first)
    place = np.arange(len(order))
    last = (place % length == length - 1) | (place == len(order) - 1)
    tables = {**triangle_table(triangles, order, last),
              RUN.name: {"lo": lo, "hi": hi, "first": first,
                         "least": np.minimum.accumulate(lo[::-1, axis])[::-1],
                         "most": np.maximum.accumulate(hi[:, axis])}}
    uniforms = {"run_count": len(first), **box_uniforms(triangles)}
    # A ray visits each run at most once and tests each triangle at most once.
    return Accelerator(tables, uniforms, step_bound=len(first) + len(order), structure=order)


ROWS = (Method(
    name="sweep",
    summary="visits runs of triangles along an axis, in the ray's direction; an example",
    citation="after Rubin and Whitted 1980",
    glsl=Path(__file__).with_name("sweep.glsl"),
    kernels=("pass_run", "intersect"),
    state=Record("state", "passed:int cursor:int phase:int steps:int"),
    tables=(TRIANGLE, RUN),
    prepare=prepare,
    options=(
        Option("axis", 0, "axis along which triangles are sorted: 0 is x, 1 is y, 2 is z", int,
               choices=(0, 1, 2), define="AXIS"),
        Option("run", 16, "triangles per run", int, minimum=1),
    ),
),)
