"""Rooms: procedural interiors, seen from inside, with large walls around smaller objects."""
from __future__ import annotations

import numpy as np

from ..camera import Camera
from .built import Built, Pieces
from .painting import palette
from .shapes import ball, boxes, place, revolve, smooth, tube

WALL, FLOOR, CEILING, WOOD, STEEL = ((0.72, 0.70, 0.64), (0.46, 0.36, 0.28), (0.78, 0.78, 0.76),
                                     (0.50, 0.34, 0.21), (0.55, 0.58, 0.62))


def _shell(pieces: Pieces, lo: tuple[float, float, float], hi: tuple[float, float, float]) -> None:
    """Add walls, floor and ceiling as slabs just outside the box [lo, hi]."""
    (x0, y0, z0), (x1, y1, z1) = lo, hi
    pieces.add(boxes((x0, y0 - 0.1, z0), (x1, y0, z1)), FLOOR)
    pieces.add(boxes((x0, y1, z0), (x1, y1 + 0.1, z1)), CEILING)
    pieces.add(boxes([(x0 - 0.1, y0, z0), (x1, y0, z0), (x0, y0, z0 - 0.1), (x0, y0, z1)],
                     [(x0, y1, z1), (x1 + 0.1, y1, z1), (x1, y1, z0), (x1, y1, z1 + 0.1)]), WALL)


