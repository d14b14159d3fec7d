"""The page shows the path of a clicked ray. The path's states equal the states of the host's
tracer. The path's boxes agree with the boxes in a tree's tables."""
from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from devtools import Browser
from pages import in_browser, opened, settle, written

import gpgpu_rt as rt
from gpgpu_rt.inspect.observe import observe_states
from gpgpu_rt.methods import find_method
from gpgpu_rt.methods.kdtree.records import KD_BOUNDS

pytestmark = in_browser
METHODS = ("kd-restart", "kd-backtrack", "kd-push-down", "kd-ropes", "grid", "grid-proximity",
           "bvh-threaded", "bih", "tree-unit", "geometry-image", "brute-force", "kd-stack",
           "kd-packet")
PATHS = METHODS[:11]
BOXED = METHODS[:9]


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Iterator[Browser]:
    with Browser() as browser:
        opened(browser, tmp_path_factory.mktemp("page"), written(METHODS),
               "method=kd-restart&schedule=step&rays=64&ray=0.63,0.71")
        yield browser


def path(page: Browser, method: str) -> tuple[list[dict], np.ndarray, np.ndarray, np.ndarray]:
    """Shows the whole path of the ray by a method. Returns the path's states, and the ray's
    origin, direction and hit."""
    page.select("#method", method)
    page.select("#schedule", "step")
    page.run("goTo(null), 0")
    settle(page)
    states, *rest = page.run("[path.states, path.origin, [...path.direction].slice(0, 3), "
                             "[...path.hit]]")
    return states, *(np.array(one) for one in rest)


def host_states(method: str, origin: np.ndarray, direction: np.ndarray
                ) -> tuple[list[dict], rt.Hits, dict[str, np.ndarray]]:
    """Returns a ray's state after each pass of the host's tracer, the ray's hit, and the texels of
    the table of bounds."""
    found: list[dict] = []
    tables: dict[str, np.ndarray] = {}
    options = {} if find_method(method).steps_once else {"steps_per_pass": 1}
    with rt.Tracer(rt.load_scene("cornell"), method, schedule="step", **options) as tracer:
        record = tracer.method.state

        def look(one: object) -> None:
            planes = [np.frombuffer(texture.read(), np.float32)[None, :4]
                      for texture in one.outputs[:record.texels]]
            fields = record.unpack_planes(planes)
            if not found or fields["steps"][0] > found[-1]["steps"]:
                found.append({name: values[0].tolist() for name, values in fields.items()})
            tables.update({name: np.frombuffer(texture.read(), np.float32).reshape(-1, 4)
                           for name, texture in one.inputs.items() if name == "kd_bounds_table"})
        with observe_states(tracer, look):
            hits = tracer.trace(origin[None], direction[None])
    return found, hits, tables


@pytest.mark.parametrize("method", PATHS)
def test_the_path_is_the_path_of_the_host(exact_renderer, page: Browser, method: str) -> None:
    states, origin, direction, hit = path(page, method)
    told, hits, _ = host_states(method, origin, direction)
    assert len(states) == len(told) > 3
    for ours, theirs in zip(states, told):
        for name, value in theirs.items():
            assert np.array_equal(np.float32(ours["fields"][name]), np.float32(value)), name
    assert hit[3] == hits.triangle[0] and np.float32(hit[0]) == hits.t[0]


@pytest.mark.parametrize("method", BOXED)
def test_boxes_and_triangles_are_on_the_way(exact_renderer, page: Browser, method: str) -> None:
    """Each box contains the ray's interval, with the exceptions below, and some step tests the
    triangle that is hit."""
    states, origin, direction, hit = path(page, method)
    boxes = [(one, np.array(one["box"])) for one in states if one["box"]]
    assert len(boxes) > 2
    for one, (lo, hi) in boxes:
        assert (lo <= hi).all()
        # Skip climbs and ropes. While a ray climbs, its interval is the whole rest of its path.
        # The node that a rope leads to may contain only a part of this rest.
        if one["interval"] and one["kernel"] not in ("climb", "follow_rope"):
            start, end = one["interval"]
            end = start if method == "kd-ropes" else max(start, end)
            for t in (start, 0.5 * (start + end)):
                at = origin + t * direction
                assert (lo - 0.1 <= at).all() and (at <= hi + 0.1).all()
    # In at least one step that tests the hit triangle, the box contains the hit point.
    at = origin + hit[0] * direction
    corners = rt.load_scene("cornell").triangles[int(hit[3])]
    tests = [one for one in states
             if one["triangle"] and np.array_equal(np.float32(one["triangle"]), corners)]
    assert tests
    assert any((np.array(one["box"][0]) - 0.1 <= at).all()
               and (at <= np.array(one["box"][1]) + 0.1).all() for one in tests if one["box"])


