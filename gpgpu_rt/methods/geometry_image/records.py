"""The records of geometry images: positions, cells and the pyramids over them."""
from __future__ import annotations

from ...gl.record import Record

POSITION = Record("position", "at:vec3")
"""A texel of a geometry image: a position on the surface."""

IMAGE_CELL = Record("image_cell", "corner:int across:int down:int face:int")
"""A quad of a geometry image: the texel of its first corner, and the first of its two faces.

``across`` and ``down`` are the distances in texels to the next corner along the row and column.
``across`` is negative if the quad's first triangle has no area. ``down`` is negative if the second
triangle has no area."""

MIN_PYRAMID = Record("min_pyramid", "lo:vec3 miss:int")
"""A quadtree's node: the lower corner of its box, and the node after its subtree (``miss``; -1 if
there is none)."""

MAX_PYRAMID = Record("max_pyramid", "hi:vec3 hit:int")
"""The rest of a MIN_PYRAMID's node: the upper corner of its box, and its first child (``hit``).
For a leaf, ``hit`` is -1 - i, where i is its IMAGE_CELL."""

PYRAMID_LINK = Record("pyramid_link", "miss:int hit:int")
"""A node's links ``miss`` and ``hit`` for a direction octant. The table holds all nodes for
octant 0, then all nodes for octant 1, and so on."""

PYRAMID_SOURCE = Record("pyramid_source", "first:int last:int")
"""The children that a node's box bounds, from ``first`` to ``last``. For a cell, ``first`` and
``last`` are two of its four texels, at diagonal corners."""
