"""Packed paths: moving the live paths into smaller textures changes no bit of the picture. Further
tests check what packing adds to the plan."""
from __future__ import annotations

import numpy as np
import path_scenes
import pytest

import gpgpu_rt as rt
from gpgpu_rt.render import packed_paths, path
from gpgpu_rt.render.packed_paths import PackedPaths, packed_sizes

# A wave is a set of paths that are traced together. With this SIZE, some of a wave's squares of
# 8 x 8 texels are incomplete.
SIZE, SAMPLES = (14, 11), 16
SCENES = {"cornell": path_scenes.cornell_lit, "everything": path_scenes.everything,
          "slab": lambda: path_scenes.glass_slab()[0]}
TRACERS = [("bvh-threaded", {}), ("bvh-threaded", {"sort_rays": True}),
           ("bvh-packet", {"packet": (4, 2), "octants": True}), ("kd-restart", {}),
           ("kd-restart", {"schedule": "step"}),
           pytest.param("kd-restart", {"schedule": "kernels"}, marks=pytest.mark.full),
           ("bvh-threaded", {"statistics": True}),
           pytest.param("bvh-threaded", {"precision": "fp16"}, marks=pytest.mark.full)]


@pytest.fixture
def small(monkeypatch) -> None:
    """Allow packed textures as small as 64 texels, which is one square."""
    monkeypatch.setattr(packed_paths, "LEAST", 64)


def pictures(scene: rt.Scene, method: str, ways: tuple[object, ...], tracer_options: dict,
             **options: object) -> list[tuple[np.ndarray, dict[str, int]]]:
    """Return the radiance and {pass: number of draws} for each value of ``compact`` in ``ways``. A
    single tracer draws all pictures."""
    found = []
    with rt.Tracer(scene, method, **tracer_options) as tracer:
        for way in ways:
            tracer.render(size=SIZE, integrator="path", samples=SAMPLES, compact=way, **options)
            found.append((tracer.radiance, dict(tracer.statistics.picture_passes)))
    return found


def check_same_bits(scene: rt.Scene, method: str, tracer_options: dict, **options: object
                    ) -> dict[str, int]:
    """Check that packing changes no bit, and return {pass: number of draws} under
    ``compact=0.5``."""
    ways = ("off", 0.5, "on", "off")
    (expected, whole), *others = pictures(scene, method, ways, tracer_options, **options)
    assert "pack paths" not in whole and "path live" not in whole and expected.any()
    for way, (radiance, drawn) in zip(ways[1:], others):
        assert (radiance == expected).all(), way
        if way != "off":
            assert drawn["pack paths"] and drawn["bring back"] and drawn["packed path vertex"]
    return others[0][1]


@pytest.mark.parametrize("method, options", TRACERS, ids=str)
def test_the_same_bits(precise_renderer, small, method: str, options: dict) -> None:
    drawn = check_same_bits(path_scenes.cornell_lit(), method, options, bounces=9)
    assert drawn["pack paths again"]


@pytest.mark.parametrize("name, sampler", [("everything", "random"), ("slab", "sobol")])
def test_the_same_bits_of_other_scenes(precise_renderer, small, name: str, sampler: str) -> None:
    check_same_bits(SCENES[name](), "bvh-threaded", {}, sampler=sampler)


@pytest.mark.full
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("method", [row.name for row in rt.methods()])
def test_the_same_bits_by_every_method(precise_renderer, small, name: str, method: str) -> None:
    check_same_bits(SCENES[name](), method, {}, bounces=9)


@pytest.mark.parametrize("least, packs", [(1 << 11, True), (1 << 12, False)])
def test_auto_packs_large_waves(precise_renderer, small, monkeypatch, least: int, packs: bool
                                ) -> None:
    monkeypatch.setattr(packed_paths, "AUTO", least)
    (expected, _), (radiance, drawn) = pictures(path_scenes.cornell_lit(), "bvh-threaded",
                                                ("off", "auto"), {})
    assert (radiance == expected).all() and ("pack paths" in drawn) == packs


@pytest.mark.parametrize("samples", [5, 37])
def test_the_same_bits_of_several_waves(precise_renderer, small, monkeypatch,
                                        samples: int) -> None:
    """Packing changes no bit, even if a picture takes several waves and the last wave has texels
    without a path."""
    monkeypatch.setattr(path, "WAVE", 8 * SIZE[0] * SIZE[1])
    found = {}
    with rt.Tracer(path_scenes.everything()) as tracer:
        for way in ("off", "on"):
            tracer.render(size=SIZE, integrator="path", samples=samples, compact=way)
            found[way] = tracer.radiance
        first = tracer.statistics.vertices[0]
    assert (found["off"] == found["on"]).all()
    assert first["live"] == samples * SIZE[0] * SIZE[1] <= first["texels"]


