"""What packets draw into, and their hits as whoever asks next wants them."""
from __future__ import annotations

from collections.abc import Callable

import moderngl
import numpy as np

from ..gpu import Gpu
from ..ray_state import ByRay, StateBuffer, whole
from ..texel_layout import HIT
from ..textures import make_texture, read_texture, release, texture_bytes
from ..threads import threads


class PacketRoom:
    """The render targets of packets, one texel a packet.

    Parameters
    ----------
    size : (width, height) rays
    packet : (width, height) rays a packet
    targets : render targets that hold hits: one a ray, or one for four
    rows_alone : whether it is one for four
    statistics : whether packets' counters are drawn, in a pass apart
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int], packet: tuple[int, int], targets: int,
                 rows_alone: bool, statistics: bool) -> None:
        self.rays, self.packet = size, packet
        self.size = (-(-size[0] // packet[0]), -(-size[1] // packet[1]))
        what = f"{self.size[0] * self.size[1]} packets"
        self.hits = [make_texture(gpu, self.size, 4, what, dtype="u4" if rows_alone else "f4")
                     for _ in range(targets)]
        self.counters = [make_texture(gpu, self.size, 4, what)] if statistics else []
        self.targets = {"packet": gpu.context.framebuffer(self.hits)}
        # Packets are counted in it, without a test of depth.
        self._depth = gpu.context.depth_renderbuffer(self.size)
        self.mask = gpu.context.framebuffer(depth_attachment=self._depth)
        if statistics:
            self.targets["packet_counters"] = gpu.context.framebuffer(self.counters)

    def samplers(self) -> dict[str, moderngl.Texture]:
        return {**{f"packet_texels_{k}": texture for k, texture in enumerate(self.hits)},
                **{"packet_counters": texture for texture in self.counters}}

    def read_hits(self) -> np.ndarray:
        """(rays, 4) float32, the texels of HIT row by row; only where targets hold whole hits."""
        (width, height), across = self.packet, self.rays[0]
        # Channel by channel, as they will be asked for.
        planes = np.empty((4, self.size[1], height, self.size[0], width), np.float32)
        # Of four rays at a time, as many as lie side by side are moved as one number.
        four = len(self.hits) % 4 == 0
        kind = np.dtype((np.float32, np.complex64, np.complex128)[width // 2 if four else 0])

        def spread(k: int, texels: np.ndarray) -> None:
            for part, values in enumerate(np.moveaxis(texels.view(kind), -1, 0)):
                channel, first = (k % 4, k // 4 * 4) if four else (part, k)
                r = first + (part * kind.itemsize // 4 if four else 0)
                plane = planes[channel, :, r // width].view(kind)
                plane[..., r % width * 4 // kind.itemsize] = values
        run = threads(planes[0].size)
        list(run(spread, range(len(self.hits)), map(read_texture, self.hits)))
        image = planes.reshape(4, self.size[1] * height, self.size[0] * width)
        return image[:, :self.rays[1], :across].reshape(4, -1).T

    def bytes(self) -> int:
        return texture_bytes((*self.hits, *self.counters))

    def release(self) -> None:
        release(self.targets, self.mask, self.hits, self.counters, self._depth)


class PacketHits:
    """Hits that still stand in packets' targets: read from there, and handed back to rays by a
    pass only when another pass wants them."""

    def __init__(self, room: PacketRoom, hand_back: Callable[[], StateBuffer]) -> None:
        self._room, self._hand_back = room, hand_back

    def samplers(self) -> dict[str, moderngl.Texture]:
        return self._hand_back().samplers()

    def fields(self, name: str, by_ray: ByRay = whole) -> dict[str, np.ndarray]:
        """As of a ``StateBuffer``."""
        if name != HIT.name:
            return self._hand_back().fields(name, by_ray)
        return HIT.unpack(by_ray(self._room.read_hits())[:, None])
