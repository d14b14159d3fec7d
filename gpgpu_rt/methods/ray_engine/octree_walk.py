"""Octree walk: traverses an octree on the host, for arrays of rays."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..grid.cells import Grid
from .cell_walk import CellWalk
from .octree import Octree


class OctreeWalk(CellWalk):
    """The positions of n rays in an octree, with the attributes of ``CellWalk``.

    Finest cells are the cells of the deepest level. A ray leaves a cell through a face, and enters
    the finest cell behind the exit point. Along the face, this finest cell is clamped to the old
    cell, so that rounding never skips a cell. A descent from the root then finds the octree's cell
    that contains the finest cell.
    """

    grid: Octree

    def __init__(self, grid: Octree, rays: Mapping[str, np.ndarray], unit: float) -> None:
        super().__init__(grid, rays, unit)
        self.span = np.ones(len(self.origin), np.int64)
        self.levels = int(grid.resolution[0]).bit_length() - 1

    def start(self, t_end: np.ndarray) -> np.ndarray:
        rays = np.flatnonzero(self.t_enter <= self.t_exit)
        finest = self._finest(rays, self.t_enter[rays])
        self._arrive(rays, np.clip(finest, 0, self.grid.resolution - 1).astype(np.int64))
        some = self.listed[self.key[rays]] > 0
        return np.concatenate([rays[some], self.onward(rays[~some], t_end)])

    def onward(self, rays: np.ndarray, t_end: np.ndarray) -> np.ndarray:
        found = [rays[:0]]
        while len(rays):
            axis = self.t_next[rays].argmin(axis=1)
            t_leave = self.t_next[rays, axis]
            low, span = self.cell[rays], self.span[rays]
            moved = np.where(self.ahead[rays, axis], low[np.arange(len(rays)), axis] + span,
                             low[np.arange(len(rays)), axis] - 1)
            goes = ((moved >= 0) & (moved < self.grid.resolution[0]) & (t_end[rays] >= t_leave)
                    & (t_leave < self.t_exit[rays]))
            rays, axis, moved, low, span = (a[goes] for a in (rays, axis, moved, low, span))
            place = np.clip(self._finest(rays, t_leave[goes]), low,
                            low + span[:, None] - 1).astype(np.int64)
            place[np.arange(len(rays)), axis] = moved
            self._arrive(rays, place)
            some = self.listed[self.key[rays]] > 0
            found.append(rays[some])
            rays = rays[~some]
        return np.concatenate(found)

    def _finest(self, rays: np.ndarray, t: np.ndarray) -> np.ndarray:
        """Return the finest cells that contain the rays' points at t, (k, 3) float32."""
        at = self.origin[rays] + t[:, None] * self.direction[rays]
        return np.floor((at - self.grid.lo) / self.grid.cell_size)

    def _arrive(self, rays: np.ndarray, place: np.ndarray) -> None:
        """Move rays to the cells that contain the finest cells ``place``, (k, 3) int64."""
        grid, node = self.grid, np.zeros(len(rays), np.int64)
        child = grid.child[node]
        for level in range(self.levels):
            down = np.flatnonzero(child >= 0)
            if len(down) == 0:
                break
            halves = place[down] >> (self.levels - 1 - level) & 1
            child[down] = grid.child[child[down] + halves @ (1, 2, 4)]
        key = (-1 - child).astype(np.int64)
        self.key[rays] = key
        self.cell[rays], self.span[rays] = grid.corner[key], grid.span[key]
        self.nodes_visited[rays] += 1
        border = grid.corner[key] + np.where(self.ahead[rays], grid.span[key, None], 0)
        self.t_next[rays] = ((grid.lo + border.astype(np.float32) * grid.cell_size)
                             - self.origin[rays]) * self.inv_dir[rays]


def cell_walk(cells: Grid | Octree, rays: Mapping[str, np.ndarray], unit: float) -> CellWalk:
    """Return the walk of rays through a grid or an octree; see ``CellWalk``."""
    return (OctreeWalk if isinstance(cells, Octree) else CellWalk)(cells, rays, unit)
