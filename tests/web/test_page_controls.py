"""The controls of a page answer real input events with other pixels, and the address follows."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from devtools import Browser
from pages import in_browser, opened, settle, written

pytestmark = in_browser
METHODS = ("kd-restart", "bvh-threaded", "kd-stack")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as one:
        yield one


@pytest.fixture
def page(exact_renderer, browser: Browser, tmp_path: Path) -> Browser:
    """A page of cornell by kd-restart under the schedule step, 64 x 64 rays."""
    opened(browser, tmp_path, written(METHODS), "method=kd-restart&schedule=step&rays=64")
    return browser


def differing(a: np.ndarray, b: np.ndarray) -> float:
    """Returns the share of pixels that differ."""
    return float((a != b).any(axis=2).mean())


def choices(page: Browser) -> dict[str, str]:
    """Returns the choices that the page's address keeps."""
    return page.run("Object.fromEntries(new URLSearchParams(location.hash.slice(1)))")


def test_a_drag_turns_the_scene(page: Browser) -> None:
    before = page.pixels("#picture")
    assert before.std() > 20
    page.drag("#picture", (0.4, 0.5), (0.5, 0.5), (0.6, 0.55))
    settle(page)
    assert differing(before, page.pixels("#picture")) > 0.2
    assert page.run("result.side") == 64        # in full again after the drag
    eye = np.array(choices(page)["eye"].split(","), float)
    assert np.allclose(eye, page.run("chosen.camera.eye"), rtol=1e-6)
    assert not np.allclose(eye, page.run("page.camera.eye"), rtol=0.01)


def test_methods_and_schedules_show_the_same_picture(page: Browser) -> None:
    before = page.pixels("#picture")
    for method, schedule in (("kd-restart", "loop"), ("bvh-threaded", "loop"),
                             ("bvh-threaded", "step"), ("kd-stack", "loop")):
        page.select("#method", method)
        page.select("#schedule", schedule)
        settle(page)
        drawn = page.run("[chosen.method.name, chosen.schedule]")
        assert drawn == [choices(page)[name] for name in ("method", "schedule")]
        assert drawn == [method, schedule]
        assert not differing(before, page.pixels("#picture"))
    assert page.run("element('steps').hidden")      # kd-stack runs under loop alone


def test_the_slider_stops_the_search(page: Browser) -> None:
    before, steps = page.pixels("#picture"), page.run("counted.last")
    page.click("#pass", (0.2, 0.5))
    settle(page)
    most = page.run("chosen.most")
    assert 1 <= most < steps and choices(page)["pass"] == str(most)
    early = page.pixels("#picture")
    assert differing(before, early) > 0.3
    blue = (early[..., 2] > early[..., 0] + 30).mean()
    assert blue > 0.1       # rays that wait for the first kernel
    # The curve is computed from the rays' steps, the count of live rays from their phases.
    for _ in range(3):
        page.press("ArrowRight")
        settle(page)
        most += 1
        assert page.run("[chosen.most, result.alive]") == [most, page.run("counted.alive")[most]]
        assert f"{most} of {steps}" == page.run("element('step').textContent")


def test_play_advances_the_wavefront(page: Browser) -> None:
    assert page.run("element('play').textContent") == "play"
    page.run("globalThis.seen = []; new MutationObserver(() => seen.push(chosen.most)).observe("
             "element('step'), {childList: true}), 0")
    page.click("#play")
    page.wait("chosen.most >= 5")
    page.click("#play")
    settle(page)
    stopped, seen = page.run("chosen.most"), page.run("seen")
    assert page.run("result.alive === counted.alive[chosen.most]") and stopped >= 5
    assert seen == sorted(seen) and set(range(1, stopped)) <= set(seen)
    page.click("#play")     # goes on from there, to the end
    page.wait("chosen.most === null")
    settle(page)
    assert page.run("[result.alive, element('play').textContent]") == [0, "play"]
    assert stopped + 1 in page.run("seen")


def test_heat_keeps_one_scale(page: Browser) -> None:
    page.click("#heat")
    settle(page)
    scale = page.run("chosen.scale")
    taken = page.run("survey(result.schedule, result.states, 64)")
    assert scale == taken["percentile"] == float(choices(page)["heat"])
    restart = page.pixels("#picture")
    legend = page.pixels("#ramp")[6]
    brightest, darkest = legend[-4], legend[4]
    assert brightest.min() > 240 and darkest.max() < 60
    assert page.run("element('ticks').lastChild.textContent") == f"{scale:.0f} steps or more"
    page.select("#method", "bvh-threaded")
    page.select("#schedule", "step")
    settle(page)
    assert page.run("chosen.scale") == scale        # the scale is the same for all methods
    assert differing(restart, page.pixels("#picture")) > 0.3
    before = page.pixels("#picture")
    page.click("#percentile")
    settle(page)
    assert page.run("chosen.scale") == page.run("counted.percentile") != scale
    assert differing(before, page.pixels("#picture")) > 0.3


def test_programs_and_their_kernels(page: Browser) -> None:
    text = page.run("element('text').textContent")
    assert "void down(Ray ray" in text and "kd_restart.glsl" in text
    assert page.run("[...element('text').querySelectorAll('mark')].map(one => "
                    "one.textContent.match(/void (.*?)[(]/)[1])") == ["down", "intersect"]
    folded = page.run("[...element('text').querySelectorAll('details:not([open]) summary')]"
                      ".map(one => one.textContent).join()")
    assert "core/axis.glsl" in folded and "kd_common" not in folded
    assert page.run("element('text').textContent.length") == page.run(
        "[...element('text').querySelectorAll('pre, summary')]"
        ".reduce((sum, one) => sum + one.textContent.length, 0)")
    page.select("#kernel", "eye rays")
    assert "uniform vec3 forward" in page.run("element('text').textContent")
    page.select("#kernel", "set-up")
    settle(page)
    assert "void init(Ray ray" in page.run("element('text').textContent")


def test_the_address_is_followed(page: Browser) -> None:
    before = page.pixels("#picture")
    page.run("location.hash = 'method=bvh-threaded&schedule=step&rays=128&pass=7&ray=0.5,0.5'")
    settle(page)
    assert page.run("[chosen.method.name, chosen.schedule, result.side, chosen.most]") == [
        "bvh-threaded", "step", 128, 7]
    assert "steps = 7" in page.run("element('ray').textContent")
    assert differing(before, page.pixels("#picture")) > 0.2
    page.run("location.hash = 'rays=64&method=nothing&eye=1,x,3&ray=7,7&pass=-3'")
    settle(page)        # what is missing or wrong gets its first value again
    assert page.run("[chosen.method.name, chosen.most, chosen.ray, chosen.camera === page.camera]"
                    ) == ["kd-restart", None, None, True]
    assert not differing(before, page.pixels("#picture"))
    page.run("history.back()")
    settle(page)
    page.wait("chosen.method.name === 'bvh-threaded'")
