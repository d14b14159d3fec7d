"""Behind a slab, image-space refraction gives the unchanged directions that Snell's law demands.
Behind a ball, the directions are close to those of float64 rays."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.reference.refraction import refract, through_two_borders
from gpgpu_rt.render.image_space.refraction import LEFT, TOTAL, UNSEEN, Refraction
from gpgpu_rt.scene.camera import Camera
from gpgpu_rt.scene.procedural.shapes import ball, boxes

SIZE = (64, 48)


def scene_of(triangles: np.ndarray) -> rt.Scene:
    corners = np.asarray(triangles, np.float32).reshape(-1, 3)
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3), name="glass")


def errors(scene: rt.Scene, camera: Camera, smooth: bool, ior: float = 1.5
           ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the errors of image-space refraction, its kind of each pixel, and the kind of each
    pixel in the float64 reference.

    The errors, (k,), are angles in degrees between the two directions, for the pixels in which
    both methods refract a ray twice. The kinds, (n,) each, are constants of
    `render.image_space.refraction`, such as LEFT.
    """
    with rt.Tracer(scene) as tracer:
        refraction = Refraction(tracer, ior, smooth)
        found, kind = refraction.draw(camera, SIZE)
        refraction.release()
    origins, directions = (rays.reshape(-1, 3) for rays in camera.rays(SIZE))
    truth, right = through_two_borders(refraction.triangles, refraction.normals, origins,
                                       directions, ior)
    found, kind = found.reshape(-1, 3), kind.reshape(-1)
    both = (kind == LEFT) & (right == LEFT)
    cosine = np.clip((found[both] * truth[both]).sum(1), -1, 1)
    return np.degrees(np.arccos(cosine)), kind, right


def test_snell() -> None:
    angles = np.radians([0, 20, 60, 89])
    directions = np.stack([np.sin(angles), 0 * angles, -np.cos(angles)], axis=1)
    normals = np.tile([0.0, 0.0, 1.0], (4, 1))
    inside, total = refract(directions, normals, 1 / 1.5)
    assert not total.any() and np.allclose(inside[:, 0], np.sin(angles) / 1.5)
    _, total = refract(directions, normals, 1.5)
    assert (total == (1.5 * np.sin(angles) > 1)).all()


def test_a_slab_changes_no_direction(exact_renderer) -> None:
    slab = scene_of(boxes(np.array([[-5.0, -5.0, -0.5]]), np.array([[5.0, 5.0, 0.5]])))
    camera = Camera((0.3, 0.2, 4.0), (0.0, 0.0, 0.0), fov=40)
    with rt.Tracer(slab) as tracer:
        found, kind = Refraction(tracer, smooth=False).draw(camera, SIZE)
    _, directions = camera.rays(SIZE)
    assert (kind == LEFT).all()
    assert np.abs(found - directions).max() < 1e-5


def test_total_reflection_agrees_with_the_reference(precise_renderer) -> None:
    """With an index below 1, the front of the ball totally reflects rays at grazing angles."""
    off, kind, right = errors(scene_of(ball(5000)), Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0),
                                                           fov=35), True, 0.8)
    shown = kind != 0
    assert ((kind == TOTAL) == (right == TOTAL))[shown].mean() > 0.97
    assert 0.2 < (right == TOTAL)[shown].mean() < 0.6 and np.median(off) < 2


@pytest.mark.parametrize("ior", [1.1, 1.5])
def test_a_ball(precise_renderer, ior: float) -> None:
    scene = scene_of(ball(5000))
    off, kind, right = errors(scene, Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), fov=35), True, ior)
    assert ((kind > 0) == (right > 0)).mean() > 0.995       # the silhouettes agree
    # Near the silhouette, the estimated thickness is too small and the normal at the estimated
    # exit is too steep. Image-space refraction therefore finds fewer exits than the reference.
    assert (kind == LEFT).sum() > 0.75 * (right > 0).sum()
    assert np.median(off) < 2 and np.quantile(off, 0.9) < 10


def test_a_bubble_reflects_where_no_light_enters(precise_renderer) -> None:
    """The front of a body with an index below 1 reflects totally beyond the critical angle."""
    camera, ior = Camera((0.0, 0.0, 4.0), (0.0, 0.0, 0.0), fov=35), 0.8
    with rt.Tracer(scene_of(ball(5000))) as tracer:
        found, kind = Refraction(tracer, ior).draw(camera, SIZE)
    origins, directions = (rays.reshape(-1, 3) for rays in camera.rays(SIZE))
    apart = np.linalg.norm(np.cross(origins, directions), axis=1).reshape(kind.shape)
    assert np.abs(np.linalg.norm(found[kind > 0], axis=1) - 1).max() < 1e-4
    assert (kind[(apart > ior + 0.03) & (apart < 0.97)] == TOTAL).all()
    assert (kind[apart < ior - 0.03] != TOTAL).all()


@pytest.mark.parametrize("ior", [0, -1, float("nan"), 11, "x", None])
def test_an_invalid_refractive_index_is_refused(ior: object) -> None:
    with rt.Tracer(scene_of(ball(50))) as tracer:
        with pytest.raises(rt.OptionError, match="^ior is .*; give a number from 0.1 to 10$"):
            Refraction(tracer, ior)


def test_kinds(precise_renderer) -> None:
    """If the camera looks at an edge of a box, some pixels show total reflection."""
    box = scene_of(boxes(np.array([[-1.0, -1.0, -1.0]]), np.array([[1.0, 1.0, 1.0]])))
    _, kind, right = errors(box, Camera((3.0, 0.4, 3.0), (0.0, 0.0, 0.0), fov=50), False)
    assert (right == TOTAL).any() and (kind == TOTAL).any()
    assert not (kind == UNSEEN).all()
