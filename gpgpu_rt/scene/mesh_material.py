"""Mesh material: converts materials of OBJ and glTF files to `Material`."""
from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from PIL import Image

from ..disk.budget import check_texels
from ..disk.files import is_file, open_input, read_input
from ..errors import SceneError
from .lazy_trimesh import trimesh
from .material import LEAST_ROUGHNESS, Material
from .texture import Texture, quietly
from .values import LARGEST

SMOOTHEST = 0.05    # a glTF metal with at most this roughness becomes a mirror


class Textures:
    """The textures of a mesh's materials. Materials with the same image share one texture.

    Parameters
    ----------
    folder : the mesh file's folder, for images that trimesh does not read; None without a file
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self._made: dict[Any, tuple[Any, Texture]] = {}

    def of(self, image: Any, name: str) -> Texture | None:
        """Return the texture of a PIL image, or of an image file in the folder; None without an
        image or without the folder. Errors name the material ``name``."""
        if image is None or isinstance(image, str) and self.folder is None:
            return None
        key = image if isinstance(image, str) else id(image)
        if key not in self._made:
            # Keep the image alive, so that no later image gets the same id().
            self._made[key] = image, (
                Texture.load(self.folder / image) if isinstance(image, str) and self.folder
                else Texture.from_image(image, f"{name}'s texture"))
        return self._made[key][1]

    def mean(self, image: Any, name: str) -> np.ndarray:
        """Return the mean colour of the image's texture, (3,) linear; white without an image."""
        texture = self.of(image, name)
        return np.ones(3) if texture is None else texture.texels.mean((0, 1), np.float64)


def material_of(visual: Any, textures: Textures) -> Material | None:
    """Return the material of a trimesh visual, or None.

    Parameters
    ----------
    visual : the ``visual`` of a trimesh mesh
    textures : the mesh's textures so far; new textures are added
    """
    material = getattr(visual, "material", None)
    if material is None:
        return None
    said = material.__dict__
    if "_data" in said:
        return _of_gltf(str(getattr(material, "name", None) or "material"), said["_data"],
                        textures)
    image, main = said.get("image"), np.asarray(material.main_color)
    # A textured material without a colour is white: trimesh's default grey would darken the
    # texture by more than half.
    plain = np.ones(3) if image is not None and np.array_equal(main, _grey()) else main[:3] / 255
    return of_mtl(str(said.get("_name") or "material"), said.get("kwargs") or {}, textures, image,
                  plain)


def of_mtl(name: str, said: Mapping[str, Any], textures: Textures, image: Any = None,
           plain: np.ndarray | None = None) -> Material:
    """Return the material of a Wavefront MTL entry.

    The key illum decides the kind of material: 3, 5 and 8 mean a mirror that reflects Ks; 4, 6, 7
    and 9 mean a dielectric of index Ni; 2 means a glossy share Ks with exponent Ns.

    Parameters
    ----------
    name : the material's name
    said : key in lower case -> the words after the key
    textures : the mesh's textures so far; new textures are added
    image : the diffuse texture, if ``said`` does not name its file
    plain : (3,) the diffuse share, if ``said`` has no Kd
    """
    image = " ".join(said.get("map_kd") or ()) or image
    if plain is None:
        plain = _grey()[:3] / 255 if image is None else np.ones(3)
    model = int(_numbers(said.get("illum"), [0])[0])
    diffuse = np.clip(_numbers(said.get("kd"), plain), 0, 1)
    specular = np.clip(_numbers(said.get("ks"), [0, 0, 0]), 0, 1)
    glow = " ".join(said.get("map_ke") or ()) or None
    emission = np.maximum(_numbers(said.get("ke"), [float(glow is not None)] * 3), 0)
    emission = emission * textures.mean(glow, name)
    ior = float(_numbers(said.get("ni"), [0])[0])
    if model in (4, 6, 7, 9) and ior > 0:
        return Material(name, ior=ior, emission=emission)
    texture = textures.of(image, name)
    specular = np.minimum(specular, 1 - diffuse)
    if model in (3, 5, 8):
        return Material(name, diffuse, mirror=specular, emission=emission, texture=texture)
    exponent = float(_numbers(said.get("ns"), [0])[0])
    if model == 2 and exponent > 0 and specular.any():
        roughness = np.clip(np.sqrt(2 / (exponent + 2)), LEAST_ROUGHNESS, 1)
        return Material(name, diffuse, glossy=specular, roughness=float(roughness),
                        emission=emission, texture=texture)
    return Material(name, diffuse, emission=emission, texture=texture)


