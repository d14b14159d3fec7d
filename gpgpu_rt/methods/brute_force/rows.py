"""brute-force: test every ray against every triangle."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...traversal.accelerator import Accelerator
from ...traversal.method import Method
from ...traversal.records import LIST_STATE
from ...traversal.triangle_table import TRIANGLE, box_uniforms, triangle_table


def _prepare(triangles: np.ndarray, options: Mapping[str, Any]) -> Accelerator:
    return Accelerator(triangle_table(triangles),
                       {"triangle_count": len(triangles), **box_uniforms(triangles)},
                       step_bound=len(triangles), pointers=("triangle_count",))


FAMILY = "no structure"
ROWS = (Method(
    name="brute-force",
    summary="tests every ray against every triangle",
    citation="Foley and Sugerman 2005",
    glsl="methods/brute_force/brute_force.glsl",
    kernels=("intersect",),
    state=LIST_STATE,
    tables=(TRIANGLE,),
    prepare=_prepare,
),)
