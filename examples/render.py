"""A picture of a scene, and what it took: ``python examples/render.py cornell box.png``."""
from __future__ import annotations

import sys

import gpgpu_rt as rt


def main(scene_name: str = "cornell", output: str = "picture.png", side: str = "256") -> None:
    """Render a named scene, or a mesh file, ``side`` pixels square."""
    scene = rt.load_scene(scene_name)
    size = int(side), int(side)
    with rt.Tracer(scene, "bvh-threaded", octants=True, statistics=True) as tracer:
        print("\n".join(tracer.plan(size).lines()))      # what will be drawn, and why no more
        tracer.render(size=size).save(output)
        statistics = tracer.statistics
    print(f"{output}: {len(scene):,} triangles, {statistics.rays:,} rays, {statistics.passes} "
          f"passes, {statistics.counters['nodes_visited']:.1f} nodes an eye ray")


if __name__ == "__main__":
    main(*sys.argv[1:])
