"""Families: make scenes and rays for which ray tracers may give wrong hits.

A family belongs to a row of docs/extremes.md. The family's name, a number of rays and a seed
determine a case. `gpgpu-rt conform` tests engines by cases; pytest and the figure `extremes` test
methods.
"""
from __future__ import annotations

import functools

import numpy as np

from ..numerics.denormals import keeps_denormals
from . import flat_families, interval_families, structure_families  # noqa: F401 (fills FAMILIES)
from .case import FAMILIES, Case, family
from .draws import bell, between, binades, chosen, cross, directions, unit
from .shapes import aims_at, box, bumpy_sphere, lattice, outside_rays, soup, square, tube

EMBREE_CASE = np.float64([148376, 1234, -223423])   # the sphere's place in Embree's own tests


@keeps_denormals
def make_case(name: str, rays: int, seed: int) -> Case:
    return FAMILIES[name].make(rays, seed)


# Rows 1 to 5, 43: closed meshes, and a square ----------------------------------------------------

def _inside(n: int, rng: np.random.Generator, at: np.ndarray | float = 0.0) -> np.ndarray:
    return (at + between(rng, -0.4, 0.4, (n, 3))).astype(np.float32)


def _sphere(n: int, seed: int, aim: str, at: np.ndarray | float = 0.0) -> Case:
    rng = np.random.default_rng(seed)
    triangles = bumpy_sphere(at=at)
    origins = _inside(n, rng, at)
    towards = (directions(rng, n) if aim == "random"
               else aims_at(triangles, n, rng, aim) - origins)
    return Case(triangles, origins, towards, closed=True)


@family("sphere-random", 1, "closed bumpy sphere, random rays from inside")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "random")


@family("sphere-vertices", 2, "closed bumpy sphere, rays from inside to vertices")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "vertices")


@family("sphere-edges", 3, "closed bumpy sphere, rays from inside to edges")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "edges")


@family("embree-vertices", 4, "rays to vertices as in row 2, mesh at (148376, 1234, -223423)")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "vertices", EMBREE_CASE)


@family("embree-edges", 4, "rays to edges as in row 3, mesh at (148376, 1234, -223423)")
def _(n: int, seed: int) -> Case:
    return _sphere(n, seed, "edges", EMBREE_CASE)


