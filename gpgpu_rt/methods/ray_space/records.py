"""The records of the methods that sort rays: boxes of rays, beams, and their candidates."""
from __future__ import annotations

from ...gl.record import Record

RAY_BOX = Record("ray_box", "first:int")
"""A finest cell of rays in five dimensions: the first candidate of its list."""

CANDIDATE = Record("candidate", "triangle:int near")
"""A triangle that rays of a box may hit. Triangle -1 ends the list.

``near`` is the triangle's lowest coordinate along the rays' dominant axis, with the sign that
makes the coordinate grow along the rays."""

BEAM = Record("beam", "first:int entries:int")
"""A beam: the lines through a tile whose directions are in the same cell. The record has the first
entry and the number of entries of the list of triangles that these lines may hit."""

BEAM_ENTRY = Record("beam_entry", "triangle:int near far reach")
"""A triangle in a beam. The entries of a beam are sorted by ``near``.

The triangle's extent along the beam's axis is from ``near`` to ``far``. ``reach`` is the largest
``far`` of the beam's entries up to this entry."""

RAY_CLASS = Record("ray_class", "box:int")
"""The five-dimensional box of a ray, or -1 if the ray misses the scene.

For a ray that begins too far from the scene, ``box`` is a number past the last box, and stands for
a face of the direction cube."""

BEAM_STATE = Record("state", "first:int end:int low:int high:int | phase:int steps:int")
"""A ray's state: its beam's entries from `first` to `end`, and the range of the binary search from
`low` to `high`. After the search, `low` is the current entry."""
