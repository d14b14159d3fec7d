"""Animation: a scene and the positions of its vertices at each frame."""
from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..disk.arrays import read_npz
from ..errors import SceneError, did_you_mean, memory_limited
from ..text_format import printable
from .loading import load_scene
from .procedural.animations import MOTIONS
from .scene import Scene


@dataclass(frozen=True)
class Animation:
    """A scene whose triangles move, frame by frame.

    Attributes
    ----------
    scene : the scene at frame 0
    vertices : function from a frame number, 0 or more, to the argument of `Tracer.update`: (v, 3)
        or (n, 3, 3) float32, world units. The result depends only on the frame number
    frames : the number of frames; None if the animation has no end
    """

    scene: Scene
    vertices: Callable[[int], np.ndarray]
    frames: int | None = None


def animation_names() -> list[str]:
    """Return the names of the built-in scenes that move."""
    return list(MOTIONS)


@memory_limited
def load_animation(source: str | os.PathLike[str]) -> Animation:
    """Return the animation of a name or of a file.

    Parameters
    ----------
    source : a name of `animation_names()`, or the path of an .npz file with ``vertices``,
        (frames, v, 3) float, and ``faces``, (n, 3) int

    Raises
    ------
    SceneError
        the name or file does not exist, or the file holds no animation
    """
    name = os.fspath(source)
    if Path(name).suffix == ".npz":
        return _read(Path(name))
    if name not in MOTIONS:
        load_scene(name)    # raises a precise error if the name is not a scene either
        raise SceneError(f"scene {name!r} does not move{did_you_mean(name, MOTIONS)}; give one "
                         f"of {', '.join(MOTIONS)}, or an .npz of vertices and faces")
    motion, scene = MOTIONS[name], load_scene(name)
    if motion.faces is not None:
        scene = replace(scene, faces=motion.faces())
    return Animation(replace(scene, moving=True), motion.vertices)


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
    """The vertices of a file by frame; a class, because a closure cannot be pickled."""

    vertices: np.ndarray

    def __call__(self, frame: int) -> np.ndarray:
        return self.vertices[frame]
