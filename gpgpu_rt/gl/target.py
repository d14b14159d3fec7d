"""Target: textures of one size that hold records, and a framebuffer to draw into all of them."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import moderngl
import numpy as np

from .context import Gpu
from .record import Record
from .textures import (
    read_texture, release, stream_samplers, stream_textures, texture_bytes, write_texture
)

ByRay = Callable[[np.ndarray], np.ndarray]    # texels (k, 4) -> (n, 4), a row per ray


def whole(texels: np.ndarray) -> np.ndarray:
    return texels


class Target:
    """Render targets that hold one or several records at each position.

    Parameters
    ----------
    records : a Record, or several Records in the order of the render targets
    size : (width, height) in texels
    depth : a depth buffer of the same size. Draws are tested against it, but do not write it
    borrowed : name -> textures that another object owns and releases. The record of this name
        uses these textures. If no record has this name, the textures are extra render targets

    Attributes
    ----------
    records : name -> Record
    streams : name -> textures, one per texel of the record
    textures : all textures, in the order of the render targets
    framebuffer : draws into all textures at once
    length : number of positions, width * height
    """

    def __init__(self, gpu: Gpu, records: Record | Sequence[Record], size: tuple[int, int],
                 depth: moderngl.Renderbuffer | None = None,
                 borrowed: Mapping[str, list[moderngl.Texture]] | None = None) -> None:
        self.gpu, self.size, self.length = gpu, size, size[0] * size[1]
        records, given = [records] if isinstance(records, Record) else records, borrowed or {}
        self.records = {record.name: record for record in records}
        self._own = {name: stream_textures(gpu, record, size)
                     for name, record in self.records.items() if name not in given}
        self.streams = {**dict.fromkeys(self.records, []), **self._own, **given}
        self._sampled: tuple[object, Mapping[str, moderngl.Texture]] = None, {}
        self.textures = [texture for stream in self.streams.values() for texture in stream]
        self.framebuffer = gpu.context.framebuffer(self.textures, depth)
        if depth is not None:
            self.framebuffer.depth_mask = False

    @property
    def record(self) -> Record:
        """The first record; most targets have only one."""
        return next(iter(self.records.values()))

    def part(self, record: Record) -> Target:
        """Return a new target for one record, with textures borrowed from ``self``."""
        return Target(self.gpu, record, self.size,
                      borrowed={record.name: self.streams[record.name]})

    def samplers(self, as_name: str | None = None) -> Mapping[str, moderngl.Texture]:
        """Return sampler name -> texture, read-only. For a target of one record, ``as_name``
        replaces the record's name."""
        # Every draw needs this mapping, so keep it until the streams change.
        if as_name is None and self._sampled[0] is self.streams:
            return self._sampled[1]
        found = MappingProxyType({
            sampler: texture for name, textures in self.streams.items()
            for sampler, texture in stream_samplers(as_name or name, textures).items()})
        if as_name is None:
            self._sampled = self.streams, found
        return found

    def fields(self, name: str | None = None, by_ray: ByRay = whole) -> dict[str, np.ndarray]:
        """Read a record back.

        Parameters
        ----------
        name : the record; None for the first record
        by_ray : selects the texels of rays, in the order of the rays

        Returns
        -------
        Field name -> (n,) or (n, width): an entry per texel, row by row, or per ray by ``by_ray``.
        """
        record = self.records[name] if name else self.record
        return read_record(record, stream_samplers(record.name, self.streams[record.name]), by_ray)

    def write(self, name: str, **fields: np.ndarray) -> None:
        """Upload a record: the inverse of ``fields``. Texels past the last entry become 0."""
        packed = self.records[name].pack(**fields)
        for texel, texture in enumerate(self.streams[name]):
            texels = np.zeros((self.length, packed.shape[2]), "<" + texture.dtype)
            texels[:len(packed)] = packed[:, texel]
            write_texture(texture, texels)

    def clear(self, *colour: float, **more: Any) -> None:
        """Fill every texture, with the parameters of ``moderngl.Framebuffer.clear``."""
        self.gpu.clear(self.framebuffer, *colour, **more)

    def bytes(self) -> int:
        """Return the bytes of the textures, without borrowed textures."""
        return sum(map(texture_bytes, self._own.values()))

    def release(self) -> None:
        """Free the framebuffer and the textures, except borrowed textures."""
        release(self.framebuffer, self._own)


def read_record(record: Record, samplers: Mapping[str, moderngl.Texture],
                by_ray: ByRay = whole) -> dict[str, np.ndarray]:
    """Read a record from the textures that a pass samples; see ``Target.fields``."""
    texels = [by_ray(read_texture(samplers[f"{record.name}_texel_{texel}"]).reshape(-1, 4))
              for texel in range(record.texels)]
    return record.unpack(texels[0][:, None] if len(texels) == 1 else np.stack(texels, axis=1))


Drawable = Target | moderngl.Framebuffer    # a target of draws


def framebuffer_of(target: Drawable) -> moderngl.Framebuffer:
    return target.framebuffer if isinstance(target, Target) else target
