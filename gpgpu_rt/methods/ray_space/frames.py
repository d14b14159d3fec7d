"""Ray space: frames and error bounds, shared by the methods that sort rays instead of space.

The dominant axis of a direction is the axis of its largest component. Divided by the magnitude of
this component, the direction is a point (u, v) in [-1, 1]^2 on a face of a cube. In the frame of
an axis the coordinate along the axis comes last, as in `permute` of ``glsl/core/ray.glsl``.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import padding, scene_box
from ...gl.precision import FORMATS
from ...rays.far_origins import FAR, sphere

ORDERS = ((1, 2, 0), (2, 0, 1), (0, 1, 2))      # the order of coordinates in each axis' frame
SLACK = 64.0     # roundoff units, relative to distances, as in glsl/core/slack.glsl


@dataclass(frozen=True)
class RaySpace:
    """The origins of rays that the tables can answer, and the error bounds of these rays.

    Attributes
    ----------
    lo, hi : (3,) float32, the scene's padded box, world units
    pad : float, world units; rounding displaces a ray by less than this if its origin lies within
        ``far`` of the centre along each axis
    direction_pad : float, the same bound for u and v
    far : float, world units
    """

    lo: np.ndarray
    hi: np.ndarray
    pad: float
    direction_pad: float
    far: float

    @property
    def centre(self) -> np.ndarray:
        """The centre of the scene's box, (3,) float32, world units."""
        return ((self.lo.astype(np.float64) + self.hi) / 2).astype(np.float32)


def ray_space(triangles: np.ndarray, arithmetic: str = "fp32") -> RaySpace:
    """The ray space of (n, 3, 3) float32 triangles; kernels round to the format ``arithmetic``."""
    lo, hi = scene_box(triangles)
    _, radius = sphere(lo, hi)
    largest = float(max(np.abs(lo).max(), np.abs(hi).max()))
    unit = FORMATS[arithmetic].unit
    far = 1.01 * FAR * radius
    pad = SLACK * unit * (far + radius) + 8 * unit * largest + float(padding(triangles))
    return RaySpace(lo, hi, pad, SLACK * unit, far)


def in_frame(points: np.ndarray, axis: int, negative: bool = False) -> np.ndarray:
    """Convert (..., 3) points to an axis' frame, in float64.

    With ``negative`` the last coordinate is negated, so that it grows along the rays.
    """
    framed = points[..., ORDERS[axis]].astype(np.float64)
    if negative:
        framed[..., 2] *= -1
    return framed
