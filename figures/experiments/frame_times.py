"""Frame times: measures the update and the trace of each frame of a moving scene."""
from __future__ import annotations

import contextlib
import functools
import time
from collections.abc import Generator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.scene.animation import animation_names
from gpgpu_rt.workers.machine import alone

# The cameras of the measurements in docs/moving-and-large.md. Pictures use the animations' own
# cameras, which are farther from the scene.
CAMERAS = {"cloth": rt.Camera((-1.9, 1.7, 2.6), (0.0, -0.1, 0.1), fov=40),
           "walker": rt.Camera((-5.4, 5.0, 8.6), (0.0, 0.8, 0.2), fov=40)}
# The frame before the first measured one, if motion begins late; default 0.
FIRST = {"kitchen-moving": 250}
STRIDE = 4   # number of animation frames from one measured frame to the next
# With this option of a cell, another process builds the next structure (`Tracer.updates`).
AHEAD = ("build_ahead", True)


def measure(scene: str, method: str, options: Mapping[str, Any], size: int,
            frames: int) -> dict[str, Any]:
    """Measure the times of each frame, in seconds, for size x size eye rays.

    If a scene has no animation, each update writes the same triangles, as in a program that does
    not know that nothing moves. With AHEAD, another process builds the next frame's structure
    during the trace of a frame. An update is then the wait for this build and the writing of the
    tables. The frame that starts the process is not counted.

    Returns
    -------
    update, trace : lists with the times of each measured frame
    rebuilt : number of frames whose structure was rebuilt
    differing : number of rays, over all frames, whose hit distance differs from the distance in
        a tree built for the frame
    """
    start = _start(scene)
    rays = start.camera.rays((size, size))
    update, trace, rebuilt = [], [], 0
    first = FIRST.get(scene, 0) + STRIDE
    shown = range(first, first + STRIDE * frames, STRIDE)
    vertices, found = {frame: _vertices(scene, frame) for frame in shown}, {}
    own, ahead = dict(options), AHEAD in options.items()
    own.pop(AHEAD[0], None)
    with rt.Tracer(start, method, **own) as tracer, contextlib.closing(
            _moves(tracer, _vertices(scene, FIRST.get(scene, 0)), list(vertices.values()),
                   ahead)) as moves:
        next(moves)
        tracer.trace(*rays)     # compile the programs
        with alone():
            for frame in shown:
                began = time.perf_counter()
                next(moves)
                update.append(time.perf_counter() - began)
                found[frame] = tracer.trace(*rays).t
                trace.append(tracer.statistics.trace_seconds)
                rebuilt += tracer.statistics.rebuilt
    differing = sum(int((found[frame] != _distances(scene, frame, size)).sum()) for frame in shown)
    return {"update": update, "trace": trace, "rebuilt": rebuilt, "differing": differing}


@functools.lru_cache(maxsize=1)
def _animation(scene: str) -> rt.Animation:
    return rt.load_animation(scene)


def _moves(tracer: rt.Tracer, first: np.ndarray, vertices: list[np.ndarray],
           ahead: bool) -> Generator[None, None, None]:
    """At each ``next``, move the tracer's triangles, to ``first`` and then to each of
    ``vertices``.

    Without ``ahead``, the first ``next`` moves nothing: the caller has put the triangles at
    ``first``.
    """
    if ahead:
        yield from tracer.updates([first, *vertices])
        return
    yield
    for positions in vertices:
        tracer.update(positions)
        yield


@functools.lru_cache(maxsize=4)
def _start(scene: str) -> rt.Scene:
    """The scene before the measured frames, with the camera of these frames.

    An animated scene has no normals: hits do not need normals, and each frame would compute them
    anew.
    """
    if scene not in animation_names():
        return rt.load_scene(scene)
    animation, first = _animation(scene), FIRST.get(scene, 0)
    start = animation.scene.moved(animation.vertices(first)) if first else animation.scene
    camera = animation.drawing(first, {"camera": CAMERAS.get(scene)})["camera"]
    return replace(start, camera=camera or start.camera, normals=None)


@functools.lru_cache(maxsize=16)
def _vertices(scene: str, frame: int) -> np.ndarray:
    if scene in animation_names():
        return _animation(scene).vertices(frame)
    return _start(scene).triangles


@functools.lru_cache(maxsize=64)
def _distances(scene: str, frame: int, size: int) -> np.ndarray:
    """(rays,) float32 distances from a tree built for the frame."""
    still = _start(scene).moved(_vertices(scene, frame))
    with rt.Tracer(still, "bvh-threaded") as tracer:
        return tracer.trace(*still.camera.rays((size, size))).t
