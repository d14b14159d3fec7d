"""A page that is opened without choices shows a step in the middle of the search, and the path of
the ray with the most steps."""
from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from devtools import Browser
from pages import in_browser, opened, settle, written

import gpgpu_rt as rt
from gpgpu_rt.web.costs import ray_costs
from gpgpu_rt.web.export import export_method
from gpgpu_rt.web.page import page_text
from gpgpu_rt.web.page_data import PageData
from gpgpu_rt.web.twins import TWINS

METHODS = ("kd-restart", "kd-short-stack", "kd-stack")


@pytest.fixture
def browser(exact_renderer) -> Iterator[Browser]:
    with Browser() as one:
        yield one


@pytest.mark.parametrize("scene, name", [
    ("cornell", "brute-force"), ("cornell", "kd-restart"), ("cornell", "kd-stack"),
    ("cornell", "bvh-packet"), ("stadium", "grid")])
def test_the_opening_step_is_in_mid_search(scene: str, name: str) -> None:
    """At the opening step, at least half of the hits are found, and the search goes on. If all
    rays end together, the page opens with the finished picture. No ray takes more steps than the
    opening ray. If several rays take the most steps, and one of them hits, the opening ray
    hits."""
    found = rt.load_scene(scene)
    costs = ray_costs(found, name, 32)
    with rt.Tracer(found, name, statistics=True) as tracer:
        hits = tracer.trace(*found.camera.rays((32, 32)))
    ray = int(32 * costs["ray"][1]) * 32 + int(32 * costs["ray"][0])
    assert hits.steps[ray] == hits.steps.max() == costs["steps"][1] >= costs["steps"][0]
    assert hits.hit[ray] == hits.hit[hits.steps == hits.steps.max()].any()
    if name == "brute-force":
        assert costs["step"] is None
    elif name != "bvh-packet":      # for packets, the slider also counts pushes and pops
        assert 1 <= costs["step"] < costs["steps"][1]
        assert 0.5 <= np.mean(hits.steps[hits.hit] <= costs["step"]) < 1


def test_a_scene_without_hits_opens_with_the_finished_picture() -> None:
    scene = rt.Scene.from_arrays([[0, 0, 0], [0, 0, 0], [0, 0, 0]], [[0, 1, 2]], name="a point")
    assert ray_costs(scene, "kd-restart", 8)["step"] is None


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
    assert browser.run("element('unread').textContent") == ""
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


OPENED = ("brute-force", "kd-restart", "grid", "bvh-threaded", "bvh-packet", "kd-packet",
          "kd-ropes-packet", "bvh-stack")


@in_browser
def test_the_opening_ray_has_the_most_steps_of_the_table(browser: Browser,
                                                         tmp_path: Path) -> None:
    """Without `rays` in the address, the page traces 64 x 64 rays. The opening ray is a ray of the
    page's test. With another number of rays or another camera, the page opens without a ray."""
    scene, text = rt.load_scene("cornell"), written(OPENED)
    opened(browser, tmp_path, text)
    assert browser.run("chosen.method.name") == "kd-restart"    # brute-force shows no search
    for name in OPENED[:4]:
        browser.run(f"location.hash = 'method={name}'")
        browser.wait(f"chosen.method.name === '{name}'")
        settle(browser)
        costs = ray_costs(scene, name, 64)
        assert browser.run("[result.side, path.states.length - 1, chosen.most]") == [
            64, costs["steps"][1], costs["step"]]
    for other in ("rays=128", "eye=100,200,-900"):
        browser.run(f"location.hash = 'method=kd-restart&{other}'")
        browser.wait("chosen.method.name === 'kd-restart' && location.hash.includes('pass')"
                     f" && location.hash.includes('{other}')")
        settle(browser)
        assert browser.run("[chosen.ray, chosen.most === null]") == [None, False]


@in_browser
@pytest.mark.parametrize("name", OPENED[4:])
def test_packets_open_after_half_of_the_hits(browser: Browser, tmp_path: Path, name: str) -> None:
    """For packets too, the page opens at the step that the host computed. At this step, and not
    one step earlier, at least half of the hits are final."""
    opened(browser, tmp_path, written(OPENED), f"method={name}")
    costs = ray_costs(rt.load_scene("cornell"), name, 64)
    assert browser.run("[chosen.most, result.turns]") == [costs["step"]] * 2
    found = """(async (most) => {
        const {hit, states} = await trace(schedule(), chosen.camera, 64, 64, {most, place: "all"});
        const [texel, channel] = field(schedule(), "phase"), [width, height] = sizeOf.get(
            states[texel]);
        const phases = readTexture(states[texel], width, height), hits = readTexture(hit, 64, 64);
        return [...Array(64 * 64).keys()].filter((k) => {
            const [x, y] = [k % 64 * width / 64, Math.floor(k / 64) * height / 64].map(Math.floor);
            return hits[4 * k + 3] !== NO_TRIANGLE && phases[4 * (y * width + x) + channel] <= 0;
        }).length;
    })"""
    before, at, whole = (browser.run(f"{found}({most})") for most in (
        costs["step"] - 1, costs["step"], 60000))
    assert before < 0.5 * whole <= at < whole


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
@pytest.mark.parametrize("caption, index", [
    ("", ""), ("", "index.html"), (max((one.shows for one in TWINS), key=len), "index.html")])
def test_a_projector_shows_the_slider(browser: Browser, tmp_path: Path, caption: str,
                                      index: str) -> None:
    browser.resize(1280, 720)
    scene, tables = rt.load_scene("cornell"), PageData()
    methods = [export_method(scene, "kd-texture-stack", tables)]
    opened(browser, tmp_path, page_text(scene, methods, tables, "A title", caption, index))
    lowest = browser.run("Math.max(...['picture', 'pass', 'waits', 'space', 'space-text'].map("
                         "(id) => element(id).getBoundingClientRect().bottom))")
    assert browser.run("scrollY") == 0 and lowest <= 720


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
