"""Mesh file: reads the arrays and materials of a file; trimesh reads all but OBJ and AFF."""
from __future__ import annotations

import contextlib
import io
import logging
import os
import re
import warnings
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..disk.budget import check_triangles
from ..disk.files import open_input
from ..errors import LimitError, SceneError
from .aff.mesh import read_aff
from .declared import check_declared, ply_faces, ply_header, whole_text
from .lazy_trimesh import trimesh
from .material import Material
from .mesh import Mesh, fill_normals, filled, unlike
from .mesh_material import Resolver, Textures, material_of
from .obj_file import UNPAINTED, read_obj
from .texture import quietly

SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".gltf", ".aff")
# Messages of trimesh to drop. An STL file needs no face normals: the corners determine them.
_HARMLESS = ("failed to extract face_normals",)


def read(path: Path, groups: bool = False) -> Mesh:
    """Return the mesh of a file, without merging, reordering or dropping faces.

    Parameters
    ----------
    path : the mesh file
    groups : whether the groups of an OBJ file become the parts of the mesh

    Raises
    ------
    SceneError
        the file does not exist, cannot be read, has no triangle, or names a missing texture
    LimitError
        the mesh needs more memory than the budget
    """
    with reading(path):
        open_input(path).close()
        check_declared(path)
        with trimeshs_notes(path):
            mesh = _read(path, groups)
        if path.suffix.lower() == ".ply" and len(mesh.faces) < (
                declared := ply_faces(ply_header(path))):
            raise ValueError(f"{declared} faces declared, {len(mesh.faces)} found")
    if not len(mesh.faces):
        raise SceneError(f"{path}: has no triangles, only points or lines; give a mesh with faces")
    return mesh


