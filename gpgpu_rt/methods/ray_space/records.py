"""The records of the methods that sort rays: boxes and beams of rays, and their candidates."""
from __future__ import annotations

from ...gl.record import Record

RAY_BOX = Record("ray_box", "first:int")
"""A five-dimensional box of rays: the first of its candidates."""

CANDIDATE = Record("candidate", "triangle:int near")
"""A triangle that rays of a box may hit, -1 behind the last; where it begins along their dominant
axis, counted the way they go."""

BEAM = Record("beam", "first:int entries:int")
"""Rays of a cell of directions through a tile: the run of what they may cross."""

BEAM_ENTRY = Record("beam_entry", "triangle:int near far reach")
"""A triangle in a beam, by where it begins along the beam's axis; where it ends, and where the
last one of those up to it does."""

RAY_CLASS = Record("ray_class", "box:int")
"""The five-dimensional box that a ray lies in; behind the boxes, its face; or -1, a miss."""

BEAM_STATE = Record("state", "first:int end:int low:int high:int | phase:int steps:int")
"""A STATE, the run of a ray's beam, and of what is left of it the part that is searched."""
