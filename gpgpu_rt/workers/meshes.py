"""Meshes: send a named scene's files to machines where these files are missing or different."""
from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

from ..disk.files import is_file, read_input, replacing
from ..disk.own_folder import own_folder
from ..errors import Error
from ..scene import catalogue
from .digest import digest

Files = Mapping[str, bytes]     # name of a file -> its content


def mesh_files(scene: str) -> Files:
    """Return the files of a named scene: its mesh and the cameras beside it.

    The result is empty for a built-in scene. It is also empty for an AFF file, because an AFF file
    includes files that are not known here. So each machine needs its own AFF files.
    """
    name = scene.partition(":")[0]
    mesh = catalogue.mesh_path(name) if name in catalogue.ROWS else None
    if mesh is None or mesh.suffix == ".aff":
        return {}
    beside = (mesh, mesh.parent / "cameras.json")
    return {path.name: read_input(path) for path in beside if is_file(path)}


def take_mesh(scene: str, files: Files) -> None:
    """Store a named scene's files where `load_scene` finds them."""
    if not files or files == mesh_files(scene):
        return
    folder = own_folder("meshes") / digest(dict(files))
    folder.mkdir(exist_ok=True)
    for name, content in files.items():
        if Path(name).name != name:
            raise Error(f"{name!r} is not the name of a mesh file; give a name without a folder")
        with replacing(folder / name) as path:
            path.write_bytes(content)
    others = os.environ.get("GPGPU_RT_SCENES", "")
    os.environ["GPGPU_RT_SCENES"] = os.pathsep.join(filter(None, (str(folder), others)))
