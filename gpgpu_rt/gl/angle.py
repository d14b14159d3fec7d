"""AngleLoader: an OpenGL ES context of ANGLE, which draws with SwiftShader on the CPU.

ANGLE, the OpenGL of Chromium, has its own GLSL compiler, and SwiftShader its own code generator.
Neither shares code with Mesa, so equal hits on ANGLE and on Mesa are evidence from two independent
compilers. This context is slow: use it only to compare hits.
"""
from __future__ import annotations

import ctypes
import os
from pathlib import Path

from ..errors import ContextError
from .desktop_functions import DesktopFunctions
from .fragment_counter import TARGETS

FOLDERS = ("/usr/lib/chromium", "/usr/lib/chromium-browser", "/opt/google/chrome")
LIBRARIES = ("libGLESv2.so", "libEGL.so")    # libEGL.so loads libGLESv2.so
HINT = ("set GPGPU_RT_ANGLE to a folder with ANGLE's libEGL.so, libGLESv2.so and "
        "libvk_swiftshader.so")
# FragmentCounter counts fragments in the last of ANGLE's 8 render targets. A program that draws
# into all 8 targets still runs, but FragmentCounter then counts all pixels of the viewport.
MOST_TARGETS = TARGETS - 1
ES_VERSION = 310
EXTENSIONS = ("GL_EXT_color_buffer_float", "GL_EXT_float_blend", "GL_OES_draw_buffers_indexed",
              "GL_ANGLE_get_image")
# Features to switch off: with framebuffer fetch, ANGLE on SwiftShader offers only 6 render targets
# instead of the 8 that OpenGL 3.3 promises.
DISABLED = ("supportsShaderFramebufferFetch", "supportsShaderFramebufferFetchNonCoherent",
            "supportsShaderFramebufferFetchDepthStencil", "supportShaderPixelLocalStorageAngle",
            "emulatePixelLocalStorage", "supportsBlendOperationAdvanced")

# Constants of EGL, of EGL's extensions for ANGLE, and of OpenGL
EGL_NONE, EGL_SURFACE_TYPE, EGL_PBUFFER_BIT = 0x3038, 0x3033, 0x0001
EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT = 0x3040, 0x0040
EGL_WIDTH, EGL_HEIGHT, EGL_MAJOR, EGL_MINOR = 0x3057, 0x3056, 0x3098, 0x30FB
EGL_PLATFORM_ANGLE = 0x3202
EGL_PLATFORM_TYPE, EGL_VULKAN = 0x3203, 0x3450
EGL_DEVICE_TYPE, EGL_SWIFTSHADER = 0x3209, 0x3487
EGL_FEATURES_DISABLED = 0x3467
GL_EXTENSIONS = 0x1F03


