"""The panels of the viewer: choices, measurements, and the path of a ray.

Every list of choices comes from the tables of methods, options, integrators and scenes.
"""
from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from imgui_bundle import imgui

from ..errors import OptionError
from ..inspect import false_colours as colours
from ..inspect.heat import KINDS
from ..methods import methods
from ..options import Option, spell
from ..render.integrators import INTEGRATORS
from ..scene.loading import scene_names
from ..text_format import counted
from .heat_view import LAYOUTS
from .line import line_of
from .link import Link
from .model import MODES, Viewer
from .program_view import ProgramView
from .selection import Selection

WIDTH, LOW = 304, 58        # width of the left panel and height of the bottom panel, in pixels
NAME = 124      # width in pixels of the longest name of an option
GRAPH = 40      # height of a graph in pixels
HELP = (
    ("drag", "orbit the scene; in free flight, look around"),
    ("right drag", "pan"),
    ("wheel", "move closer or farther away"),
    ("W A S D Q E", "fly (faster with Shift)"),
    ("C", "switch between orbit and free flight"),
    ("R", "reset the camera"),
    ("click", "show the path of the pixel's ray, in a table and in space"),
    ("1 2 3", "show the picture, heat maps, or passes"),
    ("M, Shift+M", "next method, previous method"),
    ("left, right", "previous pass, next pass (ten with Shift)"),
    ("Enter", "draw every pixel, even if that takes long"),
    ("P", "save the picture with its settings"),
    ("Tab", "hide or show the panels"),
    ("T", "show or hide the text of the program that runs"),
    ("H", "hide or show this help"),
    ("Esc", "close the open list, the path, the text or the message"),
    ("Ctrl+Q", "quit"),
)
_ENTER = imgui.InputTextFlags_.enter_returns_true.value


