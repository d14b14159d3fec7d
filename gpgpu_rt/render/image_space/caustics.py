"""Caustics mapping: the light that glass, water or mirrors focus on other surfaces.

The image-space method is that of Shah, Konttinen and Pattanaik (2007; survey, section 5); see
``glsl/image_space/caustic_splat.vert``. A camera at a point light draws an image of the refractor,
which is the glass, water or mirror. Each pixel of this image is a photon. A second, wider camera
at the light draws an image of the receivers, which are all other surfaces. A photon searches the
second image for the point where it lands.
"""
from __future__ import annotations

from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np

from ...accel.options import in_range
from ...errors import OptionError, SceneError
from ...gl.full_screen import FullScreenPass
from ...gl.primitive_pass import PrimitivePass
from ...gl.record import EXACT_INTEGER, TABLE_WIDTH_LOG2
from ...gl.textures import make_texture, read_texture, release, table_textures, write_texture
from ...scene.camera import Camera
from ...traversal.triangle_table import TRIANGLE, triangle_table
from .photons import traced_photons
from .refractor import Refractor, corner_normals, view_uniforms
from .visible import Visible, placed

if TYPE_CHECKING:
    from ...tracer import Tracer

MIRROR, SURFACE, CLOSED = range(3)    # values of BORDERS in caustic_photons.frag
WIDEST = np.radians(80)               # largest half angle of an image from the light


