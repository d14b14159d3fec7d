"""The page that runs in a browser makes no request, and its hits equal the host's hits, bit for
bit."""
from __future__ import annotations

import base64
import hashlib
import html
import json
import re
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from devtools import CHROMIUM, SWIFTSHADER
from pages import changed, in_browser, written

import gpgpu_rt as rt
from gpgpu_rt.cli.main import main
from gpgpu_rt.errors import OptionError, ShaderError
from gpgpu_rt.gl.es import es_text
from gpgpu_rt.web import export, gallery
from gpgpu_rt.web.export import MOST_TEST_PASSES, export_method, web_names, why_not_in_browser
from gpgpu_rt.web.page import MOST_BYTES, page_text, write_page
from gpgpu_rt.web.page_data import PageData

VIRTUAL_TIME = "--virtual-time-budget=200000"
HEADER = ("#version 330 core\n#extension GL_ARB_gpu_shader5 : enable\n#ifdef GL_ARB_gpu_shader5\n"
          "#define PRECISE precise\n#else\n#define PRECISE\n#endif\n")


@pytest.mark.parametrize("text, told", [
    ("const float INFINITE = uintBitsToFloat(0x7f800000u);   // no end",
     "#define INFINITE (uintBitsToFloat(0x7f800000u))   // no end"),
    ("vec2 step = 1.0 / vec2(textureSize(rays, 0));",
     "#define step (1.0 / vec2(textureSize(rays, 0)))"),
    ("const float SPACING = 2.0 * UNIT;", "const float SPACING = 2.0 * UNIT;"),
    ("int top = 0;", "int top = 0;"),
    ("    vec2 inner = 1.0 / vec2(textureSize(rays, 0));",
     "    vec2 inner = 1.0 / vec2(textureSize(rays, 0));"),
    ("#define TABLE_FETCH(name, i) TEXEL(name##_table, vec2(TABLE_COLUMN, name##_table_row), "
     "table_texel(i))\nint f(int i) { return int(TABLE_FETCH(node, i * 3 + 0).w); }",
     "int f(int i) { return int(TEXEL(node_table, vec2(TABLE_COLUMN, node_table_row), "
     "table_texel(i * 3 + 0)).w); }")])
def test_es_text(text: str, told: str) -> None:
    """A program for desktop OpenGL becomes a program for OpenGL ES."""
    found = es_text(HEADER + text + "\n")
    assert found.startswith("#version 300 es\n") and found.endswith(told + "\n")


def test_joined_names_that_cannot_be_expanded_are_refused() -> None:
    with pytest.raises(ShaderError, match="cannot join names"):
        es_text(HEADER + "#define READ(k) texels_##k\n#define BOTH(k) READ(k)\n")
    with pytest.raises(ShaderError, match="does not begin"):
        es_text("#version 120\n")


@pytest.mark.parametrize("name", web_names())
def test_a_method_without_a_path_has_a_reason(name: str, monkeypatch) -> None:
    """A page shows no path if it lacks the method's schedule step, or if a state of this schedule
    belongs to several rays of a packet. A page leaves out schedules with too many passes."""
    scene = rt.load_scene("cornell")
    for most in (MOST_TEST_PASSES, 20):
        monkeypatch.setattr(export, "MOST_TEST_PASSES", most)
        try:
            method = export_method(scene, name, PageData())
        except OptionError as reason:
            assert "passes on this scene" in str(reason)
            continue
        step = method.schedules.get("step")
        shared = step and min(step["targets"][step["start"]["states"]]["of"]) < 1
        assert bool(method.no_path) == (not step or shared)


def test_the_page_makes_no_request_and_runs_its_own_script_only() -> None:
    text = written(("kd-restart",))
    assert not re.search(r"""\b(src|href)\s*=|url\(|@import|fetch\(|https?://""", text)
    policy = html.unescape(re.search('Content-Security-Policy" content="([^"]*)"', text)[1])
    script = re.search(r"<script>(.*?)</script>", text, re.S)[1]
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert policy.startswith("default-src 'none'") and f"script-src 'sha256-{digest}'" in policy


