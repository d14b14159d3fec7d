"""Packet tiles: draws packets in squares, and skips squares without a ray to trace."""
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

SQUARE = 8     # smallest side of a square in packets; a square is drawn or skipped as a whole


class Squares(NamedTuple):
    """Squares of packets. The packets of a square are drawn or skipped together.

    some : (down, across) bool, whether each square has packets to trace
    side : side of a square in packets
    """

    some: np.ndarray
    side: int

    def packets(self, size: tuple[int, int]) -> int:
        """Return the number of packets to draw in an image of ``size`` (across, down) packets."""
        across, down = (np.minimum(self.side, n - np.arange(0, n, self.side)) for n in size)
        return int(down @ self.some[:len(down), :len(across)] @ across)


class TilePass(PrimitivePass):
    """A pass over squares of packets. A square is drawn as a point of the square's size."""

    def __init__(self, gpu: Gpu, fragment: str, defines: dict[str, object],
                 virtual: dict[str, str]) -> None:
        super().__init__(gpu, fragment, "drivers/packet_tiles.vert", defines, virtual)
        self._squares = Squares(np.zeros((0, 0), bool), 1)      # the squares of the last draw
        self._places: moderngl.Buffer | None = None

    def covered(self, size: tuple[int, int]) -> np.ndarray:
        """Return the positions (x, y) of the k packets of the last draw, (k, 2) int."""
        drawn, side = self._squares
        packets = drawn.repeat(side, 0).repeat(side, 1)
        return np.argwhere(packets[:size[1], :size[0]])[:, ::-1]

    def draw_on(self, squares: Squares, target: Target, samplers: Samplers) -> None:
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
        # Include whole squares: the renderer drops a point whose centre is outside the viewport.
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
    """Decides which packets are drawn.

    Packets are drawn in squares; a square may cover several tiles of rays.

    Parameters
    ----------
    packet : (width, height) of a packet in rays, powers of two
    entry_tile : side in rays of the tiles that get a beam around their rays; None without beams
    """

    def __init__(self, gpu: Gpu, packet: tuple[int, int], entry_tile: int | None) -> None:
        self.gpu, self.packet, self.entry_tile = gpu, packet, entry_tile
        self._largest = gpu.context.info["GL_POINT_SIZE_RANGE"][1]

    def squares(self, rays: RayTextures, samplers: Samplers) -> Squares | None:
        """Return the squares that hold packets to trace, or None to draw all packets.

        With beams around all rays, a tile has rays to trace unless its beam shows that no ray hits
        a triangle. Otherwise, a tile has rays to trace if one of its rays is live. The result is
        None if all tiles have rays to trace (a full-screen draw is then faster), if ``Gpu.whole``
        is set, if the live tiles are not known, or if a point cannot be as large as a square.
        """
        if rays.tiles is None or self.gpu.whole:
            return None
        if self.entry_tile and rays.bounded:
            # This readback costs no extra wait: the packets' pass needs the same results.
            side, some = self.entry_tile, read_field(PACKET_ENTRY, "met", samplers) != 0
        else:
            side = max(SIDE, SQUARE * max(self.packet))
            some = rays.tiles.of_side(side).live
        # Even a small point takes time, so a square is at least SQUARE packets wide.
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
