"""Builder: a scene's triangles as a method's accelerator, built or refitted."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..accel.bounds import shrink_flat
from ..gl.precision import Precision
from ..methods import Accelerator, Method
from ..methods.quality import sah_cost
from ..scene.scene import Scene


class Builder:
    """Makes accelerators of one scene as it moves.

    Parameters
    ----------
    options : the tracer's, resolved
    charts : the scene's, which geometry images are made of
    """

    def __init__(self, method: Method, options: dict[str, Any], charts: Any) -> None:
        self.precision = Precision.of(options)
        self._method, self._options, self._charts = method, options, charts
        self._built_cost: float | None = None   # its SAH cost, once a refit asks

    def stored(self, scene: Scene) -> np.ndarray:
        """Its triangles as textures hold them: boxes then enclose what the kernels will read."""
        return shrink_flat(self.precision.stored(scene.triangles))

    def build(self, triangles: np.ndarray) -> Accelerator:
        """A new accelerator over (n, 3, 3) stored triangles."""
        self._built_cost = None
        return self._method.prepare(triangles, {**self._options, "charts": self._charts})

    def refit(self, accelerator: Accelerator, triangles: np.ndarray) -> Accelerator | None:
        """The accelerator around (n, 3, 3) stored triangles, or None where it must be built anew:
        the method cannot refit, or ``rebuild_ratio`` says that it became too much worse."""
        ratio = self._options.get("rebuild_ratio", np.inf)
        if self._method.refit is None or ratio == 0:
            return None
        if ratio < np.inf and self._built_cost is None:
            self._built_cost = sah_cost(accelerator.structure)
        moved = self._method.refit(accelerator, triangles, self._options)
        worse = ratio < np.inf and sah_cost(moved.structure) > ratio * self._built_cost
        return None if worse else moved
