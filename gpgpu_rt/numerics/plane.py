"""Plane: computes the distance of a triangle's plane along a ray, in numpy.

The code is ``plane_distance`` of ``glsl/core/watertight.glsl``, operation for operation.

The normal is the cross product of the two shorter edges. In a long and thin triangle, the longest
edge may be almost parallel to another edge. The product of these edges has few correct digits.
"""
from __future__ import annotations

from collections.abc import Callable

import numpy as np

Rounding = Callable[[np.ndarray], np.ndarray]

# The two axes of each component of a cross product.
CROSS = ((1, 2), (2, 0), (0, 1))


def kept(values: np.ndarray) -> np.ndarray:
    """Return the values unchanged. This default of ``R`` keeps numpy's rounding."""
    return values


def edges_of(corners: np.ndarray, R: Rounding = kept) -> np.ndarray:
    """Return the edges of k triangles, (3, 3, k), from corners (3 corners, 3 axes, k). Edge i is
    opposite to corner i."""
    return R(corners[[2, 0, 1]] - corners[[1, 2, 0]])


def longest(edges: np.ndarray) -> np.ndarray:
    """Return the index of each triangle's longest edge in the maximum norm, (k,)."""
    return np.abs(edges).max(axis=1).argmax(axis=0)


def shorter(edges: np.ndarray, index: np.ndarray | int) -> tuple[np.ndarray, np.ndarray]:
    """Return the two edges of each triangle other than the edge ``index``, (3, k) each."""
    return np.where(index == 0, edges[1], edges[0]), np.where(index == 2, edges[1], edges[2])


def plane_distance(corners: np.ndarray, seen: np.ndarray, directions: np.ndarray,
                   R: Rounding = kept) -> np.ndarray:
    """Return the distances of planes along rays, in units of the directions' lengths.

    A distance is not finite where the direction lies in the plane. The result equals the shader's
    if the direction is largest in the last axis.

    Parameters
    ----------
    corners : (3 corners, 3 axes, k)
    seen : (3 corners, 3 axes, k), the corners relative to the rays' origins
    directions : (3, k)
    R : rounds the result of each operation
    """
    edges = edges_of(corners, R)
    index = longest(edges)
    a, b = shorter(edges, index)
    normal = np.stack([R(R(a[i] * b[j]) - R(a[j] * b[i])) for i, j in CROSS])
    inverse = R(1 / _dot(directions, normal, R))
    apex = np.where(index == 0, seen[0], np.where(index == 1, seen[1], seen[2]))
    return _dot(apex, R(normal * inverse), R)


def _dot(a: np.ndarray, b: np.ndarray, R: Rounding) -> np.ndarray:
    products = R(a * b)
    return R(R(products[0] + products[1]) + products[2])
