"""Image-space refraction: refracts light at two interfaces of a mesh, by two rasteriser passes.

The method is Wyman's (2005); see ``glsl/image_space/refraction_front.frag``. It needs a
closed, consistently oriented mesh. The background counts as infinitely far away, so only the
direction of the light matters. The point at which light leaves the mesh is an estimate, exact for
a slab and good for a convex mesh.
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

# Kinds of pixels. NOTHING: no mesh is visible. LEFT: light leaves the mesh. UNSEEN: the exit lies
# outside the mesh's image in the first pass. TOTAL: light is totally reflected.
NOTHING, LEFT, UNSEEN, TOTAL = range(4)


class Refraction:
    """A renderer that treats all triangles of a scene as glass.

    Parameters
    ----------
    tracer : the tracer of the scene; it measures the mesh's thickness along the inward normals
    ior : refractive index inside the mesh divided by the index outside, from 0.1 to 10
    smooth : whether to interpolate normals between triangles
    """

    def __init__(self, tracer: Tracer, ior: float = 1.5, smooth: bool = True) -> None:
        self.ior = in_range("ior", ior, 0.1, 10)     # the range of `Material.ior`
        self.gpu, self.scene = tracer.gpu, tracer.scene
        self.mesh = Refractor(tracer, None, True, smooth)
        self.triangles, self.normals = self.mesh.triangles, self.mesh.normals

    def draw(self, camera: Camera | None = None,
             size: tuple[int, int] = (512, 512)) -> tuple[np.ndarray, np.ndarray]:
        """Return the direction in which the eye ray of each pixel leaves the mesh.

        Parameters
        ----------
        camera : by default the scene's own camera
        size : (width, height) pixels

        Returns
        -------
        (h, w, 3) float32 unit directions away from the mesh, and (h, w) int8 kinds of pixels
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
        """Free all buffers."""
        self.mesh.release()
