"""Render a scene and print its cost: ``python examples/render.py cornell box.png``."""
from __future__ import annotations

import sys

import gpgpu_rt as rt


def main(scene_name: str = "cornell", output: str = "picture.png", side: str = "256") -> None:
    """Render a named scene or a mesh file as a picture of ``side`` x ``side`` pixels."""
    scene = rt.load_scene(scene_name)
    size = int(side), int(side)
    with rt.Tracer(scene, "bvh-threaded", octants=True, statistics=True) as tracer:
        print("\n".join(tracer.plan(size).lines()))     # the passes, and why passes are left out
        tracer.render(size=size).save(output)
        statistics = tracer.statistics
    print(f"{output}: {len(scene):,} triangles, {statistics.rays:,} rays, {statistics.passes} "
          f"passes, {statistics.counters['nodes_visited']:.1f} nodes per eye ray")


if __name__ == "__main__":
    main(*sys.argv[1:])
