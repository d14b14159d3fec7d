"""Sketch: draws a small picture of a scene in milliseconds, from points on the triangles."""
from __future__ import annotations

import numpy as np
from PIL import Image

from ..views import SIDE, stride
from .camera import Camera

MOST_TRIANGLES, POINTS = 1 << 16, 1 << 15
_SIZE = (SIDE, SIDE * 3 // 4)
_AMBIENT = 0.25     # brightness of a surface that the camera sees edge on
_BLANK = 255        # grey level behind the scene
_WIDEST = 8         # largest side of the square that a point covers, in pixels
_OVERLAP = 1.5      # side of a point's square / distance between neighbouring points
# Multiples of these numbers, modulo 1, fill the unit square evenly (Roberts 2018).
_STEPS = np.array([[0.7548776662466927], [0.5698402909980532]])


def sketch(triangles: np.ndarray, colours: np.ndarray, camera: Camera) -> Image.Image:
    """Return a picture of triangles, lit from the camera. A large mesh is drawn from a sample of
    its triangles.

    Parameters
    ----------
    triangles : (n, 3, 3) float, world units
    colours : (n, 3) float in [0, 1]
    """
    width, height = _SIZE
    step = stride(len(triangles), MOST_TRIANGLES)
    points, normals, rows, spacing = _points(triangles[::step].astype(np.float64))
    right, up, forward = camera.basis(_SIZE)
    away = points - np.asarray(camera.eye)
    depth = away @ forward
    with np.errstate(all="ignore"):     # a depth of 0 divides by zero; ``seen`` drops such points
        facing = np.abs((away * normals).sum(1)) / np.linalg.norm(away, axis=1)
        x = (away @ right / (right @ right) / depth + 1) * width / 2
        y = (1 - away @ up / (up @ up) / depth) * height / 2
        side = np.ceil(_OVERLAP * spacing / depth * height / 2 / np.linalg.norm(up))
        seen = (depth > 0) & (x >= 0) & (x < width) & (y >= 0) & (y < height)
    order = np.flatnonzero(seen)[np.argsort(-depth[seen], kind="stable")]
    shade = _AMBIENT + (1 - _AMBIENT) * facing[order, None]
    grey = np.round(255 * np.sqrt(shade * colours[::step][rows[order]])).astype(np.uint8)
    side, depth = np.clip(side[order], 1, _WIDEST).astype(int), depth[order]
    x, y = x[order].astype(int) - side // 2, y[order].astype(int) - side // 2
    pixels = np.full((height, width, 3), _BLANK, np.uint8)
    nearest = np.full((height, width), np.inf)
    for dx, dy in np.ndindex(_WIDEST, _WIDEST):
        use = np.flatnonzero((side > dx) & (side > dy) & (x + dx >= 0) & (x + dx < width)
                             & (y + dy >= 0) & (y + dy < height))
        use = use[depth[use] < nearest[y[use] + dy, x[use] + dx]]
        # Far points come first, so the nearest point of a pixel is assigned last and stays.
        at = y[use] + dy, x[use] + dx
        pixels[at], nearest[at] = grey[use], depth[use]
    return Image.fromarray(pixels)


def _points(triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Return POINTS points spread over the triangles, the unit normal and the row of each point's
    triangle, and the distance between neighbouring points."""
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    size = np.linalg.norm(cross, axis=1)
    sums = np.cumsum(size)
    if not size.sum() > 0:
        return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, int), 0.0
    rows = np.searchsorted(sums, (np.arange(POINTS) + 0.5) / POINTS * sums[-1])
    u, v = (np.arange(1, POINTS + 1) * _STEPS % 1)[..., None]
    u, v = np.where(u + v > 1, 1 - u, u), np.where(u + v > 1, 1 - v, v)
    a, b, c = triangles[rows].transpose(1, 0, 2)
    return (a + u * (b - a) + v * (c - a), cross[rows] / size[rows, None], rows,
            float(np.sqrt(sums[-1] / 2 / POINTS)))
