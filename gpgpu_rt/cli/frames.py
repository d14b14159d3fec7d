"""``gpgpu-rt render --frames``: render a moving scene to numbered files or to one film."""
from __future__ import annotations

import argparse
import contextlib
import functools
import os
import re
import statistics
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from ..disk.files import check_writable, replacing
from ..errors import Error, OptionError
from ..scene.animation import Animation, load_animation
from ..scene.procedural.animations import FRAMES_A_SECOND
from ..text_format import counted
from ..tracer import Tracer
from ..workers.digest import digest
from .camera import given_camera
from .parser import Parser
from .picture import drawing_of
from .unfinished import Unfinished, follows_from

IMAGES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp")
_FILMS = {".gif": "GIF", ".png": "PNG", ".apng": "PNG", ".webp": "WEBP"}
_NUMBER = re.compile(r"%0?\d?d")
_WIDE = re.compile(r"%\d{2,}d")
MOST_FRAMES = 1_000_000


def add_frames(sub: Parser) -> None:
    sub.rare.add_argument("--resume", action="store_true", help="with --frames or --scheduler: "
                          "keep the parts that an interrupted run with the same settings saved in "
                          "OUTPUT.unfinished, and draw only the missing parts")
    sub.rare.add_argument("--build-ahead", action="store_true", help="with --frames: another "
                          "process builds the next frame's structure while a frame renders; the "
                          "structure is rebuilt for every frame, even if the method could refit "
                          "it")
    sub.add_argument("--frames", type=_whole, metavar="N", help="render the first N frames of a "
                     "moving scene, to numbered files if --output is a folder (ends in /) or "
                     "contains %%04d, else to one GIF, APNG or WebP. A camera that moves with the "
                     "scene is used unless an option such as --eye is given")


def check_frames(chosen: argparse.Namespace) -> None:
    """Raise OptionError for ``--floor`` with ``--frames``, and for ``--build-ahead`` without
    ``--frames`` or with ``--scheduler``."""
    if chosen.floor and chosen.frames is not None:
        raise OptionError("--floor cannot follow a moving scene; leave --frames or --floor out")
    if chosen.build_ahead and (chosen.frames is None or chosen.scheduler is not None):
        raise OptionError("--build-ahead needs --frames, and does not work with --scheduler; "
                          "leave --build-ahead out, or give --frames N without --scheduler")


def render_frames(chosen: argparse.Namespace,
                  open_tracer: Callable[[Animation], Tracer]) -> tuple[Tracer, str]:
    """Render and write the frames; return the tracer and a summary to print.

    ``open_tracer`` returns the tracer of the animation's scene at frame 0.
    """
    if chosen.explain:
        raise OptionError("--explain works for a single picture only; leave --frames out")
    animation = opened(chosen)
    tracer = open_tracer(animation)
    try:
        drawing = frame_drawing(chosen, animation)
        kept = kept_frames(chosen, animation, follows_from(
            tracer.method.name, tracer.options, tracer.gpu.renderer, drawing))
        spent: list[dict[str, Any]] = []
        with kept.until_whole():
            for frame in _moved(tracer, animation, kept.missing, chosen.build_ahead):
                kept.keep(frame, tracer.render(**animation.drawing(frame, drawing)))
                if frame:
                    spent.append(tracer.statistics.to_dict())
            write_film(chosen.output, kept)
    except BaseException:
        tracer.release()
        raise
    there = kept.count - len(kept.missing)
    return tracer, (f"wrote {counted(len(kept.missing), 'frame')} to {chosen.output}"
                    + (f"; {there} were kept from an earlier run" if there else "")
                    + f"\n{_summary(spent, chosen.build_ahead)}")


def _moved(tracer: Tracer, animation: Animation, frames: Sequence[int],
           ahead: bool) -> Iterator[int]:
    """Move the tracer's scene to each frame, and yield the frame. With ``ahead``, another process
    builds the next frame's structure meanwhile."""
    moving = [frame for frame in frames if frame]
    moves = tracer.updates(map(animation.vertices, moving)) if ahead else (
        tracer.update(animation.vertices(frame)) for frame in moving)
    with contextlib.closing(moves):
        for frame in frames:
            if frame:
                next(moves)
            yield frame


def opened(chosen: argparse.Namespace) -> Animation:
    """Check that frames can be written; return the animation that the command names."""
    _check(chosen.output)
    animation = load_animation(chosen.scene)
    if animation.frames is not None and chosen.frames > animation.frames:
        raise OptionError(f"--frames {chosen.frames}: {chosen.scene} has only "
                          f"{counted(animation.frames, 'frame')}")
    return animation


