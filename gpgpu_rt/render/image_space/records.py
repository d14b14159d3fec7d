"""The records of ray bundles."""
from __future__ import annotations

from ...gl.record import Record

LAYER = Record("layer", "depth slope:vec2 side:int")
"""A layer of a parallel projection at a pixel. ``depth`` is the depth at the pixel's centre.
``slope`` is the change of depth from pixel to pixel, to the right and upwards. ``side`` is the
visible side of a triangle: twice the triangle's row, plus 1 for the back; or -1 where there is no
triangle."""

LEAVING = Record("leaving", "radiance:vec3")
"""The radiance that leaves a side of a triangle. It is the same at every place of the side and in
all directions."""
