"""Era counts: the issues of a method's kernels on a card, from traces of an image's rays.

Cells whose ``work`` is "era counts of", a workload and a chip measure them.
"""
from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import Workload
from gpgpu_rt.hardware.issue import ORDERS, KernelIssues, issued_in_loop, issued_in_passes
from gpgpu_rt.hardware.trace import KernelTrace, record_trace

WORK, ON = "era counts of ", " on "
# The (h, w) of the pixels that branch together, as many as cards.json's branch_width. The survey
# states no shape: these are the rectangles nearest to a square. R420 cannot branch.
GROUPS = {"R420": None, "NV40": (32, 32), "R580": (6, 8), "G80": (4, 8)}
# A tile has whole groups of every card; neighbouring pixels stay neighbours.
TILE, TILES = 96, 2
SPARSE = 128     # the image is also sampled by this many pixels a side, evenly spread
PASSES = "passes"
# The trace needs a step of every ray a pass. The papers' triangle test is that of the era form.
STEPWISE = {"schedule": "step", "steps_per_pass": 1, "intersection": "moller-trumbore"}


def measure(scene: rt.Scene, rays: Workload, method: str, options: dict[str, Any],
            chip: str) -> dict[str, Any]:
    """Trace an even sample and tiles of the image, and return the issues of each form.

    The even sample gives the runs of each kernel and the numbers of passes and queries. The tiles
    give the lanes of each run, because only neighbouring pixels share a group. Issues are scaled
    to the whole image.
    """
    size = rays.size
    sparse = rays.part(_sparse(size))
    pixels = size * size
    live = sparse.live / len(sparse.origins)
    if method == "brute-force":
        tests = round(live * pixels * len(scene))
        # Every ray tests every triangle, so no lane waits.
        found = {PASSES: KernelIssues(("intersect",), (tests,), (tests,), 0, (len(scene),),
                                      len(scene) // 16)}
        return {"pixels": pixels, "rays": live * pixels, "issued": _plain(found)}
    with rt.Tracer(scene, method, **{**options, **STEPWISE}) as tracer:
        image, tiles = (_recorded(tracer, part) for part in (sparse, rays.part(tile_pixels(size))))
    passes = issued_in_passes(image)
    found = {PASSES: _scaled(issued_in_passes(tiles), image, pixels, passes)}
    group = GROUPS[chip]
    if group is not None:
        found |= {order: _scaled(issued_in_loop(tiles, group, order), image, pixels)
                  for order in ORDERS}
    return {"pixels": pixels, "rays": live * pixels, "issued": _plain(found)}


def _recorded(tracer: rt.Tracer, part: Workload) -> KernelTrace:
    assert part.shape is not None
    return record_trace(tracer, part.shape, lambda: part.trace(tracer))


def _sparse(size: int) -> np.ndarray:
    places = (np.arange(SPARSE) * size + size // 2) // SPARSE
    return places[:, None] * size + places


def tile_pixels(size: int, tile: int = TILE, tiles: int = TILES) -> np.ndarray:
    """Return the pixels of tiles in the middles of the image's parts, one tile beside another.

    Parameters
    ----------
    size : side of the image in pixels
    tile : side of a tile in pixels
    tiles : number of tiles across, and down
    """
    starts = (2 * np.arange(tiles) + 1) * size // (2 * tiles) - tile // 2
    places = (starts[:, None] + np.arange(tile)).reshape(-1)
    return places[:, None] * size + places


def _scaled(issued: KernelIssues, image: KernelTrace, pixels: int,
            host: KernelIssues | None = None) -> KernelIssues:
    """Return the tiles' issues for the whole image, kernel by kernel.

    ``host`` has the passes and queries of the whole image.
    """
    factor = pixels / image.steps[0].size
    runs = [factor * image.totals()[name] for name in issued.kernels]
    grown = [new / max(old, 1) for new, old in zip(runs, issued.runs)]
    lanes = [count * more for count, more in zip(issued.lanes, grown)]
    overall = sum(runs) / max(sum(issued.runs), 1)
    return KernelIssues(issued.kernels, tuple(map(round, runs)), tuple(map(round, lanes)),
                        round(issued.iterations * overall), host.passes if host else (),
                        host.queries if host else 0)


def _plain(found: dict[str, KernelIssues]) -> dict[str, Any]:
    return {form: asdict(issued) for form, issued in found.items()}
