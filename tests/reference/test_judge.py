"""`judge` decides whether hits are right. It sorts deliberate faults into the right categories,
accepts rounding, and reports right statistics."""
from __future__ import annotations

import numpy as np
import pytest
import trimesh
from conftest import RAY_SETS, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.accuracy.judge import CATEGORIES, judge, leaks, upper_confidence
from gpgpu_rt.hits import INVALID, UNFINISHED
from gpgpu_rt.numerics.error_bounds import bound_pairs

SEEDS = [1, 2]


def copy(hits: rt.Hits) -> rt.Hits:
    return rt.Hits(**{name: array.copy() for name, array in hits.to_dict().items()})


@pytest.fixture(scope="module", params=SEEDS)
def case(request):
    """Returns a scene, rays that certainly hit their triangles in spite of rounding, and the right
    hits as float32."""
    scene = soup_scene(500, request.param)
    origins, directions = RAY_SETS["random"](scene, 4000, request.param)
    hits = rt.reference.trace(scene, origins, directions)
    some = np.flatnonzero(hits.hit)
    pair = bound_pairs(scene.triangles[hits.triangle[some]], origins[some], directions[some])
    some = some[pair.inside & (pair.t_bound < 1e-4 * pair.t)]
    origins, directions = origins[some], directions[some]
    hits = rt.reference.trace(scene, origins, directions)
    hits.t, hits.u, hits.v = (a.astype(np.float32) for a in (hits.t, hits.u, hits.v))
    assert len(some) > 1000
    return scene, origins, directions, hits


def category(case, changed: rt.Hits, **options) -> np.ndarray:
    """Return the category of each ray, (n,) str."""
    verdict = judge(*case[:3], changed, **options)
    return np.array(CATEGORIES)[verdict.category]


def test_right_answers_are_right(case) -> None:
    verdict = judge(*case)
    assert verdict.counts["right"] == len(verdict) and not verdict.within_bound.any()
    assert verdict.wrong_share == 0 and 0 < verdict.upper_95 < 3.1 / len(verdict)
    assert 0 < verdict.quantiles()["max"] <= 0.5001  # t is correctly rounded
    assert verdict.quantiles("t_bounds")["max"] < 1
    assert verdict.quantiles("barycentric_error")["max"] < 1e-7
    assert verdict.to_dict()["counts"] == verdict.counts


def test_seeded_faults(case) -> None:
    """Each kind of fault gets its category, and the statistics count it."""
    scene, origins, directions, hits = case
    n = len(hits)
    bound = bound_pairs(scene.triangles[hits.triangle], origins, directions).t_bound
    fault = np.arange(n) % 8
    changed = copy(hits)
    at = fault == 1  # a lost hit
    changed.triangle[at], changed.t[at] = -1, np.inf
    other = (hits.triangle + 1) % len(scene)  # another triangle
    elsewhere = ~bound_pairs(scene.triangles[other], origins, directions).possible
    fault[(fault == 2) & ~elsewhere] = 0
    at = fault == 2
    changed.triangle[at] = other[at]
    at = fault == 3
    changed.t[at] += np.float32(10) * bound[at]
    at = fault == 4  # a shift within the bound
    changed.t[at] = (hits.t[at].astype(np.float64) + 0.4 * bound[at]).astype(np.float32)
    at = fault == 5
    changed.status[at] = UNFINISHED
    at = fault == 6
    changed.t[at] = np.nan
    expected = np.array(["right", "leak", "false hit", "wrong distance", "right", "unfinished",
                         "wrong distance", "right"])[fault]
    assert (category(case, changed) == expected).all()
    verdict = judge(*case[:3], changed, reference=hits)
    assert verdict.wrong_share == pytest.approx(np.isin(fault, (1, 2, 3, 5, 6)).mean())
    assert np.isnan(verdict.t_ulps[np.isin(fault, (1, 2))]).all()
    assert np.isinf(verdict.t_ulps[fault == 6]).all()
    assert 9 < np.median(verdict.t_bounds[fault == 3]) < 11


def test_a_triangle_behind_is_wrong(case) -> None:
    """The second hit along a ray counts as wrong. A traversal that skips a node would return this
    hit."""
    scene, origins, directions, hits = case
    behind = rt.reference.trace(scene, origins, directions, t_min=hits.t * np.float32(1.001))
    some = behind.hit & (behind.triangle != hits.triangle)
    found = category(case, behind)
    assert some.sum() > 300 and (found[some] == "wrong triangle").all()
    assert (found[~behind.hit] == "leak").all()


def test_hits_that_are_not_there(case) -> None:
    scene, origins, directions, hits = case
    # Rays away from the scene hit nothing, at any distance.
    away = (scene.bounds[0] - 10 + 0 * origins).astype(np.float32)
    verdict = judge(scene, away, -np.abs(directions), hits)
    assert verdict.counts["false hit"] == len(hits)
    # The interval ends before the hit or begins after the hit.
    for ends in ({"t_max": hits.t * np.float32(0.99)}, {"t_min": hits.t * np.float32(1.01)}):
        assert (category(case, hits, **ends) == "false hit").all()
    changed = copy(hits)
    changed.triangle[:] = len(scene)
    assert (category(case, changed) == "false hit").all()


