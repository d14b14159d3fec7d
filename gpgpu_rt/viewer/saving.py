"""Saving: write a picture as PNG, and the settings into the PNG and a JSON file."""
from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PIL import Image, PngImagePlugin

from ..disk.files import check_writable, replacing

if TYPE_CHECKING:
    from .model import Viewer

KEY = "gpgpu-rt"    # name of the PNG's text chunk that holds the settings


def free_name(folder: Path, stem: str) -> Path:
    """Return the first path of stem-1.png, stem-2.png, ... that does not exist. Raise Error if the
    folder cannot be written."""
    number = 1
    while (folder / f"{stem}-{number}.png").exists():
        number += 1
    return check_writable(folder / f"{stem}-{number}.png")


def name_for(viewer: Viewer, folder: Path) -> Path:
    mode = "" if viewer.mode == "picture" else f"-{viewer.mode}"
    return free_name(folder, f"{viewer.scene.name}-{viewer.selection.method}{mode}")


def picture_of(viewer: Viewer) -> Image.Image:
    """Return the viewer's picture. A heat map includes its colour scale."""
    assert viewer.image is not None
    image = Image.fromarray(viewer.image)
    return viewer.heat.with_scale(image) if viewer.mode == "heat" else image


def write(path: Path, image: Image.Image, settings: Mapping[str, Any]) -> None:
    """Write the PNG and the JSON file of the settings. Each file is either complete or absent."""
    held = PngImagePlugin.PngInfo()
    held.add_text(KEY, json.dumps(settings, default=str))
    with replacing(path) as temporary:
        image.save(temporary, pnginfo=held)
    with replacing(path.with_suffix(".json")) as temporary:
        temporary.write_text(json.dumps(settings, indent=2, default=str) + "\n",
                             encoding="utf-8")
