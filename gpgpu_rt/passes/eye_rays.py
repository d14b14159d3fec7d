"""Eye rays: those through the pixel centres of a camera's image, made where they are traced."""
from __future__ import annotations

import numpy as np

from ..approach import FAR, NEAR, sphere
from ..camera import Camera
from ..gpu import Gpu
from ..precision import Precision
from ..ray_state import RayTextures
from ..texel_layout import RAY_TEXELS
from .full_screen import FullScreenPass


class EyeRays:
    """The pass that writes them."""

    def __init__(self, gpu: Gpu, precision: Precision) -> None:
        self._pass = FullScreenPass(
            gpu, "passes/eye_rays.frag", precision.defines(),
            {"streams": precision.layout(RAY_TEXELS).stream_glsl(writes=True)})

    def write(self, rays: RayTextures, camera: Camera,
              bounds: tuple[np.ndarray, np.ndarray]) -> None:
        """The rays of an image as large as ``rays``; ``bounds`` are the scene's."""
        right, up, forward = (tuple(axis) for axis in camera.basis(rays.size))
        centre, radius = sphere(*bounds)
        far = np.linalg.norm(np.subtract(camera.eye, centre)) > FAR * radius
        self._pass.set(eye=camera.eye, right=right, up=up, forward=forward, size=rays.size,
                       centre=tuple(centre), beyond=NEAR * radius if far else 0.0)
        self._pass.draw(rays.target, {})
        rays.share_start(None if far else np.float32([*camera.eye, 0]))
        rays.seen_from = None if far else camera

    def release(self) -> None:
        self._pass.release()
