"""Meshes: files of named scenes, for machines that have others of that name, or none."""
from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from ..content import digest
from ..files import replacing
from ..scenes import catalogue

Files = Mapping[str, bytes]     # by name


def mesh_files(scene: str) -> Files:
    """The mesh of a named scene and the cameras beside it; nothing of one that is built in."""
    name = scene.partition(":")[0]
    mesh = catalogue.mesh_path(name) if name in catalogue.ROWS else None
    if mesh is None:
        return {}
    beside = (mesh, mesh.parent / "cameras.json")
    return {path.name: path.read_bytes() for path in beside if path.is_file()}


def take_mesh(scene: str, files: Files) -> None:
    """Let the scene be found as it was found where the files come from."""
    if not files or files == mesh_files(scene):
        return
    folder = Path(tempfile.gettempdir()) / f"gpgpu_rt-meshes-{os.getuid()}" / digest(dict(files))
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        with replacing(folder / name) as path:
            path.write_bytes(content)
    others = os.environ.get("GPGPU_RT_SCENES", "")
    os.environ["GPGPU_RT_SCENES"] = os.pathsep.join(filter(None, (str(folder), others)))
