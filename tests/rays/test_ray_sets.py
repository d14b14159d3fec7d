"""Tests of ray sets, and of a camera's rays in an image that is not square."""
from __future__ import annotations

import numpy as np
import pytest
import trimesh

import gpgpu_rt as rt
from gpgpu_rt.rays import ray_sets as rays


@pytest.fixture(scope="module")
def ball() -> rt.Scene:
    return rt.load_scene(trimesh.creation.icosphere(subdivisions=2))


@pytest.mark.parametrize("seed", [1, 2])
def test_surface_rays_leave_the_surface(seed: int, ball: rt.Scene) -> None:
    origins, directions = rays.surface_rays(ball, 400, seed)
    feet = origins - 1e-3 * ball.extent * directions.astype(np.float64)
    closest, distance, face = trimesh.proximity.closest_point_naive(
        trimesh.creation.icosphere(subdivisions=2), feet)
    assert distance.max() < 1e-6
    # All rays leave the ball.
    assert not rt.reference.trace(ball, origins, directions, t_min=1e-5).hit.any()
    again = rays.surface_rays(ball, 400, seed)
    assert (again[0] == origins).all() and (again[1] == directions).all()


def test_random_rays_fill_the_box(ball: rt.Scene) -> None:
    origins, directions = rays.random_rays(ball, 4000, 3)
    lo, hi = ball.bounds
    assert (origins >= lo).all() and (origins <= hi).all() and np.abs(origins.mean(0)).max() < 0.1
    assert np.abs(directions.mean(axis=0)).max() < 0.1
    np.testing.assert_allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)


@pytest.mark.parametrize("at", ["vertices", "edges"])
def test_aimed_rays_meet_their_aim(at: str, ball: rt.Scene) -> None:
    origins, directions = rays.aimed_rays(ball, 500, 4, at=at, origin=(0, 0, 0))
    hits = rt.reference.trace(ball, origins, directions)
    corner = np.stack((hits.u, hits.v, 1 - hits.u - hits.v), 1)
    low, middle, _ = np.sort(corner, axis=1).T
    assert hits.hit.all() and np.abs(low).max() < 1e-5
    if at == "vertices":
        assert np.abs(middle).max() < 1e-5
    else:
        assert 0.2 < middle.mean() < 0.3    # uniform along the edge


def test_eye_rays_need_a_square(ball: rt.Scene) -> None:
    origins, directions = rays.eye_rays(ball, 9)
    assert (directions.reshape(3, 3, 3) == ball.camera.rays((3, 3))[1]).all()
    for bad in (8, 0, -1):
        with pytest.raises(rt.Error, match="square"):
            rays.eye_rays(ball, bad)
    with pytest.raises(rt.Error, match="edges"):
        rays.aimed_rays(ball, 4, 1, at="edge")


def test_scenes_without_a_surface_have_no_surface_rays() -> None:
    empty = rt.Scene.from_arrays([], [])
    flat = rt.Scene.from_arrays([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]])
    for scene in (empty, flat):
        with pytest.raises(rt.SceneError, match="area"):
            rays.surface_rays(scene, 4, 1)
    with pytest.raises(rt.SceneError, match="aim"):
        rays.aimed_rays(empty, 4, 1)
    assert len(rays.aimed_rays(flat, 4, 1)[0]) == 4


def test_a_wide_image_keeps_the_vertical_angle() -> None:
    camera = rt.Camera((0, 0, 0), (0, 0, -2), up=(0, 5, 1), fov=90)
    right, up, forward = camera.basis((300, 100))
    np.testing.assert_allclose([right, up, forward], [(3, 0, 0), (0, 1, 0), (0, 0, -1)], atol=1e-9)
    directions = camera.rays((300, 100))[1]
    slope = directions[..., :2] / -directions[..., 2:]
    np.testing.assert_allclose(slope[0, 0], (-2.99, 0.99), rtol=1e-5)
    np.testing.assert_allclose(slope[99, 299], (2.99, -0.99), rtol=1e-5)


def test_cameras_round_trip_and_see_the_whole(ball: rt.Scene) -> None:
    """A camera survives `to_dict` and `from_dict`, and a scene's own camera sees the whole
    scene."""
    camera = rt.Camera((1, 2, 3), (4, 5, 7), (0, 0, 1), 33)
    assert rt.Camera.from_dict(camera.to_dict()) == camera
    for broken in ({}, {"eye": [0, 0, 0]}, [1], {"eye": [0, 0, 0], "target": "abc"}):
        with pytest.raises(rt.SceneError, match="here"):
            rt.Camera.from_dict(broken, "here")
    image = rt.reference.trace(ball, *ball.camera.rays((24, 24))).hit.reshape(24, 24)
    border = np.concatenate((image[0], image[-1], image[:, 0], image[:, -1]))
    assert image[12, 12] and not border.any()
