"""The records of kd-trees: nodes, bounds, leaves with ropes, and the states of rays."""
from __future__ import annotations

from ...gl.record import Record

KD_NODE = Record("kd_node", "split axis:int left:int count:int")
"""A node of a kd-tree.

For an inner node, `split` is the coordinate of the split plane, and `axis` is 0, 1 or 2. `left` is
the left child, and the right child directly follows it. `count` tells which children are empty
leaves: bit 0 is set for an empty left leaf, and bit 1 for an empty right leaf.

For a leaf, `left` is its first reference, and `count` is its number of references. The `axis` of
leaf number n is 3 + n."""

KD_BOUNDS = Record("kd_bounds", "lo:vec3 parent:int | hi:vec3")
"""Data that kd-backtrack and entry points add to a node: its box and its parent."""

KD_LEAF = Record("kd_leaf", "lo:vec3 rope_lo_x:int | hi:vec3 rope_hi_x:int "
                            "| rope_lo_y:int rope_hi_y:int rope_lo_z:int rope_hi_z:int")
"""Data that kd-ropes adds to leaf number n: its box, and for each face of the box the node behind
this face, or -1."""

KD_STATE = Record("state", "t_min t_max t_exit node:int | cursor:int end:int phase:int steps:int")
"""A ray's state: its interval in the current node (`t_min`, `t_max`) and its exit from the tree.

The leaf's references from `cursor` to `end` are still to be tested."""

KD_PUSH_DOWN_STATE = KD_STATE.extended("pushed:int pushing:int")
"""KD_STATE, and `pushed`, the node to restart at. `pushing` is 1 while `pushed` may still move
down the tree."""

KD_SHORT_STACK_STATE = KD_STATE.extended(
    "pushed:int pushing:int stacked:int | stack_t_max:vec4 | stack_node:ivec4")
"""KD_PUSH_DOWN_STATE, and a stack of the far children that were pushed last, newest first.

`stacked` is the number of entries. `stack_t_max` and `stack_node` hold, for each entry, the end of
the far child's interval and the far child."""

KD_TEXTURE_STACK_STATE = KD_STATE.extended("far_t_max far:int stacked:int")
"""KD_STATE, the far child to push, the end of its interval, and the stack pointer `stacked`."""
