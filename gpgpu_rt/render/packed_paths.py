"""Packed paths: packs the live paths of a wave side by side into smaller textures.

A wave is a set of paths that are traced together. A path is live until it ends. The texels of
ended paths stay in the texture beside live paths, and waste lanes of packets and SIMD units.
Stream reduction (D. Horn, "Stream Reduction Operations for GPGPU Applications", GPU Gems 2, 2005;
survey, sections 3.6 and 4.3) packs the live paths, in the order of squares of 8x8 texels, so that
packets and tiles still contain neighbours.

A packed path keeps the position of its original texel, on which its random numbers depend. At the
end, a pass draws a point for each packed path to add the path's light to the original texel. So
packing does not change the bits of a picture.
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
from ..gl.target import Target
from ..gl.textures import release
from ..options import Option
from ..rays.order import SQUARE, squares
from ..rays.records import RAY_TEXELS
from ..rays.textures import RayTextures
from .integrator import Integrator, PicturePass
from .picture_streams import PictureStreams, PixelStream
from .records import CAME_FROM, RADIANCE, WALK

LEAST = 1 << 11     # texels of the smallest textures; smaller passes would not be faster
PACKED = ("PACKED_PATHS",)
# Largest share that the option ``compact`` accepts. Each texture size has this share of the texels
# of the next larger size, so all packed textures together need three times the memory of a wave.
MOST_SHARE = 0.75
SHARES = {"auto": 0.25, "on": 0.25, "off": 0.0}
# Packing saves time in waves of at least this many texels; see docs/path-tracing.md.
AUTO = 1 << 15

COMPACT = Option("compact", "auto", "pack the live paths into smaller textures: on, off, auto (in "
                 "large waves), or a number: pack if at most this share of the texels is live",
                 float,
                 words=tuple(SHARES), minimum=0, label="pack live paths")

_WRITES = (("rays", RAY_TEXELS), ("walk", WALK), ("radiance", RADIANCE), ("came_from", CAME_FROM))
PACKING = (
    PicturePass("path live", "render/path_live.frag", PACKED, (("walk", WALK),)),
    PicturePass("path flags", "render/path_flags.frag", PACKED, (("walk", WALK),),
                (("values", VALUES),)),
    PicturePass("pack paths", "render/path_pack.frag", PACKED, (("source", SOURCE),), _WRITES),
    PicturePass("pack paths again", "render/path_pack.frag", PACKED, (("source", SOURCE),),
                _WRITES, ("PACKED",)),
    PicturePass("bring back", "render/bring_back.frag", PACKED, (("came_from", CAME_FROM),),
                (("radiance", RADIANCE),), points="render/bring_back.vert"),
)


class PathTextures:
    """The textures of one size for the paths of a wave. A depth buffer masks ended paths.

    Parameters
    ----------
    gpu : the OpenGL context
    room : the streams of the paths; for packed paths, also "rays" and "came from"

    Attributes
    ----------
    now, then : the current rays of the paths, and the rays of the next vertex
    walk : the names of the streams of path states that belong to ``now`` and ``then``
    """

    def __init__(self, gpu: Gpu, room: PictureStreams) -> None:
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
        """Start paths along these rays, and unmask all texels."""
        self.now, self.then, self.walk = rays, self.room.rays["next rays"], ("walk 0", "walk 1")
        self.gpu.clear(self.mask, depth=1.0)

    def turn(self) -> None:
        """Swap the streams: the next vertex reads what the current vertex wrote."""
        self.now, self.then, self.walk = self.then, self.now, self.walk[::-1]

    def samplers(self) -> dict[str, moderngl.Texture]:
        """Return the textures of the path states, which a vertex reads beside the rays."""
        packed = self.room.samplers("came from", "came_from") if self.packed else {}
        return {**self.room.samplers(self.walk[0], "walk"), **packed}

    @contextmanager
    def target(self, rays: RayTextures | None, *streams: str) -> Iterator[Target]:
        """Yield a target of ``rays`` and existing ``streams``, with the mask's depth buffer."""
        textures = {"rays": rays.textures} if rays is not None else {}
        textures |= {name: self.room.textures(name) for name in streams if name in self.room}
        target = Target(self.gpu, (), self.size, self._depth, textures)
        try:
            yield target
        finally:
            release(target)

    def release(self) -> None:
        """Free the mask, but not the streams."""
        release(self.mask, self._depth)


