"""The heat view: the cost of each pixel's ray, for one method or for two methods on one scale."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image

from ..inspect import false_colours as colours
from ..inspect.heat import BY_PASS, Heat, heat, scale_bar, scale_of
from ..methods import find_method
from ..options import TRACER_OPTIONS
from ..scene.camera import Camera
from ..statistics import Statistics
from ..tracer import Tracer
from .tracers import Tracers

LAYOUTS = ("wipe", "side by side")


@dataclass
class HeatView:
    """The settings and the maps of the heat view.

    Attributes
    ----------
    what : the counted quantity, from ``heat.KINDS``
    other : the method to compare with, or None
    layout : a name from LAYOUTS
    wipe : where the map of the other method begins, as a share of the width
    maps, top : the last measured maps, and the upper end of their common scale
    """

    what: str = "steps"
    other: str | None = None
    layout: str = LAYOUTS[0]
    wipe: float = 0.5
    maps: tuple[Heat, ...] = ()
    top: float = 1.0

    def tracers(self, tracers: Tracers, method: str, options: Mapping[str, Any]) -> list[Tracer]:
        """Return a tracer for each map."""
        return [tracers.get(name, chosen) for name, chosen in self.traced(method, options)]

    def measure(self, tracers: Sequence[Tracer], camera: Camera,
                size: tuple[int, int]) -> list[Statistics]:
        """Measure the maps. Return the statistics of each method's traversal."""
        found, costs = [], []
        for tracer in tracers:
            found.append(heat(tracer, self.what, self.size_of_one(size), camera))
            # Both maps may use the same tracer, so copy its statistics.
            costs.append(deepcopy(tracer.statistics))
        self.maps = tuple(found)
        self.top = scale_of(self.maps)
        return costs

    def traced(self, method: str, options: Mapping[str, Any]
               ) -> list[tuple[str, dict[str, Any]]]:
        rows = [(method, dict(options))]
        if self.other is not None:
            rows.append((self.other, dict(options) if self.other == method
                         else _shared(self.other, options)))
        if self.what in BY_PASS:
            return [(name, find_method(name).in_passes(chosen)) for name, chosen in rows]
        return [(name, {**chosen, "statistics": True}) for name, chosen in rows]

    def size_of_one(self, size: tuple[int, int]) -> tuple[int, int]:
        """Return the (width, height) of each map in a picture of ``size``."""
        if self.other is not None and self.layout == LAYOUTS[1]:
            return max(1, size[0] // 2), size[1]
        return size

    def pixels(self) -> np.ndarray:
        shown = [colours.ramp(one.values / self.top) for one in self.maps]
        if len(shown) == 1:
            return shown[0]
        if self.layout == LAYOUTS[1]:
            return np.concatenate(shown, axis=1)
        left, right = shown
        at = round(self.wipe * left.shape[1])
        return np.concatenate([left[:, :at], right[:, at:]], axis=1)

    def with_scale(self, image: Image.Image) -> Image.Image:
        return colours.stacked([image, self.scale(max(image.width, 200))])

    def scale(self, width: int) -> Image.Image:
        return scale_bar(self.maps, self.what, self.top, width)

    def titles(self) -> list[str]:
        return [f"{one.title}: mean {one.summary()['mean']:.1f}, maximum "
                f"{one.summary()['max']:.0f}" for one in self.maps]


def _shared(method: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Return the tracer options among ``options``, which were chosen for another method. Omit a
    schedule that ``method`` does not support. Omit ``steps_per_pass`` if a pass of ``method`` runs
    a single step."""
    known = {option.name for option in TRACER_OPTIONS}
    shared = {name: value for name, value in options.items() if name in known}
    if shared.get("schedule") not in (None, *find_method(method).schedules):
        del shared["schedule"]
    if find_method(method).steps_once:
        shared.pop("steps_per_pass", None)
    return shared
