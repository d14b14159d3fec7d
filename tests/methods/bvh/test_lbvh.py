"""LBVH: GPU passes build the same tree as numpy, node for node, and numpy's tree follows the
sorted Morton codes."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import random_soup, real_scene
from shapes import SCENES

import gpgpu_rt as rt
from gpgpu_rt.methods.bvh import lbvh
from gpgpu_rt.methods.bvh.build import build_bvh
from gpgpu_rt.methods.bvh.gpu_build import build as gpu_build
from gpgpu_rt.methods.bvh.gpu_build import thread as gpu_thread
from gpgpu_rt.methods.bvh.gpu_build.build import build_bvh_by_passes
from gpgpu_rt.methods.bvh.tree import Bvh

scene = pytest.mark.parametrize("name", SCENES)


def assert_same_tree(one: Bvh, other: Bvh) -> None:
    assert one.depth == other.depth
    for name in ("escape", "first", "count", "order", "lo", "hi"):
        left, right = getattr(one, name), getattr(other, name)
        assert left.dtype == right.dtype and np.array_equal(left, right), name


@pytest.mark.parametrize("options", [{}, {"morton_bits": 1}, {"morton_bits": 7, "max_leaf": 1},
                                     {"max_leaf": 5}], ids=str)
@scene
def test_passes_build_the_same_tree(exact_renderer, name: str, options: dict) -> None:
    triangles = SCENES[name]()
    assert_same_tree(build_bvh_by_passes(exact_renderer, triangles, build="lbvh", **options),
                     build_bvh(triangles, build="lbvh", **options))


@pytest.mark.parametrize("name", [
    "bunny", *(pytest.param(name, marks=pytest.mark.full) for name in ("robots", "kitchen"))])
def test_passes_build_the_same_tree_of_a_real_mesh(exact_renderer, name: str) -> None:
    triangles = real_scene(name).triangles
    assert_same_tree(build_bvh_by_passes(exact_renderer, triangles, build="lbvh"),
                     build_bvh(triangles, build="lbvh"))


@pytest.mark.parametrize("bits", [1, 4, 10])
@scene
def test_nodes_share_leading_bits(name: str, bits: int) -> None:
    """All keys in a node agree in their leading bits.

    The first bit in which the keys differ is 0 in every key of the left child and 1 in every key
    of the right child.
    """
    triangles = SCENES[name]()
    bvh = build_bvh(triangles, build="lbvh", morton_bits=bits, max_leaf=1)
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
    """The corners and the centre of a box get the expected codes. Eight cells meet at the centre,
    which belongs to the cell with the largest coordinates."""
    corners = np.float32([[x, y, z] for x in (0, 8) for y in (0, 8) for z in (0, 8)] + [[4, 4, 4]])
    code = lbvh.morton_codes(np.repeat(corners[:, None], 3, axis=1), 1) >> 27
    assert code.tolist() == [0, 1, 2, 3, 4, 5, 6, 7, 7]
    code = lbvh.morton_codes(np.repeat(corners[:, None], 3, axis=1), 10)
    assert code[7] == 2**30 - 1 and code[8] == 7 << 27


def test_a_code_of_fewer_bits_is_a_prefix() -> None:
    triangles = random_soup(500, 22)
    full = lbvh.morton_codes(triangles, 10)
    for bits in range(1, 10):
        assert (lbvh.morton_codes(triangles, bits) == full >> (30 - 3 * bits) << (30 - 3 * bits)
                ).all()


@pytest.mark.parametrize("wrong, message", [
    ({"build": "kay-kajiya", "build_device": "gpu"}, "cannot run on the GPU"),
    ({"build": "sah", "morton_bits": 5}, "morton_bits needs build lbvh or"),
    ({"build": "lbvh", "morton_bits": 11}, "1 to 10"),
    ({"build": "lbvh", "morton_bits": 11, "build_device": "gpu"}, "1 to 10"),
    ({"build": "lbvh", "morton_bits": 0}, "at least 1"),
])
def test_options_are_refused_in_one_line(wrong: dict, message: str) -> None:
    with pytest.raises(rt.OptionError, match=message) as refusal:
        rt.Tracer("cornell", "bvh-threaded", **wrong)
    assert "\n" not in str(refusal.value)


def test_too_many_triangles_or_nodes_are_refused(gpu, monkeypatch) -> None:
    monkeypatch.setattr(gpu_build, "EXACT_INTEGER", 8)
    with pytest.raises(rt.LimitError, match="build on the cpu"):
        build_bvh_by_passes(gpu, random_soup(9, 23), build="lbvh")
    monkeypatch.setattr(gpu_thread, "EXACT_INTEGER", 8)
    with pytest.raises(rt.LimitError, match="leaves of more triangles"):
        build_bvh_by_passes(gpu, random_soup(8, 23), build="lbvh", max_leaf=1)
