"""Patches: divides triangles into patches, and computes the direct light at points."""
from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...scene.luminance import luminance

if TYPE_CHECKING:
    from ...tracer import Tracer

LIFT = 1e-4       # Offset of shadow rays from the surface, as a share of the scene's extent.
# Multiples of these steps, modulo 1, fill a cube and a square evenly (Roberts 2018). The steps are
# negative powers of the roots of x^4 = x + 1 and x^3 = x + 1.
SPREAD_3 = 1.2207440846057596 ** -np.arange(1.0, 4.0)
SPREAD_2 = 1.3247179572447460 ** -np.arange(1.0, 3.0)


def cuts_of(triangles: np.ndarray, longest: float) -> np.ndarray:
    """Return a number of parts, (n,) int, for each of (n, 3, 3) triangles. If every edge is cut
    into this many equal parts, no part is longer than ``longest``."""
    corners = np.asarray(triangles, np.float64)
    edges = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0)
    return np.maximum(np.ceil(edges / longest), 1).astype(int)


def divided(triangles: np.ndarray, longest: float) -> tuple[np.ndarray, np.ndarray]:
    """Divide each triangle into k^2 similar parts. k is the least number with which no edge of a
    part is longer than ``longest``.

    Parameters
    ----------
    triangles : (n, 3, 3)
    longest : the longest edge of a part, in units of the triangles

    Returns
    -------
    (m, 3, 3) float32 parts, and (m,) int, the triangle that each part comes from
    """
    corners, cuts = np.asarray(triangles, np.float64), cuts_of(triangles, longest)
    parts, parents = [], []
    for k in np.unique(cuts):
        rows = np.flatnonzero(cuts == k)
        weights = _weights(int(k))
        parts.append(np.einsum("pcw,nwx->npcx", weights, corners[rows]).reshape(-1, 3, 3))
        parents.append(np.repeat(rows, len(weights)))
    if not parts:
        return np.zeros((0, 3, 3), np.float32), np.zeros(0, int)
    return np.concatenate(parts).astype(np.float32), np.concatenate(parents)


def _weights(k: int) -> np.ndarray:
    """Return (k^2, 3, 3), the barycentric weights of the corners of each part."""
    i, j = (a.reshape(-1) for a in np.indices((k, k)))
    upright, turned = i + j < k, i + j < k - 1
    lower = np.stack([(i, j), (i + 1, j), (i, j + 1)])[..., upright]
    upper = np.stack([(i + 1, j), (i + 1, j + 1), (i, j + 1)])[..., turned]
    u, v = np.concatenate([lower, upper], axis=2).transpose(1, 2, 0) / k
    return np.stack([1 - u - v, u, v], axis=2)


def areas_and_normals(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the areas (n,) and unit normals (n, 3), float64, of (n, 3, 3) triangles; the normal
    of a triangle without area is zero."""
    v0, v1, v2 = triangles.astype(np.float64).transpose(1, 0, 2)
    normal = np.cross(v1 - v0, v2 - v0)
    twice = np.linalg.norm(normal, axis=1)
    return twice / 2, normal / np.where(twice > 0, twice, 1)[:, None]


def straight_light(tracer: Tracer, places: np.ndarray, normals: np.ndarray,
                   samples: int = 64) -> np.ndarray:
    """Return the irradiance at points from emitting triangles and point lights, with shadows.

    Parameters
    ----------
    tracer : the tracer of the scene
    places, normals : (n, 3) points, and unit normals on the side that is lit
    samples : the number of points on all emitting triangles together. Each of the ``places`` gets
        a shadow ray to each of these points

    Returns
    -------
    (n, 3) float64
    """
    scene = tracer.scene
    start = (places + LIFT * scene.extent * normals).astype(np.float32)
    found = np.zeros((len(places), 3))
    for light in scene.lights:
        to = np.asarray(light.position) - start
        cosine = (to * normals).sum(1) / np.maximum(np.linalg.norm(to, axis=1), 1e-30)
        found += _reaching(tracer, start, to, cosine)[:,
                                                      None] * np.pi * np.asarray(light.intensity)
    rows = scene.emitters
    if not len(rows):
        return found
    corners = scene.triangles[rows].astype(np.float64)
    area, facing = areas_and_normals(corners)
    emission = np.array([m.emission for m in scene.materials])[scene.material_of[rows]]
    power = area * luminance(emission)
    share = np.cumsum(power) / power.sum()
    for k in range(samples):             # trace a ray from each place to the same point
        pick, u, v = (0.5 + (k + 1) * SPREAD_3) % 1
        lamp = min(int(np.searchsorted(share, pick, side="right")), len(rows) - 1)
        root = np.sqrt(u)
        at = np.array([1 - root, root * (1 - v), root * v]) @ corners[lamp]
        to = at - start
        square = np.maximum((to * to).sum(1), 1e-30)
        cosines = (to * normals).sum(1) * np.abs(to @ facing[lamp]) / square ** 2
        density = power[lamp] / power.sum() / area[lamp]
        found += _reaching(tracer, start, to, cosines)[:,
                                                       None] * emission[lamp] / density / samples
    return found


def _reaching(tracer: Tracer, start: np.ndarray, to: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Return ``value``, (n,), but 0 where the value is negative or a triangle occludes the light
    at ``start`` + ``to``."""
    reaching = np.where(value > 0, value, 0.0)
    some = np.flatnonzero(reaching)
    if len(some):
        hidden = tracer.occluded(start[some], to[some], t_max=1 - 1e-4)
        reaching[some[hidden]] = 0
    return reaching
