"""Scene: triangles with materials, lights and a camera, from arrays, a mesh or a name."""
from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from .. import views
from ..accel.image_cells import cell_faces
from ..errors import SceneError, memory_limited
from ..text_format import counted, titled
from . import mesh_file
from .attributes import corner_values, material_rows, smooth_normals
from .camera import Camera
from .framing import beside, framed
from .lazy_trimesh import trimesh
from .light import BACKDROP, Environment, PointLight
from .material import Material
from .sketch import sketch


@dataclass(eq=False)
class Scene:
    """A scene to render, made by `load_scene`, `from_arrays` or `from_trimesh`.

    Attributes
    ----------
    name : The name of the scene in tables and figures.
    triangles : (n, 3, 3) float32, world units, in the order of the given faces.
    colours : (n, 3) float32, diffuse reflectance of each triangle in [0, 1]. The texture of the
        triangle's material multiplies the colour. All other properties are the material's.
    lights : The point lights, or a single light. Triangles of emitting materials are lights too.
    camera : The default camera of pictures.
    stand_in : The name of the original that a procedural scene replaces; None for an original.
    source : The origin of the scene, such as a path or "built in".
    faces : (n, 3) int32, the vertex indices of each triangle, or None.
    charts : The (rows, columns) of texels of each chart if the triangles are the cells of a
        `GeometryImage`. Otherwise empty.
    materials : The materials; by default a single diffuse material.
    material_of : (n,) int32, index of each triangle's material in ``materials``; by default 0.
    normals : Unit normals, (n, 3, 3) float32, of each triangle's corners, which shading
        interpolates. Zeros for a flat-shaded triangle. None if all are flat-shaded.
    uv : Texture coordinates, (n, 3, 2) float32, of each triangle's corners, or None.
    environment : The light that arrives from outside the scene; None for darkness.
    moving : Whether the triangles will move.
    """

    name: str
    triangles: np.ndarray = field(repr=False)
    colours: np.ndarray = field(repr=False)
    lights: tuple[PointLight, ...]
    camera: Camera
    stand_in: str | None = None
    source: str = "arrays"
    faces: np.ndarray | None = field(default=None, repr=False)
    charts: tuple[tuple[int, int], ...] = ()
    materials: tuple[Material, ...] = (Material(),)
    material_of: np.ndarray | None = field(default=None, repr=False)
    normals: np.ndarray | None = field(default=None, repr=False)
    uv: np.ndarray | None = field(default=None, repr=False)
    environment: Environment | None = BACKDROP
    moving: bool = False

    def __post_init__(self) -> None:
        # The check below for finite values reports overflow.
        with np.errstate(over="ignore"):
            self.triangles = np.ascontiguousarray(self.triangles, np.float32)
        if self.triangles.ndim != 3 or self.triangles.shape[1:] != (3, 3):
            raise SceneError(f"{self.name}: triangles have shape {self.triangles.shape}; "
                             "give (n, 3, 3)")
        if not np.isfinite(self.triangles).all():
            finite = np.isfinite(self.triangles).all(axis=(1, 2))
            raise SceneError(f"{self.name}: triangle {np.argmin(finite)} has a vertex that is not "
                             "finite; repair or drop it")
        self.colours = _colours(self.colours, len(self.triangles), self.name)
        cells = sum((rows - 1) * (columns - 1) for rows, columns in self.charts)
        if self.charts and 2 * cells != len(self):
            raise SceneError(f"{self.name}: charts of {cells} cells have {2 * cells} triangles, "
                             f"not {len(self)}; give the charts of this mesh, or none")
        if self.charts and self.faces is None:
            self.faces = cell_faces(self.charts).astype(np.int32)
        self.lights = (self.lights,) if isinstance(self.lights, PointLight) else tuple(self.lights)
        self.materials = tuple(self.materials)
        self.material_of = material_rows(self.material_of, len(self), self.materials, self.name)
        self.normals = corner_values(self.normals, len(self), 3, self.name, "normals")
        self.uv = corner_values(self.uv, len(self), 2, self.name, "uv")
        textured = [m.name for m in self.used_materials if m.texture is not None]
        if textured and self.uv is None:
            raise SceneError(f"{self.name}: material {textured[0]} has a texture, but the mesh "
                             "has no texture coordinates; give uv")

    def __len__(self) -> int:
        return len(self.triangles)

    def __repr__(self) -> str:
        return views.line("Scene", self._facts())

    def _repr_html_(self) -> str:
        return views.table("Scene", [*self._facts(), ("source", self.source)],
                           sketch(self.triangles, self.colours, self.camera))

    def _facts(self) -> views.Facts:
        return [("name", self.title), ("size", counted(len(self), "triangle")),
                ("materials", counted(len(self.materials), "material")),
                ("lights", counted(len(self.lights), "point light")),
                ("moving", "moving" if self.moving else "")]

    @property
    def title(self) -> str:
        """The scene's name; a stand-in's name has the suffix " (stand-in)"."""
        return titled(self.name, self.stand_in)

    def facts(self) -> dict[str, Any]:
        """Return the scene's entries in JSON output."""
        return {"scene": self.name, "triangles": len(self), "source": self.source,
                "stand_in": self.stand_in}

    @property
    def light(self) -> PointLight:
        """The first point light."""
        if not self.lights:
            raise SceneError(f"{self.name}: has no point light; give lights")
        return self.lights[0]

    @light.setter
    def light(self, light: PointLight) -> None:
        self.lights = (light, *self.lights[1:])

    @property
    def used_materials(self) -> tuple[Material, ...]:
        """The materials that at least one triangle has."""
        used = np.bincount(self.material_of, minlength=len(self.materials))  # type: ignore
        return tuple(m for m, count in zip(self.materials, used) if count)

    @property
    def emitters(self) -> np.ndarray:
        """(k,) int rows of the triangles that emit light and have an area."""
        emits = np.array([m.emits for m in self.materials])
        if not emits.any():
            return np.zeros(0, np.int64)
        rows = np.flatnonzero(emits[self.material_of])
        corners = self.triangles[rows].astype(np.float64)
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        return rows[normal.any(axis=1)]

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The bounds (lo, hi), (3,) float32 each, world units; zeros without triangles."""
        if not len(self):
            return np.zeros(3, np.float32), np.zeros(3, np.float32)
        axes = self.triangles.transpose(2, 0, 1)    # numpy reduces long axes much faster
        return np.array([a.min() for a in axes]), np.array([a.max() for a in axes])

    @property
    def extent(self) -> float:
        """The longest side of the bounds, world units."""
        lo, hi = self.bounds
        return float((hi.astype(np.float64) - lo).max())

    def moved(self, vertices: Any) -> Scene:
        """Return the scene with moved vertices. Colours, lights and camera stay the same; corner
        normals are computed anew.

        Parameters
        ----------
        vertices : (v, 3) float, the vertices that ``faces`` indexes; or (n, 3, 3), the triangles

        Raises
        ------
        SceneError
            the shape is wrong, or a vertex is not finite in float32; the message names the vertex
        """
        if np.ndim(vertices) != 3:
            with np.errstate(over="ignore"):    # `check_vertices` reports overflow
                vertices = _array(vertices, np.float32, self.name, "vertices")
            if self.faces is None:
                raise SceneError(f"{self.name}: was made without vertex indices; give "
                                 f"({len(self)}, 3, 3) corners")
            if self.faces.size and self.faces.max() >= len(vertices):
                raise SceneError(f"{self.name}: has {self.faces.max() + 1} vertices or more, "
                                 f"but {len(vertices)} were given; give as many as before")
            check_vertices(vertices, self.name)
            vertices = vertices[self.faces]
        if np.shape(vertices) != self.triangles.shape:
            raise SceneError(f"{self.name}: new triangles have shape {np.shape(vertices)}; give "
                             f"{self.triangles.shape}, as before")
        normals = None
        if self.normals is not None:
            normals = smooth_normals(vertices, self.faces) * self.normals.any(2, keepdims=True)
        return replace(self, triangles=vertices, normals=normals)

    @classmethod
    @memory_limited
    def from_arrays(cls, vertices: Any, faces: Any, *, name: str = "arrays", colours: Any = None,
                    light: PointLight | None = None, camera: Camera | None = None,
                    source: str = "arrays", **appearance: Any) -> Scene:
        """Return a scene of indexed triangles, without merging, reordering or dropping faces.

        Parameters
        ----------
        vertices : (v, 3) float, world units, rounded to float32
        faces : (n, 3) int
        colours : (n, 3) or (3,) in [0, 1]; by default the diffuse shares of the materials
        camera : by default, a camera that sees the whole scene from outside
        light : by default, a light beside the camera, where no triangle hides the light
        name, source : the scene's name in tables, and its origin
        appearance : materials, material_of, normals, uv, lights (instead of light), environment,
            moving, as in Scene

        Raises
        ------
        SceneError
            a shape is wrong, a vertex is not finite in float32, or a face has an index out of
            range; the message names the vertex or face
        """
        vertices = _array(vertices, np.float64, name, "vertices")
        faces = _faces(faces, name)
        check_vertices(vertices, name)
        outside = ((faces < 0) | (faces >= len(vertices))).any(axis=1)
        if outside.any():
            first = int(np.argmax(outside))
            raise SceneError(f"{name}: face {first} is {faces[first].tolist()}, but there are "
                             f"{len(vertices)} vertices; repair or drop it")
        triangles = vertices.astype(np.float32)[faces]
        given, camera = camera, camera or framed(triangles)
        if colours is None:
            colours = diffuse_of(len(faces), name, **appearance)
        lights = appearance.pop("lights", None)
        if lights is None:
            # A default camera is outside the scene: no triangle hides a light beside the camera.
            lights = light or beside(camera, triangles if given else None)
        return cls(name, triangles, colours, lights, camera, source=source,
                   faces=faces.astype(np.int32), **appearance)

    @classmethod
    def from_trimesh(cls, mesh: trimesh.Trimesh | trimesh.Scene, *, name: str = "mesh",
                     light: PointLight | None = None, camera: Camera | None = None,
                     source: str = "trimesh") -> Scene:
        """Return a scene of a trimesh object, with its face, vertex or material colours. Each
        instance of a geometry in a `trimesh.Scene` is placed by its transform.

        Parameters
        ----------
        mesh : trimesh.Trimesh or trimesh.Scene
        name, light, camera, source : as for `from_arrays`

        Raises
        ------
        SceneError
            as for `from_arrays`
        """
        flat = mesh_file.flatten(mesh)
        return cls.from_arrays(flat.vertices, flat.faces, name=name, colours=flat.colours,
                               light=light, camera=camera, source=source, **flat.appearance())


def diffuse_of(count: int, name: str, materials: Sequence[Material] = (Material(),),
               material_of: Any = None, **_: Any) -> np.ndarray:
    """Return (count, 3) float32, the diffuse share of each triangle's material."""
    rows = material_rows(material_of, count, tuple(materials), name)
    return np.array([m.diffuse for m in materials], np.float32)[rows]