@contextlib.contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn exceptions of file readers in this context into one-line errors that name the file. A
    LimitError passes unchanged."""
    try:
        yield
    except LimitError:
        raise
    except SceneError as failure:
        prefix = "" if str(failure).startswith(str(path)) else f"{path}: "
        raise SceneError(f"{prefix}{failure}") from None
    except FileNotFoundError as failure:
        name = failure.filename
        missing = "" if name is None or os.fspath(path) == name else f" {name}"
        raise SceneError(f"{path}: no such file{missing}; check the path") from None
    except MemoryError:
        raise LimitError(f"{path}: not enough memory for this mesh; use a smaller mesh") from None
    except Exception as error:  # trimesh passes on any exception of its parsers
        said = getattr(error, "strerror", None) or str(error)
        reason = " ".join(said.split())[:160] or type(error).__name__
        raise SceneError(f"{path}: cannot read this mesh ({reason}); is the file complete, and of "
                         f"the type that its name says?") from None


def _read(path: Path, groups: bool) -> Mesh:
    suffix = path.suffix.lower()
    if suffix == ".obj":
        return read_obj(path, groups)
    if suffix == ".aff":
        return read_aff(path)
    if suffix not in (".gz", ".bz2") and suffix[1:] not in trimesh.available_formats():
        raise SceneError(f"{path}: {'no mesh format has this suffix' if suffix else 'no suffix'}; "
                         f"give {', '.join(SUFFIXES)}, or another format of trimesh")
    kind = "".join(s.lower() for s in path.suffixes[-2:]) if suffix in (".gz", ".bz2") else suffix
    text = whole_text(path)
    with open_input(path) if text is None else io.BytesIO(text) as file, quietly():
        return flatten(trimesh.load_scene(
            file, file_type=kind[1:], process=False,
            resolver=Resolver(path, uris=suffix in (".gltf", ".glb"))))


@contextlib.contextmanager
def trimeshs_notes(path: Path) -> Iterator[None]:
    """Turn trimesh's log messages in this context into one-line warnings; drop harmless
    messages."""
    log, said = logging.getLogger("trimesh"), _Notes()
    before = log.propagate
    log.addHandler(said)
    log.propagate = False
    try:
        yield
    finally:
        log.propagate = before
        log.removeHandler(said)
    for line in dict.fromkeys(said.lines):
        if line not in _HARMLESS:
            warnings.warn(f"{path}: {line}", stacklevel=4)


class _Notes(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(" ".join(record.getMessage().split())[:160])


def flatten(mesh: trimesh.Trimesh | trimesh.Scene) -> Mesh:
    """Return the arrays of a mesh. For a scene, transform its instances and join their arrays."""
    if not isinstance(mesh, trimesh.Scene):
        return _join([(mesh, None, "mesh")])
    placed = [(node, *mesh.graph[node]) for node in mesh.graph.nodes_geometry]
    faces = [len(getattr(mesh.geometry[name], "faces", ())) for _, _, name in placed]
    if len(placed) > len(mesh.geometry):
        check_triangles(sum(faces), "its instances")
    names = _part_names(mesh)
    return _join([(mesh.geometry[name], transform, names[node])
                  for node, transform, name in placed])


def _part_names(scene: trimesh.Scene) -> dict[str, str]:
    """Return the part name of each node with a geometry, as in the mesh file.

    trimesh splits a glTF node with several materials into children at the node's place. Their
    names are the node's name and a random ending such as _1a2b3c.
    """
    nodes, graph = scene.graph.nodes_geometry, scene.graph
    parents = {node: str(graph.transforms.parents.get(node)) for node in nodes}
    pieces = [node for node, parent in parents.items()
              if parent not in nodes and re.fullmatch(re.escape(parent) + "_[0-9a-f]{6}", node)
              and np.array_equal(graph[node][0], graph[parent][0])]
    count = Counter(parents[node] for node in pieces)
    return {node: parents[node] if node in pieces and count[parents[node]] > 1 else node
            for node in nodes}


def _join(placed: list[tuple[Any, np.ndarray | None, str]]) -> Mesh:
    """Join meshes; each has a transform and a name."""
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    colours: list[np.ndarray | None] = []
    corners: dict[str, list[np.ndarray | None]] = {"normals": [], "uv": []}
    materials: list[Material | None] = []
    names, textures = [], Textures()
    for mesh, transform, name in placed:
        if not isinstance(mesh, trimesh.Trimesh):
            continue  # point clouds and curves have no surface
        points, turned = np.asarray(mesh.vertices, np.float64), np.eye(3)
        if transform is not None and not np.array_equal(transform, np.eye(4)):
            points = points @ transform[:3, :3].T + transform[:3, 3]
            turned = np.linalg.inv(transform[:3, :3])
        triangles = np.asarray(mesh.faces, np.int64)
        vertices.append(points)
        faces.append(triangles + count)
        names.append(name)
        materials.append(material_of(mesh.visual, textures))
        colours.append(_colours(mesh, materials[-1]))
        whole = _whole(mesh)
        normals = mesh.vertex_normals if "vertex_normals" in mesh._cache.cache and whole else None
        uv = getattr(mesh.visual, "uv", None) if whole else None
        corners["normals"].append(None if normals is None else normals[triangles] @ turned)
        corners["uv"].append(None if uv is None or len(uv) != len(points) else uv[triangles])
        count += len(points)
    sizes = [len(f) for f in faces[1:]]
    joined = None
    if any(colour is not None for colour in colours):
        joined = np.concatenate([np.full((n, 3), UNPAINTED) if c is None else c
                                 for n, c in zip(sizes, colours)]).astype(np.float32)
    points, triangles = np.concatenate(vertices), np.concatenate(faces)
    part_of = np.repeat(np.arange(len(sizes)), sizes)
    shared, rows = unlike(materials)
    normals, uv = filled(corners["normals"], sizes, 3), filled(corners["uv"], sizes, 2)
    found = Mesh(points, triangles, joined, shared, rows[part_of].astype(np.int32), normals, uv,
                 tuple(names), part_of.astype(np.int32))
    if _in_range(triangles, len(points)):   # `Scene.from_arrays` reports an index out of range
        fill_normals(found)
    return found


def _whole(mesh: trimesh.Trimesh) -> bool:
    """Return whether all faces refer to existing vertices."""
    return _in_range(mesh.faces, len(mesh.vertices))


def _in_range(faces: np.ndarray, count: int) -> bool:
    return not len(faces) or 0 <= faces.min() <= faces.max() < count


def _colours(mesh: trimesh.Trimesh, material: Material | None) -> np.ndarray | None:
    """Return the colours of a mesh's faces, (n, 3) in [0, 1], from face colours, vertex colours or
    the material; None if the mesh has none of these."""
    visual = mesh.visual
    if not _whole(mesh):
        return None  # `Scene.from_arrays` reports the index that is out of range
    if visual.kind == "face":
        return visual.face_colors[:, :3] / 255.0
    if visual.kind == "vertex":
        return visual.vertex_colors[mesh.faces, :3].mean(axis=1) / 255.0
    return None if material is None else np.broadcast_to(material.diffuse, (len(mesh.faces), 3))