def kitchen() -> Built:
    """Return a room with counters, a table, and crockery on every shelf: 110,561 triangles."""
    rng = np.random.default_rng(11)
    pieces = Pieces()
    _shell(pieces, (0, 0, 0), (8, 4, 8))
    fronts = np.arange(0.0, 7.9, 0.8)
    low = np.stack([fronts, 0 * fronts, 0 * fronts], 1)
    pieces.add(boxes(low, low + (0.78, 1.0, 0.9)), palette(np.zeros(len(low))))
    pieces.add(boxes((0, 1.0, 0), (8, 1.06, 0.95)), STEEL)
    pieces.add(boxes((0, 2.2, 0), (8, 2.25, 0.5)), WOOD)
    pieces.add(boxes((0, 2.9, 0), (8, 2.95, 0.5)), WOOD)
    pieces.add(boxes((2.8, 0.95, 3.2), (5.6, 1.05, 5.0)), WOOD)
    legs = np.array([(2.9, 0, 3.3), (5.4, 0, 3.3), (2.9, 0, 4.8), (5.4, 0, 4.8)])
    pieces.add(boxes(legs, legs + (0.12, 0.95, 0.12)), WOOD)
    plate = revolve(smooth([(0, 0), (0.10, 0.0), (0.17, 0.03)], 8), 24)
    cup = revolve(smooth([(0, 0), (0.06, 0), (0.08, 0.08), (0.075, 0.16)], 12), 24)
    bottle = revolve(smooth([(0, 0), (0.08, 0), (0.08, 0.25), (0.03, 0.36), (0.03, 0.45)], 14), 24)
    fruit = ball(500, (0, 0.08, 0), (0.08, 0.08, 0.08))
    for thing, count in ((plate, 50), (cup, 60), (bottle, 36), (fruit, 40)):
        on_table = rng.uniform((2.9, 1.05, 3.3), (5.4, 1.05, 4.8), (count // 3, 3))
        shelf = rng.uniform((0.2, 0, 0.15), (7.8, 0, 0.4), (count - len(on_table), 3))
        shelf[:, 1] = rng.choice((1.06, 2.25, 2.95), len(shelf))
        where = np.concatenate([on_table, shelf])
        pieces.add(place(thing, where, rng.uniform(0, 6, count)),
                   palette(rng.integers(0, 9, count)))
    lamp = revolve(smooth([(0.02, 0.5), (0.05, 0.3), (0.32, 0.0)], 20), 60)
    pieces.add(place(lamp, np.array([(3.4, 2.9, 4.1), (5.0, 2.9, 4.1)])), STEEL)
    camera = Camera((7.3, 2.7, 7.4), (3.4, 1.1, 2.2), fov=50)
    return pieces.finish(110_561, camera, (5.2, 3.7, 5.6), (0.95, 0.9, 0.8))


def conference() -> Built:
    """Return a room with a long table, rows of cushioned chairs, lamps and shelves: 282,641
    triangles."""
    pieces = Pieces()
    _shell(pieces, (0, 0, 0), (16, 4, 10))
    pieces.add(boxes((3.5, 0.9, 3.6), (12.5, 1.0, 6.4)), WOOD)
    pieces.add(boxes([(4.5, 0, 4.6), (11, 0, 4.6)], [(5, 0.9, 5.4), (11.5, 0.9, 5.4)]), WOOD)
    chair = np.concatenate([
        ball(2_400, (0, 0.52, 0), (0.34, 0.09, 0.34)), ball(2_400, (0, 0.95, -0.32),
                                                            (0.32, 0.34, 0.07)),
        tube([(-0.34, 0.5, -0.2), (-0.4, 0.75, 0), (-0.34, 0.72, 0.25)], 0.03, 24),
        tube([(0.34, 0.5, -0.2), (0.4, 0.75, 0), (0.34, 0.72, 0.25)], 0.03, 24),
        tube([(0, 0.03, 0), (0, 0.25, 0), (0, 0.5, 0)], 0.04, 24),
        *(tube([(0, 0.05, 0), (0.3 * np.cos(a), 0.03, 0.3 * np.sin(a))], 0.03, 12)
          for a in np.arange(5) * 2 * np.pi / 5)])
    x = np.linspace(4.1, 11.9, 10)
    south = np.stack([x, 0 * x, 0 * x + 7.0], 1)
    north = np.stack([x, 0 * x, 0 * x + 3.0], 1)
    wall = np.stack([np.linspace(1.5, 14.5, 14), np.zeros(14), np.full(14, 0.9)], 1)
    ends = np.array([(2.9, 0, 5.0), (13.1, 0, 5.0)])
    where = np.concatenate([south, north, wall, ends])
    yaw = np.concatenate([np.full(10, np.pi), np.zeros(10), np.zeros(14), (np.pi / 2, -np.pi / 2)])
    pieces.add(place(chair, where, yaw), palette(np.repeat((2, 2, 5, 7), (10, 10, 14, 2))))
    lamp = revolve(smooth([(0.02, 0.6), (0.06, 0.3), (0.42, 0.0)], 20), 60)
    lamps = np.array([(a, 3.0, b) for a in (5, 8, 11) for b in (4.2, 5.8)], np.float64)
    pieces.add(place(lamp, lamps), STEEL)
    books = np.arange(0.3, 9.7, 0.03)
    shelf = np.array([0.6, 1.2, 1.8, 2.4])
    at = np.stack([np.tile((0.05,), len(books) * 4), np.repeat(shelf, len(books)),
                   np.tile(books, 4)], 1)
    tall = np.random.default_rng(5).uniform(0.25, 0.45, len(at))
    size = np.stack([0 * tall + 0.3, tall, 0 * tall + 0.026], 1)
    pieces.add(boxes(at, at + size), palette(np.arange(len(at)) % 13))
    camera = Camera((15.2, 3.0, 9.2), (6.0, 0.9, 3.8), fov=60)
    return pieces.finish(282_641, camera, (8.0, 3.8, 7.5), (0.95, 0.92, 0.86))


def shirley6() -> Built:
    """Return a plain room with two balls and two blocks: 804 triangles."""
    pieces = Pieces()
    _shell(pieces, (0, 0, 0), (4, 3, 4))
    pieces.add(ball(300, (1.3, 0.6, 1.6), (0.6, 0.6, 0.6)), (0.70, 0.45, 0.35))
    pieces.add(ball(300, (2.8, 0.5, 2.5), (0.5, 0.5, 0.5)), (0.40, 0.55, 0.65))
    pieces.add(boxes([(2.4, 0, 0.6), (0.4, 0, 2.6)], [(3.3, 1.6, 1.4), (0.9, 0.5, 3.1)]), WALL)
    camera = Camera((2.0, 1.6, 3.9), (2.0, 0.9, 1.0), fov=65)
    return pieces.finish(804, camera, (2.0, 2.8, 2.6))
