"""The controls of a page answer real input events: the picture changes, and the page's address
keeps the choices."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from devtools import Browser
from pages import in_browser, opened, settle, written

from gpgpu_rt.inspect.false_colours import category, ramp

pytestmark = in_browser
METHODS = ("kd-restart", "bvh-threaded", "kd-stack")


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as one:
        yield one


@pytest.fixture
def page(exact_renderer, browser: Browser, tmp_path: Path) -> Browser:
    """Opens a page of the scene cornell, with method kd-restart, schedule step and 64 x 64
    rays."""
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
    assert page.run("result.side") == 64        # the full number of rays after the drag
    eye = np.array(choices(page)["eye"].split(","), float)
    assert np.allclose(eye, page.run("chosen.camera.eye"), rtol=1e-5)
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


def test_another_method_keeps_the_schedule_and_the_step(page: Browser) -> None:
    """kd-stack has only the schedule loop, without steps. The next method returns to the
    schedule and the step that the reader chose. A step after the end shows the end."""
    last = {}
    for method, schedule in (("kd-restart", "step"), ("bvh-threaded", "step"),
                             ("kd-stack", "loop"), ("kd-restart", "step")):
        page.select("#method", method)
        settle(page)
        if not last:
            page.run("goTo(5), 0")
            settle(page)
        assert page.run("[chosen.method.name, chosen.schedule]") == [method, schedule]
        assert choices(page)["pass"] == "5"
        last[method] = page.run("counted.last")
        if schedule == "step":
            assert page.run("result.turns") == 5
    assert last["bvh-threaded"] < last["kd-restart"]
    page.run(f"goTo({last['kd-restart']}), 0")
    page.select("#method", "bvh-threaded")
    settle(page)
    end = last["bvh-threaded"]
    assert page.run("[element('step').textContent, result.alive]") == [f"{end} of {end}", 0]
    page.select("#schedule", "kernels")
    settle(page)
    for method, schedule in (("kd-stack", "loop"), ("kd-restart", "kernels")):
        page.select("#method", method)
        settle(page)
        assert page.run("[chosen.schedule, chosen.most]") == [schedule, None]


def test_the_slider_stops_the_search(page: Browser) -> None:
    before, steps = page.pixels("#picture"), page.run("counted.last")
    page.click("#pass", (0.2, 0.5))
    settle(page)
    most = page.run("chosen.most")
    assert 1 <= most < steps and choices(page)["pass"] == str(most)
    early = page.pixels("#picture")
    assert differing(before, early) > 0.3
    orange = (early[..., 0] > early[..., 2] + 100).mean()
    assert orange > 0.1       # rays that wait for the first kernel
    # The page computes the curve of live rays from the rays' steps. From the rays' phases, it
    # counts the live rays at the shown step. Both numbers must be equal.
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
    page.click("#play")     # continues to the end
    page.wait("chosen.most === null")
    settle(page)
    assert page.run("[result.alive, element('play').textContent]") == [0, "play"]
    assert stopped + 1 in page.run("seen")


def test_heat_keeps_one_scale(page: Browser) -> None:
    page.click("#heat")
    settle(page)
    scale = page.run("chosen.scale")
    taken = page.run("survey(result.schedule, result.states)")
    assert scale == taken["percentile"] == float(choices(page)["heat"])
    restart = page.pixels("#picture")
    legend = page.pixels("#ramp")[6]
    place = (np.arange(len(legend)) + 0.5) / len(legend)
    apart = np.abs(legend - ramp(place).astype(int))[2:-2]
    assert apart.max() < 10, apart     # the colours of `gpgpu-rt heat`
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


def test_the_fields_of_the_state_are_explained(page: Browser) -> None:
    """The page explains each field of the chosen schedule's state, with the field's name in a
    ``code`` element. If the schedule has no states, the page hides these texts."""
    words = page.run("[...document.querySelectorAll('#fields code')].map(one => one.textContent)")
    assert set(page.run("schedule().state.map(([name]) => name)")) <= set(words)
    assert page.run("element('fields').textContent").count("KD_STATE: ") == 1
    page.select("#schedule", "loop")
    settle(page)
    assert page.run("element('fields').hidden")


def test_the_address_is_followed(page: Browser) -> None:
    before = page.pixels("#picture")
    page.run("location.hash = 'method=bvh-threaded&schedule=step&rays=128&pass=7&ray=0.5,0.5'")
    settle(page)
    assert page.run("[chosen.method.name, chosen.schedule, result.side, chosen.most]") == [
        "bvh-threaded", "step", 128, 7]
    assert "steps = 7" in page.run("element('ray').textContent")
    assert differing(before, page.pixels("#picture")) > 0.2
    page.run("location.hash = 'rays=64&method=nothing&eye=1,x,3&ray=7,7&pass=-3'")
    settle(page)        # a missing or wrong choice gets its default again
    assert page.run("[chosen.method.name, chosen.most, chosen.ray, chosen.camera === page.camera]"
                    ) == ["kd-restart", None, None, True]
    assert not differing(before, page.pixels("#picture"))
    page.run("history.back()")
    settle(page)
    page.wait("chosen.method.name === 'bvh-threaded'")


@pytest.mark.parametrize("method", METHODS)
def test_a_page_that_is_opened_again_keeps_its_step(page: Browser, tmp_path: Path,
                                                    method: str) -> None:
    """A method that runs only under `loop` shows no steps, but keeps the step for the next
    method."""
    page.run("location.hash = 'method=kd-restart&schedule=step&rays=64&pass=7'")
    page.wait("chosen.most === 7")
    page.select("#method", method)
    settle(page)
    kept = choices(page)
    assert (kept["method"], kept["pass"]) == (method, "7")
    (tmp_path / "again").mkdir()
    opened(page, tmp_path / "again", written(METHODS), page.run("location.hash.slice(1)"))
    assert choices(page) == kept
    page.select("#method", "bvh-threaded")
    settle(page)
    assert page.run("[chosen.schedule, chosen.most, result.turns]") == ["step", 7, 7]


def test_a_wrong_address_is_named(page: Browser) -> None:
    """The page names each wrong part of the address, as text without markup. For a wrong method,
    the page also lists its methods, and for a wrong schedule, the method's schedules."""
    shown = "element('unread').textContent"
    assert page.run(shown) == ""
    methods = f" (the page runs only {', '.join(METHODS)})"
    for right in ("method=grid2", "schedule=toString", "rays=77", "pass=abc", "pass=0", "heat=x",
                  "ray=5,hello", "ray=0.5", "ray=,", "eye=1,2", "eye=1,x,3", "mehtod=kd-stack",
                  "method=kd-stack&schedule=step", "<img src=x>=1"):
        page.run(f"location.hash = '{right}'")
        page.wait(shown)
        known = page.run("` (${chosen.method.name} has only ${Object.keys(chosen.method.schedules)"
                         ".join(', ')})`") if "schedule" in right else ""
        known = methods if right == "method=grid2" else known
        assert page.run(shown).endswith(f": {right.rpartition('&')[2]}{known}")
        settle(page)
        page.run("location.hash = 'method=bvh-threaded&schedule=step&rays=64&pass=7&heat=9"
                 "&ray=0.2,0.6&eye=100,200,-900'")
        page.wait(f"{shown} === ''")
        settle(page)
    page.run("location.hash = 'method=a&schedule=b&rays=c&pass=d'")
    page.wait(shown)
    settle(page)
    told = page.run(shown)
    known = "(kd-restart has only loop, step, kernels)"
    assert told.endswith(f": method=a{methods}; schedule=b {known}; rays=c; pass=d")
    assert "\n" not in told
    assert page.run("[element('unread').children.length, chosen.method.name]") == [0, METHODS[0]]


