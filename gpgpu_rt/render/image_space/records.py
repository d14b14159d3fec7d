"""The records of ray bundles."""
from __future__ import annotations

from ...gl.record import Record

LAYER = Record("layer", "depth slope:vec2 side:int")
"""A layer of a parallel projection at a pixel: the depth at the pixel's centre; ``slope``, the
change of depth per pixel to the right and per pixel upwards; and the visible side of a triangle,
which is twice the triangle's row, plus 1 for the back. ``side`` is -1 where there is no
triangle."""

LEAVING = Record("leaving", "radiance:vec3")
"""The radiance that leaves a side of a triangle, the same at every place and in all directions."""
