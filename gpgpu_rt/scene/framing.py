"""Framing: chooses a camera and a light for a scene that declares none."""
from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from .camera import Camera, Vector
from .light import PointLight
from .sight import first_seen, shows_back

MARGIN = 0.08           # share of the picture's width and height that stays empty on each side
ALONG: Vector = (-0.45, -0.35, -1.0)    # view direction: the eye is above and to the right
INSIDE_FOV = 65.0       # degrees; wide enough to show most of a room from inside
_ROWS = 1 << 20         # points that are projected at a time, to bound the memory
# `inside` tests whether the 2^14 largest triangles hide 64 sampled triangles.
_LARGEST, _SAMPLE = 1 << 14, 64

# Candidate directions from the eye to the light, as (up, right, forward). If a triangle blocks the
# first direction, `beside` chooses the direction in which the light can be farthest from the eye.
_ASIDE = np.array([(0.9, -0.6, 0), (0.9, 0.6, 0), (0.4, -1, 0), (0.4, 1, 0), (0.2, -0.8, 0.6),
                   (0.2, 0.8, 0.6), (0.7, 0, 0.7), (1, 0, 0), (0.3, 0, 1)])
_CLEAR = 0.7            # a blocked light moves to this share of the distance to the blocker


def framed(points: np.ndarray, size: Sequence[int] = (1, 1), *, fov: float = 45.0,
           along: Vector = ALONG, margin: float = MARGIN) -> Camera:
    """Return the nearest camera that sees all points with a margin around them. The y axis is up.

    In at least one of the two image directions, the points touch the margins on both sides.

    Parameters
    ----------
    points : (n, 3) or (n, 3, 3), world units
    size : (width, height) of the picture in pixels; only the ratio matters
    fov : full vertical angle, degrees
    along : (3,), the view direction
    margin : share of the width and height that stays empty on each side, below 0.5
    """
    points = np.asarray(points).reshape(-1, 3)
    if not len(points):
        points = np.zeros((1, 3))
    lo, hi = points.min(axis=0).astype(np.float64), points.max(axis=0).astype(np.float64)
    whole = Camera.looking_at((lo, hi), fov=fov, along=along)
    right, up, forward = whole.basis(size)
    if not (hi > lo).any():
        return whole
    centre = (lo + hi) / 2
    # Half the width and half the height at depth 1 of the picture without its margins.
    steep = np.array([np.linalg.norm(right), np.linalg.norm(up)]) * (1 - 2 * margin)
    axes = np.stack([right / np.linalg.norm(right), up / np.linalg.norm(up)])
    sides = np.concatenate([axes / steep[:, None], -axes / steep[:, None]]) - forward
    reach = np.full(4, -np.inf)
    for first in range(0, len(points), _ROWS):
        reach = np.maximum(reach, ((points[first:first + _ROWS] - centre) @ sides.T).max(axis=0))
    away = (reach[:2] + reach[2:]) / 2
    offset = steep * (reach[:2] - reach[2:]) / 2
    eye = centre + offset @ axes - forward * away.max()
    target = eye + forward * max(away.max(), np.linalg.norm(hi - lo) / 2)
    return Camera(tuple(eye), tuple(target), fov=fov)


def beside(camera: Camera, triangles: np.ndarray | None = None) -> PointLight:
    """Return a light above the camera and to its left, so that shadows are visible. If a triangle
    hides this place from the camera, the light moves to another side or nearer to the camera.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units; None if no triangle can hide the light
    """
    distance = np.linalg.norm(np.subtract(camera.target, camera.eye))
    right, up, forward = camera.basis((1, 1))
    axes = np.stack([up / np.linalg.norm(up), right / np.linalg.norm(right), forward])
    ways = 0.5 * distance * _ASIDE @ axes
    chosen = ways[0]
    if triangles is not None and len(triangles):
        eye = np.asarray(camera.eye)
        length = np.linalg.norm(ways, axis=1)
        if first_seen(triangles, eye, ways[:1])[0][0] <= length[0]:
            clear = np.minimum(_CLEAR * first_seen(triangles, eye, ways)[0], length)
            best = int(np.argmax(clear))
            chosen = ways[best] * (clear[best] / length[best])
    return PointLight(tuple(np.add(camera.eye, chosen)))


def inside(triangles: np.ndarray, outside: Camera) -> Camera | None:
    """Return a camera inside the mesh if the mesh is a room; None for any other mesh, or if no
    tested place in the room is suitable.

    A mesh counts as a room if two conditions hold. First, more than 0.4 of the outside camera's
    rays that hit the mesh meet the back of a triangle. Second, more than 0.25 of the triangles are
    hidden from all six sides by the largest triangles, such as walls and table tops. The second
    condition excludes objects whose triangles face inwards. Each limit lies between the shares
    measured in rooms and the shares measured in objects.

    Parameters
    ----------
    triangles : (n, 3, 3) float32, world units
    outside : a camera that sees the whole mesh from outside
    """
    if not len(triangles):
        return None
    directions = outside.rays((8, 8))[1].reshape(-1, 3)
    edges = triangles[:, 1:].astype(np.float64) - triangles[:, :1]
    area = (np.cross(edges[:, 0], edges[:, 1]) ** 2).sum(axis=1)
    large = triangles
    if len(triangles) > _LARGEST:
        large = triangles[np.argpartition(area, -_LARGEST)[-_LARGEST:]]
    seen = first_seen(large, np.asarray(outside.eye), directions)[1]
    if 5 * shows_back(large, seen, directions).sum() <= 2 * max((seen >= 0).sum(), 1):
        return None
    lo = triangles.min(axis=(0, 1)).astype(np.float64)
    hi = triangles.max(axis=(0, 1)).astype(np.float64)
    if not _hides(triangles, large, lo, hi):
        return None
    best, deepest = None, 0.0
    for x, z in itertools.product((0.1, 0.3, 0.5, 0.7, 0.9), repeat=2):
        eye, target = lo + (hi - lo) * (x, 0.6, z), lo + (hi - lo) * (0.5, 0.35, 0.5)
        if (x, z) == (0.5, 0.5):
            continue
        camera = Camera(tuple(eye), tuple(target), fov=INSIDE_FOV)
        directions = camera.rays((5, 5))[1].reshape(-1, 3)
        distance, seen = first_seen(large, eye, directions)
        if 8 * ((seen < 0) | shows_back(large, seen, directions)).sum() > len(seen):
            continue
        depth = float(np.exp(np.log(np.minimum(distance, np.linalg.norm(hi - lo))).mean()))
        if depth > deepest:
            best, deepest = camera, depth
    return best


def _hides(triangles: np.ndarray, large: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> bool:
    """Return whether a mesh meets the second condition of `inside`, by a sample of triangles."""
    sample = np.linspace(0, len(triangles) - 1, min(len(triangles), _SAMPLE)).astype(np.int64)
    middle = triangles[sample].mean(axis=1, dtype=np.float64)
    hidden = np.ones(len(sample), bool)
    for along in ((1, 0.2, 0.3), (-1, 0.2, -0.3), (-0.3, 0.2, 1), (0.3, 0.2, -1), (0.1, 1, 0.1),
                  (0.1, -1, 0.1)):
        eye = (lo + hi) / 2 + np.array(along) * np.linalg.norm(hi - lo)
        way = middle - eye
        distance = first_seen(large, eye, way)[0]
        hidden &= distance < np.linalg.norm(way, axis=1) * (1 - 1e-3)
    return 4 * hidden.sum() > len(sample)