def test_names_cannot_inject_markup() -> None:
    scene = rt.Scene.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]],
                                 name="</script><script>alert(1)</script>")
    tables = PageData()
    text = page_text(scene, [export_method(scene, "brute-force", tables)], tables)
    assert "<script>alert" not in text
    assert text.count("<script") == 2 and text.count("</script>") == 2


def test_equal_tables_are_stored_once() -> None:
    told = description(written(("kd-restart", "kd-push-down")))
    first, second = ({name: source for one in method["schedules"]["step"]["passes"]
                      for name, source in one["inputs"].items() if source.startswith("table")}
                     for method in told["methods"])
    assert first == second


@pytest.mark.parametrize("words, message", [
    (["cornell", "-m", "ray-tiles", "-o", "a.html"], "does not run in a browser"),
    (["cornell", "-m", "ray-classification", "-o", "a.html"], "the rays of each call"),
    (["cornel", "-o", "a.html"], "cornel"),
    (["cornell", "-o", "missing/a.html"], "missing")])
def test_mistakes_get_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                               capsys: pytest.CaptureFixture, words: list[str],
                               message: str) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["web", *words]) == 1
    error = capsys.readouterr().err
    assert message in error and error.count("\n") == 1 and not list(tmp_path.iterdir())


def test_every_other_method_has_a_reason() -> None:
    """Each method that does not run in a browser has a reason why not."""
    others = {row.name: why_not_in_browser(row) for row in rt.methods()
              if row.name not in web_names()}
    assert set(others) == {"ray-engine", "ray-tiles", "ray-hierarchy", "ray-classification"}
    assert all(others.values())


def dumped(path: Path) -> str:
    """Returns a page's elements after Chromium has run the page's script."""
    assert CHROMIUM is not None
    return subprocess.run([CHROMIUM, *SWIFTSHADER, VIRTUAL_TIME, "--dump-dom", f"file://{path}"],
                          capture_output=True, text=True, timeout=300, check=True).stdout


THREE = ("kd-restart", "grid", "bvh-threaded")


@in_browser
@pytest.mark.parametrize("scene, names", [
    ("cornell", tuple(web_names())), ("bunny", THREE), ("kitchen", THREE),
    *(pytest.param(scene, tuple(name for name in web_names() if name not in too_long),
                   marks=pytest.mark.full)
      for scene, too_long in (("bunny", ("brute-force",)),
                              ("kitchen", ("brute-force", "visibility-field"))))])
def test_rays_have_the_bits_of_the_host(exact_renderer, tmp_path: Path, scene: str,
                                        names: tuple[str, ...]) -> None:
    page = tmp_path / "page.html"
    page.write_text(written(names, scene))
    assert page.stat().st_size < (8e6 if names == THREE else MOST_BYTES)
    dom = dumped(page)
    assert 'id="message"></p>' in dom
    test = re.search(r'<p id="selftest"([^>]*)>', dom)[1]
    assert 'data-state="done"' in test and 'data-differing="0"' in test
    told = description(written(names, scene))["methods"]
    assert f'data-rays="{4096 * sum(len(one["schedules"]) for one in told)}"' in test
    assert re.findall(r'<span class="method" data-method="([\w-]+)"', dom) == list(names)


def description(text: str) -> dict:
    """Returns the description of a page."""
    return json.loads(re.search(r'id="description">(.*?)</script>', text, re.S)[1])


def test_every_schedule_of_a_method_is_on_the_page() -> None:
    """On the scene cornell, the page has all schedules of at least 19 methods. Some schedules
    repeat several passes or several kernels."""
    told = {one["name"]: one["schedules"] for one in description(
        written(tuple(web_names())))["methods"]}
    assert len(told) >= 19
    assert all(sorted(told[row.name]) == sorted(row.schedules) for row in rt.methods()
               if row.name in told)
    stack = told["kd-texture-stack"]
    assert [len(turn["passes"]) for turn in stack["step"]["cycles"][0]["turns"]] == [2, 2]
    assert [one["kernel"] for one in stack["kernels"]["cycles"]] == [1, 2, 3, 4]
    assert [one["levels"] for one in stack["step"]["targets"] if "levels" in one]
    assert told["bvh-packet"]["step"]["targets"][1]["of"] == [0.5, 0.5]
    assert told["kd-short-stack"]["step"]["outputs"] == 6


