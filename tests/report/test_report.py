"""The teaching page is complete, works offline, and says which figures are missing."""
from __future__ import annotations

import base64
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from browser import looked_at
from PIL import Image

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.inspect import data_uris
from gpgpu_rt.report import CHAPTERS, page, write_report

markdown = pytest.importorskip("markdown_it", reason="no markdown-it-py (extra: report)")

TABLE = """# Figure 12: <eye> rays & time

Published beside measured; see [schedules](schedules.md), [data](fig12.csv),
[a page](http://x.org/).

## bunny

| method | ms | published ms |
| --- | --- | --- |
| kd-restart | 8.17 | 701 |

![the stadium](fig12-more.png) ![gone](gone.png)

<script>alert(1)</script>
"""


def picture(width: int, seed: int) -> Image.Image:
    noise = np.random.default_rng(seed).integers(0, 255, (width // 2, width, 3), np.uint8)
    return Image.fromarray(noise)


@pytest.fixture
def figures(tmp_path: Path) -> Path:
    """Returns a folder like a folder from `make figures`, with two figures and a figure that no
    chapter names."""
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / "fig12.md").write_text(TABLE)
    (folder / "schedules.md").write_text("# Schedules\n\nShort.\n")
    (folder / "mine.md").write_text("# A figure of my own\n\n" + "long " * 2000)
    (folder / "index.md").write_text("# Figures\n")
    for name in ("fig12", "fig12-more", "schedules", "mine"):
        picture(64, 1).save(folder / f"{name}.png")
    return folder


class Reader(HTMLParser):
    """Collects a page's text and all references."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.references: list[str] = []
        self.ids: list[str] = []
        self.tags: list[str] = []
        self.words = ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        for name, value in attributes:
            if name in ("src", "href", "srcset", "data", "action"):
                self.references.append(value)
            if name == "id":
                self.ids.append(value)

    def handle_data(self, data):
        self.words += data


def test_everything_is_carried_along(figures: Path, tmp_path: Path) -> None:
    found = write_report(tmp_path / "report.html", figures, films=False)
    text = (tmp_path / "report.html").read_text()
    read = Reader(text)
    assert found.bytes == len(text.encode()) < page.LIMIT
    assert found.figures == ["fig12", "mine", "schedules"] and "fig20" in found.missing
    outside = [r for r in read.references if not r.startswith(("data:", "#"))]
    assert outside == []
    assert all(r[1:] in read.ids for r in read.references if r.startswith("#"))
    assert "script" not in read.tags and "alert(1)" in read.words  # shown as text
    assert "Figure 12: <eye> rays & time" in read.words and "701" in read.words
    assert "A figure of my own" in read.words and "--only fig20" in read.words
    assert "The picture gone.png is missing" in read.words
    assert "#schedules" in read.references
    assert sum(r.startswith("data:image/png") for r in read.references) == 4


def test_no_figures_at_all_is_a_page_that_says_so(tmp_path: Path, capsys) -> None:
    out = tmp_path / "report.html"
    assert cli.main(["report", "-o", str(out), "--figures", str(tmp_path / "gone"), "--still",
                     "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    every = [name for chapter in CHAPTERS for name in chapter.figures]
    assert told["figures"] == [] and told["missing"] == every
    assert out.read_text().count("Not measured yet") == len(every)


def test_each_figure_has_its_chapter() -> None:
    pytest.importorskip("matplotlib", reason="no matplotlib (extra: figures)")
    from gpgpu_rt.figures.framework.catalogue import FIGURES
    named = [name for chapter in CHAPTERS for name in chapter.figures]
    assert sorted(named) == sorted(FIGURES)
    known = {row.name for row in rt.methods()}
    assert {name for c in CHAPTERS for name in (*c.passes, *c.heat)} <= known


@pytest.mark.full
def test_a_page_that_is_too_large_gets_smaller_pictures(figures: Path, tmp_path: Path,
                                                        monkeypatch) -> None:
    picture(800, 2).save(figures / "fig12.png")
    whole = write_report(tmp_path / "whole.html", figures, films=False).bytes
    monkeypatch.setattr(page, "LIMIT", whole // 2)
    assert write_report(tmp_path / "half.html", figures, films=False).bytes <= whole // 2
    monkeypatch.setattr(page, "LIMIT", 1000)
    with pytest.raises(rt.Error, match="more than 1,000"):
        write_report(tmp_path / "none.html", figures, films=False)
    assert not (tmp_path / "none.html").exists()


@pytest.mark.parametrize("width", [40, 700])
def test_pictures_keep_their_pixels_or_shrink(width: int) -> None:
    uri = data_uris.png_uri(picture(300, 3), width)
    made = Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2])))
    assert made.width == min(300, width) and made.height == made.width // 2


def test_films_and_maps(tmp_path: Path, figures: Path, monkeypatch) -> None:
    short = (page.Chapter("One", "Text.", (), ("kd-restart", "ray-tiles"), ("grid", "bih")),)
    monkeypatch.setattr(page, "CHAPTERS", short)
    write_report(tmp_path / "report.html", figures, "cornell", (12, 12))
    text = (tmp_path / "report.html").read_text()
    gif = re.search(r"data:image/gif;base64,([^\"]+)", text)[1]
    with Image.open(io.BytesIO(base64.b64decode(gif))) as film:
        assert film.n_frames > 5
    assert "on one scale" in text
    # the method has no passes; the page shows all other parts
    assert "Not shown: method ray-tiles" in text


@pytest.mark.parametrize("arguments, message", [
    (["-o", "{}/no/r.html"], "there is no folder"), (["-o", "{}"], "is a folder"),
    (["-o", "{}/r.html", "--scene", "cornel"], "did you mean cornell"),
    (["-o", "{}/r.html", "--size", "x"], "not a size")])
def test_mistakes_are_one_line(tmp_path: Path, capsys, arguments: list[str], message: str) -> None:
    try:
        status = cli.main(["report", *(a.replace("{}", str(tmp_path)) for a in arguments)])
    except SystemExit as stopped:
        status = stopped.code
    err = capsys.readouterr().err
    assert status and message in err and err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("width", [390, 1200])
def test_in_a_browser(figures: Path, tmp_path: Path, width: int) -> None:
    write_report(tmp_path / "report.html", figures, "cornell", (16, 16))
    found = looked_at(tmp_path / "report.html", width, tmp_path)
    assert found["images"] > 8
    assert found["broken"] == [] and found["requests"] == []
    assert found["refused"] == [] and found["errors"] == []
    assert found["wide"] <= 0  # nothing is cut off at the side


@pytest.mark.full
@pytest.mark.once
def test_the_browser_finds_what_is_broken(tmp_path: Path) -> None:
    bad = tmp_path / "bad.html"
    bad.write_text(page._HEAD + '<img alt="half" src="data:image/png;base64,AAAA">'
                   '<img alt="far" src="https://example.invalid/x.png">'
                   '<p style="width: 3000px">wide</p></body></html>')
    found = looked_at(bad, 390, tmp_path)
    assert set(found["broken"]) == {"half", "far"}
    assert any("example.invalid" in url for url in found["refused"] + found["requests"])
    assert found["wide"] > 0
