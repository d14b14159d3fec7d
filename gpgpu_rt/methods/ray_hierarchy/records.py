"""The records of the ray hierarchy."""
from __future__ import annotations

from ...gl.record import Record

CONE = Record("cone", "centre:vec3 radius | axis:vec3 chord | reach")
"""A node of the ray hierarchy: a sphere around the rays' origins and a cone of directions.

All lengths are in units of about the scene's size. ``chord`` is the largest distance between the
axis and a unit direction. ``reach`` is the farthest that a ray still searches, -1 for no ray."""

PAIR = Record("pair", "triangle:int x:int y:int")
"""A triangle and a node in a level of the hierarchy; triangle -1 marks an empty slot."""

CHILDREN = Record("children", "first:ivec3 | second:ivec3 | third:ivec3 | fourth:ivec3")
"""The result of testing a pair: a PAIR of the triangle and each of the node's four children."""

VISITS = Record("visits", "count:int")
"""The number of triangles that were tested against a node's children."""
