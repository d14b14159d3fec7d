"""Tests of the method table, options, contexts and the command line."""
from __future__ import annotations

import configparser
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.gl.context import open_gpu
from gpgpu_rt.gl.textures import read_texture
from gpgpu_rt.methods import find_method, register

METHODS = [row.name for row in rt.methods()]


def test_table_rows_are_complete() -> None:
    assert METHODS[:3] == ["brute-force", "ray-engine", "grid"]
    assert len(set(METHODS)) == len(METHODS)
    for row in rt.methods():
        fields = {field.name for field in row.state.fields}
        assert {"phase", "steps"} <= fields
        assert re.search(r"\d{4}", row.citation) and row.summary
        json.dumps(row.to_dict())
    with pytest.raises(rt.OptionError, match="already"):
        register(rt.methods()[0])


@pytest.mark.parametrize("arguments, message", [
    (dict(method="kd-restrat"), "did you mean .*kd-restart"),
    (dict(schedul="loop"), "did you mean schedule"),
    (dict(schedule="lop"), "did you mean loop"),
    (dict(steps_per_pass=0), "at least 1"),
    (dict(steps_per_pass="many"), "must be int"),
    (dict(octants=True, method="grid"), "has no option 'octants'"),
    (dict(context="elg"), "none of auto, egl, osmesa"),
    (dict(statistics="yes"), "must be bool"),
    (dict(method="grid", resolution=-1), "resolution"),
    (dict(schedule="loop", steps_per_pass=4), "steps_per_pass=4 runs under step only"),
    (dict(schedule="kernels", steps_per_pass=4), "steps_per_pass=4 runs under step only"),
    (dict(schedule="loop", mask_interval=4), "mask_interval=4 runs under kernels, step only"),
    (dict(rounding="up"), "all numbers are fp32"),
    (dict(rounding="up", precision="fp32"), "all numbers are fp32"),
    (dict(presort=True, sort_rays=True), "exclude each other"),
])
def test_bad_options(arguments: dict, message: str) -> None:
    with pytest.raises(rt.OptionError, match=message):
        rt.Tracer("cornell", **arguments)


@pytest.mark.parametrize("options, wanted", [
    ({"packet": "4x2"}, (4, 2)), ({"rasterised_bounds": "8"}, 8)])
def test_a_choice_may_be_given_as_it_is_spelt(options: dict, wanted: object) -> None:
    (name,) = options
    assert rt.Choice("bvh-packet", options).resolved()[1][name] == wanted


def test_an_option_selects_its_schedule() -> None:
    """Without a schedule, the option `steps_per_pass` selects the schedule `step`."""
    with rt.Tracer("cornell", steps_per_pass=4) as tracer:
        assert tracer.options["schedule"] == "step"


def test_no_context_is_one_clear_line() -> None:
    code = ("import sys, moderngl, gpgpu_rt.gl.context as g\n"
            "def no(*a, **k): raise Exception('none')\n"
            "moderngl.create_context = no\n"
            "g.OsMesaLoader._open = staticmethod(lambda: (_ for _ in ()).throw("
            "g.ContextError('no libOSMesa found')))\n"
            "from gpgpu_rt.cli import main\n"
            "sys.exit(main(['render', 'cornell', '-o', 'x.png']))\n")
    answer = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                            env={"PATH": "", "GPGPU_RT_CONTEXT": "auto", "HOME": "/"})
    assert answer.returncode == 1
    assert answer.stderr.count("\n") == 1 and "install" in answer.stderr


def test_an_existing_context_is_used() -> None:
    gpu = open_gpu()
    with rt.Tracer("cornell", context=gpu.context) as tracer:
        assert tracer.gpu is gpu  # two Gpu objects on one context would mix their logs
        assert tracer.trace([[0.0, 0, 1e4]], [[0, 0, -1.0]]) is not None


