"""Tile bounds: computes bounds of the rays in each tile of the ray textures.

A tile need not be drawn if it has no live ray, or if all its rays miss the scene.
"""
from __future__ import annotations

import numpy as np

SIDE = 8    # side of the smallest tiles, in rays


class TileBounds:
    """The bounds of the live rays in each tile. A ray is live if its interval is not empty.

    Parameters
    ----------
    size : (width, height) of the ray textures
    side : side of a tile in rays, a multiple of SIDE

    Attributes
    ----------
    size : (across, down) number of tiles
    live : (down, across) bool, whether the tile has a live ray
    least, most : (down, across, 3) float32, smallest and largest components of the directions of
        live rays; undefined if the tile has no live ray, or if rays have different starts (origin
        and t_min)
    """

    def __init__(self, size: tuple[int, int], side: int = SIDE) -> None:
        self.side = side
        self.size = (-(-size[0] // side), -(-size[1] // side))
        self.live = np.zeros(self.size[::-1], bool)
        self.least = np.empty((*self.size[::-1], 3), np.float32)
        self.most = np.empty_like(self.least)

    def see(self, first: int, planes: list[np.ndarray], start: np.ndarray | None) -> None:
        """Compute the bounds of the tiles in some rows of rays.

        Parameters
        ----------
        first : the number of the first row in the textures, a multiple of the tile's side
        planes : (rows, width, 4) float32 each, rays in the layout of RAY_TEXELS
        start : (4,) float32, the origin and t_min that all these rays share, or None
        """
        along = planes[1]
        rows = slice(first // self.side, -(-(first + len(along)) // self.side))
        if start is None:
            self.live[rows] = self._joined(np.logical_or, planes[0][:, :, 3] <= along[:, :, 3])
            return
        # The fourth component is t_max. Bounds of t_max show which tiles have live rays.
        least, most = (self._joined(op, along) for op in (np.minimum, np.maximum))
        self.live[rows] = start[3] <= most[:, :, 3]
        if not (start[3] <= least[:, :, 3]).all():      # exclude empty rays from the bounds
            live = start[3] <= along[:, :, 3, None]
            least = self._joined(np.minimum, np.where(live, along, np.float32(np.inf)))
            most = self._joined(np.maximum, np.where(live, along, np.float32(-np.inf)))
        self.least[rows], self.most[rows] = least[:, :, :3], most[:, :, :3]

    def _joined(self, op: np.ufunc, values: np.ndarray) -> np.ndarray:
        """Reduce values (rows, columns, ...) to (tiles down, tiles across, ...) with ``op``."""
        rows, columns = (n // self.side * self.side for n in values.shape[:2])
        found = op.reduce(values[:rows].reshape(-1, self.side, *values.shape[1:]), axis=1)
        if rows < len(values):
            found = np.concatenate([found, op.reduce(values[rows:], axis=0)[None]])
        part = found[:, :columns].reshape(len(found), -1, self.side, *values.shape[2:])
        while part.shape[2] > 1:    # combine halves: numpy reduces short axes slowly
            part = op(part[:, :, :part.shape[2] // 2], part[:, :, part.shape[2] // 2:])
        if columns == values.shape[1]:
            return part[:, :, 0]
        return np.concatenate([part[:, :, 0], op.reduce(found[:, columns:], axis=1)[:, None]], 1)

    def of_side(self, side: int) -> TileBounds:
        """Return the bounds of larger tiles; ``side`` is a multiple of this object's side."""
        times = side // self.side
        if times == 1:
            return self
        size = (self.size[0] * self.side, self.size[1] * self.side)
        found, joint = TileBounds(size, side), TileBounds(self.size, times)
        found.live = joint._joined(np.logical_or, self.live)
        empty = None if self.live.all() else ~self.live
        for op, end, name in ((np.minimum, np.inf, "least"), (np.maximum, -np.inf, "most")):
            values = getattr(self, name)
            if empty is not None:
                values = values.copy()
                values[empty] = end
            setattr(found, name, joint._joined(op, values))
        return found
