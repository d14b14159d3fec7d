"""Refractor: a refracting or mirroring mesh, drawn by the rasteriser to find where light goes."""
from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import moderngl
import numpy as np

from ...accel.bounds import unit_normals
from ...gl.primitive_pass import PrimitivePass
from ...gl.textures import release
from ...scene.attributes import smooth_normals
from ...scene.camera import Camera

if TYPE_CHECKING:
    from ...tracer import Tracer

OFFSET = 1e-4     # offset of rays that measure the inner thickness, as a share of the mesh's size


class Refractor:
    """Triangles of a scene in a buffer. For each corner, the buffer holds the normal and the
    mesh's thickness along the inward normal.

    Parameters
    ----------
    tracer : the tracer of the scene, which measures the thickness
    rows : (k,) rows of the scene's triangles, or None for all
    closed : whether the triangles form a closed, consistently oriented mesh; else the thickness is
        0
    smooth : whether to interpolate normals between triangles

    Attributes
    ----------
    triangles, normals : (k, 3, 3) float32, facing outwards if the mesh is closed
    """

    def __init__(self, tracer: Tracer, rows: np.ndarray | None, closed: bool,
                 smooth: bool) -> None:
        triangles = tracer.scene.triangles if rows is None else tracer.scene.triangles[rows]
        self.gpu = tracer.gpu
        self.triangles = outward(triangles) if closed else triangles
        self.normals = corner_normals(self.triangles, smooth)
        corners, normals = self.triangles.reshape(-1, 3), self.normals.reshape(-1, 3)
        inner = np.zeros(len(corners))
        if closed:
            start = OFFSET * float(np.linalg.norm(np.ptp(corners, axis=0)))
            inner = tracer.trace(corners - start * normals, -normals).t
            inner = np.where(np.isfinite(inner), inner + start, 0)
        data = np.concatenate([corners, normals, inner[:, None]], axis=1).astype(np.float32)
        self._passes: dict[str, PrimitivePass] = {}
        with self.gpu:
            self._buffer = self.gpu.context.buffer(data.tobytes())

    def draw(self, name: str, target: moderngl.Framebuffer, uniforms: Mapping[str, object],
             farthest: bool = False, read: Mapping[str, moderngl.Texture] | None = None,
             defines: Mapping[str, object] | None = None) -> None:
        """Run ``glsl/image_space/<name>.frag`` over the nearest or the farthest surfaces.

        Parameters
        ----------
        name : the fragment program
        target : a framebuffer with a depth buffer; its colours and depths are cleared
        uniforms : uniforms by name; names that the program does not have are ignored
        farthest : whether to draw the farthest surfaces instead of the nearest
        read : textures by sampler name
        defines : the defines of the program
        """
        key = f"{name} {defines}"
        if key not in self._passes:
            made = PrimitivePass(self.gpu, f"image_space/{name}.frag",
                                 "image_space/refraction.vert", defines)
            made.take(self._buffer, "3f 3f 1f", "corner", "normal", "inner")
            self._passes[key] = made
        context = self.gpu.context
        try:
            context.enable_only(moderngl.DEPTH_TEST)
            context.depth_func = ">" if farthest else "<"
            self.gpu.clear(target, depth=0.0 if farthest else 1.0)
            self._passes[key].set(**uniforms)
            self._passes[key].draw(target, read or {}, moderngl.TRIANGLES)
        finally:
            context.depth_func = "<"
            context.enable_only(moderngl.NOTHING)

    def release(self) -> None:
        """Free all buffers."""
        with self.gpu:
            release(self._passes, self._buffer)


def view_uniforms(camera: Camera, size: tuple[int, int],
                  bounds: tuple[np.ndarray, np.ndarray]) -> dict[str, object]:
    """Return the uniforms of ``stages/cover.glsl`` for an image of a scene within ``bounds``."""
    right, up, forward = camera.basis(size)
    lo, hi = (np.asarray(corner, np.float64) for corner in bounds)
    farthest = 1.01 * float(np.linalg.norm(np.maximum(abs(lo - camera.eye),
                                                      abs(hi - camera.eye))))
    return {"eye": camera.eye, "right": tuple(right), "up": tuple(up), "forward": tuple(forward),
            "size": size, "nearest": 1e-3 * farthest, "farthest": farthest}


def outward(triangles: np.ndarray) -> np.ndarray:
    """Return the (n, 3, 3) triangles of a closed mesh, all flipped if they face inwards."""
    v0, v1, v2 = (triangles - triangles.mean((0, 1))).astype(np.float64).transpose(1, 0, 2)
    inwards = (v0 * np.cross(v1, v2)).sum() < 0
    return np.ascontiguousarray(triangles[:, ::-1]) if inwards else triangles


def corner_normals(triangles: np.ndarray, smooth: bool) -> np.ndarray:
    """Return (n, 3, 3) float32 unit normals of the corners of (n, 3, 3) triangles."""
    if smooth:
        return smooth_normals(triangles)
    return np.repeat(unit_normals(triangles)[:, None], 3, axis=1)
