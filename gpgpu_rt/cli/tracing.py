"""``gpgpu-rt render`` and ``trace``: trace a picture, or the rays of a file."""
from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from ..disk.arrays import read_npz
from ..disk.files import check_writable, replacing
from ..errors import Error, OptionError
from ..gl.context import open_gpu
from ..render.plan import Plan
from ..scene.loading import load_scene
from ..scene.scene import Scene
from ..text_format import counted
from ..tracer import AUTO, DEFAULT_METHOD, Tracer
from ..traversal.stages.first_hits import FIRST_HITS
from .camera import add_camera
from .distributed import add_scheduler, render_shared, trace_shared
from .floor import add_floor, scene_of
from .frames import IMAGES, add_frames, check_frames, render_frames
from .parser import Parser
from .picture import add_picture, drawing_of, explain, progress_shown
from .shared import (
    Command, add_method, add_options, given_options, options_for, print_json, print_stand_in,
    size_word
)
from .timings import Timings


def add_commands(command: Command) -> None:
    sub = command("render", _render, "render a scene to an image file")
    sub.add_argument("scene", help="a scene's name, a mesh file or a scene file (.json)")
    _add_choice(sub)
    sub.add_argument("-o", "--output", required=True, metavar="IMAGE.png",
                     help="the file to write")
    sub.add_argument("--size", type=size_word, default=(512, 512), metavar="WIDTHxHEIGHT",
                     help="size of the picture in pixels; default 512x512")
    sub.rare.add_argument("--first-hits", choices=FIRST_HITS, default=FIRST_HITS[0],
                          help="how to find the hits of eye rays. traced: by the method. "
                          "rasterised: by the rasteriser, with proof that each hit equals the "
                          "traced hit to the bit. verified: by the rasteriser, with a check that "
                          "each hit is a hit of its ray, but not that it is the nearest; default "
                          "%(default)s")
    sub.rare.add_argument("--timings", action="store_true", help="print the time of each part, "
                          "from the start of the process to the written file; the first pass of a "
                          "program includes its compilation")
    add_camera(sub)
    add_picture(sub)
    add_floor(sub)
    add_frames(sub)
    add_scheduler(sub, "the picture's tiles, or the frames,")
    add_options(sub, unowned=(AUTO,))
    sub = command("trace", _trace, "trace the rays of a file and write their hits to a file")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    sub.add_argument("rays", metavar="RAYS.npz", help="arrays origins and directions, (n, 3) "
                     "each, and optionally t_min and t_max")
    _add_choice(sub)
    sub.add_argument("-o", "--output", required=True, metavar="HITS.npz",
                     help="the file to write")
    sub.add_argument("--invalid", choices=("raise", "miss"), default="raise",
                     help="treat a ray with NaN, infinity or a zero direction as an error, or as "
                     "a miss; default %(default)s")
    add_scheduler(sub, "the rays")
    add_options(sub, unowned=(AUTO,))


def _add_choice(sub: Parser) -> None:
    add_method(sub, "a method's name, or auto (what `tune` saved for this scene, else a safe "
               f"default); default {DEFAULT_METHOD}")
    sub.rare.add_argument("--settings", metavar="FILE", help="read method and options from a file "
                          "that `tune` wrote")
    sub.rare.add_argument("--force", action="store_true", help="use the settings even if they "
                          "were made for another scene or renderer")


def _render(chosen: argparse.Namespace) -> None:
    if given_options(chosen).get("presort"):
        raise OptionError("--presort sorts arrays of rays on the host, but a picture's rays are "
                          "generated on the GPU; leave --presort out, or use --sort-rays")
    check_frames(chosen)
    if chosen.frames is None:
        _check_picture(chosen)
    if chosen.timings and (chosen.frames is not None or chosen.scheduler is not None):
        raise OptionError("--timings measures one picture in this process; leave out --frames and "
                          "--scheduler")
    if chosen.scheduler is not None:
        return render_shared(chosen)
    if chosen.frames is not None:
        tracer, line = render_frames(chosen, lambda moving: _tracer(chosen, moving.scene))
        with tracer:
            return _report(chosen, tracer, line)
    timings = Timings()
    with timings.part("context"):
        open_gpu(given_options(chosen).get("context"))
    # Without --floor and --timings, `_tracer` loads the scene, after a check of the options.
    with timings.part("scene"):
        scene = scene_of(chosen) if chosen.floor or chosen.timings else None
    with timings.part("tracer"):
        tracer = _tracer(chosen, scene)
    timings.split("tracer", {"structure": tracer.statistics.build_seconds})
    with tracer:
        plan = explain(chosen, tracer)
        interrupted = False
        try:
            with timings.part("other drawing"), _watched_for_card(tracer) as card_time, (
                    progress_shown()) as progress:
                image = tracer.render(progress=progress, **drawing_of(chosen, tracer.scene))
        except KeyboardInterrupt:
            image, interrupted = tracer.unfinished(), True
            if image is None:
                raise
        timings.split("other drawing", {"passes": tracer.statistics.trace_seconds})
        with timings.part("file"), replacing(chosen.output) as path:
            image.save(path)
        _report(chosen, tracer, f"wrote {chosen.output}" + (
            " with the samples drawn before the interrupt" if interrupted else ""), plan,
            ({}, []) if interrupted else card_time(image.size),
            timings if chosen.timings else None)
        if interrupted:
            raise KeyboardInterrupt


def _watched_for_card(tracer: Tracer) -> AbstractContextManager[
        Callable[[tuple[int, int]], tuple[dict[str, Any], list[str]]]]:
    """Return the context `watched_for_card` under the option ``era``; without this option, return
    a context that measures nothing."""
    if not tracer.options["era"]:
        return nullcontext(lambda size: ({}, []))
    # Import the model of the cards only here: most pictures do not need it.
    from .card_time import watched_for_card
    return watched_for_card(tracer)


