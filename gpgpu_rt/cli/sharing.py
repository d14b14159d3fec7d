"""``gpgpu-rt trace|render --scheduler``: rays, tiles and frames shared among workers."""
from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ..animation import Animation
from ..content import digest
from ..errors import OptionError
from ..files import replacing
from ..methods import find_method
from ..region import Region
from ..scene import Scene, load_scene
from ..tracer import AUTO, DEFAULT_METHOD
from ..workers.workers import TILE, Progress, Workers
from .camera import camera_of
from .frames import kept_frames, opened, write_film
from .picture import picture_options
from .shared import options_for, print_json, say
from .unfinished import Unfinished


def add_scheduler(sub: argparse.ArgumentParser, what: str) -> None:
    """The option that shares ``what``."""
    sub.add_argument("--scheduler", metavar="local|ADDRESS", help=f"share {what} among a process "
                     "a core, or among the workers of a Dask scheduler")


def trace_shared(chosen: argparse.Namespace, rays: dict[str, np.ndarray]) -> None:
    """`trace` among workers; what their tracers count is theirs, and not told."""
    method, options = _method(chosen)
    with Workers(chosen.scheduler) as workers, _told("parts") as progress:
        hits = workers.trace(chosen.scene, method=method, invalid=chosen.invalid,
                             progress=progress, **rays, **options)
        count = len(workers)
    with replacing(chosen.output) as path, path.open("wb") as file:
        np.savez_compressed(file, **hits.to_dict())
    found = {"output": chosen.output, "rays": len(hits), "hits": int(hits.hit.sum()),
             "workers": count}
    if chosen.json:
        return print_json(found)
    print(f"{found['hits']:,} of {len(hits):,} rays hit, traced by {count} workers; "
          f"wrote {chosen.output}")


def render_shared(chosen: argparse.Namespace) -> None:
    """`render` among workers: a picture by its tiles, or frames."""
    if chosen.explain:
        raise OptionError("--explain is of one process; leave --scheduler out")
    method, options = _method(chosen)
    draw, source = (_tiles, load_scene(chosen.scene)) if chosen.frames is None else (
        _frames, opened(chosen))
    scene = source if isinstance(source, Scene) else source.scene
    drawing = {"camera": camera_of(chosen, scene.camera), "size": chosen.size,
               "first_hits": chosen.first_hits, **picture_options(chosen)}
    with Workers(chosen.scheduler) as workers:
        renderers = workers.renderers()
        if len(renderers) > 1:
            say(f"workers draw by {', '.join(renderers)}: parts may differ by a bit")
        drawn, kept = draw(chosen, workers, source, drawing, method, options, {
            **drawing, "method": method, "options": find_method(method).resolved(options),
            "renderer": ", ".join(renderers)})
        found = {"output": chosen.output, "parts": kept.count, "drawn": drawn,
                 "workers": len(workers)}
    if chosen.json:
        return print_json(found)
    print(f"{drawn} of {kept.count} {draw.__name__.strip('_')} drawn by {found['workers']} "
          f"workers; wrote {chosen.output}")


def _tiles(chosen: argparse.Namespace, workers: Workers, scene: Scene, drawing: dict[str, Any],
           method: str, options: dict[str, Any], settings: dict[str, Any]
           ) -> tuple[int, Unfinished]:
    """Draw the tiles that are not there yet, and the picture; how many were drawn."""
    regions = Region.of(chosen.size, None).tiles(TILE)
    kept = Unfinished(Path(chosen.output), len(regions),
                      {**settings, "scene": digest(scene), "tile": TILE}, chosen.resume)
    missing = kept.missing
    with kept.until_whole(), _told("tiles") as progress:
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
    """Draw the frames that are not there yet, and the film; how many were drawn."""
    kept = kept_frames(chosen, animation, settings)
    with kept.until_whole(), _told("frames") as progress:
        for frame, pixels in workers.frames(animation, kept.missing, method, progress, drawing,
                                            **options):
            kept.keep(frame, Image.fromarray(pixels))
        write_film(chosen.output, kept)
    return len(kept.missing), kept


def _method(chosen: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """The method that was named and its options; whatever machine takes them, they are known."""
    if chosen.settings is not None or chosen.force or chosen.method == AUTO:
        raise OptionError("--scheduler goes with a method and its options; name one by --method")
    method = chosen.method or DEFAULT_METHOD
    return method, options_for(chosen, method)


@contextmanager
def _told(unit: str) -> Iterator[Progress]:
    """What is to be told the parts that are done: a bar where tqdm is installed and someone looks
    on; else a line for each tenth of them."""
    try:
        from tqdm import tqdm
    except ImportError:
        yield _tenths(unit)
        return
    with tqdm(unit=unit.removesuffix("s"), dynamic_ncols=True, disable=None) as bar:
        if bar.disable:
            yield _tenths(unit)
            return

        def move(done: int, of: int) -> None:
            bar.total = of
            bar.update(done - bar.n)

        yield move


def _tenths(unit: str) -> Progress:
    def tell(done: int, of: int) -> None:
        if 10 * done // of > 10 * (done - 1) // of:
            say(f"{done} of {of} {unit}")

    return tell
