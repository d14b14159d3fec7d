"""Command bar: draws the bottom panel, with the command that makes the picture."""
from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui

from .layout import Rect
from .line import line_of
from .model import Viewer
from .style import FIXED_SIZE, Fonts
from .widgets import place, tip


class CommandBar:
    """The bottom panel.

    Parameters
    ----------
    save, show_keys : the actions of two buttons
    """

    def __init__(self, viewer: Viewer, fonts: Fonts, save: Callable[[], None],
                 show_keys: Callable[[], None]) -> None:
        self.viewer, self._fonts = viewer, fonts
        self._save, self._show_keys = save, show_keys
        self._copied = ""       # the last copied command

    def draw(self, rect: Rect) -> None:
        place("bar", rect)
        viewer, (line, note) = self.viewer, line_of(self.viewer)
        if imgui.small_button("Save (P)"):
            self._save()
        imgui.same_line()
        if imgui.small_button("Keys (H)"):
            self._show_keys()
        imgui.same_line()
        imgui.text_unformatted(self._size())
        held = viewer.held_back
        if held is not None:
            imgui.same_line()
            if imgui.small_button(f"Draw every pixel: about {held:.0f} s (Enter)"):
                viewer.insist()
        imgui.begin_disabled(not line)
        if imgui.button("Copied" if line and line == self._copied else "Copy", imgui.ImVec2(62, 0)
                        ):
            imgui.set_clipboard_text(line)
            self._copied = line
        imgui.end_disabled()
        tip("Copy the command that makes this picture.")
        imgui.same_line()
        imgui.set_next_item_width(-1.0)
        imgui.push_font(self._fonts.fixed, FIXED_SIZE)
        imgui.input_text("##line", viewer.command, imgui.InputTextFlags_.read_only.value)
        imgui.pop_font()
        tip(f"This command {note}:\n{line}" if line else note)
        imgui.end()

    def _size(self) -> str:
        viewer = self.viewer
        width, height = viewer.size
        if viewer.image is None:
            return f"{width} x {height} pixels"
        mine = viewer.image.shape[1::-1]
        if mine == viewer.size:
            return f"{width} x {height} pixels"
        more = "" if viewer.finished else ", refining"
        return f"{mine[0]} x {mine[1]} of {width} x {height} pixels{more}"