class Panels:
    """All panels of the viewer.

    Parameters
    ----------
    viewer : the model
    link : draws the panels
    save : writes the picture
    """

    def __init__(self, viewer: Viewer, link: Link, save: Callable[[], None]) -> None:
        self.viewer, self.link, self._save = viewer, link, save
        self.help, self.shown = False, True
        self.program = ProgramView()
        self._source = ""

    def draw(self, mouse: tuple[int, int]) -> None:
        """Draw all panels of a frame. ``mouse`` is the pixel of the picture under the mouse."""
        width, height = self.link.window.size
        if self.shown:
            self._left(height - LOW, mouse)
            self._below(width, height)
        if self.viewer.path is not None:
            self._path(width, height)
        if self.program.shown:
            self._program(width, height)
        if self.help:
            self._helping(width)
        self._notice(width)

    # Left: selection, graphs, modes ---------------------------------------------------------

    def _left(self, height: int, mouse: tuple[int, int]) -> None:
        _place("gpgpu-rt", 0, 0, WIDTH, height)
        imgui.push_item_width(_room() - NAME)
        viewer = self.viewer
        selection = viewer.selection
        self._scene(selection)
        names = [row.name for row in methods()]
        changed, at = imgui.combo("method", names.index(selection.method), names, 20)
        imgui.set_item_tooltip(f"{selection.row.citation}: {selection.row.summary}")
        if changed:
            viewer.choose(selection.with_method(names[at]))
        changed, at = imgui.combo("show", MODES.index(viewer.mode), list(MODES))
        if changed:
            viewer.look_at(MODES[at])
        if viewer.mode == "heat":
            self._heat()
        elif viewer.mode == "passes":
            self._passes(mouse)
        if imgui.collapsing_header("costs", imgui.TreeNodeFlags_.default_open.value):
            self._graphs()
        if imgui.collapsing_header("options", imgui.TreeNodeFlags_.default_open.value):
            self._options(selection.known(), viewer.tracer.options, selection.with_option)
        if imgui.collapsing_header("light"):
            kinds = list(INTEGRATORS)
            changed, at = imgui.combo("integrator", kinds.index(selection.integrator), kinds)
            if changed:
                viewer.choose(selection.with_integrator(kinds[at]))
            known = selection.light_options()
            values = {**{o.name: o.default for o in known}, **selection.light}
            self._options(known, values, selection.with_light)
        imgui.pop_item_width()
        imgui.end()

    def _scene(self, selection: Selection) -> None:
        names = scene_names()
        if selection.scene not in names:
            names.append(selection.scene)
        shown = [name if len(name) < 40 else "..." + name[-37:] for name in names]
        changed, at = imgui.combo("scene", names.index(selection.scene), shown, 20)
        scene = self.viewer.scene
        imgui.set_item_tooltip(f"{len(scene):,} triangles, {scene.source}"
                               + (f"; stand-in for {scene.stand_in}" if scene.stand_in else ""))
        if changed:
            self.viewer.open(names[at])
        entered, self._source = imgui.input_text("file", self._source, _ENTER)
        imgui.set_item_tooltip("type the name of a mesh or scene file and press Enter, or drop "
                               "the file on the window")
        if entered and self._source.strip():
            self.viewer.open(self._source.strip())

    def _options(self, known: Sequence[Option], values: Any,
                 change: Callable[[str, Any], Selection]) -> None:
        for option in known:
            changed, value = _chooser(option, values[option.name])
            imgui.set_item_tooltip(option.help)
            if changed:
                try:
                    if isinstance(value, str) and option.choices is None:
                        value = option.parse(value.strip())
                    self.viewer.choose(change(option.name, value))
                except OptionError as failure:
                    self.viewer.message = str(failure)

    def _graphs(self) -> None:
        """Draw graphs of the last pictures. For a journey, draw only live rays: its times would
        include the storing of all states."""
        history, journey = list(self.viewer.history), self.viewer.journey
        wide = _room()
        half = (wide - imgui.get_style().item_spacing.x) / 2
        if self.viewer.mode == "passes":
            if journey is None:
                return
            _graph("live", "live rays", journey.live, wide)
        elif history:
            last = history[-1]
            for k, (name, now, values) in enumerate((
                    ("ms", f"{last.seconds * 1e3:.0f} ms", [one.seconds for one in history]),
                    ("rays", f"{last.rays_per_second / 1e6:.2f} Mrays/s",
                     [one.rays_per_second for one in history]),
                    ("passes", counted(last.passes, "pass"), [one.passes for one in history]),
                    ("live", "live rays" if last.live else "not counted by loop", last.live))):
                if k % 2:
                    imgui.same_line()
                _graph(name, now, values, half)
        else:
            return
        imgui.set_item_tooltip("live rays after each pass; counted only under the schedules step "
                               "and kernels")

    # Heat and passes ------------------------------------------------------------------------

    def _heat(self) -> None:
        viewer, view = self.viewer, self.viewer.heat
        kinds = list(KINDS)
        changed, at = imgui.combo("count", kinds.index(view.what), kinds)
        if changed:
            viewer.change_heat(what=kinds[at])
        names = ["-", *(row.name for row in methods())]
        changed, at = imgui.combo("beside", names.index(view.other or "-"), names, 20)
        if changed:
            viewer.change_heat(other=None if not at else names[at])
        if view.other is not None:
            changed, at = imgui.combo("layout", LAYOUTS.index(view.layout), list(LAYOUTS))
            if changed:
                viewer.change_heat(layout=LAYOUTS[at])
            if view.layout == LAYOUTS[0]:
                changed, part = imgui.slider_float("wipe", view.wipe, 0.0, 1.0, "%.2f")
                if changed:
                    viewer.change_heat(wipe=part)
        for title in view.titles():
            imgui.text_wrapped(title)
        if view.maps:
            self._picture("bar", np.asarray(view.scale(_room())))

    def _passes(self, mouse: tuple[int, int]) -> None:
        viewer, journey = self.viewer, self.viewer.journey
        if journey is None:
            imgui.text_wrapped(viewer.failed or "passes are drawn when the camera is at rest")
            return
        # The slider's value is an index and not the number of a pass, so typing is disabled.
        changed, at = imgui.slider_int("pass", viewer.index, 0, len(journey.kept) - 1,
                                       f"{journey.kept[viewer.index].number}",
                                       imgui.SliderFlags_.no_input.value)
        if changed:
            viewer.go_to(at)
        fields = list(journey.fields)
        changed, at = imgui.combo("field", fields.index(viewer.field), fields, 20)
        if changed:
            viewer.go_to(viewer.index, fields[at])
        imgui.text_wrapped(journey.caption(viewer.index))
        if viewer.field == "phase":
            self._picture("phases", np.asarray(colours.swatches(
                [(name, colours.category(phase)) for phase, name in journey.names.items()],
                _room())))
        if imgui.collapsing_header("the ray under the mouse",
                                   imgui.TreeNodeFlags_.default_open.value):
            for name, text in viewer.ray_of(mouse):
                imgui.text(f"{name:12} {text}")

    def _picture(self, name: str, pixels: np.ndarray) -> None:
        imgui.image(self.link.picture(name, pixels, smooth=False),
                    imgui.ImVec2(*pixels.shape[1::-1]))

    # Bottom panel, notices, help, path ------------------------------------------------------

    def _below(self, width: int, height: int) -> None:
        _place("command", 0, height - LOW, width, LOW)
        viewer = self.viewer
        shown, full = viewer.image, viewer.size
        fine = "" if shown is None else f"{shown.shape[1]}x{shown.shape[0]}" + (
            "" if viewer.finished else " ...")
        if imgui.small_button("save (P)"):
            self._save()
        imgui.same_line()
        if imgui.small_button("help (H)"):
            self.help = not self.help
        imgui.same_line()
        imgui.text(f"{fine} of {full[0]}x{full[1]}")
        held = viewer.held_back
        if held is not None:
            imgui.same_line()
            if imgui.small_button(f"every pixel: about {held:.0f} s (Enter)"):
                viewer.insist()
        imgui.push_item_width(width - 16)
        imgui.input_text("##line", viewer.command, imgui.InputTextFlags_.read_only.value)
        line, note = line_of(viewer)
        imgui.set_item_tooltip(f"{note}; select the text and press Ctrl+C" if line else note)
        imgui.pop_item_width()
        imgui.end()

    def _notice(self, width: int) -> None:
        """Draw the last error or news over the picture."""
        text = self.viewer.busy or self.viewer.message
        if not text:
            return
        left = WIDTH if self.shown else 0
        imgui.set_next_window_size(imgui.ImVec2(width - left, 0))
        imgui.set_next_window_pos(imgui.ImVec2(left, 0))
        imgui.set_next_window_bg_alpha(0.85)
        imgui.begin("notice", None, _FIXED | imgui.WindowFlags_.no_title_bar.value)
        imgui.text_wrapped(text)
        if not self.viewer.busy and imgui.small_button("dismiss"):
            self.viewer.message = ""
        imgui.end()

    def _helping(self, width: int) -> None:
        """Draw the help beside the left panel. The help ignores the mouse."""
        left = WIDTH if self.shown else 0
        wide = min(max(width - left - 12, 200), 420)
        imgui.set_next_window_pos(imgui.ImVec2(left + 6, 6))
        imgui.set_next_window_size(imgui.ImVec2(wide, 0))
        imgui.set_next_window_bg_alpha(0.8)
        imgui.begin("help", None, _FIXED | imgui.WindowFlags_.no_title_bar.value
                    | imgui.WindowFlags_.no_inputs.value)
        if imgui.begin_table("keys", 2, imgui.TableFlags_.sizing_stretch_prop.value):
            imgui.table_setup_column("key", imgui.TableColumnFlags_.width_fixed.value, 100)
            imgui.table_setup_column("what", imgui.TableColumnFlags_.width_stretch.value)
            for keys, text in HELP:
                for cell in (keys, text):
                    imgui.table_next_column()
                    imgui.text_wrapped(cell)
            imgui.end_table()
        imgui.end()

    def _path(self, width: int, height: int) -> None:
        path = self.viewer.path
        assert path is not None
        left = WIDTH if self.shown else 0
        imgui.set_next_window_pos(imgui.ImVec2(left, height - LOW - 190),
                                  imgui.Cond_.first_use_ever.value)
        imgui.set_next_window_size(imgui.ImVec2(width - left, 190),
                                   imgui.Cond_.first_use_ever.value)
        _, is_open = imgui.begin(f"{path.title()}###path", True)
        if not is_open:
            self.viewer.path = None
        flags = imgui.TableFlags_
        if imgui.begin_table("rows", len(path.columns), flags.scroll_x.value
                             | flags.scroll_y.value | flags.row_bg.value | flags.borders_v.value
                             | flags.sizing_fixed_fit.value):
            imgui.table_setup_scroll_freeze(0, 1)
            for name in path.columns:
                imgui.table_setup_column(name)
            imgui.table_headers_row()
            clipper = imgui.ListClipper()
            clipper.begin(len(path.rows))
            while clipper.step():
                for row in path.rows[clipper.display_start:clipper.display_end]:
                    imgui.table_next_row()
                    for cell in row:
                        imgui.table_next_column()
                        imgui.text_unformatted(cell)
            imgui.end_table()
        imgui.end()

    def _program(self, width: int, height: int) -> None:
        left = WIDTH if self.shown else 0
        imgui.set_next_window_pos(imgui.ImVec2(left, 0), imgui.Cond_.first_use_ever.value)
        imgui.set_next_window_size(imgui.ImVec2(width - left, height - LOW),
                                   imgui.Cond_.first_use_ever.value)
        program = self.program
        _, program.shown = imgui.begin(f"{program.title}###program", True,
                                       imgui.WindowFlags_.horizontal_scrollbar.value)
        clipper = imgui.ListClipper()
        clipper.begin(len(program.lines))
        while clipper.step():
            for line in program.lines[clipper.display_start:clipper.display_end]:
                imgui.text_unformatted(line)
        imgui.end()


