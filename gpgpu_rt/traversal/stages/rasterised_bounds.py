"""Rasterised bounds: a coarse rasterisation bounds the interval of each eye ray's hit.

Hachisuka's survey proposes such bounds (section 5). Triangles are drawn over image tiles. For each
tile, MIN blending keeps the depths between which the tile's rays can hit something. Rays are
traced only between these depths.
"""
from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import moderngl
import numpy as np

from ...errors import OptionError
from ...gl.context import Gpu
from ...gl.full_screen import FullScreenPass
from ...gl.primitive_pass import PrimitivePass
from ...gl.record import TABLE_WIDTH_LOG2, streams_glsl
from ...gl.target import Target
from ...gl.textures import table_textures
from ...rays.records import RAY_TEXELS
from ...rays.textures import RayTextures, StateBuffers
from ...scene.camera import Camera
from ...statistics import Statistics
from ..driver import Driver, DriverBase
from ..method import Method
from ..packet_hits import PacketHits
from ..triangle_table import TRIANGLE, triangle_table
from .records import DEPTH_BOUNDS

NOTHING = 3.0e38    # FAR_AWAY of stages/eye_triangle.glsl


def check_bounds(options: Mapping[str, Any]) -> None:
    """Raise OptionError if rasterised bounds are not proved exact under these options.

    The proof assumes that a hit's t lies in the range of the depths of the triangle's corners, up
    to the rounding of float32. Only the watertight test in fp32 clamps t to this range.
    """
    if options["rasterised_bounds"] and (
            options["intersection"] != "woop-watertight"
            or {options["storage"], options["arithmetic"]} != {"fp32"}):
        raise OptionError("rasterised_bounds is proved only for intersection=woop-watertight in "
                          "fp32; set both, or leave rasterised_bounds out")


class RasterisedBounds(DriverBase):
    """A driver that shortens the intervals of a camera's eye rays by rasterised bounds.

    The driver given to `take` then traces the rays. The option ``rasterised_bounds`` is the side
    of a tile in pixels.
    """

    def __init__(self, gpu: Gpu, method: Method, options: Mapping[str, Any]) -> None:
        super().__init__(gpu, method, options)
        self.tile = options["rasterised_bounds"]

    def take(self, triangles: np.ndarray, driver: Driver) -> None:
        """From now on, bound rays by these (n, 3, 3) triangles and trace by this driver."""
        self.driver, self.count = driver, len(triangles)
        self.kept["tables"] = table_textures(
            self.gpu, TRIANGLE, triangle_table(triangles)[TRIANGLE.name],
            into=self.kept.get("tables"))

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        if not any_hit and rays.seen_from is not None:
            rays = self._bounded(rays, rays.seen_from, statistics)
        return self.driver.run(rays, buffers, statistics, any_hit)

    def _bounded(self, rays: RayTextures, camera: Camera, statistics: Statistics) -> RayTextures:
        bounded, depths = self._targets_for(rays.size)
        self._rasterise(depths, rays.size, camera)

        def make() -> FullScreenPass:
            layout = self.precision.layout(RAY_TEXELS)
            return FullScreenPass(
                self.gpu, "stages/bounded_rays.frag",
                {**self.precision.defines(), "TILE": self.tile},
                {"streams": streams_glsl((rays.record, DEPTH_BOUNDS),
                                         (replace(layout, name="bounded"),))})
        program = self.program(("bounded_rays", rays.record), make)
        program.set(forward=tuple(camera.basis(rays.size)[2]), **rays.uniforms())
        program.draw(bounded.target, {**rays.samplers(), **depths.samplers()})
        statistics.draw_calls += 2
        return bounded

    def _rasterise(self, depths: Target, size: tuple[int, int], camera: Camera) -> None:
        context = self.gpu.context
        depths.clear(NOTHING, NOTHING, NOTHING, NOTHING)
        if not self.count:
            return
        program = self.program("depth_bounds", lambda: PrimitivePass(
            self.gpu, "stages/depth_bounds.frag", "stages/depth_bounds.vert",
            virtual={"streams": DEPTH_BOUNDS.stream_glsl(True), "tables": TRIANGLE.table_glsl(),
                     "table_width": f"#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}"}))
        right, up, forward = (tuple(axis) for axis in camera.basis(size))
        program.set(eye=camera.eye, right=right, up=up, forward=forward, image=size,
                    tiles=depths.size, tile=self.tile)
        context.enable_only(moderngl.BLEND)
        context.blend_func = moderngl.ONE, moderngl.ONE
        context.blend_equation = moderngl.MIN
        try:
            program.draw(depths, self.kept["tables"], moderngl.TRIANGLE_STRIP, 4, self.count)
        finally:
            context.enable_only(moderngl.NOTHING)
            context.blend_equation = moderngl.FUNC_ADD

    def _targets_for(self, size: tuple[int, int]) -> tuple[RayTextures, Target]:
        tiles = (-(-size[0] // self.tile), -(-size[1] // self.tile))
        return self.keep("targets", lambda: (RayTextures(self.gpu, size, self.precision),
                                             Target(self.gpu, DEPTH_BOUNDS, tiles)),
                         lambda part: part[0].size == size)
