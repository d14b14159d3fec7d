"""Cornell box: the measurements of the box at Cornell University, in millimetres.

Quadrilaterals, reflectances (as RGB) and camera are from "The Cornell Box", Cornell University
Program of Computer Graphics. One departure: the lamp hangs half a millimetre below the ceiling
instead of in the ceiling's plane, so that no two triangles coincide.
"""
from __future__ import annotations

import numpy as np

from ..camera import Camera
from .built import Built, Pieces
from .painting import GREEN, RED, WHITE
from .shapes import quad

_WHITE_WALLS = (
    ((552.8, 0, 0), (0, 0, 0), (0, 0, 559.2), (549.6, 0, 559.2)),
    ((556, 548.8, 0), (556, 548.8, 559.2), (0, 548.8, 559.2), (0, 548.8, 0)),
    ((549.6, 0, 559.2), (0, 0, 559.2), (0, 548.8, 559.2), (556, 548.8, 559.2)),
)
_GREEN_WALL = ((0, 0, 559.2), (0, 0, 0), (0, 548.8, 0), (0, 548.8, 559.2))
_RED_WALL = ((552.8, 0, 0), (549.6, 0, 559.2), (556, 548.8, 559.2), (556, 548.8, 0))
_LIGHT = ((343, 548.3, 227), (343, 548.3, 332), (213, 548.3, 332), (213, 548.3, 227))
# The height of each block, and the corners of its top as (x, z). The blocks have no bottom.
_BLOCKS = (
    (165, ((130, 65), (82, 225), (240, 272), (290, 114))),
    (330, ((423, 247), (265, 296), (314, 456), (472, 406))),
)


def make() -> Built:
    """Return the Cornell box: 32 triangles."""
    pieces = Pieces()
    for wall in _WHITE_WALLS:
        pieces.add(quad(*wall), WHITE)
    pieces.add(quad(*_GREEN_WALL), GREEN)
    pieces.add(quad(*_RED_WALL), RED)
    for height, top in _BLOCKS:
        pieces.add(quad(*((x, height, z) for x, z in top)), WHITE)
        for (x0, z0), (x1, z1) in zip(top, np.roll(top, 1, axis=0)):
            pieces.add(quad((x0, 0, z0), (x0, height, z0), (x1, height, z1), (x1, 0, z1)), WHITE)
    pieces.add(quad(*_LIGHT), (0.78, 0.78, 0.78))
    camera = Camera((278, 273, -800), (278, 273, 0), fov=39.3)
    return pieces.finish(32, camera, (278, 540, 279.5), (1.0, 0.95, 0.85))
