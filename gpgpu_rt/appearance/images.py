"""Images: the textures of all materials in one, a rectangle each."""
from __future__ import annotations

from typing import Any

import numpy as np

from ..scene import Scene
from .texture import Texture


def places(scene: Scene) -> dict[str, np.ndarray]:
    """Where each material's image lies: the fields of IMAGE, zeros for none."""
    corners = np.zeros((len(scene.materials), 4), np.int32)
    rows = {id(t): row for t, row in zip(*_stacked(scene))}   # of those in use
    for k, material in enumerate(scene.materials):
        t = material.texture
        if t is not None and id(t) in rows:
            corners[k] = 0, rows[id(t)], t.texels.shape[1], t.texels.shape[0]
    return dict(zip(("x", "y", "width", "height"), corners.T))


def atlas(scene: Scene) -> np.ndarray:
    """(height, width, 4) float32: the images one above the other; a single black texel if none."""
    textures, rows = _stacked(scene)
    width = max((t.texels.shape[1] for t in textures), default=1)
    height = sum(t.texels.shape[0] for t in textures) or 1
    texels = np.zeros((height, width, 4), np.float32)
    for t, row in zip(textures, rows):
        texels[row:row + t.texels.shape[0], :t.texels.shape[1], :3] = t.texels
    return texels


def _stacked(scene: Scene) -> tuple[list[Texture], list[Any]]:
    """The textures, each once, and their first rows."""
    textures = list({id(m.texture): m.texture for m in scene.used_materials
                     if m.texture is not None}.values())
    rows = np.cumsum([0] + [t.texels.shape[0] for t in textures])
    return textures, rows[:-1].tolist()
