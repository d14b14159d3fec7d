"""Ray image: a stream with a texel a ray or a node of rays, and its target."""
from __future__ import annotations

import moderngl

from ..gl.context import Gpu
from ..gl.record import Record
from ..gl.textures import release, stream_samplers, stream_textures


class RayImage:
    """A record for each ray, or for each node of a level, where its texel lies.

    Parameters
    ----------
    size : (width, height)
    textures : to draw into, somebody else's; None: its own
    """

    def __init__(self, gpu: Gpu, record: Record, size: tuple[int, int],
                 textures: list[moderngl.Texture] | None = None) -> None:
        self.record, self.size = record, size
        self.length = size[0] * size[1]
        self._own = textures is None
        self.textures = stream_textures(gpu, record, size) if textures is None else textures
        self.target = gpu.context.framebuffer(self.textures)

    def samplers(self, name: str | None = None) -> dict[str, moderngl.Texture]:
        """Sampler name -> texture, as the record's or another name has them."""
        return stream_samplers(name or self.record.name, self.textures)

    def release(self) -> None:
        release(self.target, self.textures if self._own else None)
