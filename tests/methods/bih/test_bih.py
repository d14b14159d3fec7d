"""Bounding interval hierarchy: planes enclose the triangles below them, and builds terminate."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.methods.bih.tree import build_bih
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.quality import sah_cost

CASES = {
    "none": lambda: np.zeros((0, 3, 3), np.float32),
    "one": lambda: random_soup(1, 1),
    "soup": lambda: random_soup(900, 2),
    "coincident": lambda: np.repeat(random_soup(1, 3), 3000, axis=0),
    "line": lambda: random_soup(500, 4) * np.float32([1, 0, 0]),
    "nested": lambda: (0.7 ** np.arange(150)[:, None, None] * np.eye(3)).astype(np.float32),
    "huge": lambda: (random_soup(300, 5).astype(float) * 1e33).astype(np.float32),
    "tiny": lambda: (random_soup(300, 6).astype(float) * 1e-30).astype(np.float32),
    "stadium": lambda: np.concatenate([random_soup(300, 7) * np.float32(1e-6),
                                       random_soup(50, 8) * np.float32(1e3)]),
}


@pytest.mark.parametrize("max_leaf", [1, 4])
@pytest.mark.parametrize("name", CASES)
def test_planes_enclose_the_triangles_below(name: str, max_leaf: int) -> None:
    """Each node's box is made from the planes of its ancestors. The box contains all triangles
    of the subtree."""
    triangles = CASES[name]()
    bih = build_bih(triangles, max_leaf=max_leaf)
    assert np.array_equal(np.sort(bih.order), np.arange(len(triangles)))
    if not len(triangles):
        return
    nodes, leaf = np.arange(len(bih.axis)), bih.axis == 3
    assert (bih.count[leaf] > 0).all() and (bih.count[leaf] <= max_leaf).all()
    assert (bih.count[~leaf] == 0).all()
    parents = bih.parents()
    assert parents[0] == -1 and (np.bincount(parents[1:], minlength=len(nodes))
                                 == np.where(leaf, 0, 2)).all()
    lo, hi = bih.boxes()
    owner = np.repeat(nodes[leaf], bih.count[leaf])
    at = np.concatenate([np.arange(f, f + c) for f, c in zip(bih.child[leaf], bih.count[leaf])])
    inside = triangles[bih.order[at]]
    assert (np.diff(bih.order[at])[np.diff(owner) == 0] > 0).all()    # indices ascend in a leaf
    depth = 0
    while len(owner):
        assert (inside >= lo[owner, None]).all() and (inside <= hi[owner, None]).all()
        up = parents[owner]
        inside, owner, depth = inside[up >= 0], up[up >= 0], depth + 1
    assert depth == bih.depth + 1 <= 70


def test_planes_are_the_tightest() -> None:
    triangles = CASES["soup"]()
    bih = build_bih(triangles)
    below: dict[int, np.ndarray] = {}
    for node in reversed(range(len(bih.axis))):     # children come after their parent
        if bih.axis[node] == 3:
            below[node] = bih.order[bih.child[node]:bih.child[node] + bih.count[node]]
            continue
        left, right, axis = bih.child[node], bih.child[node] + 1, bih.axis[node]
        assert bih.left_hi[node] == triangles[below[left], :, axis].max()
        assert bih.right_lo[node] == triangles[below[right], :, axis].min()
        below[node] = np.concatenate([below[left], below[right]])
    assert len(below[0]) == len(triangles)


@pytest.mark.parametrize("options, message", [
    ({"max_leaf": 0}, "max_leaf"), ({"max_depth": -1}, "max_depth"), ({"bins": 4}, "bins")])
def test_wrong_options_are_refused(options: dict, message: str) -> None:
    with pytest.raises(rt.OptionError, match=message):
        build_bih(random_soup(5, 1), **options)


def test_size_and_cost_are_bounded() -> None:
    """A BIH has fewer than two nodes per triangle. Its SAH cost is higher than the cost of a BVH
    built by SAH, but less than four times as high."""
    triangles = random_soup(4000, 9, size=0.02)
    bih, sah = build_bih(triangles), build_bvh(triangles)
    assert len(bih.axis) < 2 * len(triangles)
    assert sah_cost(sah) < sah_cost(bih) < 4 * sah_cost(sah)


@pytest.mark.parametrize("stack_size", [4, 16])
@pytest.mark.parametrize("schedule", [{}, {"schedule": "step", "steps_per_pass": 7}])
def test_a_stack_saves_climbing_and_changes_no_hit(precise_renderer, stack_size: int,
                                                   schedule: dict) -> None:
    """Hits stay the same even if the stack is full, or if a new pass begins without the stack of
    the previous pass."""
    scene = soup_scene(3000, 10, size=0.05)
    rays = RAY_SETS["random"](scene, 1500, 11)
    found = []
    for options in ({}, {"stack_size": stack_size}):
        with rt.Tracer(scene, "bih", statistics=True, **schedule, **options) as tracer:
            found.append(tracer.trace(*rays))
    assert_same_bits(found[1], found[0])
    assert schedule or found[1].nodes_visited.mean() < 0.8 * found[0].nodes_visited.mean()
