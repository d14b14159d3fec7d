"""The records of bounding volume hierarchies: nodes, and the states of rays and packets."""
from __future__ import annotations

from dataclasses import replace

from ...gl.record import PackedRecord, Record
from ...rays.records import COUNTERS

BVH_NODE = Record("bvh_node", "lo:vec3 escape:int | hi:vec3 first:int")
"""A threaded node: box, escape index (-1 ends), first triangle of a leaf or -1.

Octant copies have the corner a ray meets first in ``lo``, unless they share subtrees: a portal's
``first`` is -2 less the node below, from where an escape index of -1 leads to behind it.
"""

BVH_PAIR = Record("bvh_pair", "left_lo:vec3 left:int | left_hi:vec3 | right_lo:vec3 right:int "
                              "| right_hi:vec3")
"""An inner node with its children's boxes; a child is an inner node, or -1 minus the first
triangle of a leaf."""

_LINK = "target:29 portal:1 last:1 leaf:1"

QUANTISED_NODE_16 = PackedRecord(
    "quantised_node", "lo_x:16 hi_x:16 | lo_y:16 hi_y:16 | lo_z:16 hi_z:16 | " + _LINK)

QUANTISED_NODE_8 = PackedRecord(
    "quantised_node", "lo_x:8 hi_x:8 lo_y:8 hi_y:8 | lo_z:8 hi_z:8 | " + _LINK)
"""A threaded node in one integer texel: bounds in steps of the scene's box, rounded outward;
``target`` is a leaf's first triangle, a portal's first shared node (of both the escape index is
the next node) or an inner node's escape index; ``last`` marks a node with none."""

_LINKS = "left:31 left_leaf:1 | right:31 right_leaf:1"

QUANTISED_PAIR_16 = PackedRecord(
    "quantised_pair", "left_lo_x:16 left_hi_x:16 | left_lo_y:16 left_hi_y:16 "
                      "| left_lo_z:16 left_hi_z:16 | right_lo_x:16 right_hi_x:16 "
                      "| right_lo_y:16 right_hi_y:16 | right_lo_z:16 right_hi_z:16 | " + _LINKS)

QUANTISED_PAIR_8 = PackedRecord(
    "quantised_pair", "left_lo_x:8 left_hi_x:8 left_lo_y:8 left_hi_y:8 "
                      "| right_lo_x:8 right_hi_x:8 right_lo_y:8 right_hi_y:8 "
                      "| left_lo_z:8 left_hi_z:8 right_lo_z:8 right_hi_z:8 | " + _LINKS)
"""An inner node with its children's boxes in steps of the scene's box, rounded outward; a child is
an inner node, or a leaf's first triangle."""

QUEUED = Record("queued", "child:int x:int y:int t_enter")
"""A ray, by its texel, and a node that it is in, as children of BVH_PAIR; where it enters it."""

VISITED = Record("visited", "near:int near_t far:int far_t | x:int y:int")
"""What a ray finds at a node: the children that it is in and where it enters them; its texel."""

MET = Record("met", "u v tests:int")
"""More of a TESTED leaf: where on the nearest triangle, and how many were tested."""

TALLY = Record("tally", COUNTERS.layout)
"""By blending, what a ray did so far."""

PACKET_STATE = Record("state", "node:int cursor:int phase:int steps:int | turn:int turns:int")
"""Of a packet: a TREE_STATE, the octant of directions whose rays go through the tree together, and
a bit for each whose rays are still to come."""

SHARED_WAY_OUT = "after:int"
"""The node behind the shared subtree that a walk is in; -1 outside shared subtrees."""

PACKET_SHARED_STATE = replace(PACKET_STATE, layout=f"{PACKET_STATE.layout} {SHARED_WAY_OUT}")

PACKET_STACK_STATE = replace(
    PACKET_STATE, layout=PACKET_STATE.layout + " far:int stacked:int | far_t_max")
"""And of a packet with a stack what KD_TEXTURE_STACK_STATE has."""
