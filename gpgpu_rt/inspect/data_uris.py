"""Data URIs: embeds pictures in a page."""
from __future__ import annotations

import base64
import html
import io
import warnings
from pathlib import Path

from PIL import Image

# Refuse pictures with more pixels (about 100 MB as RGB), because a file may declare any size.
MOST_PIXELS = 1 << 25
DESCRIPTION = "Description"     # key of the describing text in a PNG file


def data_uri(content: bytes, kind: str) -> str:
    """Return the ``data:image/KIND`` URI of a file's content."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def png_uri(picture: Image.Image | Path, width: int) -> str:
    """Return a picture as the data URI of a PNG, at most ``width`` pixels wide. The PNG has 256
    colours if that makes it smaller.

    Raises
    ------
    OSError, ValueError
        if the file is not a picture, or has more than MOST_PIXELS
    """
    if isinstance(picture, Path):
        if not picture.is_file():       # reading a pipe or a device may never end
            raise FileNotFoundError(picture)
        with _opened(picture) as file:
            if file.width * file.height > MOST_PIXELS:
                raise ValueError(f"{picture} has {file.width} x {file.height} pixels, more than "
                                 f"{MOST_PIXELS:,}")
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


def description_of(path: Path) -> str:
    """Return the describing text of a PNG file, or ""."""
    try:
        with _opened(path) as file:
            return str(file.info.get(DESCRIPTION, ""))
    except (OSError, ValueError):
        return ""


def _opened(path: Path) -> Image.Image:
    """Open a picture without decoding it. Raise ValueError if Pillow refuses its declared size."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            return Image.open(path)
    except Image.DecompressionBombError as failure:
        raise ValueError(str(failure)) from failure


def image_tag(uri: str, text: str, attributes: str = "") -> str:
    """Return an HTML image element. ``attributes`` are further attributes, and ``text`` is for
    readers who cannot see the picture."""
    more = f" {attributes}" if attributes else ""
    return f'<img src="{uri}" alt="{html.escape(text, quote=True)}" loading="lazy"{more}>'
