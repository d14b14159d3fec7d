"""The page of `gpgpu-rt report` is complete, works offline, and says which figures are missing."""
from __future__ import annotations

import base64
import hashlib
import html
import io
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from browser import looked_at
from PIL import Image, PngImagePlugin

import gpgpu_rt as rt
from gpgpu_rt import cli
from gpgpu_rt.inspect import data_uris
from gpgpu_rt.inspect.time_travel import travel
from gpgpu_rt.report import CHAPTERS, page, verdict_words, write_report
from gpgpu_rt.report.films import FRAMES
from gpgpu_rt.report.verdict_words import OUTCOMES

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
    """Returns a folder of figures, in the form that `make figures` writes. Chapters of the page
    name two of the figures, and no chapter names the third."""
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
    """Collects a page's text, references, ids, tags, titles, and texts of images."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.references: list[str] = []
        self.ids: list[str] = []
        self.tags: list[str] = []
        self.alternatives: list[str] = []
        self.titles: list[str] = []     # the texts of headings and captions
        self.words = ""
        self.within: list[str] = []     # the open elements
        self.boxed = False      # whether the latest element scrolls sideways
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        named = dict(attributes)
        if tag == "img":
            self.alternatives.append(named.get("alt", ""))
        elif tag not in ("meta", "link", "input"):
            self.within.append(tag)
        if tag == "table":
            assert self.boxed, "the table has no box that scrolls sideways"
        if tag in ("h1", "h2", "h3", "h4", "figcaption"):
            self.titles.append("")
        self.boxed = named.get("class") == "wide" and "tabindex" in named
        for name, value in attributes:
            if name in ("src", "href", "srcset", "data", "action"):
                self.references.append(value)
            if name == "id":
                self.ids.append(value)

    def handle_endtag(self, tag):
        while self.within and self.within.pop() != tag:
            pass

    def handle_data(self, data):
        self.words += data
        if {"h1", "h2", "h3", "h4", "figcaption"}.intersection(self.within):
            self.titles[-1] += data


def test_the_page_works_offline(figures: Path, tmp_path: Path) -> None:
    """The page contains all pictures, and refers to no other file or site."""
    found = write_report(tmp_path / "report.html", figures, films=False)
    text = (tmp_path / "report.html").read_text()
    read = Reader(text)
    assert found.bytes == len(text.encode()) < page.LIMIT
    assert found.figures == ["fig12", "mine", "schedules"] and "fig20" in found.missing
    outside = [r for r in read.references if not r.startswith(("data:", "#"))]
    assert outside == []
    assert all(r[1:] in read.ids for r in read.references if r.startswith("#"))
    # The page has only its own script. A script in a figure's text is shown as text.
    assert read.tags.count("script") == 1 and text.count("<script>") == 1
    assert "&lt;script&gt;alert(1)" in text
    assert "Figure 12: <eye> rays & time" in read.words and "701" in read.words
    assert "A figure of my own" in read.words and "--only fig20" in read.words
    assert "The picture gone.png is missing" in read.words
    assert "#schedules" in read.references
    assert sum(r.startswith("data:image/png") for r in read.references) == 4


def test_a_page_without_figures_names_them_as_missing(tmp_path: Path, capsys) -> None:
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


VERDICT = {"why": "Because.", "scenes": ["bunny", "robots"], "pairs": 10, "agreed": 3, "claims": 0,
           "held": 0, "structure": 0, "stand_ins": None, "renderer": None}
WORDS = {"fig12": "contradicted", "fig13": "reproduced", "fig14": "refuted by a counterexample",
         "fig16": "mostly reproduced", "fig20": "too little to judge", "fig22": "redrawn"}


@pytest.fixture
def judged(figures: Path) -> Path:
    """Returns a folder with six judged figures, an unjudged figure, and a wrong verdict file."""
    for name, word in WORDS.items():
        (figures / f"{name}.md").write_text(f"# Title of {name}\n\n**{word}**: because.\n")
        (figures / f"{name}.json").write_text(json.dumps({"verdict": {**VERDICT, "word": word}}))
    (figures / "mine.json").write_text(json.dumps({"verdict": None}))
    (figures / "schedules.json").write_text('{"verdict": {"word": 7}}')
    return figures


def test_the_page_begins_with_the_verdicts(judged: Path, tmp_path: Path) -> None:
    write_report(tmp_path / "report.html", judged, films=False)
    text = (tmp_path / "report.html").read_text()
    section = text[text.index('id="verdicts"'):].partition("</section>")[0]
    assert text.index('id="verdicts"') < text.index('class="figure"')
    for count in ("1 confirmed<", "1 confirmed in part<", "2 contradicted<", "2 not judged<"):
        assert count in section
    # Each group lists its figures as links.
    groups = {re.sub("<[^>]*>", "", head).rpartition(" ")[0].rpartition(" ")[0]:
              set(re.findall(r'href="#(\w+)"', body))
              for head, _, body in (part.partition("</h3>")
                                    for part in section.split("<h3>")[1:])}
    assert groups == {"confirmed": {"fig13"}, "confirmed in part": {"fig16"},
                      "contradicted": {"fig12", "fig14"}, "not judged": {"fig20", "fig22"}}
    assert "3 of 10 pairs of methods in the published order, on 2 scenes" in section
    for name, word in WORDS.items():    # each figure has its badge
        figure = text[text.index(f'id="{name}"'):].partition("</section>")[0]
        assert re.search(rf'class="badge"[^>]*>{word}<', figure)
        assert figure.count(f"Title of {name}") == 1


def test_outcomes_differ_for_colour_blind_readers() -> None:
    """Each verdict word belongs to one outcome. The badges of confirmed and of contradicted
    figures differ in lightness, and the text of every badge contrasts with the badge."""
    assert sorted(word for one in OUTCOMES for word in one.words) == sorted(verdict_words.WORDS)

    def luminance(colour: str) -> float:
        parts = np.array([int(colour[k:k + 2], 16) / 255 for k in (1, 3, 5)])
        return float(np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
                     @ [0.2126, 0.7152, 0.0722])

    def contrast(one: str, other: str) -> float:
        low, high = sorted((luminance(one), luminance(other)))
        return (high + 0.05) / (low + 0.05)
    assert all(contrast(one.paper, one.ink) > 4.5 for one in OUTCOMES)
    yes, no = OUTCOMES[0], OUTCOMES[2]
    assert contrast(yes.paper, no.paper) > 3


def film_of(text: str) -> tuple[list[str], Image.Image, str]:
    """Returns the texts of the frames, the picture, and the HTML of a page's first film."""
    film = text[text.index('<figure class="film"'):].partition("</figure>")[0]
    texts = json.loads(html.unescape(re.search(r'data-frames="([^"]*)"', film)[1]))
    png = re.search(r"data:image/png;base64,([^\"]+)", film)[1]
    return texts, Image.open(io.BytesIO(base64.b64decode(png))), film


