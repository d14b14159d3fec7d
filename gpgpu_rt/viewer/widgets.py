"""Widgets: the controls that the viewer's panels are made of, each with a label at its left."""
from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from imgui_bundle import imgui

from ..options import Option
from .automatic import Shown, written
from .layout import Rect

FIXED = (imgui.WindowFlags_.no_move.value | imgui.WindowFlags_.no_collapse.value
         | imgui.WindowFlags_.no_title_bar.value | imgui.WindowFlags_.no_saved_settings.value
         | imgui.WindowFlags_.no_bring_to_front_on_focus.value)
LABELS, OPTION_LABELS = 74, 162     # label widths in pixels: of most controls, and of options
TIP = 360               # width in pixels at which a tooltip's text wraps
ENTER = imgui.InputTextFlags_.enter_returns_true.value


def place(name: str, rect: Rect) -> None:
    imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y))
    imgui.set_next_window_size(imgui.ImVec2(max(rect.width, 32), max(rect.height, 32)))
    imgui.begin(name, None, FIXED | imgui.WindowFlags_.no_resize.value)


def room() -> int:
    """Return the free width in pixels of the window or table column, at least 64."""
    return max(int(imgui.get_content_region_avail().x), 64)


def tip(text: str) -> None:
    """Show a text while the mouse rests on the last widget."""
    if imgui.is_item_hovered(imgui.HoveredFlags_.for_tooltip.value) and imgui.begin_tooltip():
        imgui.push_text_wrap_pos(TIP)
        imgui.text_unformatted(text)
        imgui.pop_text_wrap_pos()
        imgui.end_tooltip()


def quiet(text: str) -> None:
    """Write a text in a dim colour, wrapped at the panel's edge."""
    imgui.push_text_wrap_pos(0.0)
    imgui.text_disabled(text)
    imgui.pop_text_wrap_pos()


def capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def label(text: str, width: int = LABELS) -> None:
    imgui.align_text_to_frame_padding()
    imgui.text_unformatted(text)
    imgui.same_line(width)
    imgui.set_next_item_width(-1.0)


def chosen_from(name: str, at: int, words: Sequence[str]) -> int | None:
    """Draw a list of choices. Return the index of a new choice, or None if nothing changed."""
    changed, now = imgui.combo(f"##{name}", at, list(words), 20)
    return now if changed else None


def chosen_option(option: Option, now: Shown) -> tuple[bool, Any]:
    """Draw the control of an option. Return whether its value changed, and the value.

    A text is returned as typed, but an empty text becomes "none" if the option may be None.
    """
    empty = option.optional or option.default is None
    imgui.begin_group()
    label(capital(option.title), OPTION_LABELS)
    changed, value = _control(option, now, empty)
    imgui.end_group()
    tip(f"{capital(option.help)}.\nOn the command line: --{option.name.replace('_', '-')}")
    return changed, value


def _control(option: Option, now: Shown, empty: bool) -> tuple[bool, Any]:
    name, value = f"##{option.name}", now.value
    if option.choices is not None:
        there = ([None] if empty and None not in option.choices else []) + list(option.choices)
        if value not in there:
            there.append(value)
        at = chosen_from(option.name, there.index(value), [
            now.none if choice is None else option.choice_words(choice) for choice in there])
        return at is not None, value if at is None else there[at]
    if option.kind is bool:
        return imgui.checkbox(name, bool(value))
    changed, text = imgui.input_text_with_hint(
        name, now.none if empty else "", "" if value is None else written(value), ENTER)
    return changed, text if text.strip() or not empty else "none"
