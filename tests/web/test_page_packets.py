"""A page of methods that trace packets counts packets, and both of its counts agree."""
from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from devtools import Browser
from pages import in_browser, opened, settle, written

pytestmark = in_browser


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with Browser() as one:
        yield one


def test_packets_are_called_packets(exact_renderer, browser: Browser, tmp_path: Path) -> None:
    opened(browser, tmp_path, written(("bvh-packet", "kd-texture-stack")),
           "method=bvh-packet&schedule=step&rays=64&pass=3")
    packets = 64 * 64 // 4
    assert f"of {packets:,} packets are alive" in browser.run("element('alive-text').textContent")
    assert " packets alive" in browser.run("element('counts').textContent")
    browser.select("#method", "kd-texture-stack")
    settle(browser)
    assert " rays alive" in browser.run("element('counts').textContent")


PACKETS = ("bvh-packet", "kd-packet", "kd-ropes-packet", "bvh-stack")   # bvh-stack: 1 x 1 rays


@pytest.mark.parametrize("method", PACKETS)
def test_both_counts_of_live_packets_are_equal(exact_renderer, browser: Browser, tmp_path: Path,
                                               method: str) -> None:
    """At each position of the slider, the chart and the line about the picture have the same
    number of live packets. The slider ends where no packet is alive. Each colour of a waiting
    packet is in the legend, and the program has a mark for each kernel."""
    opened(browser, tmp_path, written(PACKETS), f"method={method}&schedule=step&rays=64")
    last = browser.run("counted.last")
    assert browser.run("[result.alive, counted.alive[0] > 0]") == [0, True]
    all_, noun = ("4,096", "rays") if method == "bvh-stack" else ("1,024", "packets")
    kernels, names = set(), browser.run("schedule().structure.kernels")
    for step in sorted({1, 2, 5, last // 3, last // 2, last - 5, last - 1, last}):
        browser.run(f"goTo({step}), 0")
        settle(browser)
        chart, line, phases = browser.run("""[element("alive-text"), element("counts")].map(
            (one) => one.textContent).concat([(() => {
                const [texel, channel] = field(schedule(), "phase");
                const values = readTexture(
                    result.states[texel], ...sizeOf.get(result.states[texel]));
                return [...new Set(values.filter((_, k) => k % 4 === channel))];
            })()])""")
        alive = browser.run("result.alive")
        assert (alive > 0) == (step < last)
        assert chart.startswith(f"{alive:,} of {all_} {noun} are alive")
        assert f" {alive} {noun} alive, " in line
        kernels |= {names[int(phase) - 1] for phase in phases if phase > 0}
    assert len(kernels) > 1
    legend = browser.run("[...element('waits').children].map((one) => one.textContent)")
    assert legend == [f"waits for {name}" for name in names]
    assert set(names) == set(browser.run(
        "[...element('text').querySelectorAll('mark')].map((one) => one.dataset.kernel)"))
