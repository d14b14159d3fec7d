"""Times rays by how many triangles a scene has: one rough ball, of 0.1, 1 and 10 million."""
from __future__ import annotations

import argparse
import math
import statistics

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.rays import random_rays
from gpgpu_rt.scenes.shapes import ball, bump

COUNTS = (100_000, 1_000_000, 10_000_000)
# Of ten million triangles no more nodes than a float can number, as eight whole copies would be.
METHODS = (("bvh-packet", {"packet": (4, 2), "quantise_nodes": 16, "interval_test": True,
                           "entry_points": 32, "octants": True, "shared_subtrees": 64}),
           ("bvh-threaded", {"quantise_nodes": 16, "octants": True, "shared_subtrees": 64}),
           ("bvh-stack", {"quantise_nodes": 16}))
SIZE, TURNS, SEED = 1024, 5, 1
ALLOWED = 1.3      # times what the logarithm of the triangles grows by


def rough_ball(count: int) -> rt.Scene:
    """The same surface whatever the count, tessellated as finely as that."""
    triangles = ball(count)
    for height, wavelength in ((0.15, 0.5), (0.03, 0.1), (0.006, 0.02)):
        triangles = bump(triangles, height, wavelength)
    corners = triangles.reshape(-1, 3)
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3),
                                name=f"ball of {count:,}")


def milliseconds(scene: rt.Scene, method: str, options: dict[str, object]) -> dict[str, float]:
    """A million rays of each kind: medians, passes alone. The kinds follow one another, each on
    caches that hold the other's data: unlike in the bench, none runs once untimed before."""
    kinds = {"eye": tuple(rays.reshape(-1, 3) for rays in scene.camera.rays((SIZE, SIZE))),
             "random": random_rays(scene, SIZE * SIZE, SEED)}
    spent: dict[str, list[float]] = {kind: [] for kind in kinds}
    with rt.Tracer(scene, method, **options) as tracer:
        for turn in range(1 + TURNS):
            for kind, rays in kinds.items():
                tracer.trace(*rays, shape=(SIZE, SIZE))
                if turn:
                    spent[kind].append(1e3 * tracer.statistics.trace_seconds)
    return {kind: statistics.median(times) for kind, times in spent.items()}


def main() -> None:
    argparse.ArgumentParser(description=__doc__).parse_args()
    found: dict[tuple[str, str], list[float]] = {}
    for count in COUNTS:
        scene = rough_ball(count)
        for method, options in METHODS:
            for kind, took in milliseconds(scene, method, options).items():
                found.setdefault((method, kind), []).append(took)
                print(f"{len(scene):,} triangles, {method}, {kind} rays: {took:.1f} ms",
                      flush=True)
    for (method, kind), times in found.items():
        for k in range(1, len(times)):
            grown = times[k] / times[k - 1]
            most = ALLOWED * math.log2(COUNTS[k]) / math.log2(COUNTS[k - 1])
            print(f"{method}, {kind} rays, {COUNTS[k - 1]:,} to {COUNTS[k]:,}: {grown:.2f} times, "
                  f"{'within' if grown <= most else 'beyond'} {most:.2f}")


if __name__ == "__main__":
    main()
