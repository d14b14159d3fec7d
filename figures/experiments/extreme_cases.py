"""The extremes: scenes and rays where ray tracers fail, each with its row in docs/extremes.md.

Tests trace them with every method, and the figure `extremes` measures them. A case is made from
its name, a number of rays and a seed. Its scene does not depend on the number of rays.
"""
from __future__ import annotations

import numpy as np

from . import flat_cases  # noqa: F401, registers its cases
from .extreme_case import CASES, Case, Kind, entry
from .extreme_shapes import aims_at, bumpy_sphere, lattice, outside_rays, soup, square, unit

EMBREE_CASE = np.float64([148376, 1234, -223423])   # where Embree's own tests put their sphere
AXES = np.eye(3)


def make_case(name: str, rays: int, seed: int) -> Case:
    return CASES[name].make(rays, seed)


# Rows 1 to 6: closed meshes ----------------------------------------------------------------------

def _inside(n: int, rng: np.random.Generator, at: np.ndarray | float = 0.0) -> np.ndarray:
    return (at + 0.4 * rng.uniform(-1, 1, (n, 3))).astype(np.float32)


def _sphere(n: int, seed: int, aim: str, at: np.ndarray | float = 0.0) -> Case:
    rng = np.random.default_rng(seed)
    triangles = bumpy_sphere(at=at)
    origins = _inside(n, rng, at)
    directions = (rng.normal(size=(n, 3)) if aim == "random"
                  else aims_at(triangles, n, rng, aim) - origins)
    return Case(triangles, origins, directions, closed=True)


@entry("sphere-random", 1, "closed bumpy sphere, random rays from inside")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "random")


@entry("sphere-vertices", 2, "the same, aimed at vertices")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "vertices")


@entry("sphere-edges", 3, "the same, aimed at edges")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "edges")


@entry("embree-vertices", 4, "row 2 with the mesh at (148376, 1234, -223423)")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "vertices", EMBREE_CASE)


@entry("embree-edges", 4, "row 3 with the mesh at (148376, 1234, -223423)")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "edges", EMBREE_CASE)


