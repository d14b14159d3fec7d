"""Tests of time travel, the view of all rays after each pass. A traversal that continues from the
states of any pass finds the same hits as a whole traversal."""
from __future__ import annotations

import json

import numpy as np
import pytest
from conftest import soup_scene
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt.cli import main
from gpgpu_rt.inspect import false_colours as colours
from gpgpu_rt.inspect.film_frames import even_loss
from gpgpu_rt.inspect.heat import KINDS, draw_heat, heat
from gpgpu_rt.inspect.pass_pictures import write_passes
from gpgpu_rt.inspect.time_travel import Pass, decode, phase_names, travel
from gpgpu_rt.methods import built_in_methods
from gpgpu_rt.methods.choices import Choice, Choices
from gpgpu_rt.rays.batch import RayBatch
from gpgpu_rt.rays.records import HIT
from gpgpu_rt.traversal.schedules import LOOP_STEPS, Traversal

# The passes of these methods keep no states of single rays.
BATCHED = ("ray-engine", "ray-tiles", "ray-hierarchy")
WATCHED = [pytest.param(row.name, schedule, marks=() if schedule == "step" or row.name in (
    "grid", "kd-restart") else pytest.mark.full) for row in rt.methods()
    for schedule in row.schedules if schedule != "loop" and row.name not in BATCHED]
FIELDS = ("t", "u", "v", "triangle")


def few_rays(count: int, seed: int) -> tuple[rt.Scene, np.ndarray, np.ndarray]:
    scene = soup_scene(60, seed)
    rng = np.random.default_rng(seed)
    return scene, rng.random((count, 3)).astype(np.float32), rng.normal(size=(count, 3))


def passes_of(tracer: rt.Tracer, *rays: np.ndarray) -> tuple[list[Pass], rt.Hits]:
    passes: list[Pass] = []
    return passes, travel(tracer, *rays, passes.append)


@pytest.mark.parametrize("method, schedule", WATCHED)
def test_the_last_state_has_the_hits_of_a_trace(method: str, schedule: str) -> None:
    scene, *rays = few_rays(150, 1)
    with rt.Tracer(scene, method, schedule=schedule, statistics=True) as tracer:
        expected = tracer.trace(*rays)
        passes, hits = passes_of(tracer, *rays)
        names = set(phase_names(tracer).values())
        assert ("stack full" in names) == (method == "kd-texture-stack")
        # At most two passes draw no states of rays.
        assert abs(tracer.statistics.passes - len(passes)) <= 2
    batch = RayBatch(*rays, bounds=scene.bounds)
    last = decode(batch, passes[-1])
    for name in FIELDS:
        assert (getattr(hits, name) == getattr(expected, name)).all()
        assert (getattr(last, name) == getattr(expected, name)).all()
    assert [one.number for one in passes] == list(range(len(passes)))
    assert passes[-1].live == 0 < passes[0].live
    nearest = np.array([one.hit["t"] for one in passes])
    assert (nearest[1:] <= nearest[:-1]).all(), "a hit got farther from one pass to the next"
    assert set().union(*(one.served for one in passes)) <= names
    if "turn" not in passes[0].state:    # each ray of a packet has the packet's steps
        runs = sum(sum(one.served.values()) for one in passes)
        assert runs == expected.steps.sum()
        assert all(sum(after.served.values()) <= before.live
                   for before, after in zip(passes, passes[1:]))


@pytest.mark.parametrize("method", ["bvh-stack", "bvh-packet"])
def test_each_push_has_a_pop(method: str) -> None:
    scene, *rays = few_rays(150, 3)
    with rt.Tracer(scene, method, schedule="step") as tracer:
        passes, _ = passes_of(tracer, *rays)
    counts = [sum(one.served.get(kernel, 0) for one in passes) for kernel in ("push", "pop")]
    assert counts[0] == counts[1] > 0
    assert all(all(one.served.values()) for one in passes), "a kernel ran for no ray"


