"""Rows 21, 22 and 39 of the catalogue of extreme cases (docs/extremes.md): input that is not
finite, and input with at most one triangle, ray or pixel."""
from __future__ import annotations

import itertools

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt

METHODS = [row.name for row in rt.methods()]
pytestmark = pytest.mark.small
BAD = [np.nan, np.inf, -np.inf]


@pytest.mark.parametrize("seed", [1], ids="seed{}".format)
@pytest.mark.parametrize("method", METHODS)
def test_row_21_invalid_rays_disturb_no_other(precise_renderer, method: str, seed: int) -> None:
    """Invalid rays leave the hits of valid rays unchanged to the bit. An invalid ray has one bad
    value in one component of its origin or direction, or a zero direction of either sign. The
    rays cover every bad value in every component."""
    scene = soup_scene(200, seed)
    origins, directions = np.random.default_rng(seed).normal(size=(2, 400, 3)).astype(np.float32)
    kinds = list(itertools.product((0, 1), range(3), BAD)) + [(1, slice(None), z)
                                                              for z in (0.0, -0.0)]
    rows = np.arange(len(kinds)) * 19 % 400
    with rt.Tracer(scene, method) as tracer:
        good = tracer.trace(origins, directions)
        for row, (which, entry, value) in zip(rows, kinds):
            (origins, directions)[which][row, entry] = value
        hits = tracer.trace(origins, directions, invalid="miss")
        with pytest.raises(ValueError, match="^ray 0 "):
            tracer.trace(origins, directions)
    assert np.array_equal(np.flatnonzero(hits.status), np.sort(rows)) and hits.status.max() == 1
    assert not hits.hit[rows].any() and np.isinf(hits.t[rows]).all()
    for array in (hits, good):  # all valid rays agree bit for bit
        for name in ("t", "u", "v", "triangle", "status"):
            setattr(array, name, np.delete(getattr(array, name), rows))
    assert_same_bits(hits, good)


@pytest.mark.parametrize("value", [*BAD, 1e39])
def test_row_22_a_vertex_that_is_not_finite(value: float) -> None:
    vertices = np.zeros((9, 3))
    vertices[7, 1] = value
    with pytest.raises(rt.SceneError, match="vertex 7 ") as refusal:
        rt.Scene.from_arrays(vertices, np.arange(9).reshape(-1, 3))
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("triangles", [0, 1])
@pytest.mark.parametrize("method", METHODS)
def test_row_39_at_most_one_triangle_ray_and_pixel(method: str, triangles: int) -> None:
    """Scenes of 0 or 1 triangles, calls with 0 or 1 rays, and a picture of one pixel are valid."""
    vertices = np.float32([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])[:3 * triangles]
    scene = rt.Scene.from_arrays(vertices, np.arange(3 * triangles).reshape(-1, 3))
    with rt.Tracer(scene, method, statistics=True) as tracer:
        for rays in (0, 1):
            hits = tracer.trace(np.zeros((rays, 3)) - [0, 0, 1], np.tile([0, 0, 1.0], (rays, 1)))
            assert len(hits) == rays and (hits.triangle == triangles - 1).all()
            assert (hits.t == (1.0 if triangles else np.inf)).all()
            occluded = tracer.occluded(np.zeros((rays, 3)) - [0, 0, 1],
                                       np.tile([0, 0, 1.0], (rays, 1)))
            assert (occluded == bool(triangles)).all()
        assert tracer.render(size=(1, 1)).size == (1, 1)
