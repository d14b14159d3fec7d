"""The records of the stages before a traversal: beams, entry points, rasterised first hits."""
from __future__ import annotations

from ...gl.record import Record
from ..records import ENTRIES

DEPTH_BOUNDS = Record("depth_bounds", "least closed minus_most")
"""Bounds of the depths, along the view, at which a tile's eye rays can hit something. ``least`` is
the least depth of any triangle. If a triangle alone covers the whole tile, no ray of the tile
goes beyond the greatest depth of this triangle. ``closed`` is the least of these greatest depths.
``minus_most`` is the greatest depth of any triangle, negated so that MIN blending works for all
fields."""

SHOWN = Record("shown", "depth triangle:int")
"""A rasterised pixel: an upper bound of its hit's depth, and the shown triangle."""

SHOWN_FOUR = Record("shown_four", "triangle:ivec4 | depth:vec4")
"""The triangles and depths of four neighbouring pixels of a row, as in SHOWN."""

SHOWN_BLOCK = Record("shown_block", "depth lowest:int highest:int")
"""A square of rasterised pixels: the greatest depth in the square, and the lowest and the highest
index of the triangles shown there."""

PART = Record("part", "row:int x:int y:int")
"""A triangle to look for in a part of the image: the triangle's row and the part's first pixel."""

VERDICT = Record("verdict", "kind:int first:int last:int")
"""The verdict on a PART. ``kind`` is a constant of stages/verdict.glsl. If the triangle covers too
many pixels, the search must be split into parts of the image. ``first`` and ``last`` are then the
numbers of the first and the last part. The part in column x and row y has the number
x + 1,024 y."""

TILE_BEAM = Record(
    "tile_beam", "lo_origin:vec3 t_min | hi_origin:vec3 t_max | inv_lo:vec3 signs:int "
                 "| inv_hi:vec3 live:int")
"""The extreme origins, t and inverse directions of a tile's rays. ``signs`` tells which signs the
rays' directions have: bit a is set if a ray's direction is negative along axis a, and bit 3 + a if
a ray's direction is positive. ``live`` counts the rays with a non-empty interval."""

ENTRY_POINTS = Record("entries", " | ".join(f"list_{k}:ivec4" for k in range(ENTRIES // 4))
                      + " | visited:int count:int")
"""The list of entry points of a tile (see stages/entry_list.glsl), the number of nodes that the
tile's beam visited, and the number of entries in the list."""

TILE_BOUNDS = Record("tile_bounds", "least:vec3 live:int | most:vec3")
"""The least and the greatest components of the directions of a tile's rays. ``live`` is 0 if no
ray of the tile is live."""
