"""The oracle (the float64 reference) agrees with exact rationals and with known answers. Its
search with a tree finds the same hits as its search without a tree."""
from __future__ import annotations

import numpy as np
import pytest
import trimesh
from conftest import RAY_SETS, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.reference import trace, trace_exact


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("rays", ["random", "vertices", "edges"])
def test_against_rationals(rays: str, seed: int) -> None:
    scene = soup_scene(12, seed, size=0.6)
    origins, directions = RAY_SETS[rays](scene, 60, seed)
    ours, exact = (f(scene.triangles, origins, directions) for f in (trace, trace_exact))
    both = ours.hit & exact.hit
    np.testing.assert_allclose(ours.t[both], exact.t[both].astype(float), rtol=1e-9)
    # A ray aimed at an edge lies on one side of the edge after rounding to float32. float64 finds
    # this side.
    assert (ours.hit == exact.hit).all() and (ours.triangle == exact.triangle).all()


@pytest.mark.parametrize("rays", RAY_SETS)
def test_the_tree_changes_nothing(rays: str) -> None:
    scene = soup_scene(700, 4)
    chosen = RAY_SETS[rays](scene, 900, 5)
    plain, fast = trace(scene, *chosen), trace(scene, *chosen, accelerated=True)
    for name in ("t", "u", "v", "triangle"):
        assert (getattr(plain, name) == getattr(fast, name)).all()


@pytest.mark.parametrize("at", ["random", "vertices", "edges"])
def test_closed_meshes_do_not_leak(at: str) -> None:
    ball = trimesh.creation.icosphere(subdivisions=3)
    scene = rt.load_scene(ball)
    origins, directions = RAY_SETS[at](scene, 5000, 6)
    inside = np.linalg.norm(origins, axis=1) < 0.9
    assert trace(scene, origins[inside], directions[inside], accelerated=True).hit.all()


def test_ties_intervals_and_odd_rays() -> None:
    """The lowest index wins ties, and intervals include their ends. An invalid ray is an error or,
    with invalid="miss", a miss."""
    square = np.float32([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]] * 3)
    origins, directions = np.float32([[0.2, 0.2, 1]] * 3), np.float32([[0, 0, -2]] * 3)
    hits = trace(square, origins, directions, t_min=[0, 0.5, 0.6], t_max=[0.5, 9, 9])
    assert hits.triangle.tolist() == [0, 0, -1] and hits.t[:2].tolist() == [0.5, 0.5]
    origins[1, 0] = np.nan
    with pytest.raises(ValueError, match="1"):
        trace(square, origins, directions)
    assert trace(square, origins, directions, invalid="miss").status.tolist() == [0, 1, 0]
    flat = np.float32([[[0, 0, 0], [1, 1, 0], [2, 2, 0]]])
    assert not trace(flat, origins[:1], directions[:1]).hit.any()
    assert not trace(np.zeros((0, 3, 3)), origins[:1], directions[:1]).hit.any()
    assert random_soup(5, 1).shape == (5, 3, 3)
