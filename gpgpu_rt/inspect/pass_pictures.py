"""Pass pictures: draws, after each pass, each ray's phase, position and nearest hit so far."""
from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from ..disk.files import WRITING, check_writable, read_json, replacing
from ..errors import Error
from ..hits import Hits
from ..rays.batch import RayBatch
from ..scene.camera import Camera
from ..tracer import Tracer
from . import false_colours as colours
from .film_frames import even_loss
from .time_travel import Pass, decode, phase_names, travel

# Fields that locate a ray in the structure. A panel shows the first field that the state has.
PLACES = ("node", "place", "cell", "cursor", "first")
MOST_PICTURES = 200     # default for the approximate number of pictures
MOST_FRAMES = 150       # frames of the GIF, including the first and the last pass
FRAME_MS, LAST_MS = 80, 1500


def write_passes(tracer: Tracer, folder: Path, size: tuple[int, int], every: int | None = None,
                 states: bool = False, camera: Camera | None = None,
                 most: int = MOST_PICTURES,
                 progress: Callable[[int, int], object] = lambda done, of: None
                 ) -> dict[str, Any]:
    """Trace a picture's eye rays and write a picture of all states after each pass.

    The files are ``pass_0000.png`` and so on, ``passes.gif`` with up to MOST_FRAMES frames, and
    ``passes.json``. With ``states``, ``pass_0000.npz`` and so on hold the fields of each ray's
    state and hit. Files that an earlier ``passes.json`` lists are removed. An interrupted run does
    not change the folder.

    Parameters
    ----------
    folder : made if it does not exist
    size : (width, height) pixels
    every : number of passes from one picture to the next. The first and last pass are always drawn
    states : whether to write states too
    camera : by default the scene's own camera
    most : approximate number of pictures if ``every`` is None
    progress : called with the number of finished passes and the expected total

    Returns
    -------
    The content of the JSON file.

    Raises
    ------
    OptionError
        for a tracer whose states cannot be observed; see `travel`
    Error
        if the folder cannot be written
    """
    with _room(folder), tempfile.TemporaryDirectory(prefix=WRITING, dir=folder) as made:
        found = _write(tracer, Path(made), size, every, states, camera, most, progress)
        before, written = _listed(folder), [path.name for path in Path(made).iterdir()]
        for name in written:
            os.replace(Path(made) / name, folder / name)
        with replacing(folder / "passes.json") as path:
            path.write_text(json.dumps(found, indent=1, default=str) + "\n", encoding="utf-8")
        for old in before.difference(written):
            (folder / old).unlink(missing_ok=True)
    return found


