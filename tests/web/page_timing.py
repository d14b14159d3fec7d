"""Measures a page: the time to the first picture, the time from each move of a drag to its
picture, and the processor time of the browser."""
from __future__ import annotations

import os
from pathlib import Path

from devtools import Browser
from pages import settle

# This script notes when the first picture appears, and the time from each move of the mouse to the
# picture of the move.
_CLOCK = """addEventListener("DOMContentLoaded", () => {
globalThis.firstPicture = 0; globalThis.answers = [];
if (location.protocol === "about:") return;
let moved = null;
addEventListener("pointermove", (event) => { moved ??= event.timeStamp; }, true);
new MutationObserver(() => {
    firstPicture ||= performance.now();
    if (moved !== null && dragging) answers.push(performance.now() - moved);
    moved = null;
}).observe(document.getElementById("picture"), {attributeFilter: ["data-shown", "data-progress"]});
});"""


def first_picture(browser: Browser, page: Path, choices: str = "") -> float:
    """Returns the seconds from the opening of a page to its first picture."""
    browser.send("Page.addScriptToEvaluateOnNewDocument", source=_CLOCK)
    browser.open(page, choices)
    return 0.001 * float(browser.wait("globalThis.firstPicture"))


def answers(browser: Browser, moves: int = 20) -> list[float]:
    """Returns the milliseconds from each move of a drag until the page shows the picture for the
    move. First open the page with ``first_picture``."""
    browser.wait("element('selftest').dataset.state === 'done'", 600)
    settle(browser)
    left, top, width, height = browser.box("#picture")
    browser.run("answers.length = 0")
    x, y = left + 0.3 * width, top + 0.5 * height
    browser.mouse("pressed", x, y)
    for k in range(moves):
        x += 6 if k < moves // 2 else -6
        browser.mouse("moved", x, y)
        browser.wait(f"answers.length > {k} && !busy")
    browser.mouse("released", x, y)
    settle(browser)
    return [float(one) for one in browser.run("answers")]


def processor_seconds(browser: Browser) -> float:
    """Returns the processor time that the browser's processes have used so far. Unlike the time on
    a clock, this time depends little on other work of the machine."""
    ticks = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue        # the process has ended in the meantime
        if int(fields[2]) == browser.process:
            ticks += int(fields[11]) + int(fields[12])
    return ticks / os.sysconf("SC_CLK_TCK")