def _array(values: Any, dtype: type, name: str, what: str) -> np.ndarray:
    """Return (n, 3) values of a type; an empty list becomes (0, 3)."""
    try:
        if np.asarray(values).dtype.kind == "c":
            raise TypeError("complex numbers would lose their imaginary parts")
        array = np.asarray(values, dtype)
    except (TypeError, ValueError, OverflowError):
        raise SceneError(f"{name}: {what} are not an array of numbers; give (n, 3)") from None
    if array.size == 0 and array.ndim in (1, 2):
        return array.reshape(0, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise SceneError(f"{name}: {what} have shape {array.shape}; give (n, 3)")
    return array


def _faces(faces: Any, name: str) -> np.ndarray:
    indices = _array(faces, np.int64, name, "faces")
    if np.asarray(faces).dtype.kind not in "iu" and not np.array_equal(
            indices, _array(faces, np.float64, name, "faces")):
        raise SceneError(f"{name}: faces are not whole numbers; give (n, 3) vertex indices")
    return indices


def check_vertices(vertices: np.ndarray, name: str) -> None:
    """Raise SceneError, which names the vertex, unless (v, 3) vertices are finite in float32."""
    with np.errstate(over="ignore"):
        finite = np.isfinite(vertices.astype(np.float32)).all(axis=1)
    if not finite.all():
        first = int(np.argmin(finite))
        raise SceneError(f"{name}: vertex {first} is {vertices[first].tolist()}, not finite in "
                         "float32; repair, rescale or drop it")


def _colours(colours: Any, count: int, name: str) -> np.ndarray:
    try:
        array = np.asarray(colours, np.float32)
        array = np.broadcast_to(array, (count, 3)) if array.shape == (3,) else array
    except (TypeError, ValueError):
        raise SceneError(f"{name}: colours are not an array of numbers; give (n, 3)") from None
    if array.size == 0 and count == 0:
        array = array.reshape(0, 3)
    if array.shape != (count, 3):
        raise SceneError(f"{name}: colours have shape {array.shape}; give ({count}, 3), one "
                         "for each triangle, or (3,)")
    if not np.isfinite(array).all():
        raise SceneError(f"{name}: a colour is not finite; give numbers in [0, 1]")
    return np.ascontiguousarray(np.clip(array, 0, 1), np.float32)