def test_an_edit_of_the_schedule_alone_is_followed(page: Browser) -> None:
    for name in ("loop", "kernels", "step"):
        page.run(f"location.hash = location.hash.replace(/schedule=[a-z]+/, 'schedule={name}')")
        page.wait(f"chosen.schedule === '{name}'")
        settle(page)
        assert page.run("[element('schedule').value, result.schedule === schedule()]") == [
            name, True]
        assert choices(page)["schedule"] == name


def test_a_heat_without_end_is_not_followed(page: Browser) -> None:
    """An infinite end of the heat scale in the address is ignored."""
    scale = page.run("chosen.scale")
    page.run("location.hash = 'method=kd-restart&schedule=step&rays=64&heat=Infinity'")
    page.wait("chosen.heat")
    settle(page)
    assert page.run("chosen.scale") == scale
    assert "NaN" not in page.run("element('ticks').textContent")
    assert page.pixels("#picture").std() > 20


def test_a_pause_shows_the_step_of_the_slider(page: Browser) -> None:
    """Here the player shows every fifth step, and is paused while the page counts the live
    rays."""
    page.wait("element('selftest').dataset.state === 'done'")
    page.run("""{
        counted.last = 5 * PLAYED;
        const look_ = look;
        globalThis.look = (...given) => {
            if (playing && chosen.most > 5 && given[2] === "picture") play();
            return look_(...given);
        };
        show(true);
    }""")
    page.wait("!playing")
    settle(page)
    page.run("counted.last = counted.alive.length - 1, 0")
    step = page.run("chosen.most")
    assert step % 5 and page.run("[result.turns, result.alive]") == [
        step, page.run("counted.alive")[step]]
    assert page.run("Number(element('pass').value)") == step


