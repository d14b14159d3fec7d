"""A page shows its first picture soon, and its picture follows the mouse fast."""
from __future__ import annotations

import statistics
from pathlib import Path

import pytest
from devtools import Browser
from page_timing import answers, first_picture
from pages import in_browser, written

# The longest allowed median times: seconds to the first picture, and milliseconds from a mouse
# move to its picture.
FIRST, ANSWER = 3.0, 100.0
METHODS = ("kd-restart", "grid", "bvh-threaded")


@in_browser
@pytest.mark.full
@pytest.mark.once
@pytest.mark.parametrize("scene", ["cornell", "bunny", "kitchen"])
def test_a_page_answers_at_once(exact_renderer, tmp_path: Path, scene: str) -> None:
    page = tmp_path / "page.html"
    page.write_text(written(METHODS, scene))
    first, drags = [], []
    for _ in range(3):
        with Browser() as browser:
            first.append(first_picture(browser, page, "rays=256"))
            drags += answers(browser)
    found = statistics.median(first), statistics.median(drags)
    print(f"{scene}: first picture {found[0]:.2f} s, answer to a drag {found[1]:.0f} ms")
    assert found[0] < FIRST and found[1] < ANSWER
