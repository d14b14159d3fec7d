"""Waves: the sets of rays of a picture, traced by whatever method the tracer has."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..rays.textures import RayTextures, StateBuffers
from ..scene.camera import Camera
from ..statistics import Statistics
from ..traversal.driver import Driver
from .integrator import Hits, Integrator


class Waves:
    """Traces sets of rays of one size, or of one that buffers are kept for, and counts them.

    Parameters
    ----------
    count_rays : takes the hits of the first wave, the eye rays
    """

    def __init__(self, driver: Driver, buffers: StateBuffers, statistics: Statistics,
                 count_rays: Callable[[Hits], object]) -> None:
        self._driver, self._buffers, self._statistics = driver, buffers, statistics
        self._count_rays = count_rays
        self.count = 0

    def draw(self, drawer: Integrator, rays: RayTextures, camera: Camera) -> np.ndarray:
        """A picture, (height, width, 3) uint8; the statistics say what its passes were."""
        try:
            return drawer.draw(self.trace, rays, camera)
        finally:    # also of a picture that was interrupted
            self._statistics.picture_passes = dict(drawer.drawn)
            self._statistics.samples, self._statistics.noise = drawer.samples_done, drawer.noise
            self._statistics.waves, self._statistics.texel_fetches = self.count, drawer.fetches
            self._statistics.vertices = drawer.vertices

    def trace(self, rays: RayTextures, any_hit: bool = False) -> Hits:
        """Where the hits are, until rays are traced again."""
        buffers = self._buffers.of(rays.size)
        hits, stopped = self._driver.run(rays, buffers, self._statistics, any_hit)
        self._statistics.stopped += stopped
        if not self.count and self._buffers.counts:
            self._count_rays(hits)
        self.count += 1
        return hits
