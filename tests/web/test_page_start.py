"""A page starts only once, even after early events and lost contexts, and names the methods that
it cannot test."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from devtools import Browser
from pages import changed, in_browser, opened, settle, written

pytestmark = in_browser
TESTED = "element('selftest').dataset.state !== 'running'"
STEP = "method=kd-restart&schedule=step&rays=64"


@pytest.fixture
def browser(exact_renderer) -> Iterator[Browser]:
    with Browser() as one:
        yield one


def with_limit(browser: Browser, name: str, limit: int) -> None:
    """Make the graphics card's limit ``name`` look like ``limit`` to all pages that are opened
    later."""
    browser.send("Page.addScriptToEvaluateOnNewDocument", source=f"""{{
        const asked = WebGL2RenderingContext.prototype.getParameter;
        WebGL2RenderingContext.prototype.getParameter = function (name) {{
            return name === this.{name} ? {limit} : asked.call(this, name);
        }};
    }}""")


def test_events_before_the_first_picture_do_no_harm(browser: Browser, tmp_path: Path) -> None:
    browser.send("Page.addScriptToEvaluateOnNewDocument", source="""
        addEventListener("DOMContentLoaded", () => {
            if (location.protocol === "about:") return;
            globalThis.early = surfaces === null;
            element("pass").dispatchEvent(new Event("input"));
            for (const id of ["play", "percentile"]) element(id).click();
            for (const id of ["heat", "scale"]) element(id).dispatchEvent(new Event("change"));
        });""")
    opened(browser, tmp_path, written(("kd-restart",)), STEP)
    assert browser.run("early") and not browser.errors
    browser.wait(TESTED)
    assert browser.run("[chosen.most, element('selftest').dataset.state]") == [None, "done"]


def test_a_context_lost_twice_starts_the_page_once(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path, written(("kd-restart", "grid")), STEP)
    browser.wait(TESTED)
    browser.run("""(async () => {
        globalThis.ended = [];
        const loser = gl.getExtension("WEBGL_lose_context"), test = selfTest;
        const event = (kind) => new Promise(
            (next) => canvas.addEventListener(kind, next, {once: true}));
        globalThis.selfTest = (...given) => {
            ended.push("started");
            return test(...given).then(() => ended.push("ended"));
        };
        // The first start still decodes a table when the context is restored for the second time.
        const decode = unpacked;
        globalThis.unpacked = async (packed) => {
            await new Promise((next) => setTimeout(next, 1000));
            return decode(packed);
        };
        for (let k = 0; k < 2; ++k) {
            const [lost, restored] = ["webglcontextlost", "webglcontextrestored"].map(event);
            loser.loseContext();
            await lost;
            await new Promise((next) => setTimeout(next, 1));
            loser.restoreContext();
            await restored;
        }
    })()""")
    browser.wait("ended.includes('ended')")
    settle(browser)
    assert browser.run("ended") == ["started", "ended"]
    assert browser.run("[...element('selftest').children].map(one => one.textContent)") == [
        "kd-restart: exact", "grid: exact"]
    assert not browser.errors and not browser.run("gl.getError()")


def test_passes_share_the_textures_of_tables(browser: Browser, tmp_path: Path) -> None:
    """A table that several passes read is decoded only once, into one texture."""
    opened(browser, tmp_path, written(("kd-restart",)), STEP)
    browser.wait(TESTED)
    made, decoded, known = browser.run("""(async () => {
        const create = gl.createTexture.bind(gl), decode = unpacked, found = [0, 0];
        gl.createTexture = () => (found[0] += 1, create());
        globalThis.unpacked = (packed) => (found[1] += 1, decode(packed));
        tables.clear();
        corners = null;
        await trace(schedule(), chosen.camera, 64, 64);
        const sources = schedule().passes.flatMap(({inputs}) => Object.values(inputs));
        return [...found, new Set(sources.filter((one) => one.startsWith("table:"))).size];
    })()""")
    assert made == known >= 2
    assert decoded == known + 2     # 2 more: the triangles' vertices and corners


def test_an_array_of_eight_floats_is_set(browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path, written(("kd-restart",)), STEP)
    assert browser.run("""(() => {
        const text = page.texts.push(`#version 300 es
            precision highp float;
            uniform float many[8];
            out vec4 colour;
            void main() { colour = vec4(many[0], many[3], many[4], many[7]); }`) - 1;
        const into = target("eight 0", {outputs: 1}, 1, 1);
        draw(page.own.whole, text, into, {many: [1, 2, 3, 4, 5, 6, 7, 8]}, {});
        return [...read(into)];
    })()""") == [1, 4, 5, 8]


def test_a_method_without_schedules_is_not_tested(browser: Browser, tmp_path: Path) -> None:
    """A method is left out if the graphics card supports none of its schedules."""
    def steps_alone(told: dict) -> None:
        del told["methods"][1]["schedules"]["loop"]
    with_limit(browser, "MAX_DRAW_BUFFERS", 4)
    opened(browser, tmp_path, changed(written(("kd-restart", "kd-short-stack")), steps_alone))
    browser.wait(TESTED)
    assert browser.run("[...element('method').options].map(one => one.value)") == ["kd-restart"]
    lines = browser.run("[...element('selftest').children].map(one => one.textContent)")
    assert lines[0] == "kd-restart: exact"
    assert lines[1].startswith("kd-short-stack: not tested; step needs 6 render targets")
    verdict = browser.run("element('verdict').textContent")
    assert verdict.startswith("The 12,288 test rays have") and verdict.endswith("kd-short-stack.")
    assert not browser.errors


def test_a_picture_that_is_too_large_keeps_the_verdict(browser: Browser, tmp_path: Path) -> None:
    """A picture that is too large gives a message, and the result of the page's test stays."""
    opened(browser, tmp_path, written(("kd-restart",)), STEP)
    browser.wait(TESTED)
    verdict = browser.run("element('verdict').textContent")
    browser.run("""{
        const asked = gl.getParameter.bind(gl);
        gl.getParameter = (name) => name === gl.MAX_TEXTURE_SIZE ? 128 : asked(name);
    }""")
    browser.select("#size", "256")
    assert "256 x 256 texels is larger" in browser.wait("element('message').textContent")
    assert browser.run("[element('selftest').dataset.state, element('verdict').textContent]") == [
        "done", verdict]
    assert all("256 x 256 texels is larger" in error for error in browser.errors)
    browser.errors.clear()
    browser.select("#size", "64")
    settle(browser)
    assert browser.run("element('message').textContent") == ""
