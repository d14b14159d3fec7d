"""Every ray-triangle test finds the hits of the oracle, which is the float64 reference. With each
test, all methods find the same hits."""
from __future__ import annotations

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, assert_same_hits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.options import TRACER_OPTIONS

METHODS = [row.name for row in rt.methods()]
TESTS = next(option for option in TRACER_OPTIONS if option.name == "intersection").choices
assert TESTS is not None


@pytest.mark.small
@pytest.mark.parametrize("rays", ["eye", "random", "surface"])
@pytest.mark.parametrize("intersection", TESTS)
def test_each_finds_the_oracles_hits(intersection: str, rays: str) -> None:
    scene = soup_scene(300, seed=6)
    chosen = RAY_SETS[rays](scene, 4096, 8)
    oracle = rt.reference.trace(scene, *chosen)
    with rt.Tracer(scene, "bvh-threaded", intersection=intersection) as tracer:
        hits = tracer.trace(*chosen)
    assert_same_hits(hits, oracle, scene.extent, 0.002)
    same = hits.triangle == oracle.triangle
    assert same.mean() > 0.99
    # The values u and v are unreliable for slivers and grazing rays, but reliable for most rays.
    for name in ("u", "v"):
        error = np.abs(getattr(hits, name) - getattr(oracle, name))[same]
        assert np.quantile(error, 0.99) < 1e-3, name


@pytest.mark.parametrize("intersection", TESTS)
@pytest.mark.parametrize("method", METHODS)
def test_methods_agree(precise_renderer, method: str, intersection: str) -> None:
    scene = soup_scene(300, seed=10)
    chosen = RAY_SETS["random"](scene, 4096, 2)
    hits = []
    for name in (method, "brute-force"):
        with rt.Tracer(scene, name, intersection=intersection) as tracer:
            hits.append(tracer.trace(*chosen))
    assert_same_bits(*hits, allowed=0.001)


@pytest.mark.parametrize("intersection", TESTS)
def test_triangles_without_area_are_never_hit(intersection: str) -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=(2, 40, 1, 3)).astype(np.float32)
    flat = np.concatenate([a, b, np.where(np.arange(40)[:, None, None] % 2, a, (a + b) / 2)], 1)
    scene = rt.Scene.from_arrays(flat.reshape(-1, 3), np.arange(120).reshape(-1, 3))
    weights = rng.dirichlet([1, 1, 1], (40, 25))[..., None]
    aims = (weights * flat[:, None].astype(np.float64)).sum(2).reshape(-1, 3)
    origins = np.tile(np.float32([5, 4, 3]), (len(aims), 1))
    with rt.Tracer(scene, "brute-force", intersection=intersection) as tracer:
        hits = tracer.trace(origins, aims - origins)
    exact = rt.reference.trace(scene, origins, aims - origins)
    # The third corner of a triangle of even index is a rounded midpoint. The triangle may have an
    # area, so a hit may be right. A triangle of odd index repeats a corner and has no area.
    assert not (hits.hit & ~exact.hit & (hits.triangle % 2 == 1)).any()


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (1, 0, 2)], ids=str)
@pytest.mark.parametrize("direction", [(0, 0, 1), (0, -0.0, -1), (0.5, 0.25, 1), (-0.25, 0.5, -2)],
                         ids=str)
@pytest.mark.parametrize("intersection", TESTS)
def test_a_triangle_includes_its_border(intersection: str, direction: tuple[float, float, float],
                                        axes: tuple[int, int, int]) -> None:
    """A triangle without neighbours is hit on its border and missed just beyond.

    All numbers are exact. Where a ray meets a corner, the corner's offset from the ray is +0 or
    -0. Where a ray meets an edge, the edge function is +0 or -0.
    """
    corners = np.array([(x, y, z) for z, four in ((0, (0, 0, 4, 4)), (8, (-4, -8, 0, 4)))
                        for x, y in (four[:2], four[2:], (four[0], four[3]))], float)
    for one in (corners[:3], corners[3:]):
        for triangle in (one, one[::-1]):
            turned = np.where(triangle == 0, -0.0, triangle)[:, list(axes)]
            weights = np.array([(4, 0, 0), (0, 4, 0), (0, 0, 4), (2, 2, 0), (0, 1, 3), (1, 0, 3)])
            aims = weights @ turned / 4 + 0.0  # corners may have -0, rays have +0
            along = np.array(direction)[list(axes)]
            scene = rt.Scene.from_arrays(turned, [[0, 1, 2]])
            with rt.Tracer(scene, "brute-force", intersection=intersection) as tracer:
                hits = tracer.trace(aims - 4 * along, np.broadcast_to(along, aims.shape))
                beyond = tracer.trace(aims + 0.0625 * (aims - turned.mean(0)) - 4 * along,
                                      np.broadcast_to(along, aims.shape))
            assert hits.hit.all() and (hits.t == 4).all()
            assert not beyond.hit.any()
