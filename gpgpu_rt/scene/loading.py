"""Loading: makes a scene from a name, a file or a trimesh object."""
from __future__ import annotations

import os
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..errors import SceneError, memory_limited
from ..text_format import printable
from . import catalogue, mesh_file
from .framing import beside, inside
from .lazy_trimesh import trimesh
from .light import PointLight
from .mesh import Mesh
from .scene import Scene, check_vertices
from .scene_file import read_scene
from .surfaces.geometry_image import GeometryImage


@memory_limited
def load_scene(source: str | os.PathLike | trimesh.Trimesh | trimesh.Scene | Scene) -> Scene:
    """Return the scene of a name, a file or a trimesh object.

    Parameters
    ----------
    source : one of
        - a name of `scene_names()`;
        - the path of a mesh file (PLY, OBJ, STL, glTF, AFF, or any other format of trimesh), of a
          scene file (.json) or of a `GeometryImage` (.npz);
        - a trimesh object;
        - a Scene, which is returned unchanged

    Raises
    ------
    SceneError
        the name or file does not exist, or the file cannot be read
    """
    if isinstance(source, Scene):
        return source
    if not isinstance(source, (str, os.PathLike)):
        if isinstance(source, (trimesh.Trimesh, trimesh.Scene)):
            return Scene.from_trimesh(source)
        raise SceneError(f"cannot load a scene from {type(source).__name__}; give a name, a mesh "
                         "file, a trimesh object or a Scene")
    if not os.fspath(source):
        raise SceneError("no scene is named; give a name of `gpgpu-rt scenes`, or a mesh file")
    named = catalogue.find(os.fspath(source))
    if named is None:
        return _read(Path(source))
    row, argument = named
    path = catalogue.mesh_path(row.name)
    if path is not None:
        return _read(path, row)
    if row.make is None:
        raise SceneError(catalogue.how_to_get(row))
    made = row.make() if argument is None else row.make(argument)
    said = {"lights": (PointLight(made.light, made.intensity),), **made.appearance}
    return Scene(os.fspath(source), made.triangles, made.colours, camera=made.camera,
                 stand_in=row.stand_in, source="built in", charts=made.charts, **said)


def _read(path: Path, row: catalogue.NamedScene | None = None) -> Scene:
    if path.suffix.lower() == ".json":
        return read_scene(path, load_scene)
    if path.suffix.lower() == ".npz":
        return GeometryImage.load(path).scene(name=printable(path.stem), source=str(path),
                                              camera=catalogue.camera_beside(path))
    return scene_of(mesh_file.read(path), path, row)


def scene_of(mesh: Mesh, path: Path, row: catalogue.NamedScene | None = None,
             moving: bool = False) -> Scene:
    """Return the scene of a mesh that was read from a file.

    Parameters
    ----------
    mesh : the mesh
    path : the mesh's file; `cameras.json` in the same folder may have a camera
    row : the named scene of the file, or None
    moving : whether the triangles will move
    """
    check_vertices(mesh.vertices, str(path))
    camera = catalogue.camera_beside(path) or mesh.camera
    light: PointLight | None = None
    if row is not None:
        light = PointLight(row.light) if row.light else None
        if mesh.colours is None and row.paint and len(mesh.faces):
            mesh.colours = row.paint(mesh.vertices, mesh.faces)
    scene = Scene.from_arrays(mesh.vertices, mesh.faces,
                              name=row.name if row else printable(path.stem),
                              colours=mesh.colours, camera=camera, light=light, source=str(path),
                              moving=moving, **mesh.appearance())
    room = inside(scene.triangles, scene.camera) if camera is None else None
    if room is None:
        return scene
    warnings.warn(f"{path}: the mesh is a room, so the camera is inside; --eye and --target place "
                  "the camera", stacklevel=4)
    lights = scene.lights if light or mesh.lights else (beside(room, scene.triangles),)
    return replace(scene, camera=room, lights=lights)


def scene_names() -> list[str]:
    """Return the names that `load_scene` knows."""
    return list(catalogue.ROWS)


def list_scenes() -> list[dict[str, Any]]:
    """Return a dictionary for each named scene.

    `name` and `original` are as in `catalogue.NamedScene`. `triangles` is the number of triangles,
    or None if the mesh cannot be read. `found` is the path of the mesh file, or "built in",
    "stand-in" or "missing" without such a file. `stand_in` is the original that a built-in scene
    replaces, or None.
    """
    rows = []
    for row in catalogue.ROWS.values():
        path = catalogue.mesh_path(row.name)
        triangles: int | None = row.triangles
        found = "stand-in" if row.stand_in else "missing" if row.make is None else "built in"
        if path is not None:
            found = str(path)
        if path is not None and row.file is None:
            try:
                triangles = len(mesh_file.read(path).faces)
            except SceneError:
                triangles = None
        rows.append({"name": row.name, "triangles": triangles, "found": found,
                     "stand_in": row.stand_in if path is None else None,
                     "original": row.original})
    return rows
