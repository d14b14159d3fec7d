"""Each chapter of the tour links to the chapters before and after it, and the tour's pictures can
be made anew. test_snippets.py runs the commands of the tour and checks their output."""
from __future__ import annotations

import re
import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from snippets import ROOT, commands, snippets

tour_pictures = SimpleNamespace(**runpy.run_path(str(ROOT / "tools" / "tour_pictures.py")))
TOUR = ROOT / "docs" / "tour"
CHAPTERS = sorted(TOUR.glob("[0-9]-*.md"))
MOST_BYTES = 4 << 20     # limit for all pictures and films together
LONG = "measures for minutes"


def shown(page: Path) -> list[str]:
    """Returns the names of the pictures and films that a page shows."""
    return re.findall(r"!\[[^\]]+\]\(([^)]+)\)", page.read_text(encoding="utf-8"))


def test_the_index_lists_the_chapters_in_their_order() -> None:
    rows = re.findall(r"(?m)^\| \[(\d)\. ([^\]]+)\]\(([^)]+)\)", (TOUR / "index.md").read_text())
    assert [name for _, _, name in rows] == [page.name for page in CHAPTERS]
    heads = [page.read_text(encoding="utf-8").partition("\n")[0] for page in CHAPTERS]
    assert heads == [f"# {number}. {title}" for number, title, _ in rows]


@pytest.mark.parametrize("page", CHAPTERS, ids=lambda page: page.name)
def test_a_chapter_has_all_its_parts(page: Path) -> None:
    """A chapter shows a film and a picture. The chapter has a command that draws a figure, a
    command that makes a live page, and questions with commands. The chapter's last line links to
    the chapters before and after it."""
    text = page.read_text(encoding="utf-8")
    assert {Path(name).suffix for name in shown(page)} == {".gif", ".png"}
    assert "python -m gpgpu_rt.figures --only" in text and "gpgpu-rt web " in text
    assert "gpgpu-rt " in text.partition("## Questions")[2]
    number = CHAPTERS.index(page)
    for name in [other.name for other in CHAPTERS[max(0, number - 1):number + 2]]:
        assert (f"({name})" in text.splitlines()[-1]) == (name != page.name)


@pytest.mark.parametrize("page", CHAPTERS, ids=lambda page: page.name)
def test_only_figures_that_measure_are_left_out(page: Path) -> None:
    """test_snippets.py leaves out a block only if the block draws a figure that takes minutes."""
    left_out = [block for block in snippets(page) if block.marker]
    assert {(block.marker, block.value) for block in left_out} <= {("not run", LONG)}
    assert all(command.startswith("python -m gpgpu_rt.figures --only ")
               for block in left_out for command in commands(block))


@pytest.mark.parametrize("page", CHAPTERS, ids=lambda page: page.name)
def test_every_command_is_in_a_shell_block(page: Path) -> None:
    lines = re.findall(r"(?m)^ *((?:gpgpu-rt|python -m) .*)$", page.read_text(encoding="utf-8"))
    seen = [command for block in snippets(page) if block.language == "sh"
            for command in commands(block)]
    assert [" ".join(line.partition("  #")[0].split()) for line in lines] == seen


def test_every_picture_is_made_by_a_command_of_its_page() -> None:
    assert {TOUR / name for name in tour_pictures.PICTURES} == {
        *TOUR.glob("*.png"), *TOUR.glob("*.gif")}
    for page in CHAPTERS:
        assert sorted(shown(page)) == sorted(
            name for name in tour_pictures.PICTURES if tour_pictures.page_of(name) == page)
    for name in tour_pictures.PICTURES:
        assert tour_pictures.command_of(name).startswith(("gpgpu-rt ", "python -m gpgpu_rt."))


def test_pictures_are_small_and_films_move() -> None:
    assert sum((TOUR / name).stat().st_size for name in tour_pictures.PICTURES) < MOST_BYTES
    for name in tour_pictures.PICTURES:
        with Image.open(TOUR / name) as picture:
            assert (getattr(picture, "n_frames", 1) > 8) == name.endswith(".gif")


def test_a_picture_is_made_anew(exact_renderer, tmp_path: Path) -> None:
    """A picture that is made again is the same, except for its text, which depends on the
    installed font library."""
    name = "2-cells.png"
    tour_pictures.make(name, tmp_path)
    before, after = (np.asarray(Image.open(folder / name).convert("RGB"))
                     for folder in (TOUR, tmp_path))
    assert before.shape == after.shape
    assert (before == after).all(axis=2).mean() > 0.97
