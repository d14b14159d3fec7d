"""The records of ray bundles."""
from __future__ import annotations

from ...gl.record import Record

LAYER = Record("layer", "depth slope:vec2 side:int")
"""A layer of a parallel projection at a pixel: its ``depth`` at the pixel's centre, and the
``slope`` of the depth per pixel to the right and upwards. The visible ``side`` is twice the
triangle's row, plus 1 for the back side; -1 without a triangle."""

LEAVING = Record("leaving", "radiance:vec3")
"""The radiance that leaves a side of a triangle, equal everywhere and in all directions."""