def square_case(quads: int, n: int, seed: int) -> Case:
    """Rays from a point in front of the square, half to vertices and half to random places."""
    rng = np.random.default_rng(seed)
    triangles = square(quads)
    inner = triangles.reshape(-1, 3)
    aims = np.concatenate([inner[rng.integers(len(inner), size=n // 2)],
                           np.column_stack([rng.uniform(-1, 1, (n - n // 2, 2)),
                                            np.full(n - n // 2, -1)])])
    aims[:, :2] *= 1 - 2.0**-12    # keep off the square's own border
    origin = (rng.uniform(-0.3, 0.3, 3) + [0, 0, 0.5]).astype(np.float32)
    return Case(triangles, np.tile(origin, (n, 1)), aims - origin, closed=True)


@entry("square-32", 5, "a square of 2,048 triangles")
def _(n: int, seed: int) -> Case:
    return square_case(32, n, seed)


# Rows 8 to 10, 30: where the scene lies, and how large it is -------------------------------------

@entry("outside", 30, "soup from outside, all octants of directions")
def _(n: int, seed: int) -> Case:
    triangles = soup(400, seed)
    return Case(triangles, *outside_rays(triangles, n, np.random.default_rng(seed)))


def scaled(exponent: int, n: int, seed: int) -> Case:
    case = make_case("outside", n, seed)
    return Case(np.ldexp(case.triangles, exponent), np.ldexp(case.origins, exponent),
                case.directions)


for _k in (-20, 20):
    CASES[f"scaled-2^{_k}"] = Kind(f"scaled-2^{_k}", 8, f"soup scaled by 2^{_k}",
                                   lambda n, seed, k=_k: scaled(k, n, seed))


def moved(power: int, n: int, seed: int) -> Case:
    """The sphere, 10^power of its sizes from 0, with rays from inside to vertices and edges."""
    rng = np.random.default_rng(seed)
    at = 2.0 * 10**power * np.float64([1, -0.6, 0.3])
    triangles = bumpy_sphere(at=at)
    origins = _inside(n, rng, at)
    aims = np.concatenate([aims_at(triangles, n // 2, rng, "vertices"),
                           aims_at(triangles, n - n // 2, rng, "edges")])
    return Case(triangles, origins, aims - origins, closed=power <= 5)


for _k in (0, 2, 4, 5, 6):
    CASES[f"moved-1e{_k}"] = Kind(f"moved-1e{_k}", 9, f"scene moved by 10^{_k} of its sizes",
                                  lambda n, seed, k=_k: moved(k, n, seed))


@entry("from-afar", 9, "rays from 10 to 10^6 scene sizes away, aimed at vertices")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = bumpy_sphere()
    origins = (unit(rng.normal(size=(n, 3))) * 10 ** rng.uniform(1, 6, (n, 1))).astype(np.float32)
    return Case(triangles, origins, 0.9 * aims_at(triangles, n, rng, "vertices") - origins)


@entry("stadium", 9, "sizes from 1 to 10^-5 in one scene")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    hall, pot = soup(500, seed, 0.3), bumpy_sphere(2, 0.5 / 1e-5)
    triangles = np.concatenate([hall, (pot.astype(np.float64) * 1e-5).astype(np.float32)])
    origins = (0.5 + rng.normal(size=(n, 3)) * 10 ** rng.uniform(-4.5, -0.5, (n, 1)))
    origins = origins.astype(np.float32)
    aims = np.where(np.arange(n)[:, None] % 2 == 0, aims_at(triangles[500:], n, rng, "vertices"),
                    aims_at(triangles[:500], n, rng, "insides"))
    return Case(triangles, origins, aims - origins)


# Rows 7, 11 to 15: odd triangles -----------------------------------------------------------------

@entry("slivers", 11, "triangles of aspect 10^6, rays at them and past them")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    count = 300
    base = rng.uniform(-1, 1, (count, 1, 3))
    along = unit(rng.normal(size=(count, 3)))
    across = unit(np.cross(along, rng.normal(size=(count, 3))))
    triangles = base + np.stack([0 * along, along, 0.3 * along + 1e-6 * across], axis=1)
    triangles = triangles.astype(np.float32)
    chosen = rng.integers(count, size=n)
    aims = triangles[chosen, 0] + rng.uniform(-0.2, 1.2, (n, 1)) * along[chosen]
    aims = aims + across[chosen] * rng.choice([0, 3e-7, 1e-4, -1e-4], (n, 1))
    origins = (3 * unit(rng.normal(size=(n, 3)))).astype(np.float32)
    return Case(triangles, origins, aims - origins)


@entry("grazing", 12, "rays 10^-6 radian off the planes of large triangles")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    count = 40
    planes = np.arange(count) / count - 0.5
    frame = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    corner = np.float64([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
    triangles = corner + planes[:, None, None] * [0, 0, 1.0]
    start = np.column_stack([rng.uniform(-3, 3, (n, 2)), np.zeros(n)])
    end = np.column_stack([rng.uniform(-0.3, 0.3, (n, 2)), np.zeros(n)])
    height = planes[rng.integers(count, size=n)]
    start[:, 2], end[:, 2] = height + 1e-6 * rng.choice([-1, 1], n), height
    origins = (start @ frame).astype(np.float32)
    return Case(triangles @ frame, origins, end @ frame - origins)


@entry("degenerate", 13, "zero area: points, needles and repeated vertices, in front of a wall")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    p, q = rng.integers(-8, 9, (2, 150, 3)) / 8.0
    points, needles = np.stack([p, p, p], 1), np.stack([p, (p + q) / 2, q], 1)
    repeated = np.stack([p, q, q], 1)
    flat = np.concatenate([points, needles, repeated])
    wall = np.float64([[[-64, -64, -4], [64, -64, -4], [0, 64, -4]]])
    aims = aims_at(flat.astype(np.float32), n, rng, "vertices")
    origins = (aims + [0, 0, 4] + 0.5 * rng.integers(-2, 3, (n, 3)) * [1, 1, 0])
    return Case(np.concatenate([flat, wall]), origins, aims - origins, closed=True)


@entry("coincident", 14, "10,000 coincident triangles")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangle = np.float64([[-1, -1, 0.25], [1, -1, 0.5], [0, 1, 0.125]])
    origins = rng.uniform(-0.2, 0.2, (n, 3)) + [0, 0, 2]
    return Case(np.tile(triangle, (10_000, 1, 1)), origins, rng.normal(size=(n, 3)) * 0.1
                - [0, 0, 1])


@entry("coplanar", 14, "10,000 overlapping triangles in one plane")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = rng.uniform(-1, 1, (10_000, 1, 3)) + 0.05 * rng.normal(size=(10_000, 3, 3))
    triangles[:, :, 2] = 0.5
    origins = np.column_stack([rng.uniform(-1, 1, (n, 2)), np.full(n, 2)]).astype(np.float32)
    return Case(triangles, origins, rng.normal(size=(n, 3)) * 0.2 - [0, 0, 1])


@entry("near-planes", 15, "two planes 1 to 8 float32 spacings apart")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = []
    for k in range(1, 9):
        x = 4.0 * (k - 1)
        for z in (np.float32(1), np.float32(1) + k * np.float32(2.0**-23)):
            triangles.append([[x - 1, -1, z], [x + 1, -1, z], [x, 2, z]])
    order = rng.permutation(16)    # the nearer plane has the lower index in some pairs only
    x = 4.0 * rng.integers(8, size=n)
    origins = np.column_stack([x + rng.uniform(-0.2, 0.2, n), rng.uniform(-0.2, 0.2, n),
                               rng.choice([0.0, 1.5], n)])
    directions = np.column_stack([np.zeros((n, 2)), np.where(origins[:, 2] < 1, 1.0, -1.0)])
    return Case(np.float64(triangles)[order], origins, directions, closed=True)


# Rows 16 to 20: odd directions -------------------------------------------------------------------

SIGNS = np.stack(np.meshgrid(*[[0.0, 1.0, -1.0]] * 3), -1).reshape(-1, 3)[1:]   # 26


@entry("signed-zeros", 16, "the 26 directions with components 0, 1 and -1, zeros of both signs")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = lattice(8)
    directions = SIGNS[rng.integers(26, size=n)]
    zeros = np.where(rng.random((n, 3)) < 0.5, 0.0, -0.0)
    origins = (rng.integers(0, 64, (n, 3)) + 0.5) / 64
    return Case(triangles, origins, np.where(directions == 0, zeros, directions))


@entry("slab-planes", 17, "origins on planes of boxes and cells, direction components 0")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    directions = SIGNS[rng.integers(26, size=n)]
    origins = rng.integers(-2, 19, (n, 3)) / 16
    origins = np.where(directions == 0, origins, origins + rng.choice([0, 1 / 64], (n, 3)))
    return Case(lattice(8), origins, directions)


@entry("flat-box", 18, "flat scenes, rays along the normal of their box")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    axis = seed % 3
    triangles = np.roll(square(8) + [0, 0, 1.3125], axis, axis=2)
    origins = np.column_stack([rng.integers(-31, 32, (n, 2)) / 32, rng.choice([-3.0, 3.0], n)])
    directions = np.column_stack([np.zeros((n, 2)), np.where(origins[:, 2] < 0, 1.0, -1.0)])
    return Case(triangles, np.roll(origins, axis, 1), np.roll(directions, axis, 1), closed=True)


@entry("denormals", 19, "direction components from 1e-38 to 1e-45")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    case = make_case("signed-zeros", n, seed)
    tiny = 10 ** rng.uniform(-45, -38, (n, 3)) * rng.choice([-1, 1], (n, 3))
    directions = np.where(case.directions == 0, tiny, case.directions.astype(np.float64))
    return Case(case.triangles, case.origins, directions)


@entry("lengths", 20, "directions of length 1e-15 to 1e15")
def _(n: int, seed: int) -> Case:
    case = make_case("outside", n, seed)
    length = 10 ** np.random.default_rng(seed).uniform(-15, 15, (n, 1))
    return Case(case.triangles, case.origins, unit(case.directions.astype(np.float64)) * length)


# Rows 24 to 36: hard cases for acceleration structures -------------------------------------------

@entry("in-planes", 25, "rays and triangles in the planes that split a lattice")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    axis = rng.integers(3, size=n)[:, None] == np.arange(3)
    origins = np.where(axis, rng.integers(0, 9, (n, 3)) / 8, rng.uniform(-0.5, 1.5, (n, 3)))
    return Case(lattice(8), origins, np.where(axis, 0, rng.normal(size=(n, 3))))


@entry("spanning", 27, "long triangles across many leaves, small ones between them")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    long = rng.random((40, 1, 3)) + rng.normal(size=(40, 3, 3)) * rng.permuted(
        np.tile([3.0, 3.0, 0.02], (40, 1, 1)), axis=2)
    triangles = np.concatenate([soup(800, seed, 0.01), long.astype(np.float32)])
    return Case(triangles, *outside_rays(triangles[:800], n, rng, 0.3))


@entry("cell-corners", 28, "rays through the corners and edges of cells")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    origins = rng.integers(-8, 24, (n, 3)) / 16
    aims = rng.integers(0, 9, (n, 3)) / 8
    aims = np.where((aims == origins).all(1, keepdims=True), aims + 1, aims)
    return Case(lattice(8), origins, aims - origins,
                options={"grid": {"resolution": 8}, "grid-proximity": {"resolution": 8}})


@entry("diagonals", 29, "long diagonals through 512 x 512 x 8 cells")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    flat = np.float64([1, 1, 1 / 64])
    triangles = (soup(1500, seed, 0.004) * flat).astype(np.float32)
    corner = rng.integers(0, 2, (n, 3))
    origins = ((corner + 0.1 * rng.normal(size=(n, 3))) * flat).astype(np.float32)
    aims = np.where(np.arange(n)[:, None] % 2 == 0, aims_at(triangles, n, rng, "insides"),
                    (1 - corner + 0.1 * rng.normal(size=(n, 3))) * flat)
    cells = {"resolution": (512, 512, 8)}
    return Case(triangles, origins, aims - origins,
                options={"grid": cells, "grid-proximity": cells})


@entry("box-corners", 31, "triangles that reach into a corner of their box, rays aimed there")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    count = 500
    corner = rng.random((count, 1, 3))
    leg = rng.uniform(0.01, 0.1, (count, 3, 1)) * AXES * rng.choice([-1, 1], (count, 3, 1))
    first = rng.integers(3, size=count)
    rows = np.arange(count)
    triangles = np.concatenate([corner, corner + leg[rows, first][:, None],
                                corner + leg[rows, (first + 1) % 3][:, None]], 1)
    triangles = triangles.astype(np.float32)
    chosen = rng.integers(count, size=n)
    origins = rng.uniform(-0.5, 1.5, (n, 3)).astype(np.float32)
    return Case(triangles, origins, triangles[chosen, 0].astype(np.float64) - origins)


@entry("one-centroid", 33, "centroids, and so Morton codes, all equal")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    corners = rng.integers(-512, 513, (2000, 3, 3)) / 1024
    corners[:, 2] = -corners[:, 0] - corners[:, 1]
    triangles = corners * 2.0 ** rng.integers(-4, 1, (2000, 1, 1))
    return Case(triangles, *outside_rays(triangles.astype(np.float32), n, rng))


def long_way(count: int, n: int, seed: int) -> Case:
    """A row of triangles. The rays cross all boxes, but miss all triangles except the last."""
    rng = np.random.default_rng(seed)
    at = np.arange(count)[:, None, None] * np.float64([0, 0, -1])
    triangles = at + np.float64([[0, 0, 0.1], [1, 0, 0], [0, 1, 0]])
    triangles[-1] += np.float64([[-4, -4, 0], [4, 0, 0], [0, 4, 0]])
    origins = np.column_stack([rng.uniform(0.6, 0.9, (n, 2)), np.ones(n)])
    return Case(triangles, origins, np.tile([0.0, 0, -1], (n, 1)), closed=True)


@entry("long-way", 36, "boxes of 40,000 triangles in the way: more steps than one loop runs")
def _(n: int, seed: int) -> Case:
    return long_way(40_000, min(n, 4), seed)


@entry("one-triangle", 39, "one triangle")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    return Case(np.float64([[[0, 0, 0], [1, 0, 0], [0, 1, 0]]]), rng.normal(size=(n, 3)),
                rng.normal(size=(n, 3)))
