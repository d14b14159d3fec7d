"""THE declaration of the states of methods: stream records, as in texel_layout.py.

They hold what stands of a ray or a packet from pass to pass, besides its HIT.
"""
from __future__ import annotations

from dataclasses import replace

from .record import Record

STATE = Record("state", "phase:int steps:int")
"""What stands of a ray from pass to pass: the kernel that it waits for, by its number in the row
of the method, 0 where it is over, below 0 where it was stopped; and its kernel runs. All of it
where a method holds the rest in a single pass, or in other streams."""

LIST_STATE = Record("state", "cursor:int phase:int steps:int")
"""A STATE, and where a ray is in a list of triangles."""

BEAM_STATE = Record("state", "first:int end:int low:int high:int | phase:int steps:int")
"""A STATE, the run of a ray's beam, and of what is left of it the part that is searched."""

GRID_STATE = Record("state", "cell:ivec3 t_enter | t_next:vec3 t_exit "
                             "| cursor:int phase:int steps:int")
"""A STATE, the cell that a ray is in, where it enters and leaves that and by axis crosses into the
next ones, and where it is in the cell's list."""

TREE_STATE = Record("state", "node:int cursor:int phase:int steps:int")
"""A STATE, the node that comes next, and where a ray is in a leaf's triangles."""

BIH_STATE = Record("state", "t_min t_max node:int cursor:int | phase:int steps:int")
"""The same, and the interval of a ray in its node."""

KD_STATE = Record("state", "t_min t_max t_exit node:int | cursor:int end:int phase:int steps:int")
"""A STATE, a ray's interval in its node and in the whole tree, and what is left of a leaf's
references."""

KD_PUSH_DOWN_STATE = KD_STATE.extended("pushed:int pushing:int")
"""And the node to restart at; 1 while that may still move down."""

KD_SHORT_STACK_STATE = KD_STATE.extended(
    "pushed:int pushing:int stacked:int | stack_t_max:vec4 | stack_node:ivec4")
"""And the last far children put away, newest first: how many, where their intervals end, and which
they are."""

KD_TEXTURE_STACK_STATE = KD_STATE.extended("far_t_max far:int stacked:int")
"""And the far child that a push puts away, where its interval ends; the stack's pointer."""

KD_ENTERING, BVH_ENTERING = "entry:int root:int", "entry:int end:int"
"""Texels of rays that go through a list of subtrees: where they are in it; the node that the
present one begins at, or that comes behind it."""

PACKET_STATE = Record("state", "node:int cursor:int phase:int steps:int | turn:int turns:int")
"""Of a packet: a TREE_STATE, the octant of directions whose rays go through the tree together, and
a bit for each whose rays are still to come."""

SHARED_WAY_OUT = "after:int"
"""Of a walk where octants share subtrees: the node behind the one that it is in, -1 outside."""

PACKET_SHARED_STATE = replace(PACKET_STATE, layout=f"{PACKET_STATE.layout} {SHARED_WAY_OUT}")
PACKET_STACK_STATE = replace(
    PACKET_STATE, layout=PACKET_STATE.layout + " far:int stacked:int | far_t_max")
"""And of a packet with a stack what KD_TEXTURE_STACK_STATE has."""
