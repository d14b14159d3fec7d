"""Animation: a scene and the positions of its vertices at each frame."""
from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from .. import views
from ..disk.arrays import read_npz
from ..errors import SceneError, did_you_mean, memory_limited
from ..text_format import counted, printable
from . import catalogue, mesh_file
from .aff.animated import read_moving
from .camera import Camera
from .loading import load_scene, scene_of
from .procedural.animations import MOTIONS
from .scene import Scene
from .sketch import sketch


@dataclass(frozen=True)
class Animation:
    """A scene whose triangles move, frame by frame.

    Attributes
    ----------
    scene : the scene at frame 0
    vertices : function from a frame number, 0 or more, to vertices for `Tracer.update`: (v, 3) or
        (n, 3, 3) float, world units. The result depends only on the frame number
    frames : the number of frames; None if the animation has no end
    camera : function from a frame number to the camera; None if the scene's camera stands still
    """

    scene: Scene
    vertices: Callable[[int], np.ndarray]
    frames: int | None = None
    camera: Callable[[int], Camera] | None = None

    def __repr__(self) -> str:
        return views.line("Animation", self._facts())

    def _repr_html_(self) -> str:
        return views.table("Animation", self._facts(), sketch(
            self.scene.triangles, self.scene.colours, self.scene.camera))

    def _facts(self) -> views.Facts:
        return [("scene", self.scene.title), ("size", counted(len(self.scene), "triangle")),
                ("frames", "no end" if self.frames is None else counted(self.frames, "frame")),
                ("camera", "moving camera" if self.camera is not None else "")]

    def drawing(self, frame: int, given: Mapping[str, Any]) -> dict[str, Any]:
        """Return arguments of ``Tracer.render`` for a frame: ``given``, and the frame's camera if
        the camera moves and ``given`` has none."""
        if self.camera is None or given.get("camera") is not None:
            return dict(given)
        return {**given, "camera": self.camera(frame)}


def animation_names() -> list[str]:
    """Return the names of the scenes that move."""
    return [name for name, row in catalogue.ROWS.items() if name in MOTIONS or row.file]


@memory_limited
def load_animation(source: str | os.PathLike[str]) -> Animation:
    """Return the animation with this name or in this file.

    Parameters
    ----------
    source : a name of `animation_names()`; the path of an AFF file; or the path of an .npz file
        with ``vertices``, (frames, v, 3) float, and ``faces``, (n, 3) int

    Raises
    ------
    SceneError
        the name or file does not exist, the named scene does not move, or the file holds no
        animation
    """
    name = os.fspath(source)
    if Path(name).suffix == ".npz":
        return _read(Path(name))
    if Path(name).suffix.lower() == ".aff":
        return _read_aff(Path(name))
    if name in catalogue.ROWS and catalogue.ROWS[name].file:
        row, path = catalogue.ROWS[name], catalogue.mesh_path(name)
        if path is None:
            raise SceneError(catalogue.how_to_get(row))
        return _read_aff(path, row)
    if name not in MOTIONS:
        load_scene(name)    # raises a precise error if the name is not a scene either
        names = animation_names()
        raise SceneError(f"scene {name!r} does not move{did_you_mean(name, names)}; give one of "
                         f"{', '.join(names)}, an AFF file, or an .npz of vertices and faces")
    motion, scene = MOTIONS[name], load_scene(name)
    if motion.faces is not None:
        scene = replace(scene, faces=motion.faces())
    return Animation(replace(scene, moving=True), motion.vertices)


def _read_aff(path: Path, row: catalogue.NamedScene | None = None) -> Animation:
    with mesh_file.reading(path):
        found = read_moving(path)
    scene = scene_of(found.mesh, path, row, moving=True).moved(found.vertices(0))
    return Animation(scene, found.vertices, found.frames, found.camera)


def _read(path: Path) -> Animation:
    found = read_npz(path, "an animation", SceneError)
    missing = {"vertices", "faces"} - set(found)
    if missing:
        raise SceneError(f"{path} holds no {' and no '.join(sorted(missing))}; give vertices, "
                         "(frames, v, 3), and faces")
    vertices, faces = found["vertices"], found["faces"]
    if vertices.ndim != 3 or not len(vertices):
        raise SceneError(f"{path}: vertices have shape {vertices.shape}; give (frames, v, 3)")
    scene = Scene.from_arrays(vertices[0], faces, name=printable(path.stem),
                              source=str(path), moving=True)
    return Animation(scene, _Recorded(vertices), len(vertices))


@dataclass(frozen=True)
class _Recorded:
    """Returns the vertices of a file at a frame. Unlike a closure, it can be pickled."""

    vertices: np.ndarray

    def __call__(self, frame: int) -> np.ndarray:
        return self.vertices[frame]
