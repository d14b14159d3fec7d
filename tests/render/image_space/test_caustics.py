"""Caustics mapping is compared with mirrored lights, with Snell's law for a slab, and with traced
photons."""
from __future__ import annotations

import numpy as np
import pytest

import gpgpu_rt as rt
from gpgpu_rt.render.image_space.caustics import Caustics, is_closed
from gpgpu_rt.render.image_space.visible import Visible
from gpgpu_rt.scene.procedural.shapes import ball, boxes, floor, quad

GREY = rt.Material("grey", (0.7, 0.7, 0.7))
SIZE = (96, 64)


def scene_of(part: np.ndarray, material: rt.Material, *others: np.ndarray) -> rt.Scene:
    """Return a scene: a refractor over a grey floor at y = 0, and other grey triangles."""
    parts = [floor((-6, -6), (6, 6), 0.0, 3), *others, part]
    corners = np.concatenate(parts).reshape(-1, 3)
    rows = np.zeros(len(corners) // 3, int)
    rows[-len(part):] = 1
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3), lights=(),
                                materials=(GREY, material), material_of=rows, environment=None,
                                camera=rt.Camera((0.0, 1.6, 6.0), (0.0, 0.2, 0.0), fov=35))


def glass(ior: float) -> rt.Material:
    return rt.Material("glass", ior=ior)


SPHERE = ball(3000, (0.0, 1.3, 0.0))[:, ::-1]      # reversed, because `ball` faces inwards
SLAB = boxes((-1.0, 0.8, -1.0), (1.0, 1.2, 1.0))


def direct(seen: Visible, light: np.ndarray) -> np.ndarray:
    """Return (h, w) irradiance of an unoccluded light of one watt per steradian."""
    to = light - seen.places
    return (to * seen.normals).sum(2) / np.linalg.norm(to, axis=2) ** 3


@pytest.mark.parametrize("seed", [1, 2, 3], ids="seed{}".format)
@pytest.mark.parametrize("way", ["searched", "traced"])
def test_glass_of_air_casts_light_as_if_it_were_not_there(way: str, seed: int) -> None:
    """Light through glass of index 1 equals direct light. This checks the units, the areas, and
    the images of the two cameras at the light."""
    light = np.array([0.0, 5.0, 0.0]) + np.random.default_rng(seed).uniform(-1, 1, 3)
    with rt.Tracer(scene_of(SPHERE, glass(1.0))) as tracer:
        caustics = Caustics(tracer, light, photons=128, resolution=96, iterations=6)
        landed = caustics.traced() if way == "traced" else None
        found = caustics.draw(size=SIZE, landed=landed)
        seen = Visible.of(tracer, None, SIZE)
        expected = direct(seen, light)
        lit = np.pad(found > 0, 2)
        inner = np.all([lit[y:y + SIZE[1], x:x + SIZE[0]] for y in range(5) for x in range(5)],
                       axis=0)     # leave out the rim, because splats blur it
        ratio = found[inner] / expected[inner]
        caustics.release()
    assert inner.sum() > 20
    assert abs(np.median(ratio) - 1) < 0.01 and abs(ratio.mean() - 1) < 0.03


@pytest.mark.parametrize("seed", [1, 2], ids="seed{}".format)
def test_a_mirror_lights_like_the_light_behind_it(seed: int) -> None:
    """Photons from an upright flat mirror land as if they came from the light's mirror image."""
    light = np.array([0.4, 2.0, 1.5]) + np.random.default_rng(seed).uniform(-0.3, 0.3, 3)
    upright = quad((-1.0, 0.3, -1.5), (1.0, 0.3, -1.5), (1.0, 1.8, -1.5), (-1.0, 1.8, -1.5))
    image = light * (1, 1, -1) + (0, 0, -3.0)
    with rt.Tracer(scene_of(upright, rt.Material("mirror", mirror=(0.8,) * 3))) as tracer:
        caustics = Caustics(tracer, light, photons=96, resolution=384, spread=6, iterations=30)
        for landed, off in ((caustics.landings(), 0.06), (caustics.traced(), 1e-4)):
            some = landed[:, :, 3] > 0
            assert some.mean() > 0.1
            place = landed[some][:, :3]
            _, ways = caustics.camera.rays((96, 96))
            ways = ways[some] * (1, 1, -1)
            expected = image - ways * (image[1] / ways[:, 1])[:, None]
            assert np.median(np.linalg.norm(place - expected, axis=1)) < off
        assert caustics.borders == 0
        flux = caustics.landings()[:, :, 3]
        caustics.reflectance = 0.4
        assert np.allclose(caustics.landings()[:, :, 3], flux / 2)
        caustics.release()


