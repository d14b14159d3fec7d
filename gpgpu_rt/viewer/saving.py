"""Saving: write a picture, and its settings inside the PNG and in a JSON file beside it."""
from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PIL import Image, PngImagePlugin

from ..disk.files import check_writable, replacing

if TYPE_CHECKING:
    from .model import Viewer

KEY = "gpgpu-rt"    # the key of the settings in the PNG's text


def free_name(folder: Path, stem: str) -> Path:
    """Return the first free name of stem-1.png, stem-2.png, ... Raise Error if the folder cannot
    be written."""
    number = 1
    while (folder / f"{stem}-{number}.png").exists():
        number += 1
    return check_writable(folder / f"{stem}-{number}.png")


def name_for(viewer: Viewer, folder: Path) -> Path:
    mode = "" if viewer.mode == "picture" else f"-{viewer.mode}"
    return free_name(folder, f"{viewer.scene.name}-{viewer.selection.method}{mode}")


def picture_of(viewer: Viewer) -> Image.Image:
    """Return the viewer's picture, with the scale of a heat map."""
    assert viewer.image is not None
    image = Image.fromarray(viewer.image)
    return viewer.heat.with_scale(image) if viewer.mode == "heat" else image


def write(path: Path, image: Image.Image, settings: Mapping[str, Any]) -> None:
    """Write the picture and its settings, two files that are complete or absent."""
    held = PngImagePlugin.PngInfo()
    held.add_text(KEY, json.dumps(settings, default=str))
    with replacing(path) as temporary:
        image.save(temporary, pnginfo=held)
    with replacing(path.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(settings, indent=2, default=str) + "\n",
                             encoding="utf-8")
