"""The records of kd-tree construction by fragment passes."""
from __future__ import annotations

from ....gl.record import Record

PIECE = Record("piece", "lo:vec3 triangle:int | hi:vec3 node:int")
"""The part of a triangle in a node: its box, and the number of the node or of the small root."""

CELL = Record("cell", "lo:vec3 count:int | hi:vec3 futile:int | parent:int")
"""A node in a level of large nodes: its box, number of pieces, and parent in the level above.

`futile` is the number of levels in a row that separated no pieces. In the hybrid build it is the
node's prefix of codes."""

CHUNK = Record("chunk", "lo:vec3 | hi:vec3 | left:vec3 | right:vec3")
"""A chunk of a node's pieces: bounds, and how many lie left and right of the node's middle."""

DECISION = Record("decision", "plane axis:int futile:int")
"""The split of a node in a level of large nodes; axis 3 means no split."""

TALLIES = Record("tallies", "left_x:vec4 | left_y:vec4 | left_z:vec4 | right_x:vec4 "
                            "| right_y:vec4 | right_z:vec4")
"""The numbers of a chunk's pieces left and right of four planes along each axis."""

OFFER = Record("offer", "plane axis:int cost")
"""The cheapest plane of a group of a node's planes; axis 3 means no plane."""

SMALL_NODE = Record("node", "lo:vec3 base:int | hi:vec3 levels:int | mask:vec4")
"""A small node: its box, its root's first piece, the most levels below it, and its pieces.

`mask` marks the root's pieces that the node holds: 64 bits, 16 per channel."""

EXTENT = Record("extent", "lo hi")
"""The extent of a piece along an axis."""

SIDES = Record("sides", "lower_left:vec4 | lower_right:vec4 | upper_left:vec4 | upper_right:vec4")
"""Masks of a root's pieces left and right of a piece's lower and upper end along an axis.

The masks are as in SMALL_NODE."""

CHOICE = Record("choice", "plane face:int source:int inner:int")
"""The cheapest plane of a small node: its face (0 to 5), its EXTENT, and 1 for a node to split."""

PLACE = Record("place", "at:int pair:int")
"""The positions of a node and of its pair of children in depth-first order."""

BUILT = Record("built", "split axis:int left:int count:int | mask:vec4 | base:int")
"""A node of the finished tree, and a leaf's pieces.

`mask` marks a leaf's pieces from `base` on. If the mask is empty, the leaf has the first `count`
pieces from `base` on."""
