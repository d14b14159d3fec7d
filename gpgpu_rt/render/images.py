"""Images: packs the textures of all materials into one texture, side by side as rectangles."""
from __future__ import annotations

import numpy as np

from ..errors import LimitError
from ..scene.scene import Scene
from ..scene.texture import Texture

# Limits on the packed texture in texels; renderers support this size. Only a single image that is
# wider than WIDTH exceeds WIDTH.
WIDTH, HEIGHT = 8192, 16384


def places(scene: Scene) -> dict[str, np.ndarray]:
    """Return the fields of the record IMAGE (``records.py``): for each material, the rectangle of
    its image in the packed texture; zeros if the material has no image or no triangle."""
    corners = np.zeros((len(scene.materials), 4), np.int32)
    found = {id(t): (x, y) for t, x, y in _shelved(scene)}   # only textures in use
    for k, material in enumerate(scene.materials):
        t = material.texture
        if t is not None and id(t) in found:
            corners[k] = *found[id(t)], t.texels.shape[1], t.texels.shape[0]
    return dict(zip(("x", "y", "width", "height"), corners.T))


def atlas(scene: Scene) -> np.ndarray:
    """Return the packed texture, (height, width, 4) float32; a black texel if there is no image.

    Raises
    ------
    LimitError
        the images need more rows than a texture can have
    """
    shelved = _shelved(scene)
    width = max((x + t.texels.shape[1] for t, x, y in shelved), default=1)
    height = max((y + t.texels.shape[0] for t, x, y in shelved), default=1)
    if height > HEIGHT:
        raise LimitError(f"{scene.name}: its textures add up to {height} rows of {width} texels, "
                         f"more than {HEIGHT}; make them smaller")
    texels = np.zeros((height, width, 4), np.float32)
    for t, x, y in shelved:
        texels[y:y + t.texels.shape[0], x:x + t.texels.shape[1], :3] = t.texels
    return texels


def _shelved(scene: Scene) -> list[tuple[Texture, int, int]]:
    """Return each different texture with the column and row of its corner in the packed texture.
    Textures lie side by side in rows, in order of decreasing height."""
    textures = {id(m.texture): m.texture for m in scene.used_materials if m.texture is not None}
    width = max([WIDTH] + [t.texels.shape[1] for t in textures.values()])
    found = []
    x = y = shelf = 0
    for t in sorted(textures.values(), key=lambda t: -t.texels.shape[0]):
        if x + t.texels.shape[1] > width:
            x, y = 0, y + shelf
        if x == 0:
            shelf = t.texels.shape[0]
        found.append((t, x, y))
        x += t.texels.shape[1]
    return found
