"""Compile a fragment program for a card of 2002-2006 and print what the card's driver says.

    python tools/compile_for_card.py --drivers FOLDER CARD FRAGMENT [--listing]

FOLDER is the result of tools/period_compilers.sh. CARD is r300, r420, r580, nv40 or g80.
The drivers of R300 to R580 print counts of the program's instructions, fetches and registers; with
--listing they also print the program. NV40's driver prints the program. G80's driver prints counts
of instructions and registers. Some of these drivers crash during a normal exit. So each program is
compiled in a child process, which ends without a normal exit.
"""
from __future__ import annotations

import argparse
import ctypes
import os
import subprocess
import sys
from ctypes import POINTER, byref, c_char_p, c_float, c_int, c_ubyte, c_uint, c_void_p
from pathlib import Path
from typing import Any

# Card -> DRM shim, and environment variables. The DRM shim is a library that replaces the kernel's
# graphics driver. The variables choose the chip and, for nv40, make the driver print the program.
CARDS: dict[str, tuple[str, dict[str, str]]] = {
    "r300": ("radeon", {"RADEON_GPU_ID": "0x4E44"}),
    "r420": ("radeon", {"RADEON_GPU_ID": "0x4A49"}),
    "r580": ("radeon", {"RADEON_GPU_ID": "0x7249"}),
    "nv40": ("nouveau", {"NOUVEAU_CHIPSET": "40", "NVFX_DUMP_FP": "1"}),
    "g80": ("nouveau", {"NOUVEAU_CHIPSET": "50"}),
}
COMPILES_AT_A_DRAW = ("nv40",)
VERTEX = {
    "120": "#version 120\nattribute vec4 p; varying vec2 here;\n"
           "void main() { here = p.zw; gl_Position = vec4(p.xy, 0.0, 1.0); }",
    "330": "#version 330\nin vec4 p;\nvoid main() { gl_Position = vec4(p.xy, 0.0, 1.0); }",
}
SURFACELESS, OPENGL = 0x31DD, 0x30A2     # constants of EGL
IN_CHILD = "COMPILE_FOR_CARD_CHILD"


