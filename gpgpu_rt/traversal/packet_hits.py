"""Packet hits: makes the render targets of packets, and reads hits from the targets."""
from __future__ import annotations

from collections.abc import Callable, Mapping

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.target import ByRay, Target, whole
from ..gl.textures import make_texture, read_texture, release, texture_bytes
from ..rays.records import HIT
from ..threads import threads


class PacketTargets:
    """The render targets of packets. A target has a texel for each packet.

    Parameters
    ----------
    size : (width, height) rays
    packet : (width, height) of a packet in rays
    targets : number of render targets that hold hits
    rows_alone : whether a texel holds four hits, each as its row in the triangle table
    fours : whether a texel holds one field, such as t, of four hits. If ``fours`` and
        ``rows_alone`` are both False, a texel holds the four fields of one hit
    statistics : whether a separate pass draws the packets' counters, which need a target
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int], packet: tuple[int, int], targets: int,
                 rows_alone: bool, fours: bool, statistics: bool) -> None:
        self.rays, self.packet, self.fours = size, packet, fours
        self.size = (-(-size[0] // packet[0]), -(-size[1] // packet[1]))
        what = f"{self.size[0] * self.size[1]} packets"
        self.hits = [make_texture(gpu, self.size, 4, what, dtype="u4" if rows_alone else "f4")
                     for _ in range(targets)]
        self.counters = [make_texture(gpu, self.size, 4, what)] if statistics else []
        # Any-hit queries, and packets without a ray to trace, write only these targets.
        self.triangles = self.hits[3::4] if fours else self.hits
        self._targets = {
            name: Target(gpu, (), self.size, borrowed={f"packet_{name}": textures})
            for name, textures in (("hits", self.hits), ("triangles", self.triangles),
                                   ("counters", self.counters)) if textures}

    def target(self, counters: bool, alone: bool) -> Target:
        """Return the target of counters (if ``counters``), triangles (if ``alone``), or hits."""
        return self._targets["counters" if counters else "triangles" if alone else "hits"]

    def samplers(self, alone: bool) -> dict[str, moderngl.Texture]:
        """Return the textures of the hits and of the counters, by sampler name.

        With ``alone``, omit the textures that hold only t, u or v of hits.
        """
        textures = self.triangles if alone else self.hits
        return {**{f"packet_texels_{k}": texture for k, texture in enumerate(textures)},
                **{"packet_counters": texture for texture in self.counters}}

    def read_hits(self, alone: bool) -> np.ndarray:
        """Return the texels of HIT, (rays, 4) float32, row by row.

        With ``fours`` and ``alone``, return only triangles, (rays, 1). With ``rows_alone``, the
        targets have no texels of HIT: do not call this function.
        """
        (width, height), across = self.packet, self.rays[0]
        # Callers read single channels, so store the image channel by channel.
        each = 1 if alone and self.fours else 4
        planes = np.empty((each, self.size[1], height, self.size[0], width), np.float32)
        # With ``fours``, copy the values of neighbours in a row of the image as one wider number.
        kind = np.dtype((np.float32, np.complex64, np.complex128)[width // 2 if self.fours else 0])

        def spread(k: int, texels: np.ndarray) -> None:
            for part, values in enumerate(np.moveaxis(texels.view(kind), -1, 0)):
                channel, first = (k % each, k // each * 4) if self.fours else (part, k)
                r = first + (part * kind.itemsize // 4 if self.fours else 0)
                plane = planes[channel, :, r // width].view(kind)
                plane[..., r % width * 4 // kind.itemsize] = values
        run = threads(planes[0].size)
        textures = self.triangles if alone else self.hits
        list(run(spread, range(len(textures)), map(read_texture, textures)))
        image = planes.reshape(each, self.size[1] * height, self.size[0] * width)
        return image[:, :self.rays[1], :across].reshape(each, -1).T

    def bytes(self) -> int:
        return texture_bytes((*self.hits, *self.counters))

    def release(self) -> None:
        release(self._targets, self.hits, self.counters)


class PacketHits:
    """Hits that are still in the packets' targets.

    Before another pass samples the hits, a pass copies them to the rays' own textures. For any-hit
    queries, the targets hold only triangles (``alone``).
    """

    def __init__(self, targets: PacketTargets, alone: bool,
                 hand_back: Callable[[], Target]) -> None:
        self._targets, self._alone, self._hand_back = targets, alone, hand_back

    def samplers(self) -> Mapping[str, moderngl.Texture]:
        return self._hand_back().samplers()

    def fields(self, name: str, by_ray: ByRay = whole) -> dict[str, np.ndarray]:
        """Return the fields of a record, as ``Target.fields`` does.

        For any-hit queries, the record HIT has only the field ``triangle``.
        """
        if name != HIT.name:
            return self._hand_back().fields(name, by_ray)
        found = by_ray(self._targets.read_hits(self._alone))
        if found.shape[1] == 1:
            return {"triangle": found[:, 0].astype(np.int32)}
        return HIT.unpack(found[:, None])
