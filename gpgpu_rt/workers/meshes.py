"""Meshes: files of named scenes, for machines that have others of that name, or none."""
from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ..disk.files import is_file, read_input, replacing
from ..disk.own_folder import own_folder
from ..errors import Error
from ..scene import catalogue
from .digest import digest

Files = Mapping[str, bytes]     # by name


def mesh_files(scene: str) -> Files:
    """The mesh of a named scene and the cameras beside it; nothing of one that is built in."""
    name = scene.partition(":")[0]
    mesh = catalogue.mesh_path(name) if name in catalogue.ROWS else None
    if mesh is None:
        return {}
    beside = (mesh, mesh.parent / "cameras.json")
    return {path.name: read_input(path) for path in beside if is_file(path)}


def take_mesh(scene: str, files: Files) -> None:
    """Let the scene be found as it was found where the files come from."""
    if not files or files == mesh_files(scene):
        return
    folder = own_folder("meshes") / digest(dict(files))
    folder.mkdir(exist_ok=True)
    for name, content in files.items():
        if Path(name).name != name:
            raise Error(f"{name!r} is no name of a mesh file; take this machine's own meshes")
        with replacing(folder / name) as path:
            path.write_bytes(content)
    others = os.environ.get("GPGPU_RT_SCENES", "")
    os.environ["GPGPU_RT_SCENES"] = os.pathsep.join(filter(None, (str(folder), others)))
