"""The records of tiles of rays: a tile's cone, and the distance to which its rays still search."""
from __future__ import annotations

from ...gl.record import Record

TILE_SPAN = Record("tile_span", "centre:vec3 live:int | axis:vec3")
"""The live rays of a tile: the centre of their origins' box, their number, and their mean
direction."""

TILE_CONE = Record("tile_cone", "apex:vec3 radius | axis:vec3 cosine")
"""A cone around the rays of a tile.

Every origin lies within ``radius`` of the apex. The cosine of the angle between a ray's direction
and the axis is at least ``cosine``."""

TILE_END = Record("tile_end", "reach lines:int")
"""How far a tile's rays search. ``reach`` is the largest distance, in world units, that a ray
still searches from its origin; -1 if no ray searches. ``lines`` is 1 if a ray also searches behind
its origin, else 0."""
