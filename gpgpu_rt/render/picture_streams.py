"""Picture streams: the data that an integrator keeps for each pixel, and the passes' targets."""
from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import moderngl

from ..gl.context import Gpu
from ..gl.full_screen import Rectangles
from ..gl.precision import Precision
from ..gl.record import Record
from ..gl.target import Target
from ..gl.textures import release
from ..rays.records import HIT, NO_RAY, RAY_TEXELS
from ..rays.textures import RayTextures


def held(record: Record, precision: Precision) -> Record:
    """Return a stream's record as its textures store it: rays and hits in the format of the option
    ``storage``, other records in float32."""
    return precision.layout(record) if record in (RAY_TEXELS, HIT) else record


@dataclass(frozen=True)
class PixelStream:
    """A stream of an integrator: a record for each pixel, or for each tile of pixels.

    Attributes
    ----------
    name : the stream's name in plans
    record : the record of a pixel or tile
    wanted : the stream exists if one of these defines is set, or if the tuple is empty
    tile : side in pixels of the tile that a record describes; 1 for a record per pixel
    """

    name: str
    record: Record
    wanted: tuple[str, ...] = ()
    tile: int = 1


class PictureStreams:
    """The streams of a picture, by name. Ray streams are RayTextures."""

    def __init__(self, gpu: Gpu, size: tuple[int, int], precision: Precision,
                 streams: Iterable[PixelStream]) -> None:
        self.gpu, self.size, self.precision = gpu, size, precision
        self.rays: dict[str, RayTextures] = {}
        self._own: dict[str, Target] = {}
        self._several: dict[tuple[str, ...], Target] = {}
        self.rectangles = Rectangles(gpu)      # the rectangles of the current wave (waves.py)
        for stream in streams:
            if stream.record is RAY_TEXELS:
                self.rays[stream.name] = RayTextures(gpu, size, precision)
            else:
                self._own[stream.name] = Target(gpu, held(stream.record, precision), (
                    -(-size[0] // stream.tile), -(-size[1] // stream.tile)))

    def __contains__(self, name: str) -> bool:
        return name in self._own or name in self.rays

    def _of(self, name: str) -> Target:
        return self.rays[name].target if name in self.rays else self._own[name]

    def samplers(self, name: str, as_name: str) -> Mapping[str, moderngl.Texture]:
        """Return sampler name -> texture of a stream that the program calls ``as_name``."""
        return self._of(name).samplers(as_name)

    def textures(self, name: str) -> list[moderngl.Texture]:
        """Return the textures of a stream, one for each texel of its record."""
        return self._of(name).textures

    def target(self, *names: str) -> Target:
        """Return a target of several streams. Names without a stream are ignored."""
        return self._over({name: self.textures(name) for name in names if name in self})

    def _over(self, streams: dict[str, list[moderngl.Texture]]) -> Target:
        key = tuple(streams)
        if key not in self._several:
            size = next(iter(streams.values()))[0].size
            self._several[key] = Target(self.gpu, (), size, borrowed=streams)
        return self._several[key]

    def clear_rays(self, name: str) -> None:
        """Write empty rays into a stream."""
        for k, texel in enumerate(NO_RAY[:RAY_TEXELS.texels].tolist()):
            self._over({f"{name}, texel {k}": [self.textures(name)[k]]}).clear(*texel)

    def bytes(self) -> dict[str, int]:
        """Return the bytes of each stream."""
        return {name: self._of(name).bytes() for name in (*self.rays, *self._own)}

    def release(self) -> None:
        release(self.rectangles, self._several, self.rays, self._own)
