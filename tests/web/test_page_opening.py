"""A page that is opened without choices shows a search, with a ray that is on its way."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from devtools import Browser
from pages import in_browser, opened, settle, written

import gpgpu_rt as rt
from gpgpu_rt.web.costs import ray_costs

METHODS = ("kd-restart", "kd-short-stack", "kd-stack")


@pytest.fixture
def browser(exact_renderer) -> Iterator[Browser]:
    with Browser() as one:
        yield one


@pytest.mark.parametrize("name", ["brute-force", "kd-restart", "kd-stack", "bvh-packet"])
def test_the_step_is_in_mid_search(name: str) -> None:
    scene = rt.load_scene("cornell")
    costs = ray_costs(scene, name, 32)
    assert 1 <= costs["step"] < costs["steps"][1] and costs["steps"][0] <= costs["steps"][1]
    with rt.Tracer(scene, name, statistics=True) as tracer:
        steps = tracer.trace(*scene.camera.rays((32, 32))).steps.reshape(32, 32)
    across, down = (int(32 * at) for at in costs["ray"])
    assert steps[down, across] == steps.max() == costs["steps"][1]


@in_browser
def test_a_page_opens_in_mid_search(browser: Browser, tmp_path: Path) -> None:
    """The first picture comes before the whole search is counted, and the longest ray is shown."""
    browser.send("Page.addScriptToEvaluateOnNewDocument", source="""
        addEventListener("DOMContentLoaded", () => {
            if (location.protocol === "about:") return;
            new MutationObserver(() => { globalThis.early ??= counted === null; }).observe(
                element("picture"), {attributeFilter: ["data-shown"]});
        });""")
    opened(browser, tmp_path, written(METHODS), "rays=64")
    costs = ray_costs(rt.load_scene("cornell"), "kd-restart", 64)
    assert browser.run("[chosen.schedule, chosen.most, result.turns, playing, early]") == [
        "step", costs["step"], costs["step"], False, True]
    assert 0 < browser.run("result.alive") < 64 * 64
    assert browser.run("[path.states.length - 1, counted.last]") == [costs["steps"][1]] * 2
    assert browser.run("!element('steps').hidden && space.dataset.boxes > 3")
    browser.run("location.hash = 'method=kd-stack'")
    browser.wait("chosen.method.name === 'kd-stack'")
    settle(browser)
    assert browser.run("[chosen.schedule, chosen.most]") == ["loop", None]
    browser.run("location.hash = 'method=kd-restart&ray=0.2,0.6'")
    browser.wait("chosen.method.name === 'kd-restart'")
    settle(browser)
    assert browser.run("[chosen.schedule, chosen.most, result.alive]") == ["step", None, 0]
