"""Mesh file: what trimesh reads, flattened to vertices, faces and colours as they were given."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from ..errors import SceneError

Arrays = tuple[np.ndarray, np.ndarray, np.ndarray | None]

SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".gltf")


def read(path: Path) -> Arrays:
    """The mesh of a file; nothing is merged, reordered or dropped.

    Returns
    -------
    vertices : (v, 3) float64, world units, as the file has them
    faces : (n, 3) int64, in the file's order
    colours : (n, 3) float32 diffuse in [0, 1], or None where the file has none

    Raises
    ------
    SceneError
        no such file, or trimesh cannot read it
    """
    if not path.is_file():
        what = "a folder, no mesh file" if path.is_dir() else "no such file"
        raise SceneError(f"{path}: {what}; check the path")
    try:
        _check_whole(path)
        if path.suffix.lower() == ".obj":
            return _read_obj(path)
        arrays = flatten(trimesh.load_scene(str(path), process=False))
        if path.suffix.lower() == ".ply" and len(arrays[1]) < (declared := _declared(path)):
            raise ValueError(f"{declared} faces declared, {len(arrays[1])} found")
        return arrays
    except Exception as error:  # trimesh raises whatever its parsers meet
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise SceneError(f"{path}: cannot read this mesh ({reason}); is it whole, and of the type "
                         f"its name says?") from None


def _read_obj(path: Path) -> Arrays:
    """An OBJ file's mesh: by default trimesh would collect its faces by material."""
    loaded = trimesh.load_scene(str(path), process=False, maintain_order=True,
                                group_material=False)
    # trimesh takes the runs of one material from the last to the first.
    return _join([(mesh, None) for mesh in reversed(loaded.geometry.values())])


def _check_whole(path: Path) -> None:
    """Raise ValueError for a cut file that trimesh takes for a shorter one."""
    size = path.stat().st_size
    if size == 0:
        raise ValueError("the file is empty")
    if path.suffix.lower() == ".stl":
        with open(path, "rb") as file:
            head = file.read(84)
            file.seek(-min(size, 256), os.SEEK_END)
            tail = file.read().lower()
        # A binary STL may begin with "solid" too, but holds zeros near its end.
        if head.lstrip()[:5].lower() == b"solid" and b"\0" not in tail:
            if b"endsolid" not in tail:
                raise ValueError("no endsolid at its end")
        elif size < 84 or size < 84 + 50 * int.from_bytes(head[80:], "little"):
            raise ValueError(f"{size} bytes are fewer than its header promises")


def _declared(path: Path) -> int:
    """The number of faces that a PLY file's header promises."""
    with open(path, "rb") as file:
        for line in file:
            words = line.split()
            if words[:2] == [b"element", b"face"]:
                return int(words[2])
            if words[:1] == [b"end_header"]:
                break
    return 0


def flatten(mesh: trimesh.Trimesh | trimesh.Scene) -> Arrays:
    """The arrays of a mesh, or of each instance in a scene, placed by its transform."""
    if not isinstance(mesh, trimesh.Scene):
        return _join([(mesh, None)])
    placed = (mesh.graph[node] for node in mesh.graph.nodes_geometry)
    return _join([(mesh.geometry[name], transform) for transform, name in placed])


def _join(placed: list[tuple[Any, np.ndarray | None]]) -> Arrays:
    vertices, faces, colours, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], [], 0
    for mesh, transform in placed:
        if not isinstance(mesh, trimesh.Trimesh):
            continue  # point clouds and curves have no surface
        points = np.asarray(mesh.vertices, np.float64)
        if transform is not None and not np.array_equal(transform, np.eye(4)):
            points = points @ transform[:3, :3].T + transform[:3, 3]
        vertices.append(points)
        faces.append(np.asarray(mesh.faces, np.int64) + count)
        colours.append(_colours(mesh))
        count += len(points)
    joined = None
    if any(colour is not None for colour in colours):
        joined = np.concatenate([np.full((len(f), 3), 0.7) if c is None else c
                                 for f, c in zip(faces[1:], colours)]).astype(np.float32)
    return np.concatenate(vertices), np.concatenate(faces), joined


def _colours(mesh: trimesh.Trimesh) -> np.ndarray | None:
    """(n, 3) in [0, 1], the colours of a mesh's faces, vertices or material, or None."""
    visual = mesh.visual
    if len(mesh.faces) and not 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices):
        return None  # whoever takes the faces says which one is out of range
    if visual.kind == "face":
        return visual.face_colors[:, :3] / 255.0
    if visual.kind == "vertex":
        return visual.vertex_colors[mesh.faces, :3].mean(axis=1) / 255.0
    material = getattr(visual, "material", None)
    if material is None:
        return None
    return np.broadcast_to(np.asarray(material.main_color)[:3] / 255.0, (len(mesh.faces), 3))
