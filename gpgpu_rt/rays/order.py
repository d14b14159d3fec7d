"""Ray order: sorts arrays of rays so that similar rays lie side by side in their textures.

A renderer runs neighbouring fragments together until the last of them finishes. The survey
(section 4.3) proposes to sort rays on the graphics hardware, as the option ``sort_rays`` does
(``traversal/stages/sorted_rays.py``). This module sorts rays on the host, before their upload.
"""
from __future__ import annotations

from functools import lru_cache, partial
from itertools import product

import numpy as np

from ..accel.morton import morton_2d, morton_3d
from ..gl.precision import Precision
from ..threads import threads
from .records import NO_RAY, RAY_TEXELS

# Consecutive rays fill squares of this side along a Morton curve. The side equals 2^SQUARE_LOG2 of
# stages/sorted_place.glsl.
SQUARE = 8
ORIGIN_BITS = 3     # bits per axis for the cell of a ray's origin in the scene's box
# Number of codes of directions (`_direction_codes`). The direction comes first in the sort key:
# its octant, then the order of its components' sizes. So in most packets, all rays have the same
# signs and dominant axis. Other packets need several walks (drivers/packet_turns.glsl).
DIRECTIONS = 1 << 6
_GRAY = (0, 1, 3, 2, 6, 7, 5, 4)    # octants in Gray code order: neighbours differ in one sign
AT_ONCE = 1 << 16   # rays copied as a block, which fits in a core's cache
# Rays sorted as a block. Sorting each block by itself is faster, because a block stays in the
# cache (docs/notes/packet-speed.md). Consecutive rays of a picture start near each other, so a
# sort of all rays would gain little.
BLOCK = 1 << 17
# A block occupies a cell if a ray of the block starts there. Sort all rays together if a block
# occupies, on average, at least this share of the cells that all blocks together occupy.
SCATTERED = 0.75


class RayOrder:
    """Sorted rays. Rays with an empty interval are not sorted; one empty texel stands for them.

    Parameters
    ----------
    planes : (n, 4) float32 for each texel of RAY_TEXELS
    bounds : the scene's (lo, hi)
    precision : the precision of textures. Rounding may make t_min and t_max equal; the interval
        then contains one t, and its ray is sorted

    Attributes
    ----------
    count : the number of rays, n
    rays : (m,) int, the rays that are not empty, in sorted order
    size : (width, height) of the textures of the sorted rays
    """

    def __init__(self, planes: list[np.ndarray], bounds: tuple[np.ndarray, np.ndarray],
                 precision: Precision = Precision()) -> None:
        self.count, run = len(planes[0]), threads(len(planes[0]))
        found = list(run(partial(_live_keys, planes, precision=precision, bounds=bounds),
                         range(0, self.count, BLOCK)))
        live, empty, keys = ([part[k] for part in found] for k in range(3))
        if len(keys) > 1 and not _near_one_another(keys):
            live, keys = ([np.concatenate(each)] for each in (live, keys))
        self.rays, self._empty = _joined(list(run(self._sorted, live, keys))), _joined(empty)
        across, down = squares(len(self.rays) + (len(self._empty) > 0))
        self.size = (SQUARE * across, SQUARE * down)

    def _sorted(self, rays: np.ndarray, keys: np.ndarray) -> np.ndarray:
        order = np.argsort(keys, kind="stable")     # numpy uses a radix sort for 16 bits
        return order if len(rays) == self.count else rays[order]

    def planes(self, planes: list[np.ndarray]) -> list[np.ndarray]:
        """Return (width * height, 4) float32 per texel of RAY_TEXELS: sorted rays, then NO_RAY."""
        (width, height), count = self.size, len(self.rays)
        curve, rank = _curve(self.size)
        laid = [np.empty((width * height, 4), np.float32) for _ in planes]

        def lay(first: int) -> None:
            part = slice(first, first + AT_ONCE)
            lies = self.rays[np.minimum(rank[part], count - 1)]
            for values, into in zip(planes, laid):
                # "clip" lets numpy write directly to ``out``.
                np.take(_whole(values), lies, out=_whole(into)[part], mode="clip")
        if count:
            run = threads(count)
            list(run(lay, range(0, width * height, AT_ONCE)))
        for into, empty in zip(laid, NO_RAY):
            into[curve[count:]] = empty
        return laid

    def back(self, values: np.ndarray) -> np.ndarray:
        """Return (n, ...), the values of each ray in the caller's order. ``values`` are the texels
        of a texture, (texels, ...), row by row."""
        count, (curve, _) = len(self.rays), _curve(self.size)
        by_channel = values.ndim == 2 and values.flags.f_contiguous     # true for hits of packets
        found = np.empty((self.count, *values.shape[1:]), values.dtype, "F" if by_channel else "C")
        pairs = [(values, found)]
        if by_channel:
            pairs = list(zip(values.T, found.T))
        elif values.dtype == np.float32 and values.shape[1:] == (4,):
            pairs = [(_whole(np.ascontiguousarray(values)), _whole(found))]

        def bring(pair: tuple[np.ndarray, np.ndarray], first: int) -> None:
            (one, other), part = pair, slice(first, first + AT_ONCE)
            other[self.rays[part]] = one[curve[:count][part]]
            if first == 0 and len(self._empty):
                other[self._empty] = one[curve[count]]
        parts = range(0, max(count, 1), AT_ONCE)
        list(threads(len(found))(bring, *zip(*product(pairs, parts))))
        return found