def landed_after(caustics: Caustics, iterations: int) -> np.ndarray:
    """Return where photons land after the given number of search iterations."""
    caustics.iterations = iterations
    return caustics.landings()


@pytest.mark.parametrize("ior", [1.2, 1.5, 2.0])
def test_photons_through_a_slab(ior: float) -> None:
    """Photons land where Snell's law shifts them, and lose light at both borders by Fresnel's
    law."""
    light = np.array([0.2, 6.0, 0.1])
    with rt.Tracer(scene_of(SLAB, glass(ior))) as tracer:
        caustics = Caustics(tracer, light, photons=64, resolution=256, smooth=False,
                            iterations=8)
        _, ways = caustics.camera.rays((64, 64))
        top = light + ways * ((1.2 - light[1]) / ways[:, :, 1])[:, :, None]
        within = (np.abs(top[:, :, [0, 2]]) < 0.8).all(axis=2)
        sine = np.sqrt(1 - ways[:, :, 1] ** 2)
        inside = sine / ior / np.sqrt(1 - (sine / ior) ** 2)
        flat = ways[:, :, [0, 2]] / np.maximum(sine, 1e-9)[:, :, None]
        expected = top[:, :, [0, 2]] + flat * \
            (0.4 * inside + 0.8 * sine / -ways[:, :, 1])[..., None]
        share = 1 - ((ior - 1) / (ior + 1)) ** 2         # transmitted along the normal
        full = None
        for landed, off in ((caustics.traced(), 1e-4), (caustics.landings(), 0.02)):
            there = within & (landed[:, :, 3] > 0)
            assert there.sum() > 0.97 * within.sum()
            apart = np.linalg.norm(landed[:, :, [0, 2]] - expected, axis=2)[there]
            assert np.median(apart) < off and np.quantile(apart, 0.9) < 3 * off
            assert np.median(np.abs(landed[:, :, 1][there])) < 0.005      # on the floor
            middle = landed[31:33, 31:33, 3].mean()
            full = full or middle
            assert middle == pytest.approx(full, rel=1e-3)
        solid = 4 * np.tan(np.radians(caustics.camera.fov / 2)) ** 2 / 64 ** 2
        assert full == pytest.approx(solid * share ** 2, rel=5e-3)
        caustics.release()


def test_level_water_is_not_closed_and_refracts_once() -> None:
    """A level water surface without sides is not closed, so it refracts light once. A closed body
    refracts light twice."""
    water = floor((-2, -2), (2, 2), 1.0, 4)
    assert not is_closed(water) and is_closed(SPHERE) and is_closed(SLAB)
    light = np.array([2.5, 3.5, 0.3])
    with rt.Tracer(scene_of(water, glass(1.33))) as tracer:
        caustics = Caustics(tracer, light, photons=48, resolution=256, smooth=False,
                            iterations=8)
        assert caustics.borders == 1
        for landed, off in ((caustics.landings(), 0.03), (caustics.traced(), 1e-4)):
            some = landed[:, :, 3] > 0
            assert some.mean() > 0.2
            _, ways = caustics.camera.rays((48, 48))
            sine = np.sqrt(1 - ways[some][:, 1] ** 2)
            top = light + ways[some] * (-2.5 / ways[some][:, 1])[:, None]
            moved = np.linalg.norm(landed[some][:, [0, 2]] - top[:, [0, 2]], axis=1)
            inside = sine / 1.33
            assert np.median(np.abs(moved - inside / np.sqrt(1 - inside ** 2))) < off
        truth = caustics.traced()
        apart = [np.median(np.linalg.norm(landed_after(caustics, n) - truth, axis=2)[some])
                 for n in (1, 2, 8)]
        assert apart[0] > 1.5 * apart[1] > 1.5 * apart[2], apart       # iterations converge
        caustics.release()


@pytest.mark.parametrize("splat", [1, 3, 5])
def test_no_light_is_lost_in_the_map(splat: int) -> None:
    with rt.Tracer(scene_of(SPHERE, glass(1.5))) as tracer:
        caustics = Caustics(tracer, (0.3, 6.0, 0.2), photons=64, resolution=128, spread=4,
                            splat=splat)
        landed = caustics.landings()
        assert caustics.map().sum() == pytest.approx(landed[:, :, 3].sum(), rel=1e-4)
        assert (caustics.map() == caustics.map(landed)).all()
        caustics.release()


