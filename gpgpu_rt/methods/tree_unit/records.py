"""The records of the method tree-unit. A kd-tree and a BVH are stored in the same records."""
from __future__ import annotations

from ...gl.record import Record

UNIT_NODE = Record("unit_node", "child:pointer count:int axis:int split")
"""A node of a kd-tree or of a BVH.

For an inner node, ``child`` is the left child, and the right child directly follows it. ``axis``
is 0, 1 or 2, and the left child is the lower one along this axis. ``split`` is the coordinate of
a kd-tree's split plane, and 0 in a BVH.

For a leaf, ``axis`` is 3, ``child`` is the first reference, and ``count`` is the number of
references. With marked lists (traversal/leaf_lists.py), the record has no ``count``."""

UNIT_BOUNDS = Record("unit_bounds", "lo:vec3 parent:pointer | hi:vec3 side:int")
"""A node's box, its parent, and its side.

``side`` is the parent's axis for a left child, the parent's axis + 3 for a right child, and 6 for
the root."""

UNIT_STATE = Record("state", "t_min t_max node:pointer cursor:pointer "
                             "| end:pointer phase:int steps:int")
"""A ray's state: the current ``node``, the ray's interval in the node (``t_min``, ``t_max``), and
the leaf's references that remain to be tested (``cursor`` to ``end``). With marked lists, ``end``
is left out."""
