"""The order in which arrays of rays lie in their textures: those that are alike side by side.

A renderer runs neighbouring fragments together until the last of them is through, and they share
its caches. The survey (section 4.3) proposes to sort rays on the graphics hardware, which the
option ``sort_rays`` does (``traversal/stages/sorted_rays.py``); rays that come as
arrays can be put in order before they are uploaded, by the host.
"""
from __future__ import annotations

from functools import lru_cache, partial
from itertools import product

import numpy as np

from ..accel.morton import morton_2d, morton_3d
from ..gl.precision import Precision
from ..threads import threads
from .records import NO_RAY, RAY_TEXELS

# Rays a side of a square, along whose Morton curve neighbours in order lie: 2^SQUARE_LOG2 of
# stages/sorted_place.glsl.
SQUARE = 8
ORIGIN_BITS = 3     # an axis, of the scene's box: the cell in which a ray begins
# Directions come first: their octant, and in it which of each two components is the larger. So
# rays side by side agree in signs and dominant axis, without which those of a packet would take
# turns (packet_turns.glsl).
DIRECTIONS = 1 << 6
_GRAY = (0, 1, 3, 2, 6, 7, 5, 4)    # octants, each with one sign other than the one before
AT_ONCE = 1 << 16   # rays that are worked on at a time: they stay in a core's cache
# Rays in a row that are put in order by themselves: those of a picture's rows begin near one
# another as it is, and what lies in a cache is sorted and moved faster (docs/bvh.md).
BLOCK = 1 << 17
SCATTERED = 0.75    # of all cells in which rays begin, a block's: from there on all are one


class RayOrder:
    """Rays put in order, but for empty ones: all of these are read from one empty texel.

    Parameters
    ----------
    planes : (n, 4) float32 each, one a texel of RAY_TEXELS
    bounds : the scene's (lo, hi)
    precision : what textures hold, where an empty ray may come to end where it begins

    Attributes
    ----------
    count : rays, n
    rays : (m,) int, those that are not empty, in their order
    size : (width, height) of the textures that they lie in
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
        order = np.argsort(keys, kind="stable")     # of 16 bits: numpy takes a radix sort
        return order if len(rays) == self.count else rays[order]

    def planes(self, planes: list[np.ndarray]) -> list[np.ndarray]:
        """(width * height, 4) float32 each, the rays where they lie; empty ones elsewhere."""
        (width, height), count = self.size, len(self.rays)
        curve, rank = _curve(self.size)
        laid = [np.empty((width * height, 4), np.float32) for _ in planes]

        def lay(first: int) -> None:
            part = slice(first, first + AT_ONCE)
            lies = self.rays[np.minimum(rank[part], count - 1)]
            for values, into in zip(planes, laid):
                np.take(_whole(values), lies, out=_whole(into)[part], mode="clip")   # in place
        if count:
            run = threads(count)
            list(run(lay, range(0, width * height, AT_ONCE)))
        for into, empty in zip(laid, NO_RAY):
            into[curve[count:]] = empty
        return laid

    def back(self, values: np.ndarray) -> np.ndarray:
        """What each ray came to, from what lies in a texture.

        Parameters
        ----------
        values : (texels, ...), row by row

        Returns
        -------
        (n, ...), ray by ray
        """
        count, (curve, _) = len(self.rays), _curve(self.size)
        by_channel = values.ndim == 2 and values.flags.f_contiguous     # as packets' hits are
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
    """Squares across and down: about as wide as high, and no more than hold all rays."""
    count = -(-rays // SQUARE ** 2)
    across = max(1, round(count ** 0.5))
    return across, max(1, -(-count // across))


def _live_keys(planes: list[np.ndarray], first: int, precision: Precision,
               bounds: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, ...]:
    """Of a block of rays (m,) int, those not empty; (k,) int, those that are; (m,) uint16, of the
    former the kind of direction, then the origin's cell along a Morton curve."""
    fields = RAY_TEXELS.unpack_planes([plane[first:first + BLOCK] for plane in planes])
    some = precision.stored(fields["t_min"]) <= precision.stored(fields["t_max"])
    live, empty = np.flatnonzero(some), np.flatnonzero(~some)
    lo, hi = (np.asarray(corner, np.float32) for corner in bounds)
    direction = RAY_TEXELS.field("direction")
    assert direction.channel == 0
    lattice = _direction_codes(planes[direction.texel][first:first + BLOCK]).view(np.int32)
    lattice <<= 3 * ORIGIN_BITS
    place, cell = np.empty(len(some), np.float32), np.empty(len(some), np.int32)    # used again
    with np.errstate(all="ignore"):     # a box without extent is some cell or other
        for axis in range(3):
            np.subtract(fields["origin"][:, axis], lo[axis], out=place)
            place *= np.float32(1 << ORIGIN_BITS) / (hi - lo)[axis]
            np.copyto(cell, place, casting="unsafe")
            # One outside is taken for another: that costs order, and no hit.
            cell &= (1 << ORIGIN_BITS) - 1
            lattice |= np.left_shift(cell, ORIGIN_BITS * axis, out=cell)
    keys = np.take(_keys(), lattice[live] if len(empty) else lattice)
    return first + live, first + empty, keys


