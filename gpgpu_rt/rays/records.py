"""The records of rays and their hits."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..gl.record import EXACT_INTEGER, Record

RAY_TEXELS = Record("rays", "origin:vec3 t_min | direction:vec3 t_max")
"""A ray, stored in a texel of each of two textures."""

RAY_AFTER_HIT = replace(RAY_TEXELS, layout=RAY_TEXELS.layout + " | after:int",
                        define="AFTER_HIT")
"""A ray that continues after its hit at t_min. At exactly t_min, the ray meets only triangles with
an index larger than ``after``. Before the first hit, ``after`` is -1."""

NO_RAY = RAY_AFTER_HIT.pack(origin=np.zeros((1, 3)), t_min=[1], direction=[[0, 0, 1]], t_max=[-1],
                            after=[-1])[0]
"""(3, 4) float32, the content of texels without a ray: a ray with an empty interval."""

NO_TRIANGLE = EXACT_INTEGER     # larger than every index, so min(NO_TRIANGLE, index) is the index

HIT = Record("hit", "t u v triangle:int", constants=(("NO_TRIANGLE", NO_TRIANGLE),))
"""The nearest hit so far. Before the first hit, ``triangle`` is NO_TRIANGLE and ``t`` is the ray's
t_max. After a packet pass, ``t`` is undefined where ``triangle`` is NO_TRIANGLE."""

COUNTERS = Record("counters", "nodes_visited:int leaves_visited:int triangles_tested:int")
"""The work of a ray so far; exists only in programs with statistics."""
