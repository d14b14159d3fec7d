"""Images: built-in scenes that are geometry images of one or several charts."""
from __future__ import annotations

import itertools

import numpy as np

from ...accel.image_cells import cell_faces
from ..camera import Camera
from .built import Built
from .shapes import noise

STONE, BRASS = (0.58, 0.55, 0.50), (0.72, 0.56, 0.28)
PAINT, RUBBER = (0.62, 0.10, 0.09), (0.10, 0.10, 0.11)


def boulder() -> Built:
    """Return a closed rock of six charts: 49,152 triangles. The charts are the sides of a cube,
    projected to a sphere and displaced; neighbouring charts have bit-identical borders."""
    cells = 64
    along = 2 * np.arange(cells + 1) - cells
    charts = []
    for axis, side in itertools.product(range(3), (-cells, cells)):
        # Order rows and columns so that the triangles face outwards.
        one, two = ((axis + 1) % 3, (axis + 2) % 3)[::1 if side < 0 else -1]
        chart = np.empty((cells + 1, cells + 1, 3), np.int64)
        chart[..., axis], chart[..., one], chart[..., two] = side, along[:, None], along
        charts.append(chart)
    # Compute each border point once, for all charts that share it.
    lattice, place = np.unique(np.reshape(charts, (-1, 3)), axis=0, return_inverse=True)
    points = np.tan(lattice / cells * (np.pi / 4))
    points /= np.linalg.norm(points, axis=1, keepdims=True)
    points *= (1 + 0.07 * noise(points, 0.9, 5) + 0.015 * noise(points, 0.25, 6))[:, None]
    points[:, 1] *= 0.8
    shapes = ((cells + 1, cells + 1),) * 6
    camera = Camera((1.6, 1.4, 2.9), (0.0, 0.0, 0.0), fov=42)
    return Built(_triangles(points[place.reshape(-1)], shapes), np.array(STONE), camera,
                 (-1.5, 4.0, 3.0), charts=shapes)


def knot() -> Built:
    """Return a swept trefoil knot: one chart, closed in both directions, of 36,864 triangles."""
    rows, columns = 384, 48
    t = 2 * np.pi * np.arange(rows + 1) / rows
    t[-1] = 0
    ring = np.stack([np.cos(2 * t), 0 * t, np.sin(2 * t)], axis=1)
    out = np.cos(3 * t)[:, None] * ring + np.sin(3 * t)[:, None] * (0.0, 1.0, 0.0)
    path = ring + 0.45 * out
    ahead = np.roll(path[:-1], -1, axis=0) - np.roll(path[:-1], 1, axis=0)
    ahead = np.concatenate([ahead, ahead[:1]])
    aside = np.cross(ahead, out)
    aside /= np.linalg.norm(aside, axis=1, keepdims=True)
    angle = 2 * np.pi * np.arange(columns + 1) / columns
    angle[-1] = 0
    radius = 0.2 * (1 + 0.12 * np.cos(6 * angle))[:, None]
    points = path[:, None] + radius * (np.cos(angle)[:, None] * out[:, None]
                                       + np.sin(angle)[:, None] * aside[:, None])
    points[-1], points[:, -1] = points[0], points[:, 0]
    points[-1, -1] = points[0, 0]
    shapes = ((rows + 1, columns + 1),)
    camera = Camera((0.6, 3.0, 3.4), (0.0, -0.05, 0.0), fov=46)
    return Built(_triangles(points.reshape(-1, 3), shapes), np.array(BRASS), camera,
                 (-2.0, 5.0, 2.0), charts=shapes)


def car() -> Built:
    """Return a car of five charts, its body and four wheels: 16,384 triangles. The wheels are not
    connected to the body, so no single geometry image can hold the car."""
    along = np.linspace(0.0, 1.0, 65)
    width = 0.85 * np.sin(np.pi * along) ** 0.25
    bonnet = 0.35 * np.sin(np.pi * along) ** 0.4
    cabin = 0.42 / (1 + np.exp(-40 * (along - 0.22))) / (1 + np.exp(40 * (along - 0.66)))
    top = bonnet + cabin * np.sin(np.pi * along)
    around = _closed_angles(64)
    side, up = (np.sign(wave) * np.abs(wave) ** 0.5 for wave in (np.cos(around), np.sin(around)))
    # Below y = 0.5, the cross section is shallow. Above, it reaches up to the bonnet or the roof.
    reach = np.where(up < 0, 0.22 * np.sin(np.pi * along)[:, None] ** 0.25, top[:, None])
    body = np.stack([width[:, None] * side * np.where(up > 0, 1 - 0.25 * up, 1),
                     0.5 + reach * up, (4.0 * along[:, None] - 2.0) + 0 * side], axis=2)
    body[[0, -1], :, 0], body[[0, -1], :, 1] = 0.0, 0.5
    profile = np.array([(0.0, -0.06), (0.2, -0.06), (0.24, -0.12), (0.33, -0.1), (0.34, 0.0),
                        (0.33, 0.1), (0.24, 0.12), (0.2, 0.06), (0.0, 0.06)])
    at = np.linspace(0.0, len(profile) - 1, 17)
    radius, over = (np.interp(at, np.arange(len(profile)), one) for one in profile.T)
    turn = _closed_angles(64)
    wheel = np.stack([over[:, None] + 0 * turn, radius[:, None] * np.cos(turn),
                      radius[:, None] * np.sin(turn)], axis=2)
    wheels = [wheel + (x, 0.34, z) for x in (-0.78, 0.78) for z in (-1.25, 1.2)]
    charts = [body, *wheels]
    shapes = tuple((len(chart), chart.shape[1]) for chart in charts)
    triangles = _triangles(np.concatenate([chart.reshape(-1, 3) for chart in charts]), shapes)
    painted = 2 * (shapes[0][0] - 1) * (shapes[0][1] - 1)
    colours = np.where(np.arange(len(triangles))[:, None] < painted, PAINT, RUBBER)
    return Built(triangles, colours, Camera((3.6, 2.1, 3.9), (0.0, 0.5, 0.0), fov=40),
                 (2.0, 5.0, 3.0), charts=shapes)


def _closed_angles(steps: int) -> np.ndarray:
    """Return the angles of a full turn, (steps + 1,) radians; the last angle equals the first."""
    angles = 2 * np.pi * np.arange(steps + 1) / steps
    angles[-1] = 0
    return angles


def _triangles(points: np.ndarray, shapes: tuple[tuple[int, int], ...]) -> np.ndarray:
    return points.astype(np.float32)[cell_faces(shapes)]
