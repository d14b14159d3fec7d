"""Bounds: the boxes of triangles and of the scene, and the padding that all builders use."""
from __future__ import annotations

import numpy as np

from ..errors import SceneError

# Builders widen boxes by this share of the scene's largest absolute coordinate. This padding is 8
# to 17 float32 spacings of the coordinate. A hit point in a shader has a smaller rounding error,
# so each hit lies inside a padded box.
PADDING = 1e-6
AT_ONCE = 1 << 18   # triangles that are converted to float64 together


def largest(values: np.ndarray) -> np.ndarray:
    """Return the maximum of (3, ...) values along the first axis. This is faster than numpy's
    reduction, which is slow along short axes."""
    return np.maximum(np.maximum(values[0], values[1]), values[2])


def as_triangles(triangles: np.ndarray) -> np.ndarray:
    """Return the triangles as a contiguous (n, 3, 3) float32 array.

    Raises
    ------
    SceneError
        the shape is not (n, 3, 3), or a coordinate is not finite; the message names the first
        triangle with such a coordinate
    """
    triangles = np.ascontiguousarray(triangles, dtype=np.float32)
    if triangles.size == 0:
        return np.zeros((0, 3, 3), np.float32)
    if triangles.ndim != 3 or triangles.shape[1:] != (3, 3):
        raise SceneError(f"triangles have shape {triangles.shape}; pass an (n, 3, 3) array")
    finite = np.isfinite(triangles).all(axis=(1, 2))
    if not finite.all():
        first = int(np.argmin(finite))
        raise SceneError(f"triangle {first} has a coordinate that is not finite; repair the mesh")
    return triangles


def shrink_flat(triangles: np.ndarray) -> np.ndarray:
    """Return (n, 3, 3) float32 triangles; a triangle without area is shrunk to its first corner.

    When the watertight test shears three collinear corners, rounding may move a corner off the
    line, and a ray could hit the triangle. If all three corners are equal, the determinant in
    every triangle test is exactly zero, so no ray hits the triangle.
    """
    flat = np.concatenate([_without_area(triangles[start:start + AT_ONCE])
                           for start in range(0, max(len(triangles), 1), AT_ONCE)])
    if not flat.any():
        return triangles
    shrunk = triangles.copy()
    shrunk[flat] = triangles[flat, :1]
    return shrunk


def _without_area(triangles: np.ndarray) -> np.ndarray:
    v0, v1, v2 = triangles.astype(np.float64).transpose(1, 0, 2)
    return (np.cross(v1 - v0, v2 - v0) == 0).all(axis=1)


def padding(triangles: np.ndarray) -> np.float32:
    """Return the distance by which builders widen every box of this scene, world units."""
    largest = float(np.abs(triangles).max()) if len(triangles) else 0.0
    return np.float32(max(PADDING * (largest or 1.0), 1e-37))


def triangle_boxes(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corners of the triangles' boxes, (3, n) contiguous float32."""
    a, b, c = triangles[:, 0].T, triangles[:, 1].T, triangles[:, 2].T
    lo = np.minimum(np.minimum(a, b), c)
    hi = np.maximum(np.maximum(a, b), c)
    return np.ascontiguousarray(lo), np.ascontiguousarray(hi)


def scene_box(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corner of the scene's box, (3,) float32 each.

    The scene's box is wider than the triangles by twice the padding, so it contains the padded box
    of each triangle. Without triangles, the scene's box is the unit box.
    """
    if len(triangles) == 0:
        return np.zeros(3, np.float32), np.ones(3, np.float32)
    corners = triangles.reshape(-1, 3)
    pad = 2 * padding(triangles)
    return corners.min(axis=0) - pad, corners.max(axis=0) + pad


def half_area(lo: np.ndarray, hi: np.ndarray, axis: int = 0) -> np.ndarray:
    """Return half the surface area of boxes; 0 for an empty box. x, y and z lie along the array
    axis `axis` of lo and hi."""
    size = np.maximum(np.moveaxis(hi - lo, axis, 0), 0)
    return size[0] * size[1] + size[1] * size[2] + size[2] * size[0]


def unit_normals(corners: np.ndarray) -> np.ndarray:
    """Return (k, 3) float32 unit normals of triangles (k, 3, 3)."""
    v0, v1, v2 = corners.astype(np.float64).transpose(1, 0, 2)
    return unit_vectors(np.cross(v1 - v0, v2 - v0)).astype(np.float32)


def unit_vectors(vectors: np.ndarray) -> np.ndarray:
    """Return (n, 3) vectors scaled to length 1; (0, 0, 1) for a vector of length 0."""
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(length > 0, vectors / np.where(length > 0, length, 1), (0.0, 0.0, 1.0))
