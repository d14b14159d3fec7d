"""The triangle test never exceeds its derived error bounds, and the bounds are tight enough to be
useful."""
from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from aimed import KINDS, aimed_pairs
from conftest import soup_scene

import gpgpu_rt as rt
from gpgpu_rt.numerics.error_bounds import FLOAT32, FLOAT64, bound_pairs, distance_bound, gamma
from gpgpu_rt.numerics.watertight import intersect_pairs


def counts(quick: int, full: int) -> list:
    """Return the parameters for a quick test and a full test."""
    return [pytest.param(quick, id=f"n{quick}"),
            pytest.param(full, id=f"n{full}", marks=pytest.mark.full)]


def exact_pair(triangle: np.ndarray, origin: np.ndarray, direction: np.ndarray
               ) -> tuple[Fraction, Fraction, Fraction] | None:
    """Returns t, u and v of the point where the ray's line meets the triangle's plane, as
    rationals. Returns None for a parallel line."""
    v0, v1, v2, o, d = ([Fraction(float(x)) for x in p] for p in (*triangle, origin, direction))
    e1, e2, s = ([a - b for a, b in zip(p, q)] for p, q in ((v1, v0), (v2, v0), (o, v0)))

    def determinant(a: list, b: list, c: list) -> Fraction:
        return sum(a[i] * (b[(i + 1) % 3] * c[(i + 2) % 3] - b[(i + 2) % 3] * c[(i + 1) % 3])
                   for i in range(3))
    minus_d = [-x for x in d]
    det = determinant(minus_d, e1, e2)
    if det == 0:
        return None
    return (determinant(s, e1, e2) / det, determinant(minus_d, s, e2) / det,
            determinant(minus_d, e1, s) / det)


def depths(triangle: np.ndarray, origin: np.ndarray, direction: np.ndarray) -> list[Fraction]:
    """Return, for each corner, the exact t at which the ray reaches the corner's coordinate along
    the ray's dominant axis."""
    axis = int(np.abs(direction).argmax())
    return [(Fraction(float(x)) - Fraction(float(origin[axis]))) / Fraction(float(direction[axis]))
            for x in triangle[:, axis]]


@pytest.mark.parametrize("seed", [1])
@pytest.mark.parametrize("kind", KINDS)
def test_against_rationals(kind: str, seed: int) -> None:
    """The numpy mirror of the float32 test, and the float64 evaluation, each differ from the exact
    values by at most their error bounds."""
    pairs = aimed_pairs(kind, 120, seed)
    accepted, *found = intersect_pairs(*pairs)
    bounds = {arithmetic: bound_pairs(*pairs, arithmetic) for arithmetic in (FLOAT32, FLOAT64)}
    decided = 0
    for k, pair in enumerate(zip(*pairs)):
        exact = exact_pair(*pair)
        if exact is None:
            assert not any(b.inside[k] for b in bounds.values())
            continue
        t, u, v = exact
        low, *_, high = sorted(depths(*pair))
        t = min(max(t, low), high)
        within = u > 0 and v > 0 and u + v < 1
        for arithmetic, b in bounds.items():
            assert within or not b.inside[k]
            assert b.possible[k] or not within
            decided += b.inside[k] == b.possible[k]
            if not b.possible[k]:
                continue
            if arithmetic is FLOAT64:
                assert abs(Fraction(b.t[k]) - t) <= Fraction(b.t_bound[k])
            elif accepted[k]:
                for value, true, bound in zip(found, (t, u, v), (b.t_bound, b.u_bound, b.v_bound)):
                    assert abs(Fraction(float(value[k])) - true) <= Fraction(bound[k])
    # 120 pairs in two arithmetics give 240 tests. For rays at an edge, the bounds of float32
    # decide almost no test, and the bounds of float64 decide almost all of their 120 tests.
    assert decided >= (90 if kind in ("edge", "vertex", "slivers", "grazing") else 180)


