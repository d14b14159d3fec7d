"""Cell walk: traverses a uniform grid on the host, for arrays of rays.

It does the float32 operations of glsl/methods/grid/grid.glsl in the same order, so a ray visits
the same cells as on the GPU.
"""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..grid.cells import Grid
from .octree import Octree

TINY_DIRECTION = np.float32(1e-20)
BOX_SLACK, SPACING = 64, 2     # bounds of rounding errors in roundoff units (glsl/core/slack.glsl)


class CellWalk:
    """The positions of n rays in a grid.

    Parameters
    ----------
    rays : origin and direction, (n, 3) float32, t_min and t_max, (n,) float32, as in RAY_TEXELS
    unit : roundoff unit of the arithmetic; scales the margin by which the grid's box is widened

    Attributes
    ----------
    key : (n,) int64, each ray's current cell
    nodes_visited : (n,) int32, the number of cells that each ray has visited
    listed : (cells,) int64, the number of triangles of each cell
    """

    def __init__(self, grid: Grid | Octree, rays: Mapping[str, np.ndarray], unit: float) -> None:
        self.grid = grid
        self.listed = np.diff(grid.cell_start.astype(np.int64))
        self.origin, self.direction = rays["origin"], rays["direction"]
        direction = self.direction
        count = len(self.origin)
        tiny = np.where(direction < 0, -TINY_DIRECTION, TINY_DIRECTION)
        self.inv_dir = np.float32(1) / np.where(np.abs(direction) < TINY_DIRECTION, tiny,
                                                direction)
        self.ahead = self.inv_dir > 0
        self.cell = np.zeros((count, 3), np.int64)
        self.key = np.zeros(count, np.int64)
        self.t_next = np.zeros((count, 3), np.float32)
        self.nodes_visited = np.zeros(count, np.int32)
        enter, leave = self._interval(np.float32(unit))
        self.t_enter = np.maximum(enter, rays["t_min"])
        self.t_exit = np.minimum(leave, rays["t_max"])
        self.strides = np.cumprod([1, *grid.resolution[:2]], dtype=np.int64)
        self.step = np.where(self.ahead, 1, -1)

    def _interval(self, unit: np.float32) -> tuple[np.ndarray, np.ndarray]:
        """Return the t, (n,) each, at which the rays enter and leave the grid's widened box."""
        o, lo, hi = self.origin, self.grid.lo, self.grid.hi
        reach = np.maximum(np.abs(lo - o), np.abs(hi - o)).max(axis=1, keepdims=True)
        slack = BOX_SLACK * unit * reach + SPACING * unit * np.abs(o)
        a = (lo - (o + slack)) * self.inv_dir
        b = (hi - (o - slack)) * self.inv_dir
        return np.minimum(a, b).max(axis=1), np.maximum(a, b).min(axis=1)

    def start(self, t_end: np.ndarray) -> np.ndarray:
        """Move every ray to its first cell with triangles. Return the rays with such a cell."""
        rays = np.flatnonzero(self.t_enter <= self.t_exit)
        grid, t = self.grid, self.t_enter[rays, None]
        at = (self.origin[rays] + t * self.direction[rays] - grid.lo) / grid.cell_size
        last = grid.resolution - 1
        # Clip before the conversion: values far outside the grid do not fit into an integer.
        cell = np.clip(np.floor(at), 0, last).astype(np.int64)
        self.cell[rays] = cell
        self.key[rays] = cell @ self.strides
        self.t_next[rays] = ((grid.lo + (cell + self.ahead[rays]).astype(np.float32)
                              * grid.cell_size) - self.origin[rays]) * self.inv_dir[rays]
        self.nodes_visited[rays] += 1
        some = self.listed[self.key[rays]] > 0
        return np.concatenate([rays[some], self.onward(rays[~some], t_end)])

    def onward(self, rays: np.ndarray, t_end: np.ndarray) -> np.ndarray:
        """Move rays to their next cell that lists triangles.

        Parameters
        ----------
        rays : (k,) int, the indices of the rays to move
        t_end : (n,) float32, the end of each ray's search: the t of its hit, or t_max

        Returns
        -------
        (j,) int, the indices of rays that reached such a cell; all other rays are finished
        """
        grid, found = self.grid, [rays[:0]]
        cell, t_next, inv_dir, origin, ahead, step = (a.reshape(-1) for a in (
            self.cell, self.t_next, self.inv_dir, self.origin, self.ahead, self.step))
        while len(rays):
            axis = self.t_next[rays].argmin(axis=1)
            at = 3 * rays + axis
            t_leave, moved = t_next[at], cell[at] + step[at]
            goes = ((moved >= 0) & (moved < grid.resolution[axis]) & (t_end[rays] >= t_leave)
                    & (t_leave < self.t_exit[rays]))
            rays, at, axis, moved = rays[goes], at[goes], axis[goes], moved[goes]
            cell[at] = moved
            self.key[rays] += step[at] * self.strides[axis]
            border = grid.lo[axis] + (moved + ahead[at]).astype(np.float32) * grid.cell_size[axis]
            t_next[at] = (border - origin[at]) * inv_dir[at]
            self.nodes_visited[rays] += 1
            some = self.listed[self.key[rays]] > 0
            found.append(rays[some])
            rays = rays[~some]
        return np.concatenate(found)
