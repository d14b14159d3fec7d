"""Streams of pairs (ray, node): hits are the same for any stream size, near children are visited
first, and no buffer overflows."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.methods.bvh.ray_streams import RayStreams

COUNTERS = ("nodes_visited", "leaves_visited", "triangles_tested")


def stream_tracer(scene: rt.Scene, size: int, **options: object) -> rt.Tracer:
    return rt.Tracer(scene, "bvh-packet", streams=True, stream_size=size, **options)


def chain(count: int) -> rt.Scene:
    """Return a scene of triangles, each 1.5 times as large as the triangle before. The depth of
    the tree grows with ``count``."""
    corner = np.float32(1.5) ** np.arange(count, dtype=np.float32)[:, None, None]
    triangles = corner * np.float32([[1, 0, 0], [1, 1, 0], [1, 0, 1]])
    return rt.Scene.from_arrays(triangles.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


@pytest.mark.parametrize("statistics", [False, True], ids=["plain", "counted"])
@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
@pytest.mark.parametrize("rays", ["eye", pytest.param("surface", marks=pytest.mark.full)])
def test_streams_of_any_size_give_the_same_hits(precise_renderer, rays: str, seed: int,
                                                statistics: bool) -> None:
    """Streams of any size give the hits and the shadows of brute force."""
    scene = soup_scene(300, seed)
    chosen = RAY_SETS[rays](scene, 676, seed)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected, shadows = tracer.trace(*chosen), tracer.occluded(*chosen, t_max=1.5)
    for size in (37, 512, 1 << 20):
        with stream_tracer(scene, size, statistics=statistics) as tracer:
            assert_same_bits(tracer.trace(*chosen), expected)
            assert max(tracer.session.driver.lengths) <= size
            assert sum(tracer.session.driver.lengths) >= 676
            assert np.array_equal(tracer.occluded(*chosen, t_max=1.5), shadows)


def test_a_stream_of_one_element_visits_no_more_than_a_stack() -> None:
    """A stream of one element per pass never visits more nodes than a method with a stack per ray.

    A hit prunes all elements behind the hit. With more elements per pass, more elements are
    already tested when the hit is found, so the hit prunes fewer elements.
    """
    scene = soup_scene(300, 5)
    chosen = RAY_SETS["surface"](scene, 40, 5)
    with rt.Tracer(scene, "bvh-stack", statistics=True) as tracer:
        stack = tracer.trace(*chosen)
    found = {}
    for size in (1, 1 << 20):
        with stream_tracer(scene, size, statistics=True) as tracer:
            found[size] = tracer.trace(*chosen)
    for name in COUNTERS:
        one, all_at_once = (getattr(found[size], name) for size in found)
        assert (one <= getattr(stack, name)).all()
        assert one.sum() < 0.97 * all_at_once.sum() and one.sum() < getattr(stack, name).sum()
        assert one.sum() > 0.7 * getattr(stack, name).sum()


def test_counters_agree_with_the_lengths_of_streams() -> None:
    """The node of an element is an inner node, or a leaf that is a far child. A hit may prune a
    waiting element, so the streams have more elements than visited nodes."""
    scene = soup_scene(300, 6)
    chosen = RAY_SETS["random"](scene, 500, 6)
    with stream_tracer(scene, 1 << 20, statistics=True) as tracer:
        hits = tracer.trace(*chosen)
        through = sum(tracer.session.driver.lengths)
    nodes, leaves = (int(getattr(hits, name).sum()) for name in COUNTERS[:2])
    assert nodes < through <= 2 * nodes + 500
    assert leaves <= nodes + 500 and hits.triangles_tested.sum() >= leaves


@pytest.mark.parametrize("size", [64, 700])
def test_the_stream_does_not_overflow_in_a_deep_tree(precise_renderer, monkeypatch,
                                                     size: int) -> None:
    """The stream of waiting elements does not overflow in a deep tree.

    Every ray hits every node of the chain. Each level of the tree therefore adds one waiting
    element for each ray.
    """
    scene = chain(48)
    rng = np.random.default_rng(7)
    origins = rng.random((2000, 3)).astype(np.float32) * np.float32(0.01)
    directions = np.float32([1, 0.1, 0.1]) + 0 * origins
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(origins, directions)
    most, filter_ = [], RayStreams._filter

    def watch(self, rays, hits, first, count, any_hit) -> int:
        left = filter_(self, rays, hits, first, count, any_hit)
        most.append(first + left)
        assert first + left <= self._streams["queued"].length
        return left
    monkeypatch.setattr(RayStreams, "_filter", watch)
    with stream_tracer(scene, size) as tracer:
        depth = tracer.accelerator.structure.depth
        assert_same_bits(tracer.trace(origins, directions), expected)
    assert expected.hit.all() and max(most) > 0.7 * depth * size and depth > 10


@pytest.mark.parametrize("way", [-1, 1])
def test_lowest_index_wins(precise_renderer, way: int) -> None:
    """Triangles overlap in a plane. Along x, their indices ascend or descend.

    Leaves that are tested in one pass then have hits of equal t. In any order of the leaves, the
    lowest index must win.
    """
    shift = np.float32([[[way / 64, 0, 0]]]) * np.arange(80, dtype=np.float32)[:, None, None]
    triangles = np.float32([[-4, -4, 0], [4, -4, 0], [0, 4, 0]]) + shift
    scene = rt.Scene.from_arrays(triangles.reshape(-1, 3), np.arange(240).reshape(-1, 3))
    points = np.random.default_rng(1).random((500, 2)).astype(np.float32) - 1
    rays = np.column_stack([points, np.full(500, 3, np.float32)]), np.tile(
        np.float32([0, 0, -1]), (500, 1))
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    with stream_tracer(scene, 1 << 20) as tracer:
        assert_same_bits(tracer.trace(*rays), expected)
    assert len(np.unique(expected.t)) < 20


def test_a_cap_stops_rays() -> None:
    """A step cap stops rays. All rays are in flight at once, so a stopped ray does not change the
    order in which another ray visits nodes."""
    scene = soup_scene(200, 8)
    chosen = RAY_SETS["surface"](scene, 300, 8)
    with stream_tracer(scene, 1 << 20, statistics=True) as tracer:
        whole = tracer.trace(*chosen)
    cap = int(np.median(whole.steps))
    for statistics in (False, True):
        with stream_tracer(scene, 1 << 20, step_cap=cap, statistics=statistics) as tracer:
            capped = tracer.trace(*chosen)
            assert tracer.statistics.stopped == (capped.status == 2).sum()
        done = capped.status == 0
        assert (done == (whole.steps < cap)).all() and 0 < done.sum() < 300
        assert (capped.triangle[done] == whole.triangle[done]).all()


@pytest.mark.parametrize("options", [{"octants": True}, {"packet": (4, 2)},
                                     {"interval_test": True}, {"schedule": "loop"}], ids=str)
def test_options_that_exclude_streams_are_refused(options: dict) -> None:
    with pytest.raises(rt.OptionError, match="streams|kernels") as caught:
        rt.Tracer("cornell", "bvh-packet", streams=True, **options)
    assert "\n" not in str(caught.value)


def test_image_size_and_triangles_may_change(precise_renderer) -> None:
    """A tracer gives the same hits after the image size changes and after the triangles move."""
    scene = soup_scene(100, 9)
    with stream_tracer(scene, 256) as tracer, rt.Tracer(scene, "brute-force") as brute:
        for size in ((9, 5), (40, 30), (9, 5)):
            rays = scene.camera.rays(size)
            assert_same_bits(tracer.trace(*rays), brute.trace(*rays))
        moved = scene.triangles[::-1] * np.float32(1.1)
        for each in (tracer, brute):
            each.update(moved)
        assert_same_bits(tracer.trace(*rays), brute.trace(*rays))
        assert tracer.statistics.texture_bytes > sum(tracer.statistics.table_bytes.values())