def test_render_and_statistics() -> None:
    with rt.Tracer("cornell", "kd-restart") as tracer:
        assert tracer.render(size=(64, 48)).size == (64, 48)
        image = tracer.render(size=(64, 64))
        assert image.mode == "RGB"
        statistics = tracer.statistics.to_dict()
    assert statistics["rays"] == 64 * 64 and statistics["passes"] >= 2
    assert statistics["texture_bytes"] > 0 and statistics["trace_seconds"] > 0
    json.dumps(statistics)
    pixels = np.asarray(image).astype(int)
    left, right = pixels[32, 4], pixels[32, 59]
    assert left[0] > 2 * left[1] and right[1] > 1.5 * right[0]  # red left, green right


@pytest.mark.parametrize("method", METHODS)
def test_methods_draw_the_same_picture(exact_renderer, method: str) -> None:
    pictures = []
    for name in ("brute-force", method):
        with rt.Tracer("shirley6", name) as tracer:
            pictures.append(np.asarray(tracer.render(size=(48, 48))))
    assert (pictures[0] == pictures[1]).all()
    assert len(np.unique(pictures[0].reshape(-1, 3), axis=0)) > 50


def test_eye_rays_of_the_gpu_are_the_cameras(exact_renderer) -> None:
    scene = rt.load_scene("cornell")
    with rt.Tracer(scene) as tracer:
        tracer.render(size=(33, 20))
        with tracer.gpu:
            origin, direction = (read_texture(t)[..., :3]
                                 for t in tracer.session.buffers.rays.textures)
    origins, directions = scene.camera.rays((33, 20))
    assert (origin == origins).all()
    np.testing.assert_allclose(direction, directions, atol=3e-7)


# The command line ----------------------------------------------------------------------------


def run(capsys, *arguments: str) -> tuple[int, str, str]:
    try:
        status = cli.main(arguments)
    except SystemExit as stopped:
        status = stopped.code
    out, err = capsys.readouterr()
    return status, out, err


def test_tables(capsys) -> None:
    for command in ("info", "methods", "scenes"):
        status, out, _ = run(capsys, command)
        assert status == 0 and len(out.splitlines()) >= 3
        status, out, _ = run(capsys, command, "--json")
        assert status == 0 and len(json.loads(out)) >= 2


def test_options_and_files_of_methods(capsys) -> None:
    """`gpgpu-rt methods NAME` lists the options of the named methods with their defaults and
    choices."""
    status, out, _ = run(capsys, "methods", "bvh-packet", "brute-force")
    told = [line.split()[:2] for line in out.splitlines()]
    assert status == 0 and ["--packet", "2x2"] in told and ["--octants", "no"] in told
    assert "sah, kay-kajiya" in out and "brute-force" in out
    assert "did you mean grid" in run(capsys, "methods", "gird")[2]


def test_render_command(capsys, tmp_path) -> None:
    target = tmp_path / "box.png"
    status, out, _ = run(capsys, "render", "cornell", "-m", "bvh-threaded", "--octants", "--build",
                         "kay-kajiya", "--size", "40x30", "-o", str(target))
    assert status == 0 and "passes" in out
    assert Image.open(target).size == (40, 30)


@pytest.mark.parametrize("words", [["--octants", "cornell"], ["cornell", "--octants", "true"],
                                   ["cornell", "--octants"]])
def test_a_scene_is_not_the_value_of_a_switch(capsys, tmp_path, words: list[str]) -> None:
    status, out, _ = run(capsys, "render", *words, "--size", "8", "--json",
                         "-o", str(tmp_path / "x.png"))
    assert status == 0 and json.loads(out)["options"]["octants"] is True


def test_a_place_may_begin_below_zero(capsys, tmp_path) -> None:
    pictures = []
    for words in (["--eye", "-1,0.5,2"], ["--eye=-1,0.5,2"], []):
        path = tmp_path / f"{len(words)}.png"
        status, _, _ = run(capsys, "render", "cornell", *words, "--size", "8", "-o", str(path))
        assert status == 0
        pictures.append(path.read_bytes())
    assert pictures[0] == pictures[1] != pictures[2]


