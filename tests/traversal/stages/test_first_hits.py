"""Rasterised first hits equal traced hits to the bit, whatever the rasteriser does at edges."""
from __future__ import annotations

import json

import numpy as np
import pytest
from conftest import assert_same_bits, random_soup, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.cli import main
from gpgpu_rt.scene.camera import Camera
from gpgpu_rt.traversal.stages import first_hits as module

SIZE = (90, 61)


def scene_of(triangles: np.ndarray, name: str = "soup") -> rt.Scene:
    corners = np.asarray(triangles, np.float32).reshape(-1, 3)
    return rt.Scene.from_arrays(corners, np.arange(len(corners)).reshape(-1, 3), name=name)


def slivers(count: int, seed: int) -> np.ndarray:
    """Return narrow triangles, (count, 3, 3), with widths from about 1e-9 to 0.1. Many of these
    triangles cross the view."""
    random = np.random.default_rng(seed)
    start, way = random.uniform(-0.5, 0.5, (2, count, 3))
    width = 10.0 ** random.uniform(-9, -1, (count, 1)) * random.normal(size=(count, 3))
    at = random.choice([0.0, 0.5, 1.0], (count, 1))
    return np.stack([start, start + way, start + at * way + width], axis=1)


def fans(count: int, seed: int) -> np.ndarray:
    """Return pyramids without a base, which have many silhouette edges. Some pyramids are smaller
    than a pixel, and others are much larger."""
    random = np.random.default_rng(seed)
    centre = random.uniform(-0.5, 0.5, (count, 1, 3))
    rim = centre + 10.0 ** random.uniform(-3.5, -0.5, (count, 1, 1)) * random.normal(
        size=(count, 5, 3))
    return np.stack([np.broadcast_to(centre, rim.shape), rim, np.roll(rim, 1, axis=1)],
                    axis=2).reshape(-1, 3, 3)


def layers(count: int, seed: int) -> np.ndarray:
    """Return triangles in a few parallel planes. Some triangles occur twice. The depths of many
    triangles are equal, or differ by a rounding error."""
    random = np.random.default_rng(seed)
    flat = random_soup(count, seed, 0.5)
    flat[:, :, 2] = random.choice([0.5, 0.5 + 1e-7, 0.5 - 6e-8, 0.3], (count, 1))
    return np.concatenate([flat, flat[::-2]])


def around_the_eye(count: int, seed: int) -> np.ndarray:
    """Return large triangles around the eye. Many triangles reach behind the eye, and some pass
    close to the eye."""
    random = np.random.default_rng(seed)
    return random.normal(size=(count, 3, 3)) * 10.0 ** random.uniform(-1, 0.5, (count, 1, 1))


SHAPES = {"slivers": slivers, "fans": fans, "layers": layers,
          "soup": lambda count, seed: random_soup(count, seed, 0.2),
          "around": around_the_eye}


def look_at(scene: rt.Scene, seed: int, inside: bool) -> Camera:
    random = np.random.default_rng(seed)
    lo, hi = scene.bounds
    target = (lo + hi) / 2
    way = random.normal(size=3)
    way /= np.linalg.norm(way)
    away = np.linalg.norm(hi - lo) * (0.2 if inside else random.uniform(0.5, 1.5))
    return Camera(tuple(target + away * way), tuple(target), fov=random.choice([3.0, 50.0, 120.0]))


@pytest.mark.parametrize("inside", [False, True], ids=["outside", "inside"])
@pytest.mark.parametrize("seed", [1, 2, *(pytest.param(s, marks=pytest.mark.full)
                                          for s in range(3, 30))], ids="seed{}".format)
@pytest.mark.parametrize("shape", SHAPES)
def test_hits_are_the_same(precise_renderer, monkeypatch, shape: str, seed: int,
                           inside: bool) -> None:
    monkeypatch.setattr(module, "MOST_IN_DOUBT", 1.0)   # never trace all rays
    scene = scene_of(SHAPES[shape](300, seed))
    camera = look_at(scene, seed, inside)
    if shape == "around":
        camera = Camera((0.0, 0.0, 0.0), camera.target, fov=camera.fov)
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.eye_hits(camera, SIZE)
        hits = tracer.eye_hits(camera, SIZE, first_hits="rasterised")
        assert_same_bits(hits, expected)
        if shape in ("soup", "slivers", "fans"):
            assert tracer.statistics.first_hits["retraced_share"] < 0.5


