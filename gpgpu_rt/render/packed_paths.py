"""Packed paths: those of a wave that are left, side by side in smaller textures.

Paths end, and their texels stay: a traversal pass runs over all of a texture, and a ray that is
left keeps the others of its packet, or of its SIMD lanes, company that does nothing. Stream
reduction (D. Horn, "Stream Reduction Operations for GPGPU Applications", GPU Gems 2, 2005; survey,
3.6.2 and 4.3) brings what is left together: squares of 8x8 texels in their order, so that packets
and tiles still find neighbours. Where a path came from goes with it, for its random numbers; so
does what it has found, which a point a path brings back in the end. So pictures keep their bits.
"""
from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import moderngl
import numpy as np

from ..errors import OptionError
from ..gl.algorithms.compact import kept_sources
from ..gl.algorithms.records import SOURCE, VALUES
from ..gl.algorithms.scan import scan
from ..gl.algorithms.streams import StreamRoom
from ..gl.context import Gpu
from ..gl.precision import Precision
from ..gl.record import EXACT_INTEGER
from ..gl.textures import release
from ..options import Option
from ..rays.order import SQUARE, squares
from ..rays.records import RAY_TEXELS
from ..rays.textures import RayTextures
from .integrator import Integrator, Pass
from .picture_streams import PixelStream, Room
from .records import CAME_FROM, RADIANCE, WALK

LEAST = 1 << 11     # texels of the smallest textures: below, passes cost what they cost empty
PACKED = ("PACKED_PATHS",)
MOST_SHARE = 0.75   # that may be left for paths to be packed: three times a wave's memory
SHARES = {"auto": 0.25, "on": 0.25, "off": 0.0}
AUTO = 1 << 15      # texels of a wave from which on packing pays: docs/path-tracing.md

COMPACT = Option("compact", "auto", "pack the remaining paths into smaller textures: on, off, "
                 "auto (in large waves), or the largest share of live texels at which to pack",
                 float,
                 words=tuple(SHARES), minimum=0)

_WRITES = (("rays", RAY_TEXELS), ("walk", WALK), ("radiance", RADIANCE), ("came_from", CAME_FROM))
PACKING = (
    Pass("path live", "render/path_live.frag", PACKED, (("walk", WALK),)),
    Pass("path flags", "render/path_flags.frag", PACKED, (("walk", WALK),),
         (("values", VALUES),)),
    Pass("pack paths", "render/path_pack.frag", PACKED, (("source", SOURCE),), _WRITES),
    Pass("pack paths again", "render/path_pack.frag", PACKED, (("source", SOURCE),),
         _WRITES, ("PACKED",)),
    Pass("bring back", "render/bring_back.frag", PACKED, (("came_from", CAME_FROM),),
         (("radiance", RADIANCE),), points="render/bring_back.vert"),
)


class Level:
    """Textures of one size that the paths of a wave are in, and the depth that masks those that
    ended.

    Parameters
    ----------
    room : the streams of paths; of packed ones also "rays" and "came from"

    Attributes
    ----------
    now, then : rays of the paths, and of those of the next vertex
    walk : names of the streams that go with them
    """

    def __init__(self, gpu: Gpu, room: Room) -> None:
        self.gpu, self.room, self.size = gpu, room, room.size
        self._depth = gpu.context.depth_renderbuffer(room.size)
        self.mask = gpu.context.framebuffer(depth_attachment=self._depth)

    @property
    def texels(self) -> int:
        return self.size[0] * self.size[1]

    @property
    def packed(self) -> bool:
        return "came from" in self.room

    def start(self, rays: RayTextures) -> None:
        """Hold paths that go on by these rays; none has ended."""
        self.now, self.then, self.walk = rays, self.room.rays["next rays"], ("walk 0", "walk 1")
        self.mask.clear(depth=1.0)

    def turn(self) -> None:
        """What was written last is read next."""
        self.now, self.then, self.walk = self.then, self.now, self.walk[::-1]

    def samplers(self) -> dict[str, moderngl.Texture]:
        """What a vertex reads of its paths besides the rays."""
        packed = self.room.samplers("came from", "came_from") if self.packed else {}
        return {**self.room.samplers(self.walk[0], "walk"), **packed}

    @contextmanager
    def target(self, textures: list[moderngl.Texture], *streams: str
               ) -> Iterator[moderngl.Framebuffer]:
        """Textures, and those of streams that there are, as one target with the mask's depth."""
        target = self.gpu.context.framebuffer(
            [*textures, *(t for name in streams if name in self.room
                          for t in self.room.textures(name))], self._depth)
        target.depth_mask = False
        try:
            yield target
        finally:
            release(target)

    def release(self) -> None:
        """Free the mask; the room is released by who made it."""
        release(self.mask, self._depth)


