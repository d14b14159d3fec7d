"""Measures how the time to trace rays grows with the number of triangles, on a rough ball of 0.1,
1 and 10 million triangles."""
from __future__ import annotations

import argparse
import math
import statistics
from collections.abc import Sequence
from contextlib import ExitStack
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.bench import Entry
from gpgpu_rt.rays.ray_sets import random_rays
from gpgpu_rt.scene.procedural.shapes import ball, bump

COUNTS = (100_000, 1_000_000, 10_000_000)
# Subtrees are shared, because eight copies of a tree over ten million triangles have more nodes
# than a float can index.
_TREE = {"quantise_nodes": 16, "octants": True, "shared_subtrees": 64}
_EYE = {"packet": (4, 2), "entry_points": 32, **_TREE}
# The methods for each kind of rays, ordered by their speed at ten million triangles. At 0.1
# million, packets with an interval test are the fastest for eye rays.
METHODS = {
    "eye": (("bvh-packet", _EYE), ("bvh-packet", {**_EYE, "interval_test": True}),
            ("bvh-threaded", _TREE), ("bvh-stack", {"quantise_nodes": 16})),
    "random": (("bvh-packet", {"packet": (2, 2), "presort": True, **_TREE}),
               ("bvh-threaded", {"presort": True, **_TREE}), ("bvh-threaded", _TREE),
               ("bvh-stack", {"quantise_nodes": 16})),
}
SIZE, TURNS, SEED = 1024, 5, 1
ALLOWED = 1.3      # largest growth of the time, divided by the growth of log(triangles)


def rough_ball(count: int) -> rt.Scene:
    """Return the rough ball as ``count`` triangles. Its surface is the same for every count."""
    triangles = ball(count)
    for height, wavelength in ((0.15, 0.5), (0.03, 0.1), (0.006, 0.02)):
        triangles = bump(triangles, height, wavelength)
    corners = triangles.reshape(-1, 3)
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3),
                                name=f"ball of {count:,}")


def milliseconds(scene: rt.Scene, kind: str, entries: Sequence[tuple[str, dict[str, Any]]]
                 ) -> list[float]:
    """Return the median time of a million rays of a kind for each (method, options).

    The time covers the passes and the host's sorting of rays. The entries run in turn, in several
    rounds. An untimed run before each timed run warms the caches.
    """
    origins, directions = scene.camera.rays((SIZE, SIZE)) if kind == "eye" else random_rays(
        scene, SIZE * SIZE, SEED)
    rays = origins.reshape(-1, 3), directions.reshape(-1, 3)
    spent: list[list[float]] = [[] for _ in entries]
    with ExitStack() as open_ones:
        tracers = [open_ones.enter_context(rt.Tracer(scene, method, **options))
                   for method, options in entries]
        for _ in range(TURNS):
            for tracer, times in zip(tracers, spent):
                for _ in range(2):
                    tracer.trace(*rays, shape=(SIZE, SIZE))
                times.append(1e3 * tracer.statistics.trace_seconds)
    return [statistics.median(times) for times in spent]


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    found: dict[tuple[str, str], list[float]] = {}
    for count in COUNTS:
        scene = rough_ball(count)
        for kind, entries in METHODS.items():
            for (method, options), took in zip(entries, milliseconds(scene, kind, entries)):
                words = Entry(method, options, SIZE * SIZE).label
                found.setdefault((words, kind), []).append(took)
                print(f"{len(scene):,} triangles, {kind} rays, {words}: {took:.1f} ms", flush=True)
    for (words, kind), times in found.items():
        grown = [later / before for before, later in zip(times, times[1:])]
        most = [ALLOWED * math.log2(later) / math.log2(before)
                for before, later in zip(COUNTS, COUNTS[1:])]
        print(f"{kind} rays, {words}: the time grows " + ", then ".join(
            f"{grew:.2f} times, {'within' if grew <= may else 'beyond'} the limit of {may:.2f}"
            for grew, may in zip(grown, most)))


if __name__ == "__main__":
    main()
