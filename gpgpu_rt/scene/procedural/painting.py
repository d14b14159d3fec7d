"""Painting: makes colours for meshes without colours."""
from __future__ import annotations

import numpy as np

WHITE, RED, GREEN = (0.725, 0.71, 0.68), (0.63, 0.065, 0.05), (0.14, 0.45, 0.091)


def palette(index: np.ndarray) -> np.ndarray:
    """Return (n, 3) soft colours, different for consecutive indices."""
    turns = np.asarray(index)[..., None] * 0.618034 + (0.0, 0.31, 0.62)
    return 0.6 + 0.2 * np.cos(2 * np.pi * turns)


def by_part(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return (n, 3) colours of faces, one colour for each connected part. Vertices at the same
    position count as one vertex."""
    vertices = np.ascontiguousarray(vertices, np.float32) + np.float32(0)
    _, same = np.unique(vertices.view([("", np.float32)] * 3).reshape(-1), return_inverse=True)
    faces = same.reshape(-1)[faces]
    label = np.arange(len(vertices))
    while True:
        lowest = label[faces].min(axis=1)
        after = label.copy()
        for corner in faces.T:
            # A vertex's label is the lowest vertex index found in its part so far. Also lower the
            # label of the vertex that the corner's old label names: a long chain of triangles then
            # takes fewer iterations.
            np.minimum.at(after, label[corner], lowest)
            np.minimum.at(after, corner, lowest)
        while not np.array_equal(after, after[after]):
            after = after[after]
        if np.array_equal(after, label):
            break
        label = after
    _, part = np.unique(label[faces[:, 0]], return_inverse=True)
    return palette(part.reshape(-1))


def cornell_walls(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return (n, 3) colours of a Cornell box seen along -z: red on the left, green on the
    right."""
    x = vertices[faces, 0]
    margin = 0.03 * np.ptp(x)
    left = (x < x.min() + margin).all(axis=1)[:, None]
    right = (x > x.max() - margin).all(axis=1)[:, None]
    return np.where(left, RED, np.where(right, GREEN, WHITE))
