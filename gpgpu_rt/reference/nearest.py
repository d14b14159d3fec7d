"""Reference tracer: nearest hits in float64 on the CPU, by brute force or with `ReferenceTree`.

The triangle test is by Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", JCGT 2(1),
2013. It moves, permutes and shears the vertices so that the ray lies on the z axis and z is the
direction's largest component. Three 2D edge functions then decide. Rounding may make an edge
function 0, but never gives it the wrong sign. The triangle on the other side of an edge has
exactly the negated edge function, so no ray passes between the two triangles.

The test departs from the paper in four points. It accepts triangles that face either way. It does
not fall back to a higher precision. The ray must also pass through the bounding box of the sheared
triangle: the edge functions of a tiny, distant triangle may round to zero, and zero counts as
either sign. The fourth point is t: the distance of the triangle's plane, clamped to the range of
the vertices' distances. The paper's interpolated depth is inexact near long thin triangles.
"""
from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..hits import INVALID, TRACED, Hits
from ..numerics.error_bounds import FLOAT64, bound_pairs
from ..numerics.plane import plane_distance
from ..numerics.public_call import public_call
from .exact import nearest_of_pairs
from .tree import ReferenceTree

_PAIRS = 1 << 19


@public_call
def trace(scene_or_triangles: Any, origins: np.ndarray, directions: np.ndarray,
          t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf, *,
          accelerated: bool = False, invalid: str = "raise") -> Hits:
    """Return nearest hits, with t, u and v in float64.

    Vertices, rays, t_min and t_max are rounded to float32 on entry; all arithmetic is float64. A
    triangle without area is never hit. Among triangles at equal t, the lowest index wins.

    Parameters
    ----------
    scene_or_triangles : Scene, or (m, 3, 3) array, world units
    origins, directions : (n, 3) or (h, w, 3), directions of any nonzero length
    t_min, t_max : a number, or a value per ray, in units of |direction|; both ends are included
    accelerated : whether to use a bounding volume tree, which gives the same bits faster
    invalid : for a ray with a NaN, an infinite coordinate or a zero direction: "raise" raises an
        error, and "miss" gives the ray status 1

    Raises
    ------
    ValueError
        shapes do not match, or a ray is invalid; the message names the first invalid ray
    """
    vertices = as_triangles(scene_or_triangles)
    shape = np.shape(origins)[:-1]
    origins, directions, t_min, t_max, valid = as_rays(origins, directions, t_min, t_max, invalid)
    n = len(origins)
    hits = Hits(t=np.full(n, np.inf), u=np.zeros(n), v=np.zeros(n),
                triangle=np.full(n, -1, np.int32),
                status=np.where(valid, TRACED, INVALID).astype(np.uint8), shape=shape)
    solid = np.flatnonzero(has_area(vertices))
    if not len(solid):
        return hits
    tree = ReferenceTree.of(vertices[solid]) if accelerated else None
    dominant = np.abs(directions).argmax(axis=1)
    for axis in range(3):
        rays = np.flatnonzero(valid & (dominant == axis))
        order = [(axis + 1) % 3, (axis + 2) % 3, axis]
        bundle = _Bundle(origins[rays][:, order], directions[rays][:, order],
                         t_min[rays], t_max[rays])
        corners = np.ascontiguousarray(vertices[solid][:, :, order].transpose(1, 2, 0))
        if tree is None:
            pairs = _all_pairs(len(rays), len(solid))
        else:
            pairs = tree.pairs(origins[rays], directions[rays], t_min[rays], bundle.limit)
        _nearest(hits, rays, solid, bundle, corners, pairs)
    return hits


@public_call
def settle(scene_or_triangles: Any, origins: np.ndarray, directions: np.ndarray, hits: Hits,
           t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf
           ) -> tuple[Hits, int]:
    """Use integers to decide the rays that float64 cannot decide, and return the hits of all rays.

    Error bounds of float64 tell which triangles may be a ray's nearest hit. A ray is doubtful if
    there are several such triangles, or if the only such triangle may be missed.
    `nearest_of_pairs` then chooses among these triangles. Copies of a triangle cause no doubt,
    because the lowest index wins.

    Parameters
    ----------
    scene_or_triangles, origins, directions, t_min, t_max : as for `trace`; invalid rays keep their
        hits
    hits : the result of `trace`, which is not modified

    Returns
    -------
    The hits, exact for the doubtful rays; and the number of doubtful rays.
    """
    vertices = as_triangles(scene_or_triangles)
    origins, directions, t_min, t_max, valid = as_rays(origins, directions, t_min, t_max, "miss")
    settled = Hits(**{name: array.copy() for name, array in hits.to_dict().items()},
                   shape=hits.shape)
    different = np.unique(vertices.reshape(-1, 9), axis=0, return_index=True)[1]
    different = np.sort(different[has_area(vertices[different])])
    rays = np.flatnonzero(valid)
    if not len(different) or not len(rays):
        return settled, 0
    ray, triangle, doubtful = _candidates(vertices, different, origins[rays], directions[rays],
                                          t_min[rays], t_max[rays])
    chosen = doubtful[ray]
    ones, place = np.unique(ray[chosen], return_inverse=True)
    ones = rays[ones]
    exact = nearest_of_pairs(vertices, place, triangle[chosen], origins[ones], directions[ones],
                             t_min[ones], t_max[ones])
    for name in ("t", "u", "v", "triangle"):
        getattr(settled, name)[ones] = getattr(exact, name)
    return settled, len(ones)


