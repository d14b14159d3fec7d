"""Bench: methods on the same rays in one process, beside embreex where it is installed."""
from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from .errors import OptionError
from .scene import Scene
from .tracer import Tracer


def embree_runner(scene: Scene, origins: np.ndarray,
                  directions: np.ndarray) -> Callable[[], float] | None:
    """A function that traces the rays with embreex on one thread and returns seconds, or None."""
    try:
        from embreex import rtcore_scene
        from embreex.mesh_construction import TriangleMesh
    except ImportError:
        return None
    embree = rtcore_scene.EmbreeScene()
    TriangleMesh(embree, np.ascontiguousarray(scene.triangles))
    origins = np.ascontiguousarray(origins.reshape(-1, 3))
    directions = np.ascontiguousarray(directions.reshape(-1, 3))

    def run() -> float:
        began = time.perf_counter()
        embree.run(origins, directions)
        return time.perf_counter() - began
    return run


def bench(scene: Scene, candidates: Sequence[tuple[str, dict[str, Any]]],
          size: tuple[int, int] = (1024, 1024), runs: int = 5,
          report: Callable[[str], None] = lambda line: None) -> list[dict[str, Any]]:
    """Eye rays per second of each candidate, runs alternating, medians.

    Parameters
    ----------
    candidates : (method, options) each
    size : (width, height) of the image the rays go through
    runs : timed runs of each, after one warm-up
    report : told of the progress, a line at a time

    Returns
    -------
    list of dict
        ``name``, ``options``, ``seconds`` (passes alone), ``wall_seconds`` (numpy arrays in to
        numpy arrays out), ``rays_per_second``, ``spread`` (slowest over fastest run) and, where
        embreex is installed, ``over_embree``: its rate over embreex's on one thread.
    """
    if runs < 1:
        raise OptionError(f"{runs} runs tell nothing; give 1 or more")
    origins, directions = scene.camera.rays(size)
    count = size[0] * size[1]
    report(f"{scene.name}: building for {len(candidates)} candidates")
    tracers = [(name, options, Tracer(scene, name, **options)) for name, options in candidates]
    embree = embree_runner(scene, origins, directions)
    passes: list[list[float]] = [[] for _ in tracers]
    walls: list[list[float]] = [[] for _ in tracers]
    embree_times = []
    for turn in range(runs + 1):   # the first one warms up
        report(f"run {turn} of {runs}" if turn else "warm-up")
        for at, (_, _, tracer) in enumerate(tracers):
            began = time.perf_counter()
            tracer.trace(origins, directions)
            wall = time.perf_counter() - began
            if turn:
                passes[at].append(tracer.statistics.trace_seconds)
                walls[at].append(wall)
        if embree is not None:
            seconds = embree()
            if turn:
                embree_times.append(seconds)
    rows = []
    yardstick = statistics.median(embree_times) if embree_times else None
    for (name, options, tracer), times, wall_times in zip(tracers, passes, walls):
        seconds = statistics.median(times)
        rows.append(_row(name, options, count, seconds, statistics.median(wall_times),
                         max(times) / min(times), yardstick))
        tracer.release()
    if yardstick is not None:
        rows.append(_row("embreex, one thread", {}, count, yardstick, yardstick,
                         max(embree_times) / min(embree_times), yardstick))
    return rows


def _row(name: str, options: dict[str, Any], count: int, seconds: float, wall: float,
         spread: float, yardstick: float | None) -> dict[str, Any]:
    row = {"name": name, "options": options, "seconds": seconds, "wall_seconds": wall,
           "rays_per_second": count / seconds, "spread": spread}
    if yardstick is not None:
        row["over_embree"] = yardstick / seconds
    return row