def _direction_codes(texels: np.ndarray) -> np.ndarray:
    """(n,) uint32 below DIRECTIONS, bits that tell whether x is negative, |x| no less than |y|,
    |x| than |z|, y negative, |y| no less than |z|, z negative.

    texels : (n, 4) float32, directions first. All numbers are taken in a row, each with those
        after it, as numpy is slow along short axes.
    """
    row = texels.reshape(-1)
    negative, size = row < 0, np.abs(row)
    next_less, second_less = np.zeros_like(negative), np.zeros_like(negative)
    np.greater_equal(size[:-1], size[1:], out=next_less[:-1])
    np.greater_equal(size[:-2], size[2:], out=second_less[:-2])
    # A byte a component now; the last one's is cut off.
    code = negative.view("<u4") | next_less.view("<u4") << 1 | second_less.view("<u4") << 2
    code &= 0x010307
    code *= 1 << 16 | 1 << 11 | 1 << 5      # bits of the three bytes side by side, from the 16th
    code >>= 16
    code &= DIRECTIONS - 1
    return code


def _near_one_another(keys: list[np.ndarray]) -> bool:
    """Whether rays of a block, one in eight, begin in a part of the cells in which any do."""
    cells = np.zeros((len(keys), 1 << 3 * ORIGIN_BITS), bool)
    for held, each in zip(cells, keys):
        held[each[::8] & len(held) - 1] = True
    return cells.sum() < SCATTERED * len(keys) * cells.any(axis=0).sum()


def _joined(parts: list[np.ndarray]) -> np.ndarray:
    return parts[0] if len(parts) == 1 else np.concatenate([np.empty(0, np.intp), *parts])


def _whole(texels: np.ndarray) -> np.ndarray:
    """(n,) of (n, 4) float32: a texel as one number, which numpy moves faster than its four."""
    return texels.view(np.complex128)[:, 0]


@lru_cache(maxsize=None)
def _keys() -> np.ndarray:
    """(2^15,) uint16, the key of each direction's code and origin's cell, these in the low bits:
    octant by octant, in each around its diagonal, then along a Morton curve of origins."""
    place = np.arange(DIRECTIONS << 3 * ORIGIN_BITS)
    code, cell = np.divmod(place, 1 << 3 * ORIGIN_BITS)
    negative = code & 1 | code >> 2 & 2 | code >> 3 & 4
    over = code >> 1 & 1, code >> 2 & 1, code >> 4 & 1     # x over y, x over z, y over z
    # The six orders of three sizes, each with two neighbours of the one before swapped: the
    # largest is x, x, y, y, z, z.
    around = np.zeros(8, int)
    around[[3, 7, 6, 4, 0, 1]] = range(6)
    way = around[over[0] | over[1] << 1 | over[2] << 2]
    axes = (cell >> ORIGIN_BITS * axis & (1 << ORIGIN_BITS) - 1 for axis in range(3))
    return np.asarray((np.argsort(_GRAY)[negative] * 6 + way) << 3 * ORIGIN_BITS
                      | morton_3d(*axes), np.uint16)


@lru_cache(maxsize=1)
def _curve(size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Texels of a texture in order, square by square and along each one's curve; and the number
    that each has in it. (width * height,) int32 both."""
    width, height = size
    y, x = np.divmod(np.arange(width * height), width)
    rank = ((y // SQUARE * (width // SQUARE) + x // SQUARE) * SQUARE ** 2
            + morton_2d(y % SQUARE, x % SQUARE)).astype(np.int32)
    texels = np.empty_like(rank)
    texels[rank] = np.arange(width * height, dtype=np.int32)
    return texels, rank
