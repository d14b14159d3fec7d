"""Period work: the work of a method for an image's rays, counted as the papers' hardware does it.

Cells whose ``work`` is "period work of" and a workload measure it. They emulate tiles of an image.
"""
from __future__ import annotations

from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import Workload
from gpgpu_rt.hardware.program import Program
from gpgpu_rt.hardware.sample import TILE, emulated, program_of, tile_pixels

WORK = "period work of "
# How work is counted. SQUARES: 1024 pixels branch together, in a loop of one step per iteration.
# KERNELS: each kernel is a pass of its own.
SQUARES, KERNELS = " in squares", " by kernels"
# A width at which all fragments branch together, so the runs of a kernel are its passes.
TOGETHER = 1 << 20
WIDTHS = (1, 2, 32, 48, 1024, TOGETHER)
SQUARE = (32, 32)
# Methods that are emulated on fewer tiles, and the number of tiles across and down. Their rays
# test thousands of triangles, so these tiles are enough.
FEW = {"grid": (1, 2)}
ENOUGH = 32                # brute force tests this many triangles to measure the cost of one
# The whole image is sampled with about EVERY pixels a side, in blocks of BLOCK pixels a side. The
# pixels of a block stay together, because packets of distant pixels would be different packets.
EVERY, BLOCK = 256, 4


def measure(scene: rt.Scene, rays: Workload, method: str, options: dict[str, Any],
            manner: str) -> dict[str, Any]:
    """Count the work of the tiles' fragments, by region of the program and by width."""
    square = manner == SQUARES
    tile = SQUARE if square else TILE
    pixels = tile_pixels(rays.size, tile, FEW.get(method, (2, 2) if square else (3, 2)))
    origins, directions = rays.origins[pixels], rays.directions[pixels]
    t_max: Any = np.inf if rays.t_max is None else rays.t_max[pixels].ravel()
    some, more = _some_triangles(scene) if method == "brute-force" else (scene, 1.0)
    with rt.Tracer(some, method, **options) as tracer:
        run, watch = emulated(tracer, origins, directions, rays.any_hit, t_max, tile, WIDTHS,
                              flat=square)
        whole = _whole(tracer, rays, pixels) if method != "brute-force" else {}
    program = run.program
    inner = _inside(program, program.loops[-1]) if more > 1 else set()
    regions = [{"vector": w.vector, "scalar": w.scalar, "fetches": dict(w.fetches),
                "loop": at in program.loops, "parent": program.parents[at],
                "runs": {str(width): float(run.runs[width][at]) * (more if at in inner else 1)
                         for width in WIDTHS}} for at, w in enumerate(program.work)]
    found = {"rays": int(np.isfinite(origins).all(axis=2).sum()), "pixels": int(pixels.size),
             "fragments": run.fragments, "texel_bytes": watch.texel_bytes,
             "written_bytes": watch.written_bytes, "regions": regions, **whole}
    if manner == KERNELS:
        found["kernels"] = _kernels(some, method, options, program, regions)
    return found


def _whole(tracer: rt.Tracer, rays: Workload,
           pixels: np.ndarray) -> dict[str, dict[str, float]]:
    """Steps per pixel, and the share of pixels with a ray, in the ``image`` and in the ``tiles``.

    The shaders' own counters measure the steps. Tiles lie in the middle of their parts of the
    image, where rays may hit more or fewer triangles than at the image's edges.
    """
    apart = max(1, rays.size // EVERY)
    some = np.arange(rays.size) // BLOCK % apart == apart // 2
    image = np.arange(rays.size ** 2).reshape(rays.size, rays.size)[some][:, some]
    found = {}
    with tracer.counting():
        for name, chosen in (("image", image), ("tiles", pixels)):
            t_max: Any = np.inf if rays.t_max is None else rays.t_max[chosen].ravel()
            origins = rays.origins[chosen]
            (tracer.occluded if rays.any_hit else tracer.trace)(
                origins, rays.directions[chosen], t_max=t_max, invalid="miss")
            found[name] = {"steps": tracer.statistics.counters["steps"],
                           "rays": float(np.isfinite(origins).all(axis=2).mean())}
    return found


def image_scale(work: dict[str, Any]) -> float:
    """The work of a pixel of the whole image, as a multiple of the work of a tile's pixel."""
    if "image" not in work or not work["tiles"]["steps"]:
        return 1.0
    return work["image"]["steps"] / work["tiles"]["steps"]


def counted_rays(work: dict[str, Any]) -> float:
    """The tiles' number of rays, if as large a share of pixels had a ray as in the whole image."""
    return work["pixels"] * work["image"]["rays"] if "image" in work else work["rays"]


def _some_triangles(scene: rt.Scene) -> tuple[rt.Scene, float]:
    """A scene of the first ENOUGH triangles, and the factor by which ``scene`` has more."""
    corners = scene.triangles[:ENOUGH].reshape(-1, 3)
    few = rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))
    return few, len(scene) / len(few)


def _inside(program: Program, region: int) -> set[int]:
    """A region and all regions within it."""
    found = {region}
    for at, parent in enumerate(program.parents):
        if parent in found:
            found.add(at)
    return found


def _kernels(scene: rt.Scene, method: str, options: dict[str, Any], program: Program,
             regions: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return for each kernel, as a pass of its own, its program's work and its number of runs.

    The runs come from the loop program. It has an outer loop, which contains a loop for each
    kernel, in the order of phases.
    """
    with rt.Tracer(scene, method, **options, schedule="kernels") as tracer:
        with tracer.observe() as passes:
            tracer.trace(*scene.camera.rays((16, 16)))
        names = tracer.method.kernels
        texts = {1 + names.index(one.kernel): one.texts for one in passes if one.kernel in names}
    found = []
    for kernel, loop in enumerate(program.loops[1:], 1):
        if kernel not in texts:
            continue
        work = program_of(texts[kernel]).flattened(0)
        runs = regions[loop]["runs"]
        found.append({"name": names[kernel - 1], "vector": work.vector, "scalar": work.scalar,
                      "fetches": dict(work.fetches), "runs": runs["1"],
                      "passes": runs[str(TOGETHER)]})
    return found
