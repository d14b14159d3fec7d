"""Camera: a pinhole camera and its rays through the pixels of an image."""
from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..disk.files import read_json
from ..errors import OptionError, SceneError, memory_limited
from ..text_format import shortened

Vector = tuple[float, float, float]


def image_size(size: Sequence[int]) -> tuple[int, int]:
    """Return (width, height) in pixels; raise OptionError if ``size`` is not a valid size."""
    try:
        width, height = (int(s) for s in size)
    except (TypeError, ValueError):
        raise OptionError(f"size is {size!r}; give (width, height) in pixels") from None
    if width < 1 or height < 1:
        raise OptionError(f"size {tuple(size)} must be at least 1 x 1 pixels")
    return width, height


def check_camera(camera: Any) -> None:
    """Raise OptionError unless ``camera`` is a Camera or None."""
    if camera is not None and not isinstance(camera, Camera):
        raise OptionError(f"camera is {camera!r}; give a Camera(eye, target), or None for the "
                          "scene's own")


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Attributes
    ----------
    eye, target, up : (3,) float, world units; up need not be at right angles to the view
    fov : full vertical angle of the image, degrees, in (0, 180)

    Raises
    ------
    SceneError
        an entry is not finite, eye and target coincide, up is parallel to the view, or fov
        lies outside (0, 180)
    """

    eye: Vector
    target: Vector
    up: Vector = (0.0, 1.0, 0.0)
    fov: float = 45.0

    def __post_init__(self) -> None:
        for name in ("eye", "target", "up"):
            object.__setattr__(self, name, _vector(name, getattr(self, name)))
        object.__setattr__(self, "fov", _number("fov", self.fov))
        if not 0 < self.fov < 180:
            raise SceneError(
                f"camera: fov is {self.fov:g} degrees; give an angle between 0 and 180")
        view = np.subtract(self.target, self.eye)
        length = np.linalg.norm(view)
        if length == 0:
            raise SceneError(f"camera: eye and target are both {self.eye}; move one of them")
        height = np.linalg.norm(self.up)
        if height == 0 or np.linalg.norm(np.cross(view / length, self.up)) <= 1e-6 * height:
            raise SceneError(f"camera: up {self.up} is parallel to the view; give another up")

    def basis(self, size: Sequence[int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the scaled axes of an image of `size` = (width, height) pixels.

        Returns
        -------
        right, up, forward : (3,) float64. For x and y in [-1, 1], with y = 1 at the top, the ray
            through (x, y) has direction forward + x * right + y * up, not normalised
        """
        width, height = image_size(size)
        forward = np.subtract(self.target, self.eye)
        forward /= np.linalg.norm(forward)
        right = np.cross(forward, self.up)
        right /= np.linalg.norm(right)
        up = np.cross(right, forward)
        half = np.tan(np.radians(self.fov) / 2)
        return right * (half * width / height), up * half, forward

    @memory_limited
    def rays(self, size: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
        """Return rays through the pixel centres of an image of `size` = (width, height) pixels.

        Returns
        -------
        origins, directions : (height, width, 3) float32, row 0 at the top; directions are
            normalised in float64, then rounded
        """
        width, height = image_size(size)
        right, up, forward = self.basis(size)
        x = (2 * np.arange(width) + 1) / width - 1
        y = 1 - (2 * np.arange(height) + 1) / height
        directions = forward + x[None, :, None] * right + y[:, None, None] * up
        directions /= np.linalg.norm(directions, axis=-1, keepdims=True)
        origins = np.broadcast_to(np.asarray(self.eye, np.float32), directions.shape)
        return origins.copy(), directions.astype(np.float32)

    @classmethod
    def looking_at(cls, bounds: tuple[np.ndarray, np.ndarray], *, fov: float = 45.0,
                   along: Vector = (-0.45, -0.35, -1.0)) -> Camera:
        """Return a camera outside a box, with y up. A picture that is at least as wide as high
        shows the whole box.

        Parameters
        ----------
        bounds : (lo, hi), (3,) each, world units
        fov : full vertical angle, degrees
        along : (3,), the view direction
        """
        lo, hi = (np.asarray(corner, np.float64) for corner in bounds)
        radius = np.linalg.norm(hi - lo) / 2
        if not radius > 0:
            radius = max(1.0, float(np.abs(lo).max()))
        centre = (lo + hi) / 2
        view = np.asarray(along, np.float64) / np.linalg.norm(along)
        eye = centre - view * (radius / np.sin(np.radians(fov) / 2))
        return cls(tuple(eye), tuple(centre), fov=fov)

    @classmethod
    def from_dict(cls, entry: Mapping[str, Any], where: str = "camera") -> Camera:
        """Return the camera of the mapping `entry`, with the keys `eye` and `target`, and
        optionally `up` and `fov_degrees`. Error messages call the mapping `where`."""
        if not isinstance(entry, Mapping) or not {"eye", "target"} <= set(entry):
            raise SceneError(f"{where}: a camera needs 'eye' and 'target'; add them")
        try:
            return cls(entry["eye"], entry["target"], entry.get("up", (0.0, 1.0, 0.0)),
                       entry.get("fov_degrees", 45.0))
        except SceneError as error:
            raise SceneError(f"{where}: {error}") from None

    def to_dict(self) -> dict[str, Any]:
        """Return the mapping that `from_dict` reads."""
        return {"eye": list(self.eye), "target": list(self.target), "up": list(self.up),
                "fov_degrees": self.fov}


def load_cameras(path: str | os.PathLike) -> dict[str, Camera]:
    """Return the cameras of a JSON file that maps scene names to cameras."""
    try:
        entries = read_json(path)
    except (OSError, ValueError) as error:
        error = getattr(error, "strerror", None) or error
        raise SceneError(f"{path}: not readable as JSON ({error}); repair or remove it") from None
    if not isinstance(entries, dict):
        raise SceneError(f"{path}: expected an object that maps scene names to cameras; repair it")
    return {name: Camera.from_dict(entry, f"{path}, {name}") for name, entry in entries.items()}


def _number(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(f"camera: {name} is {shortened(value)}; give a number") from None
    if not np.isfinite(number):
        raise SceneError(f"camera: {name} is {number}; give a finite number")
    return number


def _vector(name: str, value: Any) -> Vector:
    if isinstance(value, (str, Mapping)) or not hasattr(value, "__len__") or len(value) != 3:
        raise SceneError(f"camera: {name} is {shortened(value)}; give three numbers")
    return tuple(_number(name, entry) for entry in value)
