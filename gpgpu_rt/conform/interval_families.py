"""Interval families: intervals of t with an end at or next to a hit, segments, empty intervals."""
from __future__ import annotations

import numpy as np

from .case import Case, family
from .draws import between, chosen, directions
from .shapes import aims_at, bumpy_sphere, lattice

# An end of an interval is the hit's t multiplied by one of these factors.
FACTORS = (0.5, 1 - 2.0 ** -10, 1 - 2.0 ** -24, 1.0, 1 + 2.0 ** -23, 1 + 2.0 ** -10, 2.0)


@family("intervals", 42, "intervals of t that begin or end at a hit on a lattice, or next to it")
def _(n: int, seed: int) -> Case:
    """Rays run along an axis through insides of triangles; float32 holds each hit's t exactly."""
    rng = np.random.default_rng(seed)
    axis = rng.integers(3, size=n)
    side = chosen(rng, [-1.0, 1.0], n)
    # The lattice's planes lie at multiples of 1/8; rays avoid the diagonals of the squares.
    across = (2 * rng.integers(0, 4, (n, 3)) + 0.5) / 8 + between(rng, -0.01, 0.03, (n, 3))
    along = np.eye(3)[axis]
    origins = np.where(along == 1, np.where(side > 0, -0.5, 1.5)[:, None], across)
    t = 0.5 + rng.integers(0, 8, n) / 8
    end = (t * chosen(rng, FACTORS, n)).astype(np.float32)
    begins = rng.random(n) < 0.5
    return Case(lattice(8), origins, along * side[:, None], t_min=np.where(begins, end, 0),
                t_max=np.where(begins, np.inf, end))


@family("segments", 42, "segments between two points: t in [0, 1], as for shadow rays")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = bumpy_sphere(2)
    origins = between(rng, -0.4, 0.4, (n, 3)).astype(np.float32)
    reach = chosen(rng, [0.5, 0.999, 1.001, 2.0], (n, 1))
    return Case(triangles, origins, reach * (aims_at(triangles, n, rng, "insides") - origins),
                t_max=1.0)


@family("empty-intervals", 42, "intervals of t, most of them empty, with t_max below t_min")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    first = chosen(rng, [0.0, 1.0, 100.0], n)
    last = chosen(rng, [-1.0, -1e-30, 0.5, 2.0], n)
    return Case(bumpy_sphere(2), between(rng, -0.4, 0.4, (n, 3)), directions(rng, n), t_min=first,
                t_max=last)
