"""The light of ray bundles is compared with form factors, with traced rays, and with the known
light in a furnace (a closed box that emits everywhere).

A ray bundle consists of parallel rays. Depth peeling of a parallel projection finds all hits of
the rays: layer k holds each ray's k-th hit.
"""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.gl.textures import release
from gpgpu_rt.render.image_space import visible
from gpgpu_rt.render.image_space.patches import LIFT, areas_and_normals, divided, straight_light
from gpgpu_rt.render.image_space.ray_bundles import RayBundles, half_sphere
from gpgpu_rt.render.image_space.visible import Visible
from gpgpu_rt.scene.procedural.shapes import ball, boxes, quad

INSIDE = rt.Camera((0.3, 0.1, 0.5), (0.0, 0.1, -1.0), fov=90)


def scene_of(triangles: np.ndarray, *materials: rt.Material, rows: object = None,
             **more: object) -> rt.Scene:
    corners = np.asarray(triangles).reshape(-1, 3)
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3), **{
        "materials": materials, "material_of": rows, "lights": (), "environment": None, **more})


def test_half_sphere() -> None:
    """The means of z, z^2, x and y over the directions equal the means over a half sphere."""
    d = half_sphere(200)
    assert np.allclose(np.linalg.norm(d, axis=1), 1) and (d[:, 2] > 0).all()
    assert np.allclose([d[:, 2].mean(), (d[:, 2] ** 2).mean()], [1 / 2, 1 / 3], atol=1e-3)
    assert np.abs(d[:, :2].mean(0)).max() < 0.01


@pytest.mark.parametrize("seed", [1, 2, 3], ids="seed{}".format)
def test_triangles_are_cut_evenly(seed: int) -> None:
    whole = np.random.default_rng(seed).normal(size=(20, 3, 3))
    parts, parents = divided(whole, 0.8)
    area, normal = areas_and_normals(parts)
    whole_area, whole_normal = areas_and_normals(whole)
    counts = np.bincount(parents, minlength=20)
    assert np.allclose(area, (whole_area / counts)[parents], rtol=1e-4)
    assert ((normal * whole_normal[parents]).sum(1) > 0.999).all()
    assert np.linalg.norm(parts - np.roll(parts, 1, axis=1), axis=2).max() < 0.8 * 1.0001
    assert (np.sqrt(counts) % 1 == 0).all() and counts.max() > 4


@pytest.mark.parametrize("albedo, bounces", [(0.0, 0), (0.5, 3), (0.8, 6)])
def test_a_furnace(albedo: float, bounces: int) -> None:
    """In a closed box that emits everywhere, each bounce adds albedo times the light of the
    previous bounce."""
    white = rt.Material("white", (albedo,) * 3, emission=(1, 2, 4))
    scene = scene_of(boxes((-1, -1, -1), (1, 1, 1)), white, camera=INSIDE)
    with rt.Tracer(scene) as tracer:
        bundles = RayBundles(tracer, 0.25, 48, "bundles")
        inside = bundles.solve(24, bounces)[:, 1]   # side 1 faces inwards
        # The sum of albedo^k: emission is k = 0, direct light is k = 1, and bounces follow.
        expected = (1 - albedo ** (bounces + 2)) / (1 - albedo)
        off = np.abs(inside / (expected * np.array([1, 2, 4])) - 1).max(axis=1)
        assert np.median(off) < 1e-4 and off.max() < 0.02    # edges of patches are less exact
        assert abs(bundles.weights.mean() / np.pi - 1) < 0.01
        assert bundles.layers == 2
        shown = bundles.draw(size=(24, 20), directions=40)
        bundles.release()
    expected = 1 + albedo * expected
    right = np.abs(shown / (expected * np.array([1, 2, 4])) - 1).max(axis=2)
    assert np.median(right) < 1e-3
    assert right.max() < 0.4 and (right > 0.1).mean() < 0.05     # some pixels straddle an edge


def test_a_ball_under_a_white_sky() -> None:
    """Only the sky lights a convex body, and lights it evenly. Pixels without a hit gather no
    light."""
    grey = rt.Material("grey", (0.6, 0.5, 0.4))
    scene = scene_of(ball(800)[:, ::-1], grey, environment=rt.Environment.constant((2, 2, 2)))
    with rt.Tracer(scene) as tracer:
        bundles = RayBundles(tracer, 0.2, 64)
        out = bundles.solve(32, 0)[:, 0]
        met = bundles.weights[:, 0] > 0
        assert met.mean() > 0.98
        off = np.abs(out[met] / (2 * np.array([0.6, 0.5, 0.4])) - 1).max(axis=1)
        assert np.median(off) < 1e-5 and (off < 0.02).mean() > 0.9    # outlines have errors
        seen = Visible.of(tracer, None, (24, 24))
        hit = seen.hits.hit.reshape(24, 24)
        light = bundles.gather(seen.places, seen.normals, 48)
        assert np.median(light[hit]) == pytest.approx(2 * np.pi, rel=5e-3)
        assert not light[~hit].any()
        bundles.release()


