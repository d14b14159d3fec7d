"""The records of bounding volume hierarchies: nodes, and the states of rays and packets."""
from __future__ import annotations

from dataclasses import replace

from ...gl.record import PackedRecord, Record
from ...rays.records import COUNTERS
from ...traversal.records import PACKET_STATE

BVH_NODE = Record("bvh_node", "lo:vec3 escape:int | hi:vec3 first:int")
"""A threaded node: its box, escape index (-1 ends the traversal) and a leaf's first triangle.

``first`` is -1 for an inner node. In octant copies without shared subtrees, ``lo`` is the corner
that the rays of the octant reach first. In copies with shared subtrees, a portal's ``first`` is
-2 - s, where s is the first shared node below the portal. An escape index of -1 in a shared
subtree leads to the node after the portal.
"""

BVH_PAIR = Record("bvh_pair", "left_lo:vec3 left:int | left_hi:vec3 | right_lo:vec3 right:int "
                              "| right_hi:vec3")
"""An inner node with its children's boxes.

A child is the index of an inner node, or -1 - f for a leaf whose first triangle is f."""

_LINK = "target:29 portal:1 last:1 leaf:1"

QUANTISED_NODE_16 = PackedRecord(
    "quantised_node", "lo_x:16 hi_x:16 | lo_y:16 hi_y:16 | lo_z:16 hi_z:16 | " + _LINK)

QUANTISED_NODE_8 = PackedRecord(
    "quantised_node", "lo_x:8 hi_x:8 lo_y:8 hi_y:8 | lo_z:8 hi_z:8 | " + _LINK)
"""A threaded node in one integer texel, with bounds in steps of the scene's box, rounded outward.

``target`` is a leaf's first triangle, a portal's first shared node, or another inner node's
escape index. The escape index of leaves and portals is the next node. ``last`` marks a node
without an escape index."""

_LINKS = "left:31 left_leaf:1 | right:31 right_leaf:1"

QUANTISED_PAIR_16 = PackedRecord(
    "quantised_pair", "left_lo_x:16 left_hi_x:16 | left_lo_y:16 left_hi_y:16 "
                      "| left_lo_z:16 left_hi_z:16 | right_lo_x:16 right_hi_x:16 "
                      "| right_lo_y:16 right_hi_y:16 | right_lo_z:16 right_hi_z:16 | " + _LINKS)

QUANTISED_PAIR_8 = PackedRecord(
    "quantised_pair", "left_lo_x:8 left_hi_x:8 left_lo_y:8 left_hi_y:8 "
                      "| right_lo_x:8 right_hi_x:8 right_lo_y:8 right_hi_y:8 "
                      "| left_lo_z:8 left_hi_z:8 right_lo_z:8 right_hi_z:8 | " + _LINKS)
"""An inner node with its children's boxes in steps of the scene's box, rounded outward.

A child is the index of an inner node, or a leaf's first triangle."""

QUEUED = Record("queued", "child:int x:int y:int t_enter")
"""A stream element: a ray's texel, a node (coded as the children of BVH_PAIR), and the entry t."""

VISITED = Record("visited", "near:int near_t far:int far_t | x:int y:int")
"""The result of a ray at a node: the children that it enters, with their entry t; its texel."""

MET = Record("met", "u v tests:int")
"""More data of a TESTED leaf: barycentric u, v of the nearest hit, and the number of tests."""

TALLY = Record("tally", COUNTERS.layout)
"""A ray's counters so far, summed by blending."""

SHARED_WAY_OUT = "after:int"
"""The node after the shared subtree that the ray is in; -1 outside shared subtrees."""

PACKET_SHARED_STATE = replace(PACKET_STATE, layout=f"{PACKET_STATE.layout} {SHARED_WAY_OUT}")

PACKET_STACK_STATE = replace(
    PACKET_STATE, layout=PACKET_STATE.layout + " far:int stacked:int | far_t_max")
"""A packet's state with a stack: PACKET_STATE, and the stack fields of KD_TEXTURE_STACK_STATE."""