def test_split_planes_give_the_boxes_of_the_tree(exact_renderer, page: Browser) -> None:
    states, origin, direction, _ = path(page, "kd-restart")
    _, _, tables = host_states("kd-backtrack", origin, direction)
    bounds = KD_BOUNDS.unpack(tables["kd_bounds_table"].reshape(-1, KD_BOUNDS.texels, 4))
    compared = [one for one in states if one["box"]]
    assert len({one["fields"]["node"] for one in compared}) > 3
    for one in compared:
        node = int(one["fields"]["node"])
        assert np.allclose(one["box"], [bounds["lo"][node], bounds["hi"][node]], atol=0.01)


def test_only_nodes_get_boxes(exact_renderer, page: Browser) -> None:
    """`splitBoxes` gives a box for a node's number, and nothing for any other number."""
    path(page, "kd-restart")
    lo, hi, *none = page.run("""(async () => {
        const boxOf = await splitBoxes(schedule()), left = await reader(schedule(), "left");
        const [parents] = await Promise.all(splitTrees.values());
        return [...boxOf(0), ...[-1, 0.5, parents.length, NaN].map(boxOf),
                boxOf(left(0)).flat().every(Number.isFinite)];
    })()""")
    bounds = page.run("['scene_lo', 'scene_hi'].map((name) => uniformOf(schedule(), name))")
    assert [lo, hi] == bounds and none == [None] * 4 + [True]


def test_a_path_is_traced_only_for_the_states_that_are_kept(exact_renderer, page: Browser) -> None:
    """The page stops tracing a path at the largest number of states that it keeps
    (MOST_STATES)."""
    path(page, "kd-restart")
    turns, most = page.run("""(async () => {
        const whole = trace, found = [];
        globalThis.trace = async (...given) => {
            found.push(given[4].most);
            return whole(...given);
        };
        await pathOf(chosen.method, chosen.camera, path.direction);
        globalThis.trace = whole;
        return [found[0], MOST_STATES];
    })()""")
    assert turns == most - 1       # the state after the set-up is kept too


def test_the_slider_moves_the_step_in_space(exact_renderer, page: Browser) -> None:
    states, *_ = path(page, "kd-restart")
    whole, boxes = page.pixels("#space"), page.run("space.dataset.boxes")
    assert "has ended" in page.run("element('space-text').textContent")
    page.click("#pass", (0.01, 0.5))
    settle(page)
    step = page.run("chosen.most")
    early = page.pixels("#space")
    assert (whole != early).any(axis=2).mean() > 0.005
    assert int(page.run("space.dataset.boxes")) < int(boxes)
    for _ in range(len(states) - 1 - step):
        page.press("ArrowRight")
        settle(page)
        step += 1
        kernel = states[step]["kernel"]
        told = page.run("element('space-text').textContent")
        assert f"step {step} of {len(states) - 1}" in told and kernel in told
        assert page.run("[...document.querySelectorAll('mark.present')]"
                        ".map(one => one.dataset.kernel)") == ([kernel] if kernel else [])
        assert not kernel or page.run(
            "(() => { const [one, box] = [document.querySelector('mark.present'), element('text')]"
            ".map(one => one.getBoundingClientRect()); return one.top > box.top"
            " && one.top < box.bottom; })()")


def test_a_drag_turns_the_space(exact_renderer, page: Browser) -> None:
    path(page, "grid")
    before, picture = page.pixels("#space"), page.pixels("#picture")
    page.drag("#space", (0.3, 0.5), (0.5, 0.5), (0.6, 0.4))
    assert (before != page.pixels("#space")).any(axis=2).mean() > 0.01
    assert np.array_equal(picture, page.pixels("#picture"))


PLACE = """(() => {
    const [x, y] = projector(space.getContext("2d")).placeOf(pivot).map(
        (at) => at / space.width * space.clientWidth), box = space.getBoundingClientRect();
    return [box.left + space.clientLeft + x, box.top + space.clientTop + y];
})()"""      # where the page shows the point of the ray that the present step has reached


def test_the_wheel_zooms_the_space(exact_renderer, page: Browser) -> None:
    """The point under the pointer stays in its place. A zoomed drawing turns about the ray's
    present point. If the drawing is as small as possible, the wheel scrolls the page."""
    path(page, "kd-restart")
    page.run("goTo(5), 0")
    settle(page)
    page.box("#space")
    before, pixels = np.array(page.run(PLACE)), page.pixels("#space")
    pointer = before.round()        # the browser rounds a pointer's place
    for _ in range(6):
        page.wheel(*pointer, -100)
    zoom = page.wait("spaceView.zoom > 5 && spaceView.zoom")
    zoomed = page.run(PLACE)
    assert zoomed == pytest.approx(pointer + zoom * (before - pointer), abs=0.1)
    assert (pixels != page.pixels("#space")).any(axis=2).mean() > 0.01
    yaw = page.run("spaceView.yaw")
    page.drag("#space", (0.3, 0.5), (0.4, 0.5), (0.5, 0.5))
    assert page.run("spaceView.yaw") < yaw - 0.1
    assert page.run(PLACE) == pytest.approx(zoomed, abs=0.1)
    page.run("scrollTo(0, 0)")
    page.wheel(*pointer, 2000)
    page.wait("spaceView.zoom === 1")
    assert page.run("[...spaceView.pan, scrollY]") == [0, 0, 0]
    page.wheel(*pointer, 100)
    page.wait("scrollY > 0")


