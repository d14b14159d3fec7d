"""Gpu: an OpenGL context from EGL, OSMesa, the system, ANGLE or a window."""
from __future__ import annotations

import functools
import os
import re
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import moderngl

from ..errors import ContextError, LimitError, OptionError, did_you_mean
from .angle import ES_VERSION, MOST_TARGETS, AngleLoader
from .kept_fences import KeptFences
from .observation import HostQuery, Observer, Observers
from .occlusion_query import OcclusionQuery
from .osmesa import HINT, OsMesaLoader

# The backends that "auto" tries, by ``sys.platform``. Windows and macOS have neither EGL nor
# OSMesa; there, moderngl makes a context by WGL or CGL.
AUTOMATIC = {"win32": ("native",), "darwin": ("native",)}
ELSEWHERE = ("egl", "osmesa")
GL_VERSION = 330
# words in the names of renderers on the processor
SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")
# renderer -> pattern of the names of its threads
THREADS = {"llvmpipe": r"llvmpipe-\d+", "swiftshader": r"Thread<\d+>"}


def automatic() -> tuple[str, ...]:
    """Return the backends that "auto" tries on this system."""
    return AUTOMATIC.get(sys.platform, ELSEWHERE)


def backends() -> tuple[str, ...]:
    return (*automatic(), "angle")


def hint() -> str:
    """Return advice for a system without a context."""
    return HINT if automatic() == ELSEWHERE else (
        "install the driver of the graphics card, then try `gpgpu-rt info`")


def is_software(renderer: str) -> bool:
    """Return whether a renderer runs on the processor."""
    return any(word in renderer.lower() for word in SOFTWARE)


def threads_of(renderer: str) -> int | None:
    """Return how many threads a software renderer has in this process; call this after a draw.
    Return None for a graphics card, or if the system does not list threads."""
    if not is_software(renderer):
        return None
    names = next((names for word, names in THREADS.items() if word in renderer.lower()), None)
    if names is None:
        return 1
    tasks, found = Path("/proc/self/task"), set()
    if not tasks.is_dir():
        return None
    for task in tasks.iterdir():
        with suppress(OSError):     # the thread may have ended
            found.add((task / "comm").read_text().strip())
    # With LP_NUM_THREADS=0, the calling thread draws, without llvmpipe threads.
    return max(1, sum(bool(re.fullmatch(names, name)) for name in found))