def _of_gltf(name: str, said: Mapping[str, Any], textures: Textures) -> Material:
    """Return the material of a glTF entry.

    The metallic share reflects light in the base colour, as a mirror if the surface is smooth and
    into a glossy lobe otherwise. The rest is diffuse. The 4 % reflection of non-metals is
    omitted. A material without a metallic factor counts as non-metallic. By the format's default,
    such a material is metallic, but few authors intend this. A texture varies only the diffuse
    share; metallic reflection and emission use the mean of their textures.
    """
    factor = said.get("baseColorFactor")    # trimesh stores the factor in bytes, 0 to 255
    base = np.ones(3) if factor is None else np.asarray(factor, np.float64)[:3] / 255
    image = said.get("baseColorTexture")
    metal = float(np.clip(_numbers(said.get("metallicFactor"), [0])[0], 0, 1))
    rough = float(_numbers(said.get("roughnessFactor"), [1])[0])
    emission = np.maximum(_numbers(said.get("emissiveFactor"), [0, 0, 0]), 0)
    if emission.any():
        emission = emission * textures.mean(said.get("emissiveTexture"), name)
    part = "mirror" if rough <= SMOOTHEST else "glossy"
    reflected = np.minimum(base * textures.mean(image, name), 1) * metal if metal else np.zeros(3)
    return Material(name, base * (1 - metal), **{part: reflected},
                    roughness=float(np.clip(rough ** 2, LEAST_ROUGHNESS, 1)), emission=emission,
                    texture=textures.of(image, name) if metal < 1 else None)


def _grey() -> np.ndarray:
    """Return trimesh's colour for a file without colours, (4,) in [0, 255]."""
    return np.asarray(trimesh.visual.color.DEFAULT_COLOR)


class Resolver:
    """Reads the regular files that a mesh file names.

    Parameters
    ----------
    path : the mesh file
    uris : whether names are URIs, which may write a space as %20; true for glTF
    """

    def __init__(self, path: Path, uris: bool = False) -> None:
        self.folder, self.uris = path.parent, uris

    def __getitem__(self, name: str) -> bytes:
        return self.get(name)

    def get(self, name: str) -> bytes:
        """Return the content of a file. Raise OSError if it cannot be read."""
        name = name.strip()
        plain = self.folder / unquote(name)
        return read_input(plain if self.uris and is_file(plain) else self.folder / name)


def check_image(path: Path, image: Path) -> None:
    """Raise SceneError if an image cannot be read, or LimitError if the image is too large. The
    file at ``path`` names the image; trimesh would silently omit an unreadable image."""
    if not is_file(image):
        known = "" if not image.name.startswith("-") else " (options before the name are not read)"
        raise SceneError(f"{path}: no such texture {image.name}{known}; put the texture where the "
                         "file expects it, or remove its name from the file")
    try:
        with open_input(image) as file, quietly(), Image.open(file) as found:
            check_texels(*found.size, str(image))
    except (OSError, ValueError, SyntaxError, Image.DecompressionBombError) as failure:
        raise SceneError(f"{path}: {image.name} is no image that can be read; replace it, or "
                         "remove its name from the file") from failure


def _numbers(value: Any, default: Sequence[float] | np.ndarray) -> np.ndarray:
    try:
        array = np.asarray(default if value is None else value, np.float64).reshape(-1)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    if len(array) != len(default) or not np.isfinite(array).all():
        array = np.asarray(default, np.float64)
    return np.clip(array, -LARGEST, LARGEST)
