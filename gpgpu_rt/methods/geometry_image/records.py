"""The records of geometry images: positions, cells and the pyramids over them."""
from __future__ import annotations

from ...gl.record import Record

POSITION = Record("position", "at:vec3")
"""A texel of a geometry image: a position on the surface."""

IMAGE_CELL = Record("image_cell", "corner:int across:int down:int face:int")
"""A quad of a geometry image: the texel of its first corner, and the first of its two faces.

``across`` and ``down`` are the distances in texels to the corner beside and the corner below.
``across`` is negative if the upper triangle has no area, ``down`` if the lower has no area."""

MIN_PYRAMID = Record("min_pyramid", "lo:vec3 miss:int")
"""A node of a geometry image's quadtrees: lower corner, and the node after its subtree or -1."""

MAX_PYRAMID = Record("max_pyramid", "hi:vec3 hit:int")
"""A node's upper corner, and its first child, or -1 - cell for a leaf."""

PYRAMID_LINK = Record("pyramid_link", "miss:int hit:int")
"""Both links of a node for the rays of a direction octant; the octants follow each other."""

PYRAMID_SOURCE = Record("pyramid_source", "first:int last:int")
"""The sources of a node's box: its first and last child.

For a node of the finest level, they are the first and last texel of its cell, which are diagonal
corners."""
