"""A page survives a lost context, refuses tables that are too large for the graphics card, and
frees textures that it no longer uses."""
from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from devtools import Browser
from pages import changed, in_browser, opened, settle, written

pytestmark = in_browser
TESTED = "element('selftest').dataset.state !== 'running'"


@pytest.fixture
def browser(exact_renderer) -> Iterator[Browser]:
    with Browser() as one:
        yield one


def test_a_lost_context_is_restored(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path, written(("kd-restart",)),
           "method=kd-restart&schedule=step&rays=64&ray=0.5,0.6")
    browser.wait(TESTED)
    before = browser.pixels("#picture")
    browser.run("globalThis.loser = gl.getExtension('WEBGL_lose_context'); loser.loseContext()")
    browser.wait("lost")
    assert "has stopped" in browser.run("element('message').textContent")
    # The page calls show() after each choice of the reader. Without a context, this does no harm.
    browser.run("show()")
    browser.run("loser.restoreContext()")
    browser.wait("!lost && element('selftest').dataset.state === 'running'")
    browser.wait(TESTED)
    settle(browser)
    assert browser.run("[element('message').textContent, element('selftest').dataset.state, "
                       "element('selftest').dataset.differing]") == ["", "done", "0"]
    assert browser.run("element('selftest').children.length") == 1
    assert np.array_equal(before, browser.pixels("#picture"))
    assert not browser.errors and not browser.run("gl.getError()")


def test_a_context_lost_during_a_trace_is_restored(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path, written(("kd-restart",)), "schedule=step&rays=64")
    before = browser.pixels("#picture")
    browser.run("globalThis.loser = gl.getExtension('WEBGL_lose_context')")
    browser.click("#play")
    browser.wait("chosen.most > 3")
    browser.run("loser.loseContext()")
    browser.wait("lost")
    browser.run("loser.restoreContext()")
    browser.wait("!lost")
    browser.run("location.hash = 'schedule=step&rays=64'")
    browser.wait("element('selftest').dataset.state === 'done'")
    settle(browser)
    assert not browser.errors and browser.run("chosen.most") is None
    assert np.array_equal(before, browser.pixels("#picture"))


def test_tables_too_wide_for_the_card_are_refused(browser: Browser, tmp_path: Path) -> None:
    browser.send("Page.addScriptToEvaluateOnNewDocument", source="""
        const asked = WebGL2RenderingContext.prototype.getParameter;
        WebGL2RenderingContext.prototype.getParameter = function (name) {
            return name === this.MAX_TEXTURE_SIZE ? 2048 : asked.call(this, name);
        };""")
    page = tmp_path / "page.html"
    page.write_text(written(("kd-restart",)))
    browser.open(page)
    message = browser.wait("element('message').textContent")
    assert "4096 x 1 texels is larger than this graphics card holds (2048 x 2048)" in message
    assert browser.run("element('selftest').dataset.state") == "failed"
    assert "nothing is known" in browser.run("element('verdict').textContent")


def test_targets_of_other_sizes_are_freed(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path, written(("kd-restart", "grid")), "schedule=step&rays=64")
    browser.wait(TESTED)
    browser.drag("#picture", (0.4, 0.5), (0.5, 0.5), (0.6, 0.5))
    settle(browser)
    for side in ("128", "256", "64"):
        browser.select("#size", side)
        settle(browser)
    kept = [json.loads(key) for key in browser.run("[...targets.keys()]")]
    assert kept and all(place.startswith("path ") or size in ([64, 64], [4, 4])
                        for place, *_, width, height in kept for size in [[width, height]]), kept


def test_a_page_whose_script_fails_says_so(browser: Browser, tmp_path: Path) -> None:
    def breaks(told: dict) -> None:
        told["texts"][told["methods"][0]["schedules"]["loop"]["passes"][1]["fragment"]] += "}"
    page = tmp_path / "page.html"
    page.write_text(changed(written(("kd-restart",)), breaks))
    browser.open(page)
    assert "ERROR" in browser.wait("element('message').textContent")
    assert browser.run("element('selftest').dataset.state") == "failed"


@pytest.mark.parametrize("width, height", [(1200, 900), (400, 800)])
def test_nothing_is_wider_than_the_window(browser: Browser, tmp_path: Path, width: int,
                                          height: int) -> None:
    browser.resize(width, height)
    opened(browser, tmp_path, written(("kd-restart", "grid")), "schedule=step&ray=0.5,0.5&heat=9")
    browser.wait(TESTED)
    assert browser.run("document.documentElement.scrollWidth") <= width
    wide = browser.run("[...document.querySelectorAll('body *')].filter(one => "
                       "!one.closest('#text') && one.getBoundingClientRect().right > innerWidth)"
                       ".map(one => one.id || one.tagName)")
    assert wide == []
