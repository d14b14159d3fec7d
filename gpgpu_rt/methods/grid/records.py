"""The records of uniform grids: a cell, and the state of a ray that walks cells."""
from __future__ import annotations

from ...gl.record import Record

GRID_CELL = Record("grid_cell", "first:int")
"""A cell: its first reference, or minus the cells to the nearest occupied one if it is empty (-1
says no more than that it is)."""

GRID_STATE = Record("state", "cell:ivec3 t_enter | t_next:vec3 t_exit "
                             "| cursor:int phase:int steps:int")
"""A STATE, the cell that a ray is in, where it enters and leaves that and by axis crosses into the
next ones, and where it is in the cell's list."""