class Gpu:
    """A moderngl context with its limits, programs and observers.

    ``with gpu:`` makes the context current in this thread and locks out other threads.

    Parameters
    ----------
    context : moderngl.Context
    backend : str, "egl", "osmesa", "native", "angle" or "window"

    Attributes
    ----------
    is_es : whether the context is OpenGL ES, with another dialect of GLSL
    max_draw_buffers : largest number of render targets of a program
    """

    def __init__(self, context: moderngl.Context, backend: str) -> None:
        self.is_es = backend == "angle"
        if context.version_code < (ES_VERSION if self.is_es else GL_VERSION):
            raise ContextError(f"OpenGL 3.3 is needed, {context.info['GL_RENDERER']} offers "
                               f"{context.version_code / 100:.1f}; update the driver")
        self.context = context
        context.extra = self    # so that code can find the Gpu of a texture
        self.backend = backend
        self.renderer: str = context.info["GL_RENDERER"]
        self.version: str = context.info["GL_VERSION"].removeprefix("OpenGL ")
        self.max_texture_size: int = context.info["GL_MAX_TEXTURE_SIZE"]
        self.max_draw_buffers: int = min(context.info["GL_MAX_DRAW_BUFFERS"],
                                         MOST_TARGETS if self.is_es else 64)
        # softpipe's gl_VertexID restarts every 4096 vertices. 4092 is divisible by 2 and 3, so a
        # draw in parts cuts no line and no triangle.
        self.most_vertices = 4092 if self.renderer.startswith("softpipe") else None
        self.programs: dict[Any, moderngl.Program] = {}   # filled by gl/shader.py
        self.compilations: list[Any] | None = None    # filled by gl/shader.py
        self.observers = Observers()
        self.whole = False    # whether packet passes draw even packets without a ray to trace
        # Whether local arrays work (traversal/own_arrays.py); None before the first check.
        self.keeps_own_arrays: bool | None = None
        self.fences = KeptFences(context, self.renderer)
        self._queries: list[moderngl.Query] = []
        self._rest: moderngl.Framebuffer | None = None
        self._entered = 0
        self._turn = threading.RLock()
        self._process = os.getpid()

    def __enter__(self) -> Gpu:
        if self._process != os.getpid():
            raise ContextError("an OpenGL context does not outlive a fork; start processes by "
                               "\"spawn\", or make the first Tracer after forking")
        self._turn.acquire()
        self._entered += 1
        self.context.__enter__()
        return self

    def __exit__(self, *exception: Any) -> None:
        """Leave the ``with`` block. The context stays current inside an outer block."""
        self._entered -= 1
        if not self._entered:
            self.context.__exit__(*exception)
        self._turn.release()

    @contextmanager
    def observed(self, observer: Observer, whole: bool = False) -> Iterator[None]:
        """Call an observer for every pass in the block. With ``whole``, packet passes draw even
        packets without a ray to trace."""
        before, self.whole = self.whole, whole or self.whole
        self.observers.all.append(observer)
        try:
            yield
        finally:
            self.whole = before
            self.observers.all = [one for one in self.observers.all if one is not observer]

    def note_moved(self, up: int = 0, down: int = 0) -> None:
        """Tell the observers how many bytes were uploaded or read back."""
        self.observers.moved(up, down)

    def text_of(self, program: moderngl.Program) -> tuple[str, str]:
        return next(texts for texts, one in self.programs.items() if one is program)

    def query(self) -> Any:
        """Return an occlusion query: draw in a ``with`` block, then read ``samples``."""
        query = OcclusionQuery(self.context, self._queries, self.fences)
        return HostQuery(self.observers, query) if self.observers else query

    def clear(self, framebuffer: moderngl.Framebuffer, *colour: float, **more: Any) -> None:
        """Fill a framebuffer, with the parameters of ``moderngl.Framebuffer.clear``."""
        framebuffer.clear(*colour, **more)
        self.fences.keep()

    def check_size(self, width: int, height: int, what: str) -> None:
        """Raise LimitError for a texture that is too large. GL would fail silently."""
        limit = self.max_texture_size
        if width > limit or height > limit:
            raise LimitError(f"{what} needs a {width} x {height} texture, {self.renderer} allows "
                             f"{limit} x {limit}; trace fewer rays at a time or a smaller scene")

    def check_error(self, what: str) -> None:
        """Raise LimitError if GL recorded an error, which moderngl may not report."""
        error = self.context.error
        if error != "GL_NO_ERROR":
            raise LimitError(f"OpenGL says {error} after {what} on {self.renderer}")

    def release(self, framebuffer: moderngl.Framebuffer) -> None:
        """Release ``framebuffer`` after binding another. Otherwise moderngl would later bind the
        released framebuffer again, which is a GL error."""
        if self._rest is None:
            self._rest = self.context.simple_framebuffer((1, 1))
        self._rest.use()
        framebuffer.release()

    def finish(self) -> None:
        """Wait until all issued draws have run."""
        self.context.finish()

    def info(self) -> dict[str, Any]:
        """Return the facts that `gpgpu-rt info` prints and measurements record."""
        return {"backend": self.backend, "renderer": self.renderer, "version": self.version,
                "max_texture_size": self.max_texture_size,
                "max_draw_buffers": self.max_draw_buffers}


