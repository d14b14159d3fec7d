"""Left panel: draws the five most important controls at the top, all others under headings."""
from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from imgui_bundle import imgui

from ..errors import OptionError
from ..inspect.heat import KINDS
from ..methods import methods
from ..options import TRACER_OPTIONS, Option
from ..render.integrators import INTEGRATORS
from ..scene.loading import scene_names
from ..text_format import counted
from .automatic import shown
from .graphs import draw_graphs
from .heat_view import LAYOUTS
from .link import Link
from .method_list import chosen_method, sentence
from .model import MODES, Viewer
from .passes_controls import draw_pass, draw_state
from .selection import Selection
from .widgets import ENTER, LABELS, capital, chosen_from, chosen_option, label, quiet, room, tip

MODE_WORDS = {"picture": "the picture", "heat": "a heat map: the cost of each ray",
              "passes": "the passes, one by one"}
LIGHT_WORDS = {"direct": "direct: no reflections", "whitted": "whitted: mirrors, glass, shadows",
               "path": "path: all light, with noise"}
OPEN = imgui.TreeNodeFlags_.default_open.value


class Controls:
    """The controls of the left panel.

    Parameters
    ----------
    viewer : the model
    link : uploads pictures
    """

    def __init__(self, viewer: Viewer, link: Link) -> None:
        self.viewer, self.link = viewer, link
        self._source = ""

    def draw(self, mouse: tuple[int, int]) -> None:
        """Draw the controls into the present window. ``mouse`` is the pixel under the pointer."""
        viewer, selection = self.viewer, self.viewer.selection
        self._first_five(selection)
        if viewer.mode == "heat":
            self._scale()
        if imgui.collapsing_header("Costs", OPEN):
            draw_graphs(viewer)
        if viewer.mode == "heat" and imgui.collapsing_header("Compare with a second method"):
            self._compare()
        if viewer.mode == "passes" and imgui.collapsing_header("States of the rays"):
            draw_state(viewer, mouse)
        # Leave out the schedule here: it is among the first five controls.
        own, known = selection.row.options, {option.name for option in selection.known()}
        for title, key, options in (
                (f"Options of {selection.method}", "own", own),
                ("Options of every method", "every", [
                    option for option in TRACER_OPTIONS if option.name in known - {"schedule"}])):
            if options and self._heading(title, key, options, selection.options):
                self._options(options, selection.options, selection.with_option)
        light = selection.light_options()
        if self._heading("Light and samples", "light", light, selection.light):
            if viewer.mode != "picture":
                self._light(selection)
            self._options(light, selection.light, selection.with_light)
        if imgui.collapsing_header("Open a file"):
            self._file()

    # The first five -------------------------------------------------------------------------

    def _first_five(self, selection: Selection) -> None:
        viewer = self.viewer
        self._scene(selection)
        label("Method")
        name = chosen_method(selection.method, self.link.window.size)
        if name is not None:
            viewer.choose(selection.with_method(name))
        row = selection.row
        imgui.indent(LABELS)
        quiet(f"{row.citation}. {sentence(row)}")
        imgui.unindent(LABELS)
        self._schedule(selection)
        label("Show")
        at = chosen_from("show", MODES.index(viewer.mode), [MODE_WORDS[mode] for mode in MODES])
        tip("What the window shows. Keys: 1, 2, 3.")
        if at is not None:
            viewer.look_at(MODES[at])
        if viewer.mode == "picture":
            self._light(selection)
        elif viewer.mode == "heat":
            self._counted()
        else:
            draw_pass(viewer, self.link)

    def _scene(self, selection: Selection) -> None:
        names = scene_names()
        if selection.scene not in names:
            names.append(selection.scene)
        label("Scene")
        at = chosen_from("scene", names.index(selection.scene),
                         [name if len(name) < 32 else "..." + name[-29:] for name in names])
        scene = self.viewer.scene
        tip(f"{counted(len(scene), 'triangle')}, {scene.source}"
            + (f"; stand-in for {scene.stand_in}" if scene.stand_in else "")
            + ".\nTo open a file, drop it on the window, or use the heading below.")
        if at is not None:
            self.viewer.open(names[at])

    def _schedule(self, selection: Selection) -> None:
        option = next(option for option in selection.known() if option.name == "schedule")
        assert option.choices is not None
        now = self.viewer.tracer.options["schedule"]
        choices = [*option.choices, *([now] if now not in option.choices else [])]
        label(capital(option.title))
        at = chosen_from("schedule", choices.index(now),
                         [option.choice_words(choice) for choice in choices])
        tip(f"{capital(option.help)}.")
        if at is not None:
            self._change(option, choices[at], selection.with_option)

    def _light(self, selection: Selection) -> None:
        kinds = list(INTEGRATORS)
        label("Light")
        at = chosen_from("light", kinds.index(selection.integrator),
                         [LIGHT_WORDS.get(kind, kind) for kind in kinds])
        tip("How the picture's light is computed (--integrator).")
        if at is not None:
            self.viewer.choose(selection.with_integrator(kinds[at]))

    def _counted(self) -> None:
        kinds = list(KINDS)
        label("Count")
        at = chosen_from("count", kinds.index(self.viewer.heat.what), list(KINDS.values()))
        tip("What the colours of the heat map count.")
        if at is not None:
            self.viewer.change_heat(what=kinds[at])

    # Headings -------------------------------------------------------------------------------

    @staticmethod
    def _heading(title: str, key: str, options: Sequence[Option],
                 given: Mapping[str, Any]) -> bool:
        """Draw a heading with the number of its changed options. Return whether the heading is
        open. ImGui knows a heading by ``key``, so the heading stays open if ``title`` changes."""
        changed = len({option.name for option in options} & set(given))
        note = f" ({changed} changed)" if changed else ""
        return imgui.collapsing_header(f"{title}{note}###{key}")

    def _options(self, known: Sequence[Option], given: Mapping[str, Any],
                 change: Callable[[str, Any], Selection]) -> None:
        """Draw a control for each option that applies."""
        tracer = self.viewer.tracer
        values = {**{option.name: option.default for option in known}, **tracer.options, **given}
        for option in known:
            if not option.fits(values) or option.schedules and (
                    values["schedule"] not in option.schedules):
                continue
            changed, value = chosen_option(option, shown(option, given, tracer))
            if changed:
                self._change(option, value, change)

    def _change(self, option: Option, value: Any,
                change: Callable[[str, Any], Selection]) -> None:
        try:
            if isinstance(value, str) and option.choices is None:
                value = option.parse(value.strip())
            self.viewer.choose(change(option.name, value))
        except OptionError as failure:
            self.viewer.message = str(failure)

    def _scale(self) -> None:
        view = self.viewer.heat
        for title in view.titles():
            quiet(title)
        if view.maps:
            self.link.show("bar", np.asarray(view.scale(room())))

    def _compare(self) -> None:
        viewer, view = self.viewer, self.viewer.heat
        names = [row.name for row in methods()]
        label("Beside")
        at = chosen_from("beside", names.index(view.other) + 1 if view.other else 0,
                         ["nothing", *names])
        if at is not None:
            viewer.change_heat(other=names[at - 1] if at else None)
        if view.other is None:
            return
        label("Layout")
        at = chosen_from("layout", LAYOUTS.index(view.layout), LAYOUTS)
        if at is not None:
            viewer.change_heat(layout=LAYOUTS[at])
        if view.layout == LAYOUTS[0]:
            label("Line at")
            changed, part = imgui.slider_float("##wipe", view.wipe, 0.0, 1.0, "%.2f")
            if changed:
                viewer.change_heat(wipe=part)

    def _file(self) -> None:
        label("File")
        entered, self._source = imgui.input_text_with_hint(
            "##file", "a mesh or scene file, then Enter", self._source, ENTER)
        tip("Type the name of a mesh or scene file and press Enter, or drop the file on the "
            "window.")
        if entered and self._source.strip():
            self.viewer.open(self._source.strip())
