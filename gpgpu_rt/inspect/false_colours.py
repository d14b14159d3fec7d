"""False colours: numbers, states and names as pixels, with legends; Pillow alone."""
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

# From dark blue to light yellow: grey levels that grow evenly, so that it reads without colours.
_RAMP = np.array([[8, 10, 38], [58, 22, 100], [128, 34, 108], [194, 58, 84], [238, 104, 48],
                  [252, 168, 38], [252, 242, 160]], np.float64)
# What rays do: apart in hue and in lightness, also to eyes that tell red from green badly.
_CATEGORIES = np.array([[230, 159, 0], [86, 180, 233], [0, 158, 115], [240, 228, 66],
                        [204, 121, 167], [0, 114, 178]], np.uint8)
OVER = (38, 38, 44)         # a ray that is done
STOPPED = (255, 30, 30)     # one that was stopped by the step cap
FULL = (255, 0, 200)        # one whose stack was full
NOTHING = (176, 176, 184)   # no number to show
PAPER, INK = (250, 250, 248), (24, 24, 28)
MARGIN, LINE, TEXT = 8, 16, 12     # pixels: around things, of a line, of its letters


def ramp(values: np.ndarray) -> np.ndarray:
    """Colours, (..., 3) uint8, of numbers in [0, 1]."""
    at = np.clip(np.nan_to_num(values), 0, 1) * (len(_RAMP) - 1)
    low = np.minimum(at.astype(int), len(_RAMP) - 2)
    part = (at - low)[..., None]
    return (_RAMP[low] * (1 - part) + _RAMP[low + 1] * part).round().astype(np.uint8)


def palette(pictures: Sequence[np.ndarray]) -> Image.Image:
    """Return an image whose palette ``Image.quantize`` accepts: 256 colours for all ``pictures``.

    The palette has every colour of the legends exactly, and approximates the other colours of the
    pictures, which are (h, w, 3) uint8 of the same size.
    """
    exact = np.concatenate([_CATEGORIES, [OVER, STOPPED, FULL, NOTHING, PAPER, INK],
                            ramp(np.linspace(0, 1, 42))])
    all_of_them = Image.fromarray(np.concatenate(pictures)).quantize(256 - len(exact))
    found = np.reshape(all_of_them.getpalette(), (-1, 3)).astype(int)
    # Pillow looks colours up in cells, so a colour close to a legend's colour could replace it.
    apart = np.abs(found[:, None] - exact[None].astype(int)).max(2).min(1) > 8
    made = Image.new("P", (1, 1))
    made.putpalette(np.concatenate([exact, found[apart]])[:256].ravel().tolist())
    return made


def category(number: int) -> tuple[int, int, int]:
    """The colour of a phase: those from 1 on wait for a kernel, below 0 are stopped."""
    if number <= 0:
        return {0: OVER, -1: STOPPED}.get(number, FULL)
    return tuple(int(c) for c in _CATEGORIES[(number - 1) % len(_CATEGORIES)])


def scrambled(numbers: np.ndarray) -> np.ndarray:
    """Colours, (n, 3) uint8, of (n,) integers or (n, 3) of them: the same for the same number,
    unlike for neighbouring ones."""
    numbers = np.atleast_2d(np.asarray(numbers, np.int64).T).astype(np.uint32)
    mixed = np.zeros(numbers.shape[1], np.uint32)
    for part, factor in zip(numbers, (2654435761, 2246822519, 3266489917)):
        mixed = (mixed ^ (part + np.uint32(1)) * np.uint32(factor)) * np.uint32(668265263)
        mixed ^= mixed >> np.uint32(15)
    channels = np.stack([(mixed >> np.uint32(shift)) & np.uint32(127) for shift in (3, 11, 19)], 1)
    return (channels + 96).astype(np.uint8)


