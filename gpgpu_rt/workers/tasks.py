"""Tasks: what runs in a worker: a process with one OpenGL context, which keeps the last
tracers it made, and the structures that others built."""
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
Structures = Mapping[str, bytes]     # files of the cache, named by their content

# Threads of a worker take turns at the tracers, as they would at the context.
_turn = threading.RLock()
# With each the files of the cache that it was made of.
_tracers: OrderedDict[tuple[str, str, Options], tuple[Tracer, list[Path]]] = OrderedDict()


def received(value: Any) -> Any:
    """A scene or a motion, once it has come: what other tasks take it from."""
    return value


def renderer() -> str:
    """What draws here."""
    return open_gpu().renderer


def structures(scene: Scene, digest: str, method: str, options: Options) -> Structures:
    """What is built for a method, as files of the cache that another worker can take."""
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
    """A tracer whose structures, where they were built elsewhere, are not built again."""
    give_cache(built)
    with _turn:
        yield _tracer(scene, digest, method, options)[0]


def trace(scene: Scene, built: Structures, digest: str, method: str, options: Options,
          rays: Mapping[str, Any], any_hit: bool) -> Hits | np.ndarray:
    """The hits of some rays, given as ``Tracer.trace`` takes them."""
    with tracer_of(scene, built, digest, method, options) as tracer:
        return tracer.occluded(**rays) if any_hit else tracer.trace(**rays)


def draw(scene: Scene, built: Structures, digest: str, method: str, options: Options,
         drawing: Mapping[str, Any], region: tuple[int, int, int, int]) -> np.ndarray:
    """(height, width, 3) uint8: a region of a picture, given as ``Tracer.render`` takes it."""
    with tracer_of(scene, built, digest, method, options) as tracer:
        return np.asarray(tracer.render(**drawing, region=region))


def draw_frame(scene: Scene, built: Structures, digest: str, method: str, options: Options,
               motion: Callable[[int], np.ndarray], drawing: Mapping[str, Any],
               frame: int) -> np.ndarray:
    """(height, width, 3) uint8: the picture of a frame, by a tracer that follows the motion."""
    with tracer_of(scene, built, f"{digest}, moving", method, options) as tracer:
        tracer.update(motion(frame))
        return np.asarray(tracer.render(**drawing))
