"""The records of BVH construction by fragment passes."""
from __future__ import annotations

from ....gl.record import Record

BIN = Record("bin", "lo:vec3 count:int | minus_hi:vec3")
"""The box and the number of the triangles in a bin.

The upper corner is negated, so that MIN blending serves both corners."""

SLOT = Record("slot", "triangle:int node:int starts:int")
"""A place in the order: its triangle, its unfinished node or -1, and 1 if a leaf starts here."""

SPLIT = Record("split", "axis:int at:int taken:int")
"""A node's split: ``taken`` triangles go left; 0 makes a leaf.

``at`` is the bin (of a large node) or the slot (of a small node), along ``axis``, where the split
is. Axis 3 splits in the order of slots."""

INTERVAL = Record("interval", "first:int last:int parent:int turns:int")
"""A node as a span of slots (``first`` is -1 if there is no node), with an ancestor or -1.

``turns`` counts the ancestors, on the path to ``parent``, that have the node in their left
subtree."""