def test_paths_are_counted_vertex_by_vertex(precise_renderer, small) -> None:
    """Packing does not change the number of live paths. At each vertex, the textures of the
    paths have the smallest size, packed or whole, that holds all live paths."""
    counts = {}
    with rt.Tracer(path_scenes.everything()) as tracer:
        for share in (0.25, 0.75):
            tracer.render(size=SIZE, integrator="path", samples=SAMPLES, compact=share)
            counts[share] = tracer.statistics.vertices
        whole = tracer.sessions.pictures.integrator.size[0] * \
            tracer.sessions.pictures.integrator.size[1]
        tracer.render(size=SIZE, integrator="path", samples=SAMPLES, compact="off")
        assert tracer.statistics.vertices == []
    lives = [[vertex["live"] for vertex in counts[share]] for share in counts]
    assert lives[0] == lives[1] and sorted(lives[0], reverse=True) == lives[0] and lives[0][-1] > 0
    for share, vertices in counts.items():
        sizes = [whole] + [w * h for w, h in packed_sizes(
            (4 * SIZE[0], 4 * SIZE[1]), share)]
        assert [vertex["texels"] for vertex in vertices] == [
            min(size for size in sizes if size >= vertex["live"]) for vertex in vertices]


def test_a_path_that_leaves_the_scene_is_not_live(small) -> None:
    """At the eye, all paths are live. At the next vertex, only the paths whose eye ray hits the
    white ball are live.

    After that vertex, no path is live, because a ray that leaves a convex ball hits nothing.
    """
    scene, _ = path_scenes.white_ball()
    with rt.Tracer(scene) as tracer:
        tracer.render(size=SIZE, integrator="path", samples=1, compact=0.5, roulette=60)
        assert len(tracer.statistics.vertices) == 2
        eye, ball = tracer.statistics.vertices
        hits = tracer.eye_hits(size=(8 * SIZE[0], 8 * SIZE[1])).hit.mean()
    assert eye["live"] == SIZE[0] * SIZE[1]
    assert abs(ball["live"] / eye["live"] - hits) < 0.06


def test_what_packing_adds(small) -> None:
    """Packing adds textures for each packed size, and its own passes, to the plan."""
    with rt.Tracer(path_scenes.cornell_lit(), "brute-force") as tracer:
        plans = {way: tracer.plan(size=SIZE, integrator="path", samples=SAMPLES, compact=way)
                 for way in ("off", 0.25)}
        off, on = plans["off"], plans[0.25]
        for way, plan in plans.items():
            tracer.render(size=SIZE, integrator="path", samples=SAMPLES, compact=way)
            assert tracer.statistics.texture_bytes == sum(plan.textures.values())
            assert set(tracer.statistics.picture_passes) == set(plan.passes) - (
                {"eye rays", "pack paths again"})
    streams = {"rays", "next rays", "walk 0", "walk 1", "lit", "shadow rays", "direct",
               "radiance", "came from"}
    sizes = packed_sizes((4 * SIZE[0], 4 * SIZE[1]), 0.25)
    assert len(sizes) == 2 and not set(off.textures) - set(on.textures)
    assert set(on.textures) - set(off.textures) == {
        f"{stream} of {w}x{h} packed" for stream in streams for w, h in sizes}
    assert on.textures["state and hits"] > off.textures["state and hits"]
    assert set(on.passes) - set(off.passes) == {
        "packed path vertex", "path live", "path flags", "pack paths", "pack paths again",
        "bring back"}
    assert set(on.defines) - set(off.defines) == {"PACKED_PATHS"}
    assert off.left_out["pass"]["pack paths"] == "paths are not packed"


def test_a_plan_says_what_runs_at_its_size() -> None:
    """Small waves are not packed, and a vertex samples one light.

    The plan lists the requested features in one line and the scene's properties in another line.
    """
    with rt.Tracer(path_scenes.cornell_lit(), "brute-force") as tracer:
        plans = {samples: tracer.plan((64, 64), "path", samples=samples) for samples in (4, 16)}
    for samples, packs in ((4, False), (16, True)):
        plan = plans[samples]
        assert ("pack paths" in plan.passes) == ("packed paths" in plan.present) == packs
        assert ("PACKED_PATHS" in plan.defines) == packs
        words = plan.lines()
        assert "64 bounces can matter, 1 shadow ray per hit" in words[0]
        assert words[1].startswith("the scene has: ") and "paths" not in words[1]
        assert words[2] == "asked for: paths" + (", packed paths" if packs else "")
    assert plans[4].left_out["pass"]["pack paths"] == "paths are not packed"


