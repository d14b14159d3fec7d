"""The records of kd-trees: nodes, bounds, leaves with ropes, and the states of rays."""
from __future__ import annotations

from dataclasses import replace

from ...gl.record import Record
from ...traversal.records import PACKET_STATE, STATE

KD_NODE = Record("kd_node", "split axis:int left:pointer count:int")
"""A node of a kd-tree.

For an inner node, `split` is the coordinate of the split plane, and `axis` is 0, 1 or 2. `left` is
the left child, and the right child directly follows it. Bit 0 of `count` is set if the left child
is an empty leaf, and bit 1 if the right child is.

For a leaf, `left` is its first reference, and `count` is its number of references. The `axis` of
leaf number n is 3 + n. With marked lists (traversal/leaf_lists.py), the record has no `count`."""

KD_BOUNDS = Record("kd_bounds", "lo:vec3 parent:pointer | hi:vec3")
"""The box and the parent of a node, for kd-backtrack and ``entry_points``.

With ``entry_points``, the parent is not set, and faces on the scene's box lie at infinity."""

KD_LEAF = Record("kd_leaf", "lo:vec3 rope_lo_x:pointer | hi:vec3 rope_hi_x:pointer | rope_lo_y:"
                            "pointer rope_hi_y:pointer rope_lo_z:pointer rope_hi_z:pointer")
"""Data of leaf number n for kd-ropes: the leaf's box, and a rope for each face. A rope is the
node behind the face, or -1 if there is none."""

KD_STATE = Record("state", "t_min t_max t_exit node:pointer "
                           "| cursor:pointer end:pointer phase:int steps:int")
"""A ray's state: its interval (`t_min`, `t_max`) in the current `node`, and `t_exit`, where the
ray leaves the tree.

In a leaf, the references from `cursor` to `end` are still to be tested. With marked lists
(traversal/leaf_lists.py), `end` is left out."""

KD_PUSH_DOWN_STATE = KD_STATE.extended("pushed:pointer pushing:int")
"""KD_STATE, and `pushed`, the node to restart at. `pushing` is 1 while `pushed` may still move
down the tree."""

KD_SHORT_STACK_STATE = KD_STATE.extended(
    "pushed:int pushing:int stacked:int | stack_t_max:vec4 | stack_node:ivec4")
"""KD_PUSH_DOWN_STATE, and a stack of the far children that were pushed last, newest first.
`stacked` is the number of entries. For each entry, `stack_node` holds the far child, and
`stack_t_max` the end of the ray's interval in this child."""

KD_SHORT_STACK_ERA_STATE = replace(
    KD_STATE, layout="t_min t_max t_exit place:int | stack_t_max:vec3 phase:int "
                     "| stack_node:ivec3 pushed:int")
"""KD_SHORT_STACK_STATE in the era form (traversal/era.py), for at most three entries. Together
with a hit, this state fills the four render targets of a card.

``place`` is the node of a ray that descends. In a leaf, ``place`` is the cursor, and ``t_min`` is
the end of the leaf's list. In a free stack entry, ``stack_node`` is 0. While ``pushed`` may still
move down the tree, the stack is empty, and ``stack_node`` of its first entry is -1."""

KD_TEXTURE_STACK_STATE = KD_STATE.extended("far_t_max far:pointer stacked:int")
"""KD_STATE, the far child to push (`far`), the end of the ray's interval in this child
(`far_t_max`), and the number of stack entries (`stacked`)."""

KD_ROPES_PACKET_STATE = replace(
    PACKET_STATE, layout=PACKET_STATE.layout + " last:int from:int")
"""A packet's state: PACKET_STATE, the kernel that ran last (`last`), and the node where this
kernel ran (`from`)."""

KD_PACKET_STATE = KD_ROPES_PACKET_STATE.extended("needed:int pushed:int pushing:int")
"""KD_ROPES_PACKET_STATE, the vote of the rays (``needed``), and the restart (`pushed`, `pushing`)
as in KD_PUSH_DOWN_STATE.

Bit 0 of ``needed`` is set if a ray needs the near child, bit 1 if a ray needs the far child."""

KD_PACKET_STACK_STATE = replace(
    KD_PACKET_STATE, layout=KD_PACKET_STATE.layout + " popped:int | stack_node:ivec4")
"""KD_PACKET_STATE, and `stack_node`, the nodes on the short stack, newest first; 0: free entry.

``popped`` is the number of entries that the last kernel popped."""

KD_PACKET_RAY_STATE = replace(STATE, layout=STATE.layout + " t_min t_max", full_precision=True)
"""The state of a ray in a kd packet: its interval in the packet's node.

The schedule ``loop`` keeps the interval in float32 registers. The textures of ``step`` are float32
too, so that both schedules give the same hits."""

KD_PACKET_STACK_RAY_STATE = KD_PACKET_RAY_STATE.extended("stack_t_max:vec4")
"""KD_PACKET_RAY_STATE, and the ends of the ray's intervals on the packet's stack."""

KD_PACKET_ERA_STATE = Record("state", " | ".join((
    "t_min:vec4", "t_max:vec4", "t_exit:vec4", "t_turn:vec4", "negative:ivec3 phase:int",
    "place:int end:int pushed:int far:int", "node_0:int node_1:int node_2:int",
    "t_max_0:vec4", "t_max_1:vec4", "t_max_2:vec4", "t_far:vec4")))
"""A packet's state in the era form (traversal/era_packets.py), which a loop keeps in registers. A
vec4 has one number for each of the packet's four rays.

``place`` is the node of a packet that descends. In a leaf, ``place`` is the cursor, which runs up
to ``end``. A turn is a walk, from the root, of the rays of one direction octant. ``negative``
marks the axes along which their directions are negative. ``t_turn`` is the t_min of a ray that
waits for its turn.

The stack has the nodes ``node_0`` to ``node_2``, newest first. The rays' intervals in these nodes
end at ``t_max_0`` to ``t_max_2``. ``far`` is the node to push; the rays' intervals in it end at
``t_far``."""

KD_ROPES_PACKET_RAY_STATE = replace(
    STATE, layout=STATE.layout + " t_min ray_node:int", full_precision=True)
"""The state of a ray in a packet along ropes: the ray's position in the tree.

``t_min`` is in float32, for the reason given at KD_PACKET_RAY_STATE. ``ray_node`` is the ray's
node. It is 2^24 if the ray's search is over, or if the ray waits for its octant's turn
(``drivers/packet_turns.glsl``)."""
