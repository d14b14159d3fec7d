"""`gpgpu-rt bench`: the other engines return the hits of `Tracer`, and ratios and verdicts follow
from the timed rounds."""
from __future__ import annotations

import functools
import importlib
import json
import os
import re
import subprocess
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.bench import (
    ENGINES, RAY_SETS, Entry, Workload, embree_in_c, engines, race, ranked, too_noisy, uncertain,
    workload
)
from gpgpu_rt.bench.engines import EMBREE, OWN
from gpgpu_rt.cli import benching
from gpgpu_rt.gl.context import open_gpu, threads_of
from gpgpu_rt.gl.environment import environment

SIZE = 24
# The attribute `gpgpu_rt.bench.race` is the function `race`, so get the module from importlib.
race_module = importlib.import_module("gpgpu_rt.bench.race")


@pytest.mark.parametrize("kind", RAY_SETS)
@pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)
def test_engines_answer_the_same_question(engine, kind: str) -> None:
    if engine.missing:
        pytest.skip(engine.missing)
    scene = rt.load_scene("cornell")
    rays = workload("cornell", RAY_SETS[kind], SIZE).compact(engine.most)
    if rays.t_max is not None and not engine.ends:
        pytest.skip("this engine supports only rays without an end")
    if engine.name == OWN and kind not in ("eye", "random"):
        pytest.skip("this engine hits the surface that a ray leaves")
    found = engine.prepare(scene, rays)()
    with rt.Tracer(scene) as tracer:
        if rays.any_hit:
            ours = tracer.occluded(rays.origins, rays.directions, rays.t_max)
        else:
            ours = tracer.trace(rays.origins, rays.directions).triangle
    assert found.shape == ours.shape and found.dtype.kind == ours.dtype.kind
    # Where walls meet in an edge, either triangle is right.
    assert (found == ours).mean() > (0.99 if rays.any_hit else 0.97)


def test_compact_drops_pixels_without_a_ray() -> None:
    """A ray with a NaN component or a zero direction marks a pixel without a ray. `compact` drops
    such rays."""
    nan = np.float32(np.nan)
    rays = Workload(np.float32([[0, 0, 0], [nan] * 3, [2, 0, 0], [3, 0, 0]]),
                    np.float32(np.ones((4, 3))), 2, np.float32([1, 2, 3, 4]), True)
    found = rays.compact()
    assert found.origins[:, 0].tolist() == [0, 2, 3] and found.ends.tolist() == [1, 3, 4]
    assert rays.compact(2).origins[:, 0].tolist() == [0, 3]
    assert found.live == 3 and found.any_hit
    rays.directions[0, 1], rays.directions[2] = nan, 0  # pixels with a NaN or zero direction
    again = replace(rays)
    assert again.live == again.compact().live == 1
    with rt.Tracer("cornell") as tracer:
        found = tracer.trace(rays.origins, rays.directions, invalid="miss")
    assert (found.status == 0).tolist() == again.has_ray.tolist()


def test_rays_lie_in_tiles_of_the_image() -> None:
    places = np.stack([*np.indices((4, 4))[::-1], np.ones((4, 4))], -1).reshape(-1, 3)
    rays = Workload(np.float32(places), np.float32(np.ones((16, 3))), 4)
    x, y = rays.compact(tile=(2, 2)).origins[:8, :2].T.astype(int).tolist()
    assert list(zip(x, y)) == [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (3, 0), (2, 1), (3, 1)]


def test_blocks_of_rays_are_filled_with_rays_that_miss() -> None:
    rays = workload("cornell", RAY_SETS["eye"], 3)
    blocks = embree_in_c.laid_out(rays, 8)
    assert blocks.shape == (2, embree_in_c.FIELDS, 8)
    assert np.array_equal(blocks[0, 4:7].T, rays.directions[:8])
    assert np.array_equal(blocks[1, :3, 0], rays.origins[8])
    assert (blocks[1, 8, 1:] < 0).all() and np.isinf(blocks[1, 8, 0])


def test_embree_in_c_says_what_it_lacks(monkeypatch, tmp_path) -> None:
    monkeypatch.setattr(embree_in_c, "HEADERS", (tmp_path,))
    assert embree_in_c.missing() == "libembree-dev is not installed" and not embree_in_c.version()
    (tmp_path / "rtcore_config.h").write_text('#define RTC_VERSION_STRING "9.8.7"\n')
    assert embree_in_c.version() == "9.8.7"
    monkeypatch.setenv("PATH", str(tmp_path))
    assert embree_in_c.missing() == "there is no C compiler (cc)"


