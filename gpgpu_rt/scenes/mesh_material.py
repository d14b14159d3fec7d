"""Mesh material: what a material of an OBJ or glTF file, as trimesh holds it, says here."""
from __future__ import annotations

import json
import os
import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
import trimesh
from PIL import Image

from ..appearance.material import LEAST_ROUGHNESS, Material
from ..appearance.texture import Texture
from ..errors import SceneError

SMOOTHEST = 0.05    # a metal's roughness up to which it is a mirror
GREY = trimesh.visual.color.DEFAULT_COLOR   # what trimesh says where a file says nothing


class Textures:
    """The textures of a mesh's materials, each image one.

    Parameters
    ----------
    folder : of the mesh file, for images that trimesh does not read; None without a file
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self._made: dict[Any, tuple[Any, Texture]] = {}

    def of(self, image: Any, name: str) -> Texture | None:
        """The texture of a PIL image, or of an image file in the folder; None for none."""
        if image is None or isinstance(image, str) and self.folder is None:
            return None
        key = image if isinstance(image, str) else id(image)
        if key not in self._made:
            # With the image, so that no other one takes its identity.
            self._made[key] = image, (
                Texture.load(self.folder / image) if isinstance(image, str) and self.folder
                else Texture.from_image(image, f"{name}'s texture"))
        return self._made[key][1]

    def mean(self, image: Any, name: str) -> np.ndarray:
        """(3,) the mean of that texture, linear; white for none."""
        texture = self.of(image, name)
        return np.ones(3) if texture is None else texture.texels.mean((0, 1), np.float64)


def material_of(visual: Any, textures: Textures) -> Material | None:
    """The material of a trimesh visual, or None where it has none.

    Parameters
    ----------
    textures : those made before, to be shared
    """
    material = getattr(visual, "material", None)
    if material is None:
        return None
    said = material.__dict__
    if "_data" in said:
        return _of_gltf(str(getattr(material, "name", None) or "material"), said["_data"],
                        textures)
    image, main = said.get("image"), np.asarray(material.main_color)
    # Of a texture that no colour is said with, trimesh's grey would take more than half.
    plain = np.ones(3) if image is not None and np.array_equal(main, GREY) else main[:3] / 255
    return _of_mtl(str(said.get("_name") or "material"), said.get("kwargs") or {}, plain, image,
                   textures)


def _of_mtl(name: str, said: Mapping[str, Any], plain: np.ndarray, image: Any,
            textures: Textures) -> Material:
    """Wavefront MTL: illum 3, 5 and 8 mirror by Ks; 4, 6, 7 and 9, which know transparency, let
    light through with Ni; Ks with an exponent Ns is glossy where illum says that highlights are
    on. ``plain`` is the diffuse share where no Kd is said."""
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
    """glTF's metals reflect their base colour, as a mirror or, rough, into a lobe; the rest is
    diffuse. The 4 % that other surfaces reflect are left out, and what does not say how metallic
    it is counts as no metal (the format's default is all metal, which few files mean). Only a
    diffuse share varies with a texture: a metal is tinted by its mean, and a lamp shines by it."""
    factor = said.get("baseColorFactor")    # trimesh has it in bytes
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


class UriResolver(trimesh.resolvers.FilePathResolver):
    """Finds what a glTF file names, whose names are URIs: a space may stand as %20."""

    def get(self, name: str) -> bytes:
        """What is in the file of a name."""
        try:
            return super().get(unquote(name))
        except OSError:
            return super().get(name)


def check_textures(path: Path) -> None:
    """Raise SceneError where a texture that a mesh file names cannot be read: trimesh goes on
    without it. It takes the rest of a line of MTL for the name, as files with spaces need. A file
    of materials that is missing, as many are, is warned of."""
    if path.suffix.lower() == ".obj":
        for library in _named(path, "mtllib"):
            if not os.path.isfile(path.parent / library):
                warnings.warn(f"{path}: no such file of materials {library}; its surfaces are "
                              "grey", stacklevel=4)
            else:
                for word in ("map_Kd", "map_Ke"):
                    for image in _named(path.parent / library, word):
                        _check(path.parent / library, path.parent / image)
    if path.suffix.lower() == ".gltf":
        images = json.loads(path.read_text(encoding="utf-8")).get("images", [])
        for uri in (image.get("uri", "") for image in images):
            if uri and not uri.startswith("data:"):
                plain = path.parent / unquote(uri)
                _check(path, plain if os.path.isfile(plain) else path.parent / uri)


def _check(path: Path, image: Path) -> None:
    if not os.path.isfile(image):
        known = "" if not image.name.startswith("-") else " (options before it are not read)"
        raise SceneError(f"{path}: no such texture {image.name}{known}; put it there, or leave it "
                         "out of the file")
    try:
        with Image.open(image):
            pass
    except (OSError, ValueError) as failure:
        raise SceneError(f"{path}: {image.name} is no image that can be read; replace it, or "
                         "leave it out of the file") from failure


def _named(path: Path, word: str) -> list[str]:
    """What follows a word at the beginning of a text file's lines."""
    text = path.read_text(encoding="utf-8", errors="replace")
    lines = [line.split(None, 1) for line in text.splitlines()]
    return [line[1].strip() for line in lines
            if len(line) == 2 and line[0].lower() == word.lower()]


def _numbers(value: Any, default: Sequence[float] | np.ndarray) -> np.ndarray:
    try:
        array = np.asarray(default if value is None else value, np.float64).reshape(-1)
    except (TypeError, ValueError):
        array = np.empty(0)
    return array if len(array) == len(default) else np.asarray(default, np.float64)
