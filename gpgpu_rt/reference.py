"""The oracle: nearest hits in float64 on the CPU, by brute force or through a tree of its own.

The triangle test is Woop, Benthin and Wald's, "Watertight Ray/Triangle Intersection", JCGT 2(1),
2013: vertices are moved to the ray's origin, permuted so that its longest component is z, sheared
onto the z axis, and three 2D edge functions decide. An edge function is a difference of two
products, so its sign is never wrong and it is exactly negated for the neighbour across the edge:
no ray is lost there. We accept both facings, and need no fallback to a higher precision.
"""
from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from .hits import INVALID, TRACED, Hits
from .reference_exact import trace_exact
from .reference_tree import ReferenceTree

__all__ = ["as_rays", "as_triangles", "has_area", "trace", "trace_exact"]

_PAIRS = 1 << 19


def trace(scene_or_triangles: Any, origins: np.ndarray, directions: np.ndarray,
          t_min: float | np.ndarray = 0.0, t_max: float | np.ndarray = np.inf, *,
          accelerated: bool = False, invalid: str = "raise") -> Hits:
    """Nearest hits, with t, u and v in float64.

    Vertices, rays, t_min and t_max are rounded to float32 on entry; what follows is float64.
    A triangle without area is never hit; of triangles at equal t the lowest index wins.

    Parameters
    ----------
    scene_or_triangles : Scene, or (m, 3, 3) array, world units
    origins, directions : (n, 3) or (h, w, 3), directions of any length but zero
    t_min, t_max : scalar or one a ray, in units of |direction|, both ends included
    accelerated : go through a bounding volume tree; the same bits, sooner
    invalid : "raise", or "miss" to give such a ray status 1

    Raises
    ------
    ValueError
        shapes that do not fit, or the first ray with a NaN or infinite entry or a zero direction
    """
    vertices = as_triangles(scene_or_triangles)
    origins, directions, t_min, t_max, valid = as_rays(origins, directions, t_min, t_max, invalid)
    n = len(origins)
    hits = Hits(t=np.full(n, np.inf), u=np.zeros(n), v=np.zeros(n),
                triangle=np.full(n, -1, np.int32),
                status=np.where(valid, TRACED, INVALID).astype(np.uint8))
    solid = np.flatnonzero(has_area(vertices))
    if not len(solid):
        return hits
    tree = ReferenceTree(vertices[solid]) if accelerated else None
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
            pairs = tree.pairs(origins[rays], directions[rays], t_min[rays], t_max[rays])
        _nearest(hits, rays, solid, bundle, corners, pairs)
    return hits


class _Bundle:
    """Rays whose longest component is z: origins, the shear, and the interval of t."""

    def __init__(self, origins: np.ndarray, directions: np.ndarray, t_min: np.ndarray,
                 t_max: np.ndarray) -> None:
        self.origins = np.ascontiguousarray(origins.T)
        with np.errstate(under="ignore"):
            self.shear = (directions[:, :2] / directions[:, 2:]).T.copy()
        self.inv_z = 1.0 / directions[:, 2]
        self.t_min, self.t_max = t_min, t_max


def _nearest(hits: Hits, rays: np.ndarray, solid: np.ndarray, bundle: _Bundle,
             corners: np.ndarray, pairs: Iterator[tuple[np.ndarray, np.ndarray]]) -> None:
    """Test the pairs of (ray, triangle) and keep each ray's nearest hit, lowest index first."""
    for ray, triangle in pairs:
        t, u, v, accepted = _intersect(bundle, corners, ray, triangle)
        found = np.flatnonzero(accepted)
        if not len(found):
            continue
        t, u, v = t[found], u[found], v[found]
        ray, triangle = rays[ray[found]], solid[triangle[found]]
        first = np.lexsort((triangle, t, ray))
        first = first[np.r_[True, np.diff(ray[first]) > 0]]
        ray, triangle, t, u, v = (a[first] for a in (ray, triangle, t, u, v))
        best, held = hits.t[ray], hits.triangle[ray]
        nearer = (held < 0) | (t < best) | ((t == best) & (triangle < held))
        ray = ray[nearer]
        hits.t[ray], hits.u[ray], hits.v[ray] = t[nearer], u[nearer], v[nearer]
        hits.triangle[ray] = triangle[nearer]


def _intersect(bundle: _Bundle, corners: np.ndarray, ray: np.ndarray, triangle: np.ndarray
               ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The watertight test of each pair: t, u, v, and whether it is a hit."""
    origin, shear = bundle.origins[:, ray], bundle.shear[:, ray]
    x, y, z = [], [], []
    for corner in corners:
        depth = corner[2][triangle] - origin[2]
        x.append((corner[0][triangle] - origin[0]) - shear[0] * depth)
        y.append((corner[1][triangle] - origin[1]) - shear[1] * depth)
        z.append(depth)
    edge_0 = x[2] * y[1] - y[2] * x[1]
    edge_1 = x[0] * y[2] - y[0] * x[2]
    edge_2 = x[1] * y[0] - y[1] * x[0]
    inside = ((edge_0 >= 0) & (edge_1 >= 0) & (edge_2 >= 0)
              | (edge_0 <= 0) & (edge_1 <= 0) & (edge_2 <= 0))
    det = edge_0 + edge_1 + edge_2
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        b0, b1, b2 = edge_0 / det, edge_1 / det, edge_2 / det
        t = (b0 * z[0] + b1 * z[1] + b2 * z[2]) * bundle.inv_z[ray]
    accepted = inside & (det != 0) & (t >= bundle.t_min[ray]) & (t <= bundle.t_max[ray])
    return t, b1, b2, accepted


def _all_pairs(rays: int, triangles: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Every (ray, triangle), a bounded number at a time."""
    for start in range(0, rays * triangles, _PAIRS):
        yield np.divmod(np.arange(start, min(start + _PAIRS, rays * triangles)), triangles)


def has_area(vertices: np.ndarray) -> np.ndarray:
    """(m,) bool, false where the normal is exactly zero in float64."""
    normal = np.cross(vertices[:, 1] - vertices[:, 0], vertices[:, 2] - vertices[:, 0])
    return (normal != 0).any(axis=1)


def as_triangles(scene_or_triangles: Any) -> np.ndarray:
    """A scene's or an array's triangles, (m, 3, 3), rounded to float32 and held in float64."""
    triangles = getattr(scene_or_triangles, "triangles", scene_or_triangles)
    triangles = np.asarray(triangles, np.float32).astype(np.float64)
    if triangles.shape[1:] != (3, 3):
        raise ValueError(f"triangles have shape {triangles.shape}; expected (m, 3, 3)")
    return triangles


def as_rays(origins: np.ndarray, directions: np.ndarray, t_min: float | np.ndarray,
            t_max: float | np.ndarray, invalid: str) -> tuple[np.ndarray, ...]:
    """Rays as (n, 3), (n, 3), (n,), (n,), rounded to float32 and held in float64, and (n,) bool
    for which of them are valid."""
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
