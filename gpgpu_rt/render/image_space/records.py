"""The records of ray bundles."""
from __future__ import annotations

from ...gl.record import Record

LAYER = Record("layer", "depth slope:vec2 side:int")
"""What a parallel projection shows at a pixel, one layer of all: depth at the pixel's centre and
how it grows from there, a pixel to the right and one up; the side of a triangle that faces the
viewer, twice its row, plus one where that is its back, or -1 for nothing."""

LEAVING = Record("leaving", "radiance:vec3")
"""The radiance that leaves a side of a triangle, the same at every place and in all directions."""
