"""Gap work: the measurements of the experiments on the survey's sections 4.3 and 5.

There are three kinds of cells. They measure the bytes that passes move, the work of programs at
every SIMD width, and the depth of stacks.
"""
from __future__ import annotations

import math
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import Workload
from gpgpu_rt.gl.pass_log import logged
from gpgpu_rt.hardware.emulate import texels_along_morton
from gpgpu_rt.hardware.local_store import Fetches, transfers
from gpgpu_rt.hardware.sample import emulated, tile_pixels
from gpgpu_rt.inspect.time_travel import Pass, travel
from gpgpu_rt.methods import find_method
from gpgpu_rt.statistics import Statistics

from .coherence import observe_order

# The kinds are the beginnings of a cell's ``work``; a workload follows. MOVED measures the bytes
# that the passes of the workload move, DONE the work at each width, STACKS the stacks of its rays.
MOVED, DONE, STACKS = "moved by ", "done by ", "stacks of "
KINDS = (MOVED, DONE, STACKS)
WIDTHS = (1, 2, 4, 8, 16, 32, 48, 64)
# The side of an emulated square of rays, and the number of squares across and down the image.
SIDE, SPREAD = 32, (2, 2)
# Caches: their bytes, the bytes of a transfer, and the number of rays that fetch together.
STORES, LINES, TOGETHER = (8192, 16384, 131072), (16, 128), (4, 32)


def measure(kind: str, scene: rt.Scene, rays: Workload, method: str,
            options: dict[str, Any]) -> dict[str, Any]:
    """Measure a cell of a kind, and return the result."""
    return {MOVED: _moved, DONE: _done, STACKS: _stacks}[kind](scene, rays, method, options)


def _moved(scene: rt.Scene, rays: Workload, method: str,
           options: dict[str, Any]) -> dict[str, Any]:
    """The bytes of all passes by kind, as the pass log measured them."""
    with rt.Tracer(scene, method, **options) as tracer:
        with tracer.gpu, logged(tracer.gpu, Statistics()) as log:
            rays.trace(tracer)
        passes = log.to_list()
    total = {"rays": 0, "state": 0, "written": 0}
    for one in passes:
        again = sum(size for name, size in one["texel_bytes"].items() if name.startswith("rays_"))
        total["rays"] += again * one["fragments"]
        total["state"] += one["streams_read"] - again * one["fragments"]
        total["written"] += one["written"]
    return {"count": rays.live, "bytes": total, "draws": sum(one["draws"] for one in passes),
            "fragments": sum(one["fragments"] for one in passes), "queries": log.queries,
            "uploaded": log.uploaded, "read_back": log.read_back,
            "passes": [{key: one[key] for key in ("name", "draws", "fragments", "streams_read",
                                                  "written")} for one in passes]}


def _done(scene: rt.Scene, rays: Workload, method: str,
          options: dict[str, Any]) -> dict[str, Any]:
    """Return how often each region of the program runs, by width, and the misses of caches.

    Squares of rays are emulated. With ``sort_rays`` the squares are filled with rays in their
    sorted order.
    """
    ordered = options.pop("sort_rays", False)
    chosen = _sorted_squares(scene, rays) if ordered else tile_pixels(rays.size, (SIDE, SIDE),
                                                                      SPREAD)
    t_max: Any = np.inf if rays.t_max is None else rays.t_max[chosen].ravel()
    fetches = Fetches()
    with rt.Tracer(scene, method, **options) as tracer:
        run, watch = emulated(tracer, rays.origins[chosen], rays.directions[chosen], rays.any_hit,
                              t_max, (SIDE, SIDE), WIDTHS, look=fetches)
    program = run.program
    missed = {}
    for line in LINES:
        for together in TOGETHER:
            lines = fetches.in_order(line, together)
            missed |= {f"{store} {line} {together}": transfers(lines, store // line)
                       for store in STORES}
    return {"count": int(np.isfinite(rays.origins[chosen]).all(axis=2).sum()),
            "fragments": run.fragments, "kernels": kernels_of(program, method),
            "regions": [{"vector": w.vector, "scalar": w.scalar, "fetches": dict(w.fetches),
                         "loop": at in program.loops, "parent": program.parents[at],
                         "runs": {str(width): int(run.runs[width][at]) for width in WIDTHS}}
                        for at, w in enumerate(program.work)],
            "texel_bytes": watch.texel_bytes, "written_bytes": watch.written_bytes,
            "fetched": len(lines), "transfers": missed}


def kernels_of(program: Any, method: str) -> list[str]:
    """For each region, the kernel that contains it, or "" outside of all kernels."""
    names = find_method(method).kernels
    found = [""] * len(program.work)
    inner = program.loops[1:1 + len(names)]
    for at, parent in enumerate(program.parents):
        if at in inner:
            found[at] = names[inner.index(at)]
        elif parent >= 0:
            found[at] = found[parent]
    return found


def _sorted_squares(scene: rt.Scene, rays: Workload) -> np.ndarray:
    """Squares as in `tile_pixels`, filled with rays in their sorted order.

    Neighbours in an emulated square are neighbours in the order.
    """
    with rt.Tracer(scene, "bvh-threaded", sort_rays=True) as tracer:
        with observe_order(tracer) as orders:
            rays.trace(tracer)
    order = orders[0]
    order = order[order < len(rays.origins)]
    order = order[np.isfinite(rays.origins[order]).all(axis=1)]
    squares, inside = math.prod(SPREAD), texels_along_morton(SIDE, SIDE)
    found = np.zeros((SIDE, squares * SIDE), np.int64)
    for square in range(squares):
        first = (len(order) * (2 * square + 1)) // (2 * squares) - SIDE * SIDE // 2
        found[inside[:, 1], inside[:, 0] + SIDE * square] = order[first:first + SIDE * SIDE]
    return found


def _stacks(scene: rt.Scene, rays: Workload, method: str,
            options: dict[str, Any]) -> dict[str, Any]:
    """Return a histogram of the rays' deepest stacks, and the entries that the tree may need."""
    deepest = np.zeros(len(rays.origins), np.int64)

    def look(one: Pass) -> None:
        np.maximum(deepest, one.state["stacked"], out=deepest, casting="unsafe")
    with rt.Tracer(scene, method, schedule="step", **options) as tracer:
        travel(tracer, rays.origins, rays.directions, look, shape=(rays.size, rays.size))
        levels = (tracer.accelerator.stack_levels
                  or int(tracer.accelerator.defines.get("STACK_SIZE", 0)))
    return {"levels": levels, "histogram": np.bincount(deepest).tolist()}
