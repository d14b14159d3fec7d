"""Warp kernel: finds hits with NVIDIA Warp's mesh, on the processor.

Warp reads the kernel's annotations, so this file has no ``from __future__ import annotations``.
"""
from .answers import EngineAnswers, Trace
from .case import Case


def prepare() -> Trace:
    """Import Warp, declare the kernel, and return the function that traces a case."""
    import numpy as np
    import warp
    warp.config.quiet = True

    @warp.kernel
    def trace_rays(mesh: warp.uint64, origins: warp.array(dtype=warp.vec3),
                   directions: warp.array(dtype=warp.vec3), ends: warp.array(dtype=float),
                   triangle: warp.array(dtype=int), t: warp.array(dtype=float),
                   any_hit: warp.array(dtype=int)):
        ray = warp.tid()
        found = warp.mesh_query_ray(mesh, origins[ray], directions[ray], ends[ray])
        triangle[ray] = -1
        any_hit[ray] = 0
        if found.result:
            triangle[ray] = found.face
            t[ray] = found.t
        if warp.mesh_query_ray_anyhit(mesh, origins[ray], directions[ray], ends[ray]):
            any_hit[ray] = 1

    def trace(case: Case) -> EngineAnswers:
        n, vertices = len(case.origins), case.triangles.reshape(-1, 3)
        vectors = [warp.array(array, dtype=warp.vec3, device="cpu")
                   for array in (vertices, case.origins, case.directions)]
        mesh = warp.Mesh(vectors[0], warp.array(np.arange(len(vertices), dtype=np.int32),
                                                dtype=int, device="cpu"))
        # Warp multiplies by the end of a ray, so the end must be finite.
        ends = np.minimum(np.broadcast_to(case.t_max, n), np.finfo(np.float32).max)
        found = [warp.zeros(n, dtype=kind, device="cpu") for kind in (int, float, int)]
        warp.launch(trace_rays, n, device="cpu", inputs=[
            mesh.id, *vectors[1:], warp.array(ends, dtype=float, device="cpu"), *found])
        triangle, t, any_hit = (one.numpy() for one in found)
        return EngineAnswers(triangle, t, any_hit != 0)
    return trace
