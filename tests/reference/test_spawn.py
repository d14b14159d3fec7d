"""Row 37 of docs/extremes.md: a spawned ray or a shadow ray, which starts at a hit, does not hit
the same surface again."""
from __future__ import annotations

import numpy as np
import pytest
import trimesh
from conftest import real_scene, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.gl.textures import read_texture
from gpgpu_rt.hits import Hits
from gpgpu_rt.numerics.watertight import intersect_pairs
from gpgpu_rt.rays.batch import RayBatch
from gpgpu_rt.rays.records import HIT
from gpgpu_rt.reference.spawn import spawn
from gpgpu_rt.render.lights import light_uniforms

KINDS = ("coordinates", "sizes", "slivers", "ball")


def triangles_of(kind: str, count: int, rng: np.random.Generator) -> np.ndarray:
    """Returns triangles, (count, 3, 3) float32, of one of KINDS. In "coordinates", each coordinate
    has its own size from 1e-8 to 1e8. In "sizes" and "slivers", each triangle has its own size
    from this range. "ball" gives the triangles of a ball."""
    if kind == "coordinates":
        size = 10 ** rng.uniform(-8, 8, (count, 3, 3))
        return (rng.choice((-1, 1), (count, 3, 3)) * size).astype(np.float32)
    if kind == "ball":
        ball = trimesh.creation.icosphere(subdivisions=3)
        return np.resize(ball.triangles, (count, 3, 3)).astype(np.float32)
    triangles = rng.normal(size=(count, 3, 3))
    if kind == "slivers":
        along = rng.random((count, 1))
        triangles[:, 2] = (1 - along) * triangles[:, 0] + along * triangles[:, 1]
        triangles[:, 2] += rng.normal(size=(count, 3)) * 10 ** rng.uniform(-6, -1, (count, 1))
    size = 10 ** rng.uniform(-8, 8, (count, 1, 1))
    return (triangles * size).astype(np.float32)


def hits_on(triangles: np.ndarray, each: int, rng: np.random.Generator) -> Hits:
    """Returns ``each`` hits per triangle. Some of the hits lie on edges and corners."""
    count = len(triangles) * each
    weights = rng.dirichlet((1, 1, 1), count).astype(np.float32)
    weights[::7, 0] = 0
    weights[::11] = (0, 0, 1)
    index = np.repeat(np.arange(len(triangles), dtype=np.int32), each)
    return Hits(np.ones(count, np.float32), weights[:, 1], weights[:, 2], index,
                np.zeros(count, np.uint8))


@pytest.mark.parametrize("each", [pytest.param(20, id="rays20000"), pytest.param(
    2000, id="rays2000000", marks=pytest.mark.full)])
@pytest.mark.parametrize("seed", [37])
@pytest.mark.parametrize("kind", KINDS)
def test_spawned_rays_miss_their_own_triangle(kind: str, seed: int, each: int) -> None:
    rng = np.random.default_rng(seed)
    triangles = triangles_of(kind, 1000, rng)
    for some in np.split(triangles, 1 if each < 100 else 20):
        hits = hits_on(some, each, rng)
        directions = rng.normal(size=(len(hits), 3)).astype(np.float32)  # both hemispheres
        origins = spawn(some, hits, directions)
        assert origins.dtype == np.float32
        corners = some[hits.triangle]
        accepted, t, _, _ = intersect_pairs(corners, origins, directions)
        assert not (accepted & (t >= 0)).any()
        # Almost all origins lie on the side of the triangle to which the new direction points. All
        # origins lie near the hit point.
        v0, v1, v2 = corners.astype(np.float64).transpose(1, 0, 2)
        u, v = hits.u[:, None].astype(np.float64), hits.v[:, None].astype(np.float64)
        off = origins - ((1 - u - v) * v0 + u * v1 + v * v2)
        assert ((np.cross(v1 - v0, v2 - v0) * off).sum(1)
                * (np.cross(v1 - v0, v2 - v0) * directions).sum(1) >= 0).mean() > 0.98
        assert (np.abs(off).max(1) < 1e-3 * np.abs(corners).max((1, 2))).all()


@pytest.mark.parametrize("seed", [3])
@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_no_self_hit_in_a_trace(method: str, seed: int) -> None:
    """Under every method, a spawned ray misses the triangle that it leaves."""
    rng = np.random.default_rng(seed)
    scene = soup_scene(300, seed)
    hits = hits_on(scene.triangles, 10, rng)
    directions = rng.normal(size=(len(hits), 3)).astype(np.float32)
    origins = spawn(scene, hits, directions)
    with rt.Tracer(scene, method) as tracer:
        again = tracer.trace(origins, directions)
    assert again.hit.any() and not (again.triangle == hits.triangle).any()


@pytest.mark.parametrize("seed", [4])
def test_rays_out_of_a_ball_miss_and_rays_into_it_hit(seed: int) -> None:
    """Rays that leave a ball hit nothing, not even a neighbouring facet that they graze. All rays
    that go from the surface into the ball hit the ball."""
    rng = np.random.default_rng(seed)
    ball = rt.load_scene(trimesh.creation.icosphere(subdivisions=4))
    hits = hits_on(ball.triangles, 4, rng)
    hits.u = np.clip(hits.u, 0.05, 0.45)  # at an edge, rounding may let rays hit neighbours
    hits.v = np.clip(hits.v, 0.05, 0.45)
    v0, v1, v2 = ball.triangles[hits.triangle].astype(np.float64).transpose(1, 0, 2)
    normal = np.cross(v1 - v0, v2 - v0)
    directions = rng.normal(size=(len(hits), 3)).astype(np.float32)
    directions *= np.sign((directions * normal).sum(1, keepdims=True))
    with rt.Tracer(ball, "bvh-threaded") as tracer:
        assert not tracer.trace(spawn(ball, hits, directions), directions).hit.any()
        assert tracer.trace(spawn(ball, hits, -directions), -directions).hit.all()


