"""Hybrid kd-trees that GPU passes build have the same upper levels and hits as trees that numpy
builds, and about the same cost."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, random_soup, real_scene
from test_zhou import SCENES

import gpgpu_rt as rt
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.kdtree.gpu_build.build import build_kdtree_by_passes
from gpgpu_rt.methods.kdtree.tree import LEAF
from gpgpu_rt.methods.quality import sah_cost

QUICK = ("soup1", "one", "same", "flat", "far", "small")


def scene_of(triangles: np.ndarray) -> rt.Scene:
    return rt.Scene.from_arrays(triangles.reshape(-1, 3),
                                np.arange(3 * len(triangles)).reshape(-1, 3), name="soup")


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in QUICK
                                               else pytest.mark.full) for name in SCENES])
def test_a_tree_by_passes_gives_the_same_hits(precise_renderer, name: str) -> None:
    """Random rays, and rays that aim at edges, have the hits of brute force. In the scenes, some
    triangles lie in planes of the Morton lattice. A split at such a plane must not drop these
    triangles."""
    scene = scene_of(SCENES[name]())
    with rt.Tracer(scene, "brute-force") as brute, rt.Tracer(
            scene, "kd-stack", build="hybrid", build_device="gpu") as tracer:
        for rays in ("random", "edges"):
            chosen = RAY_SETS[rays](scene, 1000, 3) if len(scene) else (
                np.zeros((4, 3)), np.ones((4, 3)))
            assert_same_bits(tracer.trace(*chosen), brute.trace(*chosen))


def test_a_lattice_of_quads(precise_renderer) -> None:
    """No ray misses squares that lie in planes of the Morton lattice. The squares' edges lie where
    two planes meet."""
    x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9), indexing="ij")
    corner = np.stack([x, y, np.full_like(x, 0.5)], axis=-1)
    a, b, c, d = corner[:-1, :-1], corner[1:, :-1], corner[1:, 1:], corner[:-1, 1:]
    sheet = np.stack([np.stack([a, b, c], 2), np.stack([a, c, d], 2)], 2).reshape(-1, 3, 3)
    scene = scene_of(np.concatenate([np.roll(sheet, k, axis=-1) for k in range(3)]))
    with rt.Tracer(scene, "brute-force") as brute, rt.Tracer(
            scene, "kd-restart", build="hybrid", build_device="gpu", morton_bits=3) as tracer:
        for rays in ("vertices", "edges", "random"):
            chosen = RAY_SETS[rays](scene, 1000, 4)
            assert_same_bits(tracer.trace(*chosen), brute.trace(*chosen))


@pytest.mark.parametrize("options", [{"bins": 7}, {"max_depth": 5}, {"max_depth": 0},
                                     {"traversal_cost": 0.3, "empty_bonus": 0.6}], ids=str)
def test_options(precise_renderer, options: dict) -> None:
    """With the same options, passes and numpy build trees of about the same cost."""
    triangles = random_soup(500, 2, size=0.05)
    tree = build_kdtree_by_passes(precise_renderer, triangles, build="hybrid", **options)
    other = build_kdtree(triangles, build="hybrid", **options)
    assert tree.depth == other.depth or "max_depth" not in options
    assert sah_cost(tree) == pytest.approx(sah_cost(other), rel=0.1)


@pytest.mark.parametrize("seed, count, size, bits", [
    (1, 600, 0.2, 1), (3, 3000, 0.03, 3), pytest.param(4, 9000, 0.01, 2)])
def test_upper_levels_are_numpys(precise_renderer, seed: int, count: int, size: float,
                                 bits: int) -> None:
    """Split planes agree to the bit. A few nodes are empty leaves in only one of the two trees,
    because passes and numpy may disagree whether a triangle touches a cell."""
    triangles = random_soup(count, seed, size)
    triangles[count // 2:] += np.float32([0, 3, 2])     # most cells of the lattice stay empty
    one = build_kdtree_by_passes(precise_renderer, triangles, build="hybrid", morton_bits=bits)
    other = build_kdtree(triangles, build="hybrid", morton_bits=bits)
    assert (one.lo == other.lo).all() and (one.hi == other.hi).all()
    todo, inner, empty, torn = [(0, 0, 0)], 0, 0, 0
    while todo:
        a, b, depth = todo.pop()
        if depth == 3 * bits:
            continue
        leaves = one.axis[a] == LEAF, other.axis[b] == LEAF
        if all(leaves):
            assert one.count[a] == other.count[b] == 0
            empty += 1
        elif any(leaves):
            torn += 1
        else:
            assert one.axis[a] == other.axis[b] == depth % 3
            assert one.split[a] == other.split[b]
            inner += 1
            left, right = int(one.left[a]), int(other.left[b])
            todo += [(left, right, depth + 1), (left + 1, right + 1, depth + 1)]
    assert inner > (4 if bits == 1 else 30) and torn < 0.05 * inner and (empty or bits == 1)


@pytest.mark.parametrize("name", ["soup1", "soup2", "rows", "cornell", *(
    pytest.param(name, marks=pytest.mark.full) for name in ("bunny", "robots", "kitchen"))])
def test_a_tree_by_passes_costs_hardly_more(precise_renderer, name: str) -> None:
    """A tree built by passes costs at most 5 % more than numpy's tree."""
    triangles = SCENES[name]() if name in SCENES else real_scene(name).triangles
    tree = build_kdtree_by_passes(precise_renderer, triangles, build="hybrid")
    other = build_kdtree(triangles, build="hybrid")
    assert sah_cost(tree) < 1.05 * sah_cost(other)
    assert len(np.unique(tree.references)) == len(np.unique(other.references))
