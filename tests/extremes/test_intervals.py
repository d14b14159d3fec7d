"""A ray with an empty interval misses, and scaling never flushes an interval's end to 0.

A tracer divides each direction by a power of two and multiplies t by the same power. The largest
component of the direction is then in [0.5, 1). For a direction of length 1e-42, t_min = 1 becomes
a denormal, which a renderer may flush to 0.
"""
from __future__ import annotations

import numpy as np
import pytest
from conftest import assert_same_bits

import gpgpu_rt as rt
from gpgpu_rt.conform.flat_families import Flat

METHODS = [row.name for row in rt.methods()]
pytestmark = pytest.mark.small
EMPTY = {"ends-before-0": (0.0, -1.0), "ends-first": (3.0, 2.0), "both-before-0": (-1.0, -2.0),
         "by-a-spacing": (1.0, float(np.nextafter(np.float32(1), np.float32(0)))),
         "before-infinity": (np.inf, 1.0)}


def rays_in_the_plane(n: int, seed: int, length: float) -> tuple[rt.Scene, np.ndarray, np.ndarray]:
    """Returns a square in y = 0 and rays that start on the square, so t is 0 at every hit. No ray
    runs in the plane of the square."""
    rng = np.random.default_rng(seed)
    scene = Flat(1, 0.0, count=2).case(1, seed).scene
    origins = np.zeros((n, 3))
    origins[:, ::2] = rng.uniform(-0.9, 0.9, (n, 2))
    directions = rng.uniform(-1, 1, (n, 3))
    directions[:, 1] = np.copysign(1.5, directions[:, 1])
    return scene, origins, (length * directions).astype(np.float32)


@pytest.mark.parametrize("length", [1.0, 1e-39, 1e-42])
@pytest.mark.parametrize("method", METHODS)
def test_an_empty_interval_is_a_miss(method: str, length: float) -> None:
    scene, *rays = rays_in_the_plane(40, 1, length)
    with rt.Tracer(scene, method) as tracer:
        assert tracer.trace(*rays).hit.all()
        for name, (t_min, t_max) in EMPTY.items():
            assert not tracer.trace(*rays, t_min, t_max).hit.any(), name
            assert not tracer.occluded(*rays, t_max, t_min).any(), name
            given = [np.where(np.arange(40) % 2, end, whole).astype(np.float32)
                     for end, whole in ((t_min, -np.inf), (t_max, np.inf))]
            assert np.array_equal(tracer.trace(*rays, *given).hit, np.arange(40) % 2 == 0), name


@pytest.mark.parametrize("length, t_min", [(1.0, 1e-40), (1e-39, 1.0), (1e-42, 1.0),
                                           (1e-30, 1e-30)])
@pytest.mark.parametrize("method", METHODS)
def test_an_interval_that_excludes_0_has_no_hit(method: str, length: float, t_min: float) -> None:
    """All hits have t = 0, so an interval that begins after 0 or ends before 0 has no hit."""
    scene, *rays = rays_in_the_plane(40, 3, length)
    with rt.Tracer(scene, method) as tracer:
        assert not tracer.trace(*rays, t_min=t_min).hit.any()
        assert tracer.trace(*rays, t_min=-t_min, t_max=t_min).hit.all()
        assert not tracer.trace(*rays, t_min=-np.inf, t_max=-t_min).hit.any()


@pytest.mark.parametrize("seed", [4], ids="seed{}".format)
@pytest.mark.parametrize("size", [1.0, 1e-8, 1e-14])
def test_the_ray_engines_host_flushes_as_its_passes_do(exact_renderer, size: float,
                                                       seed: int) -> None:
    """The ray engine's host and its passes return the same hits, even where origins, directions,
    corners and products are below 2^-126."""
    rng = np.random.default_rng(seed)
    case = Flat(1, 0.0).case(800, seed)
    tiny = 10 ** rng.uniform(-45, -30, (800, 3)) * rng.choice([-1, 1], (800, 3))
    origins = np.where(rng.random((800, 3)) < 0.3, tiny, size * case.origins)
    directions = np.where(rng.random((800, 3)) < 0.3, tiny, case.directions)
    directions = directions * 10.0 ** rng.choice([0, -30, -39], (800, 1))
    directions[(directions.astype(np.float32) == 0).all(axis=1)] = 1, 1, 0
    triangles = np.float32(size) * case.triangles
    triangles[::3, :, 1] = 10 ** rng.uniform(-45, -38, triangles[::3, :, 1].shape)
    corners = triangles.reshape(-1, 3)
    scene = rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3))
    answers = []
    for options in ({}, {"cpu_below": 10 ** 9}):
        with rt.Tracer(scene, "ray-engine", **options) as tracer:
            answers.append(tracer.trace(origins, directions, -1.0))
    assert answers[0].hit.any()
    assert_same_bits(answers[1], answers[0])
