"""A desk: the viewer's panels without a window. Tests click on a widget by its label.

The panels draw into a framebuffer of the suite's own context. While a desk is open, the functions
of ImGui also note the place of each drawn widget, and each written text.
"""
from __future__ import annotations

import itertools
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from gpgpu_rt.viewer import Selection, Viewer

# Without these modules, the tests that import a desk are skipped.
imgui = pytest.importorskip("imgui_bundle").imgui
link = pytest.importorskip("gpgpu_rt.viewer.link")
panels = pytest.importorskip("gpgpu_rt.viewer.panels")
path_drawing = pytest.importorskip("gpgpu_rt.viewer.path_drawing")

WIDGETS = ("button", "small_button", "selectable", "combo", "begin_combo", "checkbox",
           "collapsing_header", "slider_int", "slider_float", "input_text", "plot_lines",
           "input_text_with_hint")
TEXTS = ("text_unformatted", "text_disabled", "text_wrapped")


class Desk:
    """The panels around a viewer's picture.

    Attributes
    ----------
    viewer, panels : as in the window
    widgets : widget's label -> (x, y) of a point on the widget in the last frame, in drawing order
    texts : the texts of the last frame
    hints : label of a text field -> the text that the empty field shows
    choices : label of a list -> the words of its entries
    """

    def __init__(self, monkeypatch: Any, clock: Any, selection: Selection,
                 size: tuple[int, int]) -> None:
        self.viewer = Viewer(selection, (64, 48), clock=clock)
        self._context = self.viewer.gpu.context
        self._clock, self._buffer = clock, None
        keys = SimpleNamespace(**{name: number for number, name in enumerate(link.KEYS)})
        self.window = SimpleNamespace(size=size, buffer_size=size, pixel_ratio=1.0, keys=keys,
                                      use=self._use, _window=None)
        self.widgets: dict[str, tuple[float, float]] = {}
        self.texts: list[str] = []
        self.hints: dict[str, str] = {}
        self.choices: dict[str, list[str]] = {}
        with self.viewer.gpu:
            self.link = link.Link(self.viewer.gpu, self.window)
            self.panels = panels.Panels(self.viewer, self.link, lambda: None)
        self._note(monkeypatch)
        self.frame(3)

    def _use(self) -> None:
        if self._buffer is None or self._buffer.size != self.window.size:
            self._buffer = self._context.framebuffer(
                [self._context.texture(self.window.size, 4)])
        self._buffer.use()

    def _note(self, monkeypatch: Any) -> None:
        """Replace ImGui's functions by functions that also note widgets and texts."""
        def widget(draw: Any, label: str, *more: Any, **named: Any) -> Any:
            found = draw(label, *more, **named)
            if draw.__name__ != "begin_combo" or not found:
                lo, hi = imgui.get_item_rect_min(), imgui.get_item_rect_max()
                # The middle of a table's row may be out of sight, so use the row's left end.
                across = lo.x + 6 if draw.__name__ == "selectable" else (lo.x + hi.x) / 2
                self.widgets[label] = across, (lo.y + hi.y) / 2
            if draw.__name__ == "input_text_with_hint":
                self.hints[label] = more[0]
            if draw.__name__ == "combo":
                self.choices[label] = more[1]
            return found

        def text(draw: Any, words: str) -> None:
            self.texts.append(words)
            draw(words)

        for names, wrapped in ((WIDGETS, widget), (TEXTS, text)):
            for name in names:
                draw = getattr(imgui, name)
                monkeypatch.setattr(imgui, name, partial(wrapped, draw))

    def frame(self, count: int = 1) -> None:
        """Draw frames as the window does."""
        for _ in range(count):
            for noted in (self.widgets, self.texts, self.hints, self.choices):
                noted.clear()
            self.viewer.resize(self.panels.layout.picture.size)
            self._clock.now += 1.0
            self.viewer.step()
            with self.viewer.gpu:
                self._use()
                self._context.clear()
                self.link.begin(0.02)
                if self.viewer.path is not None:
                    path_drawing.draw_path(self.viewer.path, self.viewer.view,
                                           self.panels.layout.picture)
                self.panels.draw((0, 0))
                self.link.end()

    def settle(self) -> None:
        """Draw frames until the picture is complete."""
        for _ in itertools.repeat(None, 40):
            self.frame()
            if self.viewer.finished:
                return self.frame(2)
        raise AssertionError(f"not finished: {self.viewer.message}")

    def move(self, x: float, y: float) -> None:
        """Move the mouse."""
        self.link.mouse_at(x, y)
        self.frame(2)

    def press(self, down: bool) -> None:
        """Press or release the left button."""
        self.link.button(1, down)
        self.frame(2)

    def click(self, label: str) -> None:
        """Click on a widget."""
        self.move(*self.widgets[label])
        self.press(True)
        self.press(False)

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Drag the mouse with the left button."""
        self.move(*start)
        self.press(True)
        self.move(*end)
        self.press(False)

    def pixels(self) -> np.ndarray:
        """Return the pixels of the last frame, (h, w, 3) uint8."""
        with self.viewer.gpu:
            width, height = self.window.size
            read = np.frombuffer(self._buffer.read(components=3, alignment=1), np.uint8)
        return read.reshape(height, width, 3)[::-1]

    def close(self) -> None:
        """Free the panels and the viewer."""
        imgui.destroy_context()
        self.viewer.release()