def test_misses_spawn_nothing() -> None:
    scene = soup_scene(10, 1)
    hits = Hits(*np.float32([[1, np.inf], [0.2, 0], [0.3, 0]]), np.int32([3, -1]),
                np.uint8([0, 0]))
    origins = spawn(scene, hits, np.ones((2, 3)))
    assert np.isfinite(origins[0]).all() and np.isnan(origins[1]).all()
    with rt.Tracer(scene) as tracer:
        again = tracer.trace(origins, np.ones((2, 3)), invalid="miss")
    assert again.status.tolist() == [0, 1]
    with pytest.raises(ValueError, match="one for each hit"):
        spawn(scene, hits, np.ones((3, 3)))


def shadow_rays(tracer: rt.Tracer, size: tuple[int, int]) -> tuple[Hits, np.ndarray, np.ndarray]:
    """Returns the hits of the camera's rays, and the two texels of each hit's shadow ray, (n, 4)
    each. The first texel has origin and t_min, and the second has direction and t_max."""
    tracer.render(size=size)
    batch = RayBatch(*tracer.scene.camera.rays(size))
    with tracer.gpu:
        rays, buffers = tracer.session.buffers.of(batch.size)
        rays.upload(batch)
        side, _ = tracer.session.driver.run(rays, buffers, tracer.statistics)
        hits = batch.hits(side.fields(HIT.name))
        integrator = tracer.sessions.pictures.integrator
        room, light = integrator.room, light_uniforms(tracer.scene, integrator.needs)[0]
        integrator.run("surfaces", room.target("shadow rays", "lit", "direct"),
                       {**rays.complete().samplers(), **side.samplers()}, **light)
        texels = [read_texture(texture).reshape(-1, 4) for texture in room.textures("shadow rays")]
    return hits, *texels


def slivers_scene() -> rt.Scene:
    triangles = triangles_of("slivers", 600, np.random.default_rng(1)).astype(np.float64)
    triangles /= np.abs(triangles).max(axis=(1, 2), keepdims=True)
    return rt.Scene.from_arrays(triangles.reshape(-1, 3), np.arange(1800).reshape(-1, 3))


@pytest.mark.parametrize("name", ["kitchen", "slivers"])
def test_the_shader_computes_numpy_s_origin(precise_renderer, name: str) -> None:
    """The shader and numpy's `spawn` give a shadow ray the same origin, bit for bit. No shadow ray
    hits the triangle that it leaves.

    For a sliver, the shader tries several origins, and the direction to the light changes slightly
    with each origin. Numpy gets only the last direction, so numpy's origin may differ. At least
    nine of ten origins at slivers are equal.
    """
    with rt.Tracer(slivers_scene() if name == "slivers" else real_scene(name)) as tracer:
        hits, start, end = shadow_rays(tracer, (160, 120))
        lit = hits.hit & (end[:, 3] > 0)
        lit_hits = Hits(*(getattr(hits, name)[lit] for name in
                          ("t", "u", "v", "triangle", "status")))
        origins = spawn(tracer.scene, lit_hits, end[lit, :3])
        same = (origins == start[lit, :3]).all(axis=1)
        assert lit.sum() > 1000 and same.mean() >= (0.9 if name == "slivers" else 1)
        accepted, t, _, _ = intersect_pairs(tracer.scene.triangles[lit_hits.triangle],
                                            start[lit, :3], end[lit, :3])
        assert not (accepted & (t >= start[lit, 3])).any()


@pytest.mark.parametrize("precision", ["fp32", "fp24"])
@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_a_ball_has_no_shadow_on_its_lit_side(scale: float, precision: str) -> None:
    mesh = trimesh.creation.icosphere(subdivisions=3, radius=scale)
    ball = rt.load_scene(mesh)
    with rt.Tracer(ball, precision=precision) as tracer:
        hits, start, end = shadow_rays(tracer, (96, 96))
        lit = hits.hit & (end[:, 3] > 0)
        assert lit.sum() > 500
        shadowed = tracer.occluded(start[lit, :3], end[lit, :3], end[lit, 3], start[lit, 3])
    # fp24 has a significand of 17 bits, so a ray along the surface may enter the next facet.
    assert shadowed.mean() <= (0 if precision == "fp32" else 0.01)
    height = np.linalg.norm(start[lit, :3], axis=1) / scale
    assert height.max() < 1 + (1e-5 if precision == "fp32" else 1e-3)


def test_a_shadow_ray_ends_before_a_surface_at_the_light() -> None:
    """A light in the ceiling is not shadowed by the ceiling, although shadow rays end there."""
    corners = np.array([[-9, 0, -9], [9, 0, -9], [9, 0, 9], [-9, 0, 9]], np.float64)
    vertices = np.concatenate((corners, corners + (0, 3.3, 0)))
    faces = [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]
    camera = rt.Camera((0.3, 1.7, 0.2), (0.1, 0, 0.1), (0, 0, 1), 100)
    light = rt.PointLight((0.7, float(np.float32(3.3)), 1.1))
    room = rt.Scene.from_arrays(vertices, faces, light=light, camera=camera)
    with rt.Tracer(room) as tracer:
        hits, start, end = shadow_rays(tracer, (64, 64))
        lit = hits.hit & (end[:, 3] > 0)
        assert lit.mean() > 0.9
        assert not tracer.occluded(start[lit, :3], end[lit, :3], end[lit, 3], start[lit, 3]).any()
