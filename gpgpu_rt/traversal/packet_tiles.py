"""Packets where there is something to trace: tiles without are not drawn."""
from __future__ import annotations

import math
from typing import NamedTuple

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.primitive_pass import PrimitivePass
from ..gl.target import Target
from ..gl.textures import release
from ..rays.textures import RayTextures, read_field
from ..rays.tile_bounds import SIDE
from .driver import Samplers
from .records import PACKET_ENTRY

SQUARE = 8     # packets a side, at least, that are drawn or left out together


class Squares(NamedTuple):
    """Packets by the square, which are drawn or left out together.

    some : (down, across) bool, where there is something to trace
    side : packets a side of a square
    """

    some: np.ndarray
    side: int

    def packets(self, size: tuple[int, int]) -> int:
        """Return the number of packets to draw, given (width, height) of all packets."""
        across, down = (np.minimum(self.side, n - np.arange(0, n, self.side)) for n in size)
        return int(down @ self.some[:len(down), :len(across)] @ across)


class TilePass(PrimitivePass):
    """A pass over squares of packets."""

    def __init__(self, gpu: Gpu, fragment: str, defines: dict[str, object],
                 virtual: dict[str, str]) -> None:
        super().__init__(gpu, fragment, "drivers/packet_tiles.vert", defines, virtual)
        self._squares = Squares(np.zeros((0, 0), bool), 1)      # those that it is drawn on
        self._places: moderngl.Buffer | None = None

    def covered(self, size: tuple[int, int]) -> np.ndarray:
        """As of a ``FragmentPass``: always known."""
        drawn, side = self._squares
        packets = drawn.repeat(side, 0).repeat(side, 1)
        return np.argwhere(packets[:size[1], :size[0]])[:, ::-1]

    def draw_on(self, squares: Squares, target: Target, samplers: Samplers) -> None:
        """Draw the packets of those squares that have something."""
        down, across = squares.some.shape
        places = np.argwhere(squares.some)[:, ::-1].astype(np.int32, order="C")
        if self._places is None or self._places.size < 8 * squares.some.size:
            release(self._places)
            self._places = self.gpu.context.buffer(reserve=8 * squares.some.size, dynamic=True)
            self.take(self._places, "2i", "square")
        if len(places):
            self._places.write(places)
            self.gpu.note_moved(up=places.nbytes)
        self._squares = squares
        self.set(squares=(across, down), side=squares.side)
        self.gpu.context.enable_only(moderngl.PROGRAM_POINT_SIZE)
        # Whole squares, also past the last ray: a point is dropped whose middle is outside.
        target.framebuffer.viewport = (0, 0, across * squares.side, down * squares.side)
        try:
            self.draw(target, samplers, moderngl.POINTS, len(places))
        finally:
            target.framebuffer.viewport = (0, 0, *target.size)
            self.gpu.context.enable_only(moderngl.NOTHING)

    def release(self) -> None:
        super().release()
        release(self._places)
        self._places = None


class PacketTiles:
    """What packets are drawn on, and what is left out: by tiles of their rays.

    Parameters
    ----------
    packet : (width, height) rays a packet, powers of two
    entry_tile : rays a side of the tiles whose beams go first, None where none do
    """

    def __init__(self, gpu: Gpu, packet: tuple[int, int], entry_tile: int | None) -> None:
        self.gpu, self.packet, self.entry_tile = gpu, packet, entry_tile
        self._largest = gpu.context.info["GL_POINT_SIZE_RANGE"][1]

    def squares(self, rays: RayTextures, samplers: Samplers) -> Squares | None:
        """Where there is something to trace: rays whose beam meets something, or, without beams,
        any live ones. None where that is everywhere, or not known: to draw the whole takes less
        than points do."""
        if rays.tiles is None or self.gpu.whole:
            return None
        if self.entry_tile and rays.bounded:    # all that is drawn waits for these beams as it is
            side, some = self.entry_tile, read_field(PACKET_ENTRY, "met", samplers) != 0
        else:
            side = max(SIDE, SQUARE * max(self.packet))
            some = rays.tiles.of_side(side).live
        # A square may cover several small tiles: points take time too.
        least = max(side, SQUARE * max(self.packet))
        square = math.gcd(*(least // packet for packet in self.packet))
        if square > self._largest or some.all():
            return None
        for axis, packet in ((1, self.packet[0]), (0, self.packet[1])):
            packets = side // packet
            if packets > square:
                some = some.repeat(packets // square, axis)
            else:
                firsts = np.arange(0, some.shape[axis], square // packets)
                some = np.logical_or.reduceat(some, firsts, axis)
        return Squares(some, square)
