"""LBVH: the passes build numpy's tree node for node, and numpy's is the tree over sorted codes."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import random_soup, real_scene

import gpgpu_rt as rt
from gpgpu_rt import accel
from gpgpu_rt.accel import lbvh
from gpgpu_rt.passes.build import build_bvh

FLAT = np.float32([1, 0, 1])
SCENES = {
    **{f"soup{seed}": (lambda seed=seed: random_soup(997, seed)) for seed in (1, 2, 3)},
    "rows": lambda: random_soup(4096 + 700, 4, size=0.01),
    "one": lambda: random_soup(1, 5), "two": lambda: random_soup(2, 6),
    "three": lambda: random_soup(3, 7), "five": lambda: random_soup(5, 8),
    "same": lambda: np.repeat(random_soup(1, 9), 300, axis=0),
    "pairs": lambda: np.repeat(random_soup(200, 10), 2, axis=0)[::-1],
    "clumps": lambda: np.repeat(random_soup(7, 11), 71, axis=0),
    "flat": lambda: random_soup(600, 12) * FLAT,
    "line": lambda: random_soup(600, 13) * np.float32([0, 1, 0]),
    "nested": lambda: random_soup(1, 14) * np.geomspace(1, 30, 80)[:, None, None].astype("f4"),
    "middles": lambda: mirrored(random_soup(90, 15)),
    "far": lambda: random_soup(400, 16) + np.float32([1e5, -3e4, 2e4]),
    "small": lambda: random_soup(300, 17) * np.float32(1e-12),
    "large": lambda: random_soup(300, 18) * np.float32(1e12),
    "huge": lambda: random_soup(300, 19) * np.float32(1e37),
    "uneven": lambda: np.concatenate([random_soup(500, 20) * np.float32(1e-4),
                                      random_soup(3, 21) * np.float32(50)]),
}
scene = pytest.mark.parametrize("name", SCENES)


def mirrored(triangles: np.ndarray) -> np.ndarray:
    """Triangles whose boxes all have their middle in the origin."""
    box_lo, box_hi = triangles.min(1, keepdims=True), triangles.max(1, keepdims=True)
    size = box_hi - box_lo
    return np.concatenate([-size / 2, size / 2, size / 2 * np.float32([1, -1, 1])], axis=1)


def assert_same_tree(one: accel.Bvh, other: accel.Bvh) -> None:
    assert one.depth == other.depth
    for name in ("escape", "first", "count", "order", "lo", "hi"):
        left, right = getattr(one, name), getattr(other, name)
        assert left.dtype == right.dtype and np.array_equal(left, right), name


@pytest.mark.parametrize("options", [{}, {"morton_bits": 1}, {"morton_bits": 7, "max_leaf": 1},
                                     {"max_leaf": 5}], ids=str)
@scene
def test_passes_build_the_same_tree(exact_renderer, name: str, options: dict) -> None:
    triangles = SCENES[name]()
    assert_same_tree(build_bvh(exact_renderer, triangles, build="lbvh", **options),
                     accel.build_bvh(triangles, build="lbvh", **options))


@pytest.mark.parametrize("name", [
    "bunny", *(pytest.param(name, marks=pytest.mark.full) for name in ("robots", "kitchen"))])
def test_passes_build_the_same_tree_of_a_real_mesh(exact_renderer, name: str) -> None:
    triangles = real_scene(name).triangles
    assert_same_tree(build_bvh(exact_renderer, triangles, build="lbvh"),
                     accel.build_bvh(triangles, build="lbvh"))


@pytest.mark.parametrize("bits", [1, 4, 10])
@scene
def test_nodes_share_leading_bits(name: str, bits: int) -> None:
    """By the definition, one node after another: all triangles of a node share the bits at which
    its children part, the left one's next bit is 0 and the right one's 1."""
    triangles = SCENES[name]()
    bvh = accel.build_bvh(triangles, build="lbvh", morton_bits=bits, max_leaf=1)
    code = lbvh.morton_codes(triangles, bits)
    place = np.empty(len(code), np.int64)
    place[np.lexsort([np.arange(len(code)), code])] = np.arange(len(code))
    key = [f"{c:030b}{p:024b}" for c, p in zip(code, place)]
    assert [key[i] for i in bvh.order] == sorted(key)
    for node in np.flatnonzero(bvh.count == 0):
        middle, end = bvh.escape[node + 1], bvh.escape[node]
        sides = [[key[i] for i in bvh.order[bvh.first[a:b][bvh.count[a:b] > 0]]]
                 for a, b in ((node + 1, middle), (middle, end))]
        every = sides[0] + sides[1]
        shared = next(k for k in range(54) if len({word[k] for word in every}) > 1)
        assert {word[shared] for word in sides[0]} == {"0"}
        assert {word[shared] for word in sides[1]} == {"1"}


def test_codes_are_cells_of_a_lattice() -> None:
    """At eight corners of a box and its middle, whose cell is the upper one."""
    corners = np.float32([[x, y, z] for x in (0, 8) for y in (0, 8) for z in (0, 8)] + [[4, 4, 4]])
    code = lbvh.morton_codes(np.repeat(corners[:, None], 3, axis=1), 1) >> 27
    assert code.tolist() == [0, 1, 2, 3, 4, 5, 6, 7, 7]
    code = lbvh.morton_codes(np.repeat(corners[:, None], 3, axis=1), 10)
    assert code[7] == 2**30 - 1 and code[8] == 7 << 27


def test_fewer_bits_are_the_first_ones() -> None:
    triangles = random_soup(500, 22)
    full = lbvh.morton_codes(triangles, 10)
    for bits in range(1, 10):
        assert (lbvh.morton_codes(triangles, bits) == full >> (30 - 3 * bits) << (30 - 3 * bits)
                ).all()


@pytest.mark.parametrize("wrong, message", [
    ({"build": "kay-kajiya", "build_device": "gpu"}, "no passes"),
    ({"build": "sah", "morton_bits": 5}, "leave morton_bits"),
    ({"build": "lbvh", "morton_bits": 11}, "1 to 10"),
    ({"build": "lbvh", "morton_bits": 11, "build_device": "gpu"}, "1 to 10"),
    ({"build": "lbvh", "morton_bits": 0}, "at least 1"),
])
def test_options_are_refused_in_one_line(wrong: dict, message: str) -> None:
    with pytest.raises(rt.OptionError, match=message) as refusal:
        rt.Tracer("cornell", "bvh-threaded", **wrong)
    assert "\n" not in str(refusal.value)
