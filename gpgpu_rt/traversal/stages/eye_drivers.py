"""Eye drivers: wraps a driver so that the rasteriser bounds or finds the hits of eye rays."""
from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...errors import OptionError
from ...gl.context import Gpu
from ...gl.textures import bytes_of, release
from ..driver import Driver
from ..method import Method
from .first_hits import FirstHits, check_first_hits
from .rasterised_bounds import RasterisedBounds, check_bounds


class EyeDrivers:
    """Makes, on demand, the drivers `FirstHits` and `RasterisedBounds`, which wrap a method's own
    driver."""

    def __init__(self, gpu: Gpu, method: Method, options: Mapping[str, Any]) -> None:
        check_bounds(options)
        self.gpu, self.method, self.options = gpu, method, options
        self._bounds: RasterisedBounds | None = None
        self._first_hits: FirstHits | None = None
        self._lost = False

    def over(self, driver: Driver, first_hits: str, triangles: np.ndarray) -> Driver:
        """Return the driver that traces a picture's rays.

        Parameters
        ----------
        driver : the method's own driver
        first_hits : a value of ``first_hits.FIRST_HITS``
        triangles : (n, 3, 3) float32, rounded as the method's tables store them; a hit on row i
            gets the triangle index i

        Raises
        ------
        OptionError
            as `check_first_hits`, or if the rasteriser needs triangles whose positions the host
            does not know
        """
        rasterises = check_first_hits(first_hits, self.options)
        if self._lost and (rasterises or self.options["rasterised_bounds"]):
            raise OptionError("the rasteriser does not know the positions of triangles that moved "
                              "without read_back; move them with read_back=True, or set "
                              "first_hits=traced and leave rasterised_bounds out")
        if self.options["rasterised_bounds"]:
            if self._bounds is None:
                self._bounds = RasterisedBounds(self.gpu, self.method, self.options)
                self._bounds.take(triangles, driver)
            driver = self._bounds
        if not rasterises:
            return driver
        if self._first_hits is None:
            self._first_hits = FirstHits(self.gpu, self.method, self.options)
            self._first_hits.take(triangles, driver)
        self._first_hits.proved = first_hits == "rasterised"
        return self._first_hits

    def take(self, triangles: np.ndarray, driver: Driver) -> None:
        """Use moved triangles, and the method's driver for these triangles."""
        self._lost = False
        for helper in (self._bounds, self._first_hits):
            if helper is not None:
                helper.take(triangles, driver)
                driver = helper

    def lose_triangles(self) -> None:
        """Record that the host does not know the positions of moved triangles, until ``take``."""
        self._lost = True

    def bytes(self) -> int:
        return bytes_of(self._bounds, self._first_hits)

    def release(self) -> None:
        release(self._bounds, self._first_hits)
