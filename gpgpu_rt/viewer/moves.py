"""Moves: moves a camera around its target, or freely. Each function returns a new camera."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..scene.camera import Camera

STEEPEST = np.radians(89.0)     # largest angle to the horizon; a view along `up` is not defined


def _turn(vector: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """Return a vector, (3,), rotated around a unit axis by an angle in radians (Rodrigues)."""
    return (vector * np.cos(angle) + np.cross(axis, vector) * np.sin(angle)
            + axis * (axis @ vector) * (1 - np.cos(angle)))


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _turned_view(camera: Camera, across: float, upward: float) -> np.ndarray:
    """Return the vector from eye to target, (3,), rotated around `up` and then towards `up`, by
    angles in radians."""
    up = _unit(np.asarray(camera.up))
    view = _turn(np.subtract(camera.target, camera.eye), up, across)
    rise = float(np.arcsin(np.clip(_unit(view) @ up, -1, 1)))
    upward = float(np.clip(rise + upward, -STEEPEST, STEEPEST)) - rise
    return _turn(view, _unit(np.cross(view, up)), upward)


def orbit(camera: Camera, across: float, upward: float) -> Camera:
    """Move the eye around the target, by angles in radians."""
    view = _turned_view(camera, across, upward)
    return replace(camera, eye=tuple(np.subtract(camera.target, view)))


def look(camera: Camera, across: float, upward: float) -> Camera:
    """Move the target around the eye, by angles in radians."""
    view = _turned_view(camera, across, upward)
    return replace(camera, target=tuple(np.add(camera.eye, view)))


def approach(camera: Camera, factor: float) -> Camera:
    """Multiply the distance of the eye from the target by ``factor``."""
    view = np.subtract(camera.target, camera.eye)
    return replace(camera, eye=tuple(np.subtract(camera.target, view * factor)))


def fly(camera: Camera, right: float, up: float, forward: float) -> Camera:
    """Move eye and target along the axes of the view, in world units."""
    ahead = _unit(np.subtract(camera.target, camera.eye))
    aside = _unit(np.cross(ahead, camera.up))
    moved = right * aside + up * np.cross(aside, ahead) + forward * ahead
    return replace(camera, eye=tuple(np.add(camera.eye, moved)),
                   target=tuple(np.add(camera.target, moved)))


def pan(camera: Camera, right: float, up: float) -> Camera:
    """Move eye and target sideways. ``right`` and ``up`` are shares of the image's height."""
    height = 2 * np.tan(np.radians(camera.fov) / 2) * np.linalg.norm(
        np.subtract(camera.target, camera.eye))
    return fly(camera, right * height, up * height, 0.0)
