"""The camera that the viewer draws with: fitted to the picture's shape, and rounded.

The mouse moves the exact camera, but the viewer draws with the rounded camera. A command with the
rounded numbers therefore draws the same picture to the bit.
"""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import SceneError
from ..scene.camera import Camera

# Rounding a camera moves a point's projection by less than PIXEL_SHARE pixels, for points at
# NEAREST to 1 times the depth of the target.
PIXEL_SHARE = 0.1
NEAREST = 0.25
# Parts of the camera in the order of rounding, each with a share. After a part is rounded, all
# roundings so far move a point's projection by less than the share times PIXEL_SHARE pixels.
_BUDGETS = (("fov", 0.1), ("up", 0.3), ("eye", 0.6), ("target", 1.0))


def fitted(camera: Camera, size: tuple[int, int]) -> Camera:
    """Return the camera, with a wider field of view for a picture that is taller than wide.

    The field of view is vertical. The fitted camera shows all that a square picture of the given
    camera shows.
    """
    width, height = size
    if width >= height:
        return camera
    half = np.tan(np.radians(camera.fov) / 2) * height / width
    return replace(camera, fov=float(2 * np.degrees(np.arctan(half))))


def shift(exact: Camera, other: Camera, size: tuple[int, int]) -> float:
    """Return the largest distance in pixels between the projections of a point by two cameras.

    The points lie on the rays of ``exact`` through the picture's corners, edge middles and centre.
    Their depths are NEAREST and 1 times the distance of the target.
    """
    right, up, forward = exact.basis(size)
    places = np.stack(np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]), axis=-1).reshape(-1, 2)
    directions = forward + places[:, :1] * right + places[:, 1:] * up
    distance = np.linalg.norm(np.subtract(exact.target, exact.eye))
    moved = np.subtract(exact.eye, other.eye)
    right, up, forward = other.basis(size)
    most = 0.0
    for depth in (NEAREST * distance, distance):
        seen = moved + depth * directions
        ahead = seen @ forward
        if (ahead <= 0).any():
            return np.inf
        found = np.stack([seen @ right / (right @ right), seen @ up / (up @ up)]) / ahead
        pixels = (found.T - places) * np.asarray(size) / 2
        most = max(most, float(np.linalg.norm(pixels, axis=1).max()))
    return most


def rounded(camera: Camera, size: tuple[int, int], own: Camera | None = None) -> Camera:
    """Return the camera with the fewest decimals that keep `shift` below PIXEL_SHARE.

    Parameters
    ----------
    camera : the exact camera
    size : (width, height) of the picture in pixels
    own : the scene's own camera. Parts equal to this camera's are not rounded, because a command
        omits such parts
    """
    found = camera
    for name, share in _BUDGETS:
        if own is not None and getattr(camera, name) == getattr(own, name):
            continue
        for one in _candidates(found, name):
            if shift(camera, one, size) < share * PIXEL_SHARE:
                found = one
                break
    return found


def _candidates(camera: Camera, name: str) -> Iterator[Camera]:
    """Yield cameras whose part ``name`` is rounded to more and more decimals; last, the camera
    itself."""
    value: Any = getattr(camera, name)
    largest = np.abs(value).max()
    first = -int(np.floor(np.log10(largest))) if largest > 0 else 0     # one significant digit
    for decimals in range(first, first + 17):
        try:
            yield replace(camera, **{name: _cut(value, decimals)})
        except SceneError:      # so few digits give no valid camera
            continue
    yield camera


def _cut(value: Any, decimals: int) -> Any:
    if isinstance(value, tuple):
        return tuple(_cut(part, decimals) for part in value)
    return round(value, decimals) + 0.0     # -0.0 + 0.0 is 0.0
