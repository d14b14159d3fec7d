"""The order in which arrays of rays lie in their textures: those that are alike side by side.

A renderer runs neighbouring fragments together until the last of them is through, and they share
its caches. The survey (section 4.3) proposes to sort rays on the graphics hardware, which the
option ``sort_rays`` does (``passes/sorted_rays.py``); rays that come as arrays can be put in order
before they are uploaded, by the host.
"""
from __future__ import annotations

from functools import lru_cache

import numpy as np

from .texel_layout import NO_RAY
from .threads import threads

BLOCK = 8          # rays a side of a square, along whose Morton curve neighbours in the order lie
ROW = 1024         # rays in a row of the texture
CELL_BITS = 3      # an axis, of the scene's box: where a ray begins
WAY_BITS = 2       # an axis, of its direction, which comes first
AT_ONCE = 1 << 16  # rays whose keys are made at a time: they stay in a core's cache


class RayOrder:
    """Rays put in order.

    Parameters
    ----------
    planes : (textures, n, 4) float32, a texel of RAY_TEXELS each, directions below 1
    bounds : the scene's (lo, hi)

    Attributes
    ----------
    size : (width, height) of the textures that they lie in
    places : (n,) int, the texel of each ray, row by row
    """

    def __init__(self, planes: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]) -> None:
        count = planes.shape[1]
        across = max(1, min(ROW // BLOCK, -(-count // BLOCK ** 2)))
        self.size = (BLOCK * across, BLOCK * max(1, -(-count // (BLOCK ** 2 * across))))
        # A key and its ray as one number: numpy sorts these faster than it finds an order.
        keys = _keys(planes, bounds).astype(np.uint64) << np.uint64(32)
        keys |= np.arange(count, dtype=np.uint64)
        keys.sort()
        self._rays = (keys & np.uint64(0xffffffff)).astype(np.intp)
        self.places = np.empty(count, np.intp)
        self.places[self._rays] = _curve(self.size)[0][:count]

    def texels(self, planes: np.ndarray) -> np.ndarray:
        """(height, width, textures, 4) float32, the rays where they lie; empty ones elsewhere."""
        (width, height), count = self.size, len(self._rays)
        curve, rank = _curve(self.size)
        lies = self._rays[np.minimum(rank, count - 1)] if count else rank[:0]
        laid = np.empty((len(planes), width * height, 4), np.float32)

        def lay(texel: int) -> None:
            # A texel as one number of 16 bytes, which numpy moves faster than four of four.
            into, values = (part[texel].view(np.complex128)[:, 0] for part in (laid, planes))
            np.take(values, lies, out=into[:len(lies)])
            laid[texel, curve[count:]] = NO_RAY[texel]
        with threads(count) as run:
            list(run(lay, range(len(planes))))
        return laid.reshape(-1, height, width, 4).transpose(1, 2, 0, 3)


def _keys(planes: np.ndarray, bounds: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """(n,) uint16: the cell of a ray's direction, then that of its origin, along Morton curves."""
    (at, way), count = planes, planes.shape[1]
    lo, hi = (np.asarray(corner, np.float32) for corner in bounds)
    cells, ways = (1 << CELL_BITS), (1 << WAY_BITS)
    with np.errstate(all="ignore"):
        scale = np.float32(cells) / (hi - lo)
    keys = np.empty(count, np.uint16)

    def fill(first: int) -> None:
        part = slice(first, first + AT_ONCE)
        lattice = np.zeros(len(keys[part]), np.int32)
        for axis in range(3):
            with np.errstate(all="ignore"):    # a box without extent is some cell or other
                cell = (at[part, axis] - lo[axis]) * scale[axis]
                lattice |= _whole(cell, cells) << (CELL_BITS * axis)
                along = (way[part, axis] + np.float32(1)) * np.float32(ways / 2)
                lattice |= _whole(along, ways) << (3 * CELL_BITS + WAY_BITS * axis)
        np.take(_morton(), lattice, out=keys[part])
    with threads(count) as run:
        list(run(fill, range(0, count, AT_ONCE)))
    return keys


def _whole(values: np.ndarray, cells: int) -> np.ndarray:
    """(n,) int32, the cell that each lies in, the nearest one where it lies in none."""
    np.minimum(values, cells - 1, out=values)
    np.maximum(values, 0, out=values)
    return values.astype(np.int32) & (cells - 1)     # of what is no number too


@lru_cache(maxsize=None)
def _morton() -> np.ndarray:
    """(2^15,) uint16, the key of a place in both lattices, each x first."""
    lattice, key, low = np.arange(1 << 3 * (CELL_BITS + WAY_BITS)), 0, 0
    for bits in (CELL_BITS, WAY_BITS):
        for axis in range(3):
            for bit in range(bits):
                key |= (lattice >> (low + bits * axis + bit) & 1) << (low + 3 * bit + axis)
        low += 3 * bits
    return np.asarray(key, np.uint16)


@lru_cache(maxsize=4)
def _curve(size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Texels of a texture in order, square by square and along each one's curve; and the number
    that each has in it. (width * height,) int both."""
    width, height = size
    y, x = np.divmod(np.arange(width * height), width)
    inside = sum((x >> bit & 1) << 2 * bit | (y >> bit & 1) << 2 * bit + 1 for bit in range(3))
    rank = (y // BLOCK * (width // BLOCK) + x // BLOCK) * BLOCK ** 2 + inside
    texels = np.empty_like(rank)
    texels[rank] = np.arange(width * height)
    return texels, rank
