"""Rays on their way in, the state passes ping-pong, and hits on their way out."""
from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

import moderngl
import numpy as np

from .approach import approach
from .camera import Camera
from .gpu import Gpu
from .hits import INVALID, Hits
from .precision import Precision
from .record import EXACT_INTEGER, Record
from .texel_layout import COUNTERS, HIT, NO_RAY, RAY_AFTER_HIT, RAY_TEXELS
from .textures import read_texture, release, stream_textures, texture_bytes, write_texture

ROW = 1024   # rays in a row of the texture where the caller gave no shape


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
        # By columns, and all rays at once where all are well: this is what tracing waits for.
        size = np.abs(directions[:, 0])
        for axis in (1, 2):
            np.maximum(size, np.abs(directions[:, axis]), out=size)
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
        width = shape[1] if shape is not None else max(1, min(self.count, ROW))
        height = shape[0] if shape is not None else -(-self.count // width)
        self.size = (max(1, width), max(1, height))
        # A texture behind the other, as they are uploaded, though seen ray by ray.
        planes = np.empty((RAY_TEXELS.texels, self.size[0] * self.size[1], 4), np.float32)
        texels = planes.swapaxes(0, 1)
        self._shift: np.ndarray | None = None
        with np.errstate(over="ignore", invalid="ignore"):
            if self._exponents is not None:
                directions = np.ldexp(directions, -self._exponents[:, None])
                t_min, t_max = np.ldexp(t_min, self._exponents), np.ldexp(t_max, self._exponents)
            if bounds is not None:
                origins, self._shift = approach(origins, directions, *bounds)
                if self._shift is not None:
                    t_min, t_max = t_min - self._shift, t_max - self._shift
            RAY_TEXELS.pack(texels[:self.count], origin=origins, direction=directions,
                            t_min=t_min, t_max=t_max)
        texels[self.count:] = texels[self.invalid] = NO_RAY[:RAY_TEXELS.texels]
        self.texels = planes.reshape(-1, *self.size[::-1], 4).transpose(1, 2, 0, 3)

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
        starts = self.texels.reshape(-1, 2, 4)[:self.count, 0]
        if not self.count or len(self.invalid) or (starts[0] != starts[self.count // 2]).any():
            return None
        return starts[0] if (starts == starts[0]).all() else None

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


def _exponents(size: np.ndarray) -> np.ndarray | None:
    """(n,) int, of the power of two times [0.5, 1) that each of (n,) is; None where all are 0."""
    if not len(size) or (size.min() >= 0.5 and size.max() < 1):
        return None
    return np.frexp(size)[1]


def hits_of(fields: Mapping[str, np.ndarray]) -> Hits:
    """Hits from the fields of HIT, in the units they are in."""
    missed = np.flatnonzero(fields["triangle"] == EXACT_INTEGER)
    found = {}
    for name, on_miss in (("t", np.inf), ("u", 0), ("v", 0), ("triangle", -1)):
        found[name] = fields[name].copy()      # together, not a column of what was read
        found[name][missed] = on_miss
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


class RayTextures:
    """The textures of a set of rays, one texel a ray.

    Parameters
    ----------
    size : (width, height)
    precision : what they hold
    after_hit : rays that go on behind a hit (RAY_AFTER_HIT), which take a third texture
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int], precision: Precision,
                 after_hit: bool = False) -> None:
        self.gpu, self.size, self.precision = gpu, size, precision
        self.after_hit = after_hit
        self.in_textures = precision.layout(RAY_AFTER_HIT if after_hit else RAY_TEXELS)
        self.textures = stream_textures(gpu, self.in_textures, size)
        self.target = gpu.context.framebuffer(self.textures)
        self._start: np.ndarray | None = None
        self.seen_from: Camera | None = None    # whose pixels' centres they go through, if so

    def share_start(self, start: np.ndarray | None) -> None:
        """All rays have this origin and t_min, (4,) float32; None: they may differ. Programs read
        what is shared from a uniform, which saves a fetch and whatever follows from it alone."""
        self.seen_from = None
        # An empty ray is one whose t_max is -1: that only a t_min below could make it live.
        alike = start is not None and start[3] >= 0
        self._start = self.precision.stored(start) if alike and start is not None else None

    def share_with(self, other: RayTextures) -> None:
        """Share what another set of rays, of which these are some, shares."""
        self._start = other._start

    def like(self, size: tuple[int, int]) -> RayTextures:
        """Textures of another size for rays of the same kind."""
        return RayTextures(self.gpu, size, self.precision, self.after_hit)

    def fits(self, other: RayTextures, size: tuple[int, int] | None = None) -> bool:
        """Whether rays of ``other`` can stand here, as many as its own or those of ``size``."""
        return self.size == (size or other.size) and self.after_hit == other.after_hit

    @property
    def record(self) -> Record:
        """The rays as traversal programs read them."""
        record = self.in_textures
        return record if self._start is None else replace(record, uniform_texels=(0,))

    def uniforms(self) -> dict[str, tuple[float, ...]]:
        """What programs read from uniforms."""
        return {} if self._start is None else {
            f"{RAY_TEXELS.name}_texel_0": tuple(self._start.tolist())}

    def upload(self, batch: RayBatch) -> None:
        self.share_start(batch.shared_start())
        self.write(batch.texels)

    def write(self, texels: np.ndarray) -> None:
        """Take (height, width, textures, 4) float32 texels."""
        for k, texture in enumerate(self.textures):
            stored = self.precision.stored(texels[:, :, k])
            write_texture(texture, np.ascontiguousarray(stored, "<" + texture.dtype))

    def samplers(self) -> dict[str, moderngl.Texture]:
        return stream_samplers(RAY_TEXELS.name, self.textures)

    def release(self) -> None:
        release(self.target, self.textures)


def stream_samplers(name: str, textures: list[moderngl.Texture]) -> dict[str, moderngl.Texture]:
    """Sampler name -> texture of a stream record read under ``name``."""
    return {f"{name}_texel_{k}": texture for k, texture in enumerate(textures)}


class StateBuffer:
    """One side of the ping-pong: the state, hit and counters of every ray, as one target."""

    def __init__(self, gpu: Gpu, records: list[Record], size: tuple[int, int],
                 depth: moderngl.Renderbuffer) -> None:
        self.records = {r.name: r for r in records}
        self.streams = {r.name: stream_textures(gpu, r, size) for r in records}
        self.textures = [t for textures in self.streams.values() for t in textures]
        self.target = gpu.context.framebuffer(self.textures, depth)
        self.target.depth_mask = False

    def samplers(self) -> dict[str, moderngl.Texture]:
        return {sampler: texture for name, textures in self.streams.items()
                for sampler, texture in stream_samplers(name, textures).items()}

    def fields(self, name: str) -> dict[str, np.ndarray]:
        """Fields of the record ``name``, one entry a texel, row by row."""
        texels = [read_texture(texture).reshape(-1, 4) for texture in self.streams[name]]
        return self.records[name].unpack(
            texels[0][:, None] if len(texels) == 1 else np.stack(texels, axis=1))

    def write(self, name: str, **fields: np.ndarray) -> None:
        """The inverse of ``fields``: what the host knows of every ray, one entry a texel."""
        packed = self.records[name].pack(**fields)
        for texel, texture in enumerate(self.streams[name]):
            write_texture(texture,
                          np.ascontiguousarray(packed[:, texel], "<" + texture.dtype))

    def release(self) -> None:
        release(self.target, self.textures)


class StateBuffers:
    """The ping-pong pair of one method for ``size`` rays, and the depth buffer they share."""

    def __init__(self, gpu: Gpu, state: Record, size: tuple[int, int], statistics: bool,
                 precision: Precision) -> None:
        gpu.check_size(*size, f"the state of {size[0] * size[1]} rays")
        self.gpu, self.size, self.precision = gpu, size, precision
        self._state, self._smaller = state, dict[tuple[int, int], StateBuffers]()
        self.records = [precision.layout(state), precision.layout(HIT)]
        self.records += [COUNTERS] if statistics else []
        self.counts = statistics
        self.depth = gpu.context.depth_renderbuffer(size)
        self.mask = gpu.context.framebuffer(depth_attachment=self.depth)
        self._sides: list[StateBuffer] = []

    def side(self, index: int) -> StateBuffer:
        """Side 0 or 1; the second is made when a schedule first asks for it."""
        while len(self._sides) <= index:
            self._sides.append(StateBuffer(self.gpu, self.records, self.size, self.depth))
        return self._sides[index]

    def keep(self, sizes: Iterable[tuple[int, int]]) -> None:
        """Have buffers of these sizes at hand too, for fewer rays, and of no others."""
        wanted = set(sizes)
        for size in set(self._smaller) - wanted:
            release(self._smaller.pop(size))
        for size in wanted - set(self._smaller):
            self._smaller[size] = StateBuffers(self.gpu, self._state, size, self.counts,
                                               self.precision)
            self._smaller[size].side(0)

    def of(self, size: tuple[int, int]) -> StateBuffers:
        """Those for rays of this size: these, or some that are kept."""
        return self if size == self.size else self._smaller[size]

    def __iter__(self) -> Iterator[StateBuffer]:
        return iter(self._sides)

    def bytes(self) -> int:
        return (sum(texture_bytes(side.textures) for side in self)
                + sum(other.bytes() for other in self._smaller.values()))

    def release(self) -> None:
        release(self._sides, self._smaller, self.mask, self.depth)
