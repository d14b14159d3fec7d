"""Flat families: scenes that are flat along an axis, and rays that start on or next to the scene.

A scene lies at 0, 0.5 or 1000 on its axis, or at the next float32 value above or below. The scene
may be tilted by a float32 spacing. In practice, a shadow ray starts so near a floor: the distance
of its origin from the floor is less than the rounding errors along the other axes.
"""
from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np

from .case import Case, family
from .draws import bell, between, binades, chosen, directions

# Distances of ray origins from the scene. Some origins are one float32 spacing away instead.
HEIGHTS = (0.0, 1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)
STARTS = (-1.0, -1e-6, 0.0, 0.0, 1e-9, 1e-6, 0.3)     # values of t_min


@dataclass(frozen=True)
class Flat:
    """A flat scene.

    Attributes
    ----------
    axis : the axis along which the scene is flat
    at : the scene's coordinate on this axis
    spacings : number of float32 values by which the scene is moved further along the axis
    tilted : whether the scene rises by a float32 spacing (at least 2^-24) per unit of length
    count : number of triangles; 2 triangles form a square
    """

    axis: int
    at: float
    spacings: int = 0
    tilted: bool = False
    count: int = 30

    @property
    def height(self) -> np.float32:
        height = np.float32(self.at)
        for _ in range(abs(self.spacings)):
            height = np.nextafter(height, np.float32(np.copysign(np.inf, self.spacings)))
        return height

    def triangles(self, seed: int) -> np.ndarray:
        rng = np.random.default_rng(seed)
        if self.count == 2:
            flat = np.float64([[[-1, -1], [1, -1], [1, 1]], [[-1, -1], [1, 1], [-1, 1]]])
        else:
            size = 2 / np.sqrt(self.count)
            flat = (between(rng, -1, 1, (self.count, 1, 2))
                    + size * bell(rng, (self.count, 3, 2)))
        spacing = max(float(np.spacing(self.height)), 2.0 ** -24)
        height = float(self.height) + self.tilted * spacing * flat[..., 0]
        return self._turned(flat, height).astype(np.float32)

    def case(self, n: int, seed: int, together: bool = False) -> Case:
        """Return a case of n rays that start on or next to the scene.

        Directions are random, in the plane, near the plane, or along a coordinate axis.

        Parameters
        ----------
        together : whether all rays start at one point with t_min 0
        """
        rng = np.random.default_rng((seed, int(together)))
        spacing = float(np.spacing(self.height))
        above = np.where(rng.random(n) < 0.1, spacing, chosen(rng, HEIGHTS, n))
        origins = self._turned(between(rng, -1.2, 1.2, (n, 2)),
                               float(self.height) + above * chosen(rng, [-1, 1], n))
        towards, share = directions(rng, n), rng.random(n)
        steep = np.where(share < 0.25, binades(rng, 1e-12, 1, n), 1.0)
        towards[:, self.axis] *= np.where(share > 0.85, 0.0, steep)
        along = rng.random(n) < 0.1             # parallel to a coordinate axis
        towards[along] *= np.eye(3)[rng.integers(3, size=along.sum())]
        towards[(towards == 0).all(axis=1)] = np.roll((1.0, 1.0, 0.0), self.axis)
        t_min = chosen(rng, STARTS, n)
        if together:
            origins[:], t_min[:] = origins[0], 0
        return Case(self.triangles(seed), origins, towards, t_min=t_min)

    def _turned(self, flat: np.ndarray, height: np.ndarray) -> np.ndarray:
        """Return points (..., 3) from points (..., 2) in the plane and their heights (...)."""
        height = np.broadcast_to(height, flat.shape[:-1])
        return np.roll(np.concatenate([height[..., None], flat], -1), self.axis, -1)


FLATS = [Flat(*one) for one in itertools.product(
    range(3), (0.0, 0.5, 1000.0), (-1, 0, 1), (False, True), (2, 30, 2000))]


@family("flat-floor", 41, "two triangles in a coordinate plane, rays on it and next to it")
def _(n: int, seed: int) -> Case:
    return Flat(seed % 3, 0.0, count=2).case(n, seed)


@family("flat-soup", 41, "overlapping triangles in a coordinate plane, rays on it and next to it")
def _(n: int, seed: int) -> Case:
    return Flat(seed % 3, 0.0).case(n, seed)


@family("flat-tilted", 41, "overlapping triangles far from 0, tilted by a float32 spacing")
def _(n: int, seed: int) -> Case:
    return Flat(seed % 3, 1000.0, tilted=True).case(n, seed)
