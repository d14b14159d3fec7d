"""Room: the streams of a picture of one size, and what is drawn into them."""
from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import moderngl

from ..gl.context import Gpu
from ..gl.full_screen import Rectangles
from ..gl.precision import Precision
from ..gl.record import Record
from ..gl.textures import release, stream_samplers, stream_textures, texture_bytes
from ..rays.records import HIT, NO_RAY, RAY_TEXELS
from ..rays.textures import RayTextures


def held(record: Record, precision: Precision) -> Record:
    """A stream as its textures hold it: rays and hits follow the option ``storage``."""
    return precision.layout(record) if record in (RAY_TEXELS, HIT) else record


@dataclass(frozen=True)
class PixelStream:
    """A stream of an integrator: a record a pixel, or a tile of pixels.

    Attributes
    ----------
    name : how plans call it
    record : what it holds
    wanted : it exists where one of these defines is set, or always
    tile : pixels a side that one record stands for
    """

    name: str
    record: Record
    wanted: tuple[str, ...] = ()
    tile: int = 1


class Room:
    """Streams by name; those of rays are ready to be traced."""

    def __init__(self, gpu: Gpu, size: tuple[int, int], precision: Precision,
                 streams: Iterable[PixelStream]) -> None:
        self.gpu, self.size, self.precision = gpu, size, precision
        self.rays: dict[str, RayTextures] = {}
        self._textures: dict[str, list[moderngl.Texture]] = {}
        self._targets: dict[tuple[str, ...], moderngl.Framebuffer] = {}
        self.rectangles = Rectangles(gpu)      # of the wave at hand
        for stream in streams:
            if stream.record is RAY_TEXELS:
                self.rays[stream.name] = RayTextures(gpu, size, precision)
                self._textures[stream.name] = self.rays[stream.name].textures
            else:
                self._textures[stream.name] = stream_textures(
                    gpu, held(stream.record, precision),
                    (-(-size[0] // stream.tile), -(-size[1] // stream.tile)))

    def __contains__(self, name: str) -> bool:
        return name in self._textures

    def samplers(self, name: str, as_name: str) -> dict[str, moderngl.Texture]:
        """Sampler name -> texture, of a stream that a program reads as ``as_name``."""
        return stream_samplers(as_name, self._textures[name])

    def textures(self, name: str) -> list[moderngl.Texture]:
        """The textures of a stream, a texel each."""
        return self._textures[name]

    def target(self, *names: str) -> moderngl.Framebuffer:
        """Streams as one target; names that there is no stream of are passed over."""
        return self._target(tuple(name for name in names if name in self))

    def _target(self, names: tuple[str, ...]) -> moderngl.Framebuffer:
        if names not in self._targets:
            self._targets[names] = self.gpu.context.framebuffer(
                [texture for name in names for texture in self._textures[name]])
        return self._targets[names]

    def clear_rays(self, name: str) -> None:
        """Make every ray of a stream an empty one."""
        for k, texel in enumerate(NO_RAY[:RAY_TEXELS.texels].tolist()):
            key = (name, str(k))
            if key not in self._targets:
                self._targets[key] = self.gpu.context.framebuffer([self._textures[name][k]])
            self._targets[key].clear(*texel)

    def bytes(self) -> dict[str, int]:
        """Bytes by stream."""
        return {name: texture_bytes(textures) for name, textures in self._textures.items()}

    def release(self) -> None:
        release(self.rectangles, self._targets, self.rays)
        release(textures for name, textures in self._textures.items() if name not in self.rays)