def test_embree_in_c_tells_of_a_failed_compilation(monkeypatch, tmp_path) -> None:
    (tmp_path / "rtcore_config.h").write_text("")
    compiler = tmp_path / "cc"
    compiler.write_text("#!/bin/sh\necho no such header >&2\nexit 1\n")
    compiler.chmod(0o755)
    monkeypatch.setattr(embree_in_c, "HEADERS", (tmp_path,))
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin")
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    embree_in_c._library.cache_clear()
    try:
        assert embree_in_c.missing() == "libembree-dev cannot be used: no such header"
    finally:
        embree_in_c._library.cache_clear()


def test_a_title_gives_the_number_of_traced_rays(capsys) -> None:
    """If an engine traces only a part of the rays, its title gives the number of these rays."""
    own = next(one for one in ENGINES if one.name == OWN)
    if own.missing:
        pytest.skip(own.missing)
    lines: list[str] = []
    ours, theirs = race("cornell", RAY_SETS["eye"], [("grid", {})], SIZE, 1,
                        [replace(own, most=100)], lines.append)
    assert (ours.title, theirs.title) == ("grid", f"{OWN}, 100 of 576 rays")
    assert "building for 1 candidate" in [line.partition(": ")[2] for line in lines]
    benching._print("cornell", "eye", [ours, theirs], SIZE)
    assert f"{OWN}, 100 of 576 rays" in capsys.readouterr().out


def test_a_race_has_a_ratio_for_each_round() -> None:
    """In each round, a race divides embreex's seconds by the seconds of each entry."""
    entries = race("cornell", RAY_SETS["eye"], [("grid", {}), ("bvh-threaded", {"octants": True})],
                   SIZE, 2, [one for one in ENGINES if one.name == EMBREE])
    assert [entry.name for entry in entries][:2] == ["grid", "bvh-threaded"]
    assert all(len(entry.seconds) == 2 and entry.rays == SIZE ** 2 for entry in entries)
    assert entries[0].bytes_a_triangle > 48  # a triangle's corners are three texels of 16 bytes
    if len(entries) == 3:
        ours, theirs = entries[0], entries[2]
        assert ours.over == pytest.approx([b / a for a, b in zip(ours.seconds, theirs.seconds)])


def _entry(name: str, seconds: list[float], over: list[float]) -> Entry:
    return Entry(name, {}, 10, seconds, seconds, over, over)


@pytest.mark.parametrize("over, verdict", [
    ([1.1, 1.5, 2.0], "faster"), ([0.9, 0.5, 0.99], "slower"), ([0.9, 1.1, 3], "not told apart")])
def test_a_verdict_needs_every_round(over: list[float], verdict: str) -> None:
    """A method gets the verdict "faster" only if it is faster in every round. The same rule holds
    for "slower"."""
    assert _entry("grid", [1, 1, 1], over).verdict() == verdict


@pytest.mark.parametrize("seconds, why", [([1, 1.2, 1.1], ""), ([1, 1.6, 1.1], "too busy"),
                                          ([1, 1], "2 runs cannot decide")])
def test_a_busy_machine_gives_no_verdict(seconds: list[float], why: str) -> None:
    """There is no verdict on a busy machine, from fewer than 3 runs, or without embreex."""
    assert why in too_noisy([_entry(EMBREE, seconds, seconds)])
    assert bool(too_noisy([_entry(EMBREE, seconds, seconds)])) == bool(why)
    assert "did not run" in too_noisy([_entry("grid", [1, 1, 1], [])])


def test_rates_of_a_large_spread_are_called_uncertain(capsys) -> None:
    """The warning names each unsteady entry, even if embreex is steady or missing."""
    steady, unsteady = _entry(EMBREE, [1, 1.1, 1], [1, 1, 1]), _entry("grid", [1, 1.6, 1], [2] * 3)
    assert uncertain([steady, unsteady]) == uncertain([unsteady]) == [unsteady]
    benching._warn("cornell", "eye", [steady, unsteady])
    assert capsys.readouterr().err == (
        "cornell, eye rays: uncertain rates, because the slowest run took more than 1.5 times the "
        "fastest; measure again on an idle machine: grid\n")
    benching._warn("cornell", "eye", [steady])
    assert not capsys.readouterr().err


