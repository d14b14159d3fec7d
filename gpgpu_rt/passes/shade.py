"""The passes around traversal that make a picture: eye rays, surfaces and shadow rays, colours."""
from __future__ import annotations

from dataclasses import replace

import moderngl
import numpy as np

from ..approach import FAR, NEAR, sphere
from ..camera import Camera
from ..column import Column
from ..gpu import Gpu
from ..methods.brute_force import triangle_table
from ..options import word_define
from ..precision import Precision
from ..ray_state import RayTextures, StateBuffer, stream_samplers
from ..rays import unit_normals
from ..record import TABLE_WIDTH_LOG2
from ..scene import Scene
from ..texel_layout import HIT, LIT, RAY_TEXELS, SURFACE, TRIANGLE
from ..textures import read_texture, stream_textures, table_textures, texture_bytes
from .full_screen import FullScreenPass
from .packet_room import PacketHits


class Shading:
    """Diffuse surfaces under one point light with hard shadows, for one scene.

    Parameters
    ----------
    intersection : the triangle test, which shadow rays are spawned clear of
    """

    def __init__(self, gpu: Gpu, scene: Scene, precision: Precision, intersection: str) -> None:
        self.gpu, self.precision = gpu, precision
        self.surface_tables: dict[str, moderngl.Texture] = {}
        self.take(scene)
        triangle = precision.layout(TRIANGLE)
        rays, hit = precision.layout(RAY_TEXELS), precision.layout(HIT)
        read, write = (lambda r: r.stream_glsl(writes=False)), (lambda r: r.stream_glsl(True))
        self._eye = FullScreenPass(gpu, "passes/eye_rays.frag", precision.defines(),
                                   {"streams": write(rays)})
        shadow = replace(rays, name="shadow_rays")
        self._surfaces = FullScreenPass(
            gpu, "passes/surfaces.frag",
            {"TABLE_WIDTH_LOG2": TABLE_WIDTH_LOG2, **precision.defines(),
             word_define("INTERSECTION", intersection): True},
            {"streams": "\n".join((read(rays), read(hit), write(shadow),
                                   LIT.stream_glsl(True, first_target=shadow.texels))),
             "tables": SURFACE.table_glsl() + "\n" + triangle.table_glsl()})
        self._picture = FullScreenPass(gpu, "passes/picture.frag", {},
                                       {"streams": "\n".join((read(LIT), read(hit)))})
        self._size: tuple[int, int] | None = None

    def take(self, scene: Scene) -> None:
        """Shade this scene from now on: the same one, or one whose triangles moved."""
        self.scene = scene
        surface = {"diffuse": scene.colours, "normal": Column(
            len(scene), lambda rows: unit_normals(scene.triangles[rows]))}
        # The tracer's own table has its method's order; hits count in the scene's.
        triangle = triangle_table(scene.triangles)[TRIANGLE.name]
        self.surface_tables = {
            **table_textures(self.gpu, SURFACE, surface, into=self.surface_tables),
            **table_textures(self.gpu, self.precision.layout(TRIANGLE), triangle, self.precision,
                             self.surface_tables)}

    def eye_rays(self, rays: RayTextures, camera: Camera) -> None:
        """Write the rays through the pixel centres of an image as large as ``rays``."""
        self._make_room(rays.size)
        right, up, forward = (tuple(axis) for axis in camera.basis(rays.size))
        centre, radius = sphere(*self.scene.bounds)
        far = np.linalg.norm(np.subtract(camera.eye, centre)) > FAR * radius
        self._eye.set(eye=camera.eye, right=right, up=up, forward=forward, size=rays.size,
                      centre=tuple(centre), beyond=NEAR * radius if far else 0.0)
        self._eye.draw(rays.target, {})
        rays.share_start(None if far else np.float32([*camera.eye, 0]))

    def surfaces(self, rays: RayTextures, hits: StateBuffer | PacketHits) -> RayTextures:
        """What the light gives each hit, and the rays from there towards the light."""
        light = self.scene.light
        self._surfaces.set(light_position=light.position, light_intensity=light.intensity)
        self._surfaces.draw(self._target, {**rays.samplers(), **hits.samplers(),
                                           **self.surface_tables})
        return self.shadow_rays

    def picture(self, shadows: StateBuffer | PacketHits) -> np.ndarray:
        """(height, width, 3) uint8 sRGB; light arrives where no shadow ray hit anything."""
        self._picture.draw(self._screen, {**stream_samplers(LIT.name, self.lit),
                                          **shadows.samplers()})
        return (read_texture(self._screen.color_attachments[0])[:, :, :3] * 255 + 0.5).astype(
            np.uint8)

    def bytes(self) -> int:
        """Bytes of the textures that shading adds."""
        tables = list(self.surface_tables.values())
        if self._size is None:
            return texture_bytes(tables)
        return texture_bytes([*tables, *self.shadow_rays.textures, *self.lit,
                              *self._screen.color_attachments])

    def _make_room(self, size: tuple[int, int]) -> None:
        if self._size == size:
            return
        self._release_room()
        self._size = size
        self.shadow_rays = RayTextures(self.gpu, size, self.precision)
        self.lit = stream_textures(self.gpu, LIT, size)
        self._target = self.gpu.context.framebuffer([*self.shadow_rays.textures, *self.lit])
        screen = stream_textures(self.gpu, LIT, size)[:1]
        self._screen: moderngl.Framebuffer = self.gpu.context.framebuffer(screen)

    def _release_room(self) -> None:
        if self._size is None:
            return
        textures = [*self.lit, *self._screen.color_attachments]
        self.gpu.release(self._target)
        self.gpu.release(self._screen)
        for texture in textures:
            texture.release()
        self.shadow_rays.release()
        self._size = None

    def release(self) -> None:
        self._release_room()
        for texture in self.surface_tables.values():
            texture.release()
        for program in (self._eye, self._surfaces, self._picture):
            program.release()
