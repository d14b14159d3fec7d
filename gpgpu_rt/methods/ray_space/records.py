"""The records of the methods that sort rays: boxes of rays, beams, and their candidates."""
from __future__ import annotations

from ...gl.record import Record

RAY_BOX = Record("ray_box", "first:int")
"""A five-dimensional box of rays: its first candidate."""

CANDIDATE = Record("candidate", "triangle:int near")
"""A triangle that rays of a box may hit; -1 ends the list.

``near`` is the triangle's lowest coordinate along the rays' dominant axis, in their direction."""

BEAM = Record("beam", "first:int entries:int")
"""The rays of a cell of directions through a tile: the run of the entries that they may hit."""

BEAM_ENTRY = Record("beam_entry", "triangle:int near far reach")
"""A triangle in a beam; the entries of a beam are sorted by ``near``.

The triangle's extent along the beam's axis is from ``near`` to ``far``. ``reach`` is the largest
``far`` of this entry and all entries before it."""

RAY_CLASS = Record("ray_class", "box:int")
"""The five-dimensional box that a ray lies in; -1 if the ray misses the scene.

A number past the last box stands for a face of the direction cube."""

BEAM_STATE = Record("state", "first:int end:int low:int high:int | phase:int steps:int")
"""A ray's state: its beam's run of entries, and the range of the binary search.

The run is from `first` to `end`, the range from `low` to `high`. After the search, `low` is the
current entry."""
