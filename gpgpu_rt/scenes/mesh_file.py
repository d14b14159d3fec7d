"""Mesh file: what trimesh reads, flattened to arrays and materials as they were given."""
from __future__ import annotations

import io
import itertools
import os
import re
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from ..appearance.material import Material
from ..errors import SceneError
from ..rays import unit_normals
from .mesh_material import Textures, UriResolver, check_textures, material_of

SUFFIXES = (".ply", ".obj", ".stl", ".glb", ".gltf")


@dataclass
class Mesh:
    """A mesh as its file has it.

    Attributes
    ----------
    vertices : (v, 3) float64, world units
    faces : (n, 3) int64, in the file's order
    colours : (n, 3) float32 diffuse in [0, 1], or None where the file has none
    materials : what ``material_of``, (n,) int32, counts; empty where the file has none
    normals, uv : (n, 3, 3) and (n, 3, 2) float64 of the faces' corners, or None
    parts : names of objects or groups, which ``part_of``, (n,) int32, counts
    """

    vertices: np.ndarray
    faces: np.ndarray
    colours: np.ndarray | None
    materials: tuple[Material, ...]
    material_of: np.ndarray
    normals: np.ndarray | None
    uv: np.ndarray | None
    parts: tuple[str, ...]
    part_of: np.ndarray

    def appearance(self) -> dict[str, Any]:
        """What of it `Scene.from_arrays` takes besides vertices, faces and colours."""
        said: dict[str, Any] = {"normals": self.normals, "uv": self.uv}
        if self.materials:
            said.update(materials=self.materials, material_of=self.material_of)
        return {name: value for name, value in said.items() if value is not None}


def read(path: Path, groups: bool = False) -> Mesh:
    """The mesh of a file; nothing is merged, reordered or dropped.

    Parameters
    ----------
    groups : whether an OBJ file's parts are its groups; faces then stand group by group

    Raises
    ------
    SceneError
        no such file, trimesh cannot read it, or a texture that it names is missing
    """
    if not os.path.isfile(path):    # unlike Path's, False for a name too long
        what = "a folder, no mesh file" if os.path.isdir(path) else "no such file"
        raise SceneError(f"{path}: {what}; check the path")
    try:
        _check_whole(path)
        check_textures(path)
        resolver = UriResolver(str(path)) if path.suffix.lower() == ".gltf" else None
        mesh = (_read_obj(path, groups) if path.suffix.lower() == ".obj"
                else flatten(trimesh.load_scene(str(path), process=False, resolver=resolver)))
        if path.suffix.lower() == ".ply" and len(mesh.faces) < (declared := _declared(path)):
            raise ValueError(f"{declared} faces declared, {len(mesh.faces)} found")
        if not len(mesh.faces):
            warnings.warn(f"{path}: no triangles in it, every ray will miss", stacklevel=3)
        return mesh
    except SceneError:
        raise
    except Exception as error:  # trimesh raises whatever its parsers meet
        reason = " ".join(str(error).split())[:160] or type(error).__name__
        raise SceneError(f"{path}: cannot read this mesh ({reason}); is it whole, and of the type "
                         f"its name says?") from None


def _read_obj(path: Path, groups: bool) -> Mesh:
    """An OBJ file's mesh: by default trimesh would collect its faces by material."""
    text = path.read_bytes()
    corners = re.search(rb"^v[tn]\s", text, re.MULTILINE)
    if corners or groups:
        text = _in_runs(text, path.name.encode() if groups else None)

    def load(maintain_order: bool) -> Mesh:
        loaded = trimesh.load_scene(
            io.BytesIO(text), "obj", trimesh.resolvers.FilePathResolver(str(path)), process=False,
            maintain_order=maintain_order, group_material=False, split_groups=groups)
        # trimesh takes the runs of one material from the last to the first.
        return _join([(mesh, None, name)
                      for name, mesh in reversed(list(loaded.geometry.items()))], path.parent)

    with warnings.catch_warnings():     # of corners' values that are taken from elsewhere below
        warnings.simplefilter("ignore", RuntimeWarning)
        mesh = load(True)
    if corners:
        # Vertices as the file has them have one normal and one texture coordinate each, whatever
        # its faces say, or none at all where one is no face's first three corners: those are
        # taken from vertices that trimesh splits.
        split = load(False)
        if len(split.faces) == len(mesh.faces):
            mesh.normals, mesh.uv = split.normals, split.uv
    return mesh


# Of an OBJ file: a word that divides it, or faces one after another with one kind of corners.
_PIECES = re.compile(rb"^[ \t]*(?:(?P<word>usemtl|g|o)\b(?P<name>[^\n]*)|" + b"|".join(
    rb"(?P<%s>(?:[ \t]*f[ \t]+-?\d+%s[ \t][^\n]*(?:\n|\Z))+)" % kind for kind in (
        (b"bare", rb"/*"), (b"uv", rb"/-?\d+/?"), (b"normal", rb"//-?\d+"),
        (b"both", rb"/-?\d+/-?\d+"))) + b")", re.MULTILINE)


