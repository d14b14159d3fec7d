"""Tests of rays with known float64 hits (`KnownRays`), of their scores, of the reference picture
and of `gpgpu-rt accuracy`."""
from __future__ import annotations

import copy
import json
import re
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
import trimesh
from snippets import without_meshes

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.accuracy.candidates import precisions
from gpgpu_rt.accuracy.known_rays import WITHIN_BOUND, WRONG, KnownRays, bytes_in_flight
from gpgpu_rt.accuracy.measure import Yardstick, accuracy
from gpgpu_rt.gl.environment import environment
from gpgpu_rt.methods import find_method, methods
from gpgpu_rt.reference.picture import reference_picture

METHODS = [row.name for row in rt.methods()]


@pytest.fixture(scope="module")
def ball() -> rt.Scene:
    """Returns a closed mesh. Tests trace rays from inside and from outside."""
    mesh = trimesh.creation.icosphere(subdivisions=3)
    return rt.Scene.from_arrays(mesh.vertices * 3.7 + 1.3, mesh.faces, name="ball")


@pytest.fixture(scope="module")
def known(ball: rt.Scene) -> KnownRays:
    return KnownRays(ball, 2000, seed=5)


def test_rays_follow_the_seed(ball) -> None:
    one, again, other = (KnownRays(ball, 403, seed) for seed in (1, 1, 2))
    assert (one.directions == again.directions).all() and (one.truth.t == again.truth.t).all()
    assert [p.stop - p.start for p in one.parts.values()] == [100, 101, 101, 101]
    for kind, part in one.parts.items():
        assert (one.directions[part] != other.directions[part]).any(axis=1).mean() > 0.9, kind
    eye = KnownRays(ball, 100, 7, ["eye"]).directions.astype(float)
    pixels = ball.camera.rays((10, 10))[1].reshape(-1, 3)
    angle = np.arccos(np.clip((eye * pixels).sum(axis=1), -1, 1))
    assert 0 < np.degrees(angle).max() < ball.camera.fov / 10  # each ray stays within its pixel
    for kinds in ((), ("eye", "eye"), ("ey",)):
        with pytest.raises(rt.OptionError):
            KnownRays(ball, 10, 1, kinds)


def answers(known: KnownRays, **changes: tuple[np.ndarray, object]):
    """Change fields of the true hits, and judge the result. ``changes`` maps the name of a field
    to (rays, values): the field of these rays gets these values."""
    hits = copy.deepcopy(known.truth)
    for name, (rays, values) in changes.items():
        getattr(hits, name)[rays] = values
    return known.judge(hits)


def test_the_truth_is_right(known) -> None:
    score = answers(known).score()
    assert score.wrong == 0 and score.wrong_share == 0
    assert score.upper_95 == pytest.approx(1 - 0.05 ** (1 / 2000))
    assert score.t_error == {"median": 0, "99.9 %": 0, "max": 0}


@pytest.mark.parametrize("kind", ["random", "vertices", "edges"])
def test_a_miss_inside_a_closed_mesh_is_a_leak(known, kind: str) -> None:
    part = known.parts[kind]
    rays = np.arange(part.start, part.stop)[known.truth.hit[part]]
    assert len(rays) > 200
    found = answers(known, t=(rays, np.inf), triangle=(rays, -1))
    assert found.categories["leak"][rays].all()
    assert found.score().wrong == len(rays) == found.score(part).wrong
    assert not found.categories[WITHIN_BOUND].any()


