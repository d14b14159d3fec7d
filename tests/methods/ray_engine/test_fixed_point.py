"""The Ray Engine, with the fixed-point numbers of cards of its time, finds the same hits as a
numpy model. Hits that differ from exact hits lie at edges of triangles."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.errors import OptionError
from gpgpu_rt.figures.experiments import lost_rays
from gpgpu_rt.methods.ray_engine.fixed_point import FIXED_POINT, fixed_uniforms

SIZE = 64


def modelled(scene: rt.Scene, origins: np.ndarray, directions: np.ndarray,
             name: str) -> tuple[np.ndarray, np.ndarray]:
    """Returns two arrays, (n, triangles) each: t of each ray and triangle, and the distance from
    the nearest edge.

    t is in world units, and inf for a miss. The distance is the smallest of the hit point's signed
    distances from the three edges, in steps of the fixed-point format. The distance is negative
    outside the triangle. The model computes in float32 and rounds each result to a step.
    """
    numbers, uniforms = FIXED_POINT[name], fixed_uniforms(name, scene.triangles)

    def fixed(x: np.ndarray) -> np.ndarray:
        step, *range_ = map(np.float32, (numbers.step, numbers.least, numbers.most))
        return np.clip(np.round(np.float32(x) / step) * step, *range_)

    def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        p = fixed(a * b)
        return fixed(fixed(p[..., 0] + p[..., 1]) + p[..., 2])

    def unit(v: np.ndarray) -> np.ndarray:
        return v / np.linalg.norm(v, axis=-1, keepdims=True)
    scale, centre = np.float32(uniforms["fixed_scale"]), np.float32(uniforms["fixed_centre"])
    corners = (scene.triangles - centre) * scale
    v0, v1, v2 = corners.transpose(1, 0, 2)
    normal = unit(np.cross(v1 - v0, v2 - v0))
    speed = np.linalg.norm(np.float32(directions), axis=1, keepdims=True)
    origin = fixed((np.float32(origins) - centre) * scale)[:, None]
    direction = fixed(directions / speed)[:, None]
    with np.errstate(all="ignore"):
        facing = dot(fixed(normal), direction)
        t = fixed(dot(fixed(normal), fixed(fixed(v0) - origin)) / facing)
        point = fixed(origin + fixed(t[..., None] * direction))
        edges = np.min([dot(fixed(unit(np.cross(normal, b - a))), fixed(point - fixed(a)))
                        for a, b in ((v1, v2), (v2, v0), (v0, v1))], axis=0)
        hit = (facing != 0) & (edges >= 0) & (t >= 0)
        return np.where(hit, t / (speed * scale), np.inf), edges / numbers.step


@pytest.mark.parametrize("name", FIXED_POINT)
def test_hits_are_those_of_a_model(name: str) -> None:
    """The numpy model tests all pairs, and finds the same t for almost all rays. In the
    exceptions, the square roots of numpy and the renderer differ, so a unit vector is rounded to
    different steps."""
    scene = rt.load_scene("cornell")
    origins, directions = (a.reshape(-1, 3) for a in scene.camera.rays((SIZE, SIZE)))
    with rt.Tracer(scene, "ray-engine", fixed_point=name, resolution=1) as tracer:
        found = tracer.trace(origins, directions)
    t, _ = modelled(scene, origins, directions, name)
    nearest = t.min(axis=1)
    # The host does not trace a ray that misses the scene's box. Rounded to fixed point, such a ray
    # might hit a triangle.
    ends = np.array([scene.triangles.min((0, 1)), scene.triangles.max((0, 1))])[:, None]
    with np.errstate(divide="ignore"):
        sides = (ends - origins) / directions
    enters = sides.min(0).max(1) <= sides.max(0).min(1)
    assert not found.hit[~enters].any()
    assert (np.isfinite(nearest) == found.hit)[enters].mean() > 0.999
    both = found.hit & np.isfinite(nearest)
    assert (np.abs(found.t[both] / nearest[both] - 1) < 1e-5).mean() > 0.995
    # At each hit that the model also finds, the tracer's t is a multiple of the step.
    steps = found.t[both] * fixed_uniforms(name, scene.triangles)["fixed_scale"] * (
        np.linalg.norm(directions[both], axis=1)) / FIXED_POINT[name].step
    assert np.abs(steps - np.round(steps)).max() < 0.01


def test_wrong_rays_of_the_r200_lie_at_edges() -> None:
    """The point of a wrong hit is less than 8 steps from an edge of the triangle that the ray hits
    or should hit."""
    scene = rt.load_scene("cornell")
    result = lost_rays.measure(scene, "ray-engine", {"fixed_point": "r200"}, SIZE)
    lost, other = (part.reshape(-1) for part in (lost_rays.wrong_pixels(result, SIZE)))
    assert 0 < (lost | other).mean() < 0.01
    origins, directions = (a.reshape(-1, 3) for a in scene.camera.rays((SIZE, SIZE)))
    triangles = []
    for method, options in ((lost_rays.EXACT, {}), ("ray-engine", {"fixed_point": "r200"})):
        with rt.Tracer(scene, method, **options) as tracer:
            triangles.append(tracer.trace(origins, directions).triangle)
    _, edges = modelled(scene, origins, directions, "r200")
    wrong = np.flatnonzero(lost | other)
    near = np.abs(np.take_along_axis(edges[wrong], np.array(triangles).T[wrong], axis=1))
    assert (near.min(axis=1) < 8).all()


def test_fewer_bits_lose_more() -> None:
    """With the fewer bits of the nv25, more rays lose or change their hits than with the r200, and
    the error of t is larger. Without fixed point, there are no errors."""
    scene = rt.load_scene("cornell")
    shares = {name: lost_rays.measure(scene, "ray-engine", {"fixed_point": name}, SIZE)
              for name in FIXED_POINT}
    for key in ("lost", "other", "t_error"):
        assert shares["r200"][key] < shares["nv25"][key], key
    exact = lost_rays.measure(scene, "ray-engine", {}, SIZE)
    assert (exact["lost"], exact["other"], exact["t_error"]) == (0, 0, 0)


def test_a_map_holds_the_wrong_pixels() -> None:
    """The masks of `wrong_pixels` mark as many pixels as `measure` counts."""
    scene = rt.load_scene("cornell")
    result = lost_rays.measure(scene, "ray-engine", {"fixed_point": "nv25"}, SIZE)
    lost, other = lost_rays.wrong_pixels(result, SIZE)
    assert lost.shape == (SIZE, SIZE) and not (lost & other).any()
    assert (lost.sum(), other.sum()) == (result["lost"], result["other"] + result["false"])
    assert min(result["lost"], result["other"]) > 0


def test_the_host_has_no_fixed_point() -> None:
    """`fixed_point` is refused together with `cpu_below`, because the host computes in float32."""
    with pytest.raises(OptionError, match="leave cpu_below at 0"):
        rt.Tracer("cornell", "ray-engine", fixed_point="r200", cpu_below=8)