@pytest.mark.parametrize("seed", SEEDS)
def test_zero_area_and_invalid_rays(seed: int) -> None:
    """A hit on a triangle of zero area is a false hit. Hits must mark invalid rays as invalid."""
    flat = np.float32([[[0, 0, 0], [1, 1, 0], [2, 2, 0]], [[0, 0, -1], [3, 0, -1], [0, 3, -1]]])
    origins, directions = np.float32([[1, 1, 1]] * 4), np.float32([[0, 0, -1]] * 4)
    directions[2:] = 0
    hits = rt.Hits(np.float32([1, 2, np.inf, np.inf]), *np.float32([[0.3] * 4] * 2),
                   np.int32([0, 1, -1, -1]), np.uint8([0, 0, INVALID, 0]))
    verdict = judge(flat, origins, directions, hits)
    assert np.array(CATEGORIES)[verdict.category].tolist() == ["false hit", "right", "right",
                                                               "false hit"]
    with pytest.raises(ValueError, match="a hit for each ray"):
        judge(flat, origins[:3], directions[:3], hits)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("at", ["vertices", "edges"])
def test_neighbours_are_accepted_and_leaks_are_found(at: str, seed: int) -> None:
    """Rays at shared edges and vertices may hit either neighbour, but may not pass through a
    closed mesh."""
    ball = rt.load_scene(trimesh.creation.icosphere(subdivisions=3))
    rays = RAY_SETS[at](ball, 3000, seed)
    inside = np.linalg.norm(rays[0], axis=1) < 0.9
    rays = tuple(a[inside] for a in rays)
    with rt.Tracer(ball, "bvh-threaded") as tracer:
        hits = tracer.trace(*rays)
    reference = rt.reference.trace(ball, *rays, accelerated=True)
    verdict = judge(ball, *rays, hits, reference=reference)
    assert verdict.counts["right"] == len(hits) and verdict.within_bound.any()
    assert not leaks(reference, hits).any()
    hits.triangle[::3] = -1
    assert leaks(reference, hits).sum() == len(hits.triangle[::3])


@pytest.mark.parametrize("seed", SEEDS)
def test_a_miss_at_an_edge_is_a_leak_if_a_triangle_lies_behind(seed: int) -> None:
    """A ray that goes through an edge on the front of a ball must hit the back of the ball, so a
    miss is a leak. Near the edge, no front triangle is certainly hit. The judge therefore searches
    the reference's tree for a triangle that is certainly hit."""
    rng = np.random.default_rng(seed)
    ball = rt.load_scene(trimesh.creation.icosphere(subdivisions=3))
    corner = rng.integers(len(ball.triangles), size=500)
    aims = ball.triangles[corner, :2].mean(axis=1)  # the middle of an edge
    origins = (3 * aims + 0.3 * rng.normal(size=aims.shape)).astype(np.float32)
    directions = aims - origins
    reference = rt.reference.trace(ball, origins, directions)
    pair = bound_pairs(ball.triangles[reference.triangle], origins, directions)
    unsure = reference.hit & ~pair.inside
    missed = rt.Hits(np.full(500, np.inf), *np.zeros((2, 500)), np.full(500, -1, np.int32),
                     np.zeros(500, np.uint8))
    found = np.array(CATEGORIES)[judge(ball, origins, directions, missed,
                                       reference=reference).category]
    assert unsure.mean() > 0.5 and (found[unsure] == "leak").mean() > 0.99


def test_brute_force_is_right_on_a_soup() -> None:
    """Brute force has no wrong hit for any set of rays."""
    scene = soup_scene(300, 5)
    for name, rays in RAY_SETS.items():
        chosen = rays(scene, 1024, 3)
        reference = rt.reference.trace(scene, *chosen)
        with rt.Tracer(scene, "brute-force") as tracer:
            verdict = judge(scene, *chosen, tracer.trace(*chosen), reference=reference)
        assert not verdict.wrong.any(), (name, verdict.counts)


@pytest.mark.parametrize("wrong, rays", [(0, 1), (0, 10 ** 6), (1, 10), (3, 300_000), (9, 10),
                                         (40, 1000)])
def test_the_confidence_bound_is_where_the_tail_is_5_percent(wrong: int, rays: int) -> None:
    p = upper_confidence(wrong, rays)
    tail, term = 0.0, (1 - p) ** rays
    for k in range(wrong + 1):
        tail += term
        term *= (rays - k) / (k + 1) * p / (1 - p)
    assert tail == pytest.approx(0.05, rel=1e-6) and p > wrong / rays
    if not wrong:
        assert p == pytest.approx(1 - 0.05 ** (1 / rays), rel=1e-9)


def test_the_confidence_bound_at_its_ends() -> None:
    assert upper_confidence(0, 0) == upper_confidence(7, 7) == 1
    assert upper_confidence(10 ** 5, 10 ** 6) == pytest.approx(0.1005, rel=1e-3)
    assert upper_confidence(0, 100, 0.99) > upper_confidence(0, 100)
