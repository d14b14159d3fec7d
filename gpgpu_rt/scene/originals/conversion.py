"""Conversion: makes the mesh of a scene from the files that its owner publishes."""
from __future__ import annotations

import shutil
import warnings
import zipfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh

from ...errors import SceneError
from .. import mesh_file
from ..mesh import Mesh


@dataclass(frozen=True)
class Original:
    """A scene that can be fetched.

    Attributes
    ----------
    file : the mesh file: a path in the scene's archive, or one of the scene's files
    triangles : the number of triangles that the mesh must have
    edit : a function that changes the mesh after reading
    keeps_files : whether to keep the published files for an animation that reads them
    """

    file: str
    triangles: int
    edit: Callable[[Mesh], Mesh] = lambda mesh: mesh
    keeps_files: bool = False


def _without_repeats(mesh: Mesh) -> Mesh:
    """Return a mesh without repeated triangles or unused vertices.

    In the published Cornell box, two faces at the bottom repeat the vertices of side faces.
    Without the two faces, the box has 32 triangles, like Cornell University's own data.
    """
    corners = np.sort(mesh.vertices[mesh.faces].view("f8,f8,f8")[..., 0], axis=1)
    _, first = np.unique(corners.view("f8").reshape(len(mesh.faces), -1), axis=0,
                         return_index=True)
    used, faces = np.unique(mesh.faces[np.sort(first)], return_inverse=True)
    return replace(mesh, vertices=mesh.vertices[used], faces=faces.reshape(-1, 3))


ORIGINALS: dict[str, Original] = {
    "bunny": Original("bunny/reconstruction/bun_zipper.ply", 69_451),
    "conference": Original("conference.obj", 331_179),
    "cornell": Original("CornellBox-Original.obj", 32, _without_repeats),
    "kitchen": Original("kitchen.aff", 110_561, keeps_files=True),
    "robots": Original("Robot.aff", 71_708, keeps_files=True),
    "teapot": Original("teapot.obj", 15_704),
}


def convert(scene: str, files: list[Path], work: Path) -> Path:
    """Return a PLY file in the folder ``work`` with the mesh of a scene.

    Parameters
    ----------
    scene : a name of ORIGINALS
    files : the complete published files: either one archive, or the files themselves
    work : a folder that no other run uses

    Raises
    ------
    SceneError
        the files do not give the expected number of triangles
    """
    original = ORIGINALS[scene]
    unpacked = work / "unpacked"
    shutil.rmtree(unpacked, ignore_errors=True)     # a killed run may have left the folder
    try:
        if len(files) == 1:
            with zipfile.ZipFile(files[0]) as archive:
                archive.extractall(unpacked)
            path = unpacked / original.file
        else:
            path = next(file for file in files if file.name == original.file)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")     # about materials, which are not kept
            mesh = original.edit(mesh_file.read(path))
    finally:
        shutil.rmtree(unpacked, ignore_errors=True)
    if len(mesh.faces) != original.triangles:
        raise SceneError(f"{scene}: the published files give {len(mesh.faces):,} triangles, but "
                         f"{original.triangles:,} are expected; report this as an error of "
                         "gpgpu_rt")
    target = work / f"{scene}.ply"
    target.write_bytes(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(
        file_type="ply"))
    return target
