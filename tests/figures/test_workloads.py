"""Tests of workloads: shadow rays start at hits and end at the light, and mirror rays leave hits
in the reflected direction."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt import reference
from gpgpu_rt.bench.workloads import EYE, SHADOW, mirror, workload

SIZE = 24


def _seen(name: str) -> tuple[rt.Scene, np.ndarray, np.ndarray, rt.Hits]:
    """Returns a scene, its eye rays, and the reference's hits."""
    scene, rays = rt.load_scene(name), workload(name, EYE, SIZE)
    return scene, rays.origins, rays.directions, reference.trace(scene, rays.origins,
                                                                 rays.directions)


@pytest.mark.parametrize("name", ["cornell", "stadium"])
def test_shadow_rays_reach_the_light(name: str) -> None:
    scene, origins, directions, hits = _seen(name)
    rays, light = workload(name, SHADOW, SIZE), np.asarray(scene.light.position)
    live = np.isfinite(rays.origins).all(axis=1)
    assert 0 < rays.live == live.sum() <= hits.hit.sum()
    points = origins + np.where(hits.hit, hits.t, 0)[:, None] * directions
    assert np.abs(rays.origins[live] - points[live]).max() < 1e-4 * scene.extent
    ends = rays.origins[live] + rays.t_max[live, None] * rays.directions[live]
    assert np.abs(ends - light).max() < 1e-4 * scene.extent
    # A hit without a shadow ray faces away from the light.
    corners = scene.triangles[hits.triangle].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal *= -np.sign((normal * directions).sum(axis=1, keepdims=True))
    faces = hits.hit & ((normal * (light - points)).sum(axis=1) > 0)
    assert (faces == live).mean() > 0.99  # except where the light grazes the surface


def test_shadow_rays_agree_with_the_reference() -> None:
    """For more than 99.5 % of the shadow rays, the tracer and the reference agree on whether an
    occluder lies before the light."""
    rays = workload("cornell", SHADOW, SIZE)
    live = np.isfinite(rays.origins).all(axis=1)
    truth = reference.trace(rt.load_scene("cornell"), rays.origins[live], rays.directions[live])
    with rt.Tracer("cornell", "kd-packet") as tracer:
        answers = tracer.occluded(rays.origins, rays.directions, rays.t_max, shape=(SIZE, SIZE),
                                  invalid="miss")
    assert 0 < answers.sum() < rays.live and not answers[~live].any()
    assert (answers[live] == (truth.t < rays.t_max[live])).mean() > 0.995


@pytest.mark.parametrize("bounces", [1, 2])
def test_mirror_rays_are_reflected(bounces: int) -> None:
    """Mirror rays leave hits in the reflected direction, except near the edges of triangles."""
    scene, before = rt.load_scene("cornell"), workload("cornell", mirror(bounces - 1), SIZE)
    rays = workload("cornell", mirror(bounces), SIZE)
    came = np.isfinite(before.origins).all(axis=1)
    hits = reference.trace(scene, np.nan_to_num(before.origins),
                           np.where(came[:, None], before.directions, np.float32(1)))
    live = np.isfinite(rays.origins).all(axis=1)
    assert 0 < rays.live <= before.live and not live[~came].any()
    corners = scene.triangles[hits.triangle[live]].astype(np.float64)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    into, out = before.directions[live], rays.directions[live]
    along = [(d * normal).sum(axis=1) for d in (into, out)]
    edge = np.minimum(np.minimum(hits.u, hits.v), 1 - hits.u - hits.v)[live] < 1e-3
    turned = np.abs(along[0] + along[1]) < 1e-4
    kept = np.abs((into - along[0][:, None] * normal)
                  - (out - along[1][:, None] * normal)).max(axis=1) < 1e-4
    assert (turned & kept)[~edge].all()
    assert mirror(0) == EYE