def test_a_plate_under_a_sky_that_darkens() -> None:
    """A sky has the radiance (1 + y) / 2 in the direction (x, y, z). A level plate then has an
    irradiance of pi (1/2 + 1/3) from above and pi (1/2 - 1/3) from below."""
    plate = quad((-1, 0, -1), (-1, 0, 1), (1, 0, 1), (1, 0, -1))          # faces up
    scene = scene_of(plate, rt.Material("grey", (0.5,) * 3),
                     environment=rt.Environment.sky((1, 1, 1), (0, 0, 0)))
    with rt.Tracer(scene) as tracer:
        bundles = RayBundles(tracer, 0.5, 64)
        expected = np.pi * np.array([5 / 6, 1 / 6])
        assert np.allclose(bundles.solve(64, 0)[:, :, 0] * np.pi / 0.5, expected, rtol=0.05)
        places = np.zeros((1, 2, 3)) + (0.3, 0, 0.2)
        normals = np.array([[[0, 1, 0], [0, -1, 0]]])
        assert np.allclose(bundles.gather(places, normals, 256)[0, :, 0], expected, rtol=0.01)
        bundles.release()


@pytest.mark.parametrize("distance, factor", [(0.5, 0.41525), (1.0, 0.19982), (2.0, 0.06859)])
def test_form_factor_of_squares(distance: float, factor: float) -> None:
    """Two unit squares that face each other have a form factor with a known closed form."""
    a, b = 1 / distance, 1 / distance
    x, y = np.sqrt(1 + a * a), np.sqrt(1 + b * b)
    closed = 2 / (np.pi * a * b) * (
        np.log(x * y / np.sqrt(1 + a * a + b * b)) + 2 * a * y * np.arctan(a / y)
        - 2 * a * np.arctan(a))
    assert closed == pytest.approx(factor, abs=1e-4)
    lamp, black = rt.Material("lamp", (0, 0, 0), emission=(1, 1, 1)), rt.Material("w", (1, 1, 1))
    squares = np.concatenate([
        quad((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)),
        quad((0, 0, distance), (1, 0, distance), (1, 1, distance), (0, 1, distance))])
    scene = scene_of(squares, lamp, black, rows=[0, 0, 1, 1])
    with rt.Tracer(scene) as tracer:
        for straight in ("bundles", "traced"):
            bundles = RayBundles(tracer, 0.12, 96, straight)
            out = bundles.solve(192, 0)[:, :, 0]
            lit = bundles.parent >= 2
            area, _ = areas_and_normals(bundles.triangles)
            mean = (out.sum(1) * area)[lit].sum() / area[lit].sum()
            assert mean == pytest.approx(factor, rel=0.03), straight
            assert bundles.layers == (2 if straight == "bundles" else 0)
            bundles.release()


@pytest.mark.parametrize("count", [1, 3, 6])
def test_layers_are_all_peeled(count: int) -> None:
    """A pile of sheets has as many layers as sheets. The last pass of the peeling finds no
    surface, and does not count as a layer."""
    sheet = quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
    pile = np.concatenate([sheet + (0, 0, 0.1 * k) for k in range(count)])
    scene = scene_of(pile, rt.Material("black", (0, 0, 0)),
                     environment=rt.Environment.constant((1, 1, 1)))
    with rt.Tracer(scene) as tracer:
        bundles = RayBundles(tracer, 1.0, 48)
        bundles.solve(16, 0)
        assert bundles.layers == count
        bundles.release()


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
def test_gathered_light_equals_the_light_of_traced_rays(seed: int) -> None:
    """Light at visible points is gathered in two ways: from the layers of ray bundles, and by
    traced rays in the same directions. The results are almost equal, except at a few pixels."""
    rng = np.random.default_rng(seed)
    things = boxes(*np.sort(rng.uniform(-0.8, 0.8, (2, 4, 3)), axis=0))
    scene = scene_of(np.concatenate([boxes((-1, -1, -1), (1, 1, 1)), things]),
                     rt.Material("white", (0.5,) * 3), camera=INSIDE)
    with rt.Tracer(scene) as tracer:
        bundles = RayBundles(tracer, 0.3, 256, "bundles")
        bundles.leave(rng.uniform(0.2, 1, (len(scene), 2, 3))[bundles.parent])
        seen = Visible.of(tracer, None, (20, 16))
        found = bundles.gather(seen.places, seen.normals, 24)
        expected = traced_gather(bundles, seen, 24)
        bundles.release()
    off = np.abs(found - expected).max(axis=2) / expected.mean()
    assert np.median(off) < 0.02 and (off < 0.15).mean() > 0.95


