"""The records of BVH construction by fragment passes."""
from __future__ import annotations

from ....gl.record import Record

BIN = Record("bin", "lo:vec3 count:int | minus_hi:vec3")
"""What the triangles in a bin span, the upper corner negated so that one blending takes the
minimum of both, and how many they are."""

SLOT = Record("slot", "triangle:int node:int starts:int")
"""A place in the order: its triangle; the node being split there, or -1; 1 where a leaf begins."""

SPLIT = Record("split", "axis:int at:int taken:int")
"""How a node is split: ``taken`` triangles go left, none where it is a leaf; which ones, says a
bin, or a slot, along an axis; 3 stands for the order of slots itself."""

INTERVAL = Record("interval", "first:int last:int parent:int turns:int")
"""A node as the slots that it spans, or -1 for none; an ancestor, or -1 for none; and of those on
the way there how many have it on their left."""
