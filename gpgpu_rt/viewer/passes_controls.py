"""Passes controls: draws the controls of the passes, and the state of a ray."""
from __future__ import annotations

import numpy as np
from imgui_bundle import imgui

from ..inspect import false_colours as colours
from .link import Link
from .model import Viewer
from .widgets import capital, chosen_from, label, quiet, room, tip


def draw_pass(viewer: Viewer, link: Link) -> None:
    """Draw the slider that chooses a pass, a line about the pass, and the colours' legend."""
    journey = viewer.journey
    label("Pass")
    if journey is None:
        imgui.text_wrapped(capital(viewer.failed)
                           or "Passes are drawn when the camera is at rest.")
        return
    step = imgui.get_frame_height()
    imgui.set_next_item_width(-2 * (step + imgui.get_style().item_spacing.x))
    # The slider's value is an index, not a pass's number, so disable typing.
    changed, at = imgui.slider_int("##pass", viewer.index, 0, len(journey.kept) - 1,
                                   f"{journey.kept[viewer.index].number}",
                                   imgui.SliderFlags_.no_input.value)
    tip("The pass after which the rays are shown. Keys: left and right.")
    if changed:
        viewer.go_to(at)
    for word, by in (("<", -1), (">", 1)):
        imgui.same_line()
        if imgui.button(f"{word}##pass", imgui.ImVec2(step, 0)):
            viewer.go_to(viewer.index + by)
    quiet(capital(journey.caption(viewer.index)) + ".")
    if viewer.tracer.options["schedule"] == "loop":
        quiet("Traced under another schedule, because loop has a single pass.")
    if viewer.field == "phase":
        link.show("phases", np.asarray(colours.swatches(
            [(name, colours.category(phase)) for phase, name in journey.names.items()], room())))


def draw_state(viewer: Viewer, mouse: tuple[int, int]) -> None:
    """Draw the list of fields to choose from, and the state of the ray at a pixel."""
    journey = viewer.journey
    if journey is None:
        return
    label("Colours")
    fields = list(journey.fields)
    at = chosen_from("field", fields.index(viewer.field), fields)
    tip("The field of the ray's state that the colours show. The field phase is the kernel that "
        "the ray waits for.")
    if at is not None:
        viewer.go_to(viewer.index, fields[at])
    quiet("The ray under the mouse:")
    if imgui.begin_table("state", 2):
        for name, text in viewer.ray_of(mouse):
            for cell in (name, text):
                imgui.table_next_column()
                imgui.text_unformatted(cell)
        imgui.end_table()
