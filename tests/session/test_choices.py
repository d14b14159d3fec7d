"""With the method "auto", a tracer has two choices (methods with options): one for coherent rays,
and one for incoherent rays. In each call, the rays decide between the choices."""
from __future__ import annotations

import pickle
from collections.abc import Iterator

import numpy as np
import pytest
from conftest import assert_same_bits, soup_scene

import gpgpu_rt as rt
from gpgpu_rt.bench.workloads import workload
from gpgpu_rt.methods.choices import COHERENT, INCOHERENT, Choice, Choices
from gpgpu_rt.rays import ray_sets
from gpgpu_rt.rays.batch import RayBatch
from gpgpu_rt.rays.coherence import coherence
from gpgpu_rt.session.builder import Builder
from gpgpu_rt.session.sessions import COHERENT_SHARE

SIDE = 16
PAIR = Choices(Choice("bvh-packet", {"packet": (2, 2)}), Choice("kd-restart"))


@pytest.fixture
def scene() -> rt.Scene:
    return soup_scene(200, seed=1)


@pytest.fixture(autouse=True)
def nothing_tuned(monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_CACHE", "")


@pytest.fixture
def auto(scene) -> Iterator[rt.Tracer]:
    with rt.Tracer(scene, PAIR) as tracer:
        yield tracer


def eye(scene: rt.Scene) -> ray_sets.Rays:
    return scene.camera.rays((SIDE, SIDE))


def random(scene: rt.Scene) -> ray_sets.Rays:
    return tuple(a.reshape(SIDE, SIDE, 3) for a in ray_sets.random_rays(scene, SIDE ** 2, 3))


def took(tracer: rt.Tracer) -> tuple[str, str, str]:
    """Return the choice and the method of the last call, and the method of the current choice."""
    statistics = tracer.statistics
    assert statistics.method == tracer.method.name
    return statistics.choice, statistics.method, tracer.choices.of(tracer.taken).method


# Coherence ---------------------------------------------------------------------------------------


def share_of(origins: np.ndarray, directions: np.ndarray, diagonal: float = 1.0,
             **more) -> float | None:
    """Return the share of pairs of neighbouring rays that are coherent."""
    return coherence(RayBatch(origins, directions, **more), diagonal)


@pytest.mark.parametrize("height, width", [(1, 2), (3, 5), (8, 8), (40, 24), (300, 300)])
def test_rays_with_one_direction_are_coherent(height: int, width: int) -> None:
    """Rays with the same direction are coherent if their origins are near each other."""
    origins, directions = np.zeros((height, width, 3)), np.ones((height, width, 3)) * (1, 2, 3)
    assert share_of(origins, directions) == 1
    assert share_of(origins, -directions) == 1
    moved = origins + np.arange(width)[None, :, None]        # columns lie far apart
    assert share_of(moved, directions, 100.0) == 1
    across = share_of(moved, directions, 1.0)
    if height == 1:
        assert across == 0
    else:       # only vertical neighbours are near
        y, x = min(8, height), min(8, width)
        assert across == pytest.approx((y - 1) * x / ((y - 1) * x + y * (x - 1)))


def test_neighbours_that_are_not_coherent() -> None:
    """Neighbouring rays are not coherent if they differ in a sign or in the dominant axis, or if
    their origins lie far apart."""
    origins, directions = np.zeros((1, 8, 3)), np.ones((1, 8, 3)) * (1, 2, 3)
    for change in ((-1, 2, 3), (1, 3, 2)):
        other = directions.copy()
        other[:, ::2] = change
        assert share_of(origins, other) == 0
    apart = origins.copy()
    apart[:, ::2] = 0.1
    assert share_of(apart, directions) == 0
    assert share_of(apart, directions, 10.0) == 1


def test_invalid_rays_do_not_count() -> None:
    """Without two valid neighbours, there is no share."""
    origins, directions = np.zeros((4, 4, 3)), np.ones((4, 4, 3)) * (1, 2, 3)
    directions[:, 2:] *= -1
    assert share_of(origins, directions) == 1 - 4 / 24
    origins[:, 2:] = np.nan
    assert share_of(origins, directions, invalid="miss") == 1
    origins[:] = np.nan
    assert share_of(origins, directions, invalid="miss") is None
    for count in (0, 1):
        assert share_of(np.zeros((count, 3)), np.ones((count, 3))) is None
    assert share_of(origins[0, :1], directions[0, :1], invalid="miss") is None


@pytest.mark.parametrize("name", ["cornell", "kitchen"])
def test_the_rays_of_the_bench_are_told_apart(name: str) -> None:
    """Eye and shadow rays of `bench` count as coherent. Diffuse and random rays do not."""
    scene = rt.load_scene(name)
    diagonal = float(np.linalg.norm(np.subtract(*scene.bounds)))
    for kind, coherent in (("eye rays", True), ("shadow rays", True), ("diffuse rays 1", False),
                           ("diffuse rays 2", False), ("random rays", False)):
        rays = workload(name, kind, 64)
        found = share_of(rays.origins, rays.directions, diagonal, shape=(64, 64), invalid="miss")
        assert (found >= COHERENT_SHARE) == coherent, (kind, found)


# Choice by rays ----------------------------------------------------------------------------------


def test_rays_decide(scene, auto) -> None:
    """Each call uses the choice for its rays, and finds the hits of brute force."""
    assert took(auto) == (COHERENT, "bvh-packet", "bvh-packet")
    kinds = {COHERENT: ("bvh-packet", eye(scene)), INCOHERENT: ("kd-restart", random(scene))}
    with rt.Tracer(scene, "brute-force") as truth:
        for rays in (COHERENT, INCOHERENT, COHERENT, COHERENT, INCOHERENT):
            method, given = kinds[rays]
            assert_same_bits(truth.trace(*given), auto.trace(*given))
            assert took(auto) == (rays, method, method)
            assert auto.statistics.build_seconds > 0 and auto.statistics.rays == SIDE ** 2
        for rays, (method, given) in kinds.items():
            assert (truth.occluded(*given, 0.5) == auto.occluded(*given, 0.5)).all()
            assert took(auto)[0] == rays
            one, other = truth.trace_all(*given), auto.trace_all(*given)
            assert took(auto)[0] == rays
            assert (one.triangle == other.triangle).all() and (one.t == other.t).all()
        # A single ray has no neighbour to compare with, so the current choice traces it.
        alone = [a.reshape(-1, 3)[:1] for a in eye(scene)]
        assert_same_bits(truth.trace(*alone), auto.trace(*alone))
        assert took(auto)[0] == INCOHERENT


def test_the_second_structure_is_built_when_it_is_needed(scene, auto) -> None:
    auto.trace(*eye(scene))
    coherent_alone, built = auto.statistics.texture_bytes, auto.statistics.build_seconds
    assert len(auto.sessions.held) == 1
    auto.trace(*random(scene))
    kd = dict(auto.statistics.table_bytes)
    first, second = auto.sessions.held
    assert second is auto.session and second.structure.table_bytes == kd
    assert "kd_node" in kd and "kd_node" not in first.structure.table_bytes
    auto.trace(*eye(scene))
    assert auto.statistics.build_seconds == built        # reused, not rebuilt
    assert auto.statistics.texture_bytes == coherent_alone + sum(kd.values())   # both are kept


def test_a_choice_that_cannot_be_built_changes_nothing(scene, auto, monkeypatch) -> None:
    hits = auto.trace(*eye(scene))

    def fail(self, triangles: np.ndarray) -> None:
        raise rt.LimitError("too large")
    with monkeypatch.context() as patch:
        patch.setattr(Builder, "build", fail)
        with pytest.raises(rt.LimitError, match="too large"):
            auto.trace(*random(scene))
    assert_same_bits(hits, auto.trace(*eye(scene)))
    assert took(auto) == (COHERENT, "bvh-packet", "bvh-packet")
    auto.trace(*random(scene))
    assert took(auto) == (INCOHERENT, "kd-restart", "kd-restart")


def test_both_structures_follow_triangles_that_move(scene, auto) -> None:
    """After an update, both structures find hits on the moved triangles."""
    given = eye(scene), random(scene)
    for rays in given:
        auto.trace(*rays)
    for step in (1, 2):
        triangles = scene.triangles + np.float32(0.05 * step)
        auto.update(triangles)
        with rt.Tracer(scene, "brute-force") as truth:
            truth.update(triangles)
            for rays in given[::step]:
                assert_same_bits(truth.trace(*rays), auto.trace(*rays))
    auto.update(scene.triangles)
    with rt.Tracer(scene, "brute-force") as truth:
        for rays in given:
            assert_same_bits(truth.trace(*rays), auto.trace(*rays))


def test_pictures_are_the_same(scene, auto) -> None:
    with rt.Tracer(scene, "kd-restart") as other:
        for integrator, rays, more in (
                ("whitted", COHERENT, {}), ("path", INCOHERENT, {"samples": 2}),
                ("direct", COHERENT, {})):
            pictures = [np.asarray(t.render(size=(SIDE, SIDE), integrator=integrator, **more))
                        for t in (auto, other)]
            assert (pictures[0] == pictures[1]).all() and took(auto)[0] == rays
            if integrator == "path":
                radiance = auto.radiance
        auto.plan((SIDE, SIDE), "path")
        assert took(auto)[0] == INCOHERENT
        assert_same_bits(other.eye_hits(size=(SIDE, SIDE)), auto.eye_hits(size=(SIDE, SIDE)))
        assert took(auto)[0] == COHERENT and radiance.any()
        auto.render(size=(SIDE, SIDE), integrator="path", samples=2)
        auto.trace(*eye(scene))
        assert (auto.radiance == radiance).all()     # a later trace keeps the last picture


def test_release_frees_both(scene) -> None:
    """`release` frees the textures of both structures."""
    tracer = rt.Tracer(scene, PAIR)
    for rays in (eye(scene), random(scene)):
        tracer.trace(*rays)
    tables = [texture for session in tracer.sessions.held
              for texture in session.tables.samplers().values()]
    assert len(tracer.sessions.held) == 2 and len(tables) > 3
    tracer.release()
    assert all(isinstance(t.mglo, type(tables[0].mglo)) for t in tables)
    assert {type(t.mglo).__name__ for t in tables} == {"InvalidObject"}


def test_both_choices_are_sent_to_other_processes(scene, auto) -> None:
    """A pickled tracer keeps both choices."""
    given = random(scene)
    hits = auto.trace(*given)
    with pickle.loads(pickle.dumps(auto)) as copy:
        assert copy.choices.differ and copy.choices.incoherent.method == "kd-restart"
        assert_same_bits(hits, copy.trace(*given))
        assert took(copy)[0] == INCOHERENT
        copy.trace(*eye(scene))
        assert took(copy)[:2] == (COHERENT, "bvh-packet")
        assert copy.options["packet"] == (2, 2)


def test_one_choice_is_one_structure(scene) -> None:
    with rt.Tracer(scene, Choices.one(Choice("grid"))) as tracer, rt.Tracer(scene, "grid") as own:
        for rays in (eye(scene), random(scene)):
            assert_same_bits(own.trace(*rays), tracer.trace(*rays))
            assert len(tracer.sessions.held) == 1 and tracer.statistics.choice == ""
            assert tracer.statistics.method == "grid"


def test_choices_that_cannot_be(scene) -> None:
    """Unknown methods and wrong options are refused, and `statistics` applies to both choices."""
    for choices, options, message in (
            (Choices(Choice("grid"), Choice("gird")), {}, "did you mean grid"),
            (Choices(Choice("grid"), Choice("grid", {"octants": True})), {}, "octants"),
            (PAIR, {"schedule": "step"}, "schedule=step: the choices fixed all options")):
        with pytest.raises(rt.OptionError, match=message):
            rt.Tracer(scene, choices, **options)
    with rt.Tracer(scene, PAIR, statistics=True) as tracer:
        for rays in (eye(scene), random(scene)):
            assert tracer.trace(*rays).nodes_visited.sum() > 0


def test_a_tracer_with_two_choices_cannot_be_deformed() -> None:
    surface = Choices(Choice("geometry-image"), Choice("bvh-threaded"))
    with rt.Tracer("boulder", surface) as tracer:
        with pytest.raises(rt.OptionError, match="make the tracer with method geometry-image"):
            rt.Deformation(tracer, "wave")


# The safe default --------------------------------------------------------------------------------


def test_the_default_pair(scene) -> None:
    """Without settings, `auto` traces coherent rays in packets, and all other rays singly."""
    with rt.Tracer(scene, "auto") as tracer, rt.Tracer(scene, "brute-force") as truth:
        assert tracer.settings is None
        for rays, given, method in ((COHERENT, eye(scene), "bvh-packet"),
                                    (INCOHERENT, random(scene), "bvh-threaded")):
            assert_same_bits(truth.trace(*given), tracer.trace(*given))
            assert took(tracer) == (rays, method, method) and tracer.options["octants"]
    with rt.Tracer(scene, "auto", schedule="step") as tracer:     # entry points are dropped
        tracer.trace(*eye(scene))
        assert took(tracer) == (COHERENT, "bvh-packet", "bvh-packet")
    with rt.Tracer(scene, "auto", entry_points=4) as tracer:      # packets do not accept 4
        tracer.trace(*eye(scene))
        assert took(tracer) == ("", "bvh-threaded", "bvh-threaded")
    with rt.Tracer(scene, "auto", octants=False) as tracer:
        assert [tracer.choices.of(rays).options["octants"] for rays in (COHERENT, INCOHERENT)] == [
            False, False]


@pytest.mark.parametrize("count", [0, 1, 2])
def test_the_default_pair_on_next_to_nothing(count: int) -> None:
    """The default pair also works on scenes of 0, 1 and 2 triangles."""
    few = rt.Scene.from_arrays(np.random.default_rng(count).random((3 * count, 3)),
                               np.arange(3 * count).reshape(-1, 3))
    some = soup_scene(10, seed=1)
    with rt.Tracer(few, "auto") as tracer, rt.Tracer(few, "brute-force") as truth:
        for rays in (eye(some), random(some)):
            assert_same_bits(truth.trace(*rays), tracer.trace(*rays))