def test_a_second_pointer_does_not_turn_the_scene(page: Browser) -> None:
    left, top, width, height = page.box("#picture")
    x, y = left + 0.4 * width, top + 0.5 * height
    page.mouse("pressed", x, y)
    page.mouse("moved", x + 20, y)
    settle(page)
    eye = page.run("chosen.camera.eye")
    for kind in ("pointermove", "pointerup"):
        page.run(f"canvas.dispatchEvent(new PointerEvent('{kind}', "
                 "{pointerId: 77, clientX: 0, clientY: 0, bubbles: true})), 0")
    assert page.run("[chosen.camera.eye, dragging]") == [eye, True]
    page.mouse("moved", x + 40, y)
    page.mouse("released", x + 40, y)
    settle(page)
    assert page.run("chosen.camera.eye") != eye and not page.run("dragging")


def test_a_camera_near_its_up_can_be_turned_away(page: Browser) -> None:
    """A camera that looks almost along its up vector can be turned, and never gets nearer to
    the up vector."""
    page.run("""{
        const {target: at, up} = page.camera, across = unit(cross(up, [1, 2, 3]));
        const offset = scaled(unit(up), 1000).map((x, k) => x + 30 * across[k]);
        chosen.camera = {...page.camera, eye: at.map((x, k) => x + offset[k])};
    }""")
    slants = [page.run("slant(chosen.camera.eye, chosen.camera)")]
    assert slants[0] < 0.05
    for turn in ("2, 0", "0, 1", "0, -1", "0, 1", "0, -1"):
        page.run(f"turnCamera({turn})")
        slants.append(page.run("slant(chosen.camera.eye, chosen.camera)"))
    page.run("dragging = false, show()")
    settle(page)
    assert slants[1] == pytest.approx(slants[0])
    assert all(after > before * (1 - 2e-6) for before, after in zip(slants, slants[1:]))
    assert slants[-1] > slants[0] + 0.015


def test_counts_of_another_trace_are_not_shown(page: Browser) -> None:
    """While the page traces a new number of rays, it shows no counts of the previous trace."""
    assert "are alive" in page.run("element('alive-text').textContent")
    assert page.run("""(() => {
        [chosen.side, playing] = [128, true];
        steps();
        const shown = ["alive-text", "step"].map((id) => element(id).textContent);
        [chosen.side, playing] = [64, false];
        steps();
        return shown;
    })()""") == ["", ""]


def test_four_kernels_have_four_colours(exact_renderer, browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path, written(("kd-texture-stack",)), "schedule=kernels&rays=64")
    chips, marks, lines = browser.run("""[
        [...document.querySelectorAll("#waits i")].map(
            (one) => getComputedStyle(one).backgroundColor),
        [1, 2, 3, 4].map((k) => {
            const mark = document.createElement("mark");
            mark.className = `kernel-${k}`;
            element("text").append(mark);
            const {borderLeftColor, backgroundColor} = getComputedStyle(mark);
            return [borderLeftColor, backgroundColor];
        }),
        [1, 2, 3, 4].map((phase) => {
            element("space").style.color = colourOf({fields: {phase}});
            return getComputedStyle(element("space")).color;
        })]""")
    borders, backgrounds = zip(*marks)
    films = [f"rgb({', '.join(map(str, category(phase)))})" for phase in (1, 2, 3, 4)]
    assert films == chips == [*borders] == lines
    assert len({*backgrounds, "rgba(0, 0, 0, 0)"}) == 5
    shown = browser.run("""[1, 2, 3, 4].map((phase) => {
        const one = (...texel) => texture(1, 1, 4, new Float32Array(texel));
        const into = target("colours 0", {outputs: 1}, 1, 1);
        const {whole, show} = page.own;
        draw(whole, show, into,
             {places: [0, 0], stepwise: 1, most: 0, size: [1, 1], ...SHOWN_COLOURS},
             {hits: one(0, 0, 0, NO_TRIANGLE), surfaces: one(0, 0, 0, 0), counts: one(0, 0, 0, 0),
              directions: one(0, 0, 1, 0), phases: one(phase, 0, 0, 0)});
        return [...read(into)].slice(0, 3);
    })""")
    films = np.array([category(phase) for phase in (1, 2, 3, 4)]) / 255
    assert np.allclose(shown, films, atol=1e-6)
