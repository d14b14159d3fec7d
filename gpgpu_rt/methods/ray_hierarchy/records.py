"""The records of the hierarchy over rays."""
from __future__ import annotations

from ...gl.record import Record

CONE = Record("cone", "centre:vec3 radius | axis:vec3 chord | reach")
"""A node over rays: a sphere around their origins, all lengths in units of about the scene's size;
an axis and how far unit directions lie from it at most; how far the rays go, or -1 where none is
left."""

PAIR = Record("pair", "triangle:int x:int y:int")
"""A triangle and a node of a level of the hierarchy; triangle -1 where the slot is empty."""

CHILDREN = Record("children", "first:ivec3 | second:ivec3 | third:ivec3 | fourth:ivec3")
"""What became of a pair: the triangle with each of the node's children, as a PAIR."""

VISITS = Record("visits", "count:int")
"""How often a node was met with a triangle."""
