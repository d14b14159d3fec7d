"""Buildings: procedural scenes that stand in for Soda Hall and the Power Plant.

The stand-ins have the properties of the originals that matter for ray tracing. Each stand-in has
as many triangles as its original: millions, most of them small and hidden. In Soda Hall, large
walls and floors surround many small objects, and rooms hide each other. The Power Plant has many
thin parts without walls between them.
"""
from __future__ import annotations

import numpy as np

from ..camera import Camera
from .built import Built, Pieces
from .painting import palette
from .shapes import ball, boxes, bump, floor, place, revolve, smooth, tube

PLASTER, CARPET, WOOD, STEEL, CONCRETE, GROUND = (
    (0.74, 0.72, 0.66), (0.36, 0.38, 0.42), (0.50, 0.34, 0.21), (0.55, 0.58, 0.62),
    (0.60, 0.59, 0.56), (0.42, 0.40, 0.36))
SODA_HALL, POWER_PLANT = 2_169_132, 12_748_510   # triangles, as in Hachisuka's survey, Figure 22

# Soda Hall -------------------------------------------------------------------------------------

# ROOMS: rooms on each side of a corridor. ROOM: width, height and depth of a room.
STOREYS, ROOMS, ROOM = 7, 20, (5.0, 3.4, 6.0)
CORRIDOR = 3.0


def sodahall() -> Built:
    """Return seven storeys of furnished rooms along corridors, seen from inside: 2,169,132
    triangles."""
    rng = np.random.default_rng(22)
    pieces = Pieces()
    width, height, depth = ROOM
    length = ROOMS * width
    storey = np.arange(STOREYS) * height
    for y in storey:
        pieces.add(floor((0, -depth - CORRIDOR / 2), (length, depth + CORRIDOR / 2), y, 12),
                   CARPET)
    pieces.add(boxes((0, STOREYS * height, -depth - 1.5), (length, STOREYS * height + 0.3,
                                                           depth + 1.5)), CONCRETE)
    room = np.array([(x, y, side) for y in storey for x in np.arange(ROOMS) * width
                     for side in (-1, 1)])
    x, y, side = room.T
    # A room extends from the corridor's wall to the far wall.
    wall_z = side * CORRIDOR / 2
    far_z = wall_z + side * depth
    low, high = np.minimum(wall_z, far_z), np.maximum(wall_z, far_z)
    up = y + height
    pieces.add(boxes(np.stack([x, y, low], 1), np.stack([x + 0.12, up, high], 1)), PLASTER)
    pieces.add(boxes(np.stack([x, y, far_z - 0.05], 1), np.stack([x + width, y + 1.0,
                                                                  far_z + 0.05], 1)), PLASTER)
    # Two boxes leave a doorway free: the wall beside the door, and the wall above the door.
    for begin, end, bottom in ((1.4, width, 0.0), (0.0, 1.4, 2.2)):
        pieces.add(boxes(np.stack([x + begin, y + bottom, wall_z - 0.06], 1),
                         np.stack([x + end, up, wall_z + 0.06], 1)), PLASTER)
    middle = np.stack([x + width / 2, y, wall_z + side * depth / 2], 1)
    yaw = np.where(side > 0, 0.0, np.pi)
    desk, chair, books, lamp, plant, things = _furniture(rng)
    for thing, share, colour in ((desk, 1.0, WOOD), (chair, 1.0, None), (books, 1.0, None),
                                 (lamp, 1.0, STEEL), (plant, 0.7, (0.22, 0.40, 0.18)),
                                 (things, 0.5, None), (chair, 0.3, None)):
        there = np.flatnonzero(rng.random(len(room)) < share)
        colours = palette(rng.integers(0, 13, len(there))) if colour is None else colour
        # Shelves and lamps keep their place; all other furniture is moved and turned at random.
        loose = 0.0 if thing is books or thing is lamp else 0.2
        moved = middle[there] + rng.uniform(-loose, loose, (len(there), 3)) * (1, 0, 1)
        turned = yaw[there] + rng.uniform(-loose, loose, len(there))
        pieces.add(place(thing, moved, turned), colours)
    stairs = np.arange(STOREYS * 20)
    low = np.stack([length + 0.28 * (stairs % 20), stairs * 0.17, 0 * stairs - 1.2], 1)
    pieces.add(boxes(low, low + (0.3, 0.05, 2.4)), CONCRETE)
    camera = Camera((1.0, 2 * height + 1.7, -0.6), (30.0, 2 * height + 1.3, 2.6), fov=62)
    light = (6.0, 2 * height + 3.1, 0.0)
    return pieces.finish(SODA_HALL, camera, light, (0.95, 0.92, 0.86))


