"""The picture and the panels of the viewer fill the window and do not overlap."""
from __future__ import annotations

import itertools

import numpy as np
import pytest

from gpgpu_rt.viewer.layout import MOST_SHARE, Rect, arranged


@pytest.mark.parametrize("window", [(1280, 800), (900, 600), (330, 700), (60, 40), (1, 1)])
@pytest.mark.parametrize("panel, help_width, table", [
    *itertools.product((340, 5000), (None, 330), (None, 220, 5000)), (None, 330, 220)])
def test_panels_cover_no_picture_and_leave_no_gap(window: tuple[int, int], panel: int | None,
                                                  help_width: int | None,
                                                  table: int | None) -> None:
    layout = arranged(window, panel=panel, help_width=help_width, table=table)
    covered = np.zeros(window[::-1], int)
    parts = (layout.picture, layout.panel, layout.bar, layout.help, layout.table)
    for rect in parts:
        if rect is not None:
            covered[rect.y:rect.y + rect.height, rect.x:rect.x + rect.width] += 1
    assert (covered == 1).all()
    assert min(layout.picture.size) > 0
    if panel is None:
        assert parts[1:] == (None,) * 4
    elif min(window) > 300:
        assert layout.panel.width <= MOST_SHARE * window[0]
        assert (layout.help is None) == (help_width is None)
        assert (layout.table is None) == (table is None)
        assert min(layout.picture.size) > 0.2 * min(window)


def test_a_rectangle_has_its_points() -> None:
    """`Rect.has` includes the left and upper edges, and excludes the right and lower edges."""
    rect = Rect(3, 4, 10, 20)
    assert rect.has(3, 4) and rect.has(12.9, 23.9)
    assert not any(rect.has(*at) for at in ((2.9, 5), (5, 3.9), (13, 5), (5, 24)))