def _candidates(vertices: np.ndarray, different: np.ndarray, origins: np.ndarray,
                directions: np.ndarray, t_min: np.ndarray, t_max: np.ndarray
                ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the pairs in which the triangle may be the ray's nearest hit, as rays (k,) and
    triangles (k,); and whether the nearest hit of each ray is doubtful, (n,) bool."""
    limit = t_max.copy()        # upper bound of the nearest hit's t
    kept = []
    tree = ReferenceTree.of(vertices[different])
    for ray, some in tree.pairs(origins, directions, t_min, limit):
        triangle = different[some]
        pair = bound_pairs(vertices[triangle], origins[ray], directions[ray], FLOAT64)
        first, last = pair.t - pair.t_bound, pair.t + pair.t_bound
        may = pair.possible & (last >= t_min[ray]) & (first <= t_max[ray])
        sure = pair.inside & (first >= t_min[ray]) & (last <= t_max[ray])
        np.minimum.at(limit, ray[sure], last[sure])
        kept.append([a[may] for a in (ray, triangle, first, sure)])
    ray, triangle, first, sure = (np.concatenate(parts) for parts in
                                  (zip(*kept) if kept else [[np.zeros(0, np.int64)]] * 4))
    near = first <= limit[ray]
    ray, triangle, sure = ray[near], triangle[near], sure[near].astype(bool)
    doubtful = np.bincount(ray, minlength=len(origins)) > 1
    doubtful[ray[~sure]] = True
    return ray, triangle, doubtful


class _Bundle:
    """Rays in permuted axes, so that z is the largest component of each direction."""

    def __init__(self, origins: np.ndarray, directions: np.ndarray, t_min: np.ndarray,
                 t_max: np.ndarray) -> None:
        self.origins = np.ascontiguousarray(origins.T)
        with np.errstate(under="ignore"):
            self.shear = (directions[:, :2] / directions[:, 2:]).T.copy()
        self.directions = np.ascontiguousarray(directions.T)
        self.t_min, self.t_max = t_min, t_max
        self.limit = t_max.copy()       # t of the nearest hit so far; farther boxes are pruned


def _nearest(hits: Hits, rays: np.ndarray, solid: np.ndarray, bundle: _Bundle,
             corners: np.ndarray, pairs: Iterator[tuple[np.ndarray, np.ndarray]]) -> None:
    """Test the pairs of (ray, triangle) and store each ray's nearest hit in ``hits``. At equal t,
    the lowest index wins."""
    for ray, triangle in pairs:
        t, u, v, accepted = _intersect(bundle, corners, ray, triangle)
        found = np.flatnonzero(accepted)
        if not len(found):
            continue
        t, u, v = t[found], u[found], v[found]
        ray, triangle = ray[found], solid[triangle[found]]
        first = np.lexsort((triangle, t, ray))
        first = first[np.r_[True, np.diff(ray[first]) > 0]]
        ray, triangle, t, u, v = (a[first] for a in (ray, triangle, t, u, v))
        bundle.limit[ray] = np.minimum(bundle.limit[ray], t)
        ray = rays[ray]
        best, held = hits.t[ray], hits.triangle[ray]
        nearer = (held < 0) | (t < best) | ((t == best) & (triangle < held))
        ray = ray[nearer]
        hits.t[ray], hits.u[ray], hits.v[ray] = t[nearer], u[nearer], v[nearer]
        hits.triangle[ray] = triangle[nearer]


def _intersect(bundle: _Bundle, corners: np.ndarray, ray: np.ndarray, triangle: np.ndarray
               ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Apply the watertight test to each pair; return t, u, v, and whether the pair is a hit."""
    corners, direction = corners[:, :, triangle], bundle.directions[:, ray]
    seen = corners - bundle.origins[:, ray]
    x, y, z = seen.swapaxes(0, 1)
    x, y = (a - shear * z for a, shear in zip((x, y), bundle.shear[:, ray]))
    edge_0 = x[2] * y[1] - y[2] * x[1]
    edge_1 = x[0] * y[2] - y[0] * x[2]
    edge_2 = x[1] * y[0] - y[1] * x[0]
    inside = ((edge_0 >= 0) & (edge_1 >= 0) & (edge_2 >= 0)
              | (edge_0 <= 0) & (edge_1 <= 0) & (edge_2 <= 0))
    for a, b, c in (x, y):
        inside &= ((a <= 0) | (b <= 0) | (c <= 0)) & ((a >= 0) | (b >= 0) | (c >= 0))
    det = edge_0 + edge_1 + edge_2
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        b1, b2 = edge_1 / det, edge_2 / det
        depths = z / direction[2]
        plane = plane_distance(corners, seen, direction)
        t = np.fmin(np.fmax(plane, depths.min(axis=0)), depths.max(axis=0))
    accepted = inside & (det != 0) & (t >= bundle.t_min[ray]) & (t <= bundle.t_max[ray])
    return t, b1, b2, accepted


def _all_pairs(rays: int, triangles: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield all pairs of (ray, triangle) in batches of bounded size."""
    for start in range(0, rays * triangles, _PAIRS):
        yield np.divmod(np.arange(start, min(start + _PAIRS, rays * triangles)), triangles)


def has_area(vertices: np.ndarray) -> np.ndarray:
    """Return (m,) bool, whether each triangle of ``vertices`` (m, 3, 3) has a nonzero normal in
    float64."""
    normal = np.cross(vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0])
    return (normal != 0).any(axis=1)


def as_triangles(scene_or_triangles: Any) -> np.ndarray:
    """Return triangles (m, 3, 3), rounded to float32 and stored as float64.

    Parameters
    ----------
    scene_or_triangles : an object with ``triangles``, or (m, 3, 3) float

    Raises
    ------
    ValueError
        the shape is wrong, or a corner is not finite in float32
    """
    triangles = getattr(scene_or_triangles, "triangles", scene_or_triangles)
    with np.errstate(over="ignore"):
        triangles = np.asarray(triangles, np.float32).astype(np.float64)
    if triangles.shape[1:] != (3, 3):
        raise ValueError(f"triangles have shape {triangles.shape}; expected (m, 3, 3)")
    finite = np.isfinite(triangles).all(axis=(1, 2))
    if not finite.all():
        raise ValueError(f"triangle {int(np.argmin(finite))} has a corner that is not finite in "
                         "float32; repair, rescale or drop it")
    return triangles


def as_rays(origins: np.ndarray, directions: np.ndarray, t_min: float | np.ndarray,
            t_max: float | np.ndarray, invalid: str) -> tuple[np.ndarray, ...]:
    """Return origins (n, 3), directions (n, 3), t_min (n,) and t_max (n,) of rays, rounded to
    float32 and stored as float64; and (n,) bool, whether each ray is valid.

    Parameters
    ----------
    origins, directions : (n, 3) or (h, w, 3) float
    t_min, t_max : numbers, or a value per ray, in units of |direction|
    invalid : "raise" or "miss"

    Raises
    ------
    ValueError
        shapes do not match; or, with "raise", a ray is invalid
    """
    with np.errstate(over="ignore"):
        origins, directions = (np.asarray(a, np.float32).astype(np.float64)
                               for a in (origins, directions))
        t_min, t_max = (np.asarray(t, np.float32).astype(np.float64) for t in (t_min, t_max))
    if origins.shape != directions.shape or origins.ndim not in (2, 3) or origins.shape[-1] != 3:
        raise ValueError(f"origins {origins.shape} and directions {directions.shape}: both must "
                         "be (n, 3) or (h, w, 3)")
    if invalid not in ("raise", "miss"):
        raise ValueError(f"invalid={invalid!r}; give 'raise' or 'miss'")
    rays = origins.shape[:-1]
    t_min, t_max = (np.broadcast_to(t.reshape(rays) if t.size > 1 else t, rays).reshape(-1)
                    for t in (t_min, t_max))
    origins, directions = origins.reshape(-1, 3), directions.reshape(-1, 3)
    finite = np.isfinite(origins).all(axis=1) & np.isfinite(directions).all(axis=1)
    valid = (finite & (directions != 0).any(axis=1)) & ~np.isnan(t_min) & ~np.isnan(t_max)
    if invalid == "raise" and not valid.all():
        first = int(np.argmin(valid))
        raise ValueError(f"ray {first} is invalid: origin {origins[first]}, direction "
                         f"{directions[first]}, t in [{t_min[first]}, {t_max[first]}]; "
                         "drop it, or pass invalid='miss'")
    return origins, directions, t_min, t_max, valid
