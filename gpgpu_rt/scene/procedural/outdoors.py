"""Outdoors: procedural scenes in a wide space, mostly with unevenly distributed triangles."""
from __future__ import annotations

import numpy as np

from ..camera import Camera
from .built import Built, Pieces
from .creatures import PORCELAIN, pot
from .painting import palette
from .shapes import ball, boxes, bump, floor, place, revolve, smooth, tube

GROUND, LEAF, BARK = (0.42, 0.40, 0.36), (0.24, 0.42, 0.16), (0.36, 0.25, 0.17)


def robots() -> Built:
    """Return a crowd of small, detailed robots in a wide street of plain houses: 71,708
    triangles."""
    rng = np.random.default_rng(3)
    pieces = Pieces()
    pieces.add(floor((-160, -400), (160, 250), 0.0, 2), GROUND)
    z = np.linspace(-390, 230, 20)
    for side in (-1, 1):
        lo = np.stack([np.where(side < 0, -150, 30) + 0 * z, 0 * z, z], 1)
        height = rng.uniform(40, 220, len(z))
        hi = lo + np.stack([0 * z + 120, height, 0 * z + 28], 1)
        pieces.add(boxes(lo, hi), palette(rng.integers(0, 12, len(z))) * 0.9)
    robot = np.concatenate([
        boxes((-0.4, 1.0, -0.25), (0.4, 1.9, 0.25)), ball(700, (0, 2.25, 0), (0.3, 0.32, 0.3)),
        *(tube([(s * 0.22, 1.0, 0), (s * 0.25, 0.5, 0.1), (s * 0.25, 0.0, 0)], 0.12, 40)
          for s in (-1, 1)),
        *(tube([(s * 0.4, 1.8, 0), (s * 0.7, 1.4, 0.1), (s * 0.6, 1.0, 0.3)], 0.09, 40)
          for s in (-1, 1)),
        *(ball(120, (s * 0.12, 2.3, 0.27), (0.07, 0.07, 0.07)) for s in (-1, 1))])
    count = 40
    where = np.stack([rng.uniform(-9, 9, count), np.zeros(count), -218 + rng.uniform(-14, 10,
                                                                                     count)], 1)
    pieces.add(place(robot, where, rng.uniform(-0.8, 0.8, count)),
               palette(rng.integers(0, 9, count)))
    camera = Camera((-1.0, 3.4, -198.0), (0.4, 1.7, -214.0), fov=45)
    return pieces.finish(71_708, camera, (20.0, 60.0, -180.0), (0.95, 0.92, 0.85))


def fairyforest() -> Built:
    """Return dense trees and mushrooms on a wide meadow: 174,117 triangles."""
    rng = np.random.default_rng(8)
    pieces = Pieces()
    ground = floor((-40, -40), (40, 40), 0.0, 60)
    ground[..., 1] += 0.25 * np.sin(ground[..., 0] * 0.4) * np.cos(ground[..., 2] * 0.3)
    pieces.add(ground, (0.30, 0.38, 0.18))
    trunk = tube([(0, -0.5, 0), (0.1, 2, 0), (0, 4, 0.1), (0, 6, 0)], (0.5, 0.35, 0.25, 0.05), 16)
    crown = bump(np.concatenate([ball(700, (0, 5.5, 0), (1.8, 1.6, 1.8)),
                                 ball(500, (0.9, 4.4, 0.5), (1.3, 1.0, 1.3)),
                                 ball(500, (-0.8, 4.6, -0.6), (1.3, 1.0, 1.3))]), 0.15, 0.9)
    count = 55
    where = np.stack([rng.uniform(-30, 30, count), np.zeros(count), rng.uniform(-38, 8, count)], 1)
    where[np.abs(where[:, 0]) < 3, 0] += 5
    size, yaw = rng.uniform(0.7, 1.3, count), rng.uniform(0, 6, count)
    pieces.add(place(trunk, where, yaw, size), BARK)
    pieces.add(place(crown, where, yaw, size), palette(rng.integers(0, 5, count)) * 0.3 + (
        0.08, 0.22, 0.02))
    mushroom = np.concatenate([tube([(0, 0, 0), (0, 0.2, 0), (0, 0.4, 0)], 0.07, 16),
                               revolve(smooth([(0.32, 0.34), (0.28, 0.48), (0, 0.6)], 12), 24)])
    count = 60
    near = np.stack([rng.uniform(-5, 5, count), np.full(count, 0.05), rng.uniform(0, 9, count)], 1)
    pieces.add(place(mushroom, near, 0.0, rng.uniform(0.4, 1.2, count)), (0.62, 0.18, 0.14))
    camera = Camera((0.5, 1.9, 13.5), (0.0, 2.2, 0.0), fov=52)
    return pieces.finish(174_117, camera, (12.0, 22.0, 16.0), (1.0, 0.95, 0.82))


def tenk() -> Built:
    """Return twenty-four balls on a floor: 10,000 triangles."""
    pieces = Pieces()
    pieces.add(floor((-6, -5), (6, 5), 0.0, 4), GROUND)
    x, z = (axis.reshape(-1) for axis in np.meshgrid(np.linspace(-5, 5, 6), np.linspace(-3.6, 3.6,
                                                                                        4)))
    where = np.stack([x, 0.7 + 0 * x, z], 1)
    pieces.add(place(ball(390), where, 0.0, np.full(24, 0.7)), palette(np.arange(24)))
    camera = Camera((-2.0, 6.5, 11.0), (0.0, 0.4, 0.0), fov=42)
    return pieces.finish(10_000, camera, (-6.0, 10.0, 7.0))


def stadium(ratio: float = 0.01) -> Built:
    """Return a teapot in the middle of a stadium: 8,000 triangles, a little over 6,000 of them in
    the teapot. The teapot is ``ratio`` times as large as the stadium; the teapot's size does
    not change."""
    pieces = Pieces()
    side = 6.4 / ratio
    tiers = revolve([(0.5 * side * (0.75 + 0.05 * k), side * 0.04 * (k // 2 + (k % 2)))
                     for k in range(6)], 64)
    pieces.add(tiers, (0.55, 0.53, 0.50))
    pieces.add(floor((-0.5 * side, -0.5 * side), (0.5 * side, 0.5 * side), -0.01, 1),
               (0.34, 0.50, 0.24))
    pieces.add(pot(5_000), PORCELAIN)
    camera = Camera((1.2, 5.2, 9.0), (0.2, 1.2, 0.0), fov=45)
    return pieces.finish(8_000, camera, (-5.0, 9.0, 6.0))
