"""Rays in textures, and the state that passes ping-pong."""
from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.precision import Precision
from ..gl.record import Record
from ..gl.textures import (
    read_texture, release, stream_samplers, stream_textures, texture_bytes, write_texture
)
from ..scene.camera import Camera
from .batch import RayBatch
from .records import COUNTERS, HIT, RAY_AFTER_HIT, RAY_TEXELS
from .tile_bounds import TileBounds

ByRay = Callable[[np.ndarray], np.ndarray]    # what a texture holds, (k, 4) -> (n, 4), ray by ray


def whole(texels: np.ndarray) -> np.ndarray:
    """Texels as they lie."""
    return texels


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
        self._start_written = True      # in the texture too
        self.seen_from: Camera | None = None    # whose pixels' centres they go through, if so
        self.tiles: TileBounds | None = None    # of directions only where the start is shared

    def share_start(self, start: np.ndarray | None) -> None:
        """All rays have this origin and t_min, (4,) float32, which is not below 0; None: they may
        differ. Programs read what is shared from a uniform, which saves a fetch and whatever
        follows from it alone."""
        self.seen_from = self.tiles = None
        self._start = None if start is None else self.precision.stored(start)
        self._start_written = True

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

    @property
    def bounded(self) -> bool:
        """Whether it is known between which directions the rays of each tile go from one point."""
        return self.tiles is not None and self._start is not None

    def uniforms(self) -> dict[str, tuple[float, ...]]:
        """What programs read from uniforms."""
        return {} if self._start is None else {
            f"{RAY_TEXELS.name}_texel_0": tuple(self._start.tolist())}

    def upload(self, batch: RayBatch) -> None:
        """Take rays; where they share their start, that is left to the uniform."""
        self.share_start(batch.start)
        self._start_written = self._start is None
        # Stored in fewer bits, an empty ray may be one that ends where it begins.
        self.tiles = batch.tiles if self.precision.storage == "fp32" else None
        for texel in range(0 if self._start_written else 1, RAY_TEXELS.texels):
            self._write(texel, batch.texels(texel))

    def write(self, texels: np.ndarray) -> None:
        """Take (height, width, textures, 4) float32 texels."""
        self.share_start(None)
        for texel in range(len(self.textures)):
            self._write(texel, texels[:, :, texel])

    def _write(self, texel: int, values: np.ndarray) -> None:
        stored, texture = self.precision.stored(values), self.textures[texel]
        write_texture(texture, np.ascontiguousarray(stored, "<" + texture.dtype))

    def samplers(self) -> dict[str, moderngl.Texture]:
        """What programs sample that read rays as ``record`` says."""
        found = stream_samplers(RAY_TEXELS.name, self.textures)
        if not self._start_written:
            del found[f"{RAY_TEXELS.name}_texel_0"]
        return found

    def complete(self) -> RayTextures:
        """These, with what is shared in the textures too, for programs that ask for no uniform."""
        if not self._start_written:
            assert self._start is not None
            self._write(0, np.broadcast_to(self._start, (*self.size[::-1], 4)))
            self._start_written = True
        return self

    def release(self) -> None:
        release(self.target, self.textures)


def read_stream(record: Record, samplers: Mapping[str, moderngl.Texture]) -> dict[str, np.ndarray]:
    """(height, width) or (height, width, k) by field: a stream read back from what it is sampled
    by."""
    return record.unpack_planes([read_texture(samplers[f"{record.name}_texel_{texel}"])
                                 for texel in range(record.texels)])


def read_field(record: Record, name: str,
               samplers: Mapping[str, moderngl.Texture]) -> np.ndarray:
    """One field of a stream, from the one texture that has it."""
    field = record.field(name)
    return field.of(read_texture(samplers[f"{record.name}_texel_{field.texel}"]))


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

    def fields(self, name: str, by_ray: ByRay = whole) -> dict[str, np.ndarray]:
        """Fields of the record ``name``, one entry a texel, row by row, or as ``by_ray`` says."""
        texels = [by_ray(read_texture(texture).reshape(-1, 4)) for texture in self.streams[name]]
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
