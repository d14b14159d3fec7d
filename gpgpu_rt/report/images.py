"""Pictures as data URIs: what a page carries in itself."""
from __future__ import annotations

import base64
import html
import io
import warnings
from pathlib import Path

from PIL import Image

WIDTHS = (1400, 1000, 700, 450)     # pixels at most, tried in turn until a page is small enough
MOST_PIXELS = 1 << 25   # of a chart, about 100 MB as it is read; a small file may claim any number


def data_uri(content: bytes, kind: str) -> str:
    """``data:image/KIND`` of a file's content."""
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def png_uri(picture: Image.Image | Path, width: int) -> str:
    """A PNG of at most so many pixels' width, in up to 256 colours where that is smaller.

    Raises
    ------
    OSError, ValueError
        a file that is no picture, or a picture of more than MOST_PIXELS
    """
    if isinstance(picture, Path):
        if not picture.is_file():       # a pipe would hang, a device never end
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


def _opened(path: Path) -> Image.Image:
    """The picture, not yet decoded, whatever size it claims."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            return Image.open(path)
    except Image.DecompressionBombError as failure:
        raise ValueError(str(failure)) from failure


def image_tag(uri: str, text: str) -> str:
    """An element that says in words what it shows."""
    return f'<img src="{uri}" alt="{html.escape(text, quote=True)}" loading="lazy">'
