"""Scene file: reads a scene from JSON; docs/scene-files.md describes the format."""
from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ..disk.files import is_file, read_json
from ..errors import SceneError, nearest_names
from ..text_format import printable
from . import mesh_file
from .attributes import smooth_normals
from .camera import Camera
from .framing import framed
from .light import BACKDROP, Environment, PointLight
from .material import Material
from .procedural.shapes import ball, boxes, quad
from .scene import Scene, diffuse_of
from .scene_keys import check
from .texture import Texture

SPHERE_TRIANGLES = 1280
_SHAPES = ("file", "box", "sphere", "quad")


def read_scene(path: Path, load_scene: Callable[[str], Scene]) -> Scene:
    """Return the scene of a file.

    Parameters
    ----------
    path : the scene file
    load_scene : loads a named scene that a mesh entry of the file refers to

    Raises
    ------
    SceneError
        the file is wrong; the message is one line that names the file and, if possible, the key
    """
    try:
        said = read_json(path)
    except OSError as failure:
        raise SceneError(f"{path}: cannot read this scene file ({failure.strerror})") from None
    except ValueError as failure:
        raise SceneError(f"{path}: no JSON ({failure}); repair it") from None
    check(said, "scene", f"{path}: scene")
    return _SceneFile(path, said, load_scene).scene()


class _SceneFile:
    def __init__(self, path: Path, said: Mapping[str, Any],
                 load_scene: Callable[[str], Scene]) -> None:
        self.path, self.said, self.load_scene = path, said, load_scene
        self.names: list[str] = []
        self.materials: list[Material] = []
        for name, entry in said.get("materials", {}).items():
            texture = self._texture(entry, "texture", f"materials.{name}")
            self.names.append(name)
            self._add(f"materials.{name}", lambda: Material(
                name, **{**entry, **({"texture": texture} if texture else {})}))

    def scene(self) -> Scene:
        """Return the scene that the file describes."""
        if not self.said["meshes"]:
            raise SceneError(f"{self.path}: meshes is empty; give at least one mesh")
        parts = [self._mesh(entry, f"meshes[{k}]") for k, entry in enumerate(self.said["meshes"])]
        triangles, colours, rows, normals, uv = (
            [part[k] for part in parts] for k in range(5))
        corners = np.concatenate(triangles)
        camera = self.said.get("camera")
        lights = self._lights()
        environment = self._environment()
        scene = self._said(lambda: Scene(
            printable(self.said.get("name", self.path.stem)), corners, np.concatenate(colours),
            lights, Camera.from_dict(camera, "camera") if camera else framed(corners),
            source=str(self.path), materials=tuple(self.materials) or (Material(),),
            material_of=np.concatenate(rows), environment=environment,
            normals=mesh_file.filled(normals, [len(part) for part in triangles], 3),
            uv=mesh_file.filled(uv, [len(part) for part in triangles], 2),
            faces=np.arange(3 * len(corners), dtype=np.int32).reshape(-1, 3)))
        if not lights and environment is None and not len(scene.emitters):
            raise SceneError(f"{self.path}: the scene has no light; add lights, an environment, "
                             "or a mesh of a material with emission")
        return scene

    def _mesh(self, entry: Mapping[str, Any], where: str) -> tuple[Any, ...]:
        """Return a mesh entry's triangles (n, 3, 3), colours, material rows, corner normals and
        uv. The last two may be None; without normals, shading is flat."""
        shapes = [shape for shape in _SHAPES if shape in entry]
        if len(shapes) != 1:
            raise SceneError(f"{self.path}: {where} has {' and '.join(shapes) or 'no shape'}; "
                             f"give one of {', '.join(_SHAPES)}")
        if "file" in entry:
            triangles, colours, rows, normals, uv = self._from_file(entry, where)
        else:
            if "materials" in entry:
                raise SceneError(f"{self.path}: {where}.materials needs file; give material "
                                 "instead")
            triangles = self._shape(entry, shapes[0], where)
            count = len(triangles)
            rows = np.full(count, self._row(entry.get("material"), f"{where}.material"), np.int32)
            colours = diffuse_of(count, where, self.materials, rows)
            normals, uv = None, None
            if "quad" in entry:
                square = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], np.float32)
                uv = square[[[0, 1, 2], [0, 2, 3]]]
        if uv is None and any(self.materials[row].texture is not None for row in np.unique(rows)):
            raise SceneError(f"{self.path}: {where} has no texture coordinates for its material's "
                             "texture; put the texture on a quad, or on a mesh file with "
                             "coordinates")
        linear = _linear(entry)
        moved = np.asarray(entry.get("translate", (0, 0, 0)), np.float64)
        triangles = triangles @ linear.T + moved
        if normals is not None:
            normals = normals @ np.linalg.inv(linear)
            length = np.linalg.norm(normals, axis=2, keepdims=True)
            normals = normals / np.where(length > 0, length, 1)
        if entry.get("smooth"):
            normals = smooth_normals(triangles)
        return triangles, colours, rows, normals, uv

    def _from_file(self, entry: Mapping[str, Any], where: str) -> tuple[Any, ...]:
        path = self.path.parent / entry["file"]
        if path.suffix.lower() == ".json" or not (is_file(path) or path.suffix):
            if path.suffix:
                raise SceneError(f"{self.path}: {where}.file is a scene file; give a mesh")
            scene = self._said(lambda: self.load_scene(entry["file"]), f"{where}.file")
            mesh = mesh_file.Mesh(
                scene.triangles.reshape(-1, 3), np.arange(3 * len(scene)).reshape(-1, 3),
                scene.colours, scene.materials, scene.material_of.copy(), scene.normals,
                scene.uv, (scene.name,), np.zeros(len(scene), np.int32))
        else:
            mesh = self._said(lambda: mesh_file.read(path, groups=True), f"{where}.file")
        first = len(self.materials)
        own = entry.get("materials", {})
        if "material" not in entry:
            self.materials += mesh.materials or (Material(),)
            rows = first + mesh.material_of
            colours = mesh.colours
        else:
            rows = np.full(len(mesh.faces), self._row(entry["material"], f"{where}.material"))
            colours = None
        if colours is None:
            colours = diffuse_of(len(rows), where, self.materials, rows)
        colours = np.array(colours, np.float32)
        for word, name in own.items():
            chosen = _named(mesh, word)
            if not chosen.any():
                known = dict.fromkeys((*mesh.parts, *(m.name for m in mesh.materials)))
                raise SceneError(f"{self.path}: {where}.materials: {entry['file']} has no {word!r}"
                                 f"{nearest_names(word, known)}")
            row = self._row(name, f"{where}.materials.{word}")
            rows[chosen], colours[chosen] = row, self.materials[row].diffuse
        triangles = np.asarray(mesh.vertices, np.float64)[mesh.faces]
        return triangles, colours, rows.astype(np.int32), mesh.normals, mesh.uv

    def _shape(self, entry: Mapping[str, Any], shape: str, where: str) -> np.ndarray:
        if shape == "box":
            lo, hi = (np.array(entry["box"][key], np.float64) for key in ("lo", "hi"))
            if not (hi > lo).all():
                raise SceneError(f"{self.path}: {where}.box.hi is {entry['box']['hi']}; give more "
                                 f"than lo, {entry['box']['lo']}, along each axis")
            return boxes(lo, hi)
        if shape == "sphere":
            said = entry["sphere"]
            inward = ball(int(said.get("triangles", SPHERE_TRIANGLES)), said["centre"],
                          (said["radius"],) * 3)
            return inward[:, ::-1]
        return quad(*np.array(entry["quad"], np.float64))

    def _row(self, name: str | None, where: str) -> int:
        """Return the row of the material ``name``. If name is None, add a default material."""
        if name is None:
            self.materials.append(Material())
            return len(self.materials) - 1
        if name not in self.names:
            raise SceneError(f"{self.path}: {where}: no material {name!r}"
                             f"{nearest_names(name, self.names)}")
        return self.names.index(name)

    def _lights(self) -> tuple[PointLight, ...]:
        lights = []
        for k, entry in enumerate(self.said.get("lights", [])):
            light = self._said(lambda: PointLight(**entry), f"lights[{k}]")
            if not any(light.intensity):
                raise SceneError(f"{self.path}: lights[{k}].intensity is 0, so the light has no "
                                 "effect; leave the light out")
            lights.append(light)
        return tuple(lights)

    def _environment(self) -> Environment | None:
        said = self.said.get("environment")
        if said is None:
            return None
        if said == {"backdrop": False}:
            return None
        kinds = [kind for kind in (("colour",), ("zenith", "ground"), ("image",), ("backdrop",))
                 if any(said.get(key, False) is not False for key in kind)]
        if len(kinds) != 1:
            raise SceneError(f"{self.path}: environment is {said}; give either colour, zenith and "
                             "ground, image, or backdrop")
        image = self._texture(said, "image", "environment")
        if image is not None:
            found = Environment.surrounded(image)
        elif said.get("backdrop"):
            found = BACKDROP
        else:
            black = (0, 0, 0)
            found = Environment.sky(said.get("zenith", said.get("colour", black)),
                                    said.get("ground", said.get("colour", black)))
        if not found.emits:
            raise SceneError(f"{self.path}: environment is black; leave it out")
        return found

    def _texture(self, entry: Mapping[str, Any], key: str, where: str) -> Texture | None:
        if key not in entry:
            return None
        return self._said(lambda: Texture.load(self.path.parent / entry[key]), f"{where}.{key}")

    def _add(self, where: str, make: Any) -> None:
        self.materials.append(self._said(make, where))

    def _said(self, make: Any, where: str = "") -> Any:
        """Return the result of ``make``; add the file and the key to its errors."""
        try:
            return make()
        except SceneError as error:
            raise SceneError(f"{self.path}: {where + ': ' if where else ''}{error}") from None
        except OSError as failure:      # the user is not allowed to read the file
            raise SceneError(f"{self.path}: {where}: cannot be read ({failure.strerror}); check "
                             "it") from None


