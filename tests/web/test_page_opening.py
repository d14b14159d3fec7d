"""A page that is opened without choices shows a step in the middle of the search, and the path of
the ray with the most steps."""
from __future__ import annotations

import re
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
    """The opening step comes before the search ends, and the opening ray takes the most steps."""
    scene = rt.load_scene("cornell")
    costs = ray_costs(scene, name, 32)
    assert 1 <= costs["step"] < costs["steps"][1] and costs["steps"][0] <= costs["steps"][1]
    with rt.Tracer(scene, name, statistics=True) as tracer:
        steps = tracer.trace(*scene.camera.rays((32, 32))).steps.reshape(32, 32)
    across, down = (int(32 * at) for at in costs["ray"])
    assert steps[down, across] == steps.max() == costs["steps"][1]


@in_browser
def test_a_page_opens_in_mid_search(browser: Browser, tmp_path: Path) -> None:
    """The first picture appears before the steps of the whole search are counted. The page shows
    the ray with the most steps."""
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


def test_the_table_compares_the_methods() -> None:
    """The table of methods has the mean and the largest numbers of steps and visited nodes."""
    rows = dict(re.findall(r'<tr data-method="([\w-]+)">(.*?)</tr>', written(METHODS)))
    assert tuple(rows) == METHODS
    scene = rt.load_scene("cornell")
    for name, row in rows.items():
        with rt.Tracer(scene, name, statistics=True) as tracer:
            hits = tracer.trace(*scene.camera.rays((64, 64)))
        assert re.findall("<td>(.*?)</td>", row) == [
            text for counts in (hits.steps, hits.nodes_visited)
            for text in (f"{counts.mean():.1f}", f"{counts.max()}")]


@in_browser
def test_a_button_goes_to_the_end_of_the_ray(browser: Browser, tmp_path: Path) -> None:
    """A button moves the slider to the step at which the chosen ray ends."""
    opened(browser, tmp_path, written(METHODS),
           "method=kd-restart&schedule=step&rays=64&pass=5&ray=0.2,0.6")
    end = browser.run("path.states.length - 1")
    assert 5 < end < browser.run("counted.last")
    # In the chart, a dashed mark shows the step at which the ray ends.
    marks = """(() => {
        const {width, height} = element("alive"), context = element("alive").getContext("2d");
        const {data} = context.getImageData(0, height - 30, width, 30);
        return [...Array(width).keys()].filter((x) => [...Array(30).keys()].some((y) =>
            data[4 * (y * width + x)] < 60 && data[4 * (y * width + x) + 3] > 120));
    })()"""
    width, last = browser.run("[element('alive').width, counted.last]")
    found = browser.run(marks)
    assert found and all(abs(x - end / last * (width - 1)) < 3 for x in found)
    browser.click("#end")
    settle(browser)
    assert browser.run("chosen.most") == end
    assert "has ended" in browser.run("element('space-text').textContent")
    address = browser.run("location.hash")
    assert address == f"#method=kd-restart&schedule=step&rays=64&pass={end}&ray=0.2,0.6"
    browser.select("#schedule", "kernels")
    settle(browser)
    assert browser.run("element('end').disabled")


@in_browser
def test_texts_are_not_cut(browser: Browser, tmp_path: Path) -> None:
    """The texts of the ray and of the programs are not wider than their elements. The page says
    only once how to choose a ray."""
    browser.resize(1280, 900)
    opened(browser, tmp_path, written(METHODS))
    assert browser.run("[...document.querySelectorAll('#ray, #text, #text pre')].filter("
                       "(one) => one.scrollWidth > one.clientWidth).length") == 0
    words = browser.run("document.body.innerText")
    assert words.lower().count("click a pixel") == 1
