"""Rasterised bounds: a coarse rasterisation tells each eye ray where its hit can lie.

The survey's section 5 proposes it. Triangles are drawn over tiles of the image; of each tile MIN
blending keeps the depths between which its rays hit something; rays then search there alone.
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
from ...gl.precision import Precision
from ...gl.primitive_pass import PrimitivePass
from ...gl.record import TABLE_WIDTH_LOG2, Record
from ...gl.target import Target
from ...gl.textures import release, table_textures, texture_bytes
from ...rays.records import RAY_TEXELS
from ...rays.textures import RayTextures, StateBuffers
from ...scene.camera import Camera
from ...statistics import Statistics
from ..driver import Driver
from ..packet_hits import PacketHits
from ..triangle_table import TRIANGLE, triangle_table
from .records import DEPTH_BOUNDS

NOTHING = 3.0e38    # FAR_AWAY of stages/eye_triangle.glsl


def check_bounds(options: Mapping[str, Any]) -> None:
    """Raise OptionError where bounds are asked for, but t is no mean of the corners' depths to
    float32's last bits."""
    if options["rasterised_bounds"] and (
            options["intersection"] != "woop-watertight"
            or {options["storage"], options["arithmetic"]} != {"fp32"}):
        raise OptionError("rasterised_bounds is proven for woop-watertight in fp32 alone; leave "
                          "intersection and precision at these")


class RasterisedBounds:
    """A driver that gives rays through the pixels of a camera their bounds, and leaves these and
    all others to another driver. The option ``rasterised_bounds`` says how many pixels a side of a
    tile of the coarse image has."""

    def __init__(self, gpu: Gpu, options: Mapping[str, Any], precision: Precision) -> None:
        self.gpu, self.tile, self.precision = gpu, options["rasterised_bounds"], precision
        self._program: PrimitivePass | None = None
        self._bound: dict[Record, FullScreenPass] = {}
        self._rays: RayTextures | None = None
        self._tables: dict[str, moderngl.Texture] = {}

    def take(self, triangles: np.ndarray, driver: Driver) -> None:
        """Bound rays by (n, 3, 3) triangles from now on, and trace by this driver."""
        self.driver, self.count = driver, len(triangles)
        self._tables = table_textures(self.gpu, TRIANGLE, triangle_table(triangles)[TRIANGLE.name],
                                      into=self._tables)

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target | PacketHits, int]:
        """Trace every ray; see ``Driver``."""
        if not any_hit and rays.seen_from is not None:
            rays = self._bounded(rays, rays.seen_from, statistics)
        return self.driver.run(rays, buffers, statistics, any_hit)

    def _bounded(self, rays: RayTextures, camera: Camera, statistics: Statistics) -> RayTextures:
        """The rays of a camera's image, each with the ends that the bounds of its tile give it."""
        bounded = self._room_for(rays.size)
        self._rasterise(rays.size, camera, self.count, self._tables)
        if rays.record not in self._bound:
            texts = [rays.record.stream_glsl(False), DEPTH_BOUNDS.stream_glsl(False),
                     replace(self.precision.layout(RAY_TEXELS), name="bounded").stream_glsl(True)]
            self._bound[rays.record] = FullScreenPass(
                self.gpu, "stages/bounded_rays.frag",
                {**self.precision.defines(), "TILE": self.tile}, {"streams": "\n".join(texts)})
        program = self._bound[rays.record]
        program.set(forward=tuple(camera.basis(rays.size)[2]), **rays.uniforms())
        program.draw(bounded.target, {
            **rays.samplers(), **self._depths.samplers()})
        statistics.draw_calls += 2
        return bounded

    def _rasterise(self, size: tuple[int, int], camera: Camera, triangles: int,
                   samplers: Mapping[str, moderngl.Texture]) -> None:
        context = self.gpu.context
        self._depths.clear(NOTHING, NOTHING, NOTHING, NOTHING)
        if not triangles:
            return
        if self._program is None:
            self._program = PrimitivePass(
                self.gpu, "stages/depth_bounds.frag", "stages/depth_bounds.vert",
                virtual={"streams": DEPTH_BOUNDS.stream_glsl(True),
                         "tables": TRIANGLE.table_glsl(),
                         "table_width": f"#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}"})
        right, up, forward = (tuple(axis) for axis in camera.basis(size))
        self._program.set(eye=camera.eye, right=right, up=up, forward=forward, image=size,
                          tiles=self._depths.size, tile=self.tile)
        context.enable_only(moderngl.BLEND)
        context.blend_func = moderngl.ONE, moderngl.ONE
        context.blend_equation = moderngl.MIN
        try:
            self._program.draw(self._depths, samplers, moderngl.TRIANGLE_STRIP, 4, triangles)
        finally:
            context.enable_only(moderngl.NOTHING)
            context.blend_equation = moderngl.FUNC_ADD

    def _room_for(self, size: tuple[int, int]) -> RayTextures:
        if self._rays is None or self._rays.size != size:
            self._release_room()
            self._rays = RayTextures(self.gpu, size, self.precision)
            tiles = (-(-size[0] // self.tile), -(-size[1] // self.tile))
            self._depths = Target(self.gpu, DEPTH_BOUNDS, tiles)
        return self._rays

    def bytes(self) -> int:
        """Bytes of the coarse image and of the bounded rays."""
        own = self._rays.bytes() + self._depths.bytes() if self._rays else 0
        return own + texture_bytes(self._tables.values())

    def _release_room(self) -> None:
        if self._rays is not None:
            release(self._rays, self._depths)
            self._rays = None

    def release(self) -> None:
        release(self._program, self._bound, self._tables)
        self._release_room()
