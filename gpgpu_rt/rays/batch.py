"""Ray batch: converts arrays of rays to texels, and hits back to the caller's units and order."""
from __future__ import annotations

import time
from collections.abc import Mapping
from numbers import Integral

import numpy as np

from ..gl.precision import Precision
from ..gl.texel_channels import whole_texels
from ..hits import INVALID, Hits
from ..numerics.error_bounds import FLOAT32
from ..numerics.powers_of_two import exponents_of, scaled
from ..threads import cores, threads
from .far_origins import approach
from .order import RayOrder
from .records import NO_RAY, NO_TRIANGLE, RAY_TEXELS
from .tile_bounds import SIDE, TileBounds

# Smallest and largest block of rays that a thread writes to texels. With smaller blocks, threads
# mostly wait for the interpreter lock. Larger blocks leave the cache before their bounds are
# computed.
FEW, AT_ONCE = 1 << 16, 1 << 18
# Rays in a row of the texture if the caller gives no shape.
ROW = 1024
# Values of a block of rays: indices of invalid rays; exponents that scaled directions; shifts of
# origins, in units of t; and the shared start (origin and t_min). Exponents or shifts are None if
# all are 0. The start is None if rays start differently.
_Laid = tuple[np.ndarray, np.ndarray | None, np.ndarray | None, np.ndarray | None]
_ON_MISS = {"t": np.inf, "u": 0, "v": 0, "triangle": -1}


