"""Refraction through a mesh in float64: the reference for image-space refraction."""
from __future__ import annotations

import numpy as np

from .nearest import trace


def refract(directions: np.ndarray, normals: np.ndarray, ratio: float
            ) -> tuple[np.ndarray, np.ndarray]:
    """Refract unit directions (n, 3) by Snell's law.

    Parameters
    ----------
    directions : (n, 3) unit directions of the incoming rays
    normals : (n, 3) unit normals on the incoming side
    ratio : the refractive index in front of the interface divided by the index behind

    Returns
    -------
    (n, 3) refracted directions, with mirrored directions under total reflection; and (n,) bool,
    whether reflection is total
    """
    cosine = -(directions * normals).sum(1)
    rest = 1 - ratio ** 2 * (1 - cosine ** 2)
    total = rest < 0
    through = ratio * directions + \
        (ratio * cosine - np.sqrt(np.maximum(rest, 0)))[:, None] * normals
    mirrored = directions + 2 * cosine[:, None] * normals
    return np.where(total[:, None], mirrored, through), total


def through_two_borders(triangles: np.ndarray, normals: np.ndarray, origins: np.ndarray,
                        directions: np.ndarray, ior: float
                        ) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions of rays after two refractions: into a mesh and out of it.

    Parameters
    ----------
    triangles, normals : (m, 3, 3), a closed mesh, and unit normals of its corners
    origins, directions : (n, 3), rays that start outside the mesh
    ior : the refractive index inside the mesh divided by the refractive index outside

    Returns
    -------
    (n, 3) float64 unit directions; and (n,) int: 0 if the ray hits nothing, 1 if it is refracted
    at both interfaces, 2 if it finds no second interface, 3 if an interface reflects it totally
    """
    size = float(np.ptp(triangles.reshape(-1, 3), axis=0).max())
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    kind = np.zeros(len(origins), int)
    first, place, normal = _meet(triangles, normals, origins, directions)
    found = directions.copy()
    found[first], total = refract(directions[first], normal, 1 / ior)
    kind[first] = np.where(total, 3, 2)
    within, place = np.flatnonzero(first)[~total], place[~total]
    inside = found[within]
    second, _, normal = _meet(triangles, normals, place + 1e-5 * size * inside, inside)
    rays = within[second]
    found[rays], total = refract(inside[second], -normal, ior)
    kind[rays] = np.where(total, 3, 1)
    return found, kind


def _meet(triangles: np.ndarray, normals: np.ndarray, origins: np.ndarray, directions: np.ndarray
          ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (n,) bool, whether each ray hits the mesh; and for rays that hit, the hit points and
    the interpolated unit normals."""
    hits = trace(triangles, origins, directions, accelerated=True)
    hit = hits.triangle >= 0
    weights = np.stack([1 - hits.u - hits.v, hits.u, hits.v], axis=1)[hit]
    at = hits.triangle[hit]
    normal = (weights[:, :, None] * normals[at].astype(np.float64)).sum(1)
    place = (weights[:, :, None] * triangles[at].astype(np.float64)).sum(1)
    return hit, place, normal / np.linalg.norm(normal, axis=1, keepdims=True)
