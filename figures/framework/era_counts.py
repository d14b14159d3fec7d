"""Era counts: counts how often a card issues a method's kernels, from traces of an image's rays.

An issue runs a kernel for all pixels that branch together (hardware/issue.py). A cell (cell.py)
with the ``work`` "issues of WORKLOAD on CHIP" counts the issues. A method's era form is the form
in which the papers' cards can run its kernels (docs/era.md).
"""
from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import Workload
from gpgpu_rt.hardware import packet_trace
from gpgpu_rt.hardware.issue import (
    GROUPS, ORDERS, QUAD, STEP, WHILE_WHILE, WITHIN, KernelIssues, issued_in_loop, issued_in_passes
)
from gpgpu_rt.hardware.static_costs import era_methods, packet_methods
from gpgpu_rt.hardware.trace import KernelTrace, record_trace
from gpgpu_rt.hardware.warp_packets import growth
from gpgpu_rt.methods import find_method
from gpgpu_rt.traversal.packets import packet_of

WORK, ON = "issues of ", " on "
# TILE: side of a tile in pixels. Each card's groups (pixels that branch together) fill a tile
# exactly. Neighbours in a tile are neighbours in the image.
TILE, TILES = 96, 2
SPARSE = 128     # the image is also sampled at SPARSE x SPARSE pixels, evenly spread
PASSES, BLOCKS, PACKETS = "passes", "passes, blocks", "packets"
# The form WHILE_WHILE (hardware/issue.py) on the G80, but each lane loads its own data.
UNCOALESCED = "while-while, uncoalesced"
# The form STEP on NV40, but about 256 pixels branch together, as on the 7800 GTX, the next card of
# the family (AnandTech's G80 article, p. 7). More than four registers slow a program down (GPU
# Gems 2, chapter 30), probably because fewer pixels are in flight. No source says how many pixels
# then branch together.
SMALLER = "step, 256 pixels"
SMALLER_GROUPS = {"NV40": (16, 16)}
BLOCK = (8, 8)   # (h, w) of the pixels that the early depth test rejects together, under BLOCKS
# Options for a trace with the era form's triangle test. A pass runs one step of every ray.
STEPWISE = {"schedule": "step", "steps_per_pass": 1, "intersection": "moller-trumbore"}
# A method without an era form -> the method whose kernels stand in. kd-stack runs the kernels of
# kd-texture-stack in a loop. On the chip WARPS, the 32 rays of a packet are the lanes of a warp,
# and each lane runs a single ray's kernels at the node of the packet; voting and kd-packet's short
# stack are left out. On other cards a fragment traces a packet.
SAME_WALK = {"kd-stack": "kd-texture-stack"}
SINGLE_RAYS = {"kd-packet": "kd-push-down", "kd-ropes-packet": "kd-ropes",
               "bvh-packet": "bvh-threaded"}
WARPS = "G80"    # the chip whose warps run packets
# The largest packet of this program. Two such packets make a warp's packet (warp_packets.py).
WARP_PACKET = (4, 4)
# Kernel -> the packet counter that says how often each lane runs the kernel, and the runs per
# count. A bvh-packet counts a node once but tests the boxes of its two children: two runs of
# `traverse`. The counter of triangle tests is a sum over a packet's rays, hence the division.
RUNS = {"down": ("nodes_visited", 1.0), "traverse": ("nodes_visited", 2.0),
        "follow_rope": ("leaves_visited", 1.0),
        "intersect": ("triangles_tested", 1 / math.prod(WARP_PACKET))}
# Kernel -> the packet's kernel that visits the same nodes or triangles, and the state's field with
# the node or the cursor.
PLACES = {"down": ("traverse", "node"), "traverse": ("traverse", "node"),
          "follow_rope": ("leave", "node"), "intersect": ("intersect", "cursor")}


def kernels_from(method: str, form: str) -> str:
    """Return the method whose kernels are compiled in place of the kernels of ``method``."""
    return (SINGLE_RAYS if form == PACKETS else SAME_WALK).get(method, method)


def counted_as(form: str) -> str:
    """Return the form whose issues are counted for ``form``: both forms have the same issues."""
    return WHILE_WHILE if form == UNCOALESCED else form


def packets_in_loop(method: str, chip: str) -> bool:
    """Return whether a fragment of the chip traces a packet of the method in a loop."""
    return chip != WARPS and GROUPS.get(chip) is not None and method in packet_methods()


def forms_of(method: str, chip: str, forms: Sequence[str]) -> tuple[str, ...]:
    """Return the forms in which a method runs on a card's chip, or () if there is none.

    ``forms`` are the forms of the card's programs. Packets on WARPS, and brute force, always
    have a single form.
    """
    if packets_in_loop(method, chip):
        return tuple(form for form in forms if form in ORDERS)
    if method in SINGLE_RAYS:
        return (PACKETS,) if chip == WARPS else ()
    if SAME_WALK.get(method, method) not in era_methods():
        return ()
    return (PASSES,) if method == "brute-force" else tuple(forms)


