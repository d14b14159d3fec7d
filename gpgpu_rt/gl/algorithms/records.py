"""The records of scan, sort and reduction."""
from __future__ import annotations

from ..record import Record

VALUES = Record("values", "value:vec4")
"""Four numbers per element."""

SORT_KEY = Record("sort_key", "hi:int lo:int index:int")
"""A sort key, ordered by hi and lo (integers of up to 24 bits), then index."""

SOURCE = Record("source", "index:int")
"""The index of the element to copy."""

BOX = Record("box", "lo:vec3 | hi:vec3")
"""The bounding box of a triangle, a node, a cell or successive slots. A slot is a position in a
builder's order of triangles."""