def test_a_leak_to_the_back_of_the_mesh_is_wrong(ball) -> None:
    """A ray from outside that leaks through an edge of the front hits the back of the mesh.

    This hit counts as wrong. For each front triangle alone, float32's error bounds would excuse a
    miss. But all rays in a ring around the ray hit the front, so the ray must hit the front, too.
    """
    rng = np.random.default_rng(3)
    known = KnownRays(ball, 400, 3, ["edges"])
    known.origins[:] = np.float32((1.3, 1.3, 9.0)) + rng.uniform(-1, 1, (400, 3)).astype("f4")
    aim = rng.integers(len(ball), size=400)
    corners = ball.triangles[aim].astype(float)
    share = rng.random((400, 1))
    known.directions[:] = corners[:, 0] * share + corners[:, 1] * (1 - share) - known.origins
    known.truth = rt.reference.trace(ball, known.origins, known.directions)
    behind = rt.reference.trace(ball, known.origins, known.directions,
                                np.where(known.truth.hit, known.truth.t * 1.02, 0))
    through = np.flatnonzero(behind.hit & (behind.t > 1.1 * known.truth.t))
    assert len(through) > 300
    found = answers(known, t=(through, behind.t[through]),
                    triangle=(through, behind.triangle[through]))
    assert found.wrong[through].all()
    # The hit is wrong even if its distance has an additional error, as at low precision.
    found = answers(known, t=(through, behind.t[through] * 1.01),
                    triangle=(through, behind.triangle[through]))
    assert found.categories["wrong distance"][through].all() and found.wrong[through].all()


def test_the_rim_of_an_open_mesh_may_be_missed() -> None:
    """A miss at the rim of the square is not wrong, because some rays in a ring around the ray
    miss the square too. A miss at the diagonal between the two triangles is a leak."""
    corners = np.array([[0, 0, 0], [3, 0, 0.5], [3, 3, 1], [0, 3, 0.5]])
    square = rt.Scene.from_arrays(corners, [[0, 1, 2], [0, 2, 3]], name="square")
    known = KnownRays(square, 600, 3, ["edges"])
    rng = np.random.default_rng(3)
    ends = np.array([[0, 2], [0, 1], [1, 2], [2, 3], [3, 0]])[np.arange(600) % 5]
    along = rng.uniform(0.01, 0.99, (600, 1))
    known.origins[:] = rng.uniform((0, 0, 3), (3, 3, 5), (600, 3))
    known.directions[:] = (corners[ends[:, 0]] * along + corners[ends[:, 1]] * (1 - along)
                           - known.origins)
    known.truth = rt.reference.trace(square, known.origins, known.directions)
    rays = np.flatnonzero(known.truth.hit)
    diagonal = rays % 5 == 0
    assert diagonal.sum() == 120 and len(rays) > 200
    found = answers(known, t=(rays, np.inf), triangle=(rays, -1))
    assert found.categories["leak"][rays[diagonal]].all()
    assert not found.wrong[rays[~diagonal]].any()


def test_wrong_distances_are_no_wrong_hits(known) -> None:
    part = known.parts["random"]
    rays = np.arange(part.start, part.stop)[known.truth.hit[part]]
    found = answers(known, t=(rays, known.truth.t[rays] * (1 + 1e-3)))
    assert not found.wrong.any() and found.categories["wrong distance"][rays].all()
    assert found.t_error[rays] == pytest.approx(1e-3)
    assert found.over(0.5e-3) == (len(rays), int(known.truth.hit.sum()))
    # Another triangle at a wrong distance is a wrong hit.
    other = (known.truth.triangle[rays] + 640) % 1280
    found = answers(known, t=(rays, known.truth.t[rays] * 1.5), triangle=(rays, other))
    assert found.wrong[rays].all() and np.isnan(found.t_error[rays]).all()
    eye = np.flatnonzero(known.truth.hit)
    eye = eye[eye < known.parts["eye"].stop]
    back = rt.reference.trace(known.scene, known.origins[eye], known.directions[eye],
                              known.truth.t[eye] * 1.02)
    eye, t, triangle = eye[back.hit], 1.01 * back.t[back.hit], back.triangle[back.hit]
    found = answers(known, t=(eye, t), triangle=(eye, triangle))
    assert len(eye) > 100 and found.categories["wrong triangle"][eye].mean() > 0.95
    assert found.wrong[eye].all()


def test_unfinished_rays_are_wrong(known) -> None:
    assert answers(known, status=(slice(3, 6), 2)).score().counts["unfinished"] == 3


