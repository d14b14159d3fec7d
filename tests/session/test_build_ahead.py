"""If another process builds the frames ahead, hits, pictures and errors are the same as with
`update`."""
from __future__ import annotations

import os
import signal
from collections.abc import Iterator

import numpy as np
import pytest
from conftest import RAY_SETS, assert_same_bits, soup_scene
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.session import build_ahead

BY_PASSES = {"geometry-image"}      # methods whose accelerators are built by passes
SCENE = soup_scene(120, 3)
RAYS = RAY_SETS["random"](SCENE, 200, 3)


def positions(count: int = 3) -> list[np.ndarray]:
    """Return the (n, 3, 3) float32 triangles of each frame. Each triangle moves in its own
    direction."""
    way = np.random.default_rng(5).normal(0, 0.2, (len(SCENE), 1, 3)).astype(np.float32)
    return [SCENE.triangles + np.float32(frame + 1) * way for frame in range(count)]


def in_turn(method: str, **options: object) -> Iterator[rt.Hits]:
    """Update a tracer frame by frame, and yield the hits of each frame."""
    with rt.Tracer(SCENE, method, **options) as tracer:
        for frame in positions():
            tracer.update(frame)
            yield tracer.trace(*RAYS)


@pytest.mark.parametrize("method, options", [
    *((row.name, {}) for row in rt.methods() if row.name not in BY_PASSES),
    ("bvh-packet", {"packet": (4, 2), "octants": True, "quantise_nodes": 16}),
    ("kd-restart", {"entry_points": 4, "build": "zhou"}), ("kd-stack", {"precision": "fp16"})],
    ids=str)
def test_frames_built_ahead_equal_the_frames_of_update(method: str, options: dict) -> None:
    with rt.Tracer(SCENE, method, **options) as tracer:
        first = tracer.trace(*RAYS)
        moves = tracer.updates(positions())
        # While the first frame is built, the tracer still has the triangles of the scene.
        assert_same_bits(tracer.trace(*RAYS), first)
        count = 0
        for expected, _ in zip(in_turn(method, **options), moves):
            assert_same_bits(tracer.trace(*RAYS), expected)
            assert tracer.statistics.rebuilt and tracer.statistics.build_seconds > 0
            count += 1
        assert count == 3 and next(moves, "the end") == "the end"
        tracer.update(SCENE.triangles)
        assert_same_bits(tracer.trace(*RAYS), first)


def test_a_frame_is_built_while_the_frame_before_it_is_traced(monkeypatch) -> None:
    """When the caller gets frame n, the build of frame n + 1 has begun, but no later build."""
    begun: list[int] = []
    begin = build_ahead.Builds.begin
    monkeypatch.setattr(build_ahead.Builds, "begin", lambda builds, scene: (
        begun.append(len(begun)), begin(builds, scene))[1])
    with rt.Tracer(SCENE, "kd-stack") as tracer:
        seen = [len(begun) for _ in tracer.updates(positions())]
    assert seen == [2, 3, 3]


def test_a_bad_frame_is_reported_after_the_frame_before_it() -> None:
    good, bad = positions(2)
    bad[7, 1, 2] = np.nan
    with rt.Tracer(SCENE, "kd-stack") as tracer:
        moves = tracer.updates([good, bad, good])
        next(moves)
        expected = next(in_turn("kd-stack"))
        assert_same_bits(tracer.trace(*RAYS), expected)
        with pytest.raises(rt.SceneError, match="finite"):
            next(moves)
        assert_same_bits(tracer.trace(*RAYS), expected)
        with pytest.raises(rt.SceneError, match="finite"):
            tracer.updates([bad])


@pytest.mark.parametrize("method, options, message", [
    ("geometry-image", {}, "builds with passes"),
    ("kd-stack", {"build": "zhou", "build_device": "gpu"}, "builds with passes"),
    (rt.Choices(rt.Choice("bvh-packet"), rt.Choice("kd-restart")), {}, "has two")], ids=str)
def test_structures_that_cannot_be_built_ahead(method, options: dict, message: str) -> None:
    """`updates` is refused if GPU passes build the structure, or if there are two structures."""
    with rt.Tracer(SCENE, method, **options) as tracer:
        with pytest.raises(rt.OptionError, match=message):
            tracer.updates(positions())


def test_no_frames() -> None:
    with rt.Tracer(SCENE, "kd-stack") as tracer:
        assert list(tracer.updates([])) == []


def test_a_process_that_is_killed_gives_one_line() -> None:
    with rt.Tracer(SCENE, "kd-stack") as tracer:
        moves = tracer.updates(positions())
        next(moves)
        worker, = moves.gi_frame.f_locals["builds"]._pool._processes.values()
        os.kill(worker.pid, signal.SIGKILL)
        with pytest.raises(rt.Error, match="ended early") as caught:
            list(moves)
        assert "\n" not in str(caught.value)
        tracer.update(SCENE.triangles)      # the tracer still works


def run(*words: str) -> int:
    try:
        return cli.main(list(words)) or 0
    except SystemExit as end:
        return int(end.code or 0)


def test_the_command_builds_ahead(tmp_path, capsys) -> None:
    """`render --frames` writes the same frames with and without `--build-ahead`."""
    for name, more in (("turn", ()), ("ahead", ("--build-ahead",))):
        (tmp_path / name).mkdir()
        assert run("render", "walker", "-m", "bih", "--size", "16", "--frames", "3", "-o",
                   str(tmp_path / name), *more) == 0
    assert "rebuilt ahead" in capsys.readouterr().out
    for path in sorted((tmp_path / "turn").iterdir()):
        one, other = (np.asarray(Image.open(tmp_path / name / path.name))
                      for name in ("turn", "ahead"))
        assert np.array_equal(one, other)
    assert run("render", "walker", "--build-ahead", "-o", str(tmp_path / "x.png")) == 1
    err = capsys.readouterr().err
    assert "--build-ahead needs --frames" in err and err.count("\n") == 1
