"""Labels: names beside the points of a chart, in place of a legend."""
from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

# Places to try for a label: distances (units of 1/72 inch) and directions (degrees) from the
# labelled point.
_DISTANCES = (5, 12, 20, 30, 42, 56, 72, 90)
_ANGLES = (0, 180, 60, -60, 120, -120, 90, -90, 30, -30, 150, -150)
_PADDING = 1.5       # space around a label in points
_LEADER = 8        # a label at a larger distance gets a line to its point

Box = tuple[float, float, float, float]


def direct_labels(axis: Any, points: Sequence[tuple[float, float, str]], size: float = 6.5,
                  avoid: Sequence[tuple[float, float]] = ()) -> int:
    """Write a label beside each point, so that labels cover neither each other nor a point.

    Call this function when layout and limits are final, because it works in pixels.

    Parameters
    ----------
    points : x, y and text of each label, the most important point first
    size : size of the text in points
    avoid : further points (x, y) that no label may cover

    Returns
    -------
    The number of written labels. Labels that find no space are left out.
    """
    figure = axis.figure
    pixel = figure.dpi / 72
    inside = _box_of(axis.get_window_extent())
    places = [tuple(axis.transData.transform((x, y))) for x, y, _ in points]
    other = [tuple(axis.transData.transform(point)) for point in avoid]
    taken: list[Box] = [_around(place, 2.5 * pixel) for place in (*places, *other)]
    written = 0
    for (x, y, text), place in zip(points, places):
        note = axis.annotate(text, (x, y), fontsize=size, color="#333333", va="center")
        extent = note.get_window_extent(figure.canvas.get_renderer())
        found = _free_place(place, (extent.width + _PADDING * pixel,
                                    extent.height + _PADDING * pixel), pixel, taken, inside)
        note.remove()
        if found is None:
            continue
        distance, angle, box = found
        across = (box[0] + box[2]) / 2 - place[0], (box[1] + box[3]) / 2 - place[1]
        axis.annotate(
            text, (x, y), xytext=(across[0] / pixel, across[1] / pixel), fontsize=size,
            textcoords="offset points", ha="center", va="center", color="#333333",
            arrowprops={"arrowstyle": "-", "color": "#aaaaaa", "linewidth": 0.5,
                        "shrinkA": 0, "shrinkB": 2} if distance > _LEADER else None)
        taken.append(box)
        written += 1
    return written


def _free_place(place: tuple[float, float], size: tuple[float, float], pixel: float,
                taken: Sequence[Box], inside: Box) -> tuple[int, int, Box] | None:
    """Return the distance, the direction and the box of the first free place."""
    wide, high = size
    for distance in _DISTANCES:
        for angle in _ANGLES:
            dx, dy = math.cos(math.radians(angle)), math.sin(math.radians(angle))
            # Measure the distance from the point to the label's edge, not to its centre. Above and
            # below the point, centre the label horizontally.
            side = 0.0 if abs(dx) < 0.1 else math.copysign(wide / 2, dx)
            x = place[0] + dx * distance * pixel + side
            y = place[1] + dy * (distance * pixel + high / 2)
            box = x - wide / 2, y - high / 2, x + wide / 2, y + high / 2
            within = (inside[0] <= box[0] and inside[1] <= box[1] and box[2] <= inside[2]
                      and box[3] <= inside[3])
            if within and not any(_overlap(box, one) for one in taken):
                return distance, angle, box
    return None


def _overlap(one: Box, other: Box) -> bool:
    return (one[0] < other[2] and other[0] < one[2] and one[1] < other[3]
            and other[1] < one[3])


def _around(place: tuple[float, float], radius: float) -> Box:
    return place[0] - radius, place[1] - radius, place[0] + radius, place[1] + radius


def _box_of(extent: Any) -> Box:
    return extent.x0, extent.y0, extent.x1, extent.y1
