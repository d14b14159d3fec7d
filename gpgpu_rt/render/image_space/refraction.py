"""Image-space refraction: light through two borders of a mesh, by two passes of the rasteriser.

Wyman 2005; see ``glsl/image_space/refraction_front.frag``. The mesh is closed and evenly turned,
and what it is seen before is so far away that a direction is all that counts. What it gets wrong
is where the light leaves: it is right for a slab and good for what is convex.
"""
from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...accel.options import in_range
from ...gl.textures import make_texture, read_texture, release
from ...scene.camera import Camera
from .refractor import Refractor, view_uniforms

if TYPE_CHECKING:
    from ...tracer import Tracer

NOTHING, LEFT, UNSEEN, TOTAL = range(4)   # kinds: no mesh, as it should, exit not seen, reflected


class Refraction:
    """A scene's triangles as glass.

    Parameters
    ----------
    tracer : of the scene; traces how thick it is against the normals
    ior : refractive index inside over that outside, from 0.1 to 10
    smooth : blend normals between triangles; else each is flat
    """

    def __init__(self, tracer: Tracer, ior: float = 1.5, smooth: bool = True) -> None:
        self.ior = in_range("ior", ior, 0.1, 10)     # as of a material
        self.gpu, self.scene = tracer.gpu, tracer.scene
        self.mesh = Refractor(tracer, None, True, smooth)
        self.triangles, self.normals = self.mesh.triangles, self.mesh.normals

    def draw(self, camera: Camera | None = None,
             size: tuple[int, int] = (512, 512)) -> tuple[np.ndarray, np.ndarray]:
        """Where the light that arrives at each pixel comes from.

        Returns
        -------
        (h, w, 3) float32 unit directions away from the mesh, and (h, w) int8 kinds
        """
        camera = camera or self.scene.camera
        uniforms = {**view_uniforms(camera, size, self.scene.bounds), "ior": self.ior}
        with self.gpu:
            context = self.gpu.context
            back, leaving = (make_texture(self.gpu, size, 4, "refraction") for _ in range(2))
            depth = context.depth_renderbuffer(size)
            targets = [context.framebuffer([texture], depth) for texture in (back, leaving)]
            try:
                self.mesh.draw("refraction_back", targets[0], uniforms, farthest=True)
                self.mesh.draw("refraction_front", targets[1], uniforms,
                               read={"back_faces": back})
                found = read_texture(leaving)
            finally:
                release(targets, back, leaving, depth)
        return found[:, :, :3], found[:, :, 3].astype(np.int8)

    def release(self) -> None:
        """Free buffers; it is of no use afterwards."""
        self.mesh.release()
