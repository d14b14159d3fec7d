"""The records of the ray hierarchy."""
from __future__ import annotations

from ...gl.record import Record

CONE = Record("cone", "centre:vec3 radius | axis:vec3 chord | reach")
"""A node of the ray hierarchy: a sphere around the rays' origins and a cone of directions.

The sphere has ``centre`` and ``radius``. ``chord`` is the largest distance between the unit vector
``axis`` and a ray's unit direction. ``reach`` is the largest distance to which a ray still
searches, or -1 if the node has no ray. Lengths are scaled: the scene's size is about 1."""

PAIR = Record("pair", "triangle:int x:int y:int")
"""A triangle and a node, at (x, y) of a level's texture. Triangle -1 marks an empty element."""

CHILDREN = Record("children", "first:ivec3 | second:ivec3 | third:ivec3 | fourth:ivec3")
"""The result of testing a PAIR: a PAIR for each of the node's four children, with triangle -1 if
no ray of the child can hit the triangle."""

VISITS = Record("visits", "count:int")
"""The number of triangles tested against a node's children."""