def traced_gather(bundles: RayBundles, seen: Visible, count: int) -> np.ndarray:
    """Return (h, w, 3), the light that traced rays in ``count`` directions gather."""
    cut = scene_of(bundles.triangles, rt.Material())
    normals = seen.normals.reshape(-1, 3)
    start = seen.places.reshape(-1, 3) + LIFT * bundles.scene.extent * normals
    sums, weights = np.zeros((len(start), 3)), np.zeros((len(start), 1))
    with rt.Tracer(cut) as tracer:
        for along in half_sphere(count):
            facing = (normals * along).sum(1)
            ways = np.where(facing[:, None] > 0, along, -along)
            hits = tracer.trace(start, ways)
            corners = bundles.triangles[hits.triangle]
            _, flat = areas_and_normals(corners)
            side = ((flat * ways).sum(1) > 0).astype(int)
            light = bundles.leaving[hits.triangle, side] * hits.hit[:, None]
            sums += light * np.abs(facing)[:, None]
            weights += np.abs(facing)[:, None]
    return (np.pi * sums / np.maximum(weights, 1e-30)).reshape(seen.places.shape)


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
def test_light_straight_from_a_small_lamp(seed: int) -> None:
    """A small lamp lights like a point whose intensity falls with the cosine of the angle to the
    lamp's normal. A screen blocks this light."""
    rng = np.random.default_rng(seed)
    side, high = 0.02, 1.5
    lamp = quad((0, high, 0), (side, high, 0), (side, high, side), (0, high, side))
    screen = quad((-9, 0.7, -9), (0.3, 0.7, -9), (0.3, 0.7, 9), (-9, 0.7, 9))
    scene = scene_of(np.concatenate([lamp, screen]),
                     rt.Material("lamp", (0, 0, 0), emission=(5, 3, 1)), rt.Material("w"),
                     rows=[0, 0, 1, 1])
    places = np.column_stack([rng.uniform(0.7, 2, 40), np.zeros(40), rng.uniform(-1, 1, 40)])
    hidden = places - (3, 0, 0)
    up = np.tile([0.0, 1.0, 0.0], (40, 1))
    with rt.Tracer(scene) as tracer:
        found = straight_light(tracer, places, up)
        assert not straight_light(tracer, hidden, up).any()
        assert not straight_light(tracer, places, -up).any()
    square = ((places - (side / 2, high, side / 2)) ** 2).sum(1)
    expected = side ** 2 * high ** 2 / square ** 2
    assert np.allclose(found / expected[:, None], [5, 3, 1], rtol=0.03)


@pytest.mark.parametrize("more, message", [
    ({"straight": "rays"}, "none of traced, bundles"), ({"patch": 0.0}, "patch is 0.0"),
    ({"resolution": 2}, "resolution is 2"), ({"samples": 0}, "samples is 0"),
    ({"patch": "a"}, "patch is 'a'; give a number"), ({"samples": "a"}, "samples is 'a'; give"),
    ({"resolution": 64.5}, "resolution is 64.5; give a whole number"),
    ({"patch": 1e-4}, r"[\d,]+ patches have more than 2\^24 sides; make patch larger")])
def test_mistakes(more: dict, message: str) -> None:
    with rt.Tracer("cornell") as tracer:
        with pytest.raises(rt.Error, match=message):
            RayBundles(tracer, **more)


@pytest.mark.parametrize("more", [{"directions": 8.5}, {"directions": "a"}, {"bounces": 1.5}])
def test_directions_and_bounces_are_whole_numbers(more: dict) -> None:
    with rt.Tracer("cornell") as tracer:
        bundles = RayBundles(tracer, 0.5, 8)
        with pytest.raises(rt.OptionError, match="is .*; give a whole number from"):
            bundles.solve(**{"directions": 2, "bounces": 0, **more})
        bundles.release()


def test_an_interrupted_gathering_frees_its_textures(monkeypatch) -> None:
    with rt.Tracer("cornell") as tracer:
        bundles, freed = RayBundles(tracer, 0.5, 8), []
        monkeypatch.setattr(visible, "release", freed.append)
        monkeypatch.setattr(bundles, "_bundles", lambda directions: 1 / 0)
        with pytest.raises(ZeroDivisionError):
            bundles.gather(np.zeros((2, 2, 3)), np.zeros((2, 2, 3)), 2)
        assert [len(made) for made in freed] == [4]
        monkeypatch.undo()
        release(freed)
        bundles.release()


def test_a_material_that_is_not_diffuse_is_refused() -> None:
    with rt.Tracer(scene_of(ball(50), rt.Material("glass", ior=1.5))) as tracer:
        with pytest.raises(rt.SceneError, match="material glass is not purely diffuse"):
            RayBundles(tracer)