def test_info_names_the_backend_that_is_used(capsys, monkeypatch) -> None:
    _, out, _ = run(capsys, "info")
    assert out.splitlines()[-1] == f"used without --context: {open_gpu().backend}"
    _, out, _ = run(capsys, "info", "--json")
    assert [row["backend"] for row in json.loads(out) if row["taken"]] == [open_gpu().backend]
    monkeypatch.setenv("GPGPU_RT_CONTEXT", "osmessa")
    for words in (["info"], ["info", "--json"]):
        status, out, err = run(capsys, *words)
        assert status == 1 and "did you mean osmesa" in err and bool(out) == (len(words) == 1)


def test_a_device_that_is_named_is_not_replaced() -> None:
    """With context "auto", OSMesa replaces a missing EGL, but never an EGL device that the user
    named."""
    answer = subprocess.run([sys.executable, "-m", "gpgpu_rt", "render", "cornell", "-o", "x.png"],
                            capture_output=True, text=True,
                            env={**os.environ, "GPGPU_RT_CONTEXT": "auto",
                                 "GPGPU_RT_EGL_DEVICE": "99"})
    assert answer.returncode == 1 and "another index" in answer.stderr


@pytest.mark.parametrize("text, note", [
    ("mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "no such file of materials gone"),
    ("mtllib .\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "file of materials . cannot be read")])
def test_what_is_odd_in_a_mesh_is_noted_in_a_line(capsys, tmp_path, text: str, note: str) -> None:
    (tmp_path / "one.obj").write_text(text)
    status, out, err = run(capsys, "render", str(tmp_path / "one.obj"), "--size", "8", "-o",
                           str(tmp_path / "x.png"))
    assert status == 0 and "wrote" in out
    assert note in err and err.startswith("gpgpu-rt: note: ") and err.count("\n") == 1
    with pytest.warns(UserWarning, match=note):
        rt.load_scene(str(tmp_path / "one.obj"))


def test_a_size_that_is_no_pair_is_named() -> None:
    with rt.Tracer("cornell") as tracer, pytest.raises(rt.OptionError, match="size is 5"):
        tracer.render(size=5)


def test_pictures_of_stopped_rays_say_so(capsys, tmp_path) -> None:
    status, out, _ = run(capsys, "render", "cornell", "-m", "kd-restart", "--step-cap", "1",
                         "--size", "8", "-o", str(tmp_path / "box.png"))
    assert status == 0 and "64 rays were stopped" in out


@pytest.mark.parametrize("word, cells", [("9", [9, 9, 9]), ("5,6,7", [5, 6, 7])])
def test_words_of_resolutions(word: str, cells: list[int]) -> None:
    option = next(o for o in find_method("grid").options if o.name == "resolution")
    with rt.Tracer("cornell", "grid", resolution=option.parse(word)) as tracer:
        assert tracer.accelerator.structure.resolution.tolist() == cells


def test_trace_command(capsys, tmp_path) -> None:
    scene = rt.load_scene("cornell")
    origins, directions = scene.camera.rays((8, 8))
    rays, found = tmp_path / "rays.npz", tmp_path / "hits.npz"
    np.savez(rays, origins=origins, directions=directions)
    status, out, _ = run(capsys, "trace", "cornell", str(rays), "-o", str(found), "--json",
                         "--statistics")
    assert status == 0 and json.loads(out)["method"] == "bvh-threaded"
    hits = np.load(found)
    assert (hits["triangle"] == rt.reference.trace(scene, origins, directions).triangle).all()
    assert {"t", "u", "v", "status", "nodes_visited"} <= set(hits)


BOUNDS = ["--max-wrong", "1e-3", "--max-t-error", "1e-3"]


@pytest.mark.parametrize("arguments, message", [
    (["render", "cornel", "-o", "{}/x.png"], "did you mean cornell"),
    (["render", "cornell", "--presort", "-o", "{}/x.png"], "use --sort-rays"),
    (["render", "cornell", "--schedule", "loop", "--steps-per-pass", "4", "-o", "{}/x.png"],
     "runs under step only"),
    (["trace", "cornell", "{}/rays.npz", "-o", "{}/hits.txt"], "end the name in .npz"),
    (["render", "gone.ply", "-o", "{}/x.png"], "gone.ply: no such file"),
    (["render", "stadium:7", "-o", "{}/x.png"], "ratio"),
    (["render", "cornell", "-m", "bvh-thread", "-o", "{}/x.png"], "did you mean bvh-threaded"),
    (["render", "cornell", "-o", "{}/no/x.png"], "there is no folder"),
    (["render", "cornell", "-o", "{}/x.txt"], "image format"),
    (["render", "cornell", "-o", "{}/x.png", "--steps-per-pass", "0"], "at least 1"),
    (["render", "cornell", "-o", "{}/x.png", "--octants", "-m", "grid"], "no option --octants"),
    (["render", "cornell", "-o", "{}/x.png", "--resolution", "5,6", "-m", "grid"],
     "give one number or three"),
    (["bench", "cornell", "--size", "8", "--runs", "0"], "give 1 or more"),
    (["render", "cornell", "-o", "{}/x.png", "--size", "0x3"], "not a size"),
    (["render", "cornell", "-o", "{}/x.png", "--size", "12x"], "not a size"),
    (["render", "cornell", "-o", "{}/x.png", "--size", "999999x2"], "fewer rays"),
    (["render", "cornell"], "-o/--output"),
    (["trace", "cornell", "{}/gone.npz", "-o", "{}/h.npz"], "cannot read rays"),
    (["trace", "cornell", "{}/bad.npz", "-o", "{}/h.npz"], "cannot read rays"),
    (["trace", "cornell", "{}/nan.npz", "-o", "{}/nan.npz"], "overwrite the rays"),
    (["accuracy", "cornell", "--precision", "fp16"], "--precisions"),
    (["trace", "cornell", "{}/one.npy", "-o", "{}/h.npz"], "cannot read rays"),
    (["trace", "cornell", "{}/torn.npz", "-o", "{}/h.npz"], "cannot read rays"),
    (["render", "{}/torn.npz", "--frames", "1", "-o", "{}"], "cannot read an animation"),
    (["render", "{}/torn.npz", "-o", "{}/x.png"], "cannot read a geometry image"),
    (["bench", "cornell", "--size", "8", "-m", "kd-stack", "--schedule", "step"], "loop only"),
    (["accuracy", "cornell", "-m", "kd-short-stack", "--stack-size", "16"], "none of 1, 2, 3, 4"),
    (["bench", "cornell", "--size", "8", "-m", "kd-stack,bvh-stack", "--build", "zhou"],
     "method bvh-stack: option build='zhou' is none of"),
    (["render", "cornell", "-o", "{}/x.png", "-m", "kd-stack", "--build", "zhou", "--split",
      "exact"], "split needs build sah or hybrid"),
    (["trace", "cornell", "{}/empty.npz", "-o", "{}/h.npz"], "has no directions"),
    (["trace", "cornell", "{}/nan.npz", "-o", "{}/h.npz"], "ray 1 is invalid"),
    (["fly"], "invalid choice"),
    (["render", "cornell", "-m", "grid", "-m", "bih", "-o", "{}/x.png"], "twice, grid and bih"),
    (["render", "cornell", "-m", "grid", "--density", "3", "--resolution", "4", "-o", "{}/x.png"],
     "exclude each other"),
    (["bench", "cornell", "-m", "grid,"], "empty name; give NAME,NAME,... without spaces"),
    (["passes", "cornell", "-m", "grid,bih", "-o", "{}/new"], "give one name: grid or bih"),
    (["render", "cornell,tenk", "-o", "{}/x.png"], "give one name: cornell or tenk"),
    (["render", "cornell,x", "-o", "{}/x.png"], "did you mean cornell"),
    (["passes", "cornell", "-m", "grid", "-o", "{}/bad.npz"], "a file has this name"),
    (["bench", "cornell", "--size", "8x4"], "not the side of a square"),
    (["bench", "cornell", "--size", "-3"], "not the side of a square"),
    (["tune", "cornell", *BOUNDS, "--budget", "-1"], "give seconds"),
    (["tune", "cornell", *BOUNDS, "--rays", "0"], "of 1 or more"),
    (["tune", "cornell", *BOUNDS, "--seed", "-3"], "of 0 or more"),
    (["render", "cornell", "-m", "auto", "--packet", "2x2", "-o", "{}/x.png"], "name the method"),
    (["bench", "cornell", "-m", "auto"], "auto is not a method"),
    (["hardware", "--methods", "--sources"], "give one"),
    (["bench", "cornell", "--size", "8", "--stack-size", "4", "--cells", "grid"],
     "no method accepts all of these options: cells=grid, stack_size=4"),
    (["passes", "cornell", "-m", "kd-stack", "-o", "{}/new"], "loop"),
    (["render", "cornell", "-o", "{}/x.png", "--octnats"],
     "render has no --octnats; did you mean --octants or"),
    (["render", "cornell", "-o", "{}/x.png", "--qqqq=3"], "render has no --qqqq (see"),
    (["trace", "cornell", "{}/nan.npz", "more", "-o", "{}/h.npz"],
     "run gpgpu-rt trace again for more (see"),
])
def test_mistakes_are_one_line(capsys, tmp_path, tmp_path_factory, monkeypatch,
                               arguments: list[str], message: str) -> None:
    # Another test may have stored settings of `tune`, about which `auto` prints a note.
    monkeypatch.setenv("GPGPU_RT_CACHE", str(tmp_path_factory.mktemp("cache")))
    (tmp_path / "bad.npz").write_bytes(b"PK not an archive")
    np.savez(tmp_path / "empty.npz", stuff=np.zeros(3))
    np.save(tmp_path / "one.npy", np.zeros(3))
    np.savez_compressed(tmp_path / "torn.npz", origins=np.random.default_rng(1).random((99, 3)))
    whole = bytearray((tmp_path / "torn.npz").read_bytes())
    whole[99:120] = bytes(21)  # damage the compressed data, which zlib notices
    (tmp_path / "torn.npz").write_bytes(whole)
    np.savez(tmp_path / "nan.npz", origins=[[0, 0, 0], [np.nan, 0, 0]], directions=np.ones((2, 3)))
    before = sorted(tmp_path.iterdir())
    status, out, err = run(capsys, *(a.replace("{}", str(tmp_path)) for a in arguments))
    assert status in (1, 2) and message in err
    assert err.count("\n") == 1 and "Traceback" not in err
    assert sorted(tmp_path.iterdir()) == before  # no partial output


def test_a_missing_folder_of_scenes_is_reported(capsys, tmp_path, monkeypatch) -> None:
    monkeypatch.setenv("GPGPU_RT_SCENES", os.pathsep.join([str(tmp_path), str(tmp_path / "gone")]))
    status, out, err = run(capsys, "render", "cornell", "-o", str(tmp_path / "x.png"), "--size",
                           "8")
    assert status == 0 and (tmp_path / "x.png").exists()
    assert err.count("\n") == 1 and f"there is no folder {tmp_path / 'gone'}; create it" in err


def test_every_folder_is_installed() -> None:
    """setup.cfg lists every package folder, because a wheel contains only listed folders. An
    editable install would hide a missing folder."""
    root = Path(rt.__file__).parents[1]
    config = configparser.ConfigParser()
    config.read(root / "setup.cfg")
    listed = config["options"]["packages"].split()
    folders = ["gpgpu_rt" + "." * (part != ".") + part.replace("/", ".") * (part != ".")
               for part in (str(path.parent.relative_to(root / "gpgpu_rt"))
                            for path in root.glob("gpgpu_rt/**/__init__.py"))]
    figures = [".".join(("gpgpu_rt", *path.parent.relative_to(root).parts))
               for path in root.glob("figures/**/__init__.py")]
    assert sorted(listed) == sorted([*folders, *figures, "gpgpu_rt.glsl"])
