"""`gpgpu-rt bench`: the choice of engines, the counted work, and the results that are printed
after a failure."""
from __future__ import annotations

import datetime
import json

import pytest
from trimesh.ray.ray_triangle import RayMeshIntersector

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.bench import ENGINES, RAY_SETS, Workload, engines, load, workload
from gpgpu_rt.bench.engines import OWN
from gpgpu_rt.cli import benching

SIZE = 24


def test_trimeshs_engine_gets_its_rays_in_blocks(monkeypatch) -> None:
    """All rays are traced, in small blocks. A block of 1,024 rays in a scene of a room needed
    20 GB."""
    own = next(one for one in ENGINES if one.name == OWN)
    if own.missing:
        pytest.skip(own.missing)
    scene, rays = load("cornell"), workload("cornell", RAY_SETS["eye"], SIZE).compact()
    given: list[int] = []
    whole = RayMeshIntersector.intersects_first
    monkeypatch.setattr(RayMeshIntersector, "intersects_first", lambda self, origins, directions: (
        given.append(len(origins)), whole(self, origins, directions))[1])
    found = own.prepare(scene, rays)()
    assert max(given) <= engines.BLOCK and sum(given) == len(found) == rays.live
    with rt.Tracer(scene, "grid") as tracer:
        assert (found == rays.trace(tracer).triangle).mean() > 0.99


@pytest.mark.parametrize("kind", ["eye", "mirror", "shadow"])
def test_statistics_count_the_work_per_ray(kind: str, capsys) -> None:
    """`bench` divides the work by the number of rays. Pixels without a ray do not count, although
    the tracer's means are over all pixels. A packet's work is divided among its rays: each ray of
    a 2 x 2 packet counts a quarter of the work."""
    arguments = ["bench", "bunny", "--size", "16", "-m", "grid,bvh-packet", "--runs", "1",
                 "--rays", kind, "--engine", "none", "--statistics"]
    assert cli.main([*arguments, "--json"]) == 0
    grid, packet = json.loads(capsys.readouterr().out)["races"][0]["entries"]
    rays = workload("bunny", RAY_SETS[kind], 16)
    assert grid["options"] == packet["options"] == {}
    assert grid["all_options"]["statistics"] and packet["all_options"]["statistics"]
    assert rays.live < 16 * 16 or kind == "eye"
    alone = Workload(rays.origins[rays.has_ray], rays.directions[rays.has_ray], 16,
                     None if rays.t_max is None else rays.t_max[rays.has_ray], rays.any_hit,
                     (1, rays.live))
    with rt.Tracer(load("bunny"), "grid", statistics=True) as tracer:
        alone.trace(tracer)
        counters = tracer.statistics.counters
    assert grid["work"] == pytest.approx({name: counters[name] for name in grid["work"]})
    with rt.Tracer(load("bunny"), "bvh-packet", statistics=True) as tracer:
        rays.trace(tracer)
        counters = tracer.statistics.counters
    assert packet["work"]["triangles_tested"] * 4 * rays.live == pytest.approx(
        counters["triangles_tested"] * 16 * 16)
    assert cli.main(arguments) == 0
    out = capsys.readouterr().out
    assert "triangles tested" in out
    assert "embreex" not in out, "the output names an engine that did not run"


def test_the_json_says_how_to_repeat_the_run(capsys) -> None:
    """The JSON has the command line, the date and the number of rounds. An entry has the defaults
    of its options, and the quartiles of its times. The field `too_noisy`, which says why a
    comparison with embreex has no verdict, is empty, because embreex does not run."""
    words = ["bench", "cornell", "--size", "8", "--runs", "3", "-m", "grid", "--resolution", "4",
             "--engine", "none", "--json"]
    before = datetime.datetime.now(datetime.timezone.utc)
    assert cli.main(words) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["command"] == "gpgpu-rt " + " ".join(words) and found["runs"] == 3
    date = datetime.datetime.fromisoformat(found["date"])
    assert abs(date - before) < datetime.timedelta(minutes=5)
    race, = found["races"]
    entry, = race["entries"]
    assert race["too_noisy"] == ""
    assert entry["options"].items() < entry["all_options"].items()
    assert entry["all_options"]["intersection"] == "woop-watertight"
    assert not entry["all_options"]["statistics"]
    low, middle, high = (1e9 * seconds / 64 for seconds in sorted(entry["seconds"]))
    assert (entry["ns_per_ray_q1"], entry["ns_per_ray"], entry["ns_per_ray_q3"]) == pytest.approx(
        ((low + middle) / 2, middle, (middle + high) / 2))


@pytest.mark.parametrize("words, names", [
    ("none", []), ("embreex", [one.name for one in ENGINES if one.name.startswith("embreex")]),
    ("Trimesh,embreex", [one.name for one in ENGINES if one.name[:7] in ("trimesh", "embreex")])],
    ids=str)
def test_engines_are_chosen_by_the_first_word(words: str, names: list[str]) -> None:
    if any(one.missing for one in ENGINES if one.name in names):
        pytest.skip("embreex or rtree is not installed")
    assert [one.name for one in benching._engines(words.split(","))] == names


def test_an_engine_that_cannot_run_is_one_line(capsys, monkeypatch) -> None:
    for word in ("embrex", "embre"):        # the beginning of a word names no engine
        assert cli.main(["bench", "cornell", "--engine", word]) == 1
        assert "did you mean embreex or Embree?" in capsys.readouterr().err
    monkeypatch.setattr(engines, "_absent", lambda module: f"{module} is not installed")
    assert cli.main(["bench", "cornell", "--engine", "open3d"]) == 1
    assert "--engine open3d: open3d is not installed; install it" in capsys.readouterr().err


@pytest.mark.parametrize("failure, status", [(MemoryError, 1), (KeyboardInterrupt, 130)])
def test_finished_races_survive_a_failure(monkeypatch, capsys, failure, status: int) -> None:
    """If a race fails, the results of the finished races are printed before the error. Printing
    the results loads no scene again."""
    timed, loaded = benching.race, []

    def fails(scene: str, *rest) -> list:
        if scene == "tenk":
            monkeypatch.setattr(benching, "load", loaded.append)
            raise failure
        return timed(scene, *rest)
    monkeypatch.setattr(benching, "race", fails)
    assert cli.main(["bench", "cornell", "bunny", "tenk", "--size", "8", "-m", "grid", "--runs",
                     "1", "--engine", "none", "--json"]) == status
    out, err = capsys.readouterr()
    assert [race["scene"] for race in json.loads(out)["races"]] == ["cornell", "bunny"]
    assert not loaded
