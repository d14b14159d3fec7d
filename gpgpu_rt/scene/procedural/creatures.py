"""Creatures: procedural stand-ins for scanned or modelled objects, seen from outside."""
from __future__ import annotations

import numpy as np

from ..camera import Camera
from .built import Built, Pieces
from .shapes import ball, bump, place, revolve, smooth, tube

FUR, STONE, HIDE, PORCELAIN = (0.72, 0.63, 0.52), (0.62, 0.60, 0.50), (0.55, 0.40, 0.30), (
    0.75, 0.76, 0.78)


def bunny() -> Built:
    """Return a sitting animal with a wrinkled coat: 69,451 small triangles of similar size."""
    parts = [ball(24_000, (0, 0.45, 0), (0.5, 0.45, 0.42)),
             ball(9_000, (-0.36, 0.95, 0.05), (0.27, 0.25, 0.24)),
             ball(4_000, (-0.30, 1.36, 0.12), (0.07, 0.30, 0.10), (0.15, -0.25)),
             ball(4_000, (-0.22, 1.34, -0.06), (0.07, 0.30, 0.10), (-0.25, -0.4)),
             ball(3_000, (0.50, 0.25, 0), (0.14, 0.14, 0.14)),
             ball(3_000, (-0.22, 0.08, 0.26), (0.24, 0.09, 0.11)),
             ball(3_000, (-0.22, 0.08, -0.26), (0.24, 0.09, 0.11)),
             ball(4_000, (0.25, 0.22, 0.33), (0.28, 0.25, 0.16))]
    pieces = Pieces()
    pieces.add(bump(bump(np.concatenate(parts), 0.012, 0.22), 0.004, 0.05, 7), FUR)
    camera = Camera((-0.9, 1.1, 3.1), (0.0, 0.78, 0.0), fov=38)
    return pieces.finish(69_451, camera, (-2.5, 4.0, 3.0), (0.95, 0.92, 0.86))


def buddha() -> Built:
    """Return a standing figure on a pedestal: 100,000 triangles."""
    pieces = Pieces()
    robe = revolve(smooth([(0.0, 0.0), (0.42, 0.0), (0.44, 0.25), (0.30, 0.9), (0.34, 1.3),
                           (0.26, 1.62), (0.09, 1.72), (0.0, 1.73)], 160), 160)
    arms = [tube([(s * 0.25, 1.5, 0.05), (s * 0.5, 1.75, 0.1), (s * 0.42, 2.15, 0.1)],
                 (0.1, 0.08, 0.05), 60) for s in (-1, 1)]
    head = ball(12_000, (0, 1.92, 0.02), (0.19, 0.22, 0.19))
    knot = ball(2_000, (0, 2.13, 0.0), (0.09, 0.08, 0.09))
    pieces.add(bump(np.concatenate([robe, head, knot, *arms]), 0.02, 0.25, 3), STONE)
    pieces.add(revolve([(0, 0), (0.62, 0), (0.62, -0.18), (0.75, -0.3), (0, -0.3)], 200), STONE)
    camera = Camera((0.9, 1.4, 4.2), (0.0, 0.83, 0.0), fov=43)
    return pieces.finish(100_000, camera, (2.5, 4.0, 3.5), (0.95, 0.92, 0.85))


def _cow(size: int) -> np.ndarray:
    """Return a cow of at most ``size`` triangles, about four units long, with its feet at y =
    0."""
    def part(share: float, *rest: tuple[float, ...]) -> np.ndarray:
        return ball(int(size * share), *rest)
    legs = [part(0.06, (x, 0.7, z), (0.17, 0.72, 0.17)) for x in (-1.1, 1.1) for z in (-0.4, 0.4)]
    return np.concatenate([
        part(0.34, (0, 1.75, 0), (1.6, 0.72, 0.66)), part(0.12, (-1.6, 2.25, 0), (0.5, 0.35, 0.33),
                                                          (0.0, -0.9)),
        part(0.12, (-2.05, 2.5, 0), (0.5, 0.27, 0.26), (0.0, 0.5)), *legs,
        part(0.04, (-1.85, 2.9, 0.25), (0.06, 0.2, 0.06), (0.5, 0.0)),
        part(0.04, (-1.85, 2.9, -0.25), (0.06, 0.2, 0.06), (-0.5, 0.0)),
        part(0.04, (1.65, 1.5, 0), (0.06, 0.6, 0.06), (0.0, 0.15))])


def cow() -> Built:
    """Return a single cow: 5,804 triangles."""
    pieces = Pieces()
    pieces.add(bump(_cow(5_500), 0.02, 1.0), HIDE)
    camera = Camera((-4.5, 3.6, 8.5), (-0.3, 1.5, 0.0), fov=31)
    return pieces.finish(5_804, camera, (-6.0, 9.0, 7.0))


def cows() -> Built:
    """Return four cows on a meadow of two triangles: 23,218 triangles."""
    pieces = Pieces()
    where = np.array([(0, 0, 0), (4.5, 0, -3), (-4.2, 0, -4), (1.2, 0, -7.5)], np.float64)
    herd = place(bump(_cow(5_500), 0.02, 1.0), where, np.array([0.2, 2.0, -0.5, 3.4]))
    pieces.add(herd, [HIDE, (0.75, 0.72, 0.68), (0.32, 0.25, 0.21), (0.62, 0.45, 0.30)])
    triangles, colours = pieces.arrays()
    ground = np.array([[(-30, 0, -30), (-30, 0, 30), (30, 0, 30)],
                       [(-30, 0, -30), (30, 0, 30), (30, 0, -30)]], np.float64)
    camera = Camera((-4.0, 4.5, 11.0), (0.3, 1.2, -2.2), fov=40)
    built = pieces.finish(23_216, camera, (-9.0, 14.0, 9.0))
    return Built(np.concatenate([built.triangles, ground]),
                 np.concatenate([built.colours, np.tile((0.33, 0.48, 0.22), (2, 1))]),
                 camera, built.light, built.intensity)


def pot(size: int) -> np.ndarray:
    """Return a teapot of about ``size`` triangles, about six units wide, with its base at y =
    0."""
    n = max(8, int(np.sqrt(size / 6.4)))
    body = revolve(smooth([(0, 0), (1.5, 0.05), (2.0, 0.9), (1.75, 1.9), (1.4, 2.4)], n), 2 * n)
    lid = revolve(smooth([(1.4, 2.4), (0.8, 2.65), (0.25, 2.75), (0.35, 3.0), (0, 3.15)], n // 2),
                  2 * n)
    spout = tube([(1.6, 0.8, 0), (2.4, 1.1, 0), (2.7, 1.9, 0), (3.3, 2.4, 0)],
                 (0.55, 0.4, 0.28, 0.22), n)
    angle = np.linspace(-0.5 * np.pi, 0.5 * np.pi, max(6, n // 2))
    handle = tube(np.stack([-1.75 - 1.05 * np.cos(angle), 1.45 + 0.75 * np.sin(angle),
                            0 * angle], 1), 0.16, n)
    return np.concatenate([body, lid, spout, handle])


def teapot() -> Built:
    """Return a teapot: 6,320 triangles."""
    pieces = Pieces()
    pieces.add(pot(5_600), PORCELAIN)
    camera = Camera((0.4, 4.2, 8.4), (0.2, 1.4, 0.0), fov=48)
    return pieces.finish(6_320, camera, (-5.0, 8.0, 6.0))