def enlarged(pixels: np.ndarray, least: int = 256) -> Image.Image:
    """(h, w, 3) pixels as an image, each a square of whole pixels, ``least`` wide or more."""
    height, width = pixels.shape[:2]
    factor = max(1, -(-least // width))
    return Image.fromarray(pixels).resize((width * factor, height * factor),
                                          Image.Resampling.NEAREST)


def sheet(panels: Sequence[tuple[str, Image.Image]], head: Sequence[str],
          legend: Image.Image) -> Image.Image:
    """Lines of text, pictures of one size side by side under their titles, and a legend."""
    width, height = panels[0][1].size
    top = MARGIN + LINE * len(head)
    wide = max(len(panels) * (width + MARGIN) + MARGIN, legend.width + 2 * MARGIN,
               max((text_width(line) for line in head), default=0) + 2 * MARGIN)
    page = Image.new("RGB", (wide, top + LINE + height + MARGIN + legend.height + MARGIN), PAPER)
    pen = ImageDraw.Draw(page)
    for row, line in enumerate(head):
        write(pen, (MARGIN, MARGIN // 2 + LINE * row), line)
    for column, (title, picture) in enumerate(panels):
        left = MARGIN + column * (width + MARGIN)
        write(pen, (left, top), title)
        page.paste(picture, (left, top + LINE))
    page.paste(legend, (MARGIN, top + LINE + height + MARGIN))
    return page


def colour_bar(highest: float, unit: str, width: int, lowest: float = 0.0,
               beyond: bool = False) -> Image.Image:
    """The ramp with numbers under it, from ``lowest`` to ``highest``, and ``beyond`` for which the
    last colour stands too."""
    image = Image.new("RGB", (width, 3 * LINE), PAPER)
    bar = np.broadcast_to(ramp(np.linspace(0, 1, width)), (LINE, width, 3))
    image.paste(Image.fromarray(np.ascontiguousarray(bar)), (0, 0))
    pen = ImageDraw.Draw(image)
    ticks = 5 if width >= 300 else 3
    for k in range(ticks):
        text = f"{lowest + (highest - lowest) * k / (ticks - 1):.4g}"
        text += " and more" if beyond and k == ticks - 1 else ""
        at = k * (width - 1) // (ticks - 1)
        pen.line([(at, LINE), (at, LINE + 3)], fill=INK)
        left = min(max(at - text_width(text) // 2, 0), width - text_width(text))
        write(pen, (left, LINE + 3), text)
    write(pen, (0, 2 * LINE), unit)
    return image


def swatches(entries: Sequence[tuple[str, tuple[int, int, int]]], width: int) -> Image.Image:
    """Names beside their colours, as many a line as fit."""
    places, left, row = [], 0, 0
    for name, _ in entries:
        wide = LINE + 4 + text_width(name) + 2 * MARGIN
        if left and left + wide > width:
            left, row = 0, row + 1
        places.append((left, row * LINE))
        left += wide
    image = Image.new("RGB", (width, (row + 1) * LINE), PAPER)
    pen = ImageDraw.Draw(image)
    for (name, colour), (x, y) in zip(entries, places):
        pen.rectangle([x, y + 2, x + LINE - 4, y + LINE - 3], fill=colour, outline=INK)
        write(pen, (x + LINE, y), name)
    return image


def stacked(images: Sequence[Image.Image]) -> Image.Image:
    """Images one under the other."""
    page = Image.new("RGB", (max(i.width for i in images), sum(i.height for i in images)), PAPER)
    top = 0
    for image in images:
        page.paste(image, (0, top))
        top += image.height
    return page


def text_width(text: str) -> int:
    """Pixels that a line takes."""
    return int(np.ceil(ImageFont.load_default(TEXT).getlength(text)))


def write(pen: ImageDraw.ImageDraw, at: tuple[int, int], text: str) -> None:
    """A line of text from its upper left corner."""
    pen.text(at, text, fill=INK, font=ImageFont.load_default(TEXT))
