"""DesktopFunctions: supplies the OpenGL 3.3 functions that moderngl calls, on OpenGL ES 3.1."""
from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any

from .fragment_counter import FragmentCounter

# ES 3.1 has these functions only with the suffix OES.
INDEXED = ("ColorMaski", "Enablei", "Disablei", "IsEnabledi", "BlendEquationi",
           "BlendEquationSeparatei", "BlendFunci", "BlendFuncSeparatei")
RENAMED = {**{f"gl{name}": f"gl{name}OES" for name in INDEXED},
           "glGetTexImage": "glGetTexImageANGLE", "glPolygonMode": "glPolygonModeANGLE",
           "glProvokingVertex": "glProvokingVertexANGLE"}
# Capabilities that ES does not know. ES always does what PROGRAM_POINT_SIZE (0x8642),
# TEXTURE_CUBE_MAP_SEAMLESS and MULTISAMPLE enable. ES lacks PRIMITIVE_RESTART (0x8F9D).
NO_CAPABILITIES = (0x8642, 0x884F, 0x8F9D, 0x809D)
# The names of the range of point sizes, in OpenGL and in ES.
GL_POINT_SIZE_RANGE, GL_ALIASED_POINT_SIZE_RANGE = 0x0B12, 0x846D
# ES never clamps floats that are read from a float framebuffer.
WITHOUT_EFFECT = ("glClampColor",)
# moderngl works without these functions.
MAY_BE_MISSING = ("glPrimitiveRestartIndex",)
GL_NO_ERROR, GL_INVALID_OPERATION = 0, 0x0502
UINT, INT, POINTER, FLOAT, DOUBLE = (
    ctypes.c_uint, ctypes.c_int, ctypes.c_void_p, ctypes.c_float, ctypes.c_double)


class DesktopFunctions:
    """Returns addresses of OpenGL functions. The object must live as long as the context.

    A stub replaces a function that ES lacks. The stub sets the error GL_INVALID_OPERATION, or does
    nothing for `WITHOUT_EFFECT`. An exception in this class sets GL_INVALID_OPERATION, too.

    Parameters
    ----------
    address_of : returns the address of the ES function by name, or 0; needs a current context
    """

    def __init__(self, address_of: Callable[[str], int]) -> None:
        self._address_of = address_of
        self._failed = False
        # Callbacks by name. ctypes frees a callback that nothing refers to.
        self._kept: dict[str, Any] = {}
        enable, disable = (self._es(name, None, UINT) for name in ("glEnable", "glDisable"))
        clear_depth = self._es("glClearDepthf", None, FLOAT)
        depth_range = self._es("glDepthRangef", None, FLOAT, FLOAT)
        draw_buffers = self._es("glDrawBuffers", None, INT, POINTER)
        get_floats = self._es("glGetFloatv", None, UINT, POINTER)
        self._get_error = self._es("glGetError", UINT)

        def draw_buffer(buffer: int) -> None:
            draw_buffers(1, ctypes.byref(UINT(buffer)))

        def floats(name: int, into: int) -> None:
            get_floats(GL_ALIASED_POINT_SIZE_RANGE if name == GL_POINT_SIZE_RANGE else name, into)

        self._replace("glEnable", lambda one: one in NO_CAPABILITIES or enable(one), UINT)
        self._replace("glDisable", lambda one: one in NO_CAPABILITIES or disable(one), UINT)
        self._replace("glClearDepth", clear_depth, DOUBLE)
        self._replace("glDepthRange", depth_range, DOUBLE, DOUBLE)
        self._replace("glDrawBuffer", draw_buffer, UINT)
        self._replace("glGetFloatv", floats, UINT, POINTER)
        self._kept["glGetError"] = ctypes.CFUNCTYPE(UINT)(self._error)
        counter = FragmentCounter(self._es)
        self._replace("glBeginQuery", counter.begin, UINT, UINT)
        self._replace("glEndQuery", counter.end, UINT)
        self._replace("glGetQueryObjectuiv", counter.result, UINT, UINT, POINTER)
        self._replace("glDrawArraysInstanced", counter.draw_arrays, UINT, INT, INT, INT)
        self._replace("glDrawElementsInstanced", counter.draw_elements, UINT, INT, UINT, POINTER,
                      INT)

    def address(self, name: str) -> int:
        """Return the address of an OpenGL 3.3 function; 0 if it is absent and not needed."""
        if name not in self._kept:
            found = self._address_of(RENAMED.get(name, name))
            if found or name in MAY_BE_MISSING:
                return found
            self._replace(name, _nothing if name in WITHOUT_EFFECT else self._note_missing)
        return int(ctypes.cast(self._kept[name], ctypes.c_void_p).value or 0)

    def _es(self, name: str, result: Any, *arguments: Any) -> Callable[..., Any]:
        return ctypes.CFUNCTYPE(result, *arguments)(self._address_of(RENAMED.get(name, name)))

    def _replace(self, name: str, call: Callable[..., object], *arguments: Any) -> None:
        def void(*values: Any) -> None:
            try:
                call(*values)
            except Exception:       # ctypes would only print the exception
                self._failed = True
                raise

        self._kept[name] = ctypes.CFUNCTYPE(None, *arguments)(void)

    def _note_missing(self) -> None:
        self._failed = True

    def _error(self) -> int:
        found = self._get_error()
        if found == GL_NO_ERROR and self._failed:
            found = GL_INVALID_OPERATION
        self._failed = False
        return int(found)


def _nothing() -> None:
    pass
