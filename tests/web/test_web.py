"""The page that runs in a browser: its text is closed, and its rays have the host's bits."""
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
from gpgpu_rt.errors import ShaderError
from gpgpu_rt.gl.es import es_text
from gpgpu_rt.web.export import PageData, export_method, web_names, why_not_in_browser
from gpgpu_rt.web.page import page_text

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
    ("int f(int i) { return int(TABLE_FETCH(node, i * 3 + 0).w); }",
     "int f(int i) { return int(TEXEL(node_table, vec2(TABLE_COLUMN, node_table_row), "
     "table_texel(i * 3 + 0)).w); }")])
def test_es_text(text: str, told: str) -> None:
    found = es_text(HEADER + text + "\n")
    assert found.startswith("#version 300 es\n") and found.endswith(told + "\n")


def test_joined_names_are_refused() -> None:
    with pytest.raises(ShaderError, match="joins no names"):
        es_text(HEADER + "#define READ(k) texels_##k\n")
    with pytest.raises(ShaderError, match="does not begin"):
        es_text("#version 120\n")


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
    told = json.loads(re.search(r'id="description">(.*?)</script>',
                                written(("kd-restart", "kd-push-down")), re.S)[1])
    first, second = ({name: source for one in method["schedules"]["step"]["passes"]
                      for name, source in one["inputs"].items() if source.startswith("table")}
                     for method in told["methods"])
    assert first == second


@pytest.mark.parametrize("words, message", [
    (["cornell", "-m", "bvh-packet", "-o", "a.html"], "does not run in a browser"),
    (["cornell", "-m", "kd-texture-stack", "-o", "a.html"], "other passes write"),
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
    names = web_names()
    assert len(names) >= 13
    assert all(bool(why_not_in_browser(row)) == (row.name not in names) for row in rt.methods())


def dumped(path: Path) -> str:
    """Returns the page's elements after Chromium has run its script."""
    assert CHROMIUM is not None
    return subprocess.run([CHROMIUM, *SWIFTSHADER, VIRTUAL_TIME, "--dump-dom", f"file://{path}"],
                          capture_output=True, text=True, timeout=300, check=True).stdout


@in_browser
@pytest.mark.parametrize("scene", ["cornell", "bunny", "kitchen"])
def test_rays_have_the_bits_of_the_host(exact_renderer, tmp_path: Path, scene: str) -> None:
    page = tmp_path / "page.html"
    names = tuple(web_names()) if scene == "cornell" else ("kd-restart", "grid", "bvh-threaded")
    page.write_text(written(names, scene))
    dom = dumped(page)
    assert 'id="message"></p>' in dom
    test = re.search(r'<p id="selftest"([^>]*)>', dom)[1]
    assert 'data-state="done"' in test and 'data-differing="0"' in test
    assert int(re.search(r'data-rays="(\d+)"', test)[1]) >= 4096 * len(names)
    assert re.findall(r'data-method="([\w-]+)"', dom) == list(names)


def _other_rays(told: dict) -> None:
    test = told["methods"][1]["test"]
    test["directions"] = test["hits"]


def _writes_nothing(told: dict) -> None:
    number = told["methods"][1]["schedules"]["loop"]["passes"][-1]["fragment"]
    told["texts"][number] = told["texts"][number].replace("void main() {",
                                                          "void main() { if (true) discard;")


@in_browser
@pytest.mark.parametrize("change", [_other_rays, _writes_nothing])
def test_wrong_hits_are_reported(exact_renderer, tmp_path: Path,
                                 change: Callable[[dict], None]) -> None:
    """The second method traces other rays, or writes nothing: the page must not call itself
    exact, although the first method left right hits in the targets."""
    page = tmp_path / "page.html"
    page.write_text(changed(written(("kd-restart", "bvh-threaded")), change))
    dom = dumped(page)
    test = re.search(r'<p id="selftest"([^>]*)>', dom)[1]
    assert 'data-state="done"' in test and 'data-differing="0"' not in test
    assert "so its pictures are not exact" in dom and "kd-restart: exact" in dom
