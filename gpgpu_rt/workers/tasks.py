"""Tasks: the functions that run in a worker.

A worker is a process with one OpenGL context and the tracers that it used last.
"""
from __future__ import annotations

import contextlib
import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..accel.cache import cache_files, give_cache
from ..gl.context import open_gpu
from ..hits import Hits
from ..scene.scene import Scene
from ..tracer import Tracer

MOST_TRACERS = 2

Options = tuple[tuple[str, Any], ...]
# Name -> content of a cache file. The name is the digest of the triangles, builder and options.
Structures = Mapping[str, bytes]

# Locks the tracers of a worker, which share one OpenGL context.
_turn = threading.RLock()
# Each tracer, with the cache files that it was built from.
_tracers: OrderedDict[tuple[str, str, Options], tuple[Tracer, list[Path]]] = OrderedDict()


def received(value: Any) -> Any:
    """Return ``value``, a scene or a motion. Later tasks receive it through this task's future."""
    return value


def renderer() -> str:
    return open_gpu().renderer


def structures(scene: Scene, digest: str, method: str, options: Options) -> Structures:
    """Build a method's structures and return them as cache files."""
    with _turn:
        files = _tracer(scene, digest, method, options)[1]
    return {path.name: path.read_bytes() for path in files if path.exists()}


def _tracer(scene: Scene, digest: str, method: str, options: Options) -> tuple[Tracer, list[Path]]:
    key = (digest, method, options)
    if key not in _tracers:
        while len(_tracers) >= MOST_TRACERS:
            _tracers.popitem(last=False)[1][0].release()
        with cache_files() as files:
            _tracers[key] = Tracer(scene, method, **dict(options)), files
    _tracers.move_to_end(key)
    return _tracers[key]


@contextlib.contextmanager
def tracer_of(scene: Scene, built: Structures, digest: str, method: str,
              options: Options) -> Iterator[Tracer]:
    """Yield a tracer. ``built`` holds the tracer's structures, which a worker has built."""
    give_cache(built)
    with _turn:
        yield _tracer(scene, digest, method, options)[0]


def trace(scene: Scene, built: Structures, digest: str, method: str, options: Options,
          rays: Mapping[str, Any], any_hit: bool) -> Hits | np.ndarray:
    """Return the hits of some rays; with ``any_hit``, return whether each ray hits a triangle.

    ``rays`` holds the arguments of ``Tracer.trace`` or ``Tracer.occluded``.
    """
    with tracer_of(scene, built, digest, method, options) as tracer:
        return tracer.occluded(**rays) if any_hit else tracer.trace(**rays)


def draw(scene: Scene, built: Structures, digest: str, method: str, options: Options,
         drawing: Mapping[str, Any], region: tuple[int, int, int, int]) -> np.ndarray:
    """Return a region of a picture, (height, width, 3) uint8.

    ``drawing`` and ``region`` are arguments of ``Tracer.render``.
    """
    with tracer_of(scene, built, digest, method, options) as tracer:
        return np.asarray(tracer.render(**drawing, region=region))


def draw_frame(scene: Scene, built: Structures, digest: str, method: str, options: Options,
               motion: Callable[[int], np.ndarray], drawing: Mapping[str, Any],
               frame: int) -> np.ndarray:
    """Move the triangles to a frame's positions. Return a picture, (height, width, 3) uint8."""
    with tracer_of(scene, built, f"{digest}, moving", method, options) as tracer:
        tracer.update(motion(frame))
        return np.asarray(tracer.render(**drawing))
