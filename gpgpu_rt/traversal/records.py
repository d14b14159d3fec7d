"""The records that several families share: states of rays, stacks, entry lists, candidates."""
from __future__ import annotations

from ..gl.record import EXACT_INTEGER, Record

STACK_ENTRY = Record("stack_entry", "t_max node:int")
"""A level of a ray's stack in an atlas: a node to visit, and where the interval in it ends."""

NEAREST = Record("nearest", "t")
"""The least t of the triangles drawn over a ray."""

FOUND = Record("found", "triangle:int")
"""The lowest index of the triangles drawn over a ray at its least t."""

ENTRIES = 28      # of a tile, at most

ENTRY_TILE = 4    # rays a side of the tiles that rays have their lists from

ENTRY_LIST = Record("entry_list", "codes:ivec4")
"""Four entries of a tile's list."""

PACKET_ENTRY = Record(
    "packet_entry", "start:int link_1:int link_2:int link_3:int | inv_lo:vec3 link_4:int "
                    "| inv_hi:vec3 t_min | lo_origin:vec3 visited:int | hi_origin:vec3 met:int",
    constants=(("NO_LINK", EXACT_INTEGER),))
"""Where packets of a tile enter the tree if their rays lie within the beam of these outermost
values (drivers/packet_entry.glsl), NO_LINK for nowhere; how many nodes the beam visited, and 0
where it holds all rays of the tile and meets nothing."""

QUADS = Record("quads", "drawn:int tested:int")
"""Quads of triangles that were drawn over a ray, and triangles tested in them."""

TESTED = Record("tested", "t triangle:int x:int y:int")
"""A ray's test of a triangle: t and the triangle, or infinity and -1; the ray's texel."""

LEAST = Record("least", "t spare:vec2 tests:int")
"""By blending, the least t of a ray's tests and how many they were."""

LOWEST = Record("lowest", "triangle:int")
"""By blending, the lowest triangle of those at the least t."""

STATE = Record("state", "phase:int steps:int")
"""What stands of a ray from pass to pass: the kernel that it waits for, by its number in the row
of the method, 0 where it is over, below 0 where it was stopped; and its kernel runs. All of it
where a method holds the rest in a single pass, or in other streams."""

LIST_STATE = Record("state", "cursor:int phase:int steps:int")
"""A STATE, and where a ray is in a list of triangles."""

TREE_STATE = Record("state", "node:int cursor:int phase:int steps:int")
"""A STATE, the node that comes next, and where a ray is in a leaf's triangles."""

KD_ENTERING, BVH_ENTERING = "entry:int root:int", "entry:int end:int"
"""Texels of rays that go through a list of subtrees: where they are in it; the node that the
present one begins at, or that comes behind it."""
