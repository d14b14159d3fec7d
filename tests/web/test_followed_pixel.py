"""A ring marks the pixel of the followed ray in the picture."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from devtools import Browser
from pages import in_browser, opened, settle, written

pytestmark = in_browser
METHODS = ("kd-restart", "kd-stack", "bvh-packet")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as one:
        yield one


@pytest.mark.parametrize("choices", [
    "", "method=bvh-packet&rays=512&ray=1,0", "method=kd-stack&schedule=loop&ray=0.45,0.55"])
def test_a_ring_marks_the_followed_pixel(exact_renderer, browser: Browser, tmp_path: Path,
                                         choices: str) -> None:
    """The ring is white between two dark rings. The ring does not cover the pixel, and a click on
    the ring follows a ray."""
    opened(browser, tmp_path, written(METHODS), choices)
    left, top, width, _ = browser.box("#picture")
    ray, side = browser.run("[chosen.ray, result.side]")
    pixel = np.minimum(np.floor(np.multiply(ray, side)), side - 1)
    x, y, across, down = browser.box("#mark")
    centre = np.array([x + across / 2 - left, y + down / 2 - top])
    assert np.abs(centre - (pixel + 0.5) * width / side).max() < 1
    assert browser.run("element('ray').textContent").startswith(
        f"ray ({pixel[0]:.0f}, {pixel[1]:.0f})")
    ringed = browser.pixels("#mark")
    browser.run("element('mark').style.opacity = 0")
    plain = browser.pixels("#mark")
    painted = (ringed != plain).any(axis=2)
    rows, columns = (np.arange(n) + 0.5 for n in painted.shape)
    far = np.maximum(*np.meshgrid(abs(columns - across / 2), abs(rows - down / 2)))
    assert not painted[far < width / side / 2].any()
    # The ring has white and dark parts on both sides of the pixel.
    for half in np.array_split(ringed[len(rows) // 2].mean(axis=1), 2):
        assert half.max() > 250 and half.min() < 160
    browser.click("#mark")
    settle(browser)
    assert not browser.run("element('mark').hidden")


def test_the_ring_moves_with_the_ray(exact_renderer, browser: Browser, tmp_path: Path) -> None:
    """Without a ray there is no ring."""
    opened(browser, tmp_path, written(METHODS), "method=kd-restart&schedule=step&rays=64")
    assert browser.run("element('mark').hidden")
    for place in (0.25, 0.75):
        browser.click("#picture", (place, 0.25))
        settle(browser)
        left, _, width, _ = browser.box("#picture")
        x, _, across, _ = browser.box("#mark")
        assert abs((x + across / 2 - left) / width - (64 * place + 0.5) / 64) < 2 / width
    browser.run("location.hash = 'method=kd-restart&schedule=step&pass=3'")
    browser.wait("chosen.ray === null")
    settle(browser)
    assert browser.run("element('mark').hidden")