_FIXED = (imgui.WindowFlags_.no_move.value | imgui.WindowFlags_.no_resize.value
          | imgui.WindowFlags_.no_collapse.value | imgui.WindowFlags_.no_saved_settings.value)


def _room() -> int:
    """Return the width in pixels of the panel without its scrollbar."""
    return max(int(imgui.get_content_region_avail().x), 64)


def _place(name: str, x: int, y: int, width: int, height: int) -> None:
    imgui.set_next_window_pos(imgui.ImVec2(x, y))
    imgui.set_next_window_size(imgui.ImVec2(width, max(height, 32)))
    imgui.set_next_window_bg_alpha(0.85)
    imgui.begin(name, None, _FIXED | imgui.WindowFlags_.no_title_bar.value
                | imgui.WindowFlags_.no_bring_to_front_on_focus.value)


def _graph(name: str, now: str, values: Sequence[float] | np.ndarray, width: float) -> None:
    numbers = np.asarray(values if len(values) else [0.0], np.float32)
    top = float(numbers.max())
    imgui.plot_lines(f"##{name}", numbers, overlay_text=now, scale_min=0.0,
                     scale_max=1.1 * top or 1.0, graph_size=imgui.ImVec2(width, GRAPH))


def _chooser(option: Option, value: Any) -> tuple[bool, Any]:
    """Draw the control of an option. Return whether its value changed, and the value."""
    empty = option.optional or option.default is None
    if option.choices is not None:
        there = ([None] if empty and None not in option.choices else []) + list(option.choices)
        if value not in there:
            there.append(value)
        changed, at = imgui.combo(option.name, there.index(value),
                                  ["-" if c is None else spell(c) for c in there])
        return changed, there[at]
    if option.kind is bool:
        return imgui.checkbox(option.name, bool(value))
    text = ",".join(map(str, value)) if isinstance(value, tuple) else spell(value)
    changed, text = imgui.input_text(option.name, "" if value is None else text, _ENTER)
    return changed, text if text.strip() or not empty else "none"