def _write(tracer: Tracer, folder: Path, size: tuple[int, int], every: int | None, states: bool,
           camera: Camera | None, most: int,
           progress: Callable[[int, int], object]) -> dict[str, Any]:
    origins, directions = (camera or tracer.scene.camera).rays(size)
    first = tracer.trace(origins, directions)    # compiles the programs, and counts passes
    expected = tracer.statistics.passes
    step = every or -(-expected // most)
    painter = PassPainter(tracer, RayBatch(origins, directions, bounds=tracer.scene.bounds), first)
    passes: list[dict[str, Any]] = []
    held: list[Pass] = []

    def keep(one: Pass) -> None:
        name = f"pass_{one.number:04d}"
        painter.picture(one).save(folder / f"{name}.png")
        passes[-1]["picture"] = f"{name}.png"
        if states:
            np.savez_compressed(folder / f"{name}.npz",
                                **{f"state_{k}": v for k, v in one.state.items()},
                                **{f"hit_{k}": v for k, v in one.hit.items()})
            passes[-1]["states"] = f"{name}.npz"

    def look(one: Pass) -> None:
        passes.append(one.to_dict())
        held[:] = [one]
        if one.number % step == 0:
            keep(one)
            held.clear()
        progress(len(passes), max(len(passes), expected))

    hits = travel(tracer, origins, directions, look)
    if held:
        keep(held[0])
    found = {**tracer.scene.facts(), "method": tracer.method.name, "gpu": tracer.gpu.info(),
             "size": list(size),
             "options": {k: v for k, v in tracer.options.items() if k != "context"},
             "phases": {str(k): v for k, v in phase_names(tracer).items()},
             "rays_hit": int(hits.hit.sum()), "rays": len(hits), "passes": passes}
    drawn = [one for one in passes if "picture" in one]
    _write_gif(folder, [drawn[k]["picture"]
                        for k in even_loss([one["live"] for one in drawn], MOST_FRAMES)])
    return found


def _listed(folder: Path) -> set[str]:
    try:
        passes = read_json(folder / "passes.json")["passes"]
        names = {one[key] for one in passes for key in ("picture", "states") if key in one}
        return {name for name in names if Path(name).name == name}
    except (OSError, ValueError, KeyError, TypeError):
        return set()


@contextmanager
def _room(folder: Path) -> Iterator[None]:
    """Make a missing folder. If the ``with`` block fails, remove a new folder that is empty."""
    is_new = not folder.exists()
    try:
        folder.mkdir(exist_ok=True)
    except OSError as failure:
        advice = ("a file has this name; give another name" if folder.is_file() else
                  f"{failure.strerror}; give a folder whose parent exists")
        raise Error(f"cannot make the folder {folder}: {advice}") from failure
    check_writable(folder / "passes.json")
    try:
        yield
    except BaseException as failure:
        if is_new and not any(folder.iterdir()):
            folder.rmdir()
        if isinstance(failure, OSError):
            raise Error(f"cannot write into {folder}: {failure.strerror or failure}") from failure
        raise


def _write_gif(folder: Path, pictures: list[str]) -> None:
    # Late frames have few live rays, so four frames of the first half give the palette.
    palette = colours.palette([np.asarray(_rgb(folder / pictures[len(pictures) * k // 8]))
                               for k in (0, 1, 2, 4)])
    frames = [_rgb(folder / picture).quantize(palette=palette, dither=Image.Dither.NONE)
              for picture in pictures]
    frames[0].save(folder / "passes.gif", save_all=True, append_images=frames[1:], loop=0,
                   optimize=False, duration=[FRAME_MS] * (len(frames) - 1) + [LAST_MS])


def _rgb(path: Path) -> Image.Image:
    with Image.open(path) as picture:
        return picture.convert("RGB")


def phase_pixels(phases: np.ndarray, names: Mapping[int, str]) -> np.ndarray:
    shown = np.zeros((len(phases), 3), np.uint8)
    for phase in names:
        shown[phases == phase] = colours.category(phase)
    return shown


def distance_pixels(hits: Hits, lo: float, hi: float) -> np.ndarray:
    """Return colours, (n, 3) uint8, of each ray's t from ``lo`` to ``hi``; grey is a miss."""
    shown = np.full((len(hits), 3), colours.NOTHING, np.uint8)
    shown[hits.hit] = colours.ramp((hits.t[hits.hit] - lo) / max(hi - lo, 1e-30))
    return shown


class PassPainter:
    """Draws three panels per pass: phase, position and t. A pixel is a ray.

    Attributes
    ----------
    names : the meaning of each phase
    lo, hi : the smallest and the largest t of the final hits: the ends of the colour scale

    Parameters
    ----------
    batch, hits : the rays of a picture, and their final hits
    """

    def __init__(self, tracer: Tracer, batch: RayBatch, hits: Hits) -> None:
        self.tracer, self.batch, self.size = tracer, batch, batch.size
        t = hits.t[hits.hit]
        self.lo, self.hi = (float(t.min()), float(t.max())) if len(t) else (0.0, 1.0)
        self.names = phase_names(tracer)

    def panels(self, one: Pass) -> list[tuple[str, np.ndarray]]:
        """Return the title and the pixels, (height, width, 3) uint8, of each panel."""
        place = next((name for name in PLACES if name in one.state), "phase")
        wheres = colours.scrambled(one.state[place])
        wheres[one.state["phase"] <= 0] = colours.OVER
        distance = distance_pixels(decode(self.batch, one), self.lo, self.hi)
        phases = phase_pixels(one.state["phase"], self.names)
        return [(title, pixels.reshape(self.size[1], self.size[0], 3))
                for title, pixels in (("next kernel of each ray", phases),
                                      (f"{place}: a colour per number", wheres),
                                      ("t of the nearest hit so far", distance))]

    def legend(self) -> list[tuple[str, tuple[int, int, int]]]:
        """Return the names and colours of the phases, and of rays without a hit."""
        return [*((name, colours.category(phase)) for phase, name in self.names.items()),
                ("no hit yet", colours.NOTHING)]

    def picture(self, one: Pass) -> Image.Image:
        tracer = self.tracer
        panels = [(title, colours.enlarged(pixels)) for title, pixels in self.panels(one)]
        width = panels[0][1].width
        served = ", ".join(f"{count:,} {name}" for name, count in one.served.items()) or "none"
        era, form = tracer.options["era"], tracer.options["schedule"]
        form = f"era {era}" if era else form
        head = [f"{tracer.scene.title}, {tracer.method.name}, {form}: pass "
                f"{one.number}, kernel {'of each ray' if one.kernel == 'all' else one.kernel}",
                f"rays by the kernel that ran: {served}; live rays: {one.live:,} of "
                f"{self.batch.count:,}"]
        legend = colours.stacked([
            colours.swatches(self.legend(), max(3 * width, 300)),
            colours.colour_bar(self.hi, "t of a hit", max(width, 200), self.lo)])
        return colours.sheet(panels, head, legend)
