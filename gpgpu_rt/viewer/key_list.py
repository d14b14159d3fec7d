"""Key list: draws the list of keys and mouse actions."""
from __future__ import annotations

from imgui_bundle import imgui

from .layout import Rect
from .widgets import place, quiet

ABOUT = ("Each pixel has a ray. Fragment-shader passes trace all rays, as on graphics cards of "
         "2002 to 2007. Choose a scene and a method at the left. Rest the mouse on a control to "
         "read about it.")
KEYS = (
    ("drag", "turn around the scene"),
    ("right drag", "shift the scene"),
    ("wheel", "move closer or farther away"),
    ("click", "follow the ray of a pixel"),
    ("1, 2, 3", "show picture, heat map, passes"),
    ("left, right", "go a pass back or forward; ten with Shift"),
    ("up, down", "go a row up or down in the table of a ray"),
    ("M", "next method; previous with Shift"),
    ("R", "return to the first camera"),
    ("C", "switch between turning and flying"),
    ("W A S D Q E", "fly; faster with Shift"),
    ("Enter", "draw every pixel, however long it takes"),
    ("P", "save the picture with its settings"),
    ("T", "show the text of the program that runs"),
    ("Tab", "hide or show the panels"),
    ("H", "hide or show this list"),
    ("Esc", "close a list, table, text or message"),
    ("Ctrl+Q", "quit"),
)


def draw_keys(rect: Rect) -> bool:
    """Draw the list. Return whether the user closed the list."""
    place("keys", rect)
    closed = imgui.small_button("close##keys")
    imgui.same_line()
    imgui.text_unformatted("Mouse and keys")
    imgui.separator()
    quiet(ABOUT)
    imgui.spacing()
    if imgui.begin_table("keys", 2, imgui.TableFlags_.sizing_stretch_prop.value):
        imgui.table_setup_column("key", imgui.TableColumnFlags_.width_fixed.value, 88)
        imgui.table_setup_column("what", imgui.TableColumnFlags_.width_stretch.value)
        for keys, text in KEYS:
            for cell in (keys, text):
                imgui.table_next_column()
                imgui.text_wrapped(cell)
        imgui.end_table()
    imgui.end()
    return closed