def frame_drawing(chosen: argparse.Namespace, animation: Animation) -> dict[str, Any]:
    """Return the arguments of `Tracer.render` that all frames share. If the animation moves the
    camera, ``camera`` is missing, unless an option such as --eye is given."""
    drawing = drawing_of(chosen, animation.scene)
    if animation.camera is not None and not given_camera(chosen):
        del drawing["camera"]
    return drawing


def kept_frames(chosen: argparse.Namespace, animation: Animation,
                settings: dict[str, Any]) -> Unfinished:
    """Return the record of finished frames.

    ``settings`` and the animation determine a frame's pixels. A later run may resume with more
    frames.
    """
    numbered = _is_numbered(chosen.output)
    output = Path(chosen.output) / "frames" if Path(chosen.output).is_dir() else Path(
        chosen.output)
    return Unfinished(output, chosen.frames, {
        **settings, "scene": digest(animation.scene), "motion": digest(animation.vertices),
        **({} if "camera" in settings else {"view": digest(animation.camera)})},
        chosen.resume, functools.partial(_name, chosen.output) if numbered else None)


def _summary(spent: list[dict[str, Any]], ahead: bool) -> str:
    """Return a line with the median times of the frames after the first.

    With ``ahead``, a build's time is the wait for the build, plus the time to write the tables.
    """
    if not spent:
        return "no times: no frame after the first was rendered"
    builds = [s["build_seconds"] for s in spent if s["rebuilt"]]
    refits = [s["refit_seconds"] for s in spent if not s["rebuilt"]]
    in_build = ("rebuilt ahead", "waited") if ahead else ("rebuilt", "took")
    parts = [f"{word} {counted(len(times), 'time')}, {took} "
             f"{statistics.median(times) * 1e3:.0f} ms"
             for (word, took), times in ((("refitted", "took"), refits), (in_build, builds))
             if times]
    whole = [s["trace_seconds"] + s["refit_seconds"] + (s["build_seconds"] if s["rebuilt"] else 0)
             for s in spent]
    trace = statistics.median(s["trace_seconds"] for s in spent)
    return (f"{'; '.join(parts)}; rendered in {trace * 1e3:.0f} ms (medians): "
            f"{1 / statistics.median(whole):.2f} frames per second")


# Output -----------------------------------------------------------------------------------------

def _is_numbered(output: str) -> bool:
    return bool(_NUMBER.search(output)) or Path(output).is_dir() or output.endswith(os.sep)


def _check(output: str) -> None:
    path, suffix = Path(output), Path(output).suffix.lower()
    if (wide := _WIDE.search(output)) and not _NUMBER.fullmatch(wide[0]):
        raise OptionError(f"cannot number frames by {wide[0][:20]}; give at most 9 digits, for "
                          "example frame_%04d.png")
    if not _is_numbered(output):
        if suffix not in _FILMS:
            raise OptionError(f"cannot write frames to {output}; end the name in "
                              f"{', '.join(_FILMS)} for a film, put %04d into it for numbered "
                              "files, or give a folder")
        check_writable(output)
    elif not _NUMBER.search(output):
        try:
            path.mkdir(exist_ok=True)
        except OSError as failure:
            raise Error(f"cannot create the folder {output}: {failure.strerror}") from failure
        check_writable(path / "frame_0000.png")
    elif _NUMBER.search(path.name) is None or suffix not in IMAGES:
        raise OptionError(f"cannot write numbered frames to {output}; give a name such as "
                          "frame_%04d.png")
    else:
        check_writable(_name(output, 0))


def _name(output: str, frame: int) -> Path:
    if _NUMBER.search(output):
        return Path(_NUMBER.sub(lambda match: match[0] % frame, output))
    return Path(output) / f"frame_{frame:04d}.png"


def write_film(output: str, kept: Unfinished) -> None:
    """Write the frames as a film that plays in a loop, unless each frame has its own file."""
    if _is_numbered(output):
        return
    first, *rest = map(kept.image, range(kept.count))
    with replacing(output) as path:
        first.save(path, format=_FILMS[Path(output).suffix.lower()], save_all=True,
                   append_images=rest, duration=1000 / FRAMES_A_SECOND, loop=0)


def _whole(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = 0
    if not 1 <= number <= MOST_FRAMES:
        raise argparse.ArgumentTypeError(f"{text[:40]!r} is not a number of frames; give a number "
                                         f"from 1 to {MOST_FRAMES:,}")
    return number