class PackedPaths:
    """The smaller textures for packed paths; each size has ``share`` times the texels of the next
    larger size.

    Parameters
    ----------
    drawer : the integrator, whose passes trace and pack the paths
    size : (width, height) of a wave
    precision : the precision of the textures
    share : pack paths into smaller textures if at most this share of the texels contains live
        paths; 0 turns packing off
    """

    def __init__(self, drawer: Integrator, size: tuple[int, int], precision: Precision,
                 share: float) -> None:
        self._drawer, self.wave, self.share = drawer, size, share
        streams = [*drawer.streams(), PixelStream("rays", RAY_TEXELS),
                   PixelStream("came from", CAME_FROM)]
        self._rooms = [PictureStreams(drawer.gpu, smaller, precision,
                                      [s for s in streams if drawer.needs.want(s.wanted)])
                       for smaller in packed_sizes(size, share)]
        self._levels = [PathTextures(drawer.gpu, room) for room in self._rooms]
        self._kept = 0

    @property
    def sizes(self) -> list[tuple[int, int]]:
        """The sizes of the textures, (width, height), largest first."""
        return [level.size for level in self._levels]

    def pack(self, level: PathTextures, live: int) -> PathTextures:
        """Pack ``live`` paths into the smallest textures that hold the paths, and return these
        textures. If no smaller textures hold the paths, return ``level``.

        If the paths are packed already, first add their light to their original texels.

        Parameters
        ----------
        level : the current textures of the paths
        live : the number of live paths
        """
        fits = [other for other in self._levels if live <= other.texels < level.texels]
        if not fits:
            return level
        self.bring_back(level)
        smaller = fits[-1]
        drawer, across = self._drawer, _across(level.size)
        with StreamRoom(drawer.gpu) as room:
            flags = room.stream(VALUES, _elements(level.size))
            drawer.run("path flags", flags, level.samplers(), size=level.size,
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

    def bring_back(self, level: PathTextures) -> None:
        """Add the light of packed paths to their original texels in the wave."""
        assert self._drawer.room is not None
        if level.packed:
            self._drawer.run("bring back", self._drawer.room.target("radiance"), {
                **level.room.samplers("radiance", "radiance"), **level.samplers()},
                points=self._kept, size=self.wave, squares_a_row=_across(level.size))

    def bytes(self) -> dict[str, int]:
        """Return the bytes of each stream in each size, by name."""
        return {f"{name} of {room.size[0]}x{room.size[1]} packed": taken
                for room in self._rooms for name, taken in room.bytes().items()}

    def release(self) -> None:
        release(self._levels, self._rooms)


def share_of(options: Mapping[str, Any], texels: int = AUTO) -> float:
    """Return the largest share of live paths at which the option ``compact`` packs a wave of
    ``texels`` texels; 0 for never."""
    share = SHARES.get(options["compact"], options["compact"])
    if options["compact"] == "auto" and texels < AUTO:
        share = 0.0
    if not share <= MOST_SHARE:
        raise OptionError(f"compact is {share!r}; give a share of {MOST_SHARE} at most, or one "
                          f"of {', '.join(SHARES)}")
    return float(share)


def packed_sizes(size: tuple[int, int], share: float) -> list[tuple[int, int]]:
    """Return the sizes of the textures for packed paths: ``share``, share^2, share^3 ... of a
    wave's texels, rounded up to whole squares. Sizes of less than LEAST texels are left out. The
    list is empty if the wave has more texels than float32 can count."""
    texels, sizes = size[0] * size[1] * share, []
    while LEAST <= texels and _elements(size) < EXACT_INTEGER:
        sizes.append(squares(int(np.ceil(texels))))
        texels *= share
    return [(SQUARE * across, SQUARE * down) for across, down in sizes
            if SQUARE ** 2 * across * down < size[0] * size[1]]


def _across(size: tuple[int, int]) -> int:
    """Return the number of squares in a row; the last square may be incomplete."""
    return -(-size[0] // SQUARE)


def _elements(size: tuple[int, int]) -> int:
    """Return the number of texels of all squares."""
    return SQUARE ** 2 * _across(size) * -(-size[1] // SQUARE)