def _in_runs(text: bytes, whole: bytes | None) -> bytes:
    """The text of an OBJ file whose faces stand in runs of one material and one kind of corners.

    trimesh gives a run the corners' values that all its faces have, and a group its last material.

    Parameters
    ----------
    whole : the group of faces outside groups, which are objects where there are none. A group of
        several runs is numbered. None: keep no groups
    """
    divides = b"g" if re.search(rb"^g\s", text, re.MULTILINE) else b"o"
    group, material, run = whole, b"", None
    names: dict[Any, bytes] = {}
    used: set[bytes] = set()

    def divided(found: re.Match[bytes]) -> bytes:
        nonlocal group, material, run
        word, named = found["word"], (found["name"] or b"").strip()
        if word == b"usemtl":
            material, run = named, None
            return b""
        if word is not None:
            group = named or whole if whole is not None and word == divides else group
            return b""
        kind = group, material, found.lastgroup
        if kind == run:
            return found[0]
        run = kind
        if group is not None and kind not in names:
            names[kind] = _unused(group, used)
            used.add(names[kind])
        return (b"usemtl %s\n" % material + (b"g %s\n" % names[kind] if group is not None else b"")
                + found[0])

    return _PIECES.sub(divided, text.replace(b"\r\n", b"\n").replace(b"\\\n", b""))


def _unused(name: bytes, used: set[bytes]) -> bytes:
    """A name, numbered where it is taken."""
    found = name
    for k in itertools.count(1):
        if found not in used:
            break
        found = b"%s_%d" % (name, k)
    return found


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


def flatten(mesh: trimesh.Trimesh | trimesh.Scene) -> Mesh:
    """The arrays of a mesh, or of each instance in a scene, placed by its transform."""
    if not isinstance(mesh, trimesh.Scene):
        return _join([(mesh, None, "mesh")])
    placed = ((node, *mesh.graph[node]) for node in mesh.graph.nodes_geometry)
    return _join([(mesh.geometry[name], transform, node) for node, transform, name in placed])


def _join(placed: list[tuple[Any, np.ndarray | None, str]], folder: Path | None = None) -> Mesh:
    """One mesh of several, each with its transform and name; ``folder`` is that of their file."""
    vertices, faces, count = [np.zeros((0, 3))], [np.zeros((0, 3), np.int64)], 0
    colours: list[np.ndarray | None] = []
    corners: dict[str, list[np.ndarray | None]] = {"normals": [], "uv": []}
    materials: list[Material | None] = []
    names, textures = [], Textures(folder)
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
        joined = np.concatenate([np.full((n, 3), 0.7) if c is None else c
                                 for n, c in zip(sizes, colours)]).astype(np.float32)
    points, triangles = np.concatenate(vertices), np.concatenate(faces)
    part_of = np.repeat(np.arange(len(sizes)), sizes)
    shared, rows = _unlike(materials)
    normals, uv = filled(corners["normals"], sizes, 3), filled(corners["uv"], sizes, 2)
    if normals is not None:
        missing = ~(np.linalg.norm(normals, axis=2) > 0).all(axis=1)    # or not a number
        normals[missing] = unit_normals(points[triangles[missing]])[:, None]
    if uv is not None:
        uv[~np.isfinite(uv)] = 0
    return Mesh(points, triangles, joined, shared, rows[part_of].astype(np.int32), normals, uv,
                tuple(names), part_of.astype(np.int32))


def _unlike(materials: list[Material | None]) -> tuple[tuple[Material, ...], np.ndarray]:
    """Materials, each once, and which one each of the list is; none at all if none is known."""
    if not any(materials):
        return (), np.zeros(len(materials), np.int64)
    known = list(dict.fromkeys(m or Material() for m in materials))
    return tuple(known), np.array([known.index(m or Material()) for m in materials])


def filled(parts: list[np.ndarray | None], sizes: list[int], width: int) -> np.ndarray | None:
    """Values of all corners, zeros where a part has none; None where no part has any."""
    if all(part is None for part in parts):
        return None
    return np.concatenate([np.zeros((n, 3, width)) if part is None else part
                           for part, n in zip(parts, sizes)])


def _whole(mesh: trimesh.Trimesh) -> bool:
    """Whether no face names a vertex that is not there."""
    return not len(mesh.faces) or 0 <= mesh.faces.min() <= mesh.faces.max() < len(mesh.vertices)


def _colours(mesh: trimesh.Trimesh, material: Material | None) -> np.ndarray | None:
    """(n, 3) in [0, 1], the colours of a mesh's faces, vertices or material, or None."""
    visual = mesh.visual
    if not _whole(mesh):
        return None  # whoever takes the faces says which one is out of range
    if visual.kind == "face":
        return visual.face_colors[:, :3] / 255.0
    if visual.kind == "vertex":
        return visual.vertex_colors[mesh.faces, :3].mean(axis=1) / 255.0
    return None if material is None else np.broadcast_to(material.diffuse, (len(mesh.faces), 3))