class Caustics:
    """The caustic of a scene's dielectrics, or of its mirrors, from a point light.

    Parameters
    ----------
    tracer : the tracer of a scene with a dielectric or a mirror
    light : (3,) position of the light, outside the refractor
    photons : pixels along a side of the refractor's image
    resolution : pixels along a side of the receivers' image, and of the caustic map
    spread : the width of the receivers' image, divided by the width of the refractor's image, at
        equal distances from the light
    splat : side in pixels of the square that a photon covers in the caustic map
    iterations : number of successive estimates of the point where a photon lands
    smooth : whether to interpolate the refractor's normals

    Attributes
    ----------
    camera, wide : the cameras at the light, for the refractor and for the receivers
    borders : 0 for a mirror, 1 for an open surface with glass or water behind it, 2 for a closed
        surface of glass
    """

    def __init__(self, tracer: Tracer, light: Any, photons: int = 256, resolution: int = 256,
                 spread: float = 3.0, splat: int = 3, iterations: int = 5,
                 smooth: bool = True) -> None:
        photons, resolution, splat, iterations = (
            in_range(name, value, 1, EXACT_INTEGER, int) for name, value in (
                ("photons", photons), ("resolution", resolution), ("splat", splat),
                ("iterations", iterations)))
        spread = in_range("spread", spread, 1, np.inf)
        place = np.asarray(light, np.float64) if np.shape(light) == (3,) else np.full(3, np.nan)
        if not np.isfinite(place).all():
            raise OptionError(f"the light is at {light}; give three finite numbers")
        with tracer.gpu:        # OpenGL shrinks points above this size, which would lose light
            largest = int(tracer.gpu.context.info["GL_POINT_SIZE_RANGE"][1])
        if splat > largest:
            raise OptionError(f"splat is {splat}; give at most {largest}, the largest point that "
                              "this renderer draws")
        scene = tracer.scene
        self.tracer, self.gpu, self.scene = tracer, tracer.gpu, scene
        self.photons, self.resolution = photons, resolution
        self.splat, self.iterations, self.smooth = splat, iterations, smooth
        self.rows, self.ior, self.reflectance = turning(tracer)
        corners = scene.triangles[self.rows]
        self.borders = MIRROR if not self.ior else CLOSED if is_closed(corners) else SURFACE
        self.mesh = Refractor(tracer, self.rows, self.borders == CLOSED, smooth)
        if not np.array_equal(self.mesh.triangles, corners):
            raise SceneError(f"{scene.name}: the triangles of the glass face inwards, as if the "
                             "mesh were a hollow in glass; flip the triangles")
        self.camera, self.wide = _views(place, corners, spread)
        receivers = np.delete(scene.triangles, self.rows, axis=0)
        self._corners = 3 * len(receivers)
        read = {"constants": f"#define TABLE_WIDTH_LOG2 {TABLE_WIDTH_LOG2}",
                "tables": TRIANGLE.table_glsl()}
        with self.gpu:
            self._tables = table_textures(self.gpu, TRIANGLE,
                                          triangle_table(receivers)[TRIANGLE.name])
            self._receive = PrimitivePass(self.gpu, "image_space/caustic_receivers.frag",
                                          "image_space/caustic_receivers.vert", virtual=read)
            self._splats = {words: PrimitivePass(
                self.gpu, "image_space/arrived.frag", "image_space/caustic_splat.vert",
                virtual={"constants": "".join(f"#define {word}\n" for word in words)})
                for words in ((), ("KNOWN",), ("HOME",))}
            self._look = FullScreenPass(self.gpu, "image_space/caustic_look.frag")
            self._make_targets()

    def _make_targets(self) -> None:
        context = self.gpu.context
        few, many = (self.photons,) * 2, (self.resolution,) * 2
        self._textures = {
            **{name: make_texture(self.gpu, few, 4, "photons")
               for name in ("back_faces", "leaving", "start", "landed")},
            **{name: make_texture(self.gpu, many, 4, "a caustic")
               for name in ("receivers", "caustic")}}
        self._depths = [context.depth_renderbuffer(size) for size in (few, many)]

        def target(depth: Any, *names: str) -> moderngl.Framebuffer:
            return context.framebuffer([self._textures[name] for name in names], depth)
        self._targets = {"back": target(self._depths[0], "back_faces"),
                         "front": target(self._depths[0], "leaving", "start"),
                         "receivers": target(self._depths[1], "receivers"),
                         "landed": target(None, "landed"), "caustic": target(None, "caustic")}

    def uniforms(self, wide: bool) -> dict[str, object]:
        """Return the uniforms of passes in the receivers' image (``wide``) or the refractor's."""
        side = self.resolution if wide else self.photons
        return {**view_uniforms(self.wide if wide else self.camera, (side, side),
                                self.scene.bounds), "photons": self.photons,
                "ior": self.ior or 1.0, "reflectance": self.reflectance,
                "iterations": self.iterations, "splat": float(self.splat)}

    # The map --------------------------------------------------------------------------------

    def map(self, landed: np.ndarray | None = None) -> np.ndarray:
        """Return the caustic map, the flux in each texel of the receivers' image.

        Parameters
        ----------
        landed : the result of `landings` or `traced`; None to search the receivers' image

        Returns
        -------
        (resolution, resolution) float32, for a light of 1 watt per steradian, row 0 at the top
        """
        if landed is not None and np.shape(landed) != (self.photons, self.photons, 4):
            raise OptionError(f"landed has the shape {np.shape(landed)}; give ({self.photons}, "
                              f"{self.photons}, 4), as landings and traced return it")
        with self.gpu:
            self._see()
            words: tuple[str, ...] = ()
            if landed is not None:
                words = ("KNOWN",)
                write_texture(self._textures["landed"], np.asarray(landed, np.float32))
            self._drop(words, "caustic")
            return read_texture(self._textures["caustic"])[:, :, 0]

    def landings(self) -> np.ndarray:
        """Return (photons, photons, 4) float32: the point where each photon lands, and its flux, 0
        for a lost photon."""
        with self.gpu:
            self._see()
            self._drop(("HOME",), "landed")
            return read_texture(self._textures["landed"])

    def traced(self) -> np.ndarray:
        """Trace the photons as rays with the tracer; return landings in the form of `landings`."""
        origins, directions = self.camera.rays((self.photons,) * 2)
        right, up, forward = self.camera.basis((1, 1))
        area = 4 * np.linalg.norm(right) * np.linalg.norm(up) / self.photons ** 2
        cosine = directions.reshape(-1, 3) @ forward
        normals = np.zeros_like(self.scene.triangles)
        normals[self.rows] = corner_normals(self.scene.triangles[self.rows], self.smooth)
        return traced_photons(self.tracer, normals, origins.reshape(-1, 3),
                              directions.reshape(-1, 3), area * cosine ** 3
                              ).reshape(self.photons, self.photons, 4)

    def _see(self) -> None:
        """Draw the light's images of the refractor and of the receivers."""
        narrow, wide = self.uniforms(False), self.uniforms(True)
        context = self.gpu.context
        if self.borders == CLOSED:
            self.mesh.draw("refraction_back", self._targets["back"], narrow, farthest=True)
        self.mesh.draw("caustic_photons", self._targets["front"], narrow, read=self._textures,
                       defines={"BORDERS": self.borders})
        target = self._targets["receivers"]
        self.gpu.clear(target, depth=1.0)
        context.enable_only(moderngl.DEPTH_TEST)
        self._receive.set(**wide)
        self._receive.draw(target, self._tables, moderngl.TRIANGLES, self._corners)
        context.enable_only(moderngl.NOTHING)

    def _drop(self, words: tuple[str, ...], target: str) -> None:
        """Draw the photons as points with additive blending."""
        context = self.gpu.context
        self.gpu.clear(self._targets[target])
        context.blend_func = moderngl.ONE, moderngl.ONE
        context.enable_only(moderngl.BLEND | moderngl.PROGRAM_POINT_SIZE)
        self._splats[words].set(**self.uniforms(True))
        self._splats[words].draw(self._targets[target], self._textures, moderngl.POINTS,
                                 self.photons ** 2)
        context.enable_only(moderngl.NOTHING)

    # The picture ----------------------------------------------------------------------------

    def look(self, places: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Return (h, w) float32, the irradiance at points according to the last `map`, for a light
        of 1 watt per steradian.

        Parameters
        ----------
        places : (h, w, 3) points
        normals : (h, w, 3) unit normals on the visible side; zeros for points that get no light
        """
        with self.gpu, placed(self.gpu, places, normals, 1) as (target, given):
            self.gpu.context.enable_only(moderngl.NOTHING)
            self._look.set(**self.uniforms(True))
            self._look.draw(target, {**self._textures, **given})
            return read_texture(target.color_attachments[0])[:, :, 0]

    def draw(self, camera: Camera | None = None, size: tuple[int, int] = (256, 256),
             landed: np.ndarray | None = None) -> np.ndarray:
        """Return the irradiance of the caustic at a camera's first hits; 0 on the refractor.

        To add the caustic to a picture, multiply by colour / pi. ``landed`` is as for `map`.

        Returns
        -------
        (h, w) float32, for a light of 1 watt per steradian, row 0 at the top
        """
        self.map(landed)
        seen = Visible.of(self.tracer, camera, size)
        seen.normals[np.isin(seen.hits.triangle, self.rows).reshape(seen.normals.shape[:2])] = 0
        return self.look(seen.places, seen.normals)

    def release(self) -> None:
        """Free textures and programs."""
        with self.gpu:
            release(self.mesh, self._receive, self._look, self._splats, self._targets,
                    self._textures, self._tables, self._depths)


def turning(tracer: Tracer) -> tuple[np.ndarray, float | None, float]:
    """Find the triangles that refract or mirror light.

    Returns
    -------
    the triangles' rows; their refractive index, or None for mirrors; the share of light that
    mirrors reflect
    """
    scene = tracer.scene
    turns = np.array([bool(m.ior) or any(m.mirror) for m in scene.materials])
    rows = np.flatnonzero(turns[scene.material_of])
    used = [scene.materials[k] for k in np.unique(scene.material_of[rows])]
    kinds = {(m.ior, 0.0 if m.ior else float(np.mean(m.mirror))) for m in used}
    if len(kinds) != 1:
        raise SceneError(f"{scene.name}: " + (
            f"{', '.join(sorted(m.name for m in used))} turn light differently; give them one "
            "material" if kinds else "no material is a dielectric or a mirror; a caustic needs "
            "one"))
    return rows, *kinds.pop()


def is_closed(triangles: np.ndarray) -> bool:
    """Return whether every edge of (n, 3, 3) triangles belongs to exactly two triangles, ignoring
    triangles with two equal corners."""
    corners = np.unique(triangles.reshape(-1, 3), axis=0, return_inverse=True)[1].reshape(-1, 3)
    edges = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2)
    whole = (edges[:, :, 0] != edges[:, :, 1]).all(axis=1)
    _, counts = np.unique(edges[whole].reshape(-1, 2), axis=0, return_counts=True)
    return bool(len(counts)) and bool((counts == 2).all())


def _views(light: np.ndarray, corners: np.ndarray, spread: float) -> tuple[Camera, Camera]:
    """Return two cameras at the light. The first camera's image just contains the triangles
    ``corners``, (k, 3, 3). The second is ``spread`` times as wide. WIDEST limits both angles."""
    points = corners.reshape(-1, 3).astype(np.float64)
    centre = (points.min(0) + points.max(0)) / 2
    away = centre - light
    distance = float(np.linalg.norm(away))
    radius = float(np.linalg.norm(points - centre, axis=1).max())
    if not radius < distance:
        raise OptionError(f"the light at {light.tolist()} is too near the refractor, which has a "
                          f"radius of {radius:.3g} around {centre.round(3).tolist()}; move the "
                          "light away")
    up = tuple(np.eye(3)[np.argmin(np.abs(away))])
    forward = away / distance
    along = (points - light) @ forward
    across = np.linalg.norm(points - light - along[:, None] * forward, axis=1)
    half = 1.01 * float((across / along).max())
    angles = np.minimum(np.arctan([half, half * spread]), WIDEST)
    narrow, wide = (Camera(tuple(light), tuple(centre), up, float(np.degrees(2 * a)))
                    for a in angles)
    return narrow, wide
