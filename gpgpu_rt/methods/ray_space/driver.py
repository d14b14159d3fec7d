"""Ray classification: a pass finds the five-dimensional box of each ray (ray_boxes.py).

The host makes the missing lists of these boxes. Then passes trace the rays through the lists.
"""
from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np

from ...gl.full_screen import FullScreenPass
from ...gl.record import TABLE_WIDTH_LOG2, Record, streams_glsl
from ...gl.target import Target
from ...gl.textures import release, table_textures, texture_bytes
from ...rays.textures import RayTextures, StateBuffers
from ...statistics import Statistics
from ...traversal.accelerator import Accelerator
from ...traversal.driver import Samplers, Setup
from ...traversal.schedules import Traversal
from .ray_boxes import RayBoxes
from .records import CANDIDATE, RAY_BOX, RAY_CLASS


class RayClasses(Traversal):
    """A traversal whose tables grow before the rays are traced.

    Integers in the tables may then exceed the limit of ``Accelerator.small_integers``.
    """

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self.accelerator = replace(self.accelerator, small_integers=False)
        self._given = setup.samplers
        self._own: dict[Record, Samplers] = {RAY_BOX: {}, CANDIDATE: {}}

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Use new tables after the triangles moved, and release the textures of the old lists."""
        self._release_own()
        self._given = samplers
        super().follow(samplers, replace(accelerator, small_integers=False), step_cap)

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[Target, int]:
        boxes: RayBoxes = self.accelerator.structure
        cells = self._box_of_each(rays, statistics)
        # If all lists exist, ask() is False, but the textures may be missing.
        if boxes.ask(cells) or not self._own[RAY_BOX]:
            self._upload(boxes)
        for record, samplers in self._own.items():
            if samplers:
                statistics.table_bytes[record.name] = texture_bytes(samplers.values())
        statistics.driver = {
            **boxes.to_dict(), "rays_from_afar": float((cells >= boxes.cells).sum())}
        return super().run(rays, buffers, statistics, any_hit)

    def _box_of_each(self, rays: RayTextures, statistics: Statistics) -> np.ndarray:
        """Return the number of every ray's box, (rays,) int32; see RAY_CLASS."""
        classes = self.keep("classes", lambda: Target(self.gpu, RAY_CLASS, rays.size),
                            lambda classes: classes.size == rays.size)
        program = self.program(("ray_class", rays.record), lambda: FullScreenPass(
            self.gpu, "methods/ray_space/ray_class.frag",
            {**self.precision.defines(), "TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2},
            {"streams": streams_glsl((rays.record,), (RAY_CLASS,))}))
        program.set(**rays.uniforms())
        self.gpu.context.enable_only(moderngl.NOTHING)
        self.draw(program, classes, rays.samplers(), statistics)
        return classes.fields()["box"]

    def _upload(self, boxes: RayBoxes) -> None:
        arrays = {RAY_BOX: {"first": boxes.directory},
                  CANDIDATE: {"triangle": boxes.triangle, "near": boxes.near}}
        for record, own in self._own.items():
            self._own[record] = table_textures(self.gpu, self.precision.layout(record),
                                               arrays[record], self.precision, own)
        self.samplers = {**self._given, **self._own[RAY_BOX], **self._own[CANDIDATE]}

    def _release_own(self) -> None:
        for record, samplers in self._own.items():
            release(samplers)
            self._own[record] = {}

    def release(self) -> None:
        self._release_own()
        super().release()