@pytest.mark.parametrize("more", [[], ["--json"]], ids=str)
def test_warnings_go_to_stderr(more: list[str], capsys, monkeypatch) -> None:
    """The warnings are not part of the table or of the JSON, which may be written to a file."""
    monkeypatch.setattr(benching, "race", lambda *_: [
        _entry(EMBREE, [1, 1.7, 1], [1, 1, 1]), _entry("grid", [1, 1.6, 1], [2] * 3)])
    assert cli.main(["bench", "cornell", "--rays", "shadow", *more]) == 0
    out, err = capsys.readouterr()
    assert f"cornell, shadow rays: no verdict: the slowest run of {EMBREE} took 1.70 times" in err
    assert "cornell, shadow rays: uncertain rates, " in err and err.endswith(
        f"idle machine: {EMBREE}; grid\n")
    assert "no verdict" not in out and "measure again" not in out


@pytest.fixture
def apart() -> list[Entry]:
    """Returns entries in which the packets have the better median rate, but the grid is faster in
    most rounds."""
    embree = _entry(EMBREE, [1.0, 2.0, 1.0], [1, 1, 1])
    grid = _entry("grid", [0.5, 1.1, 1.1], [2, 1.8, 0.9])
    packet = _entry("bvh-packet", [1.0, 2.0, 0.9], [1, 1.0, 1.1])
    packet.options = {"packet": (4, 2), "octants": True}
    return [embree, packet, grid]


def test_rows_are_in_order_of_the_ratio(apart: list[Entry], capsys) -> None:
    assert apart[1].rays_per_second > apart[2].rays_per_second
    benching._print("cornell", "mirror", apart, 64)
    out = capsys.readouterr().out.splitlines()
    assert [line.split()[0].strip(",") for line in out[3:6]] == ["grid", "embreex", "bvh-packet"]
    assert out[0].endswith("mirror rays of 64 x 64 pixels")
    for entry in apart:  # without embreex, the rates decide the order
        entry.over = []
    assert [entry.name for entry in ranked(apart)][0] == EMBREE


def test_the_set_up_page_names_columns_that_the_table_has(apart: list[Entry], capsys) -> None:
    page = Path(rt.__file__).parents[1] / "docs" / "set-up.md"
    named = re.findall(r"`([^`]+)`", page.read_text().partition("It prints a table: ")[2])
    benching._print("cornell", "mirror", apart, 64)
    heads = re.split(r"  +", capsys.readouterr().out.splitlines()[1])
    assert len(named) == 4 and set(named) <= set(heads)


def test_the_chart_has_the_entries_of_the_table(apart: list[Entry], tmp_path) -> None:
    pytest.importorskip("matplotlib")
    from gpgpu_rt.bench.chart import draw
    draw([("box", "mirror rays of 64 x 64 pixels", apart),
          ("box", "eye rays", [_entry("grid", [1.0, 1.0, 1.0], [])])],
         str(tmp_path / "b.svg"), "llvmpipe, on 2 threads")
    # The SVG draws text as outlines. A comment beside each outline contains the text. The first
    # bar in the file is the chart's lowest bar.
    texts = [line.strip()[5:-4] for line in (tmp_path / "b.svg").read_text().splitlines()
             if line.strip().startswith("<!--")]
    assert [text for text in texts if text.startswith(("grid", "embree", "bvh"))] == [
        "bvh-packet packet=4x2 octants", EMBREE, "grid", "grid"]
    assert {"box, mirror rays of 64 x 64 pixels", "llvmpipe, on 2 threads"} <= set(texts)
    assert any(text.startswith("no verdict: the slowest run") for text in texts)
    assert any(text.startswith("no verdict: embreex did not run") for text in texts)
    assert texts.count("million rays per second: the median of the rounds, and a line from the "
                       "slowest to the fastest round") == 2
    assert texts.count("in brackets: the ratio to the rate of embreex on one thread") == 1
    assert any("0.00001 (1)" in text for text in texts)


def test_the_chart_writes_a_rate_at_the_end_of_its_bar(tmp_path, monkeypatch) -> None:
    chart = pytest.importorskip("gpgpu_rt.bench.chart")
    drawn = []
    monkeypatch.setattr(chart, "save", lambda figure, *_: drawn.append(figure))
    chart.draw([("box", "eye rays", [_entry("grid", [1.0, 2.0, 3.0], [])])], "", "")
    axis, = drawn[0].axes
    value, = axis.texts
    assert value.xy[0] == axis.patches[0].get_width()


