"""The records of scan, sort and reduction."""
from __future__ import annotations

from ..record import Record

VALUES = Record("values", "value:vec4")
"""Four numbers an element: what is reduced, scanned or flagged."""

SORT_KEY = Record("sort_key", "hi:int lo:int index:int")
"""A key of two numbers, up to 24 bits each, and what it belongs to; sorted in this order."""

SOURCE = Record("source", "index:int")
"""The element that one is taken from."""

BOX = Record("box", "lo:vec3 | hi:vec3")
"""A box: of a triangle, of a run of slots or of a node."""
