"""The records of kd-tree construction by fragment passes."""
from __future__ import annotations

from ....gl.record import Record

PIECE = Record("piece", "lo:vec3 triangle:int | hi:vec3 node:int")
"""The part of a triangle in a node: its box; the node's number in its level, or a small root's."""

CELL = Record("cell", "lo:vec3 count:int | hi:vec3 futile:int | parent:int")
"""A node of a level of large nodes: its box, its pieces; how many levels have told none from
another, or the prefix of codes that it is; its parent in the level above."""

CHUNK = Record("chunk", "lo:vec3 | hi:vec3 | left:vec3 | right:vec3")
"""Some pieces of a node: bounds; how many lie left and right of the node's middle, by axis."""

DECISION = Record("decision", "plane axis:int futile:int")
"""How a node of such a level is split; axis 3: not at all."""

TALLIES = Record("tallies", "left_x:vec4 | left_y:vec4 | left_z:vec4 | right_x:vec4 "
                            "| right_y:vec4 | right_z:vec4")
"""How many of some pieces lie left and right of four planes along each axis."""

OFFER = Record("offer", "plane axis:int cost")
"""The cheapest of some planes of a node; axis 3: none."""

SMALL_NODE = Record("node", "lo:vec3 base:int | hi:vec3 levels:int | mask:vec4")
"""A small node: its box, its root's first piece, how many levels there may be below it, and which
of the root's pieces it holds: 64 bits, 16 a channel."""

EXTENT = Record("extent", "lo hi")
"""A piece along one axis."""

SIDES = Record("sides", "lower_left:vec4 | lower_right:vec4 | upper_left:vec4 | upper_right:vec4")
"""Which pieces of a root lie left and right of where a piece begins and of where it ends, along
one axis: masks as a small node's."""

CHOICE = Record("choice", "plane face:int source:int inner:int")
"""The cheapest plane of a small node: a box's face, 0 to 5; its extent; whether it is taken."""

PLACE = Record("place", "at:int pair:int")
"""Where a node stands in depth-first order, and where the pair of its children does."""

BUILT = Record("built", "split axis:int left:int count:int | mask:vec4 | base:int")
"""A node of the finished tree, and where a leaf's pieces are: from base on those of the mask, or
where that is empty the first ones."""