def square_case(quads: int, n: int, seed: int) -> Case:
    """Return a square with rays from a point in front of it. Half of the rays go to vertices, and
    half to random points."""
    rng = np.random.default_rng(seed)
    triangles = square(quads)
    inner = triangles.reshape(-1, 3)
    aims = np.concatenate([inner[rng.integers(len(inner), size=n // 2)],
                           np.column_stack([between(rng, -1, 1, (n - n // 2, 2)),
                                            np.full(n - n // 2, -1)])])
    aims[:, :2] *= 1 - 2.0**-12    # stay off the border of the square
    origin = (between(rng, -0.3, 0.3, 3) + [0, 0, 0.5]).astype(np.float32)
    return Case(triangles, np.tile(origin, (n, 1)), aims - origin, closed=True)


@family("box-vertices", 43, "a closed box of 12 triangles, rays from inside to its vertices")
def _(n: int, seed: int) -> Case:
    return _in_box(1, "vertices", n, seed)


@family("box-edges", 43, "a closed box of 12 triangles, rays from inside to edges and diagonals")
def _(n: int, seed: int) -> Case:
    return _in_box(1, "edges", n, seed)


@family("box-fine", 43, "a closed box of 3,072 triangles, rays from inside to its vertices")
def _(n: int, seed: int) -> Case:
    return _in_box(16, "vertices", n, seed)


def _in_box(cells: int, aim: str, n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = box(cells)
    origins = between(rng, -0.9, 0.9, (n, 3)).astype(np.float32)
    return Case(triangles, origins, aims_at(triangles, n, rng, aim) - origins, closed=True)


@family("square-32", 5, "a square of 2,048 triangles")
def _(n: int, seed: int) -> Case:
    return square_case(32, n, seed)


# Rows 8, 9, 30: where the scene lies, and how large it is ----------------------------------------

@family("outside", 30, "random triangles, rays from outside in all octants of directions")
def _(n: int, seed: int) -> Case:
    triangles = soup(400, seed)
    return Case(triangles, *outside_rays(triangles, n, np.random.default_rng(seed)))


def scaled(exponent: int, n: int, seed: int) -> Case:
    case = make_case("outside", n, seed)
    return Case(np.ldexp(case.triangles, exponent), np.ldexp(case.origins, exponent),
                case.directions)


for _k in (-20, 20):
    family(f"scaled-2^{_k}", 8, f"random triangles scaled by 2^{_k}, rays from outside")(
        functools.partial(scaled, _k))


def moved(power: int, n: int, seed: int) -> Case:
    """Return the bumpy sphere, moved by 10^power times its size, with rays from inside to vertices
    and edges."""
    rng = np.random.default_rng(seed)
    at = 2.0 * 10**power * np.float64([1, -0.6, 0.3])
    triangles = bumpy_sphere(at=at)
    origins = _inside(n, rng, at)
    aims = np.concatenate([aims_at(triangles, n // 2, rng, "vertices"),
                           aims_at(triangles, n - n // 2, rng, "edges")])
    return Case(triangles, origins, aims - origins, closed=power <= 5)


for _k in (0, 2, 4, 5, 6):
    family(f"moved-1e{_k}", 9, f"closed bumpy sphere, 10^{_k} times its size away from 0")(
        functools.partial(moved, _k))


@family("from-afar", 9, "rays from 10 to 10^6 scene sizes away, aimed at vertices")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = bumpy_sphere()
    origins = (directions(rng, n) * binades(rng, 10, 1e6, (n, 1))).astype(np.float32)
    return Case(triangles, origins, 0.9 * aims_at(triangles, n, rng, "vertices") - origins)


@family("stadium", 9, "sizes from 1 to 10^-5 in one scene")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    hall, pot = soup(500, seed, 0.3), bumpy_sphere(2, 0.5 / 1e-5)
    triangles = np.concatenate([hall, (pot.astype(np.float64) * 1e-5).astype(np.float32)])
    origins = 0.5 + bell(rng, (n, 3)) * binades(rng, 3e-5, 0.3, (n, 1))
    origins = origins.astype(np.float32)
    aims = np.where(np.arange(n)[:, None] % 2 == 0, aims_at(triangles[500:], n, rng, "vertices"),
                    aims_at(triangles[:500], n, rng, "insides"))
    return Case(triangles, origins, aims - origins)


# Rows 11 to 15: odd triangles --------------------------------------------------------------------

@family("slivers", 11, "triangles of aspect 10^6, rays at them and past them")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    count = 300
    base = between(rng, -1, 1, (count, 1, 3))
    along = directions(rng, count)
    across = unit(cross(along, directions(rng, count)))
    triangles = base + np.stack([0 * along, along, 0.3 * along + 1e-6 * across], axis=1)
    triangles = triangles.astype(np.float32)
    some = rng.integers(count, size=n)
    aims = triangles[some, 0] + between(rng, -0.2, 1.2, (n, 1)) * along[some]
    aims = aims + across[some] * chosen(rng, [0, 3e-7, 1e-4, -1e-4], (n, 1))
    origins = (3 * directions(rng, n)).astype(np.float32)
    return Case(triangles, origins, aims - origins)


def _turned(points: np.ndarray) -> np.ndarray:
    """Return points (..., 3) rotated by the unit quaternion (1, 2, 4, 10) / 11."""
    x, y, z = points[..., 0], points[..., 1], points[..., 2]
    return np.stack([-111 * x - 4 * y + 48 * z, 36 * x - 87 * y + 76 * z,
                     32 * x + 84 * y + 81 * z], -1) / 121


@family("grazing", 12, "rays 10^-6 radian off the planes of large triangles, inside a box")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    count = 40
    planes = np.arange(count) / count - 0.5
    corner = np.float64([[-1, -1, 0], [1, -1, 0], [0, 1, 0]])
    triangles = corner + planes[:, None, None] * [0, 0, 1.0]
    start = np.column_stack([between(rng, -3, 3, (n, 2)), np.zeros(n)])
    end = np.column_stack([between(rng, -0.3, 0.3, (n, 2)), np.zeros(n)])
    height = planes[rng.integers(count, size=n)]
    start[:, 2], end[:, 2] = height + 1e-6 * chosen(rng, [-1, 1], n), height
    origins = _turned(start).astype(np.float32)
    triangles = np.concatenate([_turned(triangles), 8 * box()])
    return Case(triangles, origins, _turned(end) - origins, closed=True)


@family("thin-walls", 11, "a closed tube of triangles 10^4 times as long as wide, from inside")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = tube(300, 200)
    wall = triangles[rng.integers(600, size=n)]
    wall = (wall[:, 0] + wall[:, 1] + wall[:, 2]) / 3 * [1, 1, 0]
    inside = 1 - binades(rng, 1e-4, 0.1, (n, 1))
    origins = wall * inside + between(rng, -98, 98, (n, 1)) * [0, 0, 1]
    origins = _turned(origins).astype(np.float32)
    return Case(_turned(triangles), origins, directions(rng, n), closed=True)


@family("degenerate", 13, "zero area: points, needles and repeated vertices, in front of a wall")
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


@family("coincident", 14, "10,000 coincident triangles", 100)
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangle = np.float64([[-1, -1, 0.25], [1, -1, 0.5], [0, 1, 0.125]])
    origins = between(rng, -0.2, 0.2, (n, 3)) + [0, 0, 2]
    return Case(np.tile(triangle, (10_000, 1, 1)), origins, bell(rng, (n, 3)) * 0.1 - [0, 0, 1])


@family("coplanar", 14, "10,000 overlapping triangles in one plane", 500)
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = between(rng, -1, 1, (10_000, 1, 3)) + 0.05 * bell(rng, (10_000, 3, 3))
    triangles[:, :, 2] = 0.5
    origins = np.column_stack([between(rng, -1, 1, (n, 2)), np.full(n, 2)]).astype(np.float32)
    return Case(triangles, origins, bell(rng, (n, 3)) * 0.2 - [0, 0, 1])


@family("near-planes", 15, "two planes 1 to 8 float32 spacings apart")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = []
    for k in range(1, 9):
        x = 4.0 * (k - 1)
        for z in (np.float32(1), np.float32(1) + k * np.float32(2.0**-23)):
            triangles.append([[x - 1, -1, z], [x + 1, -1, z], [x, 2, z]])
    order = rng.permutation(16)    # the nearer plane has the lower index in some pairs only
    x = 4.0 * rng.integers(8, size=n)
    origins = np.column_stack([x + between(rng, -0.2, 0.2, n), between(rng, -0.2, 0.2, n),
                               chosen(rng, [0.0, 1.5], n)])
    along = np.column_stack([np.zeros((n, 2)), np.where(origins[:, 2] < 1, 1.0, -1.0)])
    return Case(np.float64(triangles)[order], origins, along, closed=True)


# Rows 16 to 20: odd directions -------------------------------------------------------------------

SIGNS = np.stack(np.meshgrid(*[[0.0, 1.0, -1.0]] * 3), -1).reshape(-1, 3)[1:]   # 26


@family("signed-zeros", 16, "the 26 directions with components 0, 1 and -1, zeros of both signs")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    triangles = lattice(8)
    signs = SIGNS[rng.integers(26, size=n)]
    zeros = np.where(rng.random((n, 3)) < 0.5, 0.0, -0.0)
    origins = (rng.integers(0, 64, (n, 3)) + 0.5) / 64
    return Case(triangles, origins, np.where(signs == 0, zeros, signs))


@family("slab-planes", 17, "origins on planes of boxes and cells, direction components 0")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    signs = SIGNS[rng.integers(26, size=n)]
    origins = rng.integers(-2, 19, (n, 3)) / 16
    origins = np.where(signs == 0, origins, origins + chosen(rng, [0, 1 / 64], (n, 3)))
    return Case(lattice(8), origins, signs)


@family("flat-box", 18, "flat scenes, rays along the normal of their box")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    axis = seed % 3
    triangles = np.roll(square(8) + [0, 0, 1.3125], axis, axis=2)
    origins = np.column_stack([rng.integers(-31, 32, (n, 2)) / 32, chosen(rng, [-3.0, 3.0], n)])
    along = np.column_stack([np.zeros((n, 2)), np.where(origins[:, 2] < 0, 1.0, -1.0)])
    return Case(triangles, np.roll(origins, axis, 1), np.roll(along, axis, 1), closed=True)


@family("denormals", 19, "direction components from 1e-38 to 1e-45")
def _(n: int, seed: int) -> Case:
    rng = np.random.default_rng(seed)
    case = make_case("signed-zeros", n, seed)
    tiny = binades(rng, 2.0 ** -149, 2.0 ** -126, (n, 3)) * chosen(rng, [-1, 1], (n, 3))
    return Case(case.triangles, case.origins,
                np.where(case.directions == 0, tiny, case.directions.astype(np.float64)))


@family("lengths", 20, "directions of length 1e-15 to 1e15")
def _(n: int, seed: int) -> Case:
    case = make_case("outside", n, seed)
    length = binades(np.random.default_rng(seed), 1e-15, 1e15, (n, 1))
    return Case(case.triangles, case.origins, unit(case.directions.astype(np.float64)) * length)
