"""The kd-tree family: traversals of single rays visit the same leaves, rays whose stack is full
are flagged, and packets lose no ray."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, real_scene, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.kdtree.ropes import build_ropes
from gpgpu_rt.methods.kdtree.tree import LEAF as KD_LEAF_AXIS
from gpgpu_rt.traversal.schedules import Traversal

STEPPING = [row.name for row in rt.methods()
            if row.name.startswith("kd-") and "step" in row.schedules and not row.packet]


def leaf_sequences(monkeypatch, scene: rt.Scene, method: str, rays, **options) -> list[list[int]]:
    """Return a list per ray: the numbers of the leaves in the order of visits.

    A leaf's number is the index of its first reference. The numbers are read after every pass.
    """
    sequences: list[list[int]] = [[] for _ in rays[0]]
    before = np.zeros(len(rays[0]), np.int64)
    draw = Traversal._draw

    def watch(self, program, rays, source, target, *rest) -> None:
        draw(self, program, rays, source, target, *rest)
        visited = target.fields("counters")["leaves_visited"][:len(sequences)]
        cursor = target.fields("state")["cursor"][:len(sequences)]
        for ray in np.flatnonzero(visited > before):
            sequences[ray].append(int(cursor[ray]))
        before[:] = np.maximum(before, visited)

    monkeypatch.setattr(Traversal, "_draw", watch)
    with rt.Tracer(scene, method, schedule="step", statistics=True, **options) as tracer:
        tracer.trace(*rays)
    monkeypatch.undo()
    return sequences


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("method", [name for name in STEPPING if name != "kd-restart"])
def test_leaf_sequences_are_those_of_restart(monkeypatch, method: str, seed: int) -> None:
    scene = soup_scene(150, seed)
    rays = RAY_SETS["random"](scene, 300, seed)
    expected = leaf_sequences(monkeypatch, scene, "kd-restart", rays)
    assert np.mean([len(sequence) for sequence in expected]) > 3
    found = leaf_sequences(monkeypatch, scene, method, rays)
    # A method may skip a leaf that a ray crosses in a single point. This happens to no ray here.
    assert found == expected


@pytest.mark.parametrize("options", [{"stack_size": 1}, {"stack_size": 4}, {"push_down": False}],
                         ids=str)
def test_short_stacks_of_any_size_visit_the_same_leaves(monkeypatch, options: dict) -> None:
    scene = soup_scene(150, 3)
    rays = RAY_SETS["random"](scene, 300, 3)
    assert (leaf_sequences(monkeypatch, scene, "kd-short-stack", rays, **options)
            == leaf_sequences(monkeypatch, scene, "kd-restart", rays))


@pytest.mark.parametrize("method", ["kd-stack", "kd-texture-stack"])
def test_a_full_stack_is_flagged(method: str) -> None:
    scene = soup_scene(300, 5)
    rays = RAY_SETS["random"](scene, 800, 4)
    with rt.Tracer(scene, method) as tracer:
        whole = tracer.trace(*rays)
    with rt.Tracer(scene, method, stack_size=1) as tracer:
        cut = tracer.trace(*rays)
        with pytest.raises(rt.Error, match="raise stack_size"):
            tracer.occluded(*rays)
    flagged = cut.status == 3
    assert not whole.status.any() and flagged.any() and not flagged.all()
    assert (cut.triangle == whole.triangle)[~flagged].all()


def test_a_stack_in_textures_takes_one_step_a_pass() -> None:
    with pytest.raises(rt.OptionError, match="one step per pass"):
        rt.Tracer(soup_scene(9, 1), "kd-texture-stack", steps_per_pass=4)
    with pytest.raises(rt.OptionError, match="runs under kernels, step only"):
        rt.Tracer(soup_scene(9, 1), "kd-texture-stack", schedule="loop")


def test_a_stack_lost_between_passes_is_replaced_by_a_restart(monkeypatch) -> None:
    scene = soup_scene(300, 6)
    rays = RAY_SETS["random"](scene, 600, 6)
    with rt.Tracer(scene, "kd-stack") as tracer:
        whole = tracer.trace(*rays)
    monkeypatch.setattr("gpgpu_rt.traversal.schedules.LOOP_STEPS", 7)
    with rt.Tracer(scene, "kd-stack") as tracer:
        assert_same_bits(tracer.trace(*rays), whole)
        assert tracer.statistics.passes > 3


@pytest.mark.parametrize("push_down", [True, False])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_ropes_lead_to_nodes_behind_a_face(seed: int, push_down: bool) -> None:
    tree = build_kdtree(random_soup(200, seed))
    lo, hi = tree.boxes()
    ropes = build_ropes(tree, push_down)
    assert (tree.axis[ropes.node] == KD_LEAF_AXIS).all()
    for axis in range(3):
        others = [a for a in range(3) if a != axis]
        for face, rope, outer in ((ropes.lo, ropes.rope_lo, tree.lo),
                                  (ropes.hi, ropes.rope_hi, tree.hi)):
            nil = rope[:, axis] < 0
            assert (nil == (face[:, axis] == outer[axis])).all()
            node, at = rope[~nil, axis], face[~nil, axis]
            touching = hi[node, axis] if outer is tree.lo else lo[node, axis]
            inside = (lo[node, axis] <= at) & (at <= hi[node, axis])
            assert (touching == at).all() if push_down else inside.all()
            assert (lo[node][:, others] <= ropes.lo[~nil][:, others]).all()
            assert (hi[node][:, others] >= ropes.hi[~nil][:, others]).all()


@pytest.mark.full
@pytest.mark.parametrize("name", ["cornell", "bunny", "robots", "kitchen", "conference"])
def test_a_short_stack_costs_few_nodes_more(name: str) -> None:
    scene = real_scene(name)
    rays = RAY_SETS["eye"](scene, 65_536, 0)
    nodes = {}
    for method in ("kd-stack", "kd-short-stack"):
        with rt.Tracer(scene, method, statistics=True) as tracer:
            nodes[method] = tracer.trace(*rays).nodes_visited.mean()
    assert nodes["kd-stack"] <= nodes["kd-short-stack"] <= 1.05 * nodes["kd-stack"]


@pytest.mark.parametrize("packet", [(2, 2), (4, 4)], ids=str)
@pytest.mark.parametrize("method", ["kd-packet", "kd-ropes-packet"])
def test_packets_at_their_step_limit_lose_no_ray(monkeypatch, method: str,
                                                 packet: tuple[int, int]) -> None:
    """If a packet reaches its step limit, its live rays are traced singly."""
    scene = soup_scene(300, 8)
    rays = RAY_SETS["random"](scene, 1000, 8)
    with rt.Tracer(scene, method, packet=packet) as tracer:
        whole = tracer.trace(*rays)
        occluded = tracer.occluded(*rays)
    monkeypatch.setattr("gpgpu_rt.traversal.packets.PACKET_STEPS", 60)
    with rt.Tracer(scene, method, packet=packet) as tracer:
        hits = tracer.trace(*rays)
        assert tracer.statistics.passes > 2
        assert_same_bits(hits, whole)
        assert not hits.status.any() and (tracer.occluded(*rays) == occluded).all()


@pytest.mark.parametrize("shape", [(1, 1), (3, 5), (17, 4), (2, 31)], ids=str)
def test_packets_at_the_edges_of_odd_images(shape: tuple[int, int]) -> None:
    scene = soup_scene(100, 3)
    origins, directions = RAY_SETS["random"](scene, shape[0] * shape[1], 5)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(origins, directions, shape=shape)
    with rt.Tracer(scene, "kd-packet", packet=(4, 4)) as tracer:
        assert_same_bits(tracer.trace(origins, directions, shape=shape), expected)


@pytest.mark.parametrize("single, options", [
    ("kd-short-stack", {}), ("kd-push-down", {"stack_size": 0}),
    ("kd-restart", {"stack_size": 0, "push_down": False})], ids=str)
def test_a_packet_that_visits_empty_leaves_walks_as_its_rays_do(single: str,
                                                                options: dict) -> None:
    """If empty leaves are not skipped, a packet of one ray visits the same nodes and leaves as the
    method for single rays. If empty leaves are skipped, the packet visits fewer nodes and leaves,
    and the hits are the same."""
    scene = soup_scene(150, 4)
    rays = RAY_SETS["random"](scene, 600, 4)

    def traced(method: str, **more: object) -> rt.Hits:
        with rt.Tracer(scene, method, statistics=True, **more) as tracer:
            return tracer.trace(*rays)
    alone = traced(single)
    all_leaves, fewer = (traced("kd-packet", packet=(1, 1), skip_empty_leaves=skips, **options)
                         for skips in (False, True))
    for name in ("nodes_visited", "leaves_visited", "triangles_tested"):
        assert np.array_equal(getattr(all_leaves, name), getattr(alone, name)), name
    assert_same_bits(all_leaves, alone)
    assert_same_bits(fewer, alone)
    assert fewer.leaves_visited.mean() < 0.5 * all_leaves.leaves_visited.mean()
    assert fewer.nodes_visited.mean() < all_leaves.nodes_visited.mean()


@pytest.mark.parametrize("packet", [(2, 2), (4, 4)], ids=str)
def test_skipping_empty_leaves_changes_no_hit(packet: tuple[int, int]) -> None:
    scene = soup_scene(150, 4)
    for rays in (RAY_SETS["random"](scene, 600, 4), RAY_SETS["eye"](scene, 1024, 4)):
        with rt.Tracer(scene, "brute-force") as tracer:
            expected = tracer.trace(*rays)
        for skips in (False, True):
            with rt.Tracer(scene, "kd-packet", packet=packet, skip_empty_leaves=skips) as tracer:
                assert_same_bits(tracer.trace(*rays), expected)
