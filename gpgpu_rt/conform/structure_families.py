"""Structure families: hard cases for acceleration structures, rows 25 to 39 of docs/extremes.md.
"""
from __future__ import annotations

import numpy as np

from .case import Case, family
from .draws import bell, between, chosen, directions
from .shapes import aims_at, box, lattice, outside_rays, soup


@family("in-planes", 25, "rays and triangles in the planes that split a lattice, inside a box")
def _(n: int, seed: int) -> Case:
    """The rays meet the lattice only at edges, where float32 cannot decide hits. All rays
    hit the box."""
    rng = np.random.default_rng(seed)
    triangles = np.concatenate([lattice(8), 2.5 * box(3) + np.float32(0.46875)])
    axis = rng.integers(3, size=n)[:, None] == np.arange(3)
    origins = np.where(axis, rng.integers(0, 9, (n, 3)) / 8, between(rng, -0.5, 1.5, (n, 3)))
    return Case(triangles, origins, np.where(axis, 0, directions(rng, n)), closed=True)


@family("spanning", 27, "long triangles across many leaves, small ones between them")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    long = rng.random((40, 1, 3)) + bell(rng, (40, 3, 3)) * rng.permuted(
        np.tile([3.0, 3.0, 0.02], (40, 1, 1)), axis=2)
    triangles = np.concatenate([soup(800, seed, 0.01), long.astype(np.float32)])
    return Case(triangles, *outside_rays(triangles[:800], n, rng, 0.3))


@family("cell-corners", 28, "rays through the corners and edges of cells")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    origins = rng.integers(-8, 24, (n, 3)) / 16
    aims = rng.integers(0, 9, (n, 3)) / 8
    aims = np.where((aims == origins).all(1, keepdims=True), aims + 1, aims)
    return Case(lattice(8), origins, aims - origins,
                options={"grid": {"resolution": 8}, "grid-proximity": {"resolution": 8}})


@family("diagonals", 29, "long diagonals through 512 x 512 x 8 cells")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    flat = np.float64([1, 1, 1 / 64])
    triangles = (soup(1500, seed, 0.004) * flat).astype(np.float32)
    corner = rng.integers(0, 2, (n, 3))
    origins = ((corner + 0.1 * bell(rng, (n, 3))) * flat).astype(np.float32)
    aims = np.where(np.arange(n)[:, None] % 2 == 0, aims_at(triangles, n, rng, "insides"),
                    (1 - corner + 0.1 * bell(rng, (n, 3))) * flat)
    cells = {"resolution": (512, 512, 8)}
    return Case(triangles, origins, aims - origins,
                options={"grid": cells, "grid-proximity": cells})


@family("box-corners", 31, "triangles that reach into a corner of their box, rays aimed there")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    count = 500
    corner = rng.random((count, 1, 3))
    leg = between(rng, 0.01, 0.1, (count, 3, 1)) * np.eye(3) * chosen(rng, [-1, 1], (count, 3, 1))
    first = rng.integers(3, size=count)
    rows = np.arange(count)
    triangles = np.concatenate([corner, corner + leg[rows, first][:, None],
                                corner + leg[rows, (first + 1) % 3][:, None]], 1)
    triangles = triangles.astype(np.float32)
    some = rng.integers(count, size=n)
    origins = between(rng, -0.5, 1.5, (n, 3)).astype(np.float32)
    return Case(triangles, origins, triangles[some, 0].astype(np.float64) - origins)


@family("one-centroid", 33, "triangles with equal centroids, so with equal Morton codes", 300)
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    corners = rng.integers(-512, 513, (2000, 3, 3)) / 1024
    corners[:, 2] = -corners[:, 0] - corners[:, 1]
    triangles = np.ldexp(corners, rng.integers(-4, 1, (2000, 1, 1)))
    return Case(triangles, *outside_rays(triangles.astype(np.float32), n, rng))


def long_way(count: int, n: int, seed: int) -> Case:
    """Return a row of triangles, and rays that cross all boxes but hit only the last triangle."""
    rng = np.random.default_rng(seed)
    at = np.arange(count)[:, None, None] * np.float64([0, 0, -1])
    triangles = at + np.float64([[0, 0, 0.1], [1, 0, 0], [0, 1, 0]])
    triangles[-1] += np.float64([[-4, -4, 0], [4, 0, 0], [0, 4, 0]])
    origins = np.column_stack([between(rng, 0.6, 0.9, (n, 2)), np.ones(n)])
    return Case(triangles, origins, np.tile([0.0, 0, -1], (n, 1)), closed=True)


@family("long-way", 36, "rays through boxes of 40,000 triangles, too many steps for one loop", 3)
def _(n: int, seed: int) -> Case:
    return long_way(40_000, n, seed)


@family("one-triangle", 39, "one triangle, rays at it and past it")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangle = np.float64([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]])
    origins = bell(rng, (n, 3)).astype(np.float32)
    aims = aims_at(triangle, n, rng, "insides") + chosen(rng, [0, 0.3], (n, 1))
    return Case(triangle, origins, aims - origins)
