"""Visible: the points and normals of a camera's first hits, as images for further passes."""
from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import moderngl
import numpy as np

from ...errors import OptionError
from ...gl.context import Gpu
from ...gl.textures import make_texture, release, vector_texture
from ...hits import Hits
from ...scene.camera import Camera
from .patches import areas_and_normals

if TYPE_CHECKING:
    from ...tracer import Tracer


@dataclass
class Visible:
    """The first hits of an image of (height, width) pixels, row 0 at the top.

    Attributes
    ----------
    places : (h, w, 3) float32 hit points; zeros for a miss
    normals : (h, w, 3) float32 normals of the hit triangles' planes, towards the camera; zeros for
        a miss
    directions : (h, w, 3) float32 directions of the eye rays
    hits : (h * w,) the hits
    """

    places: np.ndarray
    normals: np.ndarray
    directions: np.ndarray
    hits: Hits

    @classmethod
    def of(cls, tracer: Tracer, camera: Camera | None, size: tuple[int, int],
           first_hits: str = "traced") -> Visible:
        """Return the first hits of an image. The parameters are as for ``Tracer.eye_hits``."""
        camera = camera or tracer.scene.camera
        hits = tracer.eye_hits(camera, size, first_hits)
        origins, directions = camera.rays(size)
        shape = directions.shape
        rows, hit = hits.triangle, hits.hit
        places, normals = np.zeros((len(hits), 3)), np.zeros((len(hits), 3))
        corners = tracer.scene.triangles[rows[hit]].astype(np.float64)
        weights = np.stack([1 - hits.u - hits.v, hits.u, hits.v], axis=1)[hit]
        places[hit] = np.einsum("nc,ncx->nx", weights, corners)
        _, normals[hit] = areas_and_normals(corners)
        away = (normals * directions.reshape(-1, 3)).sum(1) > 0
        normals[away] *= -1
        return cls(places.reshape(shape).astype(np.float32),
                   normals.reshape(shape).astype(np.float32), directions, hits)


@contextmanager
def placed(gpu: Gpu, places: np.ndarray, normals: np.ndarray, components: int
           ) -> Iterator[tuple[moderngl.Framebuffer, dict[str, moderngl.Texture]]]:
    """Yield a framebuffer with a texel for each place, and textures of the places and normals. The
    end of the ``with`` block frees all three.

    Parameters
    ----------
    gpu : the OpenGL context
    places, normals : (h, w, 3) points, and their normals
    components : the number of components of the framebuffer's texture

    Raises
    ------
    OptionError
        an array does not have the shape (h, w, 3), or the two shapes differ
    """
    shapes = np.shape(places), np.shape(normals)
    if len(shapes[0]) != 3 or shapes[0][2] != 3 or shapes[0] != shapes[1] or 0 in shapes[0]:
        raise OptionError(f"places and normals have the shapes {shapes[0]} and {shapes[1]}; give "
                          "both as (h, w, 3)")
    made: list[object] = []
    try:
        given = {}
        for name, vectors in (("places", places), ("normals", normals)):
            given[name] = vector_texture(gpu, np.asarray(vectors), name)
            made.append(given[name])
        made.append(make_texture(gpu, shapes[0][1::-1], components, "light at places"))
        target = gpu.context.framebuffer([made[-1]])
        made.append(target)
        yield target, given
    finally:
        gpu.context.enable_only(moderngl.NOTHING)     # turn blending off after an error
        release(made)
