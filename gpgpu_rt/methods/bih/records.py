"""The records of bounding interval hierarchies."""
from __future__ import annotations

from ...gl.record import Record

BIH_NODE = Record("bih_node", "left_hi right_lo axis:int child:int")
"""A node: the end of its left child (`left_hi`) and the start of its right child (`right_lo`)
along `axis`, which is 3 for a leaf.

`child` is an inner node's left child (the right child is the next node), or a leaf's first
triangle."""

BIH_BOUNDS = Record("bih_bounds", "lo:vec3 parent:int | hi:vec3 side:int")
"""The data with which a ray climbs to a parent: a node's box, its parent, and its side.

`side` is the parent's axis for a left child, the parent's axis + 3 for a right child, and 6 for
the root."""

BIH_STATE = Record("state", "t_min t_max node:int cursor:int | phase:int steps:int")
"""A ray's state: the current ``node``, the ray's interval in the node (``t_min``, ``t_max``), and
``cursor``, the position in the node's triangles."""
