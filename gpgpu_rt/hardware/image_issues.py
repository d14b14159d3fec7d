"""Image issues: counts how often a card issues a method's kernels, for an image's rays.

An issue runs a kernel for all pixels that branch together (issue.py). Only samples of the rays are
traced. Evenly spread pixels give each kernel's runs, and the numbers of passes and queries. Tiles
of neighbouring pixels give the lanes that issues occupy, because only neighbours branch together.
For packets on the G80, all rays are traced.
"""
from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ..bench.workloads import Workload
from ..methods import find_method
from ..scene.scene import Scene
from ..tracer import Tracer
from ..traversal.packets import packet_of
from . import packet_trace
from .issue import (
    GROUPS, QUAD, STEP, WHILE_WHILE, WITHIN, KernelIssues, issued_in_loop, issued_in_passes
)
from .program_forms import (
    MEANINGS, PACKETS, PASSES, SAME_WALK, SINGLE_RAYS, SMALLER, SMALLER_GROUPS, packets_in_loop
)
from .trace import KernelTrace, record_trace
from .warp_packets import growth

# TILE: least side of a tile in pixels. Each card's groups (pixels that branch together) fill a
# tile exactly. Neighbours in a tile are neighbours in the image. TILES: tiles along an axis.
TILE, TILES = 96, 2
SPARSE = 128     # the image is also sampled at SPARSE x SPARSE pixels, evenly spread
# Options for a trace with the era form's triangle test. A pass runs one step of every ray.
STEPWISE = {"schedule": "step", "steps_per_pass": 1, "intersection": "moller-trumbore"}
# The largest packet of a packet method. Two such packets make a warp's packet (warp_packets.py).
WARP_PACKET = (4, 4)
# Kernel of a single-ray method -> (counter of the packet method, runs of the kernel for each unit
# of the counter). A bvh-packet counts a node once but tests the boxes of its two children: two
# runs of `traverse`. The counter of triangle tests sums a packet's rays: divide by their number.
RUNS = {"down": ("nodes_visited", 1.0), "traverse": ("nodes_visited", 2.0),
        "follow_rope": ("leaves_visited", 1.0),
        "intersect": ("triangles_tested", 1 / math.prod(WARP_PACKET))}
# Kernel of a single-ray method -> (kernel of the packet method that visits the same nodes or
# triangles, field of the state that holds the node or the position in a list of triangles).
PLACES = {"down": ("traverse", "node"), "traverse": ("traverse", "node"),
          "follow_rope": ("leave", "node"), "intersect": ("intersect", "cursor")}


@dataclass(frozen=True)
class Samples:
    """Two samples of the rays of an image or of another array.

    Attributes
    ----------
    sparse : evenly spread pixels; they give each kernel's runs
    tiles : tiles of neighbouring pixels; they give the lanes that issues occupy
    pixels : the number of pixels of the whole image
    """

    sparse: Workload
    tiles: Workload
    pixels: int

    @property
    def live(self) -> float:
        """The estimated number of pixels of the whole image that have a ray."""
        return self.pixels * self.sparse.live / len(self.sparse.origins)


