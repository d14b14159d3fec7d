"""Pictures as data URIs: what a page carries in itself."""
from __future__ import annotations

import base64
import html
import io
from pathlib import Path

from PIL import Image

WIDTHS = (1400, 1000, 700, 450)     # pixels at most, tried in turn until a page is small enough


def data_uri(content: bytes, kind: str) -> str:
    """``data:image/KIND`` of a file's content."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def png_uri(picture: Image.Image | Path, width: int) -> str:
    """A PNG of at most so many pixels' width, in up to 256 colours where that is smaller.

    Raises
    ------
    OSError, ValueError
        a file that is no picture
    """
    if isinstance(picture, Path):
        with Image.open(picture) as file:
            file.load()
            picture = file.convert("RGB")
    if picture.width > width:
        picture = picture.resize((width, max(1, round(picture.height * width / picture.width))),
                                 Image.Resampling.LANCZOS)
    found = []
    for one in (picture, picture.quantize(256, dither=Image.Dither.NONE)):
        buffer = io.BytesIO()
        one.save(buffer, "PNG", optimize=True)
        found.append(buffer.getvalue())
    return data_uri(min(found, key=len), "png")


def image_tag(uri: str, text: str) -> str:
    """An element that says in words what it shows."""
    return f'<img src="{uri}" alt="{html.escape(text, quote=True)}" loading="lazy">'
