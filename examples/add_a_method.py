"""Load a method from a folder of your own and check it: see ../docs/how-to/add-a-method.md."""
from __future__ import annotations

import sys
from pathlib import Path

import gpgpu_rt as rt


def main(scene_name: str = "cornell", side: str = "64") -> None:
    """Trace eye rays with ``sweep`` along each axis, and compare the hits with brute force."""
    rt.load_methods(Path(__file__).with_name("methods"))
    scene = rt.load_scene(scene_name)
    rays = scene.camera.rays((int(side), int(side)))
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    for axis in range(3):
        with rt.Tracer(scene, "sweep", axis=axis, statistics=True) as tracer:
            hits = tracer.trace(*rays)
        same = (hits.t == expected.t) & (hits.triangle == expected.triangle)
        print(f"sweep along {'xyz'[axis]}: {hits.triangles_tested.mean():.1f} of {len(scene):,} "
              f"triangles tested per ray, {same.mean():.2%} of the hits equal brute force's bits")


if __name__ == "__main__":
    main(*sys.argv[1:])
