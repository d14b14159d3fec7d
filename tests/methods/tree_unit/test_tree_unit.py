"""tree-unit finds the hits of brute force, with both criteria for entering a node and every
schedule. The tables in the method's node format contain the whole kd-tree or BVH."""
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.methods import find_method
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.tree_unit.tree import LEAF, ROOT, UnitTree, from_bvh, from_kdtree

ROW = find_method("tree-unit")
CRITERIA = ("interval", "box")
SCHEDULES = ({"schedule": "loop"}, {"schedule": "step", "steps_per_pass": 7},
             {"schedule": "kernels"})


@pytest.mark.parametrize("schedule", SCHEDULES, ids=lambda s: s["schedule"])
@pytest.mark.parametrize("criterion", CRITERIA)
def test_hits_are_those_of_brute_force(precise_renderer, criterion: str, schedule: dict) -> None:
    scene = soup_scene(700, 10, size=0.1)
    rays = RAY_SETS["random"](scene, 600, 11)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    with rt.Tracer(scene, ROW.name, criterion=criterion, **schedule) as tracer:
        assert_same_bits(tracer.trace(*rays), expected)
    assert expected.hit.any() and not expected.hit.all()


@pytest.mark.parametrize("criterion", CRITERIA)
def test_the_criterion_ends_searches_early(precise_renderer, criterion: str) -> None:
    """A hit ends a ray's search early. Compared with the method with a stack on the same tree,
    rays test hardly more triangles, and visit less than 2.5 times as many nodes."""
    scene = soup_scene(3000, 12, size=0.05)
    rays = RAY_SETS["random"](scene, 500, 13)
    stacked = {"interval": "kd-stack", "box": "bvh-stack"}[criterion]
    found = []
    for name, options in ((ROW.name, {"criterion": criterion}), (stacked, {})):
        with rt.Tracer(scene, name, statistics=True, **options) as tracer:
            found.append(tracer.trace(*rays))
    mine, other = found
    assert mine.triangles_tested.mean() < 1.1 * other.triangles_tested.mean()
    # A step up to the parent counts as a visit. If searches did not end early, the ratios of
    # visited nodes would be 2.64 (interval) and 2.32 (box).
    most = {"interval": 2.5, "box": 2.25}[criterion]
    assert mine.nodes_visited.mean() < most * other.nodes_visited.mean()


def test_the_criteria_share_all_kernels() -> None:
    """The programs of both criteria differ only in the file of the criterion."""
    part, = (one for one in ROW.parts if one.option == "criterion")
    used = {part.file({"criterion": word}) for word in CRITERIA}
    assert used == {f"methods/tree_unit/{word}.glsl" for word in CRITERIA}
    text = (Path(rt.__file__).parents[1] / "glsl" / str(ROW.glsl)).read_text()
    assert not any(line.startswith("#if") for line in text.splitlines())


@pytest.mark.parametrize("make", [lambda t: from_kdtree(build_kdtree(t)),
                                  lambda t: from_bvh(build_bvh(t))], ids=["kdtree", "bvh"])
@pytest.mark.parametrize("count", [0, 1, 500])
def test_unit_trees_contain_the_whole_tree(make, count: int) -> None:
    triangles = random_soup(count, 14)
    tree: UnitTree = make(triangles)
    assert set(tree.references.tolist()) == set(range(count))
    inner = np.flatnonzero(tree.axis != LEAF)
    parents, sides = tree.parents(), tree.sides()
    assert parents[0] == -1 and sides[0] == ROOT
    assert np.array_equal(parents[tree.child[inner]], inner)
    assert np.array_equal(sides[tree.child[inner] + 1], tree.axis[inner] + 3)
    assert tree.count[inner].sum() == 0
    assert tree.count.sum() == len(tree.references)
    # The left child is the lower child along the node's axis.
    axis, middle = tree.axis[inner], tree.lo.astype(np.float64) + tree.hi
    left, right = middle[tree.child[inner], axis], middle[tree.child[inner] + 1, axis]
    assert (left <= right).all()
    for node in np.flatnonzero(tree.axis == LEAF)[:40]:
        held = triangles[tree.references[tree.child[node]:tree.child[node] + tree.count[node]]]
        assert (held.max(axis=1, initial=-np.inf) >= tree.lo[node]).all()
        assert (held.min(axis=1, initial=np.inf) <= tree.hi[node]).all()