@pytest.mark.parametrize("name", ["cornell", "shirley6"])
def test_the_reference_picture_is_what_is_drawn(name: str) -> None:
    scene = rt.load_scene(name)
    with rt.Tracer(scene) as tracer:
        drawn = np.asarray(tracer.render(size=(96, 64))) / 255
    differing = np.abs(drawn - reference_picture(scene, (96, 64))).max(axis=2) > 1 / 255
    assert differing.mean() < 2e-3


def test_bytes_in_flight(ball) -> None:
    with rt.Tracer(ball) as tracer:
        for side in (16, 64):
            tracer.trace(*ball.camera.rays((side, side)))
            many = bytes_in_flight(tracer, 64 * 64)
            assert many == pytest.approx(tracer.statistics.texture_bytes, abs=8) or side == 16
        assert bytes_in_flight(tracer, 128 * 128) > many


@pytest.fixture(scope="module")
def yardstick(ball: rt.Scene) -> Yardstick:
    return Yardstick(ball, 128, seed=11, size=(16, 16))


def check_row(row: dict, word: str) -> None:
    json.dumps(row)
    assert row["precision"] == word and row["texture_bytes"] > 0
    assert set(row["kinds"]) == {"eye", "random", "vertices", "edges"}
    assert row["all"]["rays"] == 512 == sum(k["rays"] for k in row["kinds"].values())
    assert row["all"]["wrong"] == sum(row["all"]["counts"][name] for name in WRONG)
    assert ("step_cap" in row["options"]) == (word != "fp32")


@pytest.mark.parametrize("method", METHODS)
def test_full_precision_is_right(method: str, yardstick: Yardstick) -> None:
    exact = yardstick.measure(method, {"precision": "fp32"}, 1)
    check_row(exact, "fp32")
    assert exact["all"]["wrong"] == 0 and exact["all"]["counts"]["wrong distance"] == 0
    assert exact["all"]["t_ulps"]["99.9 %"] < 500
    # At most a few of 768 numbers may differ by 1/255. Without the reference's rounding to 8 bits,
    # the RMSE would be 1 / 255 / sqrt(12) = 1.1e-3.
    assert exact["image"]["rmse"] < 5e-4 and exact["image"]["differing"] == 0


@pytest.mark.parametrize("method", [
    name if name in ("bvh-threaded", "grid", "kd-restart") else
    pytest.param(name, marks=pytest.mark.full) for name in METHODS
    # without the schedule `loop`, the test is too slow
    if "loop" in find_method(name).schedules and "fp16" in precisions(name)])
def test_less_precision_is_measured(method: str, yardstick: Yardstick) -> None:
    rows = {word: yardstick.measure(method, {"precision": word}, 1) for word in ("fp32", "fp16")}
    check_row(rows["fp16"], "fp16")
    assert (rows["fp16"]["all"]["t_ulps"]["median"]
            > 100 * rows["fp32"]["all"]["t_ulps"]["median"])


def test_accuracy_command(capsys, tmp_path) -> None:
    path = tmp_path / "accuracy.json"
    arguments = ["accuracy", "cornell", "-m", "bvh-threaded,bvh-packet", "--precisions", "fp32",
                 "--octants", "--rays", "64", "--size", "16", "-o", str(path)]
    assert cli.main([*arguments, "--json"]) == 0
    out, progress = capsys.readouterr()
    result = json.loads(out)
    assert result == json.loads(path.read_text()) and "2 of 2" in progress
    assert result["environment"] == asdict(environment())
    assert [r["method"] for r in result["rows"]] == ["bvh-threaded", "bvh-packet"]
    assert [r["options"]["octants"] for r in result["rows"]] == [True, True]
    assert cli.main(arguments) == 0
    out = capsys.readouterr().out
    heads = re.split(r"  +", out.splitlines()[1])
    meanings = dict(re.findall(r"(?m)^([^:\n]+): (.+)", out.partition("\n\n")[2]))
    assert ", ".join(["method", "precision", *meanings]) == ", ".join(heads)
    assert "up to 64 rays of each kind" in out and "bench" in meanings["Mrays/s, ms"]
    assert "0.012" in out  # the 95 % bound of the wrong share if none of 256 rays is wrong
    path.unlink()
    for more, message in ((["--precisions", "fp12"], "no precision"),
                          (["-m", "gird"], "did you mean grid"),
                          (["-m", "grid"], "grid has no option 'octants'")):
        assert cli.main([*arguments, *more]) == 1
        error = capsys.readouterr().err
        assert message in error.splitlines()[-1] and not path.exists()


