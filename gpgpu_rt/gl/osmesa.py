"""OsMesaLoader: an off-screen Mesa context without EGL."""
from __future__ import annotations

import ctypes
import ctypes.util

from ..errors import ContextError

HINT = ("install the Mesa libraries (Debian, Ubuntu: apt-get install libegl1 libgl1 "
        "libgl1-mesa-dri, or libosmesa6 for OSMesa), then try `gpgpu-rt info`")


class OsMesaLoader:
    """An off-screen Mesa context with the interface of moderngl's loaders.

    OSMesa requires a buffer. 1 x 1 pixels suffice, because all draws go to framebuffers.
    """

    PROFILE, CORE, MAJOR, MINOR, FORMAT, RGBA, DEPTH_BITS = (
        0x33, 0x34, 0x36, 0x37, 0x22, 0x1908, 0x30)
    GL_UNSIGNED_BYTE = 0x1401

    def __init__(self) -> None:
        self.library = self._open()
        attributes = (ctypes.c_int * 11)(
            self.FORMAT, self.RGBA, self.DEPTH_BITS, 24, self.PROFILE, self.CORE,
            self.MAJOR, 3, self.MINOR, 3, 0)
        self.library.OSMesaCreateContextAttribs.restype = ctypes.c_void_p
        self.library.OSMesaGetProcAddress.restype = ctypes.c_void_p
        self.library.OSMesaGetProcAddress.argtypes = [ctypes.c_char_p]
        self.library.OSMesaMakeCurrent.argtypes = [
            ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint, ctypes.c_int, ctypes.c_int]
        self.handle = self.library.OSMesaCreateContextAttribs(attributes, None)
        if not self.handle:
            raise ContextError(f"OSMesa gives no OpenGL 3.3 core context; {HINT}")
        self.pixel = (ctypes.c_ubyte * 4)()
        self.__enter__()

    @staticmethod
    def _open() -> ctypes.CDLL:
        names = ["libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so",
                 ctypes.util.find_library("OSMesa")]
        for name in filter(None, names):
            try:
                return ctypes.CDLL(name)
            except OSError:
                continue
        raise ContextError(f"no libOSMesa found; {HINT}")

    def load_opengl_function(self, name: str) -> int:
        """Return the address of a GL function, or 0."""
        return self.library.OSMesaGetProcAddress(name.encode()) or 0

    load = load_opengl_function

    def __enter__(self) -> OsMesaLoader:
        if not self.library.OSMesaMakeCurrent(self.handle, self.pixel, self.GL_UNSIGNED_BYTE,
                                              1, 1):
            raise ContextError("OSMesa refused to make its context current")
        return self

    def __exit__(self, *exception: object) -> None:
        pass

    def release(self) -> None:
        if self.handle:
            self.library.OSMesaDestroyContext(ctypes.c_void_p(self.handle))
            self.handle = None
