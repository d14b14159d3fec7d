"""Reinsertion moves subtrees of a BVH. It finds the best place of each subtree, makes only moves
without conflicts, and lowers the tree's cost."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_threaded, random_soup
from test_builders import BUILDS, MESHES

import gpgpu_rt as rt
from gpgpu_rt.accel import tree_order
from gpgpu_rt.methods import methods
from gpgpu_rt.methods.bvh import reinsertion
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.bvh.tree import LooseTree
from gpgpu_rt.methods.quality import sah_cost
from gpgpu_rt.rays.ray_sets import random_rays

seeds = pytest.mark.parametrize("seed", range(4))


def scrambled(count: int, seed: int) -> tuple[LooseTree, np.ndarray]:
    """Return a tree and its triangles. The tree comes from joining random pairs of subtrees; the
    first subtrees are single triangles."""
    rng = np.random.default_rng(seed)
    left, right = (np.full(2 * count - 1, -1) for _ in range(2))
    loose = list(rng.permutation(np.arange(count - 1, 2 * count - 1)))
    for node in range(count - 2, -1, -1):
        a, b = (loose.pop(rng.integers(len(loose))) for _ in range(2))
        left[node], right[node] = a, b
        loose.append(node)
    return (LooseTree(left, right, (left < 0).astype(np.int64), rng.permutation(count)),
            random_soup(count, seed, size=0.1))


def area(tree: LooseTree, triangles: np.ndarray) -> float:
    """Return half the surface area of all inner nodes' boxes, summed in float64."""
    lo, hi = (corner[tree.left >= 0].astype(float) for corner in tree.boxes(triangles))
    x, y, z = (hi - lo).T
    return float((x * y + y * z + z * x).sum())


def moved(tree: LooseTree, node: int, place: int) -> LooseTree | None:
    """Return the tree after the subtree of ``node`` became the sibling of the node ``place``, or
    None if the move is impossible."""
    parent = {int(child): (above, side) for side in (tree.left, tree.right)
              for above, child in enumerate(side) if child >= 0}
    above = place
    while above != 0 and above != node:
        above = parent[above][0]
    joint, _ = parent[node]
    if above == node or place == joint or joint == 0:
        return None
    left, right = tree.left.copy(), tree.right.copy()
    for side in (left, right):
        side[:] = np.where(side == joint, left[joint] + right[joint] - node, side)
    for side in (left, right):
        side[:] = np.where(side == place, joint, side)
    left[joint], right[joint] = place, node
    return LooseTree(left, right, tree.count, tree.triangle)


@seeds
def test_no_place_is_better_than_the_found_place(seed: int) -> None:
    tree, triangles = scrambled(12, seed)
    tables = reinsertion._Tables(tree, triangles)
    unit = np.ptp(triangles.reshape(-1, 3).astype(float), axis=0).max() ** -2
    found = tables._found(np.flatnonzero(tables.parent > 0).astype(np.int32))
    gains = dict(zip(found.node.tolist(), found.gain.tolist()))
    places = dict(zip(found.node.tolist(), found.place.tolist()))
    assert gains
    for node in np.flatnonzero(tables.parent > 0).tolist():
        others = {place: other for place in range(1, len(tree.left))
                  if (other := moved(tree, node, place)) is not None}
        saved = {place: area(tree, triangles) - area(other, triangles)
                 for place, other in others.items()}
        assert gains.get(node, 0) == pytest.approx(unit * max(0, *saved.values()), abs=1e-5)
        if node in places:
            assert saved[places[node]] == pytest.approx(max(saved.values()), abs=1e-5 / unit)


@pytest.mark.parametrize("count", [4, 30, 1000])
@seeds
def test_moves_of_one_round_keep_the_tree_valid(count: int, seed: int) -> None:
    """Many moves in one round keep the tree complete and never raise its cost."""
    tree, triangles = scrambled(count, seed)
    first = before = area(tree, triangles)
    for _ in range(4):
        tree = reinsertion.reinserted(tree, triangles, 1)
        now = area(tree, triangles)
        assert now <= before * (1 + 1e-6)
        before = now
        assert len(np.concatenate(tree_order.levels(tree.left, tree.right))) == 2 * count - 1
        assert_threaded(tree.thread(triangles), triangles)
    assert count == 4 or now < 0.75 * first


def balanced() -> LooseTree:
    """Return a balanced tree of 63 nodes: the children of node k are 2k + 1 and 2k + 2."""
    inner = np.arange(31)
    left, right = (np.append(2 * inner + k, np.full(32, -1)) for k in (1, 2))
    return LooseTree(left, right, (left < 0).astype(np.int64), np.arange(32))


