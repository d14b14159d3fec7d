"""The records of the methods that sort rays: boxes of rays, beams, and their candidates."""
from __future__ import annotations

from ...gl.record import Record

RAY_BOX = Record("ray_box", "first:int")
"""A finest cell of rays, or a face of the direction cube (ray_boxes.py). ``first`` is the first
candidate in its list."""

CANDIDATE = Record("candidate", "triangle:int near")
"""A triangle that rays of a box may hit. Triangle -1 ends the list.

``near`` is the triangle's lowest coordinate along the rays' dominant axis. The axis is negated if
the rays run in its negative direction."""

BEAM = Record("beam", "first:int entries:int")
"""A beam: all lines that have a direction in one cell and cross one tile (visibility_field.py).
The list of triangles that these lines may hit begins at ``first`` and has ``entries`` entries."""

BEAM_ENTRY = Record("beam_entry", "triangle:int near far reach")
"""A triangle in a beam. The entries of a beam are sorted by ``near``.

The triangle's extent along the beam's axis is from ``near`` to ``far``. ``reach`` is the largest
``far`` of the beam's entries up to this entry."""

RAY_CLASS = Record("ray_class", "box:int")
"""The five-dimensional box of a ray, or -1 if the ray misses the scene.

For a ray that begins too far from the scene, ``box`` is the number of boxes plus the number of a
face of the direction cube."""

BEAM_STATE = Record("state", "first:int end:int low:int high:int | phase:int steps:int")
"""A ray's state. Its beam has the entries from `first` to `end`. The binary search examines the
range from `low` to `high`; after the search, `low` is the current entry."""
