"""Tests the viewer's panels without a window: their words, lists and headings, and the space that
they leave for the picture."""
from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from desk import Desk, link

import gpgpu_rt as rt
from gpgpu_rt.methods import family_of
from gpgpu_rt.viewer import Selection
from gpgpu_rt.viewer.layout import HELP, PANEL
from gpgpu_rt.viewer.overlay import projected

SIZE = (900, 600)
CHOSEN = (255, 240, 40)     # the colour of the box around the clicked row's node


@pytest.fixture
def desk(monkeypatch, clock, soup: str) -> Iterator[Callable[..., Desk]]:
    desks = []

    def made(method: str = "kd-stack", size: tuple[int, int] = SIZE, **options) -> Desk:
        desks.append(Desk(monkeypatch, clock, Selection(soup, method, options), size))
        return desks[-1]

    yield made
    for one in desks:
        one.close()


def controls(one: Desk) -> list[str]:
    """Returns the labels of the drawn controls and headings of the left panel, in their order."""
    # Do not test y: a long panel scrolls, so widgets may lie below the visible part.
    width = one.panels.layout.panel.width
    return [label for label, at in one.widgets.items() if at[0] < width]


@pytest.mark.parametrize("mode, fifth", [("picture", "##light"), ("heat", "##count"),
                                         ("passes", "##pass")])
def test_five_controls_come_first_and_all_others_are_folded(desk, mode: str, fifth: str) -> None:
    one = desk("kd-restart")
    one.viewer.look_at(mode)
    one.settle()
    labels = controls(one)
    first = [label for label in labels if label.startswith("##")]
    assert first[:5] == ["##scene", "##method", "##schedule", "##show", fifth]
    assert not set(first[5:]) - {"##ms", "##rays", "##passes", "##live"}, "a control is not folded"
    one.click("Options of kd-restart###own")
    assert {"##max_depth", "##build"} <= set(controls(one))
    one.click("Options of kd-restart###own")
    one.click("Options of every method###every")
    assert "##intersection" in controls(one) and "##schedule" in controls(one)
    assert "##max_depth" not in controls(one)
    for name in ("context", "statistics", "presort"):
        assert f"##{name}" not in one.widgets


def test_no_name_of_an_option_is_on_the_screen(desk) -> None:
    """Labels are plain words. A heading says how many options are changed. An option that has no
    effect with the present settings is not shown."""
    one = desk("kd-restart", build="hybrid")
    one.click("Options of kd-restart (1 changed)###own")
    assert "##morton_bits" in one.widgets and "Morton code bits" in one.texts
    one.click("Options of kd-restart (1 changed)###own")
    one.click("Options of every method###every")
    assert "Triangle test" in one.texts and "Passes between counts" not in one.texts
    said = [*one.texts, *(word for label, words in one.choices.items() if label != "##scene"
                          for word in words)]
    assert not [text for text in said if "_" in text]
    one.viewer.choose(one.viewer.selection.with_option("schedule", "step"))
    one.settle()
    assert "Passes between counts" in one.texts
    one.viewer.choose(one.viewer.selection.with_option("build", "sah"))
    one.settle()
    one.click("Options of kd-restart###own")
    assert "##morton_bits" not in one.widgets


def test_automatic_values_are_written_and_can_be_restored(desk) -> None:
    one = desk()
    one.settle()
    one.click("Options of kd-stack###own")
    depth = one.viewer.tracer.accelerator.automatic["max_depth"]
    assert one.hints["##max_depth"] == f"automatic ({depth})"
    assert one.hints["##stack_size"].startswith("automatic (")
    one.click("Options of kd-stack###own")
    one.click("Options of every method###every")
    assert one.choices["##storage"][0] == "automatic (fp32)"
    assert one.choices["##era"][0] == one.choices["##rasterised_bounds"][0] == "off"
    assert "loop: all steps in one pass" in one.choices["##schedule"]


def test_the_list_of_methods_explains_each(desk) -> None:
    one = desk()
    row = next(row for row in rt.methods() if row.name == "kd-stack")
    assert any(row.citation in text and row.summary[1:] in text for text in one.texts)
    one.click("##method")
    for row in rt.methods():
        at = one.texts.index(row.summary[0].upper() + row.summary[1:] + ".")
        assert one.texts[at + 1:at + 3] == [row.year, family_of(row.name)], row.name
        assert row.year.isdecimal() and row.year in row.citation
        assert row.name in one.widgets
    one.click("bih")
    one.settle()
    assert one.viewer.selection.method == "bih"
    assert len({family_of(row.name) for row in rt.methods()}) > 8


