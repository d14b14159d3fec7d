"""Panels: draws the panels of the viewer around the picture."""
from __future__ import annotations

from collections.abc import Callable

from imgui_bundle import imgui

from .command_bar import CommandBar
from .controls import Controls
from .key_list import draw_keys
from .layout import HELP, MOST_SHARE, PANEL, TABLE, PanelLayout, Rect, arranged
from .link import Link
from .model import Viewer
from .path_table import PathTable
from .program_view import ProgramView
from .style import FIXED_SIZE, NOTICE, apply
from .widgets import FIXED


class Panels:
    """All panels of the viewer.

    Parameters
    ----------
    viewer : the model
    link : shows the panels in the window
    save : writes the picture

    Attributes
    ----------
    help : whether the list of keys is shown
    shown : False hides all panels, the list of keys too
    """

    def __init__(self, viewer: Viewer, link: Link, save: Callable[[], None]) -> None:
        self.viewer, self.link = viewer, link
        self.help, self.shown = False, True
        self.program = ProgramView()
        self._fonts = apply()
        self._width = PANEL     # wanted width of the left panel
        self._controls = Controls(viewer, link)
        self._bar = CommandBar(viewer, self._fonts, save, self._change_help)
        self._table = PathTable(self._fonts, TABLE)

    @property
    def layout(self) -> PanelLayout:
        return arranged(self.link.window.size, panel=self._width if self.shown else None,
                        help_width=HELP if self.help else None,
                        table=None if self.viewer.path is None else self._table.height)

    def draw(self, mouse: tuple[int, int]) -> None:
        """Draw all panels. ``mouse`` is the pixel under the mouse."""
        layout = self.layout
        if layout.panel is not None:
            self._left(layout.panel, mouse)
        if layout.bar is not None:
            self._bar.draw(layout.bar)
        if layout.table is not None and self.viewer.path is not None:
            most = int(MOST_SHARE * (layout.bar.y if layout.bar else layout.table.height))
            if self._table.draw(self.viewer.path, layout.table, most):
                self.viewer.path = None
        if self.program.shown:
            self._program(layout.picture)
        if layout.help is not None and draw_keys(layout.help):
            self.help = False
        self._notice(layout.picture)

    def _change_help(self) -> None:
        self.help = not self.help

    def _left(self, rect: Rect, mouse: tuple[int, int]) -> None:
        imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y))
        imgui.set_next_window_size(imgui.ImVec2(*rect.size))
        most = max(MOST_SHARE * self.link.window.size[0], 32)
        imgui.set_next_window_size_constraints(imgui.ImVec2(32, rect.height),
                                               imgui.ImVec2(most, rect.height))
        imgui.begin("controls", None, FIXED)
        if round(imgui.get_window_width()) != max(rect.width, 32):
            self._width = round(imgui.get_window_width())
        self._controls.draw(mouse)
        imgui.end()

    def _notice(self, rect: Rect) -> None:
        """Draw a line at the top of the picture: present work, else the last error or report."""
        text = self.viewer.busy or self.viewer.message
        if not text:
            return
        imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y))
        imgui.set_next_window_size(imgui.ImVec2(rect.width, 0))
        imgui.set_next_window_bg_alpha(0.9)
        imgui.begin("notice", None, FIXED | imgui.WindowFlags_.no_resize.value)
        imgui.push_style_color(imgui.Col_.text.value, NOTICE)
        imgui.text_wrapped(text)
        imgui.pop_style_color()
        if not self.viewer.busy and imgui.small_button("close##notice"):
            self.viewer.message = ""
        imgui.end()

    def _program(self, rect: Rect) -> None:
        imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y), imgui.Cond_.first_use_ever.value)
        imgui.set_next_window_size(imgui.ImVec2(*rect.size), imgui.Cond_.first_use_ever.value)
        program = self.program
        _, program.shown = imgui.begin(f"{program.title}###program", True,
                                       imgui.WindowFlags_.horizontal_scrollbar.value)
        imgui.push_font(self._fonts.fixed, FIXED_SIZE)
        clipper = imgui.ListClipper()
        clipper.begin(len(program.lines))
        while clipper.step():
            for line in program.lines[clipper.display_start:clipper.display_end]:
                imgui.text_unformatted(line)
        imgui.pop_font()
        imgui.end()
