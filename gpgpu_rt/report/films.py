"""Films of passes and heat maps of the cost per pixel, made while the page is written."""
from __future__ import annotations

import html
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

from ..errors import Error
from ..inspect.data_uris import data_uri, image_tag, png_uri
from ..inspect.heat import draw_heat, heat
from ..inspect.pass_pictures import write_passes
from ..scene.scene import Scene
from ..text_format import counted
from ..tracer import Tracer

FRAMES = 60      # approximate number of pictures in a film


def film(scene: Scene, method: str, size: tuple[int, int]) -> str:
    """Return HTML with the passes of a method over eye rays as an animated GIF."""
    with tempfile.TemporaryDirectory() as made, Tracer(scene, method, schedule="step") as tracer:
        found = write_passes(tracer, Path(made), size, most=FRAMES)
        uri = data_uri((Path(made) / "passes.gif").read_bytes(), "gif")
    count = len(found["passes"])
    said = (f"{method} on {scene.title}: {size[0]} x {size[1]} rays, {counted(count, 'pass')}, "
            f"{counted(found['rays_hit'], 'ray')} hit")
    return _shown(image_tag(uri, said), said)


def heat_maps(scene: Scene, methods: Sequence[str], size: tuple[int, int], width: int) -> str:
    """Return HTML with heat maps by several methods on one scale: kernel runs for each pixel."""
    maps = []
    for method in methods:
        with Tracer(scene, method, statistics=True) as tracer:
            maps.append(heat(tracer, "steps", size))
    means = ", ".join(f"{one.title} {one.summary()['mean']:.1f}" for one in maps)
    said = f"Steps per ray on {scene.title}, on one scale; means: {means}"
    return _shown(image_tag(png_uri(draw_heat(maps, "steps", scene.title), width), said), said)


def or_why_not(make: Callable[[], str]) -> str:
    """Return the result of ``make``, or HTML with its error message, so that the page is written
    even without a film."""
    try:
        return make()
    except Error as failure:
        return f'<p class="missing">Not shown: {html.escape(str(failure))}</p>'


def _shown(picture: str, said: str) -> str:
    return f"<figure>{picture}<figcaption>{html.escape(said)}</figcaption></figure>"
