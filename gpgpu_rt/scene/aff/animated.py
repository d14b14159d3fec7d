"""Animated: the moving scene of an AFF file, frame by frame."""
from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...errors import SceneError
from ..camera import Camera
from ..mesh import Mesh
from .document import Document, read_document
from .mesh import mesh_of
from .placement import Placement
from .statements import Span
from .viewpoint import Viewpoint


@dataclass(frozen=True, eq=False)
class Movement:
    """The function from a frame number to (v, 3) float32 vertices, world units.

    Attributes
    ----------
    placement : the vertices of the document
    rows : (v,) for each vertex of the mesh, the index of its vertex in ``placement``
    span : the times of the frames
    """

    placement: Placement
    rows: np.ndarray
    span: Span

    def __call__(self, frame: int) -> np.ndarray:
        return self.placement.vertices(self.span.time(frame))[self.rows]


@dataclass(frozen=True)
class CameraPath:
    """The function from a frame number to the camera."""

    viewpoint: Viewpoint
    span: Span

    def __call__(self, frame: int) -> Camera:
        return self.viewpoint.at(self.span.time(frame))


@dataclass(frozen=True, eq=False)
class Moving:
    """The animation of an AFF file: its mesh, and how the vertices and the camera move.

    Attributes
    ----------
    mesh : the mesh at frame 0
    vertices : the vertices of ``mesh`` at each frame
    camera : the camera at each frame; None if no key frames move the camera
    frames : the number of frames
    """

    mesh: Mesh
    vertices: Movement
    camera: CameraPath | None
    frames: int


def read_moving(path: Path) -> Moving:
    """Return the animation of the AFF file at ``path``.

    Two corners share a vertex if they have the same transform, the same position before the
    transform, and the same normal. `Scene.moved` averages the normals of the triangles that share
    a vertex. So an edge stays smooth exactly if the file gives both sides the same normals.

    Raises
    ------
    SceneError
        if the file has no animation; also as for `read_document`
    LimitError, OSError
        as for `read_document`
    """
    document = read_document(path)
    if document.span is None:
        raise SceneError(f"{path}: does not move; add a line 'a START END FRAMES', such as "
                         "'a 0 10 240'")
    placement = Placement(document)
    mesh = mesh_of(document, placement)
    rows, faces = _shared(mesh, placement)
    return Moving(replace(mesh, vertices=mesh.vertices[rows], faces=faces),
                  Movement(placement, rows, document.span),
                  _path(document, document.span), document.span.frames)


def _path(document: Document, span: Span) -> CameraPath | None:
    view = Viewpoint.of(document)
    return CameraPath(view, span) if view is not None and view.moves else None


def _shared(mesh: Mesh, placement: Placement) -> tuple[np.ndarray, np.ndarray]:
    """Merge the corners that share a vertex into one vertex. Return the index of an original
    vertex for each merged vertex, (v,), and the merged vertices of each face, (n, 3)."""
    if mesh.normals is None:
        return np.arange(len(mesh.vertices)), mesh.faces
    vertex = mesh.faces.reshape(-1)
    corners = np.column_stack([placement.group[vertex], placement.points.T[vertex],
                               mesh.normals.reshape(-1, 3)])
    _, first, faces = np.unique(corners, axis=0, return_index=True, return_inverse=True)
    return vertex[first], faces.reshape(-1, 3)
