"""Ray space: frames and error bounds for the methods that subdivide rays instead of space.

The dominant axis of a direction is the axis of its largest component. Dividing the direction by
this component's magnitude gives a point (u, v) in [-1, 1]^2 on a face of the direction cube. In
the frame of an axis, the coordinate along this axis comes last, as in `permute` of
``glsl/core/ray.glsl``.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import padding, scene_box
from ...gl.precision import FORMATS
from ...rays.far_origins import FAR, sphere

ORDERS = ((1, 2, 0), (2, 0, 1), (0, 1, 2))   # the order of coordinates in the frame of each axis
SLACK = 64.0     # error bound relative to distances, in roundoff units (glsl/core/slack.glsl)


@dataclass(frozen=True)
class RaySpace:
    """The valid rays, which a method's tables cover, and their error bounds.

    Attributes
    ----------
    lo, hi : (3,) float32, the scene's padded box, world units
    pad : float, world units. Rounding displaces a valid ray by less than ``pad``
    direction_pad : float, the error bound of a valid ray's u and v
    far : float, world units. The origins of valid rays lie within this distance of the scene's
        centre along each axis
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
    """Return the ray space of (n, 3, 3) float32 triangles for kernels in format ``arithmetic``."""
    lo, hi = scene_box(triangles)
    _, radius = sphere(lo, hi)
    largest = float(max(np.abs(lo).max(), np.abs(hi).max()))
    unit = FORMATS[arithmetic].unit
    far = 1.01 * FAR * radius
    pad = SLACK * unit * (far + radius) + 8 * unit * largest + float(padding(triangles))
    return RaySpace(lo, hi, pad, SLACK * unit, far)


def in_frame(points: np.ndarray, axis: int, negative: bool = False) -> np.ndarray:
    """Convert (..., 3) points to the frame of an axis, in float64.

    With ``negative``, the last coordinate is negated, so that it grows along rays in the negative
    direction of the axis.
    """
    framed = points[..., ORDERS[axis]].astype(np.float64)
    if negative:
        framed[..., 2] *= -1
    return framed
