"""Gap work: makes measurements for several experiments (survey, sections 4.3 to 5).

The experiments are retention, simd_width, stacks and ideal_hardware.
"""
from __future__ import annotations

from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.accel.morton import morton_2d
from gpgpu_rt.bench.workloads import Workload
from gpgpu_rt.gl.pass_log import logged
from gpgpu_rt.hardware.image_issues import STEPWISE, tile_pixels
from gpgpu_rt.hardware.issue import WHILE_WHILE, WITHIN, KernelIssues, issued_in_loop
from gpgpu_rt.hardware.local_store import lines_of, transfers
from gpgpu_rt.hardware.table_reads import FIELDS, table_reads
from gpgpu_rt.hardware.trace import KernelTrace, record_trace
from gpgpu_rt.inspect.time_travel import Pass, travel
from gpgpu_rt.statistics import Statistics

from .coherence import observe_order

# The kinds of these measurements. ``Cell.work`` is a kind, followed by the name of a workload.
# MOVED measures the bytes that passes move. DONE measures the runs of kernels at each SIMD width
# (the number of pixels that branch together). STACKS measures the depth of the rays' stacks.
MOVED, DONE, STACKS = "moved by ", "run by ", "stacks of "
KINDS = (MOVED, DONE, STACKS)
# SIMD width -> (h, w) of the rectangle of pixels that branch together, as square as possible.
GROUPS = {1: (1, 1), 2: (1, 2), 4: (2, 2), 8: (2, 4), 16: (4, 4), 32: (4, 8), 48: (6, 8),
          64: (8, 8)}
WIDTHS = tuple(GROUPS)
# Side of a traced square of rays, and number of squares across and down the image. The GROUPS of
# every width tile a square exactly, whether they are groups of rays or of packets of 2x2 rays.
SIDE, SPREAD = 48, 2
# The known errors of the static costs. Pages that use static costs print this text.
COMPILED = ("Each kernel was compiled as a separate program. Two errors are known. First, the "
            "counts include the instructions that move a ray's state to the program's outputs, "
            "although a loop would keep the state in registers. This error makes the predicted "
            "times too long. Second, the counts leave out the set-up of rays and the branches of "
            "loops. This error makes the predicted times too short.")
# The simulated caches. STORES: bytes of a cache. LINES: bytes of a line. TOGETHER: number of rays
# that fetch together.
STORES, LINES, TOGETHER = (8192, 16384, 131072), (16, 128), (4, 32)
MISSES = ("kd-restart", "kd-texture-stack", "bvh-threaded")     # methods whose misses are counted


def measure(kind: str, scene: rt.Scene, rays: Workload, method: str,
            options: dict[str, Any]) -> dict[str, Any]:
    """Make the measurement of this kind (KINDS)."""
    return {MOVED: _moved, DONE: _done, STACKS: _stacks}[kind](scene, rays, method, options)


def _moved(scene: rt.Scene, rays: Workload, method: str,
           options: dict[str, Any]) -> dict[str, Any]:
    """Return the bytes that all passes move, from the pass log.

    ``rays`` counts the bytes read from ray textures, ``state`` from state and hit textures.
    """
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
    """Return the runs of each kernel, the lanes occupied at each SIMD width, and cache misses.

    Only squares of SIDE^2 rays are traced. With ``sort_rays``, rays in sorted order fill the
    squares. A packet counts as one fragment.
    """
    ordered = options.pop("sort_rays", False)
    part = rays.part(_sorted_squares(scene, rays) if ordered
                     else tile_pixels(rays.size, SIDE, SPREAD))
    assert part.shape is not None
    missed = {}
    with rt.Tracer(scene, method, **{**options, **STEPWISE}) as tracer:
        trace = record_trace(tracer, part.shape, lambda: part.trace(tracer),
                             FIELDS if method in MISSES else ())
        if method in MISSES:
            missed = _missed(trace, tracer)
    issued = {width: issued_in_loop(trace, group, WHILE_WHILE, WITHIN)
              for width, group in GROUPS.items()}
    return {"count": part.live, "runs": trace.totals(), "transfers": missed,
            "lanes": {str(width): _lanes(one) for width, one in issued.items()}}


def _lanes(issued: KernelIssues) -> dict[str, int]:
    return dict(zip(issued.kernels, issued.lanes))


def _missed(trace: KernelTrace, tracer: rt.Tracer) -> dict[str, int]:
    """Return the misses of each cache, by bytes of the cache, bytes of a line, and rays that fetch
    together."""
    found = {}
    for together in TOGETHER:
        places = table_reads(trace, tracer.accelerator.tables, GROUPS[together])
        for line in LINES:
            lines = lines_of(places, line)
            found |= {f"{store} {line} {together}": transfers(lines, store // line)
                      for store in STORES}
    return found


def _sorted_squares(scene: rt.Scene, rays: Workload) -> np.ndarray:
    """Return indices of sorted rays, (SIDE, SPREAD * SPREAD * SIDE): squares side by side.

    Consecutive rays fill a square along a Morton curve, so neighbours in the order stay near each
    other in the square.
    """
    with rt.Tracer(scene, "bvh-threaded", sort_rays=True) as tracer:
        with observe_order(tracer) as orders:
            rays.trace(tracer)
    order = orders[0]
    order = order[order < len(rays.origins)]
    order = order[np.isfinite(rays.origins[order]).all(axis=1)]
    squares = SPREAD * SPREAD
    y, x = np.divmod(np.arange(SIDE * SIDE), SIDE)
    curve = np.argsort(morton_2d(y, x))
    found = np.zeros((SIDE, squares * SIDE), np.int64)
    for square in range(squares):
        first = (len(order) * (2 * square + 1)) // (2 * squares) - SIDE * SIDE // 2
        found[y[curve], x[curve] + SIDE * square] = order[first:first + SIDE * SIDE]
    return found


def _stacks(scene: rt.Scene, rays: Workload, method: str,
            options: dict[str, Any]) -> dict[str, Any]:
    """Return a histogram of the rays' deepest stacks, and the capacity of a stack."""
    deepest = np.zeros(len(rays.origins), np.int64)

    def look(one: Pass) -> None:
        np.maximum(deepest, one.state["stacked"], out=deepest, casting="unsafe")
    with rt.Tracer(scene, method, schedule="step", **options) as tracer:
        travel(tracer, rays.origins, rays.directions, look, shape=(rays.size, rays.size))
        levels = (tracer.accelerator.stack_levels
                  or int(tracer.accelerator.defines.get("STACK_SIZE", 0)))
    return {"levels": levels, "histogram": np.bincount(deepest).tolist()}
