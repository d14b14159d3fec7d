"""The octree's cells fill its cube without overlap, and each cell lists every triangle that has a
point in the cell."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import random_soup

from gpgpu_rt.errors import OptionError
from gpgpu_rt.methods.ray_engine.octree import Octree, build_octree


def located(tree: Octree, points: np.ndarray) -> np.ndarray:
    """Return the index of the cell that contains each point, (n,)."""
    at = (points - tree.lo.astype(np.float64)) / tree.cell_size.astype(np.float64)
    inside = ((at[:, None] >= tree.corner) & (at[:, None] < tree.corner + tree.span[:, None]))
    found = inside.all(axis=2)
    assert (found.sum(axis=1) == 1).all()
    return found.argmax(axis=1)


def shapes(name: str, seed: int) -> np.ndarray:
    soup = random_soup(150, seed)
    return {"soup": soup, "one": soup[:1], "none": soup[:0], "copies": np.repeat(soup[:1], 40, 0),
            "flat": soup * np.float32([1, 1, 0]), "far": soup + np.float32(1e4),
            "small": np.concatenate([soup * np.float32(1e-3), [[[0, 0, 0], [9, 0, 0], [0, 9, 1]]]]
                                    ).astype(np.float32)}[name]


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
@pytest.mark.parametrize("name", ["soup", "one", "none", "copies", "flat", "far", "small"])
def test_points_of_triangles_are_listed(name: str, seed: int) -> None:
    """The cell that contains a point of a triangle lists the triangle."""
    triangles = shapes(name, seed)
    tree = build_octree(triangles)
    assert (tree.span.astype(np.int64)**3).sum() == np.prod(tree.resolution.astype(np.int64))
    assert tree.cell_start[-1] == len(tree.references)
    rng = np.random.default_rng(seed)
    weights = rng.dirichlet([0.5] * 3, 40)
    points = np.einsum("kc,ncx->nkx", weights, triangles.astype(np.float64)).reshape(-1, 3)
    points = np.concatenate([points, triangles.reshape(-1, 3)])
    owner = np.concatenate([np.repeat(np.arange(len(triangles)), 40),
                            np.repeat(np.arange(len(triangles)), 3)])
    cells = located(tree, points) if len(points) else np.zeros(0, int)
    listed = set(zip(np.repeat(np.arange(len(tree.span)), np.diff(tree.cell_start)).tolist(),
                     tree.references.tolist()))
    assert set(zip(cells.tolist(), owner.tolist())) <= listed
    assert len(listed) == len(tree.references)


@pytest.mark.parametrize("seed", [3], ids="seed{}".format)
def test_crowded_cells_are_split(seed: int) -> None:
    triangles = random_soup(3000, seed, size=0.02)
    coarse, fine = (build_octree(triangles, leaf_size=size) for size in (30, 4))
    for tree, size in ((coarse, 30), (fine, 4)):
        crowded = np.diff(tree.cell_start) > size
        assert (tree.span[crowded] == 1).all() and tree.span.max() > 1
    assert len(fine.span) > 2 * len(coarse.span)


def test_the_root_reaches_every_cell() -> None:
    tree = build_octree(random_soup(500, 4, size=0.05))
    cells = -1 - tree.child[tree.child < 0]
    assert (np.sort(cells) == np.arange(len(tree.span))).all()
    first = tree.child[tree.child >= 0]
    assert (np.sort(first) == 1 + 8 * np.arange(len(first))).all()
    assert len(tree.child) == 1 + 8 * len(first)


def test_wrong_options_are_refused() -> None:
    for given in ({"leaf_size": 0}, {"density": -1}, {"leaf": 3}):
        with pytest.raises(OptionError) as caught:
            build_octree(random_soup(9, 1), **given)
        assert "\n" not in str(caught.value)