@seeds
def test_the_better_half_moves_if_all_moves_gain_nothing(seed: int) -> None:
    """If all moves together do not lower the cost, only the half with the larger gains is made."""
    triangles = random_soup(32, seed, size=0.05)
    tables = reinsertion._Tables(balanced(), triangles)
    bad = reinsertion._Moves(np.int32([3]), np.int32([55]), np.int32([0]), np.float32([-1]))
    good = tables._found(np.arange(15, 63, dtype=np.int32))
    good = good.of(~np.isin(tables._links(good), tables._links(bad)).any(axis=0)).of(np.array([0]))
    both = reinsertion._Moves(*(np.concatenate([getattr(bad, name), getattr(good, name)])
                                for name in ("node", "place", "above", "gain")))
    cost, made = tables.cost, np.array([True, True])
    tables._make(both, made)
    assert made.tolist() == [False, True]
    assert tables.cost == pytest.approx(cost - good.gain[0], rel=1e-4)


def test_moves_below_each_other_conflict() -> None:
    """Each of two nodes would move to a place below the other node. If both nodes moved, neither
    would be connected to the root."""
    tables = reinsertion._Tables(balanced(), random_soup(32, 1))
    # Node 7 would move to node 55, which lies below node 13 (by way of 27). Node 13 would move to
    # node 31, which lies below node 7 (by way of 15).
    moves = reinsertion._Moves(np.int32([7, 13]), np.int32([55, 31]), np.int32([0, 0]),
                               np.float32([1, 2]))
    assert tables._without_conflict(moves).tolist() == [False, True]
    for one in (0, 1):
        assert tables._without_conflict(moves.of(np.array([one]))).tolist() == [True]


@pytest.mark.parametrize("build", BUILDS)
@pytest.mark.parametrize("name", MESHES)
def test_reinserted_is_a_threaded_tree(name: str, build: str) -> None:
    triangles = MESHES[name]()
    before, after = (build_bvh(triangles, build=build, reinsertion=rounds)
                     for rounds in (0, 2))
    assert_threaded(after, triangles)
    assert after.count.max(initial=0) <= 4
    assert sah_cost(after) <= sah_cost(before) * 1.001 or not len(triangles)


@pytest.mark.parametrize("build, least", [("sah", 0.03), ("lbvh", 0.1), ("hybrid", 0.04),
                                          ("kay-kajiya", 0.05), ("goldsmith-salmon", 0.03)])
@seeds
def test_trees_cost_less(build: str, least: float, seed: int) -> None:
    triangles = random_soup(2000, seed, size=0.05)
    before, after = (sah_cost(build_bvh(triangles, build=build, reinsertion=rounds))
                     for rounds in (0, 3))
    assert after < (1 - least) * before


def test_leaf_size_and_node_count_are_limited() -> None:
    triangles = random_soup(600, 1)
    for most in (1, 2, 7):
        assert build_bvh(triangles, reinsertion=1, max_leaf=most).count.max() <= most
    assert len(build_bvh(triangles, reinsertion=1, most_nodes=99).count) <= 99


@pytest.mark.parametrize("scale", [1e-30, 1e-12, 1e12, 1e30])
def test_the_scene_s_scale_does_not_matter(scale: float) -> None:
    """Reinsertion and the joining of leaves work alike at any scale of the scene."""
    triangles = random_soup(300, 5)
    plain, scaled = (build_bvh(triangles * np.float32(s), build="kay-kajiya", reinsertion=2)
                     for s in (1, scale))
    assert_threaded(scaled, triangles * np.float32(scale))
    assert len(scaled.count) < 2 * len(triangles) - 1       # leaves were joined
    assert abs(len(scaled.count) - len(plain.count)) < 0.1 * len(plain.count)


@pytest.mark.parametrize("options, told", [
    ({"reinsertion": -1}, "at least 0"), ({"reinsertion": 1.5}, "must be int"),
    ({"reinsertion": 10 ** 6}, "at most 1000"),
    ({"reinsertion": 1, "build_device": "gpu"}, "needs build_device cpu")], ids=str)
def test_wrong_values_are_refused(options: dict, told: str) -> None:
    with pytest.raises(rt.OptionError, match=told):
        rt.Tracer("cornell", "bvh-stack", **options)
    if "build_device" not in options:
        with pytest.raises(rt.OptionError, match="from 0 to 1000"):
            build_bvh(random_soup(9, 1), **options)


@pytest.mark.parametrize("method", [row.name for row in methods()
                                    if any(o.name == "reinsertion" for o in row.options)])
def test_hits_are_the_same(method: str) -> None:
    scene = rt.Scene.from_arrays(
        random_soup(400, 8, size=0.3).reshape(-1, 3), np.arange(1200).reshape(-1, 3))
    rays = random_rays(scene, 2000, 8)
    found = []
    for rounds in (0, 2):
        with rt.Tracer(scene, method, reinsertion=rounds) as tracer:
            found.append(tracer.trace(*rays))
    assert (found[0].triangle >= 0).any()
    for name in ("t", "u", "v", "triangle"):
        assert (getattr(found[0], name) == getattr(found[1], name)).all()
