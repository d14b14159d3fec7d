"""Octant copies hold all leaves front to back, and a shared subtree is stored once for all
octants.

`gpgpu_rt.methods.bvh.octant_copies` defines octant copies and shared subtrees.
"""
from __future__ import annotations

import numpy as np
import pytest
from test_builders import MESHES, mesh

from gpgpu_rt.accel.runs import expand, owners
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.bvh.octant_copies import OctantCopies, times_stored
from gpgpu_rt.methods.bvh.tables import Threads


@mesh
def test_copies_hold_the_same_leaves(name: str) -> None:
    bvh = build_bvh(MESHES[name]())
    copies = OctantCopies.of(bvh, met_anyway=1)
    for octant in range(8):
        runs = np.stack([copies.first[octant], copies.count[octant]], 1)
        kept = runs[copies.count[octant] > 0]
        expected = np.stack([bvh.first, bvh.count], 1)[bvh.count > 0]
        assert sorted(map(tuple, kept)) == sorted(map(tuple, expected))
        inner = np.flatnonzero(copies.count[octant] == 0)
        lo, hi = copies.lo[octant].astype(float), copies.hi[octant].astype(float)
        near, far = inner + 1, copies.escape[octant][inner + 1]
        apart = (lo + hi)[far] - (lo + hi)[near]
        axis = np.abs(apart).argmax(1)
        sign = np.where((octant >> axis) & 1, -1, 1)
        assert (sign * apart[np.arange(len(inner)), axis] >= 0).all()   # front to back


@mesh
def test_copies_leave_out_only_boxes(name: str) -> None:
    """If boxes are dropped, the leaves, the order of leaves and the nesting of the remaining boxes
    stay the same."""
    bvh = build_bvh(MESHES[name]())
    whole, fewer = OctantCopies.of(bvh, met_anyway=1), OctantCopies.of(bvh, met_anyway=0.5)
    assert fewer.source.shape[1] < whole.source.shape[1] or bvh.count.size < 8
    for octant in range(8):
        leaves = [copies.source[octant][copies.count[octant] > 0] for copies in (whole, fewer)]
        assert (leaves[0] == leaves[1]).all()
        # In a copy, the indices from a node up to its escape index belong to the kept nodes of
        # its subtree.
        source, escape = fewer.source[octant], fewer.escape[octant]
        below = expand(np.arange(len(source)), escape - np.arange(len(source)))
        owner = owners(escape - np.arange(len(source)))
        inside, outside = source[below], source[owner]
        assert (bvh.lo[inside] >= bvh.lo[outside]).all()
        assert (bvh.hi[inside] <= bvh.hi[outside]).all()
        kept = set(source.tolist())
        sizes = bvh.escape - np.arange(len(bvh.escape))
        assert all(int(escape[i] - i) == sum(n in kept for n in range(node, node + sizes[node]))
                   for i, node in enumerate(source.tolist()[:200]))


def walk(threads: Threads, octant: int, met: np.ndarray) -> tuple[list[int], list[int]]:
    """Return the tree nodes that a walk tests and the leaves that the walk enters.

    ``met`` says for each tree node whether the ray hits its box. The walk takes the same steps as
    glsl/methods/bvh/shared_subtrees.glsl.
    """
    node, after = octant * threads.uniforms["node_count"], -1
    tested, leaves = [], []
    while node >= 0:
        first, escape = (int(threads.links[name][node]) for name in ("first", "escape"))
        source = int(threads.source[node])
        tested.append(source)
        leaves += [source] if met[source] and first >= 0 else []
        past = after if escape < 0 else escape
        if met[source] and first < 0:
            node, after = (-2 - first, past) if first < -1 else (node + 1, after)
        else:
            node, after = past, -1 if escape < 0 else after
        assert len(tested) <= 2 * len(threads.source)
    return tested, leaves


@pytest.mark.parametrize("most", [1, 3, 8, 50, 1 << 20])
@pytest.mark.parametrize("name", sorted(set(MESHES) - {"empty"}))
def test_walks_enter_the_same_leaves_with_shared_subtrees(name: str, most: int) -> None:
    """For any set of hit boxes, walks with and without shared subtrees enter the same leaves. A
    shared node is stored once."""
    bvh = build_bvh(MESHES[name]())
    whole, shared = (Threads(bvh, {"octants": True, "shared_subtrees": some})
                     for some in (None, most))
    size = bvh.escape - np.arange(len(bvh.escape))
    times = np.bincount(shared.source, minlength=len(size))
    assert set(times.tolist()) <= {0, 1, 8}
    assert set(times[size > most].tolist()) <= {0, 8}       # too large to be shared
    assert set(times[bvh.count > 0].tolist()) <= {1, 8}     # no leaf is left out
    if most > 1:
        assert len(shared.source) < len(whole.source) or len(size) < 3
    rng, (left, right) = np.random.default_rng(most), bvh.children()
    for octant in range(8):
        for share in (1.0, 0.9, 0.6):
            met = rng.random(len(size)) < share
            # A ray that hits a box also hits all boxes around this box.
            for node in np.flatnonzero(left >= 0):
                met[left[node]] &= met[node]
                met[right[node]] &= met[node]
            entered = [walk(threads, octant, met) for threads in (whole, shared)]
            assert sorted(entered[0][1]) == sorted(entered[1][1])
            assert sorted(entered[0][1]) == np.flatnonzero(met & (bvh.count > 0)).tolist()
            assert all(len(set(tested)) == len(tested) for tested, _ in entered)


def test_shared_subtrees_save_most_nodes() -> None:
    """Shared subtrees reduce the number of stored nodes to less than a quarter."""
    triangles = MESHES["ball"]()
    bvh = build_bvh(triangles)
    whole, shared = OctantCopies.of(bvh), OctantCopies.of(bvh, shared_subtrees=64)
    assert (shared.shared.size + shared.source.size) * 4 < whole.source.size
    assert (shared.below >= 0).any(axis=1).all()


@pytest.mark.parametrize("most", [None, 3, 8, 16, 32, 64, 500])
def test_times_stored_bounds_the_records(most: int | None) -> None:
    """The copies have at most `times_stored` records for each node of the tree."""
    for name in ("soup", "ball", "slivers"):
        bvh = build_bvh(MESHES[name]())
        copies = OctantCopies.of(bvh, shared_subtrees=most or 0)
        assert copies.records <= times_stored(most) * len(bvh.count)


def test_no_tree_no_copies() -> None:
    copies = OctantCopies.of(build_bvh(MESHES["empty"]()), shared_subtrees=8)
    assert copies.source.shape == (8, 0) and not len(copies.shared)