def test_time_travel_follows_the_tracer_s_choice() -> None:
    """Time travel shows the passes of the method that a tracer with two methods picks for the
    rays."""
    scene, *rays = few_rays(150, 4)
    both = Choices(*(Choice(name, {"schedule": "step"}) for name in ("kd-restart", "grid")))
    with rt.Tracer(scene, both) as tracer:
        expected = tracer.trace(*rays)
        tracer.trace(np.zeros((64, 3)), np.tile([0, 0, 1.0], (64, 1)))     # use the other choice
        passes, hits = passes_of(tracer, *rays)
        assert tracer.method.name == "grid"
    assert len(passes) > 2 and passes[-1].live == 0
    assert (hits.triangle == expected.triangle).all()
    assert (passes[-1].hit["triangle"][hits.hit] == hits.triangle[hits.hit]).all()


@pytest.mark.parametrize("method, schedule", [
    pytest.param(method, schedule, marks=() if schedule == "step" or method == "grid"
                 else pytest.mark.full)
    for method in ("kd-restart", "kd-ropes", "grid", "bvh-threaded", "bih")
    for schedule in ("kernels", "step")])
def test_any_state_leads_to_the_same_hits(precise_renderer, method: str, schedule: str) -> None:
    """A traversal that resumes from the observed state of any pass finds the same hits."""
    scene, *rays = few_rays(90, 2)
    with rt.Tracer(scene, method, schedule=schedule) as tracer:
        passes, expected = passes_of(tracer, *rays)
        for one in passes[::5]:
            driver = tracer.session.driver
            assert isinstance(driver, Traversal)
            buffers = tracer.session.buffers
            now, target = buffers.states.side(0), buffers.states.side(1)
            with tracer.gpu:
                now.write(tracer.method.state.name, **one.state)
                now.write(HIT.name, **one.hit)
                program = driver._traverse(buffers.rays, False, LOOP_STEPS)
                driver._draw(program, buffers.rays, now, target, tracer.statistics)
                found = RayBatch(*rays, bounds=scene.bounds).hits(target.fields(HIT.name))
            for name in FIELDS:
                assert (getattr(found, name) == getattr(expected, name)).all(), one.number


def test_states_of_an_earlier_call_do_not_appear() -> None:
    """The textures still hold the states of the call before, but no pass shows these states."""
    scene, *rays = few_rays(100, 3)
    with rt.Tracer(scene, "kd-restart", schedule="kernels") as tracer:
        before, _ = passes_of(tracer, *rays)
        tracer.trace(rays[0], -rays[1])
        again, _ = passes_of(tracer, *rays)
    assert [one.to_dict() for one in before] == [one.to_dict() for one in again]
    for one, other in zip(before, again):
        assert all((one.state[name] == other.state[name]).all() for name in one.state)


@pytest.mark.parametrize("method, options, why", [
    *((name, {}, "no state of each ray") for name in BATCHED), ("kd-packet", {}, "one pass"),
    ("kd-restart", {"schedule": "loop"}, "one pass to look at; use the schedule kernels or step$"),
    ("grid", {"packet": (2, 2), "schedule": "loop"},
     "grid with packet=2x2 runs only under schedule loop, .*; leave packet out$"),
    ("grid", {"schedule": "step", "sort_rays": True}, "sort_rays"),
    ("kd-restart", {"schedule": "step", "entry_points": 16}, "entry_points")])
def test_methods_without_states_are_refused(method: str, options: dict, why: str) -> None:
    with rt.Tracer(soup_scene(9, 1), method, **options) as tracer:
        with pytest.raises(rt.OptionError, match=why):
            travel(tracer, [[0, 0, 0]], [[0, 0, 1]], print)


def test_a_method_with_one_pass_names_methods_to_watch(tmp_path, capsys) -> None:
    """The methods that the error names can be watched by the same command."""
    command = ["passes", "cornell", "--size", "4x4", "-o", str(tmp_path / "passes"), "-m"]
    assert main([*command, "kd-stack"]) != 0
    told = capsys.readouterr().err.strip()
    assert told.splitlines() == [
        "gpgpu-rt: method kd-stack runs only under schedule loop, which has one pass to look at; "
        "watch kd-short-stack or kd-texture-stack"]
    for name in told.rpartition("watch ")[2].split(" or "):
        assert main([*command, name]) == 0


