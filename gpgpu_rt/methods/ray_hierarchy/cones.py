"""Cones: builds a hierarchy over rays, level by level as in a mipmap."""
from __future__ import annotations

from ...gl.context import Gpu
from ...gl.full_screen import FullScreenPass
from ...gl.precision import Precision
from ...gl.record import Record
from ...gl.target import Target
from ...gl.textures import release
from ...rays.records import HIT
from ...rays.textures import RayTextures
from .records import CONE


def level_sizes(size: tuple[int, int]) -> tuple[list[tuple[int, int]], list[tuple[int, int]]]:
    """Return the (width, height) of every level, from the rays up, and the fans between levels.

    A fan is the number of children, along x and y, of a node in the upper level. It is (2, 2), but
    (4, 1) or (1, 4) for a single row or column.
    """
    sizes, fans = [size], []
    while len(sizes) == 1 or sizes[-1] != (1, 1):
        width, height = sizes[-1]
        fan = (2, 2) if min(width, height) > 1 or width == height else (
            (4, 1) if height == 1 else (1, 4))
        fans.append(fan)
        sizes.append((-(-width // fan[0]), -(-height // fan[1])))
    return sizes, fans


class RayCones:
    """The hierarchy over the rays of a texture.

    Attributes
    ----------
    levels : the CONE records of each level's nodes, from the rays up
    fans : the fans between levels; see `level_sizes`
    """

    def __init__(self, gpu: Gpu, size: tuple[int, int], state: Record,
                 precision: Precision) -> None:
        self.size = size
        sizes, self.fans = level_sizes(size)
        self.levels = [Target(gpu, CONE, each) for each in sizes]
        self.gpu, self.state, self.precision = gpu, state, precision
        self._rays: dict[Record, FullScreenPass] = {}
        self._level = FullScreenPass(gpu, "methods/ray_hierarchy/cone_level.frag",
                                     precision.defines(), {"streams": CONE.stream_glsl(True)})

    def build(self, rays: RayTextures, states: Target, unit: float) -> None:
        """Build every level, over the unfinished rays. ``unit`` scales world lengths."""
        if rays.record not in self._rays:
            layout = self.precision.layout
            texts = [record.stream_glsl(False) for record in (rays.record, layout(self.state),
                                                              layout(HIT))]
            self._rays[rays.record] = FullScreenPass(
                self.gpu, "methods/ray_hierarchy/cone_rays.frag", self.precision.defines(),
                {"streams": "\n".join([*texts, CONE.stream_glsl(True)])})
        program = self._rays[rays.record]
        program.set(unit=unit, **rays.uniforms())
        program.draw(self.levels[0], {**rays.samplers(), **states.samplers()})
        for below, level, fan in zip(self.levels, self.levels[1:], self.fans):
            self._level.set(unit=unit, fan=fan, below=below.size)
            self._level.draw(level, below.samplers())

    def top(self, nodes: int) -> int:
        """Return the lowest level above the rays that has at most ``nodes`` nodes.

        Its nodes form the first (triangle, node) pairs.
        """
        return next(k for k, level in enumerate(self.levels)
                    if k and (level.length <= nodes or k == len(self.levels) - 1))

    def bytes(self) -> int:
        return sum(level.bytes() for level in self.levels)

    def release(self) -> None:
        release(self.levels, self._rays, self._level)
