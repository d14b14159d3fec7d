"""Tests of `table_reads`, which lists the texels that a trace's kernels read, and of `transfers`,
which counts cache misses."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.errors import OptionError
from gpgpu_rt.hardware.image_issues import STEPWISE
from gpgpu_rt.hardware.local_store import lines_of, transfers
from gpgpu_rt.hardware.loop_costs import loop_costs
from gpgpu_rt.hardware.table_reads import FIELDS, TABLE, TABLES, table_reads
from gpgpu_rt.hardware.trace import KernelTrace, record_trace
from gpgpu_rt.methods.bvh.records import BVH_NODE
from gpgpu_rt.methods.kdtree.records import KD_NODE
from gpgpu_rt.traversal.triangle_table import REFERENCE, TRIANGLE

METHODS = (("kd-restart", {}), ("kd-texture-stack", {}), ("bvh-threaded", {"octants": True}))
NODE, TREE, LIST, CORNERS = (TABLE * TABLES.index(one)
                             for one in (KD_NODE, BVH_NODE, REFERENCE, TRIANGLE))


def _trace(kernels: tuple[str, ...], steps: list, node: list, cursor: list) -> KernelTrace:
    """Returns a trace of rays in one image row. Each inner list of an argument is a step."""
    def image(rows: list, kind: type) -> np.ndarray:
        return np.array(rows, kind)[:, None, :]
    return KernelTrace(kernels, image(steps, np.uint8), {
        "node": image(node, np.int32), "cursor": image(cursor, np.int32)})


def test_kd_rays_read_a_node_or_a_reference_and_a_triangle() -> None:
    # Ray 0 visits node 0 and then node 5. Ray 1 visits node 0 and then tests entry 2 of the list,
    # which is triangle 7.
    trace = _trace(("down", "intersect"), [[1, 1], [1, 2]], [[0, 0], [5, 0]], [[0, 0], [0, 2]])
    tables = {"kd_node": {}, "reference": {"triangle": np.array([4, 9, 7])}, "triangle": {}}
    corners = [CORNERS + 16 * (3 * 7 + k) for k in range(3)]
    together = [NODE, NODE, NODE + 16 * 5, LIST + 4 * 2, *corners]
    assert table_reads(trace, tables, (1, 2)).tolist() == together
    alone = [NODE, NODE + 16 * 5, NODE, LIST + 4 * 2, *corners]
    assert table_reads(trace, tables, (1, 1)).tolist() == alone


def test_bvh_rays_read_both_texels_of_a_node_before_the_next_ray_s_step() -> None:
    trace = _trace(("traverse", "intersect"), [[1, 1], [2, 0], [1, 0]], [[3, 4], [0, 0], [5, 0]],
                   [[0, 0], [6, 0], [0, 0]])
    tables = {"bvh_node": {}, "triangle": {}}
    boxes = [TREE + 16 * texel for texel in (6, 8, 7, 9)]   # both first texels, then both second
    assert table_reads(trace, tables, (1, 2)).tolist() == boxes + [
        CORNERS + 16 * (18 + k) for k in range(3)] + [TREE + 16 * 10, TREE + 16 * 11]


def test_finished_rays_and_stacks_read_nothing() -> None:
    trace = _trace(("down", "intersect", "push", "pop"), [[3, 4], [0, 0]], [[1, 1]] * 2,
                   [[1, 1]] * 2)
    tables = {"kd_node": {}, "reference": {"triangle": np.arange(3)}, "triangle": {}}
    assert table_reads(trace, tables, (2, 2)).size == 0


@pytest.mark.parametrize("method, kernel", [("kd-ropes", "follow_rope"),
                                            ("bvh-stack", "traverse")])
def test_unknown_reads_are_refused(method: str, kernel: str) -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, method, **STEPWISE) as tracer:
        trace = record_trace(tracer, (8, 8), lambda: tracer.trace(*scene.camera.rays((8, 8))))
        with pytest.raises(OptionError, match=f"kernel {kernel} are not known"):
            table_reads(trace, tracer.accelerator.tables, (1, 1))


@pytest.mark.parametrize("method, options", METHODS)
def test_reads_are_those_of_the_compiled_kernels(method: str, options: dict) -> None:
    """All kernel runs together read as many texels as the compiled kernels fetch, and each read
    lies within its table."""
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene, method, **options, **STEPWISE) as tracer:
        trace = record_trace(tracer, (16, 16), lambda: tracer.trace(
            *scene.camera.rays((16, 16))), FIELDS)
        tables = tracer.accelerator.tables
        places = table_reads(trace, tables, (1, 1))
    costs = loop_costs("g80", method, **options)
    assert len(places) == sum(count * costs[kernel].fetches
                              for kernel, count in trace.totals().items()) > 0
    for table, record in enumerate(TABLES):
        mine = places[places // TABLE == table] % TABLE
        if record.name not in tables:
            assert not len(mine)
            continue
        rows = len(list(tables[record.name].values())[-1])
        assert mine.max() < rows * record.texels * 4 * record.planes[0].components


def test_lines_begin_anew_in_each_table() -> None:
    places = np.array([0, 127, 128, TABLE, TABLE + 256])
    assert lines_of(places, 128).tolist() == [0, 0, 1, TABLE, TABLE + 2]


@pytest.mark.parametrize("seed", [3, 4])
def test_a_direct_mapped_cache_misses_as_in_a_simulation(seed: int) -> None:
    """`transfers` counts the same misses as a simulation that looks up the cache lines one
    by one."""
    random = np.random.default_rng(seed)
    lines = random.integers(0, 40, 500) + (random.integers(1, 3, 500) << 40)
    for places in (1, 8, 16, 1000):
        held: dict[int, int] = {}
        missed = 0
        for line in lines.tolist():
            place = (line + (line >> 40) * 7919) % places
            missed += held.get(place) != line
            held[place] = line
        assert transfers(lines, places) == missed
    assert transfers(lines, 1 << 23) == len(set(lines.tolist()))