@pytest.mark.parametrize("row", [pytest.param(row, id=row.name) for row in rt.methods()])
def test_every_method_traces_the_rays_in_doubt(precise_renderer, row: rt.Method) -> None:
    """Every method traces only the rays whose rasterised hit is in doubt. These rays are few."""
    scene = scene_of(np.concatenate([fans(12, 5), layers(20, 5)]))
    with rt.Tracer(scene, row.name, statistics=True) as tracer:
        expected = tracer.eye_hits(size=SIZE)
        for _ in range(2):     # the second call reuses the textures of the first
            hits = tracer.eye_hits(size=SIZE, first_hits="rasterised")
            assert_same_bits(hits, expected)
            assert (hits.status == expected.status).all()
        found = tracer.statistics.first_hits
        assert 0 < found["retraced"] < 0.1 * SIZE[0] * SIZE[1]
        assert (hits.steps > 0).sum() <= found["retraced"]     # other rays take no steps


@pytest.mark.parametrize("shape", ["fans", "slivers", "soup"])
def test_verified_hits_are_true_hits(precise_renderer, shape: str) -> None:
    """With first_hits="verified", each reported hit is a true hit of its ray, and nearly all of
    these hits are the first hits."""
    scene = scene_of(SHAPES[shape](200, 4))
    with rt.Tracer(scene, "brute-force") as tracer:
        expected = tracer.eye_hits(size=SIZE)
        hits = tracer.eye_hits(size=SIZE, first_hits="verified")
        assert tracer.statistics.first_hits["rivals"] == 0
        proved = tracer.eye_hits(size=SIZE, first_hits="rasterised")     # on the same tracer
        assert_same_bits(proved, expected)
    wrong = hits.t != expected.t
    assert wrong.sum() < 0.01 * len(hits) and (hits.t[wrong] > expected.t[wrong]).all()


def test_pictures_are_the_same(precise_renderer) -> None:
    with rt.Tracer(soup_scene(80, 7)) as tracer:
        pictures = [np.asarray(tracer.render(size=SIZE, first_hits=kind))
                    for kind in ("traced", "rasterised")]
        assert (pictures[0] == pictures[1]).all()
        tracer.update(tracer.scene.triangles[:, :, ::-1])
        moved = [np.asarray(tracer.render(size=SIZE, first_hits=kind))
                 for kind in ("rasterised", "traced")]
        assert (moved[0] == moved[1]).all() and (moved[0] != pictures[0]).any()


@pytest.mark.parametrize("size", [(1, 1), (3, 200), (8, 8), (65, 7)], ids="{0[0]}x{0[1]}".format)
def test_sizes(precise_renderer, size: tuple[int, int]) -> None:
    with rt.Tracer(scene_of(fans(60, 2)), "bvh-packet") as tracer:
        assert_same_bits(tracer.eye_hits(size=size, first_hits="rasterised"),
                         tracer.eye_hits(size=size))


@pytest.mark.parametrize("scale", [1e-12, 1e-3, 1e6], ids="x{:g}".format)
@pytest.mark.parametrize("away", [0.0, 30.0], ids="away{:g}".format)
def test_scales(precise_renderer, scale: float, away: float) -> None:
    """Scenes are small, large or far from zero. At the scale 1e-12, no error bound is known, so
    all rays are traced."""
    scene = scene_of((fans(60, 3) + away) * scale)
    with rt.Tracer(scene, "brute-force") as tracer:
        assert_same_bits(tracer.eye_hits(size=SIZE, first_hits="rasterised"),
                         tracer.eye_hits(size=SIZE))
        share = tracer.eye_hits(size=SIZE, first_hits="rasterised") and (
            tracer.statistics.first_hits["retraced_share"])
        assert share == 1 if scale == 1e-12 else share < 0.2


