"""The records of uniform grids: a cell, and the state of a ray that walks cells."""
from __future__ import annotations

from ...gl.record import Record

GRID_CELL = Record("grid_cell", "first:pointer")
"""A cell: its first reference, or a negative number if the cell is empty.

The negative number is -1 or, with proximity clouds, minus the distance in cells to the nearest
occupied cell."""

GRID_STATE = Record("state", "cell:ivec3 t_enter | t_next:vec3 t_exit "
                             "| cursor:pointer phase:int steps:int")
"""A ray's state: its current `cell`, the t at which it enters this cell (`t_enter`), and the t at
which it leaves the grid (`t_exit`).

`t_next` has, for each axis, the t at which the ray crosses into the next cell. `cursor` is the
next entry of the cell's list."""
