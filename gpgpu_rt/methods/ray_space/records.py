"""The records of the methods that sort rays: boxes of rays, beams, and their candidates."""
from __future__ import annotations

from ...gl.record import Record

RAY_BOX = Record("ray_box", "first:int")
"""A finest cell of rays in five dimensions: the first candidate of the list that the cell's rays
use."""

CANDIDATE = Record("candidate", "triangle:int near")
"""A triangle that rays of a box may hit. Triangle -1 ends the list.

``near`` is the triangle's lowest coordinate along the rays' dominant axis. This coordinate grows
in the direction of the rays."""

BEAM = Record("beam", "first:int entries:int")
"""A beam: the lines through a tile whose directions are in the same cell. The beam lists the
triangles that these lines may hit. The record has the list's first entry and number of entries."""

BEAM_ENTRY = Record("beam_entry", "triangle:int near far reach")
"""A triangle in a beam. The entries of a beam are sorted by ``near``.

The triangle's extent along the beam's axis is from ``near`` to ``far``. ``reach`` is the largest
``far`` of this entry and all entries of the beam before it."""

RAY_CLASS = Record("ray_class", "box:int")
"""The five-dimensional box of a ray, or -1 if the ray misses the scene.

A ray that begins too far from the scene is in no box. Its ``box`` is a number past the last box,
and stands for a face of the direction cube."""

BEAM_STATE = Record("state", "first:int end:int low:int high:int | phase:int steps:int")
"""A ray's state: the entries of its beam, and the range of the binary search.

The beam's entries go from `first` to `end`. The search is between `low` and `high`. After the
search, `low` is the current entry."""
