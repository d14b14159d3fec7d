"""Ray bundles: diffuse global illumination by parallel projections with depth peeling.

The method is that of Szirmay-Kalos (1998) and Hachisuka (2005; survey, section 5); see
``glsl/image_space/bundle_peel.frag``. All surfaces are diffuse, and are divided into patches of
constant radiance. Light travels between patches both ways along a fixed set of directions
(`RayBundles.solve`). The visible points then gather light along another set of directions
(`RayBundles.draw`). Few of these directions would meet a small lamp, so by default, shadow rays
find the direct light of lamps.
"""
from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import moderngl
import numpy as np

from ...accel.options import in_range
from ...errors import LimitError, OptionError, SceneError
from ...gl.full_screen import FullScreenPass
from ...gl.primitive_pass import PrimitivePass
from ...gl.record import EXACT_INTEGER, TABLE_WIDTH_LOG2, streams_glsl
from ...gl.textures import TABLE_WIDTH, make_texture, read_texture, release, table_textures
from ...reference.sampling import frames_around
from ...scene.camera import Camera
from ...scene.scene import Scene
from ...traversal.triangle_table import TRIANGLE, triangle_table
from .patches import SPREAD_2, areas_and_normals, cuts_of, divided, straight_light
from .records import LAYER, LEAVING
from .visible import Visible, placed

if TYPE_CHECKING:
    from ...tracer import Tracer

STRAIGHT = ("traced", "bundles")
FAR = 1e30           # a depth behind all surfaces
MOST_LAYERS = 4096   # a projection with more layers is an error
# The smallest patch, as a share of the scene's extent.
LEAST_PATCH = 1e-6
LIFTED = 0.2         # offset of receiving points from their surface, in pixels of a projection
NEARER = replace(LAYER, name="nearer")


