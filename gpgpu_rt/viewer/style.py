"""The fonts and colours of the viewer's panels."""
from __future__ import annotations

from pathlib import Path

import imgui_bundle
from imgui_bundle import imgui

SIZE = 15.0         # height of text in pixels
FIXED_SIZE = 14.0   # height of numbers in tables, and of program text
_FONTS = Path(imgui_bundle.__file__).parent / "assets" / "fonts"
QUIET_TEXT = imgui.ImVec4(0.66, 0.68, 0.72, 1.0)
NOTICE = imgui.ImVec4(1.0, 0.86, 0.55, 1.0)
RAY, BOX, LAST_BOX, CHOSEN_BOX = (imgui.IM_COL32(*rgba) for rgba in (
    (255, 60, 60, 255), (90, 200, 255, 110), (255, 230, 80, 255), (255, 240, 40, 255)))
OUTLINE = imgui.IM_COL32(0, 0, 0, 255)      # makes the chosen box visible on bright pictures too


class Fonts:
    """Load the fonts of labels and of numbers. If imgui_bundle has no font files, both are ImGui's
    default font."""

    def __init__(self) -> None:
        self.text = _font("Roboto/Roboto-Regular.ttf", SIZE)
        self.fixed = _font("Inconsolata-Medium.ttf", FIXED_SIZE)


def _font(name: str, size: float) -> imgui.ImFont:
    fonts, path = imgui.get_io().fonts, _FONTS / name
    return fonts.add_font_from_file_ttf(str(path), size) if path.is_file() else (
        fonts.add_font_default())


def apply() -> Fonts:
    """Set the panels' colours and spacing. Return the fonts."""
    imgui.style_colors_dark()
    style = imgui.get_style()
    style.frame_rounding = style.grab_rounding = 3.0
    style.window_rounding = 0.0
    style.window_padding = imgui.ImVec2(10, 8)
    style.item_spacing = imgui.ImVec2(8, 5)
    style.set_color_(imgui.Col_.window_bg.value, imgui.ImVec4(0.11, 0.12, 0.14, 1.0))
    style.set_color_(imgui.Col_.popup_bg.value, imgui.ImVec4(0.13, 0.14, 0.17, 1.0))
    style.set_color_(imgui.Col_.text_disabled.value, QUIET_TEXT)
    return Fonts()
