"""Path table: draws a row for each pass of a followed ray, and the chosen row's node or cell."""
from __future__ import annotations

from imgui_bundle import imgui

from .layout import Rect
from .ray_path import Place, RayPath
from .style import FIXED_SIZE, Fonts
from .widgets import FIXED, quiet, tip

RECORD = 250        # width of the part that shows the record of a node or cell
# Tooltips of the columns that are not fields of the ray's state.
TIPS = {"pass": "the number of the pass", "ran": "the kernel that ran for the ray in this pass",
        "waits for": "the kernel that the ray needs next",
        "hit t": "the distance to the nearest hit so far",
        "hit triangle": "the triangle of the nearest hit so far"}


class PathTable:
    """The table of a followed ray.

    Attributes
    ----------
    height : wanted height in pixels, which the user changes by dragging the upper edge
    """

    def __init__(self, fonts: Fonts, height: int) -> None:
        self._fonts, self.height = fonts, height
        self._seen: tuple[int, int | None] | None = None  # the path and row of the previous frame

    def draw(self, path: RayPath, rect: Rect, most: int) -> bool:
        """Draw the table in a rectangle. Return whether the user closed the table.

        Parameters
        ----------
        most : largest height to which the upper edge can be dragged
        """
        imgui.set_next_window_pos(imgui.ImVec2(rect.x, rect.y))
        imgui.set_next_window_size(imgui.ImVec2(*rect.size))
        imgui.set_next_window_size_constraints(imgui.ImVec2(rect.width, 80),
                                               imgui.ImVec2(rect.width, max(most, 80)))
        imgui.begin("path", None, FIXED)
        if round(imgui.get_window_height()) != max(rect.height, 80):
            self.height = round(imgui.get_window_height())
        closed = imgui.small_button("close##path")
        imgui.same_line()
        imgui.text_unformatted(path.title())
        wide = imgui.get_content_region_avail().x
        side = min(RECORD, wide / 2)
        imgui.push_font(self._fonts.fixed, FIXED_SIZE)
        self._rows(path, wide - side - imgui.get_style().item_spacing.x)
        imgui.same_line()
        self._record(path, side)
        imgui.pop_font()
        imgui.end()
        return closed

    def _rows(self, path: RayPath, width: float) -> None:
        flags = imgui.TableFlags_
        if not imgui.begin_table("rows", len(path.columns), flags.scroll_x.value
                                 | flags.scroll_y.value | flags.row_bg.value
                                 | flags.borders_v.value | flags.sizing_fixed_fit.value,
                                 imgui.ImVec2(width, 0)):
            return
        imgui.table_setup_scroll_freeze(1, 1)
        for name in path.columns:
            imgui.table_setup_column(name)
        imgui.table_next_row(imgui.TableRowFlags_.headers.value)
        for name in path.columns:
            imgui.table_next_column()
            imgui.table_header(name)
            tip(TIPS.get(name, f"the field {name} of the ray's state after the pass"))
        moved = self._seen != (id(path), path.row)
        clipper = imgui.ListClipper()
        clipper.begin(len(path.rows))
        if path.row is not None and moved:
            clipper.include_item_by_index(path.row)
        while clipper.step():
            for number in range(clipper.display_start, clipper.display_end):
                self._row(path, number, moved)
        self._seen = id(path), path.row
        imgui.end_table()

    @staticmethod
    def _row(path: RayPath, number: int, moved: bool) -> None:
        cells, is_chosen = path.rows[number], number == path.row
        imgui.table_next_row()
        imgui.table_next_column()
        clicked, _ = imgui.selectable(f"{cells[0]}##row", is_chosen,
                                      imgui.SelectableFlags_.span_all_columns.value)
        if clicked:
            path.row = None if is_chosen else number
        if is_chosen and moved and not imgui.is_item_visible():
            imgui.set_scroll_here_y(0.5)
        for cell in cells[1:]:
            imgui.table_next_column()
            imgui.text_unformatted(cell)

    @staticmethod
    def _record(path: RayPath, width: float) -> None:
        """Draw the records of the node or cell of the chosen row."""
        imgui.begin_child("record", imgui.ImVec2(width, 0), imgui.ChildFlags_.borders.value)
        if path.row is None:
            quiet("Click on a row to see its node or cell here and in the picture.")
        elif path.place is None:
            quiet("In this row the ray is at no node or cell that has a box.")
        else:
            PathTable._fields(path.place)
        imgui.end_child()

    @staticmethod
    def _fields(place: Place) -> None:
        imgui.text_unformatted(place.title)
        if not imgui.begin_table("fields", 2, imgui.TableFlags_.sizing_stretch_prop.value):
            return
        imgui.table_setup_column("name", imgui.TableColumnFlags_.width_fixed.value)
        imgui.table_setup_column("value", imgui.TableColumnFlags_.width_stretch.value)
        for name, text in place.record:
            imgui.table_next_row()
            imgui.table_next_column()
            if not text:
                imgui.text_disabled(name)
                continue
            imgui.text_unformatted(name)
            imgui.table_next_column()
            imgui.text_wrapped(text)
        imgui.end_table()