class RayBundles:
    """Computes the diffuse light of a scene.

    Parameters
    ----------
    tracer : the tracer of the scene; it traces first hits and shadow rays
    patch : the longest edge of a patch, as a share of the scene's extent, from 1e-6 to 1
    resolution : pixels along a side of a projection
    straight : the method for direct light of lamps: "traced" uses shadow rays; "bundles" exchanges
        this light like all other light, and suits only large lamps
    samples : with "traced", the number of shadow rays from each point to all emitting triangles
        together

    Attributes
    ----------
    triangles, parent : (m, 3, 3) the patches, and (m,) the scene's triangle of each patch
    leaving : (m, 2, 3) the radiance that leaves each patch after `solve`, on the side of its
        normal and on the other side; without emission if ``straight`` is "traced"
    weights : (m, 2) for each side, the sum of the cosine weights of the rays that met the side in
        the last exchange of light. With many directions and pixels, the sum approaches pi
    layers : the largest number of layers of a projection so far; layer k shows the k-th surface
        from the front at each pixel
    """

    def __init__(self, tracer: Tracer, patch: float = 0.1, resolution: int = 128,
                 straight: str = "traced", samples: int = 64) -> None:
        scene = tracer.scene
        _check(scene, straight)
        patch = in_range("patch", patch, LEAST_PATCH, 1)
        resolution = in_range("resolution", resolution, 4, EXACT_INTEGER, int)
        samples = in_range("samples", samples, 1, EXACT_INTEGER, int)
        self.tracer, self.gpu, self.scene = tracer, tracer.gpu, scene
        self.straight, self.samples, self.resolution = straight, samples, resolution
        longest = patch * max(scene.extent, 1e-30)
        count = int((cuts_of(scene.triangles, longest) ** 2).sum())
        if 2 * count > EXACT_INTEGER:      # check first: `divided` could use all memory
            raise LimitError(f"{count:,} patches have more than 2^24 sides; make patch larger")
        self.triangles, self.parent = divided(scene.triangles, longest)
        self.albedo = scene.colours[self.parent].astype(np.float64)
        emission = np.array([m.emission for m in scene.materials])
        self.emission = emission[scene.material_of[self.parent]]
        self.leaving = np.zeros((len(self.triangles), 2, 3))
        self.weights = np.zeros((len(self.triangles), 2))
        self.layers = 0
        lo, hi = (corner.astype(np.float64) for corner in scene.bounds)
        self._centre, self._reach = (lo + hi) / 2, max(float(np.linalg.norm(hi - lo)) / 2, 1e-30)
        # Two pixels are spare, because `_bundles` shifts each grid of pixels by a part of a pixel.
        self.pixel_size = 2 * self._reach / (resolution - 2)
        with self.gpu:
            self._tables = table_textures(self.gpu, TRIANGLE,
                                          triangle_table(self.triangles)[TRIANGLE.name])
            self._make_passes()
            self._make_targets()

    def _make_passes(self) -> None:
        constants = f"#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}"
        tables = TRIANGLE.table_glsl()
        self._peel = PrimitivePass(
            self.gpu, "image_space/bundle_peel.frag", "image_space/bundle_peel.vert", virtual={
                "constants": constants, "tables": tables,
                "streams": streams_glsl([NEARER], [LAYER])})
        read = {"constants": constants, "streams": streams_glsl([NEARER, LAYER], []),
                "tables": tables + "\n" + LEAVING.table_glsl()}
        self._exchange = PrimitivePass(self.gpu, "image_space/arrived.frag",
                                       "image_space/bundle_exchange.vert", virtual=read)
        self._gather = FullScreenPass(self.gpu, "image_space/bundle_gather.frag", {}, read)

    def _make_targets(self) -> None:
        context, size = self.gpu.context, (self.resolution, self.resolution)
        self._layers = [make_texture(self.gpu, size, 4, "layers of a ray bundle")
                        for _ in range(2)]
        self._depth = context.depth_renderbuffer(size)
        self._targets = [context.framebuffer([layer], self._depth) for layer in self._layers]
        rows = max(1, -(-2 * len(self.triangles) // TABLE_WIDTH))
        self._arriving = context.framebuffer([
            make_texture(self.gpu, (TABLE_WIDTH, rows), 4, "light that arrives at patches")])
        self._tables.update(table_textures(self.gpu, LEAVING, {
            "radiance": self.leaving.reshape(-1, 3)}))

    # Light from patch to patch --------------------------------------------------------------

    def solve(self, directions: int = 64, bounces: int = 8) -> np.ndarray:
        """Compute the radiance that leaves the patches, by exchanging light between them.

        Parameters
        ----------
        directions : the number of directions of bundles; light travels both ways along each
        bounces : the number of reflections from patch to patch; with 0, patches reflect only the
            direct light of lamps and sky

        Returns
        -------
        ``leaving``
        """
        directions = in_range("directions", directions, 1, EXACT_INTEGER, int)
        bounces = in_range("bounces", bounces, 0, EXACT_INTEGER, int)
        own = np.zeros_like(self.leaving)
        lit = np.zeros_like(self.leaving)
        if self.straight == "traced":
            _, normals = areas_and_normals(self.triangles)
            places = self.triangles.astype(np.float64).mean(axis=1)
            for side, normal in enumerate((normals, -normals)):
                lit[:, side] = straight_light(self.tracer, places, normal, self.samples)
        else:
            own += self.emission[:, None]
        reflected = self.albedo[:, None] / np.pi
        # The first exchange carries the direct light that shadow rays did not find: the sky's and,
        # unless ``straight`` is "traced", the lamps'. Omit it if shadow rays found all light.
        brought = self.straight == "traced" and self.scene.environment is None
        self.leave(own + reflected * lit if brought else own)
        for _ in range(bounces + (not brought)):
            self.leave(own + reflected * (lit + self._exchanged(directions)))
        return self.leaving

    def leave(self, radiance: np.ndarray) -> None:
        """Set the radiance that leaves the patches' sides, (m, 2, 3)."""
        self.leaving = radiance
        with self.gpu:
            self._tables.update(table_textures(self.gpu, LEAVING, {
                "radiance": radiance.reshape(-1, 3)}, into=self._tables))

    def _exchanged(self, directions: int) -> np.ndarray:
        """Return the irradiance of the patches' sides, (m, 2, 3), from the light of all
        patches."""
        target = self._arriving
        with self.gpu:
            self.gpu.clear(target)
            for uniforms in self._bundles(directions):
                self._exchange.set(**uniforms, target_rows=target.height)
                for nearer, layer in self._peeled(uniforms):
                    self._exchange.draw(target, self._read(nearer, layer), moderngl.POINTS,
                                        2 * self.resolution ** 2)
            self.gpu.context.enable_only(moderngl.NOTHING)
            sums = read_texture(target.color_attachments[0]).reshape(-1, 4)
        sums = sums[:2 * len(self.triangles)].astype(np.float64).reshape(-1, 2, 4)
        self.weights = sums[:, :, 3]
        return np.pi * sums[:, :, :3] / np.where(self.weights > 0, self.weights, 1)[:, :, None]

    # Light to the camera --------------------------------------------------------------------

    def gather(self, places: np.ndarray, normals: np.ndarray, directions: int = 256
               ) -> np.ndarray:
        """Return the irradiance at points from the light that leaves the patches.

        Parameters
        ----------
        places : (h, w, 3) points
        normals : (h, w, 3) unit normals that point to the lit side; zero at pixels without a point
        directions : the number of directions of bundles

        Returns
        -------
        (h, w, 3) float32
        """
        directions = in_range("directions", directions, 1, EXACT_INTEGER, int)
        with self.gpu, placed(self.gpu, places, normals, 4) as (target, given):
            self.gpu.clear(target)
            for uniforms in self._bundles(directions):
                self._gather.set(**uniforms, lift=LIFTED * self.pixel_size)
                for nearer, layer in self._peeled(uniforms):
                    self._gather.draw(target, {**self._read(nearer, layer), **given})
            sums = read_texture(target.color_attachments[0])
        return np.pi * sums[:, :, :3] / np.where(sums[:, :, 3:] > 0, sums[:, :, 3:], 1)

    def draw(self, camera: Camera | None = None, size: tuple[int, int] = (256, 256),
             directions: int = 256) -> np.ndarray:
        """Return a camera's picture after `solve`, (h, w, 3) float32 radiance, row 0 at the
        top."""
        seen = Visible.of(self.tracer, camera, size)
        hit, row = seen.hits.hit, seen.hits.triangle
        light = self.gather(seen.places, seen.normals, directions).reshape(-1, 3)
        if self.straight == "traced":
            light[hit] += straight_light(self.tracer, seen.places.reshape(-1, 3)[hit],
                                         seen.normals.reshape(-1, 3)[hit], self.samples)
        shown = np.zeros_like(light)
        emission = np.array([m.emission for m in self.scene.materials])
        shown[hit] = (emission[self.scene.material_of[row[hit]]]
                      + self.scene.colours[row[hit]] / np.pi * light[hit])
        if self.scene.environment is not None:
            shown[~hit] = self.scene.environment.radiance(seen.directions.reshape(-1, 3)[~hit])
        return shown.reshape(seen.places.shape)

    # Projections ----------------------------------------------------------------------------

    def _bundles(self, directions: int) -> Iterator[dict[str, object]]:
        """Yield the uniforms of each projection."""
        frames = frames_around(half_sphere(directions))
        shifts = (0.5 + np.arange(1, directions + 1)[:, None] * SPREAD_2) % 1 - 0.5
        sky = self.scene.environment
        for frame, shift in zip(frames, shifts):
            before, behind = (sky.radiance(np.stack([-frame[2], frame[2]])) if sky is not None
                              else np.zeros((2, 3)))
            yield {"centre": tuple(self._centre), "reach": self._reach,
                   "across": tuple(frame[0]), "upward": tuple(frame[1]),
                   "along": tuple(frame[2]), "shift": tuple(shift),
                   "pixel_size": self.pixel_size,
                   "resolution": self.resolution, "weight": 2 * np.pi / directions,
                   "sky_before": tuple(before), "sky_behind": tuple(behind)}

    def _peeled(self, uniforms: dict[str, object]
                ) -> Iterator[tuple[moderngl.Texture, moderngl.Texture]]:
        """Yield each pair of neighbouring layers as two textures, nearest pair first. The caller's
        draws are blended by addition.

        The front layer of the first pair and the back layer of the last pair are empty. An
        occlusion query finds the last layer."""
        context = self.gpu.context
        context.blend_func = moderngl.ONE, moderngl.ONE
        self._peel.set(**uniforms)
        self.gpu.clear(self._targets[1], -FAR, 0.0, 0.0, -1.0)
        for count in range(MOST_LAYERS + 1):    # the last iteration finds no further layer
            target, nearer = self._targets[count % 2], self._layers[1 - count % 2]
            self.gpu.clear(target, FAR, 0.0, 0.0, -1.0, depth=1.0)
            context.enable_only(moderngl.DEPTH_TEST)
            query = self.gpu.query()
            with query:
                self._peel.draw(target, self._read(nearer, None), moderngl.TRIANGLES,
                                3 * len(self.triangles))
            context.enable_only(moderngl.BLEND)
            yield nearer, self._layers[count % 2]
            if not query.samples:
                self.layers = max(self.layers, count)
                return
        raise LimitError(f"a projection has more than {MOST_LAYERS} layers; use a smaller scene")

    def _read(self, nearer: moderngl.Texture, layer: moderngl.Texture | None
              ) -> dict[str, moderngl.Texture]:
        textures = {**self._tables, "nearer_texel_0": nearer}
        return textures if layer is None else {**textures, "layer_texel_0": layer}

    def release(self) -> None:
        """Free textures and programs."""
        with self.gpu:
            textures = [*self._layers, *self._arriving.color_attachments, *self._tables.values()]
            release(self._peel, self._exchange, self._gather, self._targets, self._arriving,
                    self._depth, textures)


def half_sphere(count: int) -> np.ndarray:
    """Return (count, 3) unit directions, evenly distributed over the hemisphere around z: a spiral
    with equal steps in height and the golden angle between steps."""
    z = (np.arange(count) + 0.5) / count
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), z], axis=1)


def _check(scene: Scene, straight: str) -> None:
    if straight not in STRAIGHT:
        raise OptionError(f"straight={straight!r} is none of {', '.join(STRAIGHT)}")
    for material in scene.used_materials:
        if material.ior or any(material.mirror) or any(material.glossy) or material.texture:
            raise SceneError(f"{scene.name}: material {material.name} is not purely diffuse; ray "
                             "bundles carry only diffuse light, so use integrator=path")
