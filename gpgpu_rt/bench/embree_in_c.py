"""Embree in C: Embree's packets of rays, called from a small C program on several threads.

The program is compiled when it is first needed, with Embree's headers and library (Debian and
Ubuntu: libembree-dev) and a C compiler. Rays are brought into Embree's layout before the clock
starts, and one call traces all rays, so the times contain neither Python nor a change of layout.
"""
from __future__ import annotations

import ctypes
import functools
import hashlib
import re
import shutil
import subprocess
import time
import weakref
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..disk.files import replacing
from ..disk.own_folder import own_folder
from ..errors import Error
from ..scene.scene import Scene
from .workloads import Workload

SOURCE = Path(__file__).with_name("embree.c")
HEADERS = tuple(Path(root) / f"embree{n}" for n in (4, 3)
                for root in ("/usr/local/include", "/usr/include"))
PACKAGE = "libembree-dev"
FIELDS = 12     # fields in Embree's record of a ray, 4 bytes each


def version() -> str:
    """Return the version of the installed headers, such as "3.13.5"; "" if there are none."""
    folder = _headers()
    if folder is None:
        return ""
    text = (folder / "rtcore_config.h").read_text(errors="replace")
    found = re.search(r'#define RTC_VERSION_STRING "([\d.]+)"', text)
    return found[1] if found else ""


def missing() -> str:
    """Return the reason why Embree cannot be called from C; "" if it can."""
    if _headers() is None:
        return f"{PACKAGE} is not installed"
    if _compiler() is None:
        return "there is no C compiler (cc)"
    try:
        _library()
    except Error as failure:
        return str(failure)
    return ""


def _headers() -> Path | None:
    return next((path for path in HEADERS if (path / "rtcore_config.h").is_file()), None)


def _compiler() -> str | None:
    return next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)


@functools.cache
def _library() -> ctypes.CDLL:
    """Compile the program, unless it was compiled before, and load it."""
    headers, compiler = _headers(), _compiler()
    assert headers is not None and compiler is not None
    name = headers.name
    words = [compiler, "-O3", "-std=c11", "-shared", "-fPIC", "-pthread", f"-I{headers.parent}",
             *(["-DHAVE_EMBREE_4"] if name == "embree4" else [])]
    key = hashlib.sha256(f"{SOURCE.read_text()} {words} {version()}".encode()).hexdigest()[:16]
    path = own_folder("embree") / f"{key}.so"
    if not path.is_file():
        with replacing(path) as file:
            done = subprocess.run([*words, str(SOURCE), f"-l{name}", "-o", str(file)],
                                  capture_output=True, text=True)
            if done.returncode:
                raise Error(f"{PACKAGE} cannot be used: "
                            f"{' '.join(done.stderr.split())[:160] or 'the compiler failed'}")
    try:
        library = ctypes.CDLL(str(path))
    except OSError as failure:
        raise Error(f"{PACKAGE} cannot be loaded: {failure}") from None
    size, whole, pointer = ctypes.c_size_t, ctypes.c_int, ctypes.c_void_p
    library.embree_open.argtypes = [pointer, pointer, pointer, size, whole]
    library.embree_trace.argtypes = [pointer, pointer, pointer, size, whole, whole, whole, whole]
    library.embree_close.argtypes = [pointer]
    library.embree_trace.restype = library.embree_close.restype = None
    return library


def packets(width: int, threads: int) -> Callable[[Scene, Workload], Callable[[], np.ndarray]]:
    """Return a function that prepares Embree for packets of ``width`` rays: 16, 8 or 1.

    The function tries Embree's hints for coherent and incoherent rays, and keeps the faster hint.
    """
    def prepare(scene: Scene, rays: Workload) -> Callable[[], np.ndarray]:
        library, tracer = _library(), (ctypes.c_void_p * 2)()
        corners = np.ascontiguousarray(scene.triangles, np.float32)
        indices = np.arange(3 * len(scene), dtype=np.uint32)
        fault = library.embree_open(tracer, corners.ctypes.data, indices.ctypes.data, len(scene),
                                    threads)
        blocks = laid_out(rays, width)
        found = np.empty(len(blocks) * width, bool if rays.any_hit else np.int32)

        def trace(coherent: bool) -> np.ndarray:
            library.embree_trace(tracer, blocks.ctypes.data, found.ctypes.data, len(blocks),
                                 width, rays.any_hit, coherent, threads)
            return found[:len(rays.origins)]

        def timed(coherent: bool) -> float:
            trace(coherent)
            began = time.perf_counter()
            trace(coherent)
            return time.perf_counter() - began

        if fault:
            library.embree_close(tracer)
            raise Error(f"Embree {version()} cannot build the scene (its error {fault})")
        coherent = min((True, False), key=timed)

        def run() -> np.ndarray:
            return trace(coherent)
        weakref.finalize(run, library.embree_close, tracer)
        return run
    return prepare


def laid_out(rays: Workload, width: int) -> np.ndarray:
    """Return the rays in blocks of Embree's record, (blocks, FIELDS, width) float32. Rays that hit
    nothing fill the last block.
    """
    n = len(rays.origins)
    blocks = -(-n // width)
    fields = np.zeros((blocks * width, FIELDS), np.float32)
    fields[:n, 0:3], fields[:n, 4:7], fields[:n, 8] = rays.origins, rays.directions, rays.ends
    fields[n:, 4], fields[n:, 8] = 1, -1    # fillers end before they start
    fields[:, 9] = np.full(1, 0xFFFFFFFF, np.uint32).view(np.float32)   # mask: all bits
    return np.ascontiguousarray(fields.reshape(blocks, width, FIELDS).transpose(0, 2, 1))