class AngleLoader:
    """An ANGLE context with the interface of moderngl's loaders.

    The context's surface has 1 x 1 pixels, because all draws go to framebuffers.

    Raises
    ------
    ContextError
        if the libraries are missing or incomplete, or ANGLE gives no context
    """

    def __init__(self) -> None:
        self.folder = angle_folder()
        self._egl = _open(self.folder)
        self._display = self._initialised()
        self._surface, self._context = self._made()
        self.__enter__()
        self._check_extensions()
        self._functions = DesktopFunctions(self._address)

    def _initialised(self) -> int:
        names = (ctypes.c_char_p * (len(DISABLED) + 1))(*(name.encode() for name in DISABLED))
        wanted = (ctypes.c_ssize_t * 7)(
            EGL_PLATFORM_TYPE, EGL_VULKAN, EGL_DEVICE_TYPE, EGL_SWIFTSHADER,
            EGL_FEATURES_DISABLED, ctypes.addressof(names), EGL_NONE)
        display = self._egl.eglGetPlatformDisplay(EGL_PLATFORM_ANGLE, None, wanted)
        if not display or not self._egl.eglInitialize(display, None, None):
            raise self._error("ANGLE cannot start SwiftShader")
        return int(display)

    def _made(self) -> tuple[int, int]:
        config, count = ctypes.c_void_p(), ctypes.c_int()
        self._egl.eglChooseConfig(
            self._display, _words(EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                                  EGL_OPENGL_ES3_BIT), ctypes.byref(config), 1,
            ctypes.byref(count))
        if not count.value:
            raise self._error("ANGLE has no configuration for OpenGL ES 3")
        surface = self._egl.eglCreatePbufferSurface(
            self._display, config, _words(EGL_WIDTH, 1, EGL_HEIGHT, 1))
        major, minor = divmod(ES_VERSION // 10, 10)
        context = self._egl.eglCreateContext(
            self._display, config, None, _words(EGL_MAJOR, major, EGL_MINOR, minor))
        if not surface or not context:
            raise self._error(f"ANGLE gives no OpenGL ES {major}.{minor} context")
        return int(surface), int(context)

    def _error(self, what: str) -> ContextError:
        return ContextError(f"{what} (EGL error 0x{self._egl.eglGetError():04x}) with the "
                            f"libraries in {self.folder}; {HINT}")

    def _check_extensions(self) -> None:
        get = ctypes.CFUNCTYPE(ctypes.c_char_p, ctypes.c_uint)(self._address("glGetString"))
        have = get(GL_EXTENSIONS).decode().split()
        missing = [name for name in EXTENSIONS if name not in have]
        if missing:
            raise ContextError(f"ANGLE in {self.folder} has no {', '.join(missing)}; use the "
                               "libraries of a newer Chromium")

    def _address(self, name: str) -> int:
        return self._egl.eglGetProcAddress(name.encode()) or 0

    def load_opengl_function(self, name: str) -> int:
        return self._functions.address(name)

    load = load_opengl_function

    def __enter__(self) -> AngleLoader:
        if not self._egl.eglMakeCurrent(self._display, self._surface, self._surface,
                                        self._context):
            raise self._error("ANGLE refused to make its context current")
        return self

    def __exit__(self, *exception: object) -> None:
        # Leave the context, so that another thread can make it current.
        self._egl.eglMakeCurrent(self._display, None, None, None)

    def release(self) -> None:
        if self._context:
            self.__exit__()
            self._egl.eglDestroyContext(self._display, self._context)
            self._egl.eglDestroySurface(self._display, self._surface)
            self._context = 0


def angle_folder() -> Path:
    """Return the folder of ANGLE's libraries: ``GPGPU_RT_ANGLE``, else Chromium's folder.

    Raises
    ------
    ContextError
        if no folder has the libraries
    """
    named = os.environ.get("GPGPU_RT_ANGLE")
    folders = [Path(named)] if named else [Path(folder) for folder in FOLDERS]
    for folder in folders:
        if all((folder / library).is_file() for library in LIBRARIES):
            return folder.resolve()
    if named:
        raise ContextError(f"GPGPU_RT_ANGLE is {named!r}, which has no {' or no '.join(LIBRARIES)}"
                           "; name a folder with ANGLE's libraries")
    raise ContextError(f"no ANGLE libraries found in {', '.join(FOLDERS)}; {HINT}")


def _open(folder: Path) -> ctypes.CDLL:
    try:
        _, egl = (ctypes.CDLL(str(folder / library)) for library in LIBRARIES)
    except OSError as failure:
        raise ContextError(f"cannot load ANGLE ({failure}); {HINT}") from failure
    # Newer Chromiums contain ANGLE in their executable and ship empty libraries.
    if not hasattr(egl, "eglGetPlatformDisplay"):
        raise ContextError(f"{folder / LIBRARIES[1]} is an empty stand-in without functions; "
                           f"{HINT}")
    pointer, number = ctypes.c_void_p, ctypes.c_int
    for name, result, arguments in (
            ("eglGetPlatformDisplay", pointer, (ctypes.c_uint, pointer, pointer)),
            ("eglInitialize", ctypes.c_uint, (pointer, pointer, pointer)),
            ("eglChooseConfig", ctypes.c_uint, (pointer, pointer, pointer, number, pointer)),
            ("eglCreatePbufferSurface", pointer, (pointer, pointer, pointer)),
            ("eglCreateContext", pointer, (pointer, pointer, pointer, pointer)),
            ("eglMakeCurrent", ctypes.c_uint, (pointer,) * 4),
            ("eglDestroyContext", ctypes.c_uint, (pointer, pointer)),
            ("eglDestroySurface", ctypes.c_uint, (pointer, pointer)),
            ("eglGetProcAddress", pointer, (ctypes.c_char_p,))):
        function = getattr(egl, name)
        function.restype, function.argtypes = result, arguments
    return egl


def _words(*values: int) -> ctypes.Array[ctypes.c_int]:
    return (ctypes.c_int * (len(values) + 1))(*values, EGL_NONE)
