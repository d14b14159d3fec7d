"""Tasks: what runs in a worker: a process with one OpenGL context, which keeps the last
tracers it made, and the structures that others built."""
from __future__ import annotations

import contextlib
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from ..accel.cache import cache_files, give_cache
from ..hits import Hits
from ..scene import Scene
from ..tracer import Tracer

MOST_TRACERS = 2

Options = tuple[tuple[str, Any], ...]
Structures = Mapping[str, bytes]     # files of the cache, named by their content

_tracers: OrderedDict[tuple[str, str, Options], Tracer] = OrderedDict()


def received(scene: Scene) -> Scene:
    """A scene, once it has come: what other tasks take it from."""
    return scene


def structures(scene: Scene, digest: str, method: str, options: Options) -> Structures:
    """What is built for a method, as files of the cache that another worker can take."""
    with cache_files() as files:
        _tracer(scene, digest, method, options)
    return {path.name: path.read_bytes() for path in files if path.exists()}


def _tracer(scene: Scene, digest: str, method: str, options: Options) -> Tracer:
    key = (digest, method, options)
    if key not in _tracers:
        while len(_tracers) >= MOST_TRACERS:
            _tracers.popitem(last=False)[1].release()
        _tracers[key] = Tracer(scene, method, **dict(options))
    _tracers.move_to_end(key)
    return _tracers[key]


@contextlib.contextmanager
def tracer_of(scene: Scene, built: Structures, digest: str, method: str,
              options: Options) -> Iterator[Tracer]:
    """A tracer whose structures, where they were built elsewhere, are not built again."""
    give_cache(built)
    yield _tracer(scene, digest, method, options)


def trace(scene: Scene, built: Structures, digest: str, method: str, options: Options,
          rays: Mapping[str, Any], any_hit: bool) -> Hits | np.ndarray:
    """The hits of some rays, given as ``Tracer.trace`` takes them."""
    with tracer_of(scene, built, digest, method, options) as tracer:
        return tracer.occluded(**rays) if any_hit else tracer.trace(**rays)
