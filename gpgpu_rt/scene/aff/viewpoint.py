"""Viewpoint: the camera of an AFF file, which key frames may move."""
from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..camera import Camera
from .document import Document
from .keyframes import KeyedMotion

NAME = "camera"     # key frames of this name move the camera


@dataclass(frozen=True)
class Viewpoint:
    """A camera and its motion.

    Attributes
    ----------
    camera : the camera of the statement ``v``, or a default camera; key frames may replace its
        position, and its target with its up direction
    motion : the key frames of the camera, or None
    """

    camera: Camera
    motion: KeyedMotion | None

    @classmethod
    def of(cls, document: Document) -> Viewpoint | None:
        """Return the viewpoint of a document; None if the document defines no camera."""
        motion = document.motions.get(NAME)
        if document.camera is not None:
            return cls(document.camera, motion)
        if motion is None or motion.translation is None or motion.rotation is None:
            return None
        return cls(Camera((0.0, 0.0, 0.0), (0.0, 0.0, -1.0)), motion)

    @property
    def moves(self) -> bool:
        """Whether key frames move the camera."""
        return self.motion is not None

    def at(self, time: float) -> Camera:
        """Return the camera at a time. If key frames rotate the camera, it looks along the rotated
        negative z-axis, and its up direction is the rotated y-axis."""
        if self.motion is None:
            return self.camera
        eye, ahead = np.array(self.camera.eye), np.subtract(self.camera.target, self.camera.eye)
        up = np.array(self.camera.up)
        if self.motion.translation is not None:
            eye = self.motion.translation.at(time)
        if self.motion.rotation is not None:
            axes = self.motion.rotation.at(time)
            ahead, up = -axes[:, 2], axes[:, 1]
        return Camera(tuple(eye), tuple(eye + ahead), tuple(up), self.camera.fov)
