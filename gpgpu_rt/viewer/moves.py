"""Moves of a camera: around what it looks at, or through it. Each gives another camera."""
from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..scene.camera import Camera

STEEPEST = np.radians(89.0)     # a view along up has no horizon


def _turn(vector: np.ndarray, axis: np.ndarray, angle: float) -> np.ndarray:
    """(3,) turned around a unit axis by an angle in radians (Rodrigues)."""
    return (vector * np.cos(angle) + np.cross(axis, vector) * np.sin(angle)
            + axis * (axis @ vector) * (1 - np.cos(angle)))


def _unit(vector: np.ndarray) -> np.ndarray:
    return vector / np.linalg.norm(vector)


def _turned_view(camera: Camera, across: float, upward: float) -> np.ndarray:
    """The view, (3,) from eye to target, turned around up and then towards it, in radians."""
    up = _unit(np.asarray(camera.up))
    view = _turn(np.subtract(camera.target, camera.eye), up, across)
    rise = float(np.arcsin(np.clip(_unit(view) @ up, -1, 1)))
    upward = float(np.clip(rise + upward, -STEEPEST, STEEPEST)) - rise
    return _turn(view, _unit(np.cross(view, up)), upward)


def orbit(camera: Camera, across: float, upward: float) -> Camera:
    """The eye on a sphere around the target; angles in radians."""
    view = _turned_view(camera, across, upward)
    return replace(camera, eye=tuple(np.subtract(camera.target, view)))


def look(camera: Camera, across: float, upward: float) -> Camera:
    """The target on a sphere around the eye; angles in radians."""
    view = _turned_view(camera, across, upward)
    return replace(camera, target=tuple(np.add(camera.eye, view)))


def approach(camera: Camera, factor: float) -> Camera:
    """The eye ``factor`` times as far from the target."""
    view = np.subtract(camera.target, camera.eye)
    return replace(camera, eye=tuple(np.subtract(camera.target, view * factor)))


def fly(camera: Camera, right: float, up: float, forward: float) -> Camera:
    """Eye and target moved along the view's own axes, world units."""
    ahead = _unit(np.subtract(camera.target, camera.eye))
    aside = _unit(np.cross(ahead, camera.up))
    moved = right * aside + up * np.cross(aside, ahead) + forward * ahead
    return replace(camera, eye=tuple(np.add(camera.eye, moved)),
                   target=tuple(np.add(camera.target, moved)))


def pan(camera: Camera, right: float, up: float) -> Camera:
    """Eye and target moved so that the target moves by parts of the image's height."""
    height = 2 * np.tan(np.radians(camera.fov) / 2) * np.linalg.norm(
        np.subtract(camera.target, camera.eye))
    return fly(camera, right * height, up * height, 0.0)
