"""Films: draws films of passes, and heat maps of the cost per pixel, for the HTML report.

A film is stored as one picture: all frames below each other, with a pixel for each ray. The page's
script shows one enlarged frame at a time.
"""
from __future__ import annotations

import html
import json
from collections.abc import Callable, Sequence

import numpy as np
from PIL import Image

from ..errors import Error
from ..inspect.data_uris import image_tag, png_uri
from ..inspect.false_colours import ramp, round_ticks, tick_text
from ..inspect.film_frames import EvenLoss
from ..inspect.heat import Heat, heat, scale_of
from ..inspect.pass_pictures import PassPainter
from ..inspect.time_travel import Pass, travel
from ..rays.batch import RayBatch
from ..scene.scene import Scene
from ..text_format import counted
from ..tracer import Tracer

FRAMES = 60      # largest number of frames of a film
WHITE = 255
WIDEST = 1 << 14     # in pixels; pictures up to this width keep a pixel for each ray
SEAM = 1         # white rows between frames, so that no frame shows a row of the next


class _Film:
    """The chosen frames of a film. A frame shows the panels of a pass side by side."""

    def __init__(self, painter: PassPainter, frames: int) -> None:
        self.painter, self.chooser = painter, EvenLoss(frames)
        self.frames: list[tuple[Pass, np.ndarray]] = []
        self.passes: list[Pass] = []    # holds only the latest pass, for `end`
        self.titles: list[str] = []

    def look(self, one: Pass) -> None:
        """Add a pass to the film if a frame is due."""
        self.passes[:] = [one]
        if self.chooser.takes(one.live):
            self._add(one)

    def end(self) -> None:
        last = self.passes[0]
        if self.frames[-1][0] is not last:
            if self.chooser.is_replaced(len(self.frames), self.frames[-1][0].live, last.live):
                self.frames.pop()
            self._add(last)

    def _add(self, one: Pass) -> None:
        panels = self.painter.panels(one)
        self.titles = [title for title, _ in panels]
        height, width, _ = panels[0][1].shape
        gap = np.full((height, max(1, width // 32), 3), WHITE, np.uint8)
        parts = [part for _, pixels in panels for part in (gap, pixels)][1:]
        self.frames.append((one, np.concatenate(parts, axis=1)))

    def picture(self) -> Image.Image:
        """Return all frames below each other."""
        _, first = self.frames[0]
        seam = np.full((SEAM, *first.shape[1:]), WHITE, np.uint8)
        return Image.fromarray(np.concatenate(
            [part for _, pixels in self.frames for part in (pixels, seam)]))

    def texts(self, rays: int) -> list[str]:
        last = self.passes[0].number
        found = []
        for one, _ in self.frames:
            served = ", ".join(f"{name} {count:,}" for name, count in one.served.items())
            found.append(f"pass {one.number:,} of {last:,}: {one.live:,} of "
                         f"{counted(rays, 'ray')} live" + (f"; ran {served}" if served else ""))
        return found


def film(scene: Scene, method: str, size: tuple[int, int]) -> str:
    """Return HTML with a film of a method's passes over eye rays. The film shows a new frame each
    time a fixed share of the rays has ended."""
    rays = size[0] * size[1]
    with Tracer(scene, method, schedule="step") as tracer:
        origins, directions = scene.camera.rays(size)
        hits = tracer.trace(origins, directions)
        painter = PassPainter(tracer, RayBatch(origins, directions, bounds=scene.bounds), hits)
        made = _Film(painter, FRAMES)
        travel(tracer, origins, directions, made.look)
        made.end()
    texts, last = made.texts(rays), made.passes[0].number
    middle = len(texts) // 2
    half = made.frames[middle][0]
    alt = (f"Film of {len(texts)} frames, with a pixel for each of {size[0]} x {size[1]} eye rays "
           f"of {scene.title}, traced by {method}. Panels: {'; '.join(made.titles)}. "
           f"After pass {half.number:,} of {last:,}, {half.live:,} rays are live; at the end "
           f"{hits.hit.sum():,} rays have hit.")
    _, pixels = made.frames[0]
    legend = "".join(f'<span><i style="background:rgb{colour}"></i>{html.escape(name)}</span>'
                     for name, colour in painter.legend())
    # Without the script, the page shows the frame in the middle.
    tag = image_tag(png_uri(made.picture(), WIDEST), alt,
                    f'style="transform:translateY({-100 * middle / len(texts):.6g}%)"')
    titles = "".join(f"<span>{html.escape(title)}</span>" for title in made.titles)
    return (f'<figure class="film" data-frames="{html.escape(json.dumps(texts), quote=True)}">'
            f'<div class="panels">{titles}</div>'
            f'<div class="screen" style="aspect-ratio:{pixels.shape[1]}/{pixels.shape[0]}">'
            f'{tag}</div><div class="controls" hidden><button type="button">Play</button>'
            f'<input type="range" min="0" max="{len(texts) - 1}" value="{middle}" '
            'aria-label="frame of the film"><span class="state"></span></div>'
            f'<p class="legend">{legend}</p>{_scale(painter.lo, painter.hi, "t of a hit")}'
            f"<figcaption>{html.escape(method)} on {html.escape(scene.title)}. The film shows a "
            "new frame each time a fixed share of the rays has ended.</figcaption></figure>")


def heat_maps(scene: Scene, methods: Sequence[str], size: tuple[int, int]) -> str:
    """Return HTML with heat maps of several methods on one scale. A map shows the number of kernel
    runs of each pixel's ray."""
    maps = []
    for method in methods:
        with Tracer(scene, method, statistics=True) as tracer:
            maps.append(heat(tracer, "steps", size))
    top = scale_of(maps)
    shown = "".join(_map(one, top, scene) for one in maps)
    beyond = any(one.values.max() > top for one in maps)
    unit = "steps (kernel runs) per ray" + (
        f"; the last colour is {tick_text(top)} and more" if beyond else "")
    return (f'<figure class="maps"><div class="panels">{shown}</div>{_scale(0.0, top, unit)}'
            f"<figcaption>The cost of each eye ray of {html.escape(scene.title)}, on one scale."
            "</figcaption></figure>")


def _map(one: Heat, top: float, scene: Scene) -> str:
    found = one.summary()
    alt = (f"Heat map of {one.title} on {scene.title}: the steps of each ray. Half of the rays "
           f"take at most {found['median']:.0f} steps, and 99 % take at most "
           f"{found['quantile_99']:.0f}.")
    tag = image_tag(png_uri(Image.fromarray(ramp(one.values / top)), WIDEST), alt,
                    'class="pixels"')
    return (f"<span>{tag}{html.escape(one.title)}: mean {found['mean']:.1f}, most "
            f"{found['max']:.0f}</span>")


def _scale(low: float, high: float, unit: str) -> str:
    """Return HTML with the ramp of colours, and with round numbers below the ramp."""
    stops = ",".join(f"rgb{tuple(colour)}" for colour in ramp(np.linspace(0, 1, 8)).tolist())
    ticks = ""
    for tick in round_ticks(low, high, 5):
        share = (tick - low) / (high - low)
        side = 0 if share < 0.03 else -100 if share > 0.97 else -50     # keep text within the ramp
        ticks += (f'<span style="left:{100 * share:.4g}%;transform:translateX({side}%)">'
                  f"{tick_text(tick)}</span>")
    return (f'<div class="scale"><div class="ramp" style="background:linear-gradient(90deg,'
            f'{stops})"></div><div class="ticks">{ticks}</div>{html.escape(unit)}</div>')


def or_why_not(make: Callable[[], str]) -> str:
    """Return the result of ``make``; on an error, return HTML with the error message instead."""
    try:
        return make()
    except Error as failure:
        return f'<p class="missing">Not shown: {html.escape(str(failure))}</p>'
