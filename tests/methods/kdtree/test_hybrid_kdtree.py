"""Hybrid kd-trees: Morton prefixes split the upper levels, and SAH splits the cells below."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import random_soup

import gpgpu_rt as rt
from gpgpu_rt.accel.morton import morton_3d
from gpgpu_rt.methods.kdtree.build import build_kdtree
from gpgpu_rt.methods.kdtree.tree import LEAF


@pytest.mark.parametrize("bits", [1, 2, 3])
@pytest.mark.parametrize("seed", [51, 52])
def test_upper_levels_halve_the_box_in_turn(seed: int, bits: int) -> None:
    """Upper nodes halve x, y and z in turn, so the path to a node determines the node's box.

    An upper node is a leaf only if it has no triangle.
    """
    triangles = random_soup(600, seed, size=0.03)
    triangles[300:] += np.float32([0, 3, 2])        # most cells of the lattice stay empty
    tree = build_kdtree(triangles, build="hybrid", morton_bits=bits)
    lo, hi = tree.boxes()
    step = (tree.hi.astype(float) - tree.lo) / 2 ** bits
    todo, cells, empty = [(0, np.zeros(3, int), np.full(3, 2 ** bits))], 0, 0
    while todo:
        node, first, last = todo.pop()
        np.testing.assert_allclose(lo[node], tree.lo + first * step, atol=1e-5)
        np.testing.assert_allclose(hi[node], tree.lo + last * step, atol=1e-5)
        depth = 3 * bits - int(np.log2(np.prod(last - first)))
        if depth == 3 * bits:
            cells += 1
        elif tree.axis[node] == LEAF:
            empty += 1
            assert tree.count[node] == 0
        else:
            axis = depth % 3
            assert tree.axis[node] == axis
            middle = first.copy()
            middle[axis] = (first + last)[axis] // 2
            end = last.copy()
            end[axis] = middle[axis]
            left = int(tree.left[node])
            todo += [(left, first, end), (left + 1, middle, last)]
    assert cells > 4 and (empty or bits == 1)


def test_codes_interleave_bits_x_first() -> None:
    cells = np.random.default_rng(53).integers(0, 32, (100, 3))
    expected = [int("".join(f"{x >> b & 1}{y >> b & 1}{z >> b & 1}" for b in range(4, -1, -1)), 2)
                for x, y, z in cells.tolist()]
    assert morton_3d(*cells.T).tolist() == expected


@pytest.mark.parametrize("options, message", [
    ({"build": "hybrid", "morton_bits": 8}, "1 to 7"),
    ({"build": "zhou", "morton_bits": 2}, "needs build hybrid"),
    ({"build": "sah", "build_device": "gpu"}, "cannot run on the GPU"),
    ({"build": "hybrid", "build_device": "gpu", "split": "exact"}, "split on the gpu")], ids=str)
def test_wrong_options_are_refused(options: dict, message: str) -> None:
    with pytest.raises(rt.OptionError, match=message):
        rt.Tracer("cornell", "kd-restart", **options)
