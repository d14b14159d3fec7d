"""The records of kd-tree construction by fragment passes."""
from __future__ import annotations

from ....gl.record import Record

PIECE = Record("piece", "lo:vec3 triangle:int | hi:vec3 node:int")
"""A piece, the part of a triangle in a node: the triangle, the part's box, and the node's number.
For a small node, `node` is the number of the small root (see SMALL_NODE)."""

CELL = Record("cell", "lo:vec3 count:int | hi:vec3 futile:int | parent:int")
"""A node in a level of large nodes: its box, number of pieces, and parent in the level above.

`futile` is the number of successive levels whose splits separated no pieces; in the hybrid build,
the common prefix of the node's Morton codes."""

CHUNK = Record("chunk", "lo:vec3 | hi:vec3 | left:vec3 | right:vec3")
"""A chunk of a node's pieces: their bounds, and for each axis, the numbers of pieces left and
right of the node's middle."""

DECISION = Record("decision", "plane axis:int futile:int")
"""The split of a node in a level of large nodes. Axis 3 means no split."""

TALLIES = Record("tallies", "left_x:vec4 | left_y:vec4 | left_z:vec4 | right_x:vec4 "
                            "| right_y:vec4 | right_z:vec4")
"""The numbers of a chunk's pieces left and right of four planes along each axis."""

OFFER = Record("offer", "plane axis:int cost")
"""The cheapest plane of a group of candidate planes of a node. Axis 3 means no plane."""

SMALL_NODE = Record("node", "lo:vec3 base:int | hi:vec3 levels:int | mask:vec4")
"""A small node (at most 64 pieces). A small node without a small parent is a small root.

`base` is the first piece of the node's small root. `levels` is the largest number of levels below
the node. The 64 bits of `mask`, 16 per channel, mark the root's pieces that the node holds."""

EXTENT = Record("extent", "lo hi")
"""The extent of a piece along an axis."""

SIDES = Record("sides", "lower_left:vec4 | lower_right:vec4 | upper_left:vec4 | upper_right:vec4")
"""Masks, as in SMALL_NODE, for a piece and an axis: the pieces of the small root on the left and
on the right of the piece's lower end, and of its upper end."""

CHOICE = Record("choice", "plane face:int source:int inner:int")
"""The cheapest plane of a small node. `face` is the face of a piece's box (0 to 5) in this plane,
and `source` is the number of the piece's EXTENT. `inner` is 1 if the node is to be split."""

PLACE = Record("place", "at:int pair:int")
"""The position of a node in depth-first order, and the position of its pair of children."""

BUILT = Record("built", "split axis:int left:int count:int | mask:vec4 | base:int")
"""A node of the finished tree, with the pieces of a leaf.

Bit k of `mask` marks piece `base` + k as a piece of the leaf. If the mask is empty, the leaf has
`count` consecutive pieces from `base` on."""
