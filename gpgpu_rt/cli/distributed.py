"""``gpgpu-rt trace|render --scheduler``: share rays, tiles and frames among workers."""
from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ..disk.files import replacing
from ..errors import OptionError
from ..methods import find_method
from ..scene.animation import Animation
from ..scene.loading import load_scene
from ..scene.region import Region
from ..scene.scene import Scene
from ..text_format import counted
from ..tracer import AUTO, DEFAULT_METHOD
from ..workers.digest import digest
from ..workers.workers import TILE, Workers, check_parts
from .floor import scene_of
from .frames import frame_drawing, kept_frames, opened, write_film
from .parser import Parser
from .picture import drawing_of
from .progress import show_progress, tenths
from .shared import options_for, print_json, print_stand_in, say
from .unfinished import Unfinished, follows_from


def add_scheduler(sub: Parser, what: str) -> None:
    """Declare the option that shares ``what`` among workers."""
    sub.rare.add_argument("--scheduler", metavar="local|ADDRESS", help=f"share {what} among local "
                          "processes (one per core), or among the workers of the Dask scheduler "
                          "at this address")


def trace_shared(chosen: argparse.Namespace, rays: dict[str, np.ndarray]) -> None:
    """Run `trace` on workers, which share the rays."""
    method, options = _method(chosen)
    scene = load_scene(chosen.scene)
    with Workers(chosen.scheduler) as workers, show_progress("part", tenths("part")) as progress:
        hits = workers.trace(scene, method=method, invalid=chosen.invalid,
                             progress=progress, **rays, **options)
        count = len(workers)
    with replacing(chosen.output) as path, path.open("wb") as file:
        np.savez_compressed(file, **hits.to_dict())
    found = int(hits.hit.sum())
    print_stand_in(scene, chosen.json)
    if chosen.json:
        return print_json({**scene.facts(), "method": method,
                           "options": find_method(method).resolved(options),
                           "output": chosen.output, "rays": len(hits), "hits": found,
                           "workers": count})
    print(f"{found:,} of {len(hits):,} rays hit, traced by {counted(count, 'worker')}; "
          f"wrote {chosen.output}")


def render_shared(chosen: argparse.Namespace) -> None:
    """Run `render` on workers, which share the tiles of a picture or the frames of a film."""
    if chosen.explain:
        raise OptionError("--explain works in one process only; leave --scheduler out")
    method, options = _method(chosen)
    draw, source, unit = (
        (_tiles, scene_of(chosen), "tile") if chosen.frames is None
        else (_frames, opened(chosen), "frame"))
    scene = source if isinstance(source, Scene) else source.scene
    drawing = (drawing_of(chosen, source) if isinstance(source, Scene)
               else frame_drawing(chosen, source))
    if chosen.frames is None:
        check_parts(drawing)
    with Workers(chosen.scheduler) as workers:
        renderers = workers.renderers()
        if len(renderers) > 1:
            say(f"workers use different renderers ({', '.join(renderers)}): their parts of the "
                "output may differ in the last bit")
        resolved = find_method(method).resolved(options)
        drawn, kept = draw(chosen, workers, source, drawing, method, options, follows_from(
            method, resolved, ", ".join(renderers), drawing))
        count = len(workers)
    print_stand_in(scene, chosen.json)
    if chosen.json:
        return print_json({**scene.facts(), "method": method, "options": resolved,
                           "output": chosen.output, "parts": kept.count, "drawn": drawn,
                           "workers": count})
    print(f"{drawn:,} of {counted(kept.count, unit)} drawn by {counted(count, 'worker')}; "
          f"wrote {chosen.output}")


def _tiles(chosen: argparse.Namespace, workers: Workers, scene: Scene, drawing: dict[str, Any],
           method: str, options: dict[str, Any], settings: dict[str, Any]
           ) -> tuple[int, Unfinished]:
    """Draw the missing tiles and write the picture. Return the number of drawn tiles, and the
    record of all tiles."""
    regions = Region.of(chosen.size, None).tiles(TILE)
    kept = Unfinished(Path(chosen.output), len(regions),
                      {**settings, "scene": digest(scene), "tile": TILE}, chosen.resume)
    missing = kept.missing
    with kept.until_whole(), show_progress("tile", tenths("tile")) as progress:
        for at, pixels in workers.draw(scene, [regions[part] for part in missing], method,
                                       progress, drawing, **options):
            kept.keep(missing[at], Image.fromarray(pixels))
        picture = Image.new("RGB", chosen.size)
        for part, region in enumerate(regions):
            picture.paste(kept.image(part), region.corner)
        with replacing(chosen.output) as path:
            picture.save(path)
    return len(missing), kept


def _frames(chosen: argparse.Namespace, workers: Workers, animation: Animation,
            drawing: dict[str, Any], method: str, options: dict[str, Any],
            settings: dict[str, Any]) -> tuple[int, Unfinished]:
    """Draw the missing frames and write the film. Return the number of drawn frames, and the
    record of all frames."""
    kept = kept_frames(chosen, animation, settings)
    with kept.until_whole(), show_progress("frame", tenths("frame")) as progress:
        for frame, pixels in workers.frames(animation, kept.missing, method, progress, drawing,
                                            **options):
            kept.keep(frame, Image.fromarray(pixels))
        write_film(chosen.output, kept)
    return len(kept.missing), kept


def _method(chosen: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """Return the method and its options.

    Raise OptionError for auto, ``--settings`` and ``--force``: a choice by saved settings may
    depend on the machine. Raise OptionError for ``--statistics``, too.
    """
    if chosen.settings is not None or chosen.force or chosen.method == AUTO:
        raise OptionError("auto and --settings work in one process only; with --scheduler, name "
                          "the method by --method")
    method = chosen.method or DEFAULT_METHOD
    options = options_for(chosen, method)
    if options.get("statistics"):
        raise OptionError("--statistics works in one process only; leave --scheduler out")
    return method, options
