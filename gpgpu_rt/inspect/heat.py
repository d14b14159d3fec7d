"""Heat maps: draws the cost of each pixel's ray, for several methods on one scale."""
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from PIL import Image

from ..errors import OptionError, nearest_names
from ..methods import methods
from ..scene.camera import Camera
from ..tracer import Tracer
from . import false_colours as colours
from .time_travel import Pass, travel

KINDS = {"steps": "kernel runs per ray", "nodes": "nodes visited per ray",
         "leaves": "leaves visited per ray", "triangles": "triangles tested per ray",
         "restarts": "restarts per ray", "passes": "passes until the ray finished"}
BY_PASS = ("restarts", "passes")    # counted from the rays' states after each pass
_COUNTERS = {"steps": "steps", "nodes": "nodes_visited", "leaves": "leaves_visited",
             "triangles": "triangles_tested"}


@dataclass
class Heat:
    """The costs of a picture's eye rays by a method.

    Attributes
    ----------
    title : the method; for the count "passes", the method and the schedule
    values : (height, width) int, the cost of each ray
    """

    title: str
    values: np.ndarray

    def summary(self) -> dict[str, float]:
        """Return mean, median, 99 % quantile and maximum."""
        return {"mean": float(self.values.mean()), "median": float(np.median(self.values)),
                "quantile_99": float(np.quantile(self.values, 0.99)),
                "max": float(self.values.max())}


def heat(tracer: Tracer, what: str, size: tuple[int, int], camera: Camera | None = None) -> Heat:
    """Measure the costs of a picture's eye rays.

    Parameters
    ----------
    tracer : a tracer with statistics=True; for a count of BY_PASS, with the schedule ``step`` or
        ``kernels``
    what : a key of KINDS
    size : (width, height) pixels
    camera : by default the scene's own camera

    Raises
    ------
    OptionError
        for an unknown ``what``. For "restarts", also if the method never restarts single rays, if
        the option ``era`` is set, or if a pass runs several steps
    """
    if not isinstance(what, str) or what not in KINDS:
        raise OptionError(f"cannot count {what!r}{nearest_names(what, KINDS)}")
    origins, directions = (camera or tracer.scene.camera).rays(size)
    title = tracer.method.name
    if what in BY_PASS:
        values = np.zeros(size[0] * size[1], np.int64)
        travel(tracer, origins, directions, _restart_counter(tracer, values)
               if what == "restarts" else _pass_counter(values))
    else:
        values = getattr(tracer.trace(origins, directions), _COUNTERS[what])
    if what == "passes":
        title += f", {tracer.options['schedule']}"
    return Heat(title, values.reshape(size[::-1]))


def _pass_counter(ended: np.ndarray) -> Callable[[Pass], None]:
    """Return a function for `travel` that writes each ray's number of passes to ``ended``."""
    def look(one: Pass) -> None:
        ended[one.state["phase"] > 0] = one.number + 1
    return look


def _restart_counter(tracer: Tracer, restarts: np.ndarray) -> Callable[[Pass], None]:
    """Return a function for `travel` that adds each ray's restarts to ``restarts``. A restart is a
    jump to an ancestor, whose box encloses the box of the ray's last node."""
    if not tracer.method.restarts or tracer.accelerator.boxes is None:
        raise OptionError(f"method {tracer.method.name} has no count of restarts; these methods "
                          f"have it: {', '.join(row.name for row in methods() if row.restarts)}")
    if tracer.options["era"] or tracer.options["steps_per_pass"] != 1:
        raise OptionError("restarts are counted after each step, and not in the era form; leave "
                          "steps_per_pass and era out")
    lo, hi = tracer.accelerator.boxes()
    last = np.zeros(len(restarts), np.int64)    # every ray begins at the root

    def look(one: Pass) -> None:
        node = one.state["node"]
        restarts[(node != last) & (lo[node] <= lo[last]).all(axis=1)
                 & (hi[node] >= hi[last]).all(axis=1)] += 1
        last[:] = node
    return look


def scale_of(maps: Sequence[Heat]) -> float:
    """Return the end of a common scale: the maps' largest 99 % quantile, rounded up, at least
    1."""
    return colours.round_up(max(1.0, *(one.summary()["quantile_99"] for one in maps)))


def scale_bar(maps: Sequence[Heat], what: str, top: float, width: int) -> Image.Image:
    """Return a picture of the common scale, which ends at ``top``. Its label says if some rays
    cost more."""
    return colours.colour_bar(
        top, KINDS[what] + (", common scale" if len(maps) > 1 else ""), width,
        beyond=any(one.values.max() > top for one in maps))


def draw_heat(maps: Sequence[Heat], what: str, scene: str,
              highest: float | None = None) -> Image.Image:
    """Return an image of the maps side by side with their common scale.

    Parameters
    ----------
    highest : end of the scale; default: `scale_of`
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
