"""The records of BVH construction by fragment passes."""
from __future__ import annotations

from ....gl.record import Record

BIN = Record("bin", "lo:vec3 count:int | minus_hi:vec3")
"""The box of the triangles in a bin, and their number. The upper corner is negated, so that MIN
blending joins both corners."""

SLOT = Record("slot", "triangle:int node:int starts:int")
"""A place in the order of triangles. ``triangle`` is the triangle in this slot. ``node`` is the
slot's node in the present level, or -1 in a leaf. ``starts`` is 1 if a leaf starts here."""

SPLIT = Record("split", "axis:int at:int taken:int")
"""A node's split: ``taken`` triangles go to the left child; 0 makes the node a leaf.

``at`` is the place of the split along ``axis``: a bin for a large node, a slot for a small node.
Axis 3 splits the triangles in the order of their slots."""

INTERVAL = Record("interval", "first:int last:int parent:int turns:int")
"""A node: the slots from ``first`` to ``last``. ``first`` is -1 if there is no node.

``turns`` is the number of ancestors, on the path up to ``parent``, that have the node in their
left subtree. In LBVH, each pass of pointer jumping (lbvh.py) replaces ``parent`` by a higher
ancestor; a ``parent`` of -1 means that the path ends at the root."""