class PackedPaths:
    """The smaller textures of a picture's waves, each with a share of the texels of the one
    before.

    Parameters
    ----------
    drawer : whose passes draw here, and whose streams there are
    size : (width, height) of a wave
    share : of a texture's texels, how many paths may be left to be packed into the next; 0: never
    """

    def __init__(self, drawer: Integrator, size: tuple[int, int], precision: Precision,
                 share: float) -> None:
        self._drawer, self.wave, self.share = drawer, size, share
        streams = [*drawer.streams(), PixelStream("rays", RAY_TEXELS),
                   PixelStream("came from", CAME_FROM)]
        self._rooms = [Room(drawer.gpu, smaller, precision,
                            [s for s in streams if drawer.needs.want(s.wanted)])
                       for smaller in packed_sizes(size, share)]
        self._levels = [Level(drawer.gpu, room) for room in self._rooms]
        self._kept = 0

    @property
    def sizes(self) -> list[tuple[int, int]]:
        """(width, height) of the textures, largest first."""
        return [level.size for level in self._levels]

    def pack(self, level: Level, live: int) -> Level:
        """Where ``live`` paths go on: in the smallest textures that hold them.

        Parameters
        ----------
        level : where they are; what they have found so far goes with them
        """
        fits = [other for other in self._levels if live <= other.texels < level.texels]
        if not fits:
            return level
        self.bring_back(level)
        smaller = fits[-1]
        drawer, across = self._drawer, _across(level.size)
        with StreamRoom(drawer.gpu) as room:
            flags = room.stream(VALUES, _elements(level.size))
            drawer.run("path flags", flags.target, level.samplers(), size=level.size,
                       squares_a_row=across, last_element=flags.length - 1)
            sources = kept_sources(room, scan(room, flags))
            target = smaller.room.target("rays", "walk 0", "radiance", "came from")
            drawer.run("pack paths again" if level.packed else "pack paths", target,
                       {**level.now.samplers(), **level.samplers(), **sources.samplers(),
                        **level.room.samplers("radiance", "radiance")},
                       squares_a_row=_across(smaller.size), from_squares_a_row=across,
                       kept=sources.length)
            self._kept = sources.length
        smaller.start(smaller.room.rays["rays"])
        return smaller

    def bring_back(self, level: Level) -> None:
        """What packed paths have found so far, to the texels of the wave that they came from."""
        assert self._drawer.room is not None
        if level.packed:
            self._drawer.run("bring back", self._drawer.room.target("radiance"), {
                **level.room.samplers("radiance", "radiance"), **level.samplers()},
                points=self._kept, size=self.wave, squares_a_row=_across(level.size))

    def bytes(self) -> dict[str, int]:
        """Bytes by stream and size."""
        return {f"{name} of {room.size[0]}x{room.size[1]} packed": taken
                for room in self._rooms for name, taken in room.bytes().items()}

    def release(self) -> None:
        release(self._levels, self._rooms)


def share_of(options: Mapping[str, Any], texels: int = AUTO) -> float:
    """Of the texels that paths are in, how many may be left for them to be packed, as the option
    ``compact`` says of a wave with so many texels; 0: never."""
    share = SHARES.get(options["compact"], options["compact"])
    if options["compact"] == "auto" and texels < AUTO:
        share = 0.0
    if not share <= MOST_SHARE:
        raise OptionError(f"compact is {share!r}; give a share of {MOST_SHARE} at most, or one "
                          f"of {', '.join(SHARES)}")
    return float(share)


def packed_sizes(size: tuple[int, int], share: float) -> list[tuple[int, int]]:
    """Sizes of textures of whole squares that hold ``share`` of a wave's texels, share times share
    of them, and so on down to LEAST; none for a wave with more texels than floats can count."""
    texels, sizes = size[0] * size[1] * share, []
    while LEAST <= texels and _elements(size) < EXACT_INTEGER:
        sizes.append(squares(int(np.ceil(texels))))
        texels *= share
    return [(SQUARE * across, SQUARE * down) for across, down in sizes
            if SQUARE ** 2 * across * down < size[0] * size[1]]


def _across(size: tuple[int, int]) -> int:
    """Squares in a row, the last one of which may be cut off."""
    return -(-size[0] // SQUARE)


def _elements(size: tuple[int, int]) -> int:
    """Texels of all squares."""
    return SQUARE ** 2 * _across(size) * -(-size[1] // SQUARE)