def test_only_rays_aimed_at_vertices_and_edges_are_excused(exact_renderer, tmp_path: Path
                                                           ) -> None:
    """docs/accuracy.md says how many rays of each kind `accuracy` excuses by default."""
    with without_meshes(tmp_path):
        known = KnownRays(rt.load_scene("cornell"), 65_536, 0)
    with rt.Tracer(known.scene, "bvh-threaded") as tracer:
        found = known.judge(known.trace(tracer)[0])
    excused = {kind: found.score(part).counts[WITHIN_BOUND] for kind, part in known.parts.items()}
    page = " ".join((Path(rt.__file__).parents[1] / "docs" / "accuracy.md").read_text().split())
    vertices, edges = (int(number.replace(",", "")) for number in re.search(
        r"fp32: (\S+) aimed at vertices, (\S+) aimed at edges, no others", page).groups())
    assert excused == {"eye": 0, "random": 0, "vertices": vertices, "edges": edges}
    assert f"excuses {vertices + edges:,} of 65,536 rays" in page and not found.wrong.any()


def test_several_methods_are_named_together_or_one_by_one(capsys) -> None:
    arguments = ["accuracy", "cornell", "--precisions", "fp32", "--rays", "16", "--size", "8"]
    found = []
    for words in (["-m", "bih,grid"], ["-m", "bih", "--methods", "grid"]):
        assert cli.main([*arguments, *words, "--json"]) == 0
        found.append([row["method"] for row in json.loads(capsys.readouterr().out)["rows"]])
    assert found == [["bih", "grid"]] * 2
    assert cli.main([*arguments, "-m", "grid", "--octants"]) == 1
    assert "grid has no option 'octants'" in capsys.readouterr().err
    words = ["-m", "kd-stack", "-m", "bih", "--stack-size", "4"]
    assert cli.main([*arguments, *words, "--json"]) == 0
    assert {row["options"]["stack_size"] for row in json.loads(
        capsys.readouterr().out)["rows"]} == {4}


def test_methods_that_lack_an_option_are_left_out(ball) -> None:
    """Without a list of methods, `accuracy` leaves out methods that lack a given option, and
    names these methods."""
    told: list[str] = []
    rows = accuracy(ball, formats=["fp32"], options={"build": "zhou", "schedule": "kernels"},
                    rays=4, size=(4, 4), report=told.append)
    names = {row["method"] for row in rows}
    assert "kd-restart" in names and not names & {"kd-stack", "bvh-threaded", "bvh-stack"}
    left = next(line for line in told if "do not have" in line)
    assert "kd-stack" in left and "bvh-threaded" in left and "kd-restart" not in left


@pytest.mark.parametrize("method, era, own", [
    (row.name, era, own) for era, own in (("nv40", "fp32"), ("r420", "fp24")) for row in methods()
    if not row.why_no_era_form(era)])
def test_the_era_form_is_measured_in_the_numbers_of_its_chip(ball, method, era, own) -> None:
    """Number formats other than the chip's own are refused before rays are traced."""
    if era == "r420" and find_method(method).era_packets is not None:
        return      # a packet's program is a loop, and the card has no loops
    (row,) = accuracy(ball, [method], None, {"era": era}, 16, (8, 8))
    assert row["precision"] == own
    said: list[str] = []
    for formats in (["fp16"], ["fp32", "fp24"]):
        with pytest.raises(rt.OptionError, match=rf"{method}: era={era} computes in {own}; leave "
                           r"out .*--precisions"):
            accuracy(ball, [method], formats, {"era": era}, 16, (8, 8), report=said.append)
    assert not said


def test_options_no_method_has(ball) -> None:
    """An option that none of the given methods has is an error."""
    with pytest.raises(rt.OptionError, match="octants"):
        accuracy(ball, ["grid"], options={"octants": True}, rays=4)
