"""Eye rays: a pass on the GPU makes the rays through the pixel centres of a camera's image."""
from __future__ import annotations

import numpy as np

from ..gl.context import Gpu
from ..gl.full_screen import FullScreenPass
from ..gl.precision import Precision
from ..scene.camera import Camera
from ..scene.region import Region
from .far_origins import FAR, NEAR, sphere
from .records import RAY_TEXELS
from .textures import RayTextures

Bounds = tuple[np.ndarray, np.ndarray]


def eye_uniforms(camera: Camera, size: tuple[int, int], bounds: Bounds) -> dict[str, object]:
    """Return the uniforms of ``drivers/eye.glsl`` for an image of (width, height) pixels and a
    scene within ``bounds``."""
    right, up, forward = (tuple(axis) for axis in camera.basis(size))
    centre, radius = sphere(*bounds)
    far = np.linalg.norm(np.subtract(camera.eye, centre)) > FAR * radius
    return {"eye": camera.eye, "right": right, "up": up, "forward": forward, "size": size,
            "centre": tuple(centre), "beyond": NEAR * radius if far else 0.0}


def share_eye(rays: RayTextures, uniforms: dict[str, object]) -> None:
    """Set the eye rays' shared start (origin and t_min) from the ``uniforms`` of their pass.

    If the eye is far away, the pass moves each origin, and the rays share no start.
    """
    rays.share_start(None if uniforms["beyond"]
                     else np.float32([*uniforms["eye"], 0]))  # type: ignore[misc]


class EyeRays:
    """The pass that writes eye rays."""

    def __init__(self, gpu: Gpu, precision: Precision) -> None:
        self._pass = FullScreenPass(
            gpu, "drivers/eye_rays.frag", precision.defines(),
            {"streams": precision.layout(RAY_TEXELS).stream_glsl(writes=True)})

    def write(self, rays: RayTextures, camera: Camera, bounds: Bounds,
              aside: tuple[float, float] = (0.0, 0.0), region: Region | None = None) -> None:
        """Write the eye rays of an image, or of a region of the image, to ``rays``.

        Parameters
        ----------
        rays : textures of the size of the image or region
        bounds : the scene's (lo, hi)
        aside : offset of all rays from the pixel centres, in pixels
        region : the region of the image; by default the whole image
        """
        region = region or Region.of(rays.size, None)
        uniforms = eye_uniforms(camera, region.whole, bounds)
        self._pass.set(**uniforms, corner=region.corner, aside=aside)
        self._pass.draw(rays.target, {})
        share_eye(rays, uniforms)
        centred = not uniforms["beyond"] and not any(aside)
        rays.seen_from = camera if centred and region.is_whole else None

    def release(self) -> None:
        self._pass.release()