def test_films_and_maps(tmp_path: Path, figures: Path, monkeypatch) -> None:
    short = (page.Chapter("One", "Text.", (), ("kd-restart", "ray-tiles"), ("grid", "bih")),)
    monkeypatch.setattr(page, "CHAPTERS", short)
    write_report(tmp_path / "report.html", figures, "cornell", (40, 30))
    text = (tmp_path / "report.html").read_text()
    texts, picture, film = film_of(text)
    assert len(texts) > 10 and picture.height == len(texts) * 31 and picture.width >= 120
    live = [int(re.search(r": ([\d,]+) of 1,200 rays live", one)[1].replace(",", ""))
            for one in texts]
    # The first frame shows pass 0, and the last frame shows the last pass. Each frame has fewer
    # live rays than the frame before, even near the end, where few rays are live.
    first, last = (re.match(r"pass ([\d,]+) of ([\d,]+):", texts[k]).groups() for k in (0, -1))
    assert first[0] == "0" and last[0] == last[1] and live[-1] == 0
    lost = -np.diff(live)
    assert (lost > 0).all()
    # A frame is due at the latest when 1 / (FRAMES - 1) of the rays have ended since the previous
    # frame. At the pass before a frame, fewer rays have ended.
    passes = [int(re.match(r"pass ([\d,]+)", one)[1].replace(",", "")) for one in texts]
    scene, every = rt.load_scene("cornell"), []
    with rt.Tracer(scene, "kd-restart", schedule="step") as tracer:
        travel(tracer, *scene.camera.rays((40, 30)), lambda one: every.append(one.live))
    assert [every[at] for at in passes] == live
    assert all(live[k] - every[at - 1] < live[0] / (FRAMES - 1)
               for k, at in enumerate(passes[1:]))
    # Passes with under 5 % of the rays live make up a smaller share of the frames than of all
    # passes.
    of_frames, of_passes = (np.mean(np.array(some) < live[0] / 20) for some in (live, every))
    assert of_frames < 0.6 * of_passes, (of_frames, of_passes)
    # Frames do not overlap: the seam below each frame is white.
    assert all(pixel == (255, 255, 255) for k in range(1, len(texts) + 1)
               for pixel in (picture.convert("RGB").getpixel((9, 31 * k - 1)),))
    assert 'type="button">Play<' in film and 'type="range"' in film
    assert "on one scale" in text
    # ray-tiles lacks the schedule step, so its film is missing; the page shows all other parts.
    assert "Not shown: method ray-tiles" in text


