"""Ray space: what the methods that sort rays, not space, share: frames, and what rounding may do.

A direction belongs to the axis of its largest component, the dominant one; divided by that
component's size it is a point (u, v) in [-1, 1]^2 on a face of a cube. In the frame of an axis
coordinates are ordered so that it comes last, as `permute` of ``glsl/core/ray.glsl`` does.
"""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...accel.bounds import padding, scene_box
from ...gl.precision import FORMATS
from ...rays.far_origins import FAR, sphere

ORDERS = ((1, 2, 0), (2, 0, 1), (0, 1, 2))      # of each axis: which coordinates a frame holds
SLACK = 64.0     # units, relative to distances: as glsl/core/slack.glsl widens boxes


@dataclass(frozen=True)
class RaySpace:
    """Where rays that tables answer start, and how far what they compute may be off.

    lo, hi : (3,) float32, the scene's padded box, world units
    pad : float, world units: a ray that starts within ``far`` of the centre, along each axis,
        passes by less than this where it does not in exact arithmetic
    direction_pad : float, the same of u and v
    far : float, world units
    """

    lo: np.ndarray
    hi: np.ndarray
    pad: float
    direction_pad: float
    far: float

    @property
    def centre(self) -> np.ndarray:
        """(3,) float32."""
        return ((self.lo.astype(np.float64) + self.hi) / 2).astype(np.float32)


def ray_space(triangles: np.ndarray, arithmetic: str = "fp32") -> RaySpace:
    """The ray space of (n, 3, 3) float32 triangles; ``arithmetic`` is what kernels round to."""
    lo, hi = scene_box(triangles)
    _, radius = sphere(lo, hi)
    largest = float(max(np.abs(lo).max(), np.abs(hi).max()))
    unit = FORMATS[arithmetic].unit
    far = 1.01 * FAR * radius
    pad = SLACK * unit * (far + radius) + 8 * unit * largest + float(padding(triangles))
    return RaySpace(lo, hi, pad, SLACK * unit, far)


def in_frame(points: np.ndarray, axis: int, negative: bool = False) -> np.ndarray:
    """(..., 3) points in an axis' frame, float64; with ``negative`` the last coordinate counts
    against the axis, so that rays always go up it."""
    framed = points[..., ORDERS[axis]].astype(np.float64)
    if negative:
        framed[..., 2] *= -1
    return framed
