"""The records of kd-trees: nodes, bounds, leaves with ropes, and the states of rays."""
from __future__ import annotations

from ...gl.record import Record

KD_NODE = Record("kd_node", "split axis:int left:int count:int")
"""A node: plane; axis, or 3 plus a leaf's number; left child (the right one follows) or first
reference; references of a leaf, or which children are leaves without: 1 the left, 2 the right."""

KD_BOUNDS = Record("kd_bounds", "lo:vec3 parent:int | hi:vec3")
"""What kd-backtrack adds to a node: its box and its parent."""

KD_LEAF = Record("kd_leaf", "lo:vec3 rope_lo_x:int | hi:vec3 rope_hi_x:int "
                            "| rope_lo_y:int rope_hi_y:int rope_lo_z:int rope_hi_z:int")
"""What kd-ropes adds to a leaf, by its number: its box, and the node behind each face or -1."""

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