def squares(rays: int) -> tuple[int, int]:
    """Return the numbers of squares across and down a nearly square texture for ``rays`` rays."""
    count = -(-rays // SQUARE ** 2)
    across = max(1, round(count ** 0.5))
    return across, max(1, -(-count // across))


def _live_keys(planes: list[np.ndarray], first: int, precision: Precision,
               bounds: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, ...]:
    """Return the rays of a block that are not empty, (m,) int; the empty rays, (k,) int; and the
    keys of the rays that are not empty, (m,) uint16.

    A key has the direction in its high bits, then the origin's cell along a Morton curve.
    """
    fields = RAY_TEXELS.unpack_planes([plane[first:first + BLOCK] for plane in planes])
    some = precision.stored(fields["t_min"]) <= precision.stored(fields["t_max"])
    live, empty = np.flatnonzero(some), np.flatnonzero(~some)
    lo, hi = (np.asarray(corner, np.float32) for corner in bounds)
    direction = RAY_TEXELS.field("direction")
    assert direction.channel == 0
    lattice = _direction_codes(planes[direction.texel][first:first + BLOCK]).view(np.int32)
    lattice <<= 3 * ORIGIN_BITS
    place, cell = np.empty(len(some), np.float32), np.empty(len(some), np.int32)
    with np.errstate(all="ignore"):     # in a box without extent, any cell will do
        for axis in range(3):
            np.subtract(fields["origin"][:, axis], lo[axis], out=place)
            place *= np.float32(1 << ORIGIN_BITS) / (hi - lo)[axis]
            np.copyto(cell, place, casting="unsafe")
            # An origin outside the box gets a wrong cell, which affects only the order.
            cell &= (1 << ORIGIN_BITS) - 1
            lattice |= np.left_shift(cell, ORIGIN_BITS * axis, out=cell)
    keys = np.take(_keys(), lattice[live] if len(empty) else lattice)
    return first + live, first + empty, keys


def _direction_codes(texels: np.ndarray) -> np.ndarray:
    """Return (n,) uint32 codes below DIRECTIONS. Their bits, from the lowest, mean x < 0,
    |x| >= |y|, |x| >= |z|, y < 0, |y| >= |z|, z < 0.

    texels : (n, 4) float32, directions in the first three channels
    """
    row = texels.reshape(-1)
    negative, size = row < 0, np.abs(row)
    next_less, second_less = np.zeros_like(negative), np.zeros_like(negative)
    np.greater_equal(size[:-1], size[1:], out=next_less[:-1])
    np.greater_equal(size[:-2], size[2:], out=second_less[:-2])
    # Each component has a byte with three flags. The mask drops the last channel's byte and all
    # comparisons with this channel: three bits of x, two of y and one of z remain.
    code = negative.view("<u4") | next_less.view("<u4") << 1 | second_less.view("<u4") << 2
    code &= 0x010307
    code *= 1 << 16 | 1 << 11 | 1 << 5      # gathers the bits of the three bytes from bit 16 up
    code >>= 16
    code &= DIRECTIONS - 1
    return code


def _near_one_another(keys: list[np.ndarray]) -> bool:
    """Return whether the rays of a block start near one another; see SCATTERED."""
    cells = np.zeros((len(keys), 1 << 3 * ORIGIN_BITS), bool)
    for held, each in zip(cells, keys):
        held[each[::8] & len(held) - 1] = True
    return cells.sum() < SCATTERED * len(keys) * cells.any(axis=0).sum()


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return parts[0] if len(parts) == 1 else np.concatenate([np.empty(0, np.intp), *parts])


def _whole(texels: np.ndarray) -> np.ndarray:
    """View (n, 4) float32 texels as (n,) complex128, which numpy moves faster than short rows."""
    return texels.view(np.complex128)[:, 0]


@lru_cache(maxsize=None)
def _keys() -> np.ndarray:
    """Return (2^15,) uint16 sort keys, indexed by direction code (high bits) and cell (low bits).

    Keys order rays by octant, then by the order of |x|, |y| and |z|, then along a Morton curve of
    origin cells.
    """
    place = np.arange(DIRECTIONS << 3 * ORIGIN_BITS)
    code, cell = np.divmod(place, 1 << 3 * ORIGIN_BITS)
    negative = code & 1 | code >> 2 & 2 | code >> 3 & 4
    over = code >> 1 & 1, code >> 2 & 1, code >> 4 & 1     # x over y, x over z, y over z
    # Number the six orders of |x|, |y|, |z| so that consecutive orders differ by a swap of two
    # neighbours. The largest components are then x, x, y, y, z, z.
    around = np.zeros(8, int)
    around[[3, 7, 6, 4, 0, 1]] = range(6)
    way = around[over[0] | over[1] << 1 | over[2] << 2]
    axes = (cell >> ORIGIN_BITS * axis & (1 << ORIGIN_BITS) - 1 for axis in range(3))
    return np.asarray((np.argsort(_GRAY)[negative] * 6 + way) << 3 * ORIGIN_BITS
                      | morton_3d(*axes), np.uint16)


@lru_cache(maxsize=1)
def _curve(size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the texels of a texture in curve order, and the rank of each texel in this order.

    Both are (width * height,) int32. Each square in turn is filled along a Morton curve.
    """
    width, height = size
    y, x = np.divmod(np.arange(width * height), width)
    rank = ((y // SQUARE * (width // SQUARE) + x // SQUARE) * SQUARE ** 2
            + morton_2d(y % SQUARE, x % SQUARE)).astype(np.int32)
    texels = np.empty_like(rank)
    texels[rank] = np.arange(width * height, dtype=np.int32)
    return texels, rank