class RayBatch:
    """Rays from arrays, checked, rounded to float32 and stored as texels.

    Each direction is scaled by the power of two that brings its largest component into [0.5, 1);
    this is exact. The interval t_min to t_max is scaled to match. An origin far outside ``bounds``
    is advanced along its ray (see ``approach``). ``Hits`` are returned in the caller's units.

    A renderer may flush magnitudes below 2^-126 to 0. An interval's end with such a magnitude is
    therefore moved into the interval, to 0 or to +-2^-126. An empty interval stays empty.

    Parameters
    ----------
    origins, directions : (n, 3) or (h, w, 3) float, world units
    t_min, t_max : numbers, or a value per ray; both ends are included
    shape : (h, w) of the image that the rays form. By default, arrays (h, w, 3) give the shape,
        and rays of arrays (n, 3) fill rows of 1024 rays
    invalid : for a ray with a NaN, an infinite origin or direction, or a zero direction: "raise"
        raises an error, and "miss" counts the ray as a miss
    bounds : the scene's (lo, hi), or None to leave all origins unchanged
    tiled : whether to compute bounds of tiles

    Attributes
    ----------
    count : the number of rays, n
    shape : (h, w) if given by ``shape`` or the arrays, else (n,)
    size : (width, height) of the ray textures
    start : (4,) float32, the origin and t_min that all rays share; None if they differ between
        rays, if a ray is invalid, if an origin was advanced, or if t_min is negative
    tiles : bounds of the tiles; None if they were not requested, if the textures are too wide, or
        if the rays were sorted
    order : the order of the rays in the textures, or None if they were not sorted
    sort_seconds : time spent so far on sorting rays and on sorting hits back

    Raises
    ------
    ValueError
        shapes do not match; or, with "raise", rays are invalid: the message names the first
    """

    def __init__(self, origins: np.ndarray, directions: np.ndarray,
                 t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf,
                 shape: tuple[int, int] | None = None, invalid: str = "raise",
                 bounds: tuple[np.ndarray, np.ndarray] | None = None,
                 tiled: bool = False) -> None:
        if invalid not in ("raise", "miss"):
            raise ValueError(f'invalid is "raise" or "miss", not {invalid!r}')
        origins, directions = (_rays_array(origins, "origins"),
                               _rays_array(directions, "directions"))
        if origins.shape != directions.shape:
            raise ValueError(f"origins {origins.shape} and directions {directions.shape} differ")
        if shape is None and origins.ndim == 3:
            shape = origins.shape[:2]
        origins, directions = origins.reshape(-1, 3), directions.reshape(-1, 3)
        self.count = len(origins)
        if shape is not None:
            _check_shape(shape, self.count)
        self.shape: tuple[int, ...] = (self.count,) if shape is None else tuple(shape)
        t_min, t_max = (self._one_a_ray(t, name) for t, name in ((t_min, "t_min"),
                                                                 (t_max, "t_max")))
        width = shape[1] if shape is not None else max(1, min(self.count, ROW))
        height = shape[0] if shape is not None else -(-self.count // width)
        self.size = (max(1, width), max(1, height))
        # Allocate an array for each texture: an array that is never written uses no memory.
        planes = [np.empty((self.size[0] * self.size[1], 4), np.float32)
                  for _ in range(RAY_TEXELS.texels)]
        self._planes, self._given, self.sort_seconds = planes, planes, 0.0
        self.order: RayOrder | None = None
        _put(planes, slice(self.count, None), NO_RAY)
        at_once, self.tiles = min(max(FEW, -(-self.count // cores())), AT_ONCE), None
        across = SIDE * self.size[0]
        if tiled and across <= AT_ONCE:     # make blocks of whole tiles
            at_once = max(at_once // across, 1) * across
            self.tiles = TileBounds(self.size)
        blocks = [slice(first, min(first + at_once, self.count))
                  for first in range(0, self.count, at_once)]

        def lay(part: slice) -> _Laid:
            laid = _lay_out([plane[part] for plane in planes], origins[part], directions[part],
                            t_min[part], t_max[part], bounds)
            if self.tiles is not None:      # the rays are still in the cache
                self.tiles.see(part.start // self.size[0], self._rows(part), laid[3])
            return laid
        laid = list(threads(self.count)(lay, blocks))
        self.invalid = np.concatenate([np.empty(0, np.intp), *(
            part.start + bad for part, (bad, *_) in zip(blocks, laid))])
        if invalid == "raise" and len(self.invalid):
            first = int(self.invalid[0])
            raise ValueError(f"ray {first} is invalid: origin {origins[first]}, direction "
                             f"{directions[first]}, t_min {t_min[first]}, t_max {t_max[first]}; "
                             'entries must be finite and a direction not zero (invalid="miss", '
                             "or --invalid miss, makes such rays misses)")
        self._exponents = _joined(blocks, [exponents for _, exponents, *_ in laid])
        self._shift = _joined(blocks, [shift for _, _, shift, _ in laid])
        starts = [start for *_, start in laid]
        alike = bool(starts) and all(_same(start, starts[0]) for start in starts)
        self.start = starts[0] if alike else None
        # Blocks with a start of None have already written their origins to the texture.
        self._starts = list(zip(blocks, starts))
        if not alike:
            self._lay_out_starts()

    def _one_a_ray(self, t: float | np.ndarray, name: str) -> np.ndarray:
        t = _float32(t, name).reshape(-1)
        if len(t) not in (1, self.count):
            raise ValueError(
                f"{name} has {len(t)} values for {self.count} rays; give 1 or {self.count}")
        return np.broadcast_to(t, self.count)

    def _rows(self, part: slice) -> list[np.ndarray]:
        """Return the rows of a block, (rows, width, 4) per texture. The block begins a new row."""
        width = self.size[0]
        rows = slice(part.start, -(-part.stop // width) * width)
        return [plane[rows].reshape(-1, width, 4) for plane in self._planes]

    def _lay_out_starts(self) -> None:
        for part, start in self._starts:
            if start is not None:
                self._given[0][part] = start
        self._starts = []

    def texels(self, texel: int) -> np.ndarray:
        """Return the texture for a texel of RAY_TEXELS, (height, width, 4) float32."""
        if not texel:
            self._lay_out_starts()
        return self._planes[texel].reshape(*self.size[::-1], 4)

    def sample(self, rows: np.ndarray, columns: np.ndarray) -> dict[str, np.ndarray]:
        """Return the fields of the rays at rows and columns (broadcast) of the textures."""
        width, height = self.size
        planes = [plane.reshape(height, width, 4)[rows, columns] for plane in self._planes]
        if self.start is not None:
            planes[0][...] = self.start
        return RAY_TEXELS.unpack_planes(planes)

    def given_units(self, t: np.ndarray, rays: slice | np.ndarray) -> np.ndarray:
        """Convert (k,) float32 values of t to the caller's units; ``rays`` selects their rays."""
        with np.errstate(over="ignore"):
            if self._shift is not None:
                t = (t + self._shift[rays]).astype(np.float32)
            return t if self._exponents is None else scaled(t, -self._exponents[rays])

    def put_in_order(self, bounds: tuple[np.ndarray, np.ndarray],
                     precision: Precision = Precision()) -> None:
        """Sort the rays so that similar rays lie side by side; see ``RayOrder``."""
        began = time.perf_counter()
        self._lay_out_starts()
        given = [plane[:self.count] for plane in self._given]
        self.order = RayOrder(given, bounds, precision)
        self.size, self._planes = self.order.size, self.order.planes(given)
        self.tiles = None
        self.sort_seconds += time.perf_counter() - began

    def given_fields(self) -> dict[str, np.ndarray]:
        """Return copies of the fields of RAY_TEXELS, float32, in the caller's order of rays."""
        self._lay_out_starts()
        fields = RAY_TEXELS.unpack_planes(self._given)
        return {name: values[:self.count].copy() for name, values in fields.items()}

    def by_ray(self, texels: np.ndarray) -> np.ndarray:
        """Return (n, 4) values in the caller's order of rays, from all texels of a texture."""
        if self.order is None:
            return texels[:self.count]
        began = time.perf_counter()
        found = self.order.back(texels)
        self.sort_seconds += time.perf_counter() - began
        return found

    def hits(self, fields: Mapping[str, np.ndarray]) -> Hits:
        """Return hits in the caller's units from the fields of HIT, (n,) each.

        Parameters
        ----------
        fields : as for `hits_of`; entries after the last ray are ignored
        """
        fields = {name: values[:self.count] for name, values in fields.items()}
        if "t" in fields:
            fields["t"] = self.given_units(fields["t"], slice(None))
        hits = hits_of(fields)
        hits.status, hits.shape = self.status(), self.shape
        return hits

    def status(self) -> np.ndarray:
        """Return the status of the rays before tracing, (n,) uint8: INVALID or 0."""
        status = np.zeros(self.count, np.uint8)
        status[self.invalid] = INVALID
        return status


def _lay_out(planes: list[np.ndarray], origins: np.ndarray, directions: np.ndarray,
             t_min: np.ndarray, t_max: np.ndarray,
             bounds: tuple[np.ndarray, np.ndarray] | None) -> _Laid:
    """Write a block of rays to planes, (n, 4) each, a plane for each texel of RAY_TEXELS.

    If all rays share a start, the plane of origins is not written.
    """
    size, ill = _size(directions), np.empty(0, np.intp)
    alike = _alike(origins)
    if not (size.min() > 0 and size.max() < np.inf
            and np.isfinite(origins[:1] if alike else origins).all()
            and _numbers(t_min) and _numbers(t_max)):
        well = (size > 0) & (size < np.inf)
        for end in (t_min, t_max):
            if not _numbers(end):
                well &= ~np.isnan(end)
        for along in origins.T:
            well &= np.isfinite(along)
        bad = ~well
        np.copyto(size, 0.5, where=bad)
        ill, alike = np.flatnonzero(bad), False
    exponents, shift = _exponents(size), None
    with np.errstate(over="ignore", invalid="ignore"):
        if exponents is not None:
            directions = scaled(directions, -exponents)
        t_min = _normal(t_min, exponents, FLOAT32.tiny, 0.0)
        t_max = _normal(t_max, exponents, 0.0, -FLOAT32.tiny)
        near = alike and bounds is not None and approach(
            origins[:1], directions[:1], *bounds)[1] is None
        if bounds is not None and not near:
            origins, shift = approach(origins, directions, *bounds)
            if shift is not None:
                t_min, t_max, alike = t_min - shift, t_max - shift, False
        # A shared t_min below -1 would turn texels without a ray into rays: their t_max is -1.
        start = np.float32([*origins[0], t_min[0]]) if (
            alike and _alike(t_min) and t_min[0] >= 0) else None
        into = planes if start is None else [None, *planes[1:]]
        RAY_TEXELS.pack_into(into, origin=origins, direction=directions, t_min=t_min, t_max=t_max)
    for plane, texel in zip(planes, NO_RAY) if len(ill) else ():
        np.copyto(whole_texels(plane), whole_texels(texel), where=bad)
    return ill, exponents, shift, start


def _put(planes: list[np.ndarray], at: slice | np.ndarray, texels: np.ndarray) -> None:
    for plane, texel in zip(planes, texels):
        plane[at] = texel


def _alike(values: np.ndarray) -> bool:
    """Return whether all rows of (n,) or (n, k) values are equal, and none is NaN."""
    if not values.strides[0]:
        values = values[:1]
    if (values[:1] != values[len(values) // 2]).any():     # a cheap test that often suffices
        return False
    # Compare each row with the row before it, as flat arrays: numpy is slow along short axes.
    width, row = values[0].size, values.reshape(-1)
    return bool((row[width:] == row[:-width]).all() and not np.isnan(values[0]).any())


def _same(one: np.ndarray | None, other: np.ndarray | None) -> bool:
    return one is not None and other is not None and bool((one == other).all())


def _joined(blocks: list[slice], parts: list[np.ndarray | None]) -> np.ndarray | None:
    """Join the blocks' values per ray. None counts as zeros; return None if all blocks have None.
    """
    some = [part for part in parts if part is not None]
    if not some:
        return None
    return np.concatenate([np.zeros(block.stop - block.start, some[0].dtype) if part is None
                           else part for block, part in zip(blocks, parts)])


def _normal(t: np.ndarray, exponents: np.ndarray | None, above: float, below: float
            ) -> np.ndarray:
    """Return the products of the intervals' ends ``t`` and 2^exponents, (n,) float32.

    A renderer may flush denormals: ``above`` replaces positive, ``below`` negative denormals.
    """
    given = ends = t if t.strides[0] else t[:1]
    if exponents is not None and (given is t or given[0] not in (0, np.inf)):
        ends = scaled(given, exponents)
    tiny = (np.abs(ends) < FLOAT32.tiny) & (given != 0)
    if tiny.any():
        ends = np.where(tiny, np.where(given > 0, above, below), ends).astype(np.float32)
    return ends if len(ends) == len(t) else np.broadcast_to(ends, len(t))


def _numbers(values: np.ndarray) -> bool:
    """Return whether none of (n,) values is NaN."""
    return not np.isnan(values if values.strides[0] else values[:1]).any()


def _size(directions: np.ndarray) -> np.ndarray:
    """Return the largest magnitude among each direction's components, (n,)."""
    size = np.abs(directions[:, 0])
    for axis in (1, 2):
        np.maximum(size, np.abs(directions[:, axis]), out=size)
    return size


def _exponents(size: np.ndarray) -> np.ndarray | None:
    """Return exponents e, (n,) int, with size / 2^e in [0.5, 1); None if all exponents are 0."""
    if not len(size) or (size.min() >= 0.5 and size.max() < 1):
        return None
    return exponents_of(size)


def hits_of(fields: Mapping[str, np.ndarray]) -> Hits:
    """Return hits from the fields of HIT, without a change of units.

    Parameters
    ----------
    fields : (n,) for each field of HIT. The arrays are reused, and modified where rays missed. If
        ``triangle`` is the only field, as after an any-hit query, t, u and v are 0
    """
    missed = fields["triangle"] == NO_TRIANGLE

    def column(name: str) -> np.ndarray:
        found = np.ascontiguousarray(fields[name])      # copies the column of a readback
        np.copyto(found, _ON_MISS[name], where=missed, casting="unsafe")
        return found
    run = threads(len(missed))
    found = dict.fromkeys(_ON_MISS, np.broadcast_to(np.float32(0), len(missed)))
    found |= zip(fields, run(column, fields))
    return Hits(**found, status=np.zeros(len(missed), np.uint8))


def _check_shape(shape: tuple[int, int], count: int) -> None:
    """Raise ValueError unless ``shape`` is (height, width) of an image of ``count`` rays."""
    sides = np.asarray(shape, object)
    if sides.shape != (2,) or not all(isinstance(side, Integral) and side >= 0 for side in sides):
        raise ValueError(f"shape is {shape!r}; give (height, width), two whole numbers, or None")
    if shape[0] * shape[1] != count:
        raise ValueError(f"shape {tuple(shape)} does not hold {count} rays")


def _float32(values: float | np.ndarray, name: str) -> np.ndarray:
    """Return the values as float32. Numbers beyond float32's range become infinite."""
    try:
        array = np.asarray(values)
        if array.dtype.kind not in "biuf":
            raise ValueError(f"these are {array.dtype}")
    except ValueError as failure:
        raise ValueError(f"{name} must be numbers ({failure})") from failure
    if array.dtype == np.float32:
        return array
    with np.errstate(over="ignore"):
        return array.astype(np.float32)


def _rays_array(values: np.ndarray, name: str) -> np.ndarray:
    array = _float32(values, name)
    if array.ndim not in (2, 3) or array.shape[-1] != 3:
        raise ValueError(f"{name} must be (n, 3) or (h, w, 3), not {array.shape}")
    return array