def test_a_scene_with_too_many_steps_leaves_a_method_out(tmp_path: Path, capsys,
                                                         monkeypatch) -> None:
    monkeypatch.setattr(export, "MOST_TEST_PASSES", 90)
    with pytest.raises(OptionError, match="draws .* passes on this scene"):
        export_method(rt.load_scene("cornell"), "kd-texture-stack", PageData())
    left_out: dict[str, str] = {}
    found = write_page(rt.load_scene("cornell"), ["kd-texture-stack", "grid"],
                       str(tmp_path / "a.html"), left_out)
    assert [one.name for one in found] == ["grid"] and list(left_out) == ["kd-texture-stack"]


@pytest.mark.parametrize("output", ["a.html", "folder"])
def test_the_command_says_which_methods_have_no_steps(tmp_path: Path, capsys, monkeypatch,
                                                      output: str) -> None:
    """A page shows neither steps nor a path of a method if the page has only the method's schedule
    loop. The method may lack other schedules, or other schedules may draw too many passes."""
    monkeypatch.setattr(export, "MOST_TEST_PASSES", 60)
    monkeypatch.setattr(gallery, "TWINS", ())
    assert main(["web", "cornell", "-m", "kd-stack", "-m", "kd-restart", "-m", "grid", "-o",
                 str(tmp_path / output)]) == 0
    told = [line for line in capsys.readouterr().out.splitlines() if "no steps" in line]
    alone, passes = told
    assert alone == ("the page shows no steps and no path of kd-stack: method kd-stack runs only "
                     "under schedule loop, which has one pass to look at; watch kd-short-stack or "
                     "kd-texture-stack")
    assert re.fullmatch("the page shows no steps and no path of kd-restart: step draws [0-9]+ "
                        "passes on this scene", passes)


def _other_rays(told: dict) -> None:
    """Give the second method other directions."""
    test = told["methods"][1]["test"]
    test["directions"] = test["hits"]


def _writes_nothing(told: dict) -> None:
    """Disable the output of the last pass in the list of passes drawn once per trace."""
    discards(told, told["methods"][1]["schedules"]["loop"]["once"][-1])


def discards(told: dict, number: int, schedule: str = "loop") -> None:
    """Disable the output of a pass of the second method."""
    fragment = told["methods"][1]["schedules"][schedule]["passes"][number]["fragment"]
    told["texts"][fragment] = told["texts"][fragment].replace("void main() {",
                                                              "void main() { if (true) discard;")


def _never_pushes(told: dict) -> None:
    """Disable the output of the pass that pushes to the stack."""
    turn = told["methods"][1]["schedules"]["step"]["cycles"][0]["turns"][0]
    discards(told, turn["passes"][-1], "step")


def _wrong_stack(told: dict) -> None:
    """Remove the tile size, so that passes write the stack to a wrong place."""
    for one in told["methods"][1]["schedules"]["step"]["passes"]:
        one["sized"] = {name: size for name, size in one["sized"].items() if name != "tile_size"}


@in_browser
@pytest.mark.parametrize("change, second", [
    (_other_rays, "bvh-threaded"), (_writes_nothing, "bvh-threaded"),
    (_never_pushes, "kd-texture-stack"), (_wrong_stack, "kd-texture-stack")])
def test_wrong_hits_are_reported(exact_renderer, tmp_path: Path,
                                 change: Callable[[dict], None], second: str) -> None:
    """The page must not call the second method exact in three cases: this method traces other
    rays, a pass writes nothing, or a pass writes to a wrong place. The render targets may then
    still hold the right hits of the first method."""
    page = tmp_path / "page.html"
    page.write_text(changed(written(("kd-restart", second)), change))
    dom = dumped(page)
    test = re.search(r'<p id="selftest"([^>]*)>', dom)[1]
    assert 'data-state="done"' in test and 'data-differing="0"' not in test
    assert "so its pictures are not exact" in dom and "kd-restart: exact" in dom
