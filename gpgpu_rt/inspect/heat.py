"""Heat maps: what each pixel's ray cost, of several methods on one common scale."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from ..errors import OptionError, nearest_names
from ..scene.camera import Camera
from ..tracer import Tracer
from . import false_colours as colours
from .time_travel import Pass, travel

# What can be counted, and how that is called over a picture.
KINDS = {"steps": "kernel runs a ray", "nodes": "nodes visited a ray",
         "leaves": "leaves visited a ray", "triangles": "triangles tested a ray",
         "passes": "passes until the ray was over"}
_COUNTERS = {"steps": "steps", "nodes": "nodes_visited", "leaves": "leaves_visited",
             "triangles": "triangles_tested"}


@dataclass
class Heat:
    """What the eye rays of a picture cost by one method.

    Attributes
    ----------
    title : the method, and the schedule where it matters
    values : (height, width) int, one a ray
    """

    title: str
    values: np.ndarray

    def summary(self) -> dict[str, float]:
        """Mean, median, 99 % quantile and maximum."""
        return {"mean": float(self.values.mean()), "median": float(np.median(self.values)),
                "quantile_99": float(np.quantile(self.values, 0.99)),
                "max": float(self.values.max())}


def heat(tracer: Tracer, what: str, size: tuple[int, int], camera: Camera | None = None) -> Heat:
    """Measure the eye rays of a picture.

    Parameters
    ----------
    tracer : with statistics, but for "passes"; for "passes" under ``step`` or ``kernels``
    what : of KINDS
    size : (width, height) pixels
    camera : by default the scene's own
    """
    if not isinstance(what, str) or what not in KINDS:
        raise OptionError(f"cannot count {what!r}{nearest_names(what, KINDS)}")
    origins, directions = (camera or tracer.scene.camera).rays(size)
    title = tracer.method.name
    if what == "passes":
        ended = np.zeros(size[0] * size[1], np.int64)

        def look(one: Pass) -> None:
            ended[one.state["phase"] > 0] = one.number + 1
        travel(tracer, origins, directions, look)
        return Heat(f"{title}, {tracer.options['schedule']}", ended.reshape(size[::-1]))
    values = getattr(tracer.trace(origins, directions), _COUNTERS[what])
    return Heat(title, values.reshape(size[::-1]))


def scale_of(maps: Sequence[Heat]) -> float:
    """Where one scale for all maps ends: at what 99 % of the rays of each keep below."""
    return max(1.0, *(one.summary()["quantile_99"] for one in maps))


def scale_bar(maps: Sequence[Heat], what: str, top: float, width: int) -> Image.Image:
    """The one scale of maps, which ends at ``top``; it says where some rays lie beyond."""
    return colours.colour_bar(
        top, KINDS[what] + (", one scale for all" if len(maps) > 1 else ""), width,
        beyond=any(one.values.max() > top for one in maps))


def draw_heat(maps: Sequence[Heat], what: str, scene: str,
              highest: float | None = None) -> Image.Image:
    """Maps side by side and the scale that holds for all of them.

    Parameters
    ----------
    highest : where the scale ends; by default at what 99 % of the rays of each map keep below
    """
    top = highest or scale_of(maps)
    panels = []
    for one in maps:
        found = one.summary()
        panels.append((f"{one.title}: mean {found['mean']:.1f}, most {found['max']:.0f}",
                       colours.enlarged(colours.ramp(one.values / top))))
    width = panels[0][1].width
    wide = len(panels) * (width + colours.MARGIN) - colours.MARGIN
    return colours.sheet(panels, [f"{scene}: {KINDS[what]}"],
                         scale_bar(maps, what, top, max(wide, 200)))