def measure(scene: rt.Scene, rays: Workload, method: str, options: dict[str, Any],
            chip: str) -> dict[str, Any]:
    """Trace an even sample and tiles of the image. Return how often each form issues its kernels.

    The sample gives each kernel's runs and the numbers of passes and queries. The tiles give the
    lanes of each run, because only neighbours branch together. Issues are scaled to the whole
    image.
    """
    size, packets = rays.size, packets_in_loop(method, chip)
    sparse = rays.part(_sparse(size, 2 if packets else 1))
    pixels = size * size
    live = sparse.live / len(sparse.origins)
    if method in SINGLE_RAYS and not packets:
        issued = _issued_of_packets(scene, rays, method, options)
        return {"pixels": pixels, "rays": live * pixels, "issued": _plain({PACKETS: issued})}
    if method == "brute-force":
        tests = round(live * pixels * len(scene))
        # Every ray tests every triangle, so no lane waits.
        found = {PASSES: KernelIssues(("intersect",), (tests,), (tests,), 0, (len(scene),),
                                      len(scene) // 16)}
        return {"pixels": pixels, "rays": live * pixels, "issued": _plain(found)}
    with rt.Tracer(scene, SAME_WALK.get(method, method), **{**options, **STEPWISE}) as tracer:
        image, tiles = (_recorded(tracer, part, packets)
                        for part in (sparse, rays.part(tile_pixels(size))))
        fragments = pixels // math.prod(packet_of(tracer.options))
    if packets:
        found = {order: _scaled(issued_in_loop(tiles, GROUPS[chip], order, WITHIN), image,
                                fragments) for order in ORDERS}
        return {"pixels": pixels, "rays": live * pixels, "issued": _plain(found)}
    passes = issued_in_passes(image)
    found = {form: _scaled(issued_in_passes(tiles, block=block), image, pixels, passes)
             for form, block in ((PASSES, QUAD), (BLOCKS, BLOCK))}
    group = GROUPS[chip]
    if group is not None:
        found |= {order: _scaled(issued_in_loop(tiles, group, order, WITHIN), image, pixels)
                  for order in ORDERS}
    if chip in SMALLER_GROUPS:
        found[SMALLER] = _scaled(issued_in_loop(tiles, SMALLER_GROUPS[chip], STEP, WITHIN), image,
                                 pixels)
    return {"pixels": pixels, "rays": live * pixels, "issued": _plain(found)}


def _issued_of_packets(scene: rt.Scene, rays: Workload, method: str,
                       options: dict[str, Any]) -> KernelIssues:
    """Return how often packets issue each kernel, with a packet's rays as the lanes of a warp.

    The counters of all rays give each kernel's runs for packets of WARP_PACKET. The tiles give the
    factor by which a warp's larger packet occupies more lanes.
    """
    chosen = {**options, "intersection": "moller-trumbore", "packet": WARP_PACKET}
    with rt.Tracer(scene, method, **chosen) as tracer, tracer.counting():
        rays.trace(tracer)
        means = tracer.statistics.counters
    kernels = tuple(name for name in find_method(SINGLE_RAYS[method]).kernels if name in RUNS)
    places = dict(PLACES[name] for name in kernels)
    with rt.Tracer(scene, method, **{**chosen, "schedule": "step"}) as tracer:
        part = rays.part(tile_pixels(rays.size))
        assert part.shape is not None
        more = growth(record_trace(tracer, part.shape, lambda: part.trace(tracer),
                                   sorted(set(places.values()))), WARP_PACKET, places)
    runs = [means[counter] * times * rays.size ** 2
            for counter, times in map(RUNS.__getitem__, kernels)]
    lanes = [count * more[PLACES[name][0]] for name, count in zip(kernels, runs)]
    steps = means["steps"] * rays.size ** 2 * sum(lanes) / max(sum(runs), 1)
    return KernelIssues(kernels, tuple(map(round, runs)), tuple(map(round, lanes)), round(steps),
                        (0,) * len(kernels))


def _recorded(tracer: rt.Tracer, part: Workload, packets: bool) -> KernelTrace:
    assert part.shape is not None
    stack = packets and bool(tracer.options["stack_size"])
    trace = record_trace(tracer, part.shape, lambda: part.trace(tracer),
                         packet_trace.fields_of(stack) if packets else ())
    return packet_trace.in_loop(trace, stack) if packets else trace


def _sparse(size: int, side: int) -> np.ndarray:
    """Return the indices of SPARSE x SPARSE evenly spread pixels, in squares of ``side`` x
    ``side``."""
    count = SPARSE // side
    starts = (np.arange(count) * size + size // 2) // count // side * side
    places = (starts[:, None] + np.arange(side)).reshape(-1)
    return places[:, None] * size + places


def tile_pixels(size: int, tile: int = TILE, tiles: int = TILES) -> np.ndarray:
    """Return the indices of the pixels of ``tiles`` x ``tiles`` tiles, as a square array.

    The image is divided into ``tiles`` x ``tiles`` equal parts, with a tile in the middle of each.

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
    """Return the issues of the tiles, scaled kernel by kernel to the whole image.

    ``host`` gives the image's passes and queries.
    """
    factor = pixels / math.prod(image.steps.shape[1:])
    runs = [factor * image.totals()[name] for name in issued.kernels]
    grown = [new / max(old, 1) for new, old in zip(runs, issued.runs)]
    # A kernel that no ray of the tiles runs has unknown lanes: assume no idle lane.
    lanes = [max(count * more, new) for count, more, new in zip(issued.lanes, grown, runs)]
    overall = sum(runs) / max(sum(issued.runs), 1)
    return KernelIssues(issued.kernels, tuple(map(round, runs)), tuple(map(round, lanes)),
                        round(issued.iterations * overall), host.passes if host else (),
                        host.queries if host else 0)


def _plain(found: dict[str, KernelIssues]) -> dict[str, Any]:
    return {form: asdict(issued) for form, issued in found.items()}
