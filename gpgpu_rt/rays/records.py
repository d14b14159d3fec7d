"""The records of rays and their hits."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..gl.record import EXACT_INTEGER, Record

RAY_TEXELS = Record("rays", "origin:vec3 t_min | direction:vec3 t_max")
"""A ray as it lies in its two textures."""

RAY_AFTER_HIT = replace(RAY_TEXELS, layout=RAY_TEXELS.layout + " | after:int",
                        define="AFTER_HIT")
"""A ray that goes on behind what it hit at t_min: of the triangles at just that t only those above
``after`` count, which is -1 where nothing was hit yet."""

NO_RAY = RAY_AFTER_HIT.pack(origin=np.zeros((1, 3)), t_min=[1], direction=[[0, 0, 1]], t_max=[-1],
                            after=[-1])[0]
"""(3, 4) float32, what texels hold that no ray lies in: one whose interval is empty."""

NO_TRIANGLE = EXACT_INTEGER     # above every index: the lowest of several is one, if there is one

HIT = Record("hit", "t u v triangle:int", constants=(("NO_TRIANGLE", NO_TRIANGLE),))
"""The nearest hit so far; of none NO_TRIANGLE and the ray's end; what packets miss has any end."""

COUNTERS = Record("counters", "nodes_visited:int leaves_visited:int triangles_tested:int")
"""What a ray did; exists only in programs with statistics."""