def test_a_far_eye_is_traced(precise_renderer) -> None:
    scene = soup_scene(30, 1)
    camera = Camera((0.0, 0.0, 500.0), (0.5, 0.5, 0.5), fov=0.2)
    with rt.Tracer(scene) as tracer:
        assert_same_bits(tracer.eye_hits(camera, SIZE, first_hits="rasterised"),
                         tracer.eye_hits(camera, SIZE))
        empty = rt.Tracer(scene_of(np.zeros((0, 3, 3))))
        assert not empty.eye_hits(size=SIZE, first_hits="rasterised").hit.any()


def test_parts_are_cut(precise_renderer, monkeypatch) -> None:
    """With the limit MOST_PIXELS = 1, the search for pixels that a triangle hits first is split
    into parts of the image. No side of the image is a multiple of a part's side."""
    monkeypatch.setattr(module, "MOST_PIXELS", 1)
    scene = scene_of(fans(40, 9))
    with rt.Tracer(scene, "brute-force") as tracer:
        assert_same_bits(tracer.eye_hits(size=SIZE, first_hits="rasterised"),
                         tracer.eye_hits(size=SIZE))


def test_other_tests_and_precisions_are_refused() -> None:
    with rt.Tracer(soup_scene(3, 1), intersection="plucker") as tracer:
        with pytest.raises(rt.Error, match="intersection=woop-watertight only, not plucker"):
            tracer.render(size=(8, 8), first_hits="rasterised")
    with rt.Tracer(soup_scene(3, 1), storage="fp16") as tracer:
        with pytest.raises(rt.Error, match="storage=fp32"):
            tracer.render(size=(8, 8), first_hits="rasterised")
        with pytest.raises(rt.Error, match="is none of traced, rasterised"):
            tracer.render(size=(8, 8), first_hits="raster")


def test_command(tmp_path, capsys) -> None:
    words = ["render", "cornell", "--size", "64x64", "--first-hits", "rasterised", "-o",
             str(tmp_path / "a.png")]
    assert main(words) == 0
    assert "first hits rasterised; " in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["statistics"]["first_hits"]
    assert found["retraced_share"] == found["retraced"] / 64 ** 2 < 0.05


def test_rays_beside_the_centres_are_refused() -> None:
    """Rays that miss the centres of pixels, as in path tracing, cannot have rasterised hits."""
    with rt.Tracer(soup_scene(3, 1)) as tracer:
        with pytest.raises(rt.Error, match="integrator path .* give first_hits=traced"):
            tracer.render(size=(8, 8), integrator="path", first_hits="rasterised")


def test_statistics_log_what_the_rasteriser_draws() -> None:
    with rt.Tracer("cornell", statistics=True, rasterised_bounds=8) as tracer:
        tracer.eye_hits(size=(16, 16), first_hits="rasterised")
        drawn = {one["name"] for one in tracer.statistics.pass_log}
        assert {"stages/first_drawn.frag", "stages/first_verified.frag"} <= drawn
        tracer.eye_hits(size=(16, 16))
        drawn = {one["name"] for one in tracer.statistics.pass_log}
        assert {"stages/depth_bounds.frag", "stages/bounded_rays.frag"} <= drawn
        origins, directions = tracer.scene.camera.rays((4, 4))
        tracer.trace_all(origins, directions)
        assert tracer.statistics.pass_log and tracer.statistics.texture_bytes


@pytest.mark.parametrize("first_hits", ["verified", "rasterised"])
@pytest.mark.parametrize("shape", ["fans", "slivers"])
def test_each_pass_is_counted(precise_renderer, shape: str, first_hits: str) -> None:
    """The statistics count the passes that an observer sees, without the pass that makes the eye
    rays. (They once counted 8 passes of the rasteriser for each picture.)"""
    with rt.Tracer(scene_of(SHAPES[shape](200, seed=1)), "bvh-threaded") as tracer:
        with tracer.observe() as passes:
            tracer.eye_hits(size=SIZE, first_hits=first_hits)
        drawn = [one for one in passes if one.label != "drivers/eye_rays.frag"]
        assert tracer.statistics.passes == len(drawn) > 2
        assert first_hits == "verified" or tracer.statistics.first_hits["rivals"] > 0
