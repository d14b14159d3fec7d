"""Mesh: the triangles, materials, lights and camera of an AFF file at its animation's start."""
from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from ...disk.files import is_file
from ...errors import SceneError
from ..light import Environment
from ..material import Material
from ..mesh import Mesh, fill_normals, filled
from ..mesh_material import Textures
from ..texture import Texture
from .document import Document, read_document
from .placement import Placement
from .surface import Surface
from .viewpoint import Viewpoint

# Folders of textures, relative to the folder of the AFF file. BART's scenes use the second.
_TEXTURE_FOLDERS = ("", "../TextureFiles")


def read_aff(path: Path) -> Mesh:
    """Return the mesh of the AFF file at ``path``, at the start of its animation.

    Raises
    ------
    SceneError, LimitError, OSError
        as for `read_document`
    """
    document = read_document(path)
    return mesh_of(document, Placement(document))


def mesh_of(document: Document, placement: Placement) -> Mesh:
    """Return the mesh of a document at the start of its animation. Faces keep the file's order.
    Vertices are rounded to float32."""
    instances, time = document.instances, document.begin
    sizes = [len(instance.geometry.faces) for instance in instances]
    vertices = _finite(document, placement, time).astype(np.float64)
    faces = np.concatenate([np.zeros((0, 3), np.int64), *(
        instance.geometry.faces + first
        for instance, first in zip(instances, placement.first.tolist()))])
    parts: dict[str, int] = {}
    part_of = [parts.setdefault(instance.part, len(parts)) for instance in instances]
    materials, material_of = _materials(document)
    rows = np.repeat(material_of, sizes).astype(np.int32)
    diffuse = np.array([m.diffuse for m in materials], np.float32).reshape(-1, 3)
    view = Viewpoint.of(document)
    mesh = Mesh(vertices, faces, diffuse[rows], materials, rows,
                _normals(document, placement, sizes),
                filled([instance.geometry.uv for instance in instances], sizes, 2),
                tuple(parts), np.repeat(np.array(part_of, np.int32), sizes),
                camera=view.at(time) if view else None, lights=tuple(document.lights),
                environment=None if document.background is None
                else Environment.constant(document.background.colour))
    fill_normals(mesh)
    return mesh


def _finite(document: Document, placement: Placement, time: float) -> np.ndarray:
    """Return the vertices at ``time``, (v, 3) float32. Raise SceneError unless all are finite."""
    vertices = placement.vertices(time)
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        first = int(np.argmin(finite))
        part = document.instances[
            int(np.searchsorted(placement.first, first, side="right")) - 1].part
        raise SceneError(f"{document.path}: a vertex of {part} is not finite in float32 under its "
                         "transforms; make their numbers smaller")
    return vertices


def _normals(document: Document, placement: Placement, sizes: list[int]) -> np.ndarray | None:
    """Return the normals of corners, (n, 3, 3) float64 of length 1, or 0 where missing; None if no
    geometry has normals."""
    turned: list[np.ndarray | None] = []
    with np.errstate(all="ignore"):     # a normal that overflows counts as missing
        # Transform normals by cofactors, which are parallel to the inverse transpose. A transform
        # that flattens its content has no inverse: its normals become 0 and count as missing.
        x, y, z = placement.transforms(document.begin)[0][:, :, :3].transpose(2, 0, 1)
        cofactors = np.stack([np.cross(y, z), np.cross(z, x), np.cross(x, y)], axis=1)
        cofactors *= np.sign((x * cofactors[:, 0]).sum(axis=1))[:, None, None]
        for instance in document.instances:
            normals = instance.geometry.normals
            if normals is not None:
                normals = normals @ cofactors[instance.node]
                length = np.linalg.norm(normals, axis=2, keepdims=True)
                sound = (length > 0) & np.isfinite(length)
                normals = np.where(sound, normals / length, 0)
            turned.append(normals)
    return filled(turned, sizes, 3)


def _materials(document: Document) -> tuple[tuple[Material, ...], np.ndarray]:
    """Return the materials, each once, and the index of each instance's material. Where a texture
    is missing, keep the colour and warn."""
    made: dict[tuple[Surface | None, str, str | None], Material] = {}
    rows: dict[Material, int] = {}
    images, missing, of = Textures(document.path.parent), [], []
    for instance in document.instances:
        name = instance.geometry.texture if instance.geometry.uv is not None else None
        key = instance.surface, instance.fill, name
        if key not in made:
            texture: Texture | None = None
            if name is not None:
                place = _texture_file(document.path.parent, name)
                texture = images.of(place, instance.fill)
                missing += [] if place else [name]
            made[key] = (Material(instance.fill, texture=texture) if instance.surface is None
                         else instance.surface.material(instance.fill, texture))
        of.append(rows.setdefault(made[key], len(rows)))
    if missing:
        names = list(dict.fromkeys(missing))
        shown = ", ".join(names[:4]) + (f" and {len(names) - 4} more" if len(names) > 4 else "")
        warnings.warn(f"{document.path}: no texture {shown} in its folder or in ../TextureFiles; "
                      "without textures, surfaces have their materials' colours", stacklevel=6)
    return tuple(rows), np.array(of, np.int64)


def _texture_file(folder: Path, name: str) -> str | None:
    """Return the path of an image relative to the document's folder; None if the image is missing
    or its name contains a folder."""
    if Path(name).name != name:
        return None
    places = (str(Path(place, name)) for place in _TEXTURE_FOLDERS)
    return next((place for place in places if is_file(folder / place)), None)