def test_two_fingers_zoom_the_space(exact_renderer, page: Browser) -> None:
    path(page, "kd-restart")
    page.run("zoomSpace(0, [0, 0])")
    left, top, width, height = page.box("#space")
    x, y = left + 0.5 * width, top + 0.5 * height
    yaw = page.run("spaceView.yaw")
    for kind, *ways in (("touchStart", -50), ("touchStart", -50, 50), ("touchMove", -100, 100),
                        ("touchMove", -150, 150), ("touchEnd",)):
        page.send("Input.dispatchTouchEvent", type=kind, touchPoints=[
            {"x": x + way, "y": y, "id": k} for k, way in enumerate(ways)])
    assert page.run("spaceView.zoom") == pytest.approx(3, rel=0.05)
    assert page.run("[touches.size, spaceView.yaw]") == [0, yaw]
    page.run("zoomSpace(0, [0, 0])")


def test_a_clicked_pixel_gets_its_ray(exact_renderer, page: Browser) -> None:
    path(page, "bvh-threaded")
    page.click("#picture", (0.25, 0.25))
    settle(page)
    assert "ray (16, 16)" in page.run("element('ray').textContent")
    first = page.run("[...path.direction].slice(0, 3)")
    page.click("#picture", (0.75, 0.25))
    settle(page)
    assert "ray (48, 16)" in page.run("element('ray').textContent")
    assert not np.allclose(first, page.run("[...path.direction].slice(0, 3)"))


@pytest.mark.parametrize("method, reason", [
    ("kd-stack", "method kd-stack runs only under schedule loop, which has one pass to look at; "
     "watch kd-short-stack or kd-texture-stack."),
    ("kd-packet", "method kd-packet traces packets, and a state belongs to all rays of a packet."
     )])
def test_a_ray_without_a_path_has_a_reason(exact_renderer, page: Browser, method: str,
                                           reason: str) -> None:
    page.select("#method", method)
    settle(page)
    assert page.run("[path.states, element('space-text').textContent]") == [
        None, f"The page shows the ray without a path: {reason}"]


@pytest.mark.parametrize("method", ["kd-restart", "kd-push-down", "kd-backtrack", "kd-ropes",
                                    "bvh-threaded", "bih"])
def test_visits_and_restarts_are_the_hosts(exact_renderer, page: Browser, method: str) -> None:
    page.click("#picture", (0.63, 0.71))    # a ray with several leaves in every tree
    states, origin, direction, _ = path(page, method)
    with rt.Tracer(rt.load_scene("cornell"), method, statistics=True) as tracer:
        hits = tracer.trace(origin[None], direction[None])
    found = page.run("(({visits, restarts}) => ({visits, restarts}))(visitsOf(path.states))")
    leaves = int(hits.leaves_visited[0])
    assert leaves > 1
    # kd-restart and kd-push-down restart after each leaf except the last leaf.
    restarts = leaves - 1 if method in ("kd-restart", "kd-push-down") else 0
    assert found["restarts"] == restarts
    if restarts:
        assert found["visits"] == hits.nodes_visited[0]
    told = page.run("element('space-text').textContent")
    # The page counts restarts only for methods that can restart.
    assert f"{restarts} restart" in told if restarts else "restart" not in told
    assert f"{found['visits']} visits to " in told
    first = [one["fields"]["node"] for one in states].index(0)
    again = [k for k in range(first + 1, len(states)) if states[k]["fields"]["node"] == 0
             and states[k - 1]["fields"]["node"] > 0 and states[k]["box"]]
    if method == "kd-restart":
        assert len(again) == restarts
        at = page.run(f"stepLine(path.states, {again[0]}, schedule().structure)")
        assert "restarts at the root" in at and "1 restart so far" in at
        downs = np.cumsum([0] + [one["kernel"] == "down" for one in states])
        for step in (0, 1, 2, again[0], again[0] + 1):  # each visited node runs `down`
            at = page.run(f"stepLine(path.states, {step}, schedule().structure)")
            assert f"; {downs[step]:,} visit" in at
        texts = page.run("""{
            const context = space.getContext("2d"), texts = [];
            context.fillText = (text) => texts.push(text);
            spaceAt();
            delete context.fillText;
            texts;
        }""")
        assert texts == [f"restart {restarts}, at the root"]
