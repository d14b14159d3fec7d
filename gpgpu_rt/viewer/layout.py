"""Layout: the rectangles of the picture and of the panels in the window. They do not overlap."""
from __future__ import annotations

from dataclasses import dataclass

LOW = 66                # height of the bottom panel
# PANEL: initial width of the left panel. HELP: width of the help. TABLE: initial height of a ray's
# table.
PANEL, HELP, TABLE = 340, 330, 220
LEAST_PANEL = 220       # smallest width of the left panel; MOST_SHARE can make it narrower
# Limit on each part's share: of the window's width for the left panel, of the remaining width for
# the help, and of the height above the bottom panel for a ray's table.
MOST_SHARE = 0.5


@dataclass(frozen=True)
class Rect:
    """A rectangle in the window, in window units."""

    x: int
    y: int
    width: int
    height: int

    @property
    def size(self) -> tuple[int, int]:
        return self.width, self.height

    def has(self, x: float, y: float) -> bool:
        return self.x <= x < self.x + self.width and self.y <= y < self.y + self.height


@dataclass(frozen=True)
class PanelLayout:
    """The parts of the window. A part that is not shown is None.

    Attributes
    ----------
    picture : the free part, which the picture fills
    panel, bar : the left panel and the bottom panel
    help, table : the list of keys at the right, and the table of a ray above the bottom panel
    """

    picture: Rect
    panel: Rect | None = None
    bar: Rect | None = None
    help: Rect | None = None
    table: Rect | None = None


def arranged(window: tuple[int, int], *, panel: int | None, help_width: int | None,
             table: int | None) -> PanelLayout:
    """Return the layout of a window.

    Parameters
    ----------
    window : (width, height) of the window
    panel : wanted width of the left panel; None hides all panels
    help_width : wanted width of the help; None hides the help
    table : wanted height of the table of a ray; None hides the table
    """
    width, height = (max(1, side) for side in window)
    if panel is None:
        return PanelLayout(Rect(0, 0, width, height))
    low = min(LOW, height // 2)
    high = height - low
    left = min(max(panel, LEAST_PANEL), int(MOST_SHARE * width))
    aside = 0 if help_width is None else min(help_width, int(MOST_SHARE * (width - left)))
    under = 0 if table is None else min(table, int(MOST_SHARE * high))
    return PanelLayout(
        Rect(left, 0, width - left - aside, high - under),
        Rect(0, 0, left, high), Rect(0, high, width, low),
        Rect(width - aside, 0, aside, high - under) if aside else None,
        Rect(left, high - under, width - left, under) if under else None)