def test_bench_command(capsys, tmp_path) -> None:
    pytest.importorskip("matplotlib")
    chart = tmp_path / "b.png"
    assert cli.main(["bench", "cornell", "--size", "16", "--runs", "1", "-m", "grid,kd-restart",
                     "--rays", "eye,random", "--json", "--plot", str(chart)]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["environment"] == asdict(environment())
    assert [one["rays"] for one in found["races"]] == ["eye", "random"]
    assert all(one["rays_per_second"] > 0 for race in found["races"] for one in race["entries"])
    assert Image.open(chart).width > 100


@pytest.mark.parametrize("failure", ["ImportError", "OSError"])
def test_an_engine_that_cannot_be_imported_is_left_out(capsys, tmp_path, monkeypatch,
                                                       failure: str) -> None:
    (tmp_path / "embreex").mkdir()
    (tmp_path / "embreex" / "__init__.py").write_text(f"raise {failure}('broken\\nengine')\n")
    for name in [name for name in sys.modules if name.split(".")[0] == "embreex"]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(engines, "_absent", functools.cache(engines._absent.__wrapped__))
    assert cli.main(["bench", "cornell", "--size", "8", "--runs", "1", "-m", "grid"]) == 0
    out, err = capsys.readouterr()
    why, = (line for line in out.splitlines() if "broken engine" in line)
    assert why.startswith("left out because embreex cannot be imported "
                          f"({failure}: broken engine): "
                          f"{EMBREE}")
    assert "cornell, eye rays: no verdict: embreex did not run" in err


def test_repeated_kinds_of_rays_and_bad_scenes(capsys, tmp_path) -> None:
    """A kind of rays that is named twice is raced once. A bad scene gives an error of one line."""
    bench = ["bench", "cornell", "--size", "8", "--runs", "1", "-m", "grid", "--json"]
    assert cli.main([*bench, "--rays", "random,eye,random"]) == 0
    assert [one["rays"] for one in json.loads(capsys.readouterr().out)["races"]] == [
        "random", "eye"]
    path = tmp_path / "no-face.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n")
    assert cli.main(["bench", str(path), "--size", "8", "-m", "grid"]) == 1
    error, = capsys.readouterr().err.splitlines()
    assert str(path) in error and "triangle" in error


@pytest.mark.parametrize("asked, threads", [("3", 3), ("0", 1)])
def test_the_renderers_threads_are_counted(asked: str, threads: int) -> None:
    assert threads_of("GeForce 8800 GTX/PCIe/SSE2") is None and threads_of("softpipe") == 1
    if "llvmpipe" not in open_gpu().renderer or not os.path.isdir("/proc/self/task"):
        pytest.skip("only the threads of llvmpipe on Linux can be counted")
    program = ("import gpgpu_rt as rt; from gpgpu_rt.gl.context import open_gpu, threads_of; "
               "rt.Tracer('cornell', 'brute-force').trace([[0, 0, 0]], [[0, 0, -1]]); "
               "print(threads_of(open_gpu().renderer))")
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                           check=True, env={**os.environ, "LP_NUM_THREADS": asked})
    assert int(found.stdout) == threads


@pytest.mark.parametrize("words, message", [(["--runs", "0"], "give 1 or more"),
                                            (["--rays", "eyes"], "did you mean eye"),
                                            (["--plot", "no/such/b.png"], "there is no folder"),
                                            (["--plot", "b.xyz"], "name in .png or .svg or .pdf"),
                                            (["--plot", "b"], "name in .png")])
def test_mistakes_are_one_line(capsys, words: list[str], message: str) -> None:
    assert cli.main(["bench", "cornell", "--size", "8", "-m", "grid", *words]) == 1
    assert message in capsys.readouterr().err


def test_a_race_refuses_a_negative_number_of_pixels() -> None:
    with pytest.raises(rt.Error, match="cannot have -3 pixels"):
        race("cornell", RAY_SETS["eye"], [("grid", {})], -3, 1, ())


def test_options_go_to_the_default_methods_that_have_them(capsys) -> None:
    parser = importlib.import_module("gpgpu_rt.cli.main").command_parser()
    chosen = parser.parse_args(["bench", "cornell", "--packet", "2x2"])
    found = dict(benching._candidates(chosen))
    assert found["bvh-packet"]["packet"] == (2, 2) and "bvh-threaded" not in found
    assert found["kd-packet"] == {"packet": (2, 2)}
    left = capsys.readouterr().err
    assert "bvh-threaded" in left and "kd-packet" not in left
    found = benching._candidates(parser.parse_args(
        ["bench", "cornell", "--octants", "true", "--quantise-nodes", "16"]))
    assert [name for name, _ in found].count("bvh-threaded") == 1


def test_a_race_frees_its_tracers(monkeypatch) -> None:
    released = []

    class Noted(rt.Tracer):
        def release(self) -> None:
            released.append(self.method.name)
            super().release()

    monkeypatch.setattr(race_module, "Tracer", Noted)
    race("cornell", RAY_SETS["eye"], [("grid", {}), ("kd-restart", {})], 8, 1, ())
    assert sorted(released) == ["grid", "kd-restart"]
