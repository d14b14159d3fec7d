"""The records of geometry images: positions, cells and the pyramids over them."""
from __future__ import annotations

from ...gl.record import Record

POSITION = Record("position", "at:vec3")
"""A texel of a geometry image: the surface's position there."""

IMAGE_CELL = Record("image_cell", "corner:int across:int down:int face:int")
"""A quad of a geometry image: the texel of its first corner; how far on the texels beside and
below that one lie, each negative where a triangle has no area (across: the upper one, down: the
lower); the first of its two faces."""

MIN_PYRAMID = Record("min_pyramid", "lo:vec3 miss:int")
"""A node of a geometry image's quadtrees: lower corner; the node after its subtree, or -1."""

MAX_PYRAMID = Record("max_pyramid", "hi:vec3 hit:int")
"""The same node's upper corner, and its first child, or -1 minus the cell of a leaf."""

PYRAMID_LINK = Record("pyramid_link", "miss:int hit:int")
"""Both links of a node for rays of one octant of directions, octant after octant."""

PYRAMID_SOURCE = Record("pyramid_source", "first:int last:int")
"""What a node's box is made from: its first and last child. Of a node on the finest level: the
first and last texel of its cell, which are diagonal corners."""
