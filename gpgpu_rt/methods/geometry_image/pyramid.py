"""Pyramid: computes the boxes of a geometry image's quadtrees with one fragment pass per level.

A pass cannot read the texture that it writes, so levels are drawn alternately into the tables and
into scratch textures. A final pass copies the scratch levels into the tables. A colour mask
protects the links in the tables' fourth channels.
"""
from __future__ import annotations

from collections.abc import Mapping

import moderngl
import numpy as np

from ...gl.algorithms.streams import span
from ...gl.context import Gpu
from ...gl.full_screen import FullScreenPass, Rectangles
from ...gl.precision import Precision
from ...gl.record import TABLE_WIDTH_LOG2, Record
from ...gl.textures import TABLE_WIDTH, make_texture, release
from .records import MAX_PYRAMID, MIN_PYRAMID, POSITION, PYRAMID_SOURCE

RECORDS = (POSITION, MIN_PYRAMID, MAX_PYRAMID, PYRAMID_SOURCE)
BOXES_ONLY = (True, True, True, False)


class Pyramid:
    """Computes the boxes in the tables MIN_PYRAMID and MAX_PYRAMID from the table POSITION.

    Parameters
    ----------
    levels : (k + 1,), the first node of each of k levels, finest first; then the number of nodes
    precision : the number formats of the tables
    """

    def __init__(self, levels: np.ndarray, precision: Precision) -> None:
        self.levels, self.precision = levels, precision
        self._gpu: Gpu | None = None
        self._sides: list[moderngl.Framebuffer] = []

    def run(self, gpu: Gpu, samplers: Mapping[str, moderngl.Texture]) -> None:
        """Compute every box. ``samplers`` maps sampler names to the textures of the tables."""
        if len(self.levels) < 2:
            return
        if self._gpu is None:
            self._make(gpu, samplers)
        gpu.context.enable_only(moderngl.NOTHING)
        for level, rectangles in enumerate(self._rectangles):
            target, source = self._sides[level % 2], self._sides[1 - level % 2]
            self._draw(self._inner if level else self._cells, target, source, samplers, rectangles)
        self._draw(self._copy, *self._sides, samplers, self._odd)

    def _draw(self, program: FullScreenPass, target: moderngl.Framebuffer,
              source: moderngl.Framebuffer, samplers: Mapping[str, moderngl.Texture],
              rectangles: Rectangles) -> None:
        boxes = dict(zip(self._names, source.color_attachments))
        program.draw(target, {**samplers, **boxes}, rectangles=rectangles)

    def _make(self, gpu: Gpu, samplers: Mapping[str, moderngl.Texture]) -> None:
        self._gpu = gpu
        layouts = [self.precision.layout(record) for record in RECORDS]
        self._names = [_box_sampler(self.precision.layout(r)) for r in (MIN_PYRAMID, MAX_PYRAMID)]
        tables = [samplers[name] for name in self._names]
        scratch = [make_texture(gpu, t.size, t.components, "half of a pyramid", dtype=t.dtype)
                   for t in tables]
        for textures in (tables, scratch):
            side = gpu.context.framebuffer(textures)
            side.color_mask = (BOXES_ONLY,) * len(textures)
            self._sides.append(side)
        self._scratch = scratch
        virtual = {"tables": "\n".join(layout.table_glsl() for layout in layouts)}
        self._cells, self._inner, self._copy = (
            FullScreenPass(gpu, "methods/geometry_image/pyramid.frag",
                           {"TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2,
                               **({word: True} if word else {})},
                           virtual)
            for word in ("CELLS", "", "COPY"))
        spans = [span(int(first), int(end - first))
                 for first, end in zip(self.levels, self.levels[1:])]
        self._rectangles = [_kept(gpu, corners) for corners in spans]
        self._odd = _kept(gpu, np.concatenate([np.zeros((0, 4)), *spans[1::2]]))

    def bounds(self, nodes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Read back boxes. Return the box (lo, hi), (3,) float32 each, of all given nodes."""
        boxes = np.array([[self._corner(node, k) for k in (0, 1)] for node in nodes.tolist()])
        return boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)

    def _corner(self, node: int, which: int) -> np.ndarray:
        place = (node % TABLE_WIDTH, node // TABLE_WIDTH, 1, 1)
        texel = self._sides[0].read(place, 4, attachment=which, dtype="f4")
        assert self._gpu is not None
        self._gpu.note_moved(down=len(texel))
        return np.frombuffer(texel, "<f4")[:3]

    def release(self) -> None:
        if self._gpu is None:
            return
        release(self._cells, self._inner, self._copy, self._sides, self._scratch,
                self._rectangles, self._odd)
        self._gpu, self._sides = None, []


def _kept(gpu: Gpu, corners: np.ndarray) -> Rectangles:
    rectangles = Rectangles(gpu, max(1, len(corners)))
    rectangles.write(corners)
    return rectangles


def _box_sampler(record: Record) -> str:
    """Return the sampler name of the texture that holds a pyramid's box corners."""
    return f"{record.name}{record.plane_of(record.fields[0].texel).suffix}_table"