@pytest.mark.parametrize("method, schedule", [
    ("kd-restart", "step"), ("bvh-packet", "step"), ("kd-packet", "step"),
    pytest.param("grid", "kernels", marks=pytest.mark.full)])
def test_passes_are_written(tmp_path, method: str, schedule: str) -> None:
    folder = tmp_path / "passes"
    size = 18, 12
    (tmp_path / "passes").mkdir()
    for name in ("pass_9999.png", "pass_7.png"):
        (folder / name).write_text("old")
    (folder / "passes.json").write_text('{"passes": [{"picture": "pass_9999.png"}]}')
    with rt.Tracer("cornell", method, schedule=schedule) as tracer:
        found = write_passes(tracer, folder, size, every=9, states=True)
        origins, directions = tracer.scene.camera.rays(size)
        expected = tracer.trace(origins, directions)
        bounds = tracer.scene.bounds
    assert json.loads((folder / "passes.json").read_text()) == json.loads(json.dumps(found))
    rows = found["passes"]
    shown = [row for row in rows if "picture" in row]
    assert [row["pass"] for row in shown] == sorted({*range(0, len(rows), 9), len(rows) - 1})
    assert {path.name for path in folder.iterdir()} == {
        "passes.json", "passes.gif", "pass_7.png", *(row["picture"] for row in shown),
        *(row["states"] for row in shown)}
    with Image.open(folder / "passes.gif") as film:
        film.seek(film.n_frames // 2)
        shown_now = {tuple(c) for c in np.asarray(film.convert("RGB")).reshape(-1, 3).tolist()}
        assert {colours.PAPER, colours.INK, colours.category(1)} <= shown_now
        assert film.n_frames == len(even_loss([row["live"] for row in shown], 150))
    sizes = {Image.open(folder / row["picture"]).size for row in shown}
    assert len(sizes) == 1
    with np.load(folder / shown[-1]["states"]) as file:
        hits = RayBatch(origins, directions, bounds=bounds).hits(
            {name: file[f"hit_{name}"] for name in FIELDS})
    for name in FIELDS:
        assert (getattr(hits, name) == getattr(expected, name)).all()
    assert found["rays_hit"] == expected.hit.sum() and rows[-1]["live"] == 0


def test_interrupted_passes_leave_the_folder_as_it_was(tmp_path) -> None:
    folder = tmp_path / "passes"
    with rt.Tracer("cornell", "kd-restart", schedule="step") as tracer:
        found = write_passes(tracer, folder, (18, 12), most=7)
        pictures = sum("picture" in row for row in found["passes"])
        assert 3 <= pictures <= 8
        before = {path.name: path.read_bytes() for path in folder.iterdir()}
        assert len(before) == pictures + 2

        def interrupt(done: int, of: int) -> None:
            assert of >= len(found["passes"])
            if done == 5:
                raise KeyboardInterrupt
        for where in (folder, tmp_path / "new"):
            with pytest.raises(KeyboardInterrupt):
                write_passes(tracer, where, (18, 12), every=1, progress=interrupt)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert not (tmp_path / "new").exists()


def test_the_commands(tmp_path, capsys) -> None:
    folder, image = tmp_path / "out", tmp_path / "heat.png"
    assert main(["passes", "cornell", "-m", "bvh-threaded", "-o", str(folder), "--size", "12x8",
                 "--every", "8", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["options"]["schedule"] == "step" and (folder / "passes.gif").exists()
    for what in set(KINDS) - {"restarts"}:      # these two methods never restart
        assert main(["heat", "cornell", "-m", "grid", "-m", "bvh-threaded", "--what", what, "-o",
                     str(image), "--size", "12x8", "--json"]) == 0
        rows = json.loads(capsys.readouterr().out)["methods"]
        assert [row["method"] for row in rows] == ["grid", "bvh-threaded"]
        assert all(row["max"] > 0 for row in rows) and Image.open(image).width > 500
        # A far camera that looks away from the box hits nothing.
        assert main(["heat", "cornell", "-m", "grid", "--what", what, "-o", str(image), "--size",
                     "12x8", "--eye=9e5,0,0", "--target=9e6,0,0", "--json"]) == 0
        away, = json.loads(capsys.readouterr().out)["methods"]
        assert away["max"] < rows[0]["max"]
    image.unlink()
    for command, method, where, says in (
            ("passes", "ray-tiles", folder, "no state"),
            ("passes", "grid", folder / "a/b", "folder"),
            ("heat", "grid", tmp_path / "a.xyz", "image"), ("heat", "gird", image, "grid")):
        assert main([command, "cornell", "-m", method, "-o", str(where)]) == 1
        assert says in capsys.readouterr().err
    assert not image.exists()


def test_heat_is_the_cost_of_rays() -> None:
    """With one step per pass, a ray has as many passes as steps. The heat maps of a page have one
    scale."""
    with rt.Tracer("cornell", "kd-restart", schedule="step", statistics=True) as tracer:
        steps, passes = (heat(tracer, what, (20, 10)) for what in ("steps", "passes"))
    assert (steps.values == passes.values).all() and steps.values.shape == (10, 20)
    with rt.Tracer("cornell", "brute-force", statistics=True) as tracer:
        tested = heat(tracer, "triangles", (20, 10))
        assert (tested.values == len(tracer.scene)).all()
    page = np.asarray(draw_heat([steps, tested], "steps", "cornell", highest=float(
        tested.values.max())))
    right = page[40:120, 300:500].reshape(-1, 3)    # every pixel is at the top of the scale
    assert (right == right[0]).all() and right[0].tolist() == [252, 242, 160]


@pytest.mark.parametrize("schedule", ["step", "kernels"])
@pytest.mark.parametrize("method", [row.name for row in built_in_methods() if row.restarts])
def test_restarts_and_pops_follow_all_leaves_but_the_last(method: str, schedule: str) -> None:
    with rt.Tracer("tenk", method, schedule=schedule, statistics=True) as tracer:
        restarts, leaves = (heat(tracer, what, (24, 16)).values for what in ("restarts", "leaves"))
        pops, before = np.zeros(24 * 16, int), np.zeros(24 * 16, int)

        def look(one: Pass) -> None:
            stacked = one.state.get("stacked", before)
            pops[stacked < before] += 1
            before[:] = stacked
        travel(tracer, *tracer.scene.camera.rays((24, 16)), look)
    assert restarts.max() > 1 and pops.any() == tracer.method.stack
    assert (restarts + pops.reshape(16, 24) == np.maximum(leaves - 1, 0)).all()


@pytest.mark.parametrize("method, more, says", [
    ("kd-backtrack", {}, "these methods have it: kd-restart, kd-push-down, kd-short-stack"),
    ("kd-packet", {}, "no count of restarts"),
    ("kd-restart", {"steps_per_pass": 2}, "leave steps_per_pass and era out")])
def test_restarts_that_cannot_be_counted(method: str, more: dict, says: str) -> None:
    with rt.Tracer("cornell", method, schedule="step", **more) as tracer:
        with pytest.raises(rt.OptionError, match=says):
            heat(tracer, "restarts", (4, 4))


@pytest.mark.parametrize("method", [row.name for row in rt.methods() if row.packet])
def test_the_rays_of_a_packet_share_their_heat(tmp_path, capsys, method: str) -> None:
    """All rays of a packet have the same heat, and the command says this."""
    with rt.Tracer("cornell", method, packet=(4, 2), statistics=True) as tracer:
        blocks = heat(tracer, "nodes", (16, 8)).values.reshape(4, 2, 4, 4)
    assert (blocks == blocks[:, :1, :, :1]).all() and len(np.unique(blocks)) > 1
    for packet in ("4x2", "1x1"):
        assert main(["heat", "cornell", "-m", method, "--packet", packet, "--what", "nodes", "-o",
                     str(tmp_path / "heat.png"), "--size", "16x8"]) == 0
        said = capsys.readouterr().out
        assert ("its packet of 4x2 rays" in said) is (packet == "4x2")
