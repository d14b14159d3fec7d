"""Ray classification: sorts the rays into boxes by a pass, makes the lists that they lack on the
host, and traces them by the method's programs."""
from __future__ import annotations

import moderngl
import numpy as np

from ...gl.full_screen import FullScreenPass
from ...gl.record import TABLE_WIDTH_LOG2, Record
from ...gl.textures import read_texture, release, stream_textures, table_textures, texture_bytes
from ...rays.textures import RayTextures, StateBuffer, StateBuffers
from ...statistics import Statistics
from ...traversal.driver import Samplers, Setup
from ...traversal.method import Accelerator
from ...traversal.schedules import Traversal
from .ray_boxes import RayBoxes
from .records import CANDIDATE, RAY_BOX, RAY_CLASS


class RayClasses(Traversal):
    """A traversal whose tables grow before it runs."""

    def __init__(self, setup: Setup) -> None:
        super().__init__(setup)
        self._given = setup.samplers
        self._classifiers: dict[Record, FullScreenPass] = {}
        self._own: dict[Record, Samplers] = {RAY_BOX: {}, CANDIDATE: {}}
        self._classes: list[moderngl.Texture] = []
        self._target: moderngl.Framebuffer | None = None

    def follow(self, samplers: Samplers, accelerator: Accelerator, step_cap: int) -> None:
        """Read these tables from now on: no list is left of the triangles before they moved."""
        self._release_own()
        self._given = samplers
        for program in self._classifiers.values():
            program.set(**accelerator.uniforms)
        super().follow(samplers, accelerator, step_cap)

    def run(self, rays: RayTextures, buffers: StateBuffers, statistics: Statistics,
            any_hit: bool = False) -> tuple[StateBuffer, int]:
        """Trace every ray; where the hits are, and how many rays the step cap stopped."""
        boxes: RayBoxes = self.accelerator.structure
        cells = self._box_of_each(rays, statistics)
        if boxes.ask(cells) or not self._own[RAY_BOX]:    # others may have made lists before
            self._upload(boxes)
        for record, samplers in self._own.items():
            if samplers:
                statistics.table_bytes[record.name] = texture_bytes(samplers.values())
        statistics.driver = {
            **boxes.to_dict(), "rays_from_afar": float((cells >= boxes.cells).sum())}
        return super().run(rays, buffers, statistics, any_hit)

    def _box_of_each(self, rays: RayTextures, statistics: Statistics) -> np.ndarray:
        """The box of every ray, (rays,) int32; see RAY_CLASS."""
        if self._target is None or self._target.size != rays.size:
            self._release_classes()
            self._classes = stream_textures(self.gpu, RAY_CLASS, rays.size)
            self._target = self.gpu.context.framebuffer(self._classes)
        if rays.record not in self._classifiers:
            streams = (rays.record.stream_glsl(writes=False), RAY_CLASS.stream_glsl(True))
            self._classifiers[rays.record] = FullScreenPass(
                self.gpu, "methods/ray_space/ray_class.frag",
                {**self.precision.defines(), "TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2},
                {"streams": "\n".join(streams)})
            self._classifiers[rays.record].set(**self.accelerator.uniforms)
        program = self._classifiers[rays.record]
        program.set(**rays.uniforms())
        self.gpu.context.enable_only(moderngl.NOTHING)
        program.draw(self._target, rays.samplers())
        statistics.passes += 1
        statistics.draw_calls += 1
        return RAY_CLASS.unpack(read_texture(self._classes[0]).reshape(-1, 1, 4))["box"]

    def _upload(self, boxes: RayBoxes) -> None:
        arrays = {RAY_BOX: {"first": boxes.directory},
                  CANDIDATE: {"triangle": boxes.triangle, "near": boxes.near}}
        for record, own in self._own.items():
            self._own[record] = table_textures(self.gpu, self.precision.layout(record),
                                               arrays[record], self.precision, own)
        self.samplers = {**self._given, **self._own[RAY_BOX], **self._own[CANDIDATE]}

    def bytes(self) -> int:
        """Bytes of the driver's textures beside the tables."""
        return texture_bytes(self._classes) + super().bytes()

    def _release_own(self) -> None:
        for record, samplers in self._own.items():
            release(samplers)
            self._own[record] = {}

    def _release_classes(self) -> None:
        release(self._target, self._classes)
        self._classes, self._target = [], None

    def release(self) -> None:
        """Free programs and textures."""
        self._release_own()
        self._release_classes()
        release(self._classifiers)
        super().release()
