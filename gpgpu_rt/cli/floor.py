"""``gpgpu-rt render --floor``: put a floor below the scene, on which the scene's shadow falls.

By default, the command adds no floor, for three reasons. The printed counts and times describe the
given scene. The scene's saved settings and cached trees can be used. ``Tracer.render`` draws the
same picture as the command.
"""
from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from ..errors import OptionError
from ..scene.loading import load_scene
from ..scene.material import Material
from ..scene.procedural.shapes import quad
from ..scene.scene import Scene
from ..tracer import AUTO
from .shared import say

WIDTH = 2.5         # half the floor's side, in diagonals of the scene's bounding box
BELOW = 1e-4        # gap below the scene, in diagonals, so that no triangles coincide
GREY = 0.75


def add_floor(sub: argparse.ArgumentParser) -> None:
    sub.add_argument("--floor", action="store_true", help="add a floor of two triangles below the "
                     "scene, on which the scene's shadow falls")


def scene_of(chosen: argparse.Namespace) -> Scene:
    """Return the scene that the command names, with a floor if ``--floor`` is given."""
    scene = load_scene(chosen.scene)
    if not chosen.floor:
        return scene
    for given, word in ((chosen.method == AUTO, "auto"),
                        (chosen.settings is not None, "--settings"),
                        (chosen.method == "geometry-image", "geometry-image")):
        if given:
            raise OptionError(f"--floor adds triangles to the scene, which {word} does not "
                              f"support; leave out --floor or {word}")
    say("gpgpu-rt: note: counts and times include the two triangles of the floor")
    return on_floor(scene)


def on_floor(scene: Scene) -> Scene:
    """Return the scene with a floor: two grey triangles, which come last.

    The floor is a square below the bounding box (y is up). Two of its edges are parallel to the
    camera's right axis, projected onto the floor.
    """
    lo, hi = (corner.astype(np.float64) for corner in scene.bounds)
    diagonal = float(np.linalg.norm(hi - lo)) or 1.0
    right, _, _ = scene.camera.basis((1, 1))
    across = np.array([right[0], 0.0, right[2]]) if right[[0, 2]].any() else np.array([1.0, 0, 0])
    across *= WIDTH * diagonal / np.linalg.norm(across)
    away = np.array([across[2], 0.0, -across[0]])
    middle = np.array([(lo + hi)[0] / 2, lo[1] - BELOW * diagonal, (lo + hi)[2] / 2])
    square = quad(*(middle + a * across + b * away for a, b in ((-1, -1), (1, -1), (1, 1),
                                                                (-1, 1))))

    def more(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else np.concatenate(
            [values, np.zeros((2, *values.shape[1:]), values.dtype)])

    rows = np.append(scene.material_of, [len(scene.materials)] * 2)     # type: ignore[arg-type]
    return replace(scene, triangles=np.concatenate([scene.triangles, np.float32(square)]),
                   colours=np.concatenate([scene.colours, np.full((2, 3), np.float32(GREY))]),
                   materials=(*scene.materials, Material("floor", (GREY,) * 3)),
                   material_of=rows, normals=more(scene.normals),
                   uv=more(scene.uv), faces=None, charts=())
