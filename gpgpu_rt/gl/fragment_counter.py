"""FragmentCounter: makes occlusion queries of OpenGL ES count fragments.

An occlusion query of ES says only whether a fragment passed. So, inside a query, each fragment
adds 1 to its texel of an extra render target (`angle_text.py` adds this output). The depth test
and `discard` apply to this target, so the sum of its texels is OpenGL 3.3's count.

A draw into 8 render targets leaves no target for the count. For such a draw, all pixels of the
viewport are counted, because programs with 8 targets are full-screen passes that discard nothing.
"""
from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

import numpy as np

TARGETS = 8                     # render targets that OpenGL 3.3 promises
COUNTING_TARGET = TARGETS - 1   # the target that counts fragments

GL_SAMPLES_PASSED, GL_PRIMITIVES_GENERATED, GL_QUERY_RESULT = 0x8914, 0x8C87, 0x8866
GL_DRAW_FRAMEBUFFER, GL_DRAW_FRAMEBUFFER_BINDING = 0x8CA9, 0x8CA6
GL_COLOR_ATTACHMENT0, GL_DRAW_BUFFER0, GL_VIEWPORT = 0x8CE0, 0x8825, 0x0BA2
GL_TEXTURE_2D, GL_TEXTURE_BINDING_2D = 0x0DE1, 0x8069
GL_R32F, GL_RED, GL_FLOAT = 0x822E, 0x1903, 0x1406
GL_BLEND, GL_FUNC_ADD, GL_ONE = 0x0BE2, 0x8006, 1
GL_PACK_ALIGNMENT, GL_UNPACK_ALIGNMENT = 0x0D05, 0x0CF5
GL_LINES, GL_LINE_STRIP, GL_TRIANGLES, GL_TRIANGLE_STRIP, GL_TRIANGLE_FAN = 1, 3, 4, 5, 6
UINT, INT, POINTER = ctypes.c_uint, ctypes.c_int, ctypes.c_void_p


