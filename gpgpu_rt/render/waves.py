"""Waves: traces a picture's rays, wave by wave, with the tracer's method."""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..rays.textures import RayTextures, StateBuffers
from ..scene.camera import Camera
from ..statistics import Statistics
from ..traversal.driver import Driver
from .integrator import Hits, Integrator


class Waves:
    """Traces and counts waves, which are sets of rays, for an integrator.

    Parameters
    ----------
    driver : the driver of the tracer's method
    buffers : state buffers for all sizes of ray textures that the integrator traces
    statistics : receives the counts
    count_rays : called with the hits of the eye rays (the first wave), to count the rays' work
    """

    def __init__(self, driver: Driver, buffers: StateBuffers, statistics: Statistics,
                 count_rays: Callable[[Hits], object]) -> None:
        self._driver, self._buffers, self._statistics = driver, buffers, statistics
        self._count_rays = count_rays
        self.count = 0

    def draw(self, drawer: Integrator, rays: RayTextures, camera: Camera) -> np.ndarray:
        """Return a picture, (height, width, 3) uint8, and record its passes in the statistics."""
        try:
            return drawer.draw(self.trace, rays, camera)
        finally:    # also record the counts of an interrupted picture
            self._statistics.picture_passes = dict(drawer.drawn)
            self._statistics.samples, self._statistics.noise = drawer.samples_done, drawer.noise
            self._statistics.waves, self._statistics.texel_fetches = self.count, drawer.fetches
            self._statistics.vertices = drawer.vertices

    def trace(self, rays: RayTextures, any_hit: bool = False) -> Hits:
        """Trace rays; the returned hits are valid until the next call."""
        buffers = self._buffers.of(rays.size)
        hits, stopped = self._driver.run(rays, buffers, self._statistics, any_hit)
        self._statistics.stopped += stopped
        if not self.count and self._buffers.counts:
            self._count_rays(hits)
        self.count += 1
        return hits
