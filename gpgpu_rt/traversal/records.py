"""The records that several families share: states of rays, stacks, entry lists, candidates."""
from __future__ import annotations

from ..gl.record import EXACT_INTEGER, Record

STACK_ENTRY = Record("stack_entry", "t_max node:int")
"""A level of a ray's stack in an atlas: a node to visit, and the end of the interval."""

NEAREST = Record("nearest", "t")
"""The smallest t of the triangles drawn over a ray."""

FOUND = Record("found", "triangle:int")
"""The lowest index of the triangles drawn over a ray at its smallest t."""

ENTRIES = 28      # most entries of a tile's list

ENTRY_TILE = 4    # side in rays of the tiles with the lists that rays read

ENTRY_LIST = Record("entry_list", "codes:ivec4")
"""Four entries of a tile's list."""

PACKET_ENTRY = Record(
    "packet_entry", "start:int link_1:int link_2:int link_3:int | inv_lo:vec3 link_4:int "
                    "| inv_hi:vec3 t_min | lo_origin:vec3 visited:int | hi_origin:vec3 met:int",
    constants=(("NO_LINK", EXACT_INTEGER),))
"""The node where packets of a tile enter the tree, or NO_LINK without an entry, and four links.

The entry is valid for packets whose rays lie within the beam, which the outermost values bound
(drivers/packet_entry.glsl). ``visited`` counts the nodes that the beam visited. ``met`` is 0 if
the beam holds all rays of the tile and meets nothing."""

QUADS = Record("quads", "drawn:int tested:int")
"""The number of quads drawn over a ray, and the number of triangles tested in these quads."""

TESTED = Record("tested", "t triangle:int x:int y:int")
"""A ray's test of a triangle: t and the triangle, or infinity and -1; then the ray's texel."""

LEAST = Record("least", "t spare:vec2 tests:int")
"""Blending results: the smallest t of a ray's tests, and the number of tests."""

LOWEST = Record("lowest", "triangle:int")
"""Blending result: the lowest index of the triangles at the smallest t."""

STATE = Record("state", "phase:int steps:int")
"""A ray's state between passes: its phase, and the number of its kernel runs.

The phase is the number of the kernel that the ray waits for, in the order of the method's row; 0
for a finished ray, and below 0 for a stopped ray. A method that runs in a single pass, or that
keeps other data in other streams, needs no more."""

LIST_STATE = Record("state", "cursor:int phase:int steps:int")
"""A STATE, and the ray's position in a list of triangles."""

TREE_STATE = Record("state", "node:int cursor:int phase:int steps:int")
"""A STATE, the next node, and the ray's position in a leaf's triangles."""

PACKET_STATE = Record("state", "node:int cursor:int phase:int steps:int | turn:int turns:int")
"""A packet's state: a TREE_STATE, the active turn, and the turns that wait.

``turn`` is the number of the turn (drivers/packet_turns.glsl), such as a direction octant, whose
rays now traverse the tree together. ``turns`` has a bit for each turn that has not ended (BVHs) or
begun (kd-trees)."""

KD_ENTERING, BVH_ENTERING = "entry:int root:int", "entry:int end:int"
"""Additional fields of rays that visit a list of subtrees: the position in the list, and the root
of the present subtree or the node after its end."""
