"""The pictures of README.md show what their commands draw today. The pictures that are quick to
make are made anew and compared."""
from __future__ import annotations

import re
import runpy
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image
from snippets import ROOT

make_pictures = SimpleNamespace(**runpy.run_path(str(ROOT / "tools" / "make_pictures.py")))
README = ROOT / "docs" / "readme"
# The part of the film with the scale and its numbers: left, top, right and bottom in pixels.
SCALE = (0, 340, 270, 392)


def alike(before: Image.Image, after: Image.Image, tolerance: int = 24) -> float:
    """Returns the share of pixels whose channels differ by at most ``tolerance``."""
    assert before.size == after.size
    first, second = (np.asarray(one.convert("RGB")).astype(int) for one in (before, after))
    return float((np.abs(first - second).max(axis=2) <= tolerance).mean())


def test_the_readme_shows_each_picture() -> None:
    shown = re.findall(r"\(docs/readme/([^)]+)\)", (ROOT / "README.md").read_text())
    assert sorted(shown) == sorted(make_pictures.PICTURES)
    assert sorted(shown) == sorted(path.name for path in README.iterdir())


def test_the_viewer_is_a_part_of_its_manual_page(tmp_path: Path) -> None:
    make_pictures.viewer(tmp_path, tmp_path / "viewer.png")
    with Image.open(README / "viewer.png") as before, Image.open(
            tmp_path / "viewer.png") as after:
        assert alike(before, after, tolerance=2) > 0.999


@pytest.mark.parametrize("name", ["heat.png", "figure.png"])
def test_a_picture_of_the_readme_is_made_anew(exact_renderer, name: str, tmp_path: Path) -> None:
    """Letters depend on the installed font library, so some pixels may differ."""
    make_pictures.PICTURES[name](tmp_path, tmp_path / name)
    with Image.open(README / name) as before, Image.open(tmp_path / name) as after:
        assert alike(before, after) > 0.97


def test_the_film_ends_with_the_last_pass(exact_renderer, tmp_path: Path) -> None:
    """The film's command runs again, but writes only the first pass and the last."""
    make_pictures.run(tmp_path, *make_pictures.FILM, "--every", "100000", "-o", "ends")
    first, last = sorted(tmp_path.glob("ends/pass_*.png"))
    with Image.open(README / "film.gif") as film:
        for frame, path in ((0, first), (film.n_frames - 1, last)):
            film.seek(frame)
            with Image.open(path) as picture:
                assert alike(film, picture) > 0.98
                scale = [one.convert("RGB").crop(SCALE) for one in (film, picture)]
                assert alike(*scale) > 0.97