def test_a_ball_is_a_lens() -> None:
    """A glass ball concentrates light: its caustic is over five times as bright as direct
    light."""
    with rt.Tracer(scene_of(SPHERE, glass(1.5))) as tracer:
        light = np.array([0.3, 6.0, 0.2])
        caustics = Caustics(tracer, light, photons=96, resolution=256)
        found, truth = caustics.landings(), caustics.traced()
        both = (found[:, :, 3] > 0) & (truth[:, :, 3] > 0)
        assert np.median(np.linalg.norm(found - truth, axis=2)[both]) < 0.06
        assert truth[both][:, 3].sum() > 0.75 * truth[:, :, 3].sum()
        brightest = caustics.draw(size=SIZE).max()
        caustics.release()
    unturned = 1 / 36
    assert brightest > 5 * unturned


def test_a_lid_between_light_and_refractor_blocks_all_photons() -> None:
    lid = floor((-2, -2), (2, 2), 4.0)
    with rt.Tracer(scene_of(SPHERE, glass(1.5), lid)) as tracer:
        caustics = Caustics(tracer, (0.3, 6.0, 0.2), photons=32, resolution=64)
        assert not caustics.landings().any() and not caustics.map().any()
        assert not caustics.traced().any()
        caustics.release()


@pytest.mark.parametrize("part, material, more, message", [
    (SPHERE, rt.Material("white", (1, 1, 1)), {}, "no material is a dielectric or a mirror"),
    (SPHERE[:, ::-1], glass(1.5), {}, "face inwards"),
    (SPHERE, glass(1.5), {"light": (0, 1.3, 0.9)}, "too near the refractor, .* 1 around"),
    (SPHERE, glass(1.5), {"spread": 0.5}, "spread is 0.5"),
    (SPHERE, glass(1.5), {"spread": "a"}, "spread is 'a'; give a number"),
    (SPHERE, glass(1.5), {"iterations": None}, "iterations is None; give a whole number"),
    (SPHERE, glass(1.5), {"photons": 0}, "photons is 0"),
    (SPHERE, glass(1.5), {"photons": 2.5}, "photons is 2.5; give a whole number"),
    (SPHERE, glass(1.5), {"splat": 10 ** 6}, "splat is 1000000; give at most"),
    (SPHERE, glass(1.5), {"light": (0, 6)}, r"light is at \(0, 6\); give three"),
    (SPHERE, glass(1.5), {"light": (0, np.inf, 0)}, "give three finite")])
def test_mistakes(part, material, more: dict, message: str) -> None:
    with rt.Tracer(scene_of(part, material)) as tracer:
        with pytest.raises(rt.Error, match=message):
            Caustics(tracer, **{"light": (0, 6, 0), **more})


def test_the_widest_splat_loses_no_light_and_wrong_shapes_are_refused() -> None:
    with rt.Tracer(scene_of(SPHERE, glass(1.5))) as tracer:
        largest = int(tracer.gpu.context.info["GL_POINT_SIZE_RANGE"][1])
        with pytest.raises(rt.OptionError, match=f"at most {largest}, "):
            Caustics(tracer, (0, 6, 0), photons=4, splat=largest + 1)
        caustics = Caustics(tracer, (0, 6, 0), photons=4, resolution=2 * largest, splat=largest)
        landed = np.zeros((4, 4, 4), np.float32)
        landed[1, 2] = 0, 0, 0, 1       # right below the light, in the middle of its view
        assert caustics.map(landed).sum() == pytest.approx(1, rel=1e-3)
        for wrong in (landed[:3], landed[:, :, :3], landed[0]):
            with pytest.raises(rt.OptionError, match="landed has the shape"):
                caustics.map(wrong)
        caustics.release()


@pytest.mark.parametrize("places, normals", [
    ((5, 3), (5, 3)), ((4, 5, 3), (5, 3)), ((4, 5, 2), (4, 5, 2)), ((0, 5, 3), (0, 5, 3))])
def test_places_that_are_no_image_are_refused(places: tuple, normals: tuple) -> None:
    with rt.Tracer(scene_of(SPHERE, glass(1.5))) as tracer:
        caustics = Caustics(tracer, (0, 6, 0), photons=4, resolution=4)
        with pytest.raises(rt.OptionError, match="places and normals have the shapes .* give"):
            caustics.look(np.zeros(places), np.zeros(normals))
        caustics.release()


def test_two_kinds_of_glass_are_refused() -> None:
    scene = scene_of(SPHERE, glass(1.5))
    scene.materials = (rt.Material("water", ior=1.33), scene.materials[1])
    with rt.Tracer(scene) as tracer:
        with pytest.raises(rt.SceneError, match="glass, water turn light differently"):
            Caustics(tracer, (0, 6, 0))