def _create_egl() -> Gpu:
    device = os.environ.get("GPGPU_RT_EGL_DEVICE")
    if device is not None and not device.isdigit():
        raise OptionError(f"GPGPU_RT_EGL_DEVICE is {device!r}; set it to a device index: "
                          "0, 1, ...")
    settings = {} if device is None else {"device_index": int(device)}
    try:
        context = moderngl.create_context(standalone=True, backend="egl", require=GL_VERSION,
                                          **settings)
    except Exception as failure:   # moderngl raises bare Exception
        advice = HINT if device is None else (
            "set GPGPU_RT_EGL_DEVICE to another index, or unset it")
        raise ContextError(f"EGL gives no OpenGL 3.3 context ({failure}); {advice}") from failure
    return Gpu(context, "egl")


def _create_osmesa() -> Gpu:
    # OSMesa of Mesa 22.3 crashes when asked for zink.
    if os.environ.get("GALLIUM_DRIVER") == "zink":
        raise ContextError("OSMesa has no driver zink; unset GALLIUM_DRIVER, or choose egl")
    return Gpu(moderngl.create_context(require=GL_VERSION, context=OsMesaLoader()), "osmesa")


def _create_native() -> Gpu:
    try:
        context = moderngl.create_context(standalone=True, require=GL_VERSION)
    except Exception as failure:   # moderngl raises bare Exception
        raise ContextError(f"{sys.platform} gives no OpenGL 3.3 context ({failure}); {hint()}"
                           ) from failure
    return Gpu(context, "native")


def _create_angle() -> Gpu:
    context = moderngl.create_context(require=ES_VERSION, context=AngleLoader())
    while context.error != "GL_NO_ERROR":   # moderngl asks for limits that ES does not know
        pass
    gpu = Gpu(context, "angle")
    while context.error != "GL_NO_ERROR":
        pass
    return gpu


_making = threading.Lock()


def _shared(backend: str) -> Gpu:
    with _making:    # so that two threads make only one context
        return _made(backend)


@functools.lru_cache(maxsize=None)
def _made(backend: str) -> Gpu:
    gpu = {"egl": _create_egl, "osmesa": _create_osmesa, "native": _create_native,
           "angle": _create_angle}[backend]()
    # Leave the new context, so that other threads can use it.
    gpu.context.__exit__(None, None, None)
    return gpu


def open_gpu(context: str | moderngl.Context | Gpu | None = None) -> Gpu:
    """Return the context to draw with. The first call for a backend makes its shared context.

    Parameters
    ----------
    context : "auto", one of `backends`, a moderngl.Context (such as a window's), a Gpu, or None.
        None means the environment variable ``GPGPU_RT_CONTEXT``; if it is unset, "auto".
        "auto" tries EGL, then OSMesa; on Windows and macOS, the system's own context.

    Raises
    ------
    ContextError
        if no context can be made; the message says what to install
    """
    if isinstance(context, Gpu):
        return context
    if isinstance(context, moderngl.Context):
        return context.extra if isinstance(context.extra, Gpu) else Gpu(context, "window")
    if not isinstance(context, str | None):
        raise OptionError(f"context is {context!r}; give auto, {', '.join(backends())}, a "
                          "moderngl.Context, a Gpu or None")
    choice = context or os.environ.get("GPGPU_RT_CONTEXT") or "auto"
    if choice in backends():
        return _shared(choice)
    if choice != "auto":
        raise OptionError(f"context {choice!r} is none of auto, {', '.join(backends())}"
                          + did_you_mean(choice, ("auto", *backends())))
    failures = []
    for backend in automatic():
        try:
            return _shared(backend)
        except ContextError as failure:
            if backend == "egl" and "GPGPU_RT_EGL_DEVICE" in os.environ:
                raise      # the user wants no other device
            failures.append(f"{backend}: {failure}".split(";")[0])
    raise ContextError(f"no OpenGL context ({'; '.join(failures)}); {hint()}")


def probe() -> Iterator[tuple[str, Gpu | ContextError]]:
    """Yield each backend with its Gpu, or with its error."""
    for backend in backends():
        try:
            yield backend, _shared(backend)
        except ContextError as failure:
            yield backend, failure
