"""Method list: draws the name, the year, the family and a sentence for each method."""
from __future__ import annotations

from imgui_bundle import imgui

from ..methods import family_of, methods
from ..traversal.method import Method
from .widgets import capital, room

NAME, YEAR, FAMILY = 128, 40, 120       # widths of the columns before the sentence
WIDE, HIGH = 780, 560                   # largest size of the list


def sentence(row: Method) -> str:
    return capital(row.summary) + "."


def chosen_method(name: str, window: tuple[int, int]) -> str | None:
    """Draw the list of methods, closed or open. Return the name of a new choice, or None.

    Parameters
    ----------
    name : the present method
    window : (width, height) of the window, which limits the open list
    """
    size = imgui.ImVec2(min(WIDE, window[0] - 20), min(HIGH, window[1] - 80))
    imgui.set_next_window_size_constraints(imgui.ImVec2(size.x, 0), size)
    if not imgui.begin_combo("##method", name, imgui.ComboFlags_.height_largest.value):
        return None
    found = None
    flags = imgui.TableFlags_.row_bg.value | imgui.TableFlags_.scroll_y.value
    height = min(size.y - 20, (len(methods()) + 2) * 1.6 * imgui.get_text_line_height())
    if imgui.begin_table("methods", 4, flags, imgui.ImVec2(0, height)):
        fixed = imgui.TableColumnFlags_.width_fixed.value
        imgui.table_setup_scroll_freeze(0, 1)
        for title, width in (("method", NAME), ("year", YEAR), ("family", FAMILY)):
            imgui.table_setup_column(title, fixed, width)
        imgui.table_setup_column("what it does", imgui.TableColumnFlags_.width_stretch.value)
        imgui.table_headers_row()
        for row in methods():
            if _row(row, row.name == name):
                found = row.name
                imgui.close_current_popup()
        imgui.end_table()
    imgui.end_combo()
    return found


def _row(row: Method, is_chosen: bool) -> bool:
    """Return whether the row was clicked."""
    imgui.table_next_row()
    imgui.table_set_column_index(3)
    text = sentence(row)
    high = imgui.calc_text_size(text, wrap_width=room()).y
    imgui.push_text_wrap_pos(0.0)
    imgui.text_unformatted(text)
    imgui.pop_text_wrap_pos()
    imgui.table_set_column_index(0)
    clicked, _ = imgui.selectable(row.name, is_chosen,
                                  imgui.SelectableFlags_.span_all_columns.value,
                                  imgui.ImVec2(0, high))
    if is_chosen and imgui.is_window_appearing():
        imgui.set_scroll_here_y(0.5)
    for column, text in ((1, row.year), (2, family_of(row.name))):
        imgui.table_set_column_index(column)
        imgui.text_unformatted(text)
    return clicked
