"""The records of bounding volume hierarchies: nodes, and the states of rays and packets."""
from __future__ import annotations

from dataclasses import replace

from ...gl.packed_record import PackedRecord
from ...gl.record import Record
from ...rays.records import COUNTERS
from ...traversal.records import PACKET_STATE

BVH_NODE = Record("bvh_node", "lo:vec3 escape:pointer | hi:vec3 first:pointer")
"""A threaded node: its box, its escape index, and a leaf's first triangle.

The escape index is the next node after the node's subtree; -1 ends the traversal. ``first`` is -1
for an inner node. In octant copies without shared subtrees, ``lo`` is the corner that the octant's
rays reach first.

A portal (octant_copies.py) has ``first`` = -2 - s, where s is the first node of the shared
subtree. In a shared subtree, the escape index -1 leads to the node after the portal.
"""

BVH_PAIR = Record("bvh_pair", "left_lo:vec3 left:int | left_hi:vec3 | right_lo:vec3 right:int "
                              "| right_hi:vec3")
"""An inner node with the boxes of its children.

``left`` and ``right`` are indices of inner nodes, or -1 - f for a leaf whose first triangle is f.
"""

_LINK = "target:29 portal:1 last:1 leaf:1"

QUANTISED_NODE_16 = PackedRecord(
    "quantised_node", "lo_x:16 hi_x:16 | lo_y:16 hi_y:16 | lo_z:16 hi_z:16 | " + _LINK)

QUANTISED_NODE_8 = PackedRecord(
    "quantised_node", "lo_x:8 hi_x:8 lo_y:8 hi_y:8 | lo_z:8 hi_z:8 | " + _LINK)
"""A threaded node in one integer texel. The bounds of its box are counted in equal steps from the
scene's lower corner, and rounded outward.

``target`` is an inner node's escape index, a leaf's first triangle, or a portal's first shared
node. ``last`` marks an escape index of -1. A leaf or portal without ``last`` leads to the next
node of the table."""

_LINKS = "left:31 left_leaf:1 | right:31 right_leaf:1"

QUANTISED_PAIR_16 = PackedRecord(
    "quantised_pair", "left_lo_x:16 left_hi_x:16 | left_lo_y:16 left_hi_y:16 "
                      "| left_lo_z:16 left_hi_z:16 | right_lo_x:16 right_hi_x:16 "
                      "| right_lo_y:16 right_hi_y:16 | right_lo_z:16 right_hi_z:16 | " + _LINKS)

QUANTISED_PAIR_8 = PackedRecord(
    "quantised_pair", "left_lo_x:8 left_hi_x:8 left_lo_y:8 left_hi_y:8 "
                      "| right_lo_x:8 right_hi_x:8 right_lo_y:8 right_hi_y:8 "
                      "| left_lo_z:8 left_hi_z:8 right_lo_z:8 right_hi_z:8 | " + _LINKS)
"""An inner node with the boxes of its children, rounded as in QUANTISED_NODE_8.

``left`` is an inner node, or a leaf's first triangle if ``left_leaf`` is set; ``right`` alike."""

QUEUED = Record("queued", "child:int x:int y:int t_enter")
"""A stream element: a node ``child`` (coded as ``left`` of BVH_PAIR), a ray's texel, and the t at
which the ray enters the node."""

VISITED = Record("visited", "near:int near_t far:int far_t | x:int y:int")
"""A ray's visit to a node: the nearer and the farther child that the ray enters, the t at which it
enters each, and the ray's texel."""

MET = Record("met", "u v tests:int")
"""A ray's result in a leaf, in addition to TESTED: barycentric u and v of the nearest hit, and the
number of tested triangles."""

TALLY = Record("tally", COUNTERS.layout)
"""A ray's counters so far, summed by blending."""

SHARED_WAY_OUT = "after:int"
"""An additional field of states: the node after the present shared subtree's portal; -1 outside
shared subtrees."""

PACKET_SHARED_STATE = replace(PACKET_STATE, layout=f"{PACKET_STATE.layout} {SHARED_WAY_OUT}")
"""A packet's state with shared subtrees: PACKET_STATE and SHARED_WAY_OUT."""

PACKET_STACK_STATE = replace(
    PACKET_STATE, layout=PACKET_STATE.layout + " far:int stacked:int | far_t_max")
"""The state of a packet with a stack: PACKET_STATE, the child to push (``far``), and the stack
pointer ``stacked``. ``far_t_max`` is always 0; drivers/push.frag, which kd-trees also use, reads
it."""
