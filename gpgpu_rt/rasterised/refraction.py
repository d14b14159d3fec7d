"""Image-space refraction: light through two borders of a mesh, by two passes of the rasteriser.

Wyman 2005; see ``glsl/passes/refraction_front.frag``. The mesh is closed and evenly turned, and
what it is seen before is so far away that a direction is all that counts. What it gets wrong is
where the light leaves: it is right for a slab and good for what is convex.
"""
from __future__ import annotations

import moderngl
import numpy as np

from ..appearance.attributes import smooth_normals
from ..camera import Camera
from ..passes.primitive_pass import PrimitivePass
from ..rays import unit_normals
from ..textures import make_texture, read_texture, release
from ..tracer import Tracer

NOTHING, LEFT, UNSEEN, TOTAL = range(4)   # kinds: no mesh, as it should, exit not seen, reflected
OFFSET = 1e-4     # of the mesh's size: where rays for the inner thickness begin


class Refraction:
    """A scene's triangles as glass.

    Parameters
    ----------
    tracer : of the scene; traces how thick it is against the normals
    ior : refractive index inside over that outside
    smooth : blend normals between triangles; else each is flat
    """

    def __init__(self, tracer: Tracer, ior: float = 1.5, smooth: bool = True) -> None:
        scene = tracer.scene
        self.gpu, self.ior, self.scene = tracer.gpu, ior, scene
        self.triangles = outward(scene.triangles)
        self.normals = corner_normals(self.triangles, smooth)
        lo, hi = scene.bounds
        corners, normals = self.triangles.reshape(-1, 3), self.normals.reshape(-1, 3)
        start = OFFSET * float(np.linalg.norm(hi - lo))
        inner = tracer.trace(corners - start * normals, -normals).t
        inner = np.where(np.isfinite(inner), inner + start, 0)
        data = np.concatenate([corners, normals, inner[:, None]], axis=1).astype(np.float32)
        with self.gpu:
            self._buffer = self.gpu.context.buffer(data.tobytes())
            self._passes = {name: self._make(name) for name in ("back", "front")}

    def _make(self, name: str) -> PrimitivePass:
        made = PrimitivePass(self.gpu, f"passes/refraction_{name}.frag", "passes/refraction.vert")
        made.label = f"refraction, {name}"
        made.take(self._buffer, "3f 3f 1f", "corner", "normal", "inner")
        return made

    def draw(self, camera: Camera | None = None,
             size: tuple[int, int] = (512, 512)) -> tuple[np.ndarray, np.ndarray]:
        """Where the light that arrives at each pixel comes from.

        Returns
        -------
        (h, w, 3) float32 unit directions away from the mesh, and (h, w) int8 kinds
        """
        camera = camera or self.scene.camera
        right, up, forward = camera.basis(size)
        lo, hi = (np.asarray(corner, np.float64) for corner in self.scene.bounds)
        farthest = 1.01 * float(np.linalg.norm(np.maximum(abs(lo - camera.eye),
                                                          abs(hi - camera.eye))))
        uniforms = {"eye": camera.eye, "right": tuple(right), "up": tuple(up),
                    "forward": tuple(forward), "size": size, "nearest": 1e-3 * farthest,
                    "farthest": farthest, "ior": self.ior}
        with self.gpu:
            context = self.gpu.context
            back, leaving = (make_texture(self.gpu, size, 4, "refraction") for _ in range(2))
            depth = context.depth_renderbuffer(size)
            try:
                context.enable_only(moderngl.DEPTH_TEST)
                for name, texture, func, end in (("back", back, ">", 0.0),
                                                 ("front", leaving, "<", 1.0)):
                    context.depth_func = func
                    target = context.framebuffer([texture], depth)
                    target.clear(0.0, 0.0, 0.0, 0.0, depth=end)
                    self._passes[name].set(**uniforms)
                    self._passes[name].draw(target, {"back_faces": back}, moderngl.TRIANGLES)
                    release(target)
                found = read_texture(leaving)
            finally:
                context.depth_func = "<"
                context.enable_only(moderngl.NOTHING)
                release(back, leaving, depth)
        return found[:, :, :3], found[:, :, 3].astype(np.int8)

    def release(self) -> None:
        """Free buffers; it is of no use afterwards."""
        with self.gpu:
            release(self._passes, self._buffer)


def outward(triangles: np.ndarray) -> np.ndarray:
    """(n, 3, 3) triangles of a closed mesh, all turned over if they face inwards."""
    v0, v1, v2 = (triangles - triangles.mean((0, 1))).astype(np.float64).transpose(1, 0, 2)
    inwards = (v0 * np.cross(v1, v2)).sum() < 0
    return np.ascontiguousarray(triangles[:, ::-1]) if inwards else triangles


def corner_normals(triangles: np.ndarray, smooth: bool) -> np.ndarray:
    """(n, 3, 3) float32 unit normals of the corners of (n, 3, 3) triangles."""
    if smooth:
        return smooth_normals(triangles)
    return np.repeat(unit_normals(triangles)[:, None], 3, axis=1)