@pytest.mark.parametrize("count", [0, 1, 2])
def test_a_vertex_samples_one_light(count: int) -> None:
    """A vertex of a path samples at most one light, however many lights the scene has."""
    scene = rt.Scene.from_arrays(np.eye(3), [[0, 1, 2]], environment=None,
                                 lights=(rt.PointLight((0, 0, 9)),) * count)
    with rt.Tracer(scene, "brute-force") as tracer:
        assert tracer.plan((8, 8), "path").needs["lights"] == min(count, 1)


def test_an_interrupted_picture_keeps_its_bits(precise_renderer, small, monkeypatch) -> None:
    """Ctrl-C while a wave's paths are packed keeps the picture of the earlier waves."""
    monkeypatch.setattr(path, "WAVE", 4 * SIZE[0] * SIZE[1])
    with rt.Tracer(path_scenes.cornell_lit()) as tracer:
        tracer.render(size=SIZE, integrator="path", samples=4, compact="off")
        expected = tracer.radiance
        bring_back, told = PackedPaths.bring_back, []

        def interrupted(*arguments: object) -> None:
            if tracer.sessions.pictures.integrator.samples_done == 4 and arguments[1].packed:
                told.append(arguments[1].size)
                raise KeyboardInterrupt
            bring_back(*arguments)
        with monkeypatch.context() as patched:
            patched.setattr(PackedPaths, "bring_back", interrupted)
            with pytest.raises(KeyboardInterrupt):
                tracer.render(size=SIZE, integrator="path", samples=4 * 3, compact="on")
        assert told and tracer.statistics.samples == 4 and tracer.statistics.trace_seconds > 0
        part = tracer.radiance      # the picture of the first wave alone
        tracer.render(size=SIZE, integrator="path", samples=4 * 3, compact="on")
        whole = tracer.radiance
        tracer.render(size=SIZE, integrator="path", samples=4 * 3, compact="off")
        assert (tracer.radiance == whole).all() and not (part == whole).all()
        assert np.abs(part - expected).max() == 0


def test_sizes_of_packed_textures() -> None:
    """Size k holds share^k times as many texels as the wave, rounded up to whole squares.

    A wave of 2^24 or more texels has no packed sizes, because float32 cannot count the texels.
    """
    sizes = packed_sizes((512, 512), 0.5)
    assert [w * h for w, h in sizes] == sorted({w * h for w, h in sizes}, reverse=True)
    for k, (width, height) in enumerate(sizes, 1):
        assert not width % 8 and not height % 8
        assert 0 <= width * height - 2 ** (18 - k) <= 8 * max(width, height)
    assert sizes[-1][0] * sizes[-1][1] < 2 * packed_paths.LEAST
    assert packed_sizes((4096, 4097), 0.5) == packed_sizes((512, 512), 0.0) == []


@pytest.mark.parametrize("wrong", ["maybe", 0.8, 1.0, -0.5, float("nan"), [1]], ids=str)
def test_shares_that_make_no_sense_are_refused(wrong: object) -> None:
    with rt.Tracer(path_scenes.cornell_lit()) as tracer:
        with pytest.raises(rt.Error, match="compact") as refusal:
            tracer.render(size=(4, 4), integrator="path", compact=wrong)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("words, way", [(["--compact", "on"], "on"), (["--compact", "0.25"], 0.25),
                                        ([], "auto")], ids=str)
def test_the_words_of_the_command_line(monkeypatch, tmp_path, words: list[str], way: object
                                       ) -> None:
    """`--compact` reaches the integrator, and `auto` is its default."""
    from gpgpu_rt.cli import main
    seen = []
    start = path.Path.start
    monkeypatch.setattr(path.Path, "start", lambda self, size, options={}: (
        seen.append(options.get("compact", "auto")), start(self, size, options))[1])
    assert main(["render", "cornell", "--integrator", "path", "--samples", "2", "--size", "8",
                 *words, "-o", str(tmp_path / "box.png")]) == 0
    assert seen == [way]
