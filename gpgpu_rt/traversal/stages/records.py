"""The records of the stages before a traversal: beams, entry points, rasterised first hits."""
from __future__ import annotations

from ...gl.record import Record
from ..records import ENTRIES

DEPTH_BOUNDS = Record("depth_bounds", "least closed minus_most")
"""Bounds of a tile of eye rays: the least and the greatest depth of triangles along the view, and
the depth of a triangle that covers the whole tile. The greatest depth is negated, so that MIN
blending works for all fields."""

SHOWN = Record("shown", "depth triangle:int")
"""A rasterised pixel: an upper bound of its hit's depth, and the shown triangle."""

SHOWN_FOUR = Record("shown_four", "triangle:ivec4 | depth:vec4")
"""Four rasterised pixels of a row."""

SHOWN_BLOCK = Record("shown_block", "depth lowest:int highest:int")
"""A square of rasterised pixels: the greatest depth, the lowest and the highest triangle."""

PART = Record("part", "row:int x:int y:int")
"""A triangle in a part of the image: the triangle's row and the part's first pixel."""

VERDICT = Record("verdict", "kind:int first:int last:int")
"""The verdict on a PART, as in stages/verdict.glsl. For a triangle that must be cut into parts,
``first`` and ``last`` number its first and last part of the image, x + 1,024 y."""

TILE_BEAM = Record(
    "tile_beam", "lo_origin:vec3 t_min | hi_origin:vec3 t_max | inv_lo:vec3 signs:int "
                 "| inv_hi:vec3 live:int")
"""The outermost values of a tile's rays: origins, t and inverse directions. ``signs`` has a bit
per axis for negative directions (bit a) and for positive directions (bit 3 + a). ``live`` counts
the rays with a non-empty interval."""

ENTRY_POINTS = Record("entries", " | ".join(f"list_{k}:ivec4" for k in range(ENTRIES // 4))
                      + " | visited:int count:int")
"""The entries of a tile's rays (see stages/entry_list.glsl), the number of nodes that the tile's
beam visited, and the number of entries."""

TILE_BOUNDS = Record("tile_bounds", "least:vec3 live:int | most:vec3")
"""The outermost components of the directions of a tile's rays; 0 if no ray is live."""
