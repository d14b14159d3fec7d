"""Compare methods on the same rays: work, errors, and whether their hits agree to the bit.

``python examples/compare_methods.py bunny kd-restart kd-short-stack grid``
"""
from __future__ import annotations

import sys

import numpy as np

import gpgpu_rt as rt


def main(scene_name: str = "cornell", *names: str, side: int = 64) -> None:
    """Trace a picture's eye rays with each method and print a line per method.

    ``wrong`` counts the rays whose hit differs from the float64 answer. ``differ`` counts the
    rays whose hit differs from the first method's hit.
    """
    scene = rt.load_scene(scene_name)
    origins, directions = scene.camera.rays((side, side))
    truth = rt.reference.trace(scene, origins, directions, accelerated=True)   # float64
    first = None
    print(f"{'method':20} {'nodes':>8} {'triangles':>10} {'wrong':>6} {'differ':>7}")
    for name in names or ("kd-restart", "kd-short-stack", "bvh-threaded", "grid"):
        with rt.Tracer(scene, name, statistics=True) as tracer:
            hits = tracer.trace(origins, directions)
        first = first or hits
        differ = (hits.t != first.t) | (hits.triangle != first.triangle)
        off = np.abs(hits.t[truth.hit] - truth.t[truth.hit]) > 1e-4 * truth.t[truth.hit]
        wrong = int((hits.hit != truth.hit).sum()) + int(off.sum())
        print(f"{name:20} {hits.nodes_visited.mean():8.2f} {hits.triangles_tested.mean():10.2f} "
              f"{wrong:6} {int(differ.sum()):7}")


if __name__ == "__main__":
    main(*sys.argv[1:])