def test_pictures_are_described(tmp_path: Path, judged: Path, monkeypatch) -> None:
    """Each alternative text of the page has more than six words, and repeats no title."""
    described = PngImagePlugin.PngInfo()
    described.add_text("Description", "Dots show the times of three methods on two scenes.")
    picture(64, 1).save(judged / "fig13.png", pnginfo=described)
    (judged / "fig12.md").write_text(TABLE.replace("![gone](gone.png)", ""))
    chapters = (page.Chapter("One", "Text.", ("fig12", "fig13"), ("grid",), ("grid", "bih")),)
    monkeypatch.setattr(page, "CHAPTERS", chapters)
    write_report(tmp_path / "report.html", judged, "cornell", (16, 16))
    read = Reader((tmp_path / "report.html").read_text())
    texts = read.alternatives
    assert "Dots show the times of three methods on two scenes." in texts
    ours = [text for text in texts if text != "the stadium"]    # that text is in fig12.md
    assert len(ours) >= 6 and all(len(text.split()) > 6 for text in ours)
    named = {title.strip().lower() for title in read.titles}
    assert len(named) == len(read.titles)       # no title is repeated
    assert not named.intersection(text.lower() for text in texts)
    film, = (text for text in ours if text.startswith("Film"))
    assert "cornell" in film and "grid" in film and "16 x 16" in film


def test_the_script_is_the_page_s_own(figures: Path, tmp_path: Path) -> None:
    """The content security policy allows the page's script by its digest, and no other script."""
    write_report(tmp_path / "report.html", figures, films=False)
    text = (tmp_path / "report.html").read_text()
    script, = re.findall(r"<script>(.*?)</script>", text, re.S)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src 'sha256-{digest}'\"" in text
    assert "prefers-reduced-motion" in script


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
    picture(1600, 4).save(figures / "fig12.png")
    (figures / "schedules.md").write_text(
        "# Schedules\n\n" + "\n".join("| " + " | ".join(some * 30) + " |" for some in (
            ["column"], ["---"], ["number"])) + "\n")
    write_report(tmp_path / "report.html", figures, "cornell", (16, 16))
    found = looked_at(tmp_path / "report.html", width, tmp_path)
    assert found["images"] > 8
    assert found["broken"] == [] and found["requests"] == []
    assert found["refused"] == [] and found["errors"] == []
    assert found["wide"] <= 0  # nothing is cut off at the side
    # The contents stay in view: beside the text on a wide screen, folded on a narrow screen.
    assert found["contents"] == {"top": 0, "open": width > 1000, "beside": width > 1000}
    assert found["film"] == {"frame": 3, "button": "Play", "moves": True}


@pytest.mark.full
@pytest.mark.once
def test_the_browser_reports_faults(tmp_path: Path) -> None:
    bad = tmp_path / "bad.html"
    bad.write_text(page._HEAD + '<img alt="half" src="data:image/png;base64,AAAA">'
                   '<img alt="far" src="https://example.invalid/x.png">'
                   '<p style="width: 3000px">wide</p></body></html>')
    found = looked_at(bad, 390, tmp_path)
    assert set(found["broken"]) == {"half", "far"}
    assert any("example.invalid" in url for url in found["refused"] + found["requests"])
    assert found["wide"] > 0
