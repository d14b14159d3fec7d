"""Rays in textures, and the state that passes ping-pong."""
from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.precision import Precision
from ..gl.record import Record
from ..gl.target import Target
from ..gl.textures import read_texture, release, write_texture
from ..scene.camera import Camera
from .batch import RayBatch
from .records import COUNTERS, HIT, RAY_AFTER_HIT, RAY_TEXELS
from .tile_bounds import TileBounds


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
        self.target = Target(gpu, self.in_textures, size)
        self.textures = self.target.textures
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
        found = self.target.samplers()
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

    def bytes(self) -> int:
        """Bytes of the textures."""
        return self.target.bytes()

    def release(self) -> None:
        release(self.target)


def read_field(record: Record, name: str,
               samplers: Mapping[str, moderngl.Texture]) -> np.ndarray:
    """One field of a stream, from the one texture that has it."""
    field = record.field(name)
    return field.of(read_texture(samplers[f"{record.name}_texel_{field.texel}"]))


class PingPong:
    """Two targets of the same records that passes draw into by turns, and their depth buffer.

    Attributes
    ----------
    mask : the depth buffer alone, for passes that mask texels or count them
    """

    def __init__(self, gpu: Gpu, records: Sequence[Record], size: tuple[int, int]) -> None:
        self.gpu, self.records, self.size = gpu, records, size
        self.depth = gpu.context.depth_renderbuffer(size)
        self.mask = gpu.context.framebuffer(depth_attachment=self.depth)
        self._sides: list[Target] = []

    def side(self, index: int) -> Target:
        """Side 0 or 1; the second is made when a schedule first asks for it."""
        while len(self._sides) <= index:
            self._sides.append(Target(self.gpu, self.records, self.size, self.depth))
        return self._sides[index]

    def __iter__(self) -> Iterator[Target]:
        return iter(self._sides)

    def bytes(self) -> int:
        """Bytes of the targets that exist."""
        return sum(side.bytes() for side in self._sides)

    def release(self) -> None:
        release(self._sides, self.mask, self.depth)


class StateBuffers(PingPong):
    """State, hit and, with ``statistics``, counters of ``size`` rays by one method."""

    def __init__(self, gpu: Gpu, state: Record, size: tuple[int, int], statistics: bool,
                 precision: Precision) -> None:
        gpu.check_size(*size, f"the state of {size[0] * size[1]} rays")
        super().__init__(gpu, [precision.layout(state), precision.layout(HIT),
                               *([COUNTERS] if statistics else [])], size)
        self.precision, self.counts = precision, statistics
        self._state, self._smaller = state, dict[tuple[int, int], StateBuffers]()

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

    def bytes(self) -> int:
        """Bytes of the targets of all sizes."""
        return super().bytes() + sum(other.bytes() for other in self._smaller.values())

    def release(self) -> None:
        release(self._smaller)
        super().release()