class FragmentCounter:
    """Replaces OpenGL's functions for queries and draws.

    Parameters
    ----------
    es : (name, type of the result, types of the arguments) -> a function of ES
    """

    def __init__(self, es: Callable[..., Callable[..., Any]]) -> None:
        def function(name: str, *arguments: Any) -> Callable[..., Any]:
            return es(name, None, *arguments)

        self._begin = function("glBeginQuery", UINT, UINT)
        self._end = function("glEndQuery", UINT)
        self._result = function("glGetQueryObjectuiv", UINT, UINT, POINTER)
        self._arrays = function("glDrawArraysInstanced", UINT, INT, INT, INT)
        self._elements = function("glDrawElementsInstanced", UINT, INT, UINT, POINTER, INT)
        self._get = function("glGetIntegerv", UINT, POINTER)
        self._generate = function("glGenTextures", INT, POINTER)
        self._delete = function("glDeleteTextures", INT, POINTER)
        self._bind = function("glBindTexture", UINT, UINT)
        self._storage = function("glTexStorage2D", UINT, INT, UINT, INT, INT)
        self._write = function("glTexSubImage2D", UINT, *[INT] * 5, UINT, UINT, POINTER)
        self._read = function("glGetTexImage", UINT, INT, UINT, UINT, POINTER)
        self._pack = function("glPixelStorei", UINT, INT)
        self._attach = function("glFramebufferTexture2D", UINT, UINT, UINT, UINT, INT)
        self._draw_buffers = function("glDrawBuffers", INT, POINTER)
        self._mask = function("glColorMaski", UINT, *[ctypes.c_ubyte] * 4)
        self._is_enabled = es("glIsEnabledi", ctypes.c_ubyte, UINT, UINT)
        self._enable = function("glEnablei", UINT, UINT)
        self._disable = function("glDisablei", UINT, UINT)
        self._blend_equation = function("glBlendEquationi", UINT, UINT)
        self._blend_function = function("glBlendFunci", UINT, UINT, UINT)
        self._open: dict[int, int] = {}       # query target -> running query
        self._results: dict[int, int] = {}    # query -> result
        self._texture, self._size = UINT(0), (0, 0)
        self._is_clear = False
        self._counted = self._primitives = 0

    # Replaced functions -------------------------------------------------------------------------

    def begin(self, target: int, query: int) -> None:
        if target == GL_SAMPLES_PASSED:
            self._counted, self._is_clear = 0, False
        elif target == GL_PRIMITIVES_GENERATED:
            self._primitives = 0
        else:
            self._begin(target, query)
            return
        self._open[target] = query

    def end(self, target: int) -> None:
        query = self._open.pop(target, None)
        if query is None:
            self._end(target)
        elif target == GL_PRIMITIVES_GENERATED:
            self._results[query] = self._primitives
        else:
            self._add_up()
            self._results[query] = self._counted

    def result(self, query: int, name: int, into: int) -> None:
        if query in self._results:
            ctypes.cast(into, ctypes.POINTER(UINT))[0] = (
                self._results[query] if name == GL_QUERY_RESULT else 1)
        else:
            self._result(query, name, into)

    def draw_arrays(self, mode: int, first: int, vertices: int, instances: int) -> None:
        self._draw(mode, vertices, instances,
                   lambda: self._arrays(mode, first, vertices, instances))

    def draw_elements(self, mode: int, vertices: int, kind: int, first: int | None,
                      instances: int) -> None:
        self._draw(mode, vertices, instances,
                   lambda: self._elements(mode, vertices, kind, first, instances))

    # Counting -----------------------------------------------------------------------------------

    def _draw(self, mode: int, vertices: int, instances: int, draw: Callable[[], None]) -> None:
        if GL_PRIMITIVES_GENERATED in self._open:
            self._primitives += instances * primitives(mode, vertices)
        if GL_SAMPLES_PASSED not in self._open:
            draw()
            return
        present = (UINT * TARGETS)(*(self._integers(GL_DRAW_BUFFER0 + at)[0]
                                     for at in range(TARGETS)))
        if present[COUNTING_TARGET]:
            draw()
            _, _, width, height = self._integers(GL_VIEWPORT, 4)
            self._counted += width * height
            return
        self._prepare()
        counting = (UINT * TARGETS)(*present)
        counting[COUNTING_TARGET] = GL_COLOR_ATTACHMENT0 + COUNTING_TARGET
        self._attach_to_counting_target(self._texture.value)
        self._draw_buffers(TARGETS, counting)
        self._mask(COUNTING_TARGET, 1, 1, 1, 1)
        is_blended = self._is_enabled(GL_BLEND, COUNTING_TARGET)
        self._enable(GL_BLEND, COUNTING_TARGET)
        self._blend_equation(COUNTING_TARGET, GL_FUNC_ADD)
        self._blend_function(COUNTING_TARGET, GL_ONE, GL_ONE)
        draw()
        if not is_blended:      # leave blending enabled if it was enabled before
            self._disable(GL_BLEND, COUNTING_TARGET)
        self._attach_to_counting_target(0)
        self._draw_buffers(TARGETS, present)

    def _attach_to_counting_target(self, texture: int) -> None:
        self._attach(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0 + COUNTING_TARGET, GL_TEXTURE_2D,
                     texture, 0)

    def _prepare(self) -> None:
        """Fit the texture to the viewport. Clear the texture at a query's first draw."""
        x, y, width, height = self._integers(GL_VIEWPORT, 4)
        wanted = x + width, y + height
        if wanted != self._size:
            self._add_up()
            self._delete(1, ctypes.byref(self._texture))
            self._generate(1, ctypes.byref(self._texture))
            self._size, self._is_clear = wanted, False
            self._with_texture(lambda: self._storage(GL_TEXTURE_2D, 1, GL_R32F, *wanted))
        if not self._is_clear:
            # Upload zeros: ANGLE delays glClearTexImage until a draw, and then clears only the
            # area of the smallest render target.
            none = np.zeros(wanted, np.float32)
            self._pack(GL_UNPACK_ALIGNMENT, 4)
            self._with_texture(lambda: self._write(GL_TEXTURE_2D, 0, 0, 0, *wanted, GL_RED,
                                                   GL_FLOAT, none.ctypes.data))
            self._is_clear = True

    def _add_up(self) -> None:
        if not self._is_clear:      # nothing was drawn
            return
        texels = np.empty(self._size[::-1], np.float32)
        self._pack(GL_PACK_ALIGNMENT, 4)
        self._with_texture(lambda: self._read(GL_TEXTURE_2D, 0, GL_RED, GL_FLOAT,
                                              texels.ctypes.data))
        self._counted += int(texels.sum(dtype=np.float64))

    def _with_texture(self, call: Callable[[], None]) -> None:
        bound = self._integers(GL_TEXTURE_BINDING_2D)[0]
        self._bind(GL_TEXTURE_2D, self._texture)
        call()
        self._bind(GL_TEXTURE_2D, bound)

    def _integers(self, name: int, count: int = 1) -> list[int]:
        values = (INT * count)()
        self._get(name, values)
        return list(values)


def primitives(mode: int, vertices: int) -> int:
    """Return the number of points, lines or triangles of an instance."""
    if mode in (GL_TRIANGLE_STRIP, GL_TRIANGLE_FAN):
        return max(vertices - 2, 0)
    if mode == GL_LINE_STRIP:
        return max(vertices - 1, 0)
    return vertices // {GL_LINES: 2, GL_TRIANGLES: 3}.get(mode, 1)
