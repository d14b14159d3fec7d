"""The records of bounding interval hierarchies."""
from __future__ import annotations

from ...gl.record import Record

BIH_NODE = Record("bih_node", "left_hi right_lo axis:int child:int")
"""An inner node: along `axis`, its left child ends at `left_hi` and its right child starts at
`right_lo`. `child` is the left child; the right child follows it.

A leaf has `axis` 3, and `child` is its first triangle."""

BIH_BOUNDS = Record("bih_bounds", "lo:vec3 parent:int | hi:vec3 side:int")
"""A node's box, parent and side, which a ray reads to climb.

`side` is the parent's axis for a left child, the parent's axis + 3 for a right child, and 6 for
the root."""

BIH_STATE = Record("state", "t_min t_max node:int cursor:int | phase:int steps:int")
"""A ray's state: the current ``node``, the ray's interval in the node (``t_min``, ``t_max``), and
``cursor``, the next triangle to test in a leaf."""
