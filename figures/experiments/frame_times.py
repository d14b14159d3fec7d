"""Frame times: for each frame of a moving scene, the time to update the structure and to trace."""
from __future__ import annotations

import functools
import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.scene.animation import animation_names, load_animation
from gpgpu_rt.workers.machine import alone

# The cameras of the measurements in docs/moving-and-large.md. The animations' own cameras, which
# pictures use, are further away.
CAMERAS = {"cloth": rt.Camera((-1.9, 1.7, 2.6), (0.0, -0.1, 0.1), fov=40),
           "walker": rt.Camera((-5.4, 5.0, 8.6), (0.0, 0.8, 0.2), fov=40)}
STRIDE = 4   # number of animation frames from one measured frame to the next


def measure(scene: str, method: str, options: Mapping[str, Any], size: int,
            frames: int) -> dict[str, Any]:
    """Measure the times of each frame, in seconds, for size x size eye rays.

    A scene without an animation stands still. Its triangles are updated all the same, as by a
    program that does not know that nothing moved.

    Returns
    -------
    update, trace : lists with the times of each measured frame
    rebuilt : number of frames whose structure was rebuilt
    differing : number of rays, summed over all frames, whose hit distance differs from the
        distance that a tree built for that frame gives
    """
    start = _start(scene)
    rays = start.camera.rays((size, size))
    update, trace, rebuilt = [], [], 0
    shown = range(STRIDE, STRIDE * (frames + 1), STRIDE)
    vertices, found = {frame: _vertices(scene, frame) for frame in shown}, {}
    with rt.Tracer(start, method, **options) as tracer:
        tracer.trace(*rays)     # compile the programs
        with alone():
            for frame in shown:
                began = time.perf_counter()
                tracer.update(vertices[frame])
                update.append(time.perf_counter() - began)
                found[frame] = tracer.trace(*rays).t
                trace.append(tracer.statistics.trace_seconds)
                rebuilt += tracer.statistics.rebuilt
    differing = sum(int((found[frame] != _distances(scene, frame, size)).sum()) for frame in shown)
    return {"update": update, "trace": trace, "rebuilt": rebuilt, "differing": differing}


@functools.lru_cache(maxsize=4)
def _start(scene: str) -> rt.Scene:
    start = load_animation(scene).scene if scene in animation_names() else rt.load_scene(scene)
    return replace(start, camera=CAMERAS.get(scene, start.camera))


@functools.lru_cache(maxsize=16)
def _vertices(scene: str, frame: int) -> np.ndarray:
    if scene in animation_names():
        return load_animation(scene).vertices(frame)
    return _start(scene).triangles


@functools.lru_cache(maxsize=64)
def _distances(scene: str, frame: int, size: int) -> np.ndarray:
    """(rays,) float32 distances, from a tree that is built for the frame."""
    still = _start(scene).moved(_vertices(scene, frame))
    with rt.Tracer(still, "bvh-threaded") as tracer:
        return tracer.trace(*still.camera.rays((size, size))).t
