"""The records of the stages before a traversal: beams, entry points, rasterised first hits."""
from __future__ import annotations

from ...gl.record import Record
from ..records import ENTRIES

DEPTH_BOUNDS = Record("depth_bounds", "least closed minus_most")
"""Of a tile of eye rays: between which depths along the view triangles lie, the greatest negated
so that one blending takes the minimum of all; and the depth at which a triangle closes it."""

SHOWN = Record("shown", "depth triangle:int")
"""What a rasterised pixel shows: a depth that its hit does not lie behind, and the triangle."""

SHOWN_FOUR = Record("shown_four", "triangle:ivec4 | depth:vec4")
"""Four such pixels of a row."""

SHOWN_BLOCK = Record("shown_block", "depth lowest:int highest:int")
"""A square of such pixels: the greatest depth, the lowest and the highest triangle."""

PART = Record("part", "row:int x:int y:int")
"""A triangle in a part of the image, which begins at a pixel."""

VERDICT = Record("verdict", "kind:int first:int last:int")
"""What becomes of such a triangle, as in stages/verdict.glsl; where it must be cut up, the parts
it begins and ends in, counted across and then in rows of 1,024."""

TILE_BEAM = Record(
    "tile_beam", "lo_origin:vec3 t_min | hi_origin:vec3 t_max | inv_lo:vec3 signs:int "
                 "| inv_hi:vec3 live:int")
"""The rays of a tile by their outermost values: what corners are measured from, t and inverse
direction; which signs directions have by axis (bit a negative, 3 + a positive), and how
many rays are not empty."""

ENTRY_POINTS = Record("entries", " | ".join(f"list_{k}:ivec4" for k in range(ENTRIES // 4))
                      + " | visited:int count:int")
"""Where a tile's rays enter the tree, see stages/entry_list.glsl; nodes that its beam visited, and
how many entries there are."""

TILE_BOUNDS = Record("tile_bounds", "least:vec3 live:int | most:vec3")
"""Directions of a tile's rays by their outermost components; 0 where no ray is live."""
