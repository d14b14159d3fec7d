"""Tests the gallery: a page for each method that runs in a browser, and an index that links to all
pages. Some figures of ``make figures`` have a page too (a "twin")."""
from __future__ import annotations

import re
from pathlib import Path

import pytest

import gpgpu_rt as rt
from gpgpu_rt.cli.main import main
from gpgpu_rt.methods import built_in_methods
from gpgpu_rt.report import CHAPTERS, write_report
from gpgpu_rt.scene.loading import list_scenes
from gpgpu_rt.web import export, gallery
from gpgpu_rt.web.about import about
from gpgpu_rt.web.export import web_names, why_not_in_browser
from gpgpu_rt.web.gallery import write_gallery
from gpgpu_rt.web.twins import TWINS, Twin

SMALL = Twin("fig11", "cornell", ("kd-restart",), "After a leaf, a ray restarts.")


@pytest.mark.parametrize("twin", TWINS, ids=lambda twin: twin.figure)
def test_twins_run_in_a_browser_and_belong_to_figures(twin: Twin) -> None:
    assert web_names(list(twin.methods)) == list(twin.methods)
    assert twin.scene in {row["name"] for row in list_scenes()}
    assert any(twin.figure in chapter.figures for chapter in CHAPTERS)


@pytest.mark.parametrize("row", [row for row in built_in_methods() if row.name in web_names()],
                         ids=lambda row: row.name)
def test_each_method_has_a_manual(row) -> None:
    """The text about a built-in method names a year or the survey, and no comment marks are left
    in it."""
    paragraphs = about(row)
    assert re.search(r"\b(19|20)\d\d\b|\bsurvey\b", paragraphs[0])
    assert not any("//" in part or "\n" in part for part in paragraphs)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gallery, "TWINS", (SMALL,))


def test_the_command_names_the_file_to_open(small, tmp_path: Path, capsys) -> None:
    assert main(["web", "cornell", "-m", "grid", "-o", str(tmp_path / "out")]) == 0
    assert capsys.readouterr().out.splitlines()[-1] == (
        f"open {tmp_path / 'out' / 'index.html'} in a browser")


def test_the_index_links_to_every_page(small, tmp_path: Path) -> None:
    scene = rt.Scene.from_arrays([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]],
                                 name="</h1><script>alert(1)</script>")
    made = write_gallery(scene, ["brute-force", "kd-restart"], str(tmp_path / "out"))
    assert sorted(made.pages) == sorted(one.name for one in (tmp_path / "out").iterdir())
    index = (tmp_path / "out" / "index.html").read_text()
    assert {"brute-force.html", "kd-restart.html", "fig11.html"} == {
        name for name in re.findall(r'href="([^"]*)"', index) if not name.startswith("data:")}
    for name, title, told in (("kd-restart.html", "kd-restart on ", ""),
                              ("fig11.html", "Figure 11: cornell by kd-restart", SMALL.shows)):
        page = (tmp_path / "out" / name).read_text()
        assert re.findall('href="([^"]*)"', page) == ["index.html"]
        heading = re.search("<h1>(.*?)</h1>\n(.*)", page)
        assert heading[1].startswith(title) and f"<title>{heading[1]}</title>" in page
        assert heading[2] == (f'<p id="caption">{told}</p>' if told else "")
    assert "<script" not in index and "https://" not in index and "http://" not in index
    absent = [row for row in rt.methods() if why_not_in_browser(row)]
    assert all(f"<li>{row.name}: " in index for row in absent)


def test_the_report_links_to_the_pages_that_are_there(small, tmp_path: Path) -> None:
    pytest.importorskip("markdown_it")
    made = write_gallery(rt.load_scene("cornell"), ["brute-force"], str(tmp_path / "a web"))
    assert "fig11.html" in made.pages
    (tmp_path / "sub").mkdir()
    write_report(tmp_path / "sub" / "r.html", tmp_path, films=False, web=tmp_path / "a web")
    text = (tmp_path / "sub" / "r.html").read_text()
    assert re.findall(r'<a href="([^"#]*)">Try', text) == ["../a%20web/fig11.html"]


def test_a_method_that_needs_too_many_passes_is_named_in_the_index(
        small, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export, "MOST_TEST_PASSES", 90)
    names, scene = ["grid", "kd-texture-stack"], rt.load_scene("cornell")
    earlier = tmp_path / "a" / "kd-texture-stack.html"
    earlier.parent.mkdir()
    earlier.write_text("the page of an earlier gallery")
    with pytest.raises(rt.OptionError, match="kd-texture-stack .* passes on this scene"):
        write_gallery(scene, names, str(tmp_path / "a"))
    assert not earlier.exists()
    left_out: dict[str, str] = {}
    write_gallery(scene, names, str(tmp_path / "b"), left_out)
    assert list(left_out) == ["kd-texture-stack"]
    for folder in "ab":
        index = (tmp_path / folder / "index.html").read_text()
        assert "<li>kd-texture-stack: " in index and 'href="kd-texture-stack.html"' not in index


@pytest.mark.parametrize("words, message", [
    (("cornell", "-m", "grid", "-o", ""), "the gallery's folder is empty"),
    (("cornell", "-m", "ray-tiles", "-o", "out"), "does not run in a browser"),
    (("cornell", "-m", "kd-restart", "-o", "taken"), "cannot make the folder taken"),
    (("cornel", "-o", "out"), "cornel")])
def test_mistakes_write_nothing(words, message: str, tmp_path: Path, capsys,
                                monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken").write_text("a file")
    assert main(("web", *words)) == 1
    said = capsys.readouterr().err
    assert message in said and said.count("\n") == 1
    assert [one.name for one in tmp_path.iterdir()] == ["taken"]