@pytest.mark.parametrize("count", counts(20_000, 1_000_000))
@pytest.mark.parametrize("seed", [2])
@pytest.mark.parametrize("kind", KINDS)
def test_errors_of_float32_stay_within_bounds(kind: str, seed: int, count: int) -> None:
    """No error exceeds its bound, and the largest error is at least 5 % of its bound."""
    reached = 0.0
    for part in range(-(-count // 100_000)):
        pairs = aimed_pairs(kind, min(count, 100_000), seed + 1000 * part)
        accepted, t, u, v = intersect_pairs(*pairs)
        b = bound_pairs(*pairs)
        assert not (accepted & ~b.possible).any() and not (b.inside & ~accepted).any()
        for value, true, bound in ((t, b.t, b.t_bound), (u, b.u, b.u_bound), (v, b.v, b.v_bound)):
            ratio = (np.abs(value - true) / bound)[accepted]
            assert (ratio <= 1).all()
            reached = max(reached, ratio.max(initial=0))
    assert reached >= 0.05


@pytest.mark.parametrize("exponent", [-20, -10, 10, 18])
@pytest.mark.parametrize("seed", [3])
def test_bounds_scale_with_the_scene(seed: int, exponent: int) -> None:
    triangles, origins, directions = aimed_pairs("edge", 5000, seed)
    scale = np.float32(2.0) ** exponent
    plain = bound_pairs(triangles, origins, directions)
    scaled = bound_pairs(triangles * scale, origins * scale, directions)
    assert (plain.possible == scaled.possible).mean() > 0.999
    np.testing.assert_allclose(scaled.t_bound, plain.t_bound * scale, rtol=1e-4)
    turned = bound_pairs(triangles, origins, directions * scale)
    np.testing.assert_allclose(turned.t_bound * scale, plain.t_bound, rtol=1e-6)


def test_overflow_gives_infinite_bounds() -> None:
    """If the arithmetic of a bound overflows, the bound is infinite and no hit is certain."""
    triangles, origins, directions = aimed_pairs("inside", 1000, 4)
    b = bound_pairs(triangles * np.float32(1e25), origins * np.float32(1e25), directions)
    assert not b.inside.any() and np.isinf(b.t_bound).all() and b.possible.all()
    far = 1.5 * 2.0 ** 127      # t overflows: the test scales d.z from 1 to 0.5
    wall = np.float32([[[-0.5, -0.5, far], [0.5, -0.5, far], [0, 0.7, far]]])
    assert np.isinf(bound_pairs(wall, np.zeros((1, 3)), np.float32([[0, 0, 1]])).t_bound)
    assert gamma(3) == 3 * 2.0 ** -24 / (1 - 3 * 2.0 ** -24)


def test_edges_are_rounded_from_the_vertices() -> None:
    """The bounds compute edges from the vertices. Corners relative to a far origin lose digits
    even in float64, so their differences would be wrong edges."""
    triangle = np.float32([[[0, 4.95309503928767e-16, 5.167001563413719e-16],
                            [1, 2.537529391983612e-16, 3.197630373410565e-16],
                            [0.5, 4.2386055429219263e-16, 4.667619525074553e-16]]])
    origin = np.float32([[-0.4504268765449524, 0.9219554662704468, 0.8495473861694336]])
    direction = np.float32([[1.0917938947677612, -0.9219554662704468, -0.8495473861694336]])
    accepted, t, _, _ = intersect_pairs(triangle, origin, direction)
    bound = bound_pairs(triangle, origin, direction)
    assert accepted.all() and 5e-7 < abs(t[0] - 1) < bound.t_bound[0] < 1e-4


def test_a_ray_beside_a_speck_is_certainly_outside() -> None:
    """A ray beside a tiny triangle is certainly outside. Here the errors of the edge functions may
    exceed the functions' values, so the box test decides."""
    triangles, origins, directions = aimed_pairs("small", 2000, 5)
    centre = triangles.mean(axis=1, keepdims=True)
    triangles = (centre + (triangles - centre) * np.float32(1e-4)).astype(np.float32)
    aside = bound_pairs(triangles, origins + np.float32(0.01), directions)
    assert not aside.possible.any()
    assert bound_pairs(triangles, origins, directions).possible.any()


@pytest.mark.parametrize("seed", [6])
def test_the_mirror_equals_the_shader(exact_renderer, seed: int) -> None:
    """The mirror equals the shader bit for bit, so bounds tested with the mirror also hold for the
    shader."""
    scene = soup_scene(300, seed)
    rng = np.random.default_rng(seed)
    origins = rng.random((4096, 3)).astype(np.float32)
    directions = (rng.normal(size=(4096, 3)) * 10.0 ** rng.integers(-3, 4, (4096, 1))
                  ).astype(np.float32)
    with rt.Tracer(scene, "brute-force") as tracer:
        hits = tracer.trace(origins, directions)
    some = np.flatnonzero(hits.hit)
    pairs = scene.triangles[hits.triangle[some]], origins[some], directions[some]
    accepted, t, u, v = intersect_pairs(*pairs)
    assert accepted.all()
    for ours, theirs in ((t, hits.t), (u, hits.u), (v, hits.v)):
        assert (ours == theirs[some]).all()
    assert (np.abs(hits.t[some] - bound_pairs(*pairs).t) <= distance_bound(*pairs)).all()