def _check_picture(chosen: argparse.Namespace) -> None:
    check_writable(chosen.output)
    if os.path.splitext(chosen.output)[1].lower() not in IMAGES:
        raise OptionError(f"{chosen.output} names no image format; end the name in .png")
    if chosen.resume and chosen.scheduler is None:
        raise OptionError("--resume needs --frames or --scheduler; without them, a picture is "
                          "drawn as a whole")


def _trace(chosen: argparse.Namespace) -> None:
    if Path(chosen.output).suffix.lower() != ".npz":
        raise OptionError(f"{chosen.output}: hits are written as .npz; end the name in .npz")
    if check_writable(chosen.output).resolve() == Path(chosen.rays).resolve():
        raise OptionError(f"the hits would overwrite the rays in {chosen.rays}; give --output "
                          "another name")
    rays = _read_rays(chosen.rays)
    if chosen.scheduler is not None:
        return trace_shared(chosen, rays)
    with _tracer(chosen) as tracer:
        hits = tracer.trace(**rays, invalid=chosen.invalid)
        with replacing(chosen.output) as path, path.open("wb") as file:
            np.savez_compressed(file, **hits.to_dict())
        _report(chosen, tracer, f"{int(hits.hit.sum()):,} of {len(hits):,} rays hit; "
                                f"wrote {chosen.output}")


def _tracer(chosen: argparse.Namespace, scene: Scene | None = None) -> Tracer:
    """Return the tracer that the arguments describe. ``scene`` replaces ``chosen.scene``."""
    source = chosen.scene if scene is None else scene
    if chosen.settings is not None:
        if chosen.method is not None:
            raise OptionError("give --method or --settings, not both")
        return Tracer.from_settings(source, chosen.settings, chosen.force,
                                    **given_options(chosen))
    if chosen.force:
        raise OptionError("--force needs --settings; give both")
    if chosen.method == AUTO:
        if given_options(chosen).get("era"):
            raise OptionError("auto chooses among today's forms of all methods; with --era, name "
                              "a method")
        return Tracer(source, AUTO, **given_options(chosen))
    method = chosen.method or DEFAULT_METHOD
    options = options_for(chosen, method)
    return Tracer(load_scene(source), method, **options)


def _bounds(tracer: Tracer) -> str:
    promise = tracer.choices.of(tracer.taken).promise
    return "" if not promise else (f": share of wrong rays at most {promise['max_wrong']:g}, "
                                   f"relative error of t at most {promise['max_t_error']:g}")


def _report(chosen: argparse.Namespace, tracer: Tracer, line: str,
            plan: Plan | None = None, on_card: tuple[dict[str, Any], list[str]] = ({}, []),
            timings: Timings | None = None) -> None:
    statistics = tracer.statistics
    card_time, card_lines = on_card
    print_stand_in(tracer.scene, chosen.json)
    if chosen.json:
        print_json({**tracer.scene.facts(), "method": tracer.method.name,
                    "gpu": tracer.gpu.info(),
                    "options": {k: v for k, v in tracer.options.items() if k != "context"},
                    "statistics": statistics.to_dict(),
                    **({} if plan is None else {"plan": plan.to_dict()}),
                    **({"on_card": card_time} if card_time else {}),
                    **({} if timings is None else {"timings": timings.parts})})
        return
    print(f"{line}\n{tracer.method.name} on {tracer.gpu.renderer}: "
          f"{counted(statistics.passes, 'pass')}, {statistics.trace_seconds * 1e3:.0f} ms for "
          f"{counted(statistics.rays, 'ray' if chosen.run is _trace else 'pixel')}, built in "
          f"{statistics.build_seconds:.2f} s")
    rays = f" for {statistics.choice} rays" if statistics.choice else ""
    if chosen.method == AUTO:
        print("auto used the settings that `tune` saved for this scene and renderer" + rays
              + _bounds(tracer) if tracer.settings is not None else
              f"auto used a safe default{rays}: `tune` saved no settings that fit")
    elif rays:
        print(f"{chosen.settings} chose this method{rays}")
    if statistics.samples:
        print(f"{counted(statistics.samples, 'sample')} per pixel" + (
            f", noise {statistics.noise:.2%} of the luminance" if statistics.noise else ""))
    if statistics.stopped:
        print(f"{statistics.stopped:,} rays were stopped before their search ended, by the step "
              f"cap of {tracer.step_cap:,} or a full stack")
    if statistics.counters:
        print("per ray: " + ", ".join(f"{k.replace('_', ' ')} {v:.2f}"
                                      for k, v in statistics.counters.items()))
    if statistics.first_hits:
        print(f"first hits rasterised; {statistics.first_hits['retraced']:,} eye rays were traced "
              f"({statistics.first_hits['retraced_share']:.3%})")
    if statistics.split:
        print("work shared by host and graphics card: " + ", ".join(
            f"{name.replace('_seconds', '').replace('_', ' ')} "
            + (f"{1e3 * value:.0f} ms" if name.endswith("seconds") else f"{value:,}")
            for name, value in statistics.split.items()))
    for line in card_lines:
        print(line)
    if timings is not None:
        timings.print()


def _read_rays(path: str) -> dict[str, np.ndarray]:
    rays = read_npz(path, "rays", names=("origins", "directions", "t_min", "t_max"))
    missing = {"origins", "directions"} - set(rays)
    if missing:
        raise Error(f"{path} has no {' and no '.join(sorted(missing))}; a ray file is an .npz "
                    "with origins and directions, (n, 3) each, and optionally t_min and t_max")
    return rays
