"""Rays on their way in, as texels, and hits on their way out."""
from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from .approach import approach, near
from .hits import INVALID, Hits
from .record import EXACT_INTEGER
from .texel_layout import NO_RAY, RAY_TEXELS
from .threads import threads

ROW = 1024   # rays in a row of the texture where the caller gave no shape
BLOCK = 1 << 16     # rays laid out at a time: what is made of them stays in a core's cache
ABREAST = 128       # points in a row of what is reduced by axis


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
        texels = planes.swapaxes(0, 1)
        self.texels = planes.reshape(-1, *self.size[::-1], 4).transpose(1, 2, 0, 3)
        self.invalid = np.empty(0, np.intp)
        self._exponents: np.ndarray | None = None
        self._shift: np.ndarray | None = None
        if not _lay_out(texels[:self.count], origins, directions, t_min, t_max, bounds):
            self._lay_out_any(texels[:self.count], origins, directions, t_min, t_max, invalid,
                              bounds)
        texels[self.count:] = texels[self.invalid] = NO_RAY[:RAY_TEXELS.texels]

    def _lay_out_any(self, texels: np.ndarray, origins: np.ndarray, directions: np.ndarray,
                     t_min: np.ndarray, t_max: np.ndarray, invalid: str,
                     bounds: tuple[np.ndarray, np.ndarray] | None) -> None:
        """Rays of which some are invalid, of other sizes or far off, into (n, texels, 4)."""
        size = _size(directions)
        bad = ~(np.isfinite(size) & (size > 0) & ~np.isnan(t_min) & ~np.isnan(t_max))
        if not np.isfinite(origins).all():
            bad |= ~np.isfinite(origins).all(1)
        if invalid == "raise" and bad.any():
            first = int(bad.argmax())
            raise ValueError(f"ray {first} is invalid: origin {origins[first]}, direction "
                             f"{directions[first]}, t_min {t_min[first]}, t_max {t_max[first]}; "
                             'entries must be finite and a direction not zero (invalid="miss", '
                             "or --invalid miss, makes such rays misses)")
        self.invalid = np.flatnonzero(bad)
        size[self.invalid] = 0.5
        self._exponents = _exponents(size)
        with np.errstate(over="ignore", invalid="ignore"):
            if self._exponents is not None:
                directions = np.ldexp(directions, -self._exponents[:, None])
                t_min, t_max = np.ldexp(t_min, self._exponents), np.ldexp(t_max, self._exponents)
            if bounds is not None:
                origins, self._shift = approach(origins, directions, *bounds)
                if self._shift is not None:
                    t_min, t_max = t_min - self._shift, t_max - self._shift
            RAY_TEXELS.pack(texels, origin=origins, direction=directions, t_min=t_min,
                            t_max=t_max)

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

    def shared_start(self) -> np.ndarray | None:
        """Origin and t_min, (4,) float32, where all valid rays have the same."""
        starts = self.texels[:, :, 0].reshape(-1, 4)[:self.count]
        if not self.count or len(self.invalid) or (starts[0] != starts[self.count // 2]).any():
            return None
        rows = self.count // ABREAST * ABREAST
        abreast = starts[:rows].reshape(-1, ABREAST * 4) == np.tile(starts[0], ABREAST)
        return starts[0] if abreast.all() and (starts[rows:] == starts[0]).all() else None

    def hits(self, fields: Mapping[str, np.ndarray]) -> Hits:
        """Hits in the caller's units from the fields of HIT, one or more a ray."""
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
             t_max: np.ndarray, bounds: tuple[np.ndarray, np.ndarray] | None) -> bool:
    """Rays into (n, texels, 4), a block at a time, where all are well: this is what tracing waits
    for. False where some are invalid, of other sizes or far off."""
    def block(first: int) -> tuple[np.ndarray, np.ndarray] | None:
        """The box around a block's origins; None where a ray is not well."""
        part = slice(first, first + BLOCK)
        start, along, lo, hi = origins[part], directions[part], t_min[part], t_max[part]
        size = _size(along)
        if not (size.min() >= 0.5 and size.max() < 1 and _numbers(lo) and _numbers(hi)):
            return None
        RAY_TEXELS.pack(texels[part], origin=start, direction=along, t_min=lo, t_max=hi)
        return _by_axis(np.minimum, start), _by_axis(np.maximum, start)
    with threads(len(texels)) as run:
        ends = list(run(block, range(0, len(texels), BLOCK)))
    if not ends:
        return True
    found = [one for one in ends if one is not None]
    if len(found) < len(ends) or not np.isfinite(found).all():
        return False
    least, most = np.min([one for one, _ in found], 0), np.max([other for _, other in found], 0)
    return bounds is None or near(least, most, *bounds)


def _numbers(values: np.ndarray) -> bool:
    """Whether none of (n,) is NaN; one that stands for all is looked at once."""
    return not np.isnan(values if values.strides[0] else values[:1]).any()


def _by_axis(extreme: np.ufunc, points: np.ndarray) -> np.ndarray:
    """(3,) the extreme of (n, 3) by axis: in rows of many points, as numpy is fast along those."""
    rows = len(points) // ABREAST * ABREAST
    wide = points[:rows].reshape(-1, ABREAST * 3)
    parts = [extreme.reduce(wide, axis=0).reshape(-1, 3)] if rows else []
    return extreme.reduce(np.concatenate([*parts, points[rows:]]), axis=0)


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
    """Hits from the fields of HIT, in the units they are in."""
    missed = fields["triangle"] == EXACT_INTEGER
    found = {}
    for name, on_miss in (("t", np.inf), ("u", 0), ("v", 0), ("triangle", -1)):
        # Together, not a column of what was read.
        found[name] = np.ascontiguousarray(fields[name])
        np.copyto(found[name], on_miss, where=missed, casting="unsafe")
    return Hits(**found, status=np.zeros(len(found["t"]), np.uint8))


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
