"""The kd-tree build of Zhou et al. 2008: GPU passes build the same tree as numpy, node for
node."""
from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, real_scene, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.kdtree.gpu_build.build import build_kdtree_by_passes
from gpgpu_rt.methods.kdtree.tree import KdTree
from gpgpu_rt.methods.kdtree.zhou_small import bits, population

SCENES = {
    **{f"soup{seed}": (lambda seed=seed: random_soup(700, seed)) for seed in (1, 2)},
    "rows": lambda: random_soup(4096 + 700, 4, size=0.01),
    "one": lambda: random_soup(1, 5), "two": lambda: random_soup(2, 6),
    "empty": lambda: np.zeros((0, 3, 3), np.float32),
    "few": lambda: random_soup(64, 7), "more": lambda: random_soup(65, 8),
    "same": lambda: np.repeat(random_soup(1, 9), 300, axis=0),
    "flat": lambda: random_soup(600, 12) * np.float32([1, 0, 1]),
    "line": lambda: random_soup(600, 13) * np.float32([0, 1, 0]),
    "needles": lambda: random_soup(300, 14, 0.02) * np.float32([0.01, 30, 0.01]),
    "far": lambda: random_soup(400, 16) + np.float32([1e5, -3e4, 2e4]),
    "small": lambda: random_soup(300, 17) * np.float32(1e-12),
    "huge": lambda: random_soup(300, 19) * np.float32(1e15),
    "uneven": lambda: np.concatenate([random_soup(500, 20) * np.float32(1e-4),
                                      random_soup(3, 21) * np.float32(50)]),
}
OPTIONS = ({}, {"small": 6, "max_depth": 9}, {"small": 33, "empty_cut": 0.0, "empty_bonus": 0.0},
           {"traversal_cost": 0.3, "intersection_cost": 0.7, "empty_bonus": 0.6})
IN_ALL_WAYS = ("soup1", "flat", "few", "rows")      # tested with all options in the quick suite


def assert_same_tree(one: KdTree, other: KdTree) -> None:
    for field in dataclasses.fields(one):
        left, right = getattr(one, field.name), getattr(other, field.name)
        assert np.array_equal(left, right), field.name
        assert np.asarray(left).dtype == np.asarray(right).dtype, field.name


@pytest.mark.parametrize("name, options", [
    pytest.param(name, options, id=f"{name}-{options}",
                 marks=pytest.mark.full if options and name not in IN_ALL_WAYS else ())
    for name in SCENES for options in OPTIONS])
def test_passes_build_the_same_tree(exact_renderer, name: str, options: dict) -> None:
    triangles = SCENES[name]()
    tree = build_kdtree(triangles, build="zhou", **options)
    assert_same_tree(build_kdtree_by_passes(exact_renderer, triangles, **options), tree)
    if name == "rows":
        assert len(tree.axis) > 1000


@pytest.mark.parametrize("name", ["cornell", *(pytest.param(name, marks=pytest.mark.full)
                                               for name in ("bunny", "robots", "kitchen"))])
def test_passes_build_the_same_tree_of_a_real_mesh(exact_renderer, name: str) -> None:
    triangles = real_scene(name).triangles
    assert_same_tree(build_kdtree_by_passes(exact_renderer, triangles),
                     build_kdtree(triangles, build="zhou"))


def test_a_tree_built_on_the_gpu_gives_the_same_hits(precise_renderer) -> None:
    scene = soup_scene(900, 31, size=0.05)
    rays = RAY_SETS["random"](scene, 2000, 32)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.trace(*rays)
    with rt.Tracer(scene, "kd-restart", build="zhou", build_device="gpu") as tracer:
        assert_same_bits(tracer.trace(*rays), expected)
    assert expected.hit.any()


def test_builds_that_the_gpu_lacks_are_refused() -> None:
    with pytest.raises(rt.OptionError, match="build is one of zhou"):
        rt.Tracer("cornell", "kd-restart", build_device="gpu")
    with pytest.raises(rt.OptionError, match="small"):
        build_kdtree(random_soup(3, 1), build="zhou", small=65)


def test_a_build_with_too_long_streams_is_refused(exact_renderer, monkeypatch) -> None:
    """A build is refused if a stream would have more elements than float32 can count exactly."""
    triangles = random_soup(900, 36, size=0.02)
    monkeypatch.setattr("gpgpu_rt.gl.algorithms.streams.EXACT_INTEGER", 2000)
    with pytest.raises(rt.LimitError, match="build on the cpu"):
        build_kdtree_by_passes(exact_renderer, triangles)
    monkeypatch.undo()
    assert_same_tree(build_kdtree_by_passes(exact_renderer, triangles),
                     build_kdtree(triangles, build="zhou"))


def test_masks() -> None:
    """`population` counts the bits of 64-bit masks, and `bits` lists them."""
    masks = np.random.default_rng(33).integers(0, 2**64 - 1, 200, np.uint64, endpoint=True)
    masks[:2] = 0, 2**64 - 1
    words = [f"{int(mask):064b}"[::-1] for mask in masks]
    assert population(masks).tolist() == [word.count("1") for word in words]
    which, bit = bits(masks)
    assert list(zip(which.tolist(), bit.tolist())) == [
        (row, at) for row, word in enumerate(words) for at in range(64) if word[at] == "1"]


@pytest.mark.parametrize("seed", [34, 35])
def test_large_nodes_lose_empty_space_and_split_in_the_middle(seed: int) -> None:
    """Each large node (over 64 triangles) cuts off empty space or is split in the middle of its
    longest axis."""
    triangles = random_soup(3000, seed, size=0.02)
    triangles[:5] += np.float32([4, 0, 0])
    tree = build_kdtree(triangles, build="zhou")
    lo, hi = tree.boxes()
    held = np.where(tree.axis == 3, tree.count, 0).astype(int)
    cuts = splits = 0
    todo = [0]
    while todo:
        node = todo.pop()
        below = leaves_of(tree, node)
        inside = np.unique(np.concatenate([tree.references[tree.left[n]:tree.left[n] + held[n]]
                                           for n in below]))
        if len(inside) <= 64 or tree.axis[node] == 3:
            continue
        axis, left = tree.axis[node], int(tree.left[node])
        extent = hi[node] - lo[node]
        if tree.split[node] == lo[node, axis] + np.float32(0.5) * extent[axis]:
            splits += 1
            assert extent[axis] == extent.max()
        else:
            cuts += 1
            empty = [n for n in (left, left + 1) if tree.axis[n] == 3 and not tree.count[n]]
            assert len(empty) == 1
            assert (hi - lo)[empty[0], axis] > 0.25 * extent[axis]
        todo += [left, left + 1]
    assert cuts and splits > 20


def leaves_of(tree: KdTree, top: int) -> list[int]:
    found, todo = [], [top]
    while todo:
        node = todo.pop()
        if tree.axis[node] == 3:
            found.append(node)
        else:
            todo += [int(tree.left[node]), int(tree.left[node]) + 1]
    return found