def _named(mesh: mesh_file.Mesh, word: str) -> np.ndarray:
    """Return (n,) bool, whether each face belongs to a part or material named ``word``. If several
    nodes of a glTF file have the same name, trimesh numbers them: NAME, NAME_1, NAME_2."""
    parts = [k for k, name in enumerate(mesh.parts)
             if name == word or re.fullmatch(re.escape(word) + r"_\d+", name)]
    materials = [k for k, m in enumerate(mesh.materials) if m.name == word]
    return np.isin(mesh.part_of, parts) | (bool(mesh.materials)
                                           & np.isin(mesh.material_of, materials))


def _linear(entry: Mapping[str, Any]) -> np.ndarray:
    """Return the (3, 3) matrix that scales, then rotates around x, y and z."""
    matrix = np.diag(np.broadcast_to(np.asarray(entry.get("scale", 1.0), np.float64), 3))
    for axis, degrees in enumerate(entry.get("rotate", (0, 0, 0))):
        angle = np.radians(float(degrees))      # float also accepts whole numbers beyond 2^63
        c, s = np.cos(angle), np.sin(angle)
        turn = np.eye(3)
        one, two = (axis + 1) % 3, (axis + 2) % 3
        turn[[one, one, two, two], [one, two, one, two]] = c, -s, s, c
        matrix = turn @ matrix
    return matrix