def _furniture(rng: np.random.Generator) -> tuple[np.ndarray, ...]:
    """Return desk, chair, shelf of books, lamp, plant and small objects, relative to a room's
    centre."""
    desk = boxes([(-0.9, 0.72, 0.9), (-0.9, 0, 0.9), (0.5, 0, 0.9), (-0.3, 0.78, 1.4)],
                 [(0.9, 0.76, 1.7), (-0.85, 0.72, 1.7), (0.9, 0.72, 1.7), (0.3, 1.15, 1.44)])
    chair = np.concatenate([
        ball(900, (0, 0.48, 0.3), (0.26, 0.06, 0.26)), ball(900, (0, 0.85, 0.06),
                                                            (0.25, 0.28, 0.06)),
        tube([(0, 0.05, 0.3), (0, 0.25, 0.3), (0, 0.46, 0.3)], 0.03, 16),
        *(tube([(0, 0.05, 0.3), (0.28 * np.cos(a), 0.03, 0.3 + 0.28 * np.sin(a))], 0.025, 10)
          for a in np.arange(5) * 2 * np.pi / 5)])
    along, shelf = np.meshgrid(np.arange(-2.0, 2.0, 0.0625), 0.3 + 0.4 * np.arange(5))
    at = np.stack([along.reshape(-1), shelf.reshape(-1), np.full(320, -2.7)], 1)
    at = at[rng.random(320) < 0.7]
    size = np.stack([np.full(len(at), 0.052), rng.uniform(0.2, 0.34, len(at)),
                     rng.uniform(0.15, 0.24, len(at))], 1)
    books = boxes(at, at + size)
    lamp = revolve(smooth([(0.02, 3.2), (0.05, 2.9), (0.3, 2.7)], 12), 32)
    plant = bump(np.concatenate([ball(400, (1.8, 0.7 + 0.2 * k, 2.0), (0.3, 0.16, 0.3), (k, 2 * k))
                                 for k in range(3)]), 0.05, 0.2)
    cup = revolve(smooth([(0, 0), (0.035, 0), (0.045, 0.05), (0.04, 0.1)], 8), 14)
    spots = np.stack([rng.uniform(-0.8, 0.8, 6), np.full(6, 0.76), rng.uniform(1.0, 1.6, 6)], 1)
    return desk, chair, books, lamp, plant, place(cup, spots)


# Power Plant -----------------------------------------------------------------------------------

# A bay is a cell of the plant. BAY: its side. BAYS: number along x and z. LEVELS: storeys.
BAY, BAYS, LEVELS = 6.0, (8, 6), 12
KINDS = 9                             # number of different bays; each is placed 64 times