def sampled(rays: Workload, method: str, chip: str, shrink: int = 1) -> Samples:
    """Return the samples of an image's rays that `count_issues` traces.

    Parameters
    ----------
    rays : all rays of the image, or of an array of rays with a ``shape``
    method, chip : they decide which pixels branch together
    shrink : divide the sides of the samples by this number
    """
    height, width = shape = rays.shape or (rays.size, rays.size)
    packet = 2 if packets_in_loop(method, chip) else 1
    group = GROUPS[chip] or QUAD
    sparse = [_spread(side, packet, SPARSE // shrink) for side in shape]
    tiles = [_tile_places(side, -(-TILE // shrink // block) * block, TILES)
             for side, block in zip(shape, (lanes * packet for lanes in group))]
    return Samples(*(rays.part(rows[:, None] * width + columns)
                     for rows, columns in (sparse, tiles)), height * width)


def measure(scene: Scene, rays: Workload, method: str, options: Mapping[str, Any],
            chip: str) -> dict[str, Any]:
    """Count how often each form of a card's program issues its kernels for the rays of an image.

    Parameters
    ----------
    scene : the scene that the rays hit
    rays : all rays of the image
    method : a method that has a form on the chip (`program_forms.forms_of`)
    options : options of the tracer and the method
    chip : a chip of `program_forms.FORMS`

    Returns
    -------
    dict with ``pixels``, ``rays`` (the number of pixels with a ray) and ``issued`` (form -> the
    fields of `KernelIssues`, for the whole image)
    """
    samples = sampled(rays, method, chip)
    if method in SINGLE_RAYS and not packets_in_loop(method, chip):
        issued = _issued_of_packets(scene, rays, samples, method, options)
        return _counts(samples, {PACKETS: issued})
    return count_issues(scene, samples, method, options, chip)


def count_issues(scene: Scene, samples: Samples, method: str, options: Mapping[str, Any],
                 chip: str, forms: Collection[str] = tuple(MEANINGS)) -> dict[str, Any]:
    """Return the result of `measure` from samples of the rays, only for the given ``forms``. The
    form PACKETS needs all rays: call `measure` for this form."""
    pixels = samples.pixels
    if method == "brute-force":
        tests = round(samples.live * len(scene))
        # Every ray tests every triangle, so no lane waits.
        return _counts(samples, {PASSES: KernelIssues(
            ("intersect",), (tests,), (tests,), 0, (len(scene),), len(scene) // 16)})
    packets, group = packets_in_loop(method, chip), GROUPS[chip]
    with Tracer(scene, SAME_WALK.get(method, method), **{**options, **STEPWISE}) as tracer:
        image, tiles = (_recorded(tracer, part, packets)
                        for part in (samples.sparse, samples.tiles))
        fragments = pixels // math.prod(packet_of(tracer.options)) if packets else pixels
    smaller = None if packets else SMALLER_GROUPS.get(chip)
    found = {form: _scaled(issued_in_loop(tiles, lanes, order, WITHIN), image, fragments)
             for form, order, lanes in ((WHILE_WHILE, WHILE_WHILE, group), (STEP, STEP, group),
                                        (SMALLER, STEP, smaller))
             if form in forms and lanes is not None}
    if not packets and PASSES in forms:
        found[PASSES] = _scaled(issued_in_passes(tiles), image, pixels, issued_in_passes(image))
    return _counts(samples, found)


def _issued_of_packets(scene: Scene, rays: Workload, samples: Samples, method: str,
                       options: Mapping[str, Any]) -> KernelIssues:
    """Return how often packets issue each kernel, with a packet's rays as the lanes of a warp.

    The counters of all rays give each kernel's runs for packets of WARP_PACKET. The tiles give the
    growth of the lanes from these packets to a warp's larger packet (`warp_packets.growth`).
    """
    chosen = {**options, "intersection": "moller-trumbore", "packet": WARP_PACKET}
    with Tracer(scene, method, **chosen) as tracer, tracer.counting():
        rays.trace(tracer)
        means = tracer.statistics.counters
    kernels = tuple(name for name in find_method(SINGLE_RAYS[method]).kernels if name in RUNS)
    places = dict(PLACES[name] for name in kernels)
    with Tracer(scene, method, **{**chosen, "schedule": "step"}) as tracer:
        part = samples.tiles
        assert part.shape is not None
        more = growth(record_trace(tracer, part.shape, lambda: part.trace(tracer),
                                   sorted(set(places.values()))), WARP_PACKET, places)
    runs = [means[counter] * times * samples.pixels
            for counter, times in map(RUNS.__getitem__, kernels)]
    lanes = [count * more[PLACES[name][0]] for name, count in zip(kernels, runs)]
    steps = means["steps"] * samples.pixels * sum(lanes) / max(sum(runs), 1)
    return KernelIssues(kernels, tuple(map(round, runs)), tuple(map(round, lanes)), round(steps),
                        (0,) * len(kernels))


def _recorded(tracer: Tracer, part: Workload, packets: bool) -> KernelTrace:
    assert part.shape is not None
    stack = packets and bool(tracer.options["stack_size"])
    trace = record_trace(tracer, part.shape, lambda: part.trace(tracer),
                         packet_trace.fields_of(stack) if packets else ())
    return packet_trace.in_loop(trace, stack) if packets else trace


def _spread(side: int, packet: int, most: int) -> np.ndarray:
    """Choose at most ``most`` of the ``side`` rows (or columns) of an image, in evenly spread
    groups of ``packet`` neighbours. Return the indices of the chosen rows."""
    if side <= most:
        return np.arange(side)
    count = most // packet
    starts = (np.arange(count) * side + side // 2) // count // packet * packet
    return (starts[:, None] + np.arange(packet)).reshape(-1)


def _tile_places(side: int, tile: int, tiles: int) -> np.ndarray:
    """Return the rows (or columns) of an image that the tiles cover. If the tiles would overlap,
    return all rows.

    The axis is divided into ``tiles`` equal parts, with a tile in the middle of each.
    """
    if side <= tiles * tile:
        return np.arange(side)
    starts = ((2 * np.arange(tiles) + 1) * side // (2 * tiles) - tile // 2) // 2 * 2
    return (starts[:, None] + np.arange(tile)).reshape(-1)


def tile_pixels(size: int, tile: int, tiles: int) -> np.ndarray:
    """Return the indices of the pixels of ``tiles`` x ``tiles`` tiles, as a square array.

    Parameters
    ----------
    size : side of the image in pixels
    tile : side of a tile in pixels
    tiles : number of tiles across, and down
    """
    places = _tile_places(size, tile, tiles)
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


def _counts(samples: Samples, found: Mapping[str, KernelIssues]) -> dict[str, Any]:
    return {"pixels": samples.pixels, "rays": samples.live,
            "issued": {form: asdict(issued) for form, issued in found.items()}}
