"""The records of tiles of rays: the cone of a tile, and how far its rays still search."""
from __future__ import annotations

from ...gl.record import Record

TILE_SPAN = Record("tile_span", "centre:vec3 live:int | axis:vec3")
"""Where the rays of a tile begin and go: the middle of their origins, how many rays are not empty,
and the middle of their directions."""

TILE_CONE = Record("tile_cone", "apex:vec3 radius | axis:vec3 cosine")
"""A cone around the rays of a tile: around every origin within ``radius`` of the apex, directions
whose angle to the axis has this cosine at least."""

TILE_END = Record("tile_end", "reach lines:int")
"""How far from their origins the rays of a tile still search, world units, -1 for no ray that
does; and 1 where one of them also searches behind its origin."""