class Driver:
    """An OpenGL context of the card's driver, made by EGL without a surface."""

    def __init__(self) -> None:
        egl = self.egl = ctypes.CDLL("libEGL.so.1")
        egl.eglGetProcAddress.restype = c_void_p
        egl.eglGetProcAddress.argtypes = [c_char_p]
        egl.eglGetPlatformDisplay.restype = egl.eglCreateContext.restype = c_void_p
        egl.eglGetPlatformDisplay.argtypes = [c_uint, c_void_p, c_void_p]
        egl.eglInitialize.argtypes = [c_void_p] * 3
        egl.eglCreateContext.argtypes = egl.eglMakeCurrent.argtypes = [c_void_p] * 4
        display = egl.eglGetPlatformDisplay(SURFACELESS, None, None)
        egl.eglInitialize(display, None, None)
        egl.eglBindAPI(OPENGL)
        context = egl.eglCreateContext(display, None, None, None)
        if not context or not egl.eglMakeCurrent(display, None, None, context):
            sys.exit("no OpenGL context: run tools/period_compilers.sh FOLDER again")
        self._report = ctypes.CFUNCTYPE(None, c_uint, c_uint, c_uint, c_uint, c_int, c_char_p,
                                        c_void_p)(self._say)
        for flag in (0x92E0, 0x8242):     # GL_DEBUG_OUTPUT and ..._SYNCHRONOUS
            self("glEnable", None, c_uint)(flag)
        self("glDebugMessageCallback", None, type(self._report), c_void_p)(self._report, None)
        self("glDebugMessageControl", None, c_uint, c_uint, c_uint, c_int, c_void_p, c_ubyte)(
            0x1100, 0x1100, 0x1100, 0, None, 1)

    def __call__(self, name: str, result: Any, *types: Any) -> Any:
        return ctypes.CFUNCTYPE(result, *types)(self.egl.eglGetProcAddress(name.encode()))

    @staticmethod
    def _say(source: int, kind: int, number: int, severity: int, length: int, message: bytes,
             user: Any) -> None:
        print("says:", message.decode().strip(), flush=True)

    def name(self) -> str:
        text = self("glGetString", c_char_p, c_uint)
        return " ".join(text(what).decode() for what in (0x1F01, 0x1F02))

    def link(self, vertex: str, fragment: str) -> int:
        """Return a linked program, or exit with the compiler's message."""
        program = self("glCreateProgram", c_uint)()
        for kind, text in ((0x8B31, vertex), (0x8B30, fragment)):
            shader = self("glCreateShader", c_uint, c_uint)(kind)
            source, good = c_char_p(text.encode()), c_int()
            self("glShaderSource", None, c_uint, c_int, POINTER(c_char_p), c_void_p)(
                shader, 1, byref(source), None)
            self("glCompileShader", None, c_uint)(shader)
            self("glGetShaderiv", None, c_uint, c_uint, POINTER(c_int))(
                shader, 0x8B81, byref(good))
            if not good.value:
                sys.exit("refused: " + self._log("glGetShaderInfoLog", shader))
            self("glAttachShader", None, c_uint, c_uint)(program, shader)
        self("glLinkProgram", None, c_uint)(program)
        self("glGetProgramiv", None, c_uint, c_uint, POINTER(c_int))(program, 0x8B82, byref(good))
        if not good.value:
            sys.exit("refused: " + self._log("glGetProgramInfoLog", program))
        return int(program)

    def _log(self, function: str, number: int) -> str:
        log = ctypes.create_string_buffer(8000)
        self(function, None, c_uint, c_int, c_void_p, c_char_p)(number, 8000, None, log)
        return log.value.decode().strip()

    def draw(self, program: int) -> None:
        name = c_uint()
        self("glGenTextures", None, c_int, POINTER(c_uint))(1, byref(name))
        self("glBindTexture", None, c_uint, c_uint)(0x0DE1, name)
        self("glTexImage2D", None, c_uint, c_int, c_int, c_int, c_int, c_int, c_uint, c_uint,
             c_void_p)(0x0DE1, 0, 0x8058, 64, 64, 0, 0x1908, 0x1401, None)
        self("glTexParameteri", None, c_uint, c_uint, c_int)(0x0DE1, 0x2801, 0x2600)
        frame = c_uint()
        self("glGenFramebuffers", None, c_int, POINTER(c_uint))(1, byref(frame))
        self("glBindFramebuffer", None, c_uint, c_uint)(0x8D40, frame)
        self("glFramebufferTexture2D", None, c_uint, c_uint, c_uint, c_uint, c_int)(
            0x8D40, 0x8CE0, 0x0DE1, name, 0)
        self("glViewport", None, c_int, c_int, c_int, c_int)(0, 0, 64, 64)
        corners = (c_float * 12)(-1, -1, 0, 0, 3, -1, 2, 0, -1, 3, 0, 2)
        self("glGenBuffers", None, c_int, POINTER(c_uint))(1, byref(name))
        self("glBindBuffer", None, c_uint, c_uint)(0x8892, name)
        self("glBufferData", None, c_uint, ctypes.c_ssize_t, c_void_p, c_uint)(
            0x8892, 48, corners, 0x88E4)
        self("glEnableVertexAttribArray", None, c_uint)(0)
        self("glVertexAttribPointer", None, c_uint, c_int, c_uint, c_ubyte, c_int, c_void_p)(
            0, 4, 0x1406, 0, 0, None)
        self("glUseProgram", None, c_uint)(program)
        self("glDrawArrays", None, c_uint, c_int, c_int)(4, 0, 3)
        self("glFinish", None)()


def run(drivers: Path, card: str, fragment: Path, listing: bool = False) -> str:
    """Compile a program in a separate process. Return what the card's driver prints."""
    found = sorted(drivers.resolve().rglob("libEGL.so.1"))
    if not found:
        sys.exit(f"no drivers in {drivers}: run tools/period_compilers.sh {drivers} first")
    where, (shim, settings) = found[0].parent, CARDS[card]
    environment = {**os.environ, **settings, IN_CHILD: "1", "LD_LIBRARY_PATH": str(where),
                   "MESA_DEBUG": "context", "GBM_BACKENDS_PATH": str(where / "gbm"),
                   "LD_PRELOAD": str(where / f"lib{shim}_noop_drm_shim.so")}
    if listing:
        environment["RADEON_DEBUG"] = "fp"
    words = [sys.executable, __file__, "--drivers", str(drivers), card, str(fragment)]
    return subprocess.run(words, env=environment, text=True, stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, timeout=120, check=False).stdout


def main() -> None:
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--drivers", required=True, type=Path, metavar="FOLDER")
    parser.add_argument("card", choices=CARDS)
    parser.add_argument("fragment", type=Path)
    parser.add_argument("--listing", action="store_true")
    chosen = parser.parse_args()
    if not os.environ.get(IN_CHILD):
        print(run(chosen.drivers, chosen.card, chosen.fragment, chosen.listing), end="")
        return
    driver, text = Driver(), chosen.fragment.read_text()
    print("driver:", driver.name(), flush=True)
    program = driver.link(VERTEX["330" if "#version 330" in text else "120"], text)
    if chosen.card in COMPILES_AT_A_DRAW:
        driver.draw(program)
    sys.stdout.flush()
    os._exit(0)     # skips the normal exit, in which some drivers crash


if __name__ == "__main__":
    main()
