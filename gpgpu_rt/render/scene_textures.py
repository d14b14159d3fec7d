"""Scene textures: the tables and images that `SceneNeeds` lists, for a picture's shaders."""
from __future__ import annotations

import moderngl
import numpy as np

from ..gl.context import Gpu
from ..gl.precision import Precision
from ..gl.textures import make_texture, release, table_textures, texture_bytes
from ..scene.scene import Scene
from .images import atlas
from .needs import SceneNeeds, image_light

BLACK = np.zeros((1, 1, 4), np.float32)


class SceneTextures:
    """The tables, images and uniforms of a scene's appearance."""

    def __init__(self, gpu: Gpu, needs: SceneNeeds, precision: Precision) -> None:
        self.gpu, self.needs, self.precision = gpu, needs, precision
        self.tables: dict[str, dict[str, moderngl.Texture]] = {}
        self.images: dict[str, moderngl.Texture] = {}

    def take(self, scene: Scene) -> None:
        """Write the tables of a scene, and make its images at the first call. Later calls, for
        moved triangles, reuse the textures and images."""
        for table in self.needs.tables:
            precision = self.precision if table.geometric else None
            record = precision.layout(table.record) if precision else table.record
            self.tables[record.name] = table_textures(
                self.gpu, record, table.pack(scene), precision, self.tables.get(record.name))
        for name in self.needs.images:
            if name not in self.images:
                self.images[name] = self._image(name, scene)

    def _image(self, name: str, scene: Scene) -> moderngl.Texture:
        texels = atlas(scene) if name == "images" else BLACK
        if name == "surroundings_image" and scene.environment and scene.environment.image:
            texels = np.pad(scene.environment.image.texels, ((0, 0), (0, 0), (0, 1)))
        if name == "surroundings_sums":
            light = image_light(scene)
            texels = np.ones((1, 1, 1)) if light is None else light.cells[..., None]
        height, width, components = texels.shape
        return make_texture(self.gpu, (width, height), components, name.replace("_", " "), texels,
                            "f4" if name == "surroundings_sums" else "f2")

    def tables_glsl(self) -> str:
        """Return the GLSL accessors of the tables."""
        return "\n".join((self.precision.layout(table.record) if table.geometric
                          else table.record).table_glsl() for table in self.needs.tables)

    def samplers(self) -> dict[str, moderngl.Texture]:
        return {**self.images, **{name: texture for table in self.tables.values()
                                  for name, texture in table.items()}}

    def texels(self) -> dict[str, int]:
        """Return the number of texels that a fragment reads, by sampler name."""
        counts = {name: 4 for name in self.images}
        for table in self.needs.tables:
            record = self.precision.layout(table.record) if table.geometric else table.record
            counts.update({f"{record.name}{p.suffix}_table": p.texels for p in record.planes})
        return counts

    def uniforms(self, scene: Scene) -> dict[str, object]:
        """Return the uniforms of a scene's appearance."""
        uniforms: dict[str, object] = {
            "only_material": int(scene.material_of[0]) if len(scene) else 0,
            "only_diffuse": tuple(scene.colours[0].tolist()) if len(scene) else (0.0,) * 3}
        environment = scene.environment
        if environment is not None:
            uniforms.update(
                surroundings_kind=("backdrop", "sky", "image").index(environment.kind),
                zenith=environment.zenith, ground=environment.ground,
                ambient_terms=[tuple(row) for row in environment.ambient().tolist()])
        else:
            uniforms.update(surroundings_kind=-1, ambient_terms=[(0.0,) * 3] * 4)
        return uniforms

    def bytes(self) -> dict[str, int]:
        """Return the bytes of each table and image, by name."""
        return {**{name: texture_bytes(table.values()) for name, table in self.tables.items()},
                **{name: texture_bytes([image]) for name, image in self.images.items()}}

    def release(self) -> None:
        release(self.samplers())