def test_a_clicked_row_shows_its_node(desk) -> None:
    one = desk("kd-restart")
    one.settle()
    one.viewer.follow(tuple(np.array(one.viewer.size) // 2))
    one.settle()
    assert any(text.startswith("Click on a row") for text in one.texts)
    assert not (one.pixels() == CHOSEN).all(axis=2).any()
    one.click("2##row")
    path, tracer = one.viewer.path, one.viewer.tracer
    number = int(path.rows[path.row][path.columns.index("node")])
    assert path.row == 2 and f"node {number}" in one.texts
    split = tracer.accelerator.tables["kd_node"]["split"][number]
    assert np.float32(one.texts[one.texts.index("split") + 1]) == split
    chosen = (one.pixels() == CHOSEN).all(axis=2)
    rect = one.panels.layout.picture
    assert chosen[rect.y:rect.y + rect.height, rect.x:rect.x + rect.width].any()
    lo, hi = tracer.accelerator.boxes()
    assert (path.place.box == [lo[number], hi[number]]).all()
    one.click("2##row")
    assert path.row is None and not (one.pixels() == CHOSEN).all(axis=2).any()
    path.go(1)
    path.go(10 ** 6)
    one.frame(3)
    assert path.row == len(path.rows) - 1 and f"{path.rows[-1][0]}##row" in one.widgets
    one.click("close##path")
    assert one.viewer.path is None


def test_the_command_is_copied(desk, monkeypatch) -> None:
    held = []
    monkeypatch.setattr(link.glfw, "set_clipboard_string",
                        lambda window, text: held.append(text))
    one = desk()
    one.settle()
    one.click("Copy")
    assert held == [one.viewer.command] and "Copied" in one.widgets
    one.viewer.choose(one.viewer.selection.with_method("grid"))
    one.settle()
    assert "Copy" in one.widgets, "the button says Copied, but the command is new"


@pytest.mark.parametrize("size", [(1280, 800), SIZE])
def test_the_picture_fills_the_free_part(desk, size: tuple[int, int]) -> None:
    """The picture fills the part of the window that no panel covers. The picture shows all that a
    square picture of the scene's own camera shows, even after a panel or the window is resized."""
    one = desk("kd-restart", size)

    def framed(width: int, height: int) -> None:
        one.settle()
        rect = one.panels.layout.picture
        assert rect.size == (width, height) == one.viewer.size
        assert one.viewer.image.shape[:2] == (height, width)
        own = one.viewer.scene.camera
        shown_in_a_square = own.rays((16, 16))[1].reshape(-1, 1, 3) * [[0.0], [1.0]] + own.eye
        at = projected(one.viewer.view, rect.size, shown_in_a_square)[:, 1]
        assert ((at > 0) & (at < rect.size)).all()
        # The square fills the smaller side: the object is as large as the free part allows.
        assert np.ptp(at, axis=0).max() > 0.85 * min(width, height)

    low = one.panels.layout.bar.height
    framed(size[0] - PANEL, size[1] - low)
    one.panels.help = True
    aside = min(HELP, (size[0] - PANEL) // 2)
    framed(size[0] - PANEL - aside, size[1] - low)
    one.click("close##keys")
    assert not one.panels.help
    one.drag((PANEL - 1, 300), (PANEL - 91, 300))
    framed(size[0] - PANEL + 90, size[1] - low)
    one.window.size = one.window.buffer_size = (500, 700)
    framed(500 - PANEL + 90, 700 - low)
    one.window.size = one.window.buffer_size = size
    framed(size[0] - PANEL + 90, size[1] - low)
    one.viewer.follow((3, 3))
    one.settle()
    table = one.panels.layout.table
    framed(size[0] - PANEL + 90, size[1] - low - table.height)
    one.drag((table.x + 200, table.y + 1), (table.x + 200, table.y + 61))
    framed(size[0] - PANEL + 90, size[1] - low - table.height + 60)
    one.panels.shown = False
    framed(*size)
