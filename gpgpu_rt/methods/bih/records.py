"""The records of bounding interval hierarchies."""
from __future__ import annotations

from ...gl.record import Record

BIH_NODE = Record("bih_node", "left_hi right_lo axis:int child:int")
"""A node of intervals: where its left child ends and its right one begins, axis (3 for a leaf),
left child (the right one follows) or a leaf's first triangle."""

BIH_BOUNDS = Record("bih_bounds", "lo:vec3 parent:int | hi:vec3 side:int")
"""What climbing adds to such a node: its box, its parent, and which child it is: of the parent's
axis, 3 more if the right one, 6 for the root."""

BIH_STATE = Record("state", "t_min t_max node:int cursor:int | phase:int steps:int")
"""The same, and the interval of a ray in its node."""
