"""Overlay: project segments in space to the pixels of the picture."""
from __future__ import annotations

import numpy as np

from ..scene.camera import Camera


def projected(camera: Camera, size: tuple[int, int], segments: np.ndarray) -> np.ndarray:
    """Project segments to the picture of a camera.

    Parameters
    ----------
    camera : the camera
    size : (width, height) in pixels
    segments : (n, 2, 3), world units

    Returns
    -------
    (m, 2, 2) pixels from the upper left corner; parts behind the camera are cut off
    """
    right, up, forward = camera.basis(size)
    relative = np.asarray(segments, np.float64).reshape(-1, 2, 3) - np.asarray(camera.eye)
    depth = relative @ forward
    nearest = 1e-4 * np.linalg.norm(np.subtract(camera.target, camera.eye))
    seen = (depth > nearest).any(axis=1)
    relative, depth = relative[seen], depth[seen]
    # At the nearest visible depth, clip segments that reach behind the eye.
    change = depth[:, ::-1] - depth
    part = np.where(depth <= nearest, (nearest - depth) / np.where(change, change, 1), 0)
    relative = relative + part[..., None] * (relative[:, ::-1] - relative)
    depth = np.maximum(relative @ forward, nearest)
    x = relative @ right / (right @ right) / depth
    y = relative @ up / (up @ up) / depth
    return np.stack([(x + 1) / 2 * size[0], (1 - y) / 2 * size[1]], axis=-1)
