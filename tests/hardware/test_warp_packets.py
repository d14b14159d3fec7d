"""A packet as large as a warp consists of smaller packets, its parts. The large packet visits the
union of the places (nodes and triangles) that its parts visit."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.hardware.trace import KernelTrace, record_trace
from gpgpu_rt.hardware.warp_packets import growth

PLACES = {"traverse": "node", "intersect": "cursor"}


def _trace(parts: list[list[tuple[int, int]]]) -> KernelTrace:
    """Return the trace of a row of packets of 4x4, each with a list of (kernel, place)."""
    count = max(map(len, parts))
    steps, places = np.zeros((count, 1, len(parts)), np.uint8), np.zeros(
        (count, 1, len(parts)), np.int32)
    for part, runs in enumerate(parts):
        for at, (kernel, place) in enumerate(runs):
            steps[at, 0, part], places[at, 0, part] = kernel, place
    return KernelTrace(("traverse", "intersect"), steps, {"node": places, "cursor": places})


@pytest.mark.parametrize("parts, traverse, intersect", [
    # Both parts visit the same places, but in different orders. The packet visits each place once.
    ([[(1, 7), (1, 5), (2, 7)], [(1, 5), (2, 7), (1, 7)]], 1, 1),
    ([[(1, 7), (2, 3)], [(1, 5), (2, 4)]], 2, 2),
    # If one part is beyond the image or visits nothing, the warp makes the other part's visits.
    ([[(1, 7), (2, 3)], []], 2, 2),
    # The parts have three of four visits in common. A repeated visit counts again.
    ([[(1, 1), (1, 2), (1, 1)], [(1, 1), (1, 2), (1, 1), (1, 3)]], 2 * 4 / 7, 1),
    # Both warps visit place 2, each warp once.
    ([[(1, 1)], [(1, 2)], [(1, 2)], [(1, 2)]], 2 * 3 / 4, 1)])
def test_common_places_are_visited_once(parts: list[list[tuple[int, int]]], traverse: float,
                                        intersect: float) -> None:
    found = growth(_trace(parts), (4, 4), PLACES)
    assert found == pytest.approx({"traverse": traverse, "intersect": intersect})


@pytest.mark.parametrize("method", ["bvh-packet", "kd-ropes-packet"])
def test_the_packet_of_a_warp_is_the_packet_that_is_traced(method: str) -> None:
    """Packets of 4x2 visit about the union of the places that their parts of 2x2 visit."""
    scene, size = rt.load_scene("cornell"), (32, 32)
    found = {}
    for packet in ((4, 2), (2, 2)):
        with rt.Tracer(scene, method, schedule="step", packet=packet) as tracer:
            found[packet] = record_trace(
                tracer, size, lambda: tracer.trace(*scene.camera.rays(size)), ("cursor", "node"))
    parts = found[2, 2]
    # Parts of 2x2 rays in a packet of 4x2 behave like parts of 4x4 rays in a packet of 8x4.
    more = growth(parts, (4, 4), PLACES)
    for kernel in PLACES:
        union = more[kernel] * parts.totals()[kernel] / 2
        assert found[4, 2].totals()[kernel] == pytest.approx(union, rel=0.05)
        assert union < parts.totals()[kernel]
