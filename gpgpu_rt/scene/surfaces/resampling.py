"""Resampling: samples a flattened surface at the texels of an image."""
from __future__ import annotations

import numpy as np

from ...accel.runs import expand, owners
from .surface_mesh import SurfaceMesh


def rasterised(flat: np.ndarray, mesh: SurfaceMesh, size: int) -> np.ndarray:
    """Return the position of the surface at every texel, (size + 1, size + 1, 3) float64,
    interpolated in the triangle that contains the texel.

    Parameters
    ----------
    flat : (v, 2), row and column of each vertex
    mesh : the surface
    size : cells along a side of the image
    """
    corners = flat[mesh.faces]
    slack = 1e-9 * size
    lo = np.clip(np.ceil(corners.min(axis=1) - slack), 0, size).astype(np.int64)
    hi = np.clip(np.floor(corners.max(axis=1) + slack), 0, size).astype(np.int64)
    rows, columns = np.maximum(hi - lo + 1, 0).T
    face = owners(rows * columns)      # pairs of a triangle and a texel in its bounding box
    within = expand(np.zeros(len(rows), np.int64), rows * columns)
    at = lo[face] + np.stack([within // columns[face], within % columns[face]], axis=1)
    p, q, r = (corners[face, k] - at for k in range(3))
    areas = np.stack([cross(q, r), cross(r, p), cross(p, q)], axis=1)
    whole = areas.sum(axis=1)
    usable = np.abs(whole) > 1e-14 * size**2
    weights = areas[usable] / whole[usable, None]
    face, texel = face[usable], (at[usable] * (size + 1, 1)).sum(axis=1)
    # For each texel, choose the triangle whose smallest barycentric weight is largest. A texel on
    # an edge then always gets a triangle, even if rounding makes a weight negative.
    order = np.lexsort((weights.min(axis=1), texel))
    last = np.append(texel[order][1:] != texel[order][:-1], True)
    chosen = order[last[:len(order)]]
    chosen = chosen[weights[chosen].min(axis=1) > -1e-6]
    image = np.zeros(((size + 1) ** 2, 3))
    image[texel[chosen]] = (weights[chosen, :, None]
                            * mesh.vertices[mesh.faces[face[chosen]]]).sum(axis=1)
    missing = np.setdiff1d(np.arange(len(image)), texel[chosen])
    if len(missing):    # a texel outside the embedding gets the position of the nearest vertex
        image[missing] = mesh.vertices[_nearest(flat, np.stack(np.divmod(missing, size + 1), 1))]
    return image.reshape(size + 1, size + 1, 3)


def cross(p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return (k,) the z component of the cross products of (k, 2) vectors."""
    return p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]


def _nearest(flat: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return (k,) the vertex nearest to each of (k, 2) positions."""
    return np.concatenate([np.argmin(((flat - place) ** 2).sum(axis=2), axis=1) for place in
                           np.array_split(places[:, None], len(places) // 64 + 1)])
