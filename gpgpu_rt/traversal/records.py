"""Records that several folders of methods share: states, stack entries, entry points and hits."""
from __future__ import annotations

from ..gl.record import EXACT_INTEGER, Record

STACK_ENTRY = Record("stack_entry", "t_max node:pointer")
"""A level of a ray's stack in an atlas (stack_atlas.py): a node to visit, and the end of the ray's
interval in this node."""

NEAREST = Record("nearest", "t")
"""The smallest t of the triangles drawn over a ray."""

FOUND = Record("found", "triangle:int")
"""The lowest index of the triangles drawn over a ray at the ray's smallest t."""

ENTRIES = 28      # largest length of a tile's list of entry points

ENTRY_TILE = 4    # side in rays of the smallest tiles, whose lists the rays read

ENTRY_LIST = Record("entry_list", "codes:ivec4")
"""Four entries of a tile's list of entry points."""

PACKET_ENTRY = Record(
    "packet_entry", "start:int link_1:int link_2:int link_3:int | inv_lo:vec3 link_4:int "
                    "| inv_hi:vec3 t_min | lo_origin:vec3 visited:int | hi_origin:vec3 met:int",
    constants=(("NO_LINK", EXACT_INTEGER),))
"""The entry of a tile: where the packets of the tile enter the tree (drivers/packet_entry.glsl).

``start`` is the node to begin at, or NO_LINK if the tile has no entry. The four links describe the
walk after this node (methods/bvh/entry_stack.glsl, methods/bvh/entry_threads.glsl). A packet may
use the entry if all its rays lie within the tile's beam. The origins, inverse directions and
``t_min`` of this record bound the beam.
``visited`` counts the nodes that the beam visited. ``met`` is 0 if the beam shows that no ray of
the tile hits a triangle."""

QUADS = Record("quads", "drawn:int tested:int")
"""The number of quads drawn over a ray, and the number of triangles tested in these quads."""

TESTED = Record("tested", "t triangle:int x:int y:int")
"""The result of a ray's test of a triangle. ``t`` and ``triangle`` are infinity and -1 for a miss;
``x`` and ``y`` are the ray's texel."""

LEAST = Record("least", "t spare:vec2 tests:int")
"""Results of blending: the smallest t of a ray's tests, and the number of tests. ``spare``
holds no data: it moves ``tests`` to the alpha channel, which has a separate blend equation."""

LOWEST = Record("lowest", "triangle:int")
"""Result of blending: the lowest index of the triangles at the smallest t."""

STATE = Record("state", "phase:int steps:int")
"""A ray's state between passes: its ``phase``, and ``steps``, the number of its kernel runs.

The phase of a live ray is the number of the kernel that the ray waits for; ``Method.kernels`` has
the kernels' order. The phase is 0 for a finished ray and below 0 for a stopped ray. These two
fields are enough for a method that runs in a single pass, or that keeps its other data in other
streams."""

LIST_STATE = Record("state", "cursor:pointer phase:int steps:int")
"""The fields of STATE, and ``cursor``, the ray's position in a list of triangles."""

TREE_STATE = Record("state", "node:pointer cursor:pointer phase:int steps:int")
"""The fields of STATE, the next ``node``, and ``cursor``, the ray's position in a leaf's
triangles."""

PACKET_STATE = Record("state", "node:int cursor:int phase:int steps:int | turn:int turns:int")
"""A packet's state: the fields of TREE_STATE, the active turn, and the turns that wait.

A packet traverses the tree once per turn. In a turn, only rays of the same group traverse, for
example the rays of a direction octant (drivers/packet_turns.glsl). ``turn`` is the number of the
active turn. ``turns`` has a bit for each turn that has not ended (BVHs), or for each turn that has
not begun (kd-trees)."""

KD_ENTERING, BVH_ENTERING = "entry:int root:int", "entry:int end:int"
"""Additional fields of rays that visit a list of subtrees. ``entry`` is the position in the list.
In a kd-tree, ``root`` is the root of the current subtree. In a BVH, ``end`` is the node after the
end of the current subtree."""
