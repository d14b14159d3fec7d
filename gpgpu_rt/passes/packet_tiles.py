"""Packets where there is something to trace: tiles without are not drawn."""
from __future__ import annotations

import math
from typing import NamedTuple

import moderngl
import numpy as np

from ..gpu import Gpu
from ..ray_state import RayTextures, read_field
from ..record import Record
from ..texel_layout import PACKET_ENTRY, TILE_BOUNDS
from ..textures import release, texture_bytes, write_texture
from ..tile_bounds import SIDE
from .driver import Samplers
from .entry_points import TileImage
from .primitive_pass import PrimitivePass

SQUARE = 8     # packets a side, at least, that are drawn or left out together


class KnownTiles(NamedTuple):
    """Which tiles have something to trace.

    kind : how that is known: ``met``, by the beams that went first, or ``live``, by the rays
    something : (down, across) bool
    samplers : of what says so to programs
    """

    kind: str
    something: np.ndarray
    samplers: Samplers


class TileBoundsImage:
    """TILE_BOUNDS of the tiles of rays, in textures."""

    def __init__(self, gpu: Gpu) -> None:
        self.gpu = gpu
        self._image: TileImage | None = None
        self._size = (0, 0)

    def of(self, rays: RayTextures, side: int) -> TileImage:
        """Those of tiles of so many rays a side."""
        assert rays.tiles is not None
        tiles = rays.tiles.of_side(side)
        if self._image is None or self._size != tiles.size:
            self.release()
            self._image, self._size = TileImage(self.gpu, TILE_BOUNDS, tiles.size), tiles.size
        texels = TILE_BOUNDS.pack(
            live=tiles.live.reshape(-1), least=tiles.least.reshape(-1, 3),
            most=tiles.most.reshape(-1, 3))
        for texel, texture in enumerate(self._image.textures):
            write_texture(texture, np.ascontiguousarray(texels[:, texel]))
        return self._image

    def bytes(self) -> int:
        return texture_bytes(self._image.textures) if self._image is not None else 0

    def release(self) -> None:
        release(self._image)
        self._image = None


class TilePass(PrimitivePass):
    """A pass over the packets of those tiles that have something, or of those that have not."""

    def __init__(self, gpu: Gpu, fragment: str, defines: dict[str, object],
                 virtual: dict[str, str]) -> None:
        super().__init__(gpu, fragment, "passes/packet_tiles.vert", defines, virtual)
        self.squares: np.ndarray | None = None  # (down, across) bool, those that it is drawn on
        self.square = 1                         # packets a side of one

    def covered(self, size: tuple[int, int]) -> np.ndarray | None:
        """As of a ``FragmentPass``."""
        if self.squares is None:
            return None
        packets = self.squares.repeat(self.square, 0).repeat(self.square, 1)
        return np.argwhere(packets[:size[1], :size[0]])[:, ::-1]


class PacketTiles:
    """What packets are drawn on: points over those whose tile has something to trace.

    Parameters
    ----------
    packet : (width, height) rays a packet, powers of two
    entry_tile : rays a side of the tiles whose beams go first, None where none do
    """

    def __init__(self, gpu: Gpu, packet: tuple[int, int], entry_tile: int | None) -> None:
        self.gpu, self.packet, self.entry_tile = gpu, packet, entry_tile
        self._bounds = TileBoundsImage(gpu)
        self._largest = gpu.context.info["GL_POINT_SIZE_RANGE"][1]

    def known(self, rays: RayTextures, samplers: Samplers) -> KnownTiles | None:
        """What is known of these rays' tiles; None where nothing is that would leave one out, and
        the whole is drawn, which takes less than points do."""
        if rays.tiles is None or self.gpu.whole:
            return None
        kind = "met" if self.entry_tile and rays.bounded else "live"
        if self._square(kind) > self._largest:
            return None
        if kind == "met":   # all that is drawn waits for these beams as it is
            something = read_field(PACKET_ENTRY, "met", samplers) != 0
        else:
            something = rays.tiles.of_side(self._side(kind)).live
        if something.all():
            return None
        if kind == "live":
            samplers = {**samplers, **self._bounds.of(rays, self._side(kind)).samplers()}
        return KnownTiles(kind, something, samplers)

    def glsl(self, kind: str) -> str:
        """What the vertex program includes as <tiles>."""
        record: Record = PACKET_ENTRY if kind == "met" else TILE_BOUNDS
        return (f"{record.stream_glsl(writes=False)}\nconst int SIDE = {self._side(kind)};\n"
                f"const int SQUARE = {self._square(kind)};\n"
                f"const ivec2 PACKET_SIZE = ivec2{self.packet};\n"
                "bool has_something(ivec2 tile) {\n"
                f"    return {record.name}_load(tile).{kind} != 0;\n}}")

    def draw(self, one: TilePass, target: moderngl.Framebuffer, tiles: KnownTiles,
             with_something: bool) -> None:
        """Draw the packets of the tiles that have something, or of the others."""
        squares, square = self._squares(tiles), self._square(tiles.kind)
        one.squares, one.square = squares == with_something, square
        down, across = squares.shape
        one.set(squares=(across, down), with_something=with_something)
        self.gpu.context.enable_only(moderngl.PROGRAM_POINT_SIZE)
        # Whole tiles, also past the last ray: a point is dropped whose middle is outside.
        target.viewport = (0, 0, across * square, down * square)
        try:
            one.draw(target, tiles.samplers, moderngl.POINTS, across * down)
        finally:
            target.viewport = (0, 0, *target.size)
            self.gpu.context.enable_only(moderngl.NOTHING)

    def packets(self, tiles: KnownTiles, size: tuple[int, int]) -> int:
        """Of (width, height), those of the tiles that have something."""
        squares, square = self._squares(tiles), self._square(tiles.kind)
        across, down = (np.minimum(square, n - np.arange(0, n, square)) for n in size)
        return int(down @ squares[:len(down), :len(across)] @ across)

    def _squares(self, tiles: KnownTiles) -> np.ndarray:
        """(down, across) bool, points: whether a tile below one has something."""
        found = tiles.something
        for axis, packet in ((1, self.packet[0]), (0, self.packet[1])):
            side, square = self._side(tiles.kind) // packet, self._square(tiles.kind)
            if side > square:
                found = found.repeat(side // square, axis)
            else:
                firsts = np.arange(0, found.shape[axis], square // side)
                found = np.logical_or.reduceat(found, firsts, axis)
        return found

    def _side(self, kind: str) -> int:
        """Rays a side of a tile."""
        if kind == "met":
            assert self.entry_tile is not None
            return self.entry_tile
        return max(SIDE, SQUARE * max(self.packet))

    def _square(self, kind: str) -> int:
        """Packets a side of a point, which may cover several small tiles: points take time too."""
        side = max(self._side(kind), SQUARE * max(self.packet))
        return math.gcd(*(side // p for p in self.packet))

    def bytes(self) -> int:
        return self._bounds.bytes()

    def release(self) -> None:
        release(self._bounds)
