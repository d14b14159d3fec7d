"""Builder: builds or refits a method's accelerator over a scene's triangles."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..accel.bounds import shrink_flat
from ..gl.precision import Precision
from ..methods import Accelerator, Method
from ..methods.quality import sah_cost
from ..scene.scene import Scene


class Builder:
    """Makes the accelerators of a scene whose triangles may move.

    Parameters
    ----------
    options : a value for each of the tracer's options
    charts : the scene's charts, from which geometry images are made
    """

    def __init__(self, method: Method, options: dict[str, Any], charts: Any) -> None:
        self.precision = Precision.of(options)
        self._method, self._options, self._charts = method, options, charts
        self._built_cost: float | None = None   # SAH cost of the last build, compared with refits

    def stored(self, scene: Scene) -> np.ndarray:
        """Return the triangles rounded as textures store them. Builds need this form, because rays
        are tested against the rounded triangles."""
        return shrink_flat(self.precision.stored(scene.triangles))

    def build(self, triangles: np.ndarray) -> Accelerator:
        """Return a new accelerator over (n, 3, 3) stored triangles."""
        self._built_cost = None
        return self._method.prepare(triangles, {**self._options, "charts": self._charts})

    def refit(self, accelerator: Accelerator, triangles: np.ndarray) -> Accelerator | None:
        """Return the accelerator refitted to (n, 3, 3) stored triangles. Return None if a rebuild
        is necessary: the method cannot refit, or the refitted SAH cost exceeds ``rebuild_ratio``
        times the last build's cost."""
        ratio = self._options.get("rebuild_ratio", np.inf)
        if self._method.refit is None or ratio == 0:
            return None
        if ratio < np.inf and self._built_cost is None:
            self._built_cost = sah_cost(accelerator.structure)
        moved = self._method.refit(accelerator, triangles, self._options)
        worse = ratio < np.inf and sah_cost(moved.structure) > ratio * self._built_cost
        return None if worse else moved
