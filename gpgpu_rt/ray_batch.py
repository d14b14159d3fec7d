"""Rays on their way in, as texels, and hits on their way out."""
from __future__ import annotations

import time
from collections.abc import Mapping

import numpy as np

from .approach import approach, by_axis
from .hits import INVALID, Hits
from .ray_order import AT_ONCE, RayOrder
from .texel_layout import NO_RAY, NO_TRIANGLE, RAY_TEXELS
from .threads import threads

ROW = 1024   # rays in a row of the texture where the caller gave no shape
MANY = 5     # a share of 1 in so many: more is written by columns, less ray by ray
_ON_MISS = {"t": np.inf, "u": 0, "v": 0, "triangle": -1}


class RayBatch:
    """Rays as arrays, checked, rounded to float32 and laid out as texels.

    A direction is scaled by the power of two that brings its largest component into [0.5, 1), and
    t with it: exact, so that kernels meet directions of one size whatever length the caller's
    have. An origin far outside ``bounds`` is advanced along its ray (see ``approach``). ``Hits``
    come back in the caller's units.

    Parameters
    ----------
    origins, directions : (n, 3) or (h, w, 3) float, world units
    t_min, t_max : scalars, or one a ray; both ends count
    shape : (h, w) of the tile the rays form, or None: the shape of the arrays, else rows of 1024
    invalid : "raise" or "miss": what becomes of a ray with a NaN, an infinity or a zero direction
    bounds : the scene's (lo, hi), or None to leave every origin as it is

    Attributes
    ----------
    count : rays
    size, texels : (width, height) of their textures, and what these hold
    order : in which they lie there, once they were put in one
    sort_seconds : what that took so far, and hits back into the rays' own

    Raises
    ------
    ValueError
        for arrays that do not fit, and under "raise" for the first invalid ray.
    """

    def __init__(self, origins: np.ndarray, directions: np.ndarray,
                 t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf,
                 shape: tuple[int, int] | None = None, invalid: str = "raise",
                 bounds: tuple[np.ndarray, np.ndarray] | None = None) -> None:
        if invalid not in ("raise", "miss"):
            raise ValueError(f'invalid is "raise" or "miss", not {invalid!r}')
        origins, directions = _rays_array(
            origins, "origins"), _rays_array(directions, "directions")
        if origins.shape != directions.shape:
            raise ValueError(f"origins {origins.shape} and directions {directions.shape} differ")
        if shape is None and origins.ndim == 3:
            shape = origins.shape[:2]
        origins, directions = origins.reshape(-1, 3), directions.reshape(-1, 3)
        self.count = len(origins)
        if shape is not None and shape[0] * shape[1] != self.count:
            raise ValueError(f"shape {tuple(shape)} does not hold {self.count} rays")
        t_min, t_max = (self._one_a_ray(t, name) for t, name in ((t_min, "t_min"),
                                                                 (t_max, "t_max")))
        width = shape[1] if shape is not None else max(1, min(self.count, ROW))
        height = shape[0] if shape is not None else -(-self.count // width)
        self.size = (max(1, width), max(1, height))
        # A texture behind the other, as they are uploaded, though seen ray by ray.
        planes = np.empty((RAY_TEXELS.texels, self.size[0] * self.size[1], 4), np.float32)
        self._planes, self.sort_seconds = planes, 0.0
        self.order: RayOrder | None = None
        texels = planes.swapaxes(0, 1)
        self.texels = planes.reshape(-1, *self.size[::-1], 4).transpose(1, 2, 0, 3)
        blocks = [slice(first, min(first + AT_ONCE, self.count))
                  for first in range(0, self.count, AT_ONCE)]
        with threads(self.count) as run:
            laid = list(run(lambda part: _lay_out(
                texels[part], origins[part], directions[part], t_min[part], t_max[part], bounds),
                blocks))
        self.invalid = np.concatenate([np.empty(0, np.intp), *(
            part.start + bad for part, (bad, _, _) in zip(blocks, laid))])
        if invalid == "raise" and len(self.invalid):
            first = int(self.invalid[0])
            raise ValueError(f"ray {first} is invalid: origin {origins[first]}, direction "
                             f"{directions[first]}, t_min {t_min[first]}, t_max {t_max[first]}; "
                             'entries must be finite and a direction not zero (invalid="miss", '
                             "or --invalid miss, makes such rays misses)")
        self._exponents = _joined(blocks, [exponents for _, exponents, _ in laid])
        self._shift = _joined(blocks, [shift for *_, shift in laid])
        texels[self.count:] = NO_RAY[:RAY_TEXELS.texels]

    def _one_a_ray(self, t: float | np.ndarray, name: str) -> np.ndarray:
        t = np.asarray(t, np.float32).reshape(-1)
        if len(t) not in (1, self.count):
            raise ValueError(
                f"{name} holds {len(t)} values for {self.count} rays: one, or one each")
        return np.broadcast_to(t, self.count)

    def given_units(self, t: np.ndarray, rays: slice | np.ndarray) -> np.ndarray:
        """(k,) float32 t of the programs, of the rays chosen, in the caller's units."""
        with np.errstate(over="ignore"):
            if self._shift is not None:
                t = (t + self._shift[rays]).astype(np.float32)
            return t if self._exponents is None else np.ldexp(t, -self._exponents[rays])

    def put_in_order(self, bounds: tuple[np.ndarray, np.ndarray]) -> None:
        """Lay rays that are alike side by side; see ``RayOrder``."""
        began = time.perf_counter()
        planes = self._planes[:, :self.count]
        self.order = RayOrder(planes, bounds)
        self.size, self.texels = self.order.size, self.order.texels(planes)
        self.sort_seconds += time.perf_counter() - began

    def given_texels(self) -> np.ndarray:
        """(n, textures, 4) float32, a copy: the rays as they were given, in no other order."""
        return self._planes[:, :self.count].swapaxes(0, 1).copy()

    def by_ray(self, texels: np.ndarray) -> np.ndarray:
        """What a texture of ``size`` holds, (k, 4) row by row, ray by ray: (n, 4)."""
        if self.order is None:
            return texels[:self.count]
        began = time.perf_counter()
        found = self.order.back(texels)
        self.sort_seconds += time.perf_counter() - began
        return found

    def shared_start(self) -> np.ndarray | None:
        """Origin and t_min, (4,) float32, where all valid rays have the same."""
        starts = self._planes[0, :self.count]
        if not self.count or len(self.invalid) or (starts[0] != starts[self.count // 2]).any():
            return None
        least, most = (by_axis(extreme, starts) for extreme in (np.minimum, np.maximum))
        return starts[0] if (least == most).all() else None

    def hits(self, fields: Mapping[str, np.ndarray]) -> Hits:
        """Hits in the caller's units from the fields of HIT, (n,) each.

        Parameters
        ----------
        fields : as for `hits_of`; entries behind the last ray's do not count
        """
        fields = {name: values[:self.count] for name, values in fields.items()}
        hits = hits_of({**fields, "t": self.given_units(fields["t"], slice(None))})
        hits.status = self.status()
        return hits

    def status(self) -> np.ndarray:
        """(n,) uint8, what is known before anything is traced: which rays are invalid."""
        status = np.zeros(self.count, np.uint8)
        status[self.invalid] = INVALID
        return status


def _lay_out(texels: np.ndarray, origins: np.ndarray, directions: np.ndarray, t_min: np.ndarray,
             t_max: np.ndarray, bounds: tuple[np.ndarray, np.ndarray] | None
             ) -> tuple[np.ndarray, np.ndarray | None, np.ndarray | None]:
    """A block of rays into (n, texels, 4); which are invalid, as indices; the exponents and the
    shifts of all, None where none has one."""
    size, bad = _size(directions), np.zeros(len(texels), bool)
    if not (size.min() > 0 and size.max() < np.inf and np.isfinite(origins).all()
            and _numbers(t_min) and _numbers(t_max)):
        well = np.isfinite(size) & (size > 0) & ~np.isnan(t_min) & ~np.isnan(t_max)
        for along in origins.T:
            well &= np.isfinite(along)
        bad = ~well
        np.copyto(size, 0.5, where=bad)
        middle = np.zeros(3) if bounds is None else (bounds[0] + bounds[1]) / 2    # not far off
        origins = origins.copy()
        for along, value in zip(origins.T, middle):
            np.copyto(along, value, where=bad, casting="same_kind")
    exponents, shift = _exponents(size), None
    with np.errstate(over="ignore", invalid="ignore"):
        if exponents is not None:
            directions = np.ldexp(directions, -exponents[:, None])
            t_min, t_max = np.ldexp(t_min, exponents), np.ldexp(t_max, exponents)
        if bounds is not None:
            origins, shift = approach(origins, directions, *bounds)
            if shift is not None:
                t_min, t_max = t_min - shift, t_max - shift
        RAY_TEXELS.pack(texels, origin=origins, direction=directions, t_min=t_min, t_max=t_max)
    ill = np.flatnonzero(bad)
    if MANY * len(ill) < len(bad):
        texels[ill] = NO_RAY[:RAY_TEXELS.texels]
    else:
        for at, value in np.ndenumerate(NO_RAY[:RAY_TEXELS.texels]):
            np.copyto(texels[(slice(None), *at)], value, where=bad)
    return ill, exponents, shift


def _joined(blocks: list[slice], parts: list[np.ndarray | None]) -> np.ndarray | None:
    """One a ray from one a ray of each block, 0 where a block has none; None where all have."""
    some = [part for part in parts if part is not None]
    if not some:
        return None
    return np.concatenate([np.zeros(block.stop - block.start, some[0].dtype) if part is None
                           else part for block, part in zip(blocks, parts)])


def _numbers(values: np.ndarray) -> bool:
    """Whether none of (n,) is NaN; one that stands for all is looked at once."""
    return not np.isnan(values if values.strides[0] else values[:1]).any()


def _size(directions: np.ndarray) -> np.ndarray:
    """(n,) the largest component of (n, 3), by columns: numpy is slow along short axes."""
    size = np.abs(directions[:, 0])
    for axis in (1, 2):
        np.maximum(size, np.abs(directions[:, axis]), out=size)
    return size


def _exponents(size: np.ndarray) -> np.ndarray | None:
    """(n,) int, of the power of two times [0.5, 1) that each of (n,) is; None where all are 0."""
    if not len(size) or (size.min() >= 0.5 and size.max() < 1):
        return None
    return np.frexp(size)[1]


def hits_of(fields: Mapping[str, np.ndarray]) -> Hits:
    """Hits from the fields of HIT, in the units they are in.

    Parameters
    ----------
    fields : (n,) each of HIT's, just read: they are taken over, and changed where rays missed
    """
    missed = fields["triangle"] == NO_TRIANGLE

    def column(name: str) -> np.ndarray:
        found = np.ascontiguousarray(fields[name])      # together, not a column of what was read
        np.copyto(found, _ON_MISS[name], where=missed, casting="unsafe")
        return found
    with threads(len(missed)) as run:
        found = dict(zip(_ON_MISS, run(column, _ON_MISS)))
    return Hits(**found, status=np.zeros(len(missed), np.uint8))


def _rays_array(values: np.ndarray, name: str) -> np.ndarray:
    try:
        array = np.asarray(values)
        if array.dtype != np.float32:
            with np.errstate(over="ignore"):
                array = array.astype(np.float32)
    except (TypeError, ValueError) as failure:
        raise ValueError(f"{name} must be an array of numbers ({failure})") from failure
    if array.ndim not in (2, 3) or array.shape[-1] != 3:
        raise ValueError(f"{name} must be (n, 3) or (h, w, 3), not {array.shape}")
    return array
