"""False colours: draws numbers, states and names as pixels, with legends, by numpy and Pillow."""
from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from PIL import Image, ImageDraw, ImageFont

# Colours of numbers, from dark blue to light yellow. Lightness grows evenly, for greyscale prints.
RAMP = np.array([[8, 10, 38], [58, 22, 100], [128, 34, 108], [194, 58, 84], [238, 104, 48],
                 [252, 168, 38], [252, 242, 160]], np.float64)
# Colours of ray phases. They differ in hue and in lightness, for readers with red-green colour
# blindness.
_CATEGORIES = np.array([[230, 159, 0], [86, 180, 233], [0, 158, 115], [240, 228, 66],
                        [204, 121, 167], [0, 114, 178]], np.uint8)
OVER = (38, 38, 44)         # a finished ray
STOPPED = (255, 30, 30)     # a ray that the step cap stopped
FULL = (255, 0, 200)        # a ray with a full stack
NOTHING = (176, 176, 184)   # no value
PAPER, INK = (250, 250, 248), (24, 24, 28)
MARGIN, LINE, TEXT = 8, 16, 12     # pixels: margin, height of a text line, font size


def ramp(values: np.ndarray) -> np.ndarray:
    """Return colours, (..., 3) uint8, of numbers in [0, 1]."""
    at = np.clip(np.nan_to_num(values), 0, 1) * (len(RAMP) - 1)
    low = np.minimum(at.astype(int), len(RAMP) - 2)
    part = (at - low)[..., None]
    return (RAMP[low] * (1 - part) + RAMP[low + 1] * part).round().astype(np.uint8)


def palette(pictures: Sequence[np.ndarray]) -> Image.Image:
    """Return an image with a palette of at most 256 colours for all ``pictures``, (h, w, 3) uint8
    of the same size, for use by ``Image.quantize``. The colours of phases and text, and 42 colours
    of the ramp, are exact."""
    exact = np.concatenate([_CATEGORIES, [OVER, STOPPED, FULL, NOTHING, PAPER, INK],
                            ramp(np.linspace(0, 1, 42))])
    all_of_them = Image.fromarray(np.concatenate(pictures)).quantize(256 - len(exact))
    found = np.reshape(all_of_them.getpalette(), (-1, 3)).astype(int)
    # Drop colours close to an exact colour: Pillow groups similar colours when it searches the
    # palette, and could return the close colour for the exact colour.
    apart = np.abs(found[:, None] - exact[None].astype(int)).max(2).min(1) > 8
    made = Image.new("P", (1, 1))
    made.putpalette(np.concatenate([exact, found[apart]])[:256].ravel().tolist())
    return made


def category(number: int) -> tuple[int, int, int]:
    """Return a ray's colour by its phase: 0 if it is done, above 0 if it waits for a kernel, and
    below 0 if it was stopped."""
    if number <= 0:
        return {0: OVER, -1: STOPPED}.get(number, FULL)
    return tuple(int(c) for c in _CATEGORIES[(number - 1) % len(_CATEGORIES)])


def scrambled(numbers: np.ndarray) -> np.ndarray:
    """Return colours, (n, 3) uint8, of integers, (n,), or of integer vectors, (n, 3). Equal
    numbers have equal colours. Neighbouring numbers have different colours."""
    numbers = np.atleast_2d(np.asarray(numbers, np.int64).T).astype(np.uint32)
    mixed = np.zeros(numbers.shape[1], np.uint32)
    for part, factor in zip(numbers, (2654435761, 2246822519, 3266489917)):
        mixed = (mixed ^ (part + np.uint32(1)) * np.uint32(factor)) * np.uint32(668265263)
        mixed ^= mixed >> np.uint32(15)
    channels = np.stack([(mixed >> np.uint32(shift)) & np.uint32(127) for shift in (3, 11, 19)], 1)
    return (channels + 96).astype(np.uint8)


def enlarged(pixels: np.ndarray, least: int = 256) -> Image.Image:
    """Return (h, w, 3) pixels as an image, enlarged by a whole number to a width of at least
    ``least``."""
    height, width = pixels.shape[:2]
    factor = max(1, -(-least // width))
    return Image.fromarray(pixels).resize((width * factor, height * factor),
                                          Image.Resampling.NEAREST)


def sheet(panels: Sequence[tuple[str, Image.Image]], head: Sequence[str],
          legend: Image.Image) -> Image.Image:
    """Return a page: text lines, titled pictures of the same size, and a legend."""
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
    """Return the colour ramp from ``lowest`` to ``highest``, with round numbers below the ramp.
    With ``beyond``, the label says that the last colour includes larger numbers."""
    label = unit + (f" (last colour: {tick_text(highest)} and more)" if beyond else "")
    lines = [""]
    for word in label.split():      # break the label into lines of at most `width`
        longer = f"{lines[-1]} {word}".strip()
        lines[-1:] = [longer] if text_width(longer) <= width else [lines[-1], word]
    image = Image.new("RGB", (width, (2 + len(lines)) * LINE), PAPER)
    bar = np.broadcast_to(ramp(np.linspace(0, 1, width)), (LINE, width, 3))
    image.paste(Image.fromarray(np.ascontiguousarray(bar)), (0, 0))
    pen = ImageDraw.Draw(image)
    for tick in round_ticks(lowest, highest, 6 if width >= 300 else 3):
        text = tick_text(tick)
        at = round((tick - lowest) / (highest - lowest) * (width - 1))
        pen.line([(at, LINE), (at, LINE + 3)], fill=INK)
        left = min(max(at - text_width(text) // 2, 0), width - text_width(text))
        write(pen, (left, LINE + 3), text)
    for row, line in enumerate(lines):
        write(pen, (0, (2 + row) * LINE), line)
    return image


def round_ticks(lowest: float, highest: float, most: int) -> list[float]:
    """Return at most ``most`` evenly spaced round numbers between two numbers."""
    if not lowest < highest:
        return []
    step = 10.0 ** math.floor(math.log10((highest - lowest) / most))
    for factor in (1, 2, 2.5, 5, 10, 20):
        first = math.ceil(lowest / (factor * step) - 1e-9)
        last = math.floor(highest / (factor * step) + 1e-9)
        if last - first < most:
            break
    return [k * factor * step for k in range(first, last + 1)]


def tick_text(value: float) -> str:
    return f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.4g}"


def round_up(value: float) -> float:
    """Return the smallest round number that is at least ``value`` > 0."""
    unit = 10.0 ** math.floor(math.log10(value))
    return next(factor * unit for factor in (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10)
                if factor * unit >= value * (1 - 1e-9))


def swatches(entries: Sequence[tuple[str, tuple[int, int, int]]], width: int) -> Image.Image:
    """Return a legend of named colours, as many in a line as fit."""
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
    page = Image.new("RGB", (max(i.width for i in images), sum(i.height for i in images)), PAPER)
    top = 0
    for image in images:
        page.paste(image, (0, top))
        top += image.height
    return page


def text_width(text: str) -> int:
    return int(np.ceil(ImageFont.load_default(TEXT).getlength(text)))


def write(pen: ImageDraw.ImageDraw, at: tuple[int, int], text: str) -> None:
    """Draw a line of text with its upper left corner ``at``."""
    pen.text(at, text, fill=INK, font=ImageFont.load_default(TEXT))
