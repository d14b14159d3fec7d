"""Textures of rays, and ping-pong buffers of the state of each ray's traversal."""
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
    """The textures of a set of rays, a texel per ray.

    Parameters
    ----------
    size : (width, height) in rays
    precision : the number formats of the textures
    after_hit : whether rays continue after a hit (RAY_AFTER_HIT), which needs a third texture
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int], precision: Precision,
                 after_hit: bool = False) -> None:
        self.gpu, self.size, self.precision = gpu, size, precision
        self.after_hit = after_hit
        self.in_textures = precision.layout(RAY_AFTER_HIT if after_hit else RAY_TEXELS)
        self.target = Target(gpu, self.in_textures, size)
        self.textures = self.target.textures
        self._start: np.ndarray | None = None
        self._start_written = True      # whether the texture holds the start of each ray
        self.seen_from: Camera | None = None    # the camera, for rays through pixel centres
        self.tiles: TileBounds | None = None    # bounds of directions; they need a shared start

    def share_start(self, start: np.ndarray | None) -> None:
        """Set the rays' shared start, (4,) float32: origin and t_min >= 0. None: no shared start.

        Programs read a shared start from a uniform. This saves a fetch per ray, and repeated work
        that depends only on the start.
        """
        self.seen_from = self.tiles = None
        self._start = None if start is None else self.precision.stored(start)
        self._start_written = True

    def share_with(self, other: RayTextures) -> None:
        """Use the shared start of ``other``, a set of rays that contains these rays."""
        self._start = other._start

    def like(self, size: tuple[int, int]) -> RayTextures:
        """Return textures of another size for rays of the same kind."""
        return RayTextures(self.gpu, size, self.precision, self.after_hit)

    def fits(self, other: RayTextures, size: tuple[int, int] | None = None) -> bool:
        """Return whether these textures have this ``size`` and hold the same kind of rays as
        ``other``. By default, ``size`` is the size of ``other``.
        """
        return self.size == (size or other.size) and self.after_hit == other.after_hit

    @property
    def record(self) -> Record:
        """The record of the rays for traversal programs."""
        record = self.in_textures
        return record if self._start is None else replace(record, uniform_texels=(0,))

    @property
    def bounded(self) -> bool:
        """Whether all rays share a start and the bounds of each tile's directions are known."""
        return self.tiles is not None and self._start is not None

    def uniforms(self) -> dict[str, tuple[float, ...]]:
        """Return the uniforms of a shared start."""
        return {} if self._start is None else {
            f"{RAY_TEXELS.name}_texel_0": tuple(self._start.tolist())}

    def upload(self, batch: RayBatch) -> None:
        """Upload rays. A shared start is not uploaded, because programs read the uniform."""
        self.share_start(batch.start)
        self._start_written = self._start is None
        # The bounds of tiles omit rays whose fp32 interval is empty. In a format with fewer bits,
        # such an interval may round to a point, and the bounds would lack a live ray.
        self.tiles = batch.tiles if self.precision.storage == "fp32" else None
        for texel in range(0 if self._start_written else 1, RAY_TEXELS.texels):
            self._write(texel, batch.texels(texel))

    def write(self, texels: np.ndarray) -> None:
        """Upload (height, width, textures, 4) float32 texels."""
        self.share_start(None)
        for texel in range(len(self.textures)):
            self._write(texel, texels[:, :, texel])

    def _write(self, texel: int, values: np.ndarray) -> None:
        stored, texture = self.precision.stored(values), self.textures[texel]
        write_texture(texture, np.ascontiguousarray(stored, "<" + texture.dtype))

    def samplers(self) -> dict[str, moderngl.Texture]:
        """Return sampler name -> texture for programs that read rays by ``record``."""
        found = dict(self.target.samplers())
        if not self._start_written:
            del found[f"{RAY_TEXELS.name}_texel_0"]
        return found

    def complete(self) -> RayTextures:
        """Write a shared start into its texture, for programs without the uniform; return self."""
        if not self._start_written:
            assert self._start is not None
            self._write(0, np.broadcast_to(self._start, (*self.size[::-1], 4)))
            self._start_written = True
        return self

    def bytes(self) -> int:
        return self.target.bytes()

    def release(self) -> None:
        release(self.target)


def read_field(record: Record, name: str,
               samplers: Mapping[str, moderngl.Texture]) -> np.ndarray:
    """Read back a record's field from the texture that holds the field."""
    field = record.field(name)
    return field.of(read_texture(samplers[f"{record.name}_texel_{field.texel}"]))


class PingPong:
    """Two targets of the same records with one depth buffer. Passes draw into them alternately.

    Attributes
    ----------
    mask : a framebuffer with only the depth buffer, for passes that mask or count texels
    """

    def __init__(self, gpu: Gpu, records: Sequence[Record], size: tuple[int, int]) -> None:
        self.gpu, self.records, self.size = gpu, records, size
        self.depth = gpu.context.depth_renderbuffer(size)
        self.mask = gpu.context.framebuffer(depth_attachment=self.depth)
        self._sides: list[Target] = []

    def side(self, index: int) -> Target:
        """Return target 0 or target 1. A target is made at its first request."""
        while len(self._sides) <= index:
            self._sides.append(Target(self.gpu, self.records, self.size, self.depth))
        return self._sides[index]

    def __iter__(self) -> Iterator[Target]:
        return iter(self._sides)

    def bytes(self) -> int:
        return sum(side.bytes() for side in self._sides)

    def release(self) -> None:
        release(self._sides, self.mask, self.depth)


class StateBuffers(PingPong):
    """Ping-pong buffers of rays' states, hits and, with ``statistics``, counters."""

    def __init__(self, gpu: Gpu, state: Record, size: tuple[int, int], statistics: bool,
                 precision: Precision) -> None:
        gpu.check_size(*size, f"the state of {size[0] * size[1]} rays")
        super().__init__(gpu, [precision.layout(state), precision.layout(HIT),
                               *([COUNTERS] if statistics else [])], size)
        self.precision, self.counts = precision, statistics
        self._hits: Target | None = None
        self._state, self._smaller = state, dict[tuple[int, int], StateBuffers]()

    def hits(self) -> Target:
        """Return a target that has only the hits of side 0.

        The states of side 0 are cleared: a cleared state means that the ray's search has ended.
        If other code (a count of stopped rays, statistics, an observer) needs the real states,
        call `write_states` and draw into ``side(0)`` instead.
        """
        if self._hits is None:
            self.side(0).clear()
            self._hits = self.side(0).part(self.precision.layout(HIT))
        return self._hits

    def write_states(self) -> None:
        """Prepare for passes that write states. The next call of `hits` clears the states."""
        release(self._hits)
        self._hits = None

    def keep(self, sizes: Iterable[tuple[int, int]]) -> None:
        """Make smaller buffers of these sizes, and release smaller buffers of other sizes."""
        wanted = set(sizes)
        for size in set(self._smaller) - wanted:
            release(self._smaller.pop(size))
        for size in wanted - set(self._smaller):
            self._smaller[size] = StateBuffers(self.gpu, self._state, size, self.counts,
                                               self.precision)
            self._smaller[size].side(0)

    def of(self, size: tuple[int, int]) -> StateBuffers:
        """Return the buffers of this size: these buffers, or buffers that ``keep`` made."""
        return self if size == self.size else self._smaller[size]

    def bytes(self) -> int:
        return super().bytes() + sum(other.bytes() for other in self._smaller.values())

    def release(self) -> None:
        release(self._smaller, self._hits)
        super().release()