def powerplant() -> Built:
    """Return twelve open storeys of pipes, stairs, gratings and girders around a boiler, and a
    chimney on a plain: 12,748,510 triangles."""
    rng = np.random.default_rng(45)
    triangles = np.empty((POWER_PLANT, 3, 3), np.float32)
    colours = np.empty((POWER_PLANT, 3), np.float32)
    done = 0

    def keep(some: np.ndarray, colour: np.ndarray) -> None:
        nonlocal done
        triangles[done:done + len(some)], colours[done:done + len(some)] = some, colour
        done += len(some)

    bays = np.array([(i, k, j) for k in range(LEVELS) for i in range(BAYS[0])
                     for j in range(BAYS[1])], np.float64) * BAY
    where = rng.permutation(bays).reshape(KINDS, -1, 3)
    for kind in range(KINDS):
        for part, colour in _bay(rng):
            yaw = rng.integers(0, 4, len(where[kind])) * np.pi / 2
            tints = palette(rng.integers(0, 9, len(yaw))) * 0.6 + 0.4 * np.asarray(colour)
            keep(place(part, where[kind] + (BAY / 2, 0, BAY / 2), yaw),
                 np.repeat(tints, len(part), axis=0))
    rest = Pieces()
    rest.add(floor((-400, -400), (450, 450), -0.1, 20), GROUND)
    rest.add(revolve(smooth([(5.0, 0), (4.0, 60), (3.4, 130), (3.6, 140)], 120), 120) + (
        -14.0, 0.0, 18.0), CONCRETE)
    boiler = np.arange(-9.0, 9.0, 0.15)
    x = np.concatenate([boiler, boiler]) + 24
    z = np.repeat((-3.0, 39.0), len(boiler))
    pipe = tube([(0, 0, 0), (0, 25, 0), (0, 50, 0), (0, 75, 0)], 0.07, 24)
    rest.add(place(pipe, np.stack([x, 0 * x, z], 1)), STEEL)
    drum = ball(200_000, (24, 78, 18), (3, 3, 20))
    rest.add(drum, STEEL)
    camera = Camera((118.0, 46.0, 112.0), (24.0, 34.0, 18.0), fov=45)
    filled = rest.finish(POWER_PLANT - done, camera, (160.0, 220.0, 60.0), (1.0, 0.97, 0.9))
    keep(filled.triangles, filled.colours)
    return Built(triangles, colours, camera, filled.light, filled.intensity)


def _bay(rng: np.random.Generator) -> list[tuple[np.ndarray, tuple[float, float, float]]]:
    """Return the parts of a bay, relative to the centre of its floor, each with a colour."""
    half = BAY / 2
    corner = np.array([(a, 0, b) for a in (-half, half) for b in (-half, half)])
    girders = [boxes(corner - (0.1, 0, 0.1), corner + (0.1, BAY, 0.1)),
               boxes((-half, -0.2, -half), (half, 0, -half + 0.15)),
               boxes((-half, -0.2, -half), (-half + 0.15, 0, half))]
    bars = np.arange(-half, half, 0.06)
    low = np.stack([bars, 0 * bars - 0.04, 0 * bars - half], 1)
    grating = boxes(low, low + (0.01, 0.03, BAY))
    step = np.arange(24)
    tread = np.stack([-2.6 + 0.2 * step, 0.25 * step, 0 * step + rng.uniform(-2, 1)], 1)
    stairs = [boxes(tread, tread + (0.24, 0.03, 0.9))]
    for side in (0.0, 0.9):
        rail = np.stack([tread[:, 0], tread[:, 1] + 1.0, tread[:, 2] + side], 1)
        stairs += [tube(rail, 0.025, 10), boxes(rail - (0.01, 1.0, 0.01), rail + (0.01, 0, 0.01))]
    pipes = [_pipe(rng, half) for _ in range(18)]
    valve = revolve(smooth([(0, 0), (0.16, 0.05), (0.16, 0.1), (0.04, 0.14), (0.04, 0.3),
                            (0.12, 0.32)], 16), 20)
    valves = place(valve, rng.uniform((-half, 0.3, -half), (half, BAY - 0.5, half), (10, 3)))
    return [(np.concatenate(girders), STEEL), (grating, STEEL),
            (np.concatenate(stairs), (0.70, 0.62, 0.20)), (np.concatenate(pipes), CONCRETE),
            (valves, (0.62, 0.2, 0.16))]


def _pipe(rng: np.random.Generator, half: float) -> np.ndarray:
    """Return a pipe that runs along two axes alternately, with rounded bends."""
    points = [rng.uniform((-half, 0.2, -half), (half, BAY - 0.2, half))]
    for axis in np.tile(rng.permutation(3)[:2], 2):
        after = points[-1].copy()
        after[axis] = rng.uniform(0.2, BAY - 0.2) - (0 if axis == 1 else half)
        points.append(after)
    path = np.array(points)
    share = np.linspace(0, 1, 4)[:-1, None]
    fine = np.concatenate([a + share * (b - a) for a, b in zip(path[:-1], path[1:])] + [path[-1:]])
    fine[1:-1] = (fine[:-2] + 2 * fine[1:-1] + fine[2:]) / 4
    return tube(fine, rng.uniform(0.03, 0.16), 28)
