"""The command line: ``gpgpu-rt`` and ``python -m gpgpu_rt``."""
from __future__ import annotations

import argparse
import importlib.metadata
import os
import sys
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ..disk.arrays import read_npz
from ..disk.files import FULL, check_writable, replacing
from ..errors import Error, OptionError
from ..gl.context import open_gpu, probe
from ..interrupts import STATUS
from ..methods import find_method, load_methods, methods
from ..methods.references import reference
from ..options import spell
from ..render.plan import Plan
from ..scene.loading import load_scene
from ..scene.scene import Scene
from ..scene.surfaces.geometry_image import GeometryImage
from ..scene.surfaces.parametrise import CUTS, parametrise
from ..text_format import counted
from ..tracer import AUTO, DEFAULT_METHOD, Tracer
from ..traversal.stages.first_hits import FIRST_HITS
from . import benching, conforming, hardware
from . import passes_heat as looking
from . import program
from . import report as teaching
from . import scenes, tuning, view, web
from .camera import add_camera
from .card_programs import card_time_lines, watched_for_card
from .distributed import add_scheduler, render_shared, trace_shared
from .floor import add_floor, scene_of
from .frames import IMAGES, add_frames, check_frames, render_frames
from .parser import Parser
from .picture import add_picture, drawing_of, explain, light_options, progress_shown
from .shared import (
    add_method, add_options, all_options, described, given_options, options_for, print_any_name,
    print_json, print_stand_in, print_table, say, size_word, spelled_out, word_of
)
from .streams import printed


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return the exit status. A user's mistake prints one line on stderr."""
    return printed(lambda: _main(arguments))


def _main(arguments: Sequence[str] | None) -> int:
    print_any_name()
    try:
        # Load the methods first, because they declare most of the options.
        arguments = _take_methods(sys.argv[1:] if arguments is None else arguments)
        options = {**all_options(), **light_options()}
        if not arguments:
            _parser().print_help()
            return 0
        chosen, unknown = _parser().parse_known_args(spelled_out(arguments, options))
        if unknown:
            chosen.parser.refuse(unknown[0])
        with warnings.catch_warnings():
            warnings.showwarning = _show
            for developers in (DeprecationWarning, PendingDeprecationWarning):
                warnings.simplefilter("ignore", developers)
            chosen.run(chosen)
        sys.stdout.flush()
        return 0
    except BrokenPipeError:
        raise
    except KeyboardInterrupt:
        return STATUS
    except (Error, ValueError, OSError, MemoryError) as failure:
        if os.environ.get("GPGPU_RT_TRACEBACK"):
            raise
        message = " ".join(str(failure).split()) or type(failure).__name__
        if getattr(failure, "filename", None) is None and getattr(failure, "errno", 0) in FULL:
            message = f"cannot write to the standard output: {os.strerror(failure.errno)}"
        if isinstance(failure, MemoryError):
            message += "; take a smaller picture, fewer samples or a smaller scene"
        print(f"gpgpu-rt: {message}", file=sys.stderr)
        return 1


def _show(message: Warning | str, *where: Any, **more: Any) -> None:
    """Print a warning as one line, without the place in the code that raised it."""
    say(f"gpgpu-rt: note: {message}")


# Commands ------------------------------------------------------------------------------------


def _info(chosen: argparse.Namespace) -> None:
    rows: list[dict[str, Any]] = []
    for backend, found in probe():
        rows.append({"backend": backend, "missing": str(found)} if isinstance(found, Error)
                    else found.info())
    some = not all("missing" in row for row in rows)
    if chosen.json:
        taken = open_gpu().backend if some else None
        return print_json([{**row, "taken": row["backend"] == taken} for row in rows])
    for row in rows:
        if "missing" in row:
            print(f"{row['backend']}: not available ({row['missing']})")
        else:
            print(f"{row['backend']}: {row['renderer']}\n    OpenGL {row['version']}\n"
                  f"    largest texture {row['max_texture_size']}, "
                  f"{row['max_draw_buffers']} render targets")
    if not some:
        raise Error("no OpenGL context is available; install libegl1 libgl1 libgl1-mesa-dri "
                    "(Debian, Ubuntu) or a graphics driver")
    # Print the table now: `open_gpu` on the next line may fail because of an environment variable.
    sys.stdout.flush()
    print(f"used without --context: {open_gpu().backend}")


def _methods(chosen: argparse.Namespace) -> None:
    rows = [find_method(name) for name in chosen.names] or list(methods())
    if chosen.json:
        return print_json([row.to_dict() for row in rows] if not chosen.names else [
            {**row.to_dict(), "reference": reference(row.citation),
             "files": dict(program.files_of_method(row.name))} for row in rows])
    if not chosen.names:
        print_table(("method", "paper", "what it does"),
                    [(row.name, row.citation, row.summary) for row in rows])
        print("\n`gpgpu-rt methods NAME` lists a method's own options and files.")
    for row in rows if chosen.names else ():
        print(f"{row.name}: {row.summary} ({row.citation})\n"
              f"reference: {reference(row.citation)}\n"
              f"schedules: {', '.join(row.schedules)}\n"
              f"era form: {row.why_no_era_form() and 'no, ' + row.why_no_era_form() or 'yes'}")
        print_table(("option", "default", "meaning"), [
            (word_of(o.name), "no" if o.default is False else
             "-" if o.default is None else spell(o.default), described(o))
            for o in row.options] or [("none", "-", "")])
        print()
        print_table(("file", "used by"), program.files_of_method(row.name))
        print()


def _render(chosen: argparse.Namespace) -> None:
    if given_options(chosen).get("presort"):
        raise OptionError("--presort sorts arrays of rays on the host, but a picture's rays are "
                          "generated on the GPU; leave it out, or use --sort-rays")
    check_frames(chosen)
    if chosen.frames is None:
        _check_picture(chosen)
    if chosen.scheduler is not None:
        return render_shared(chosen)
    if chosen.frames is not None:
        tracer, line = render_frames(chosen, lambda moving: _tracer(chosen, moving.scene))
        with tracer:
            return _report(chosen, tracer, line)
    with _tracer(chosen, scene_of(chosen) if chosen.floor else None) as tracer:
        plan = explain(chosen, tracer)
        interrupted = False
        try:
            with watched_for_card(tracer) as card_time, progress_shown() as progress:
                image = tracer.render(progress=progress, **drawing_of(chosen, tracer.scene))
        except KeyboardInterrupt:
            image, interrupted = tracer.unfinished(), True
            if image is None:
                raise
        with replacing(chosen.output) as path:
            image.save(path)
        _report(chosen, tracer, f"wrote {chosen.output}" + (
            " with the samples drawn before the interrupt" if interrupted else ""), plan,
            card_time())
        if interrupted:
            raise KeyboardInterrupt


def _check_picture(chosen: argparse.Namespace) -> None:
    """Refuse a picture that cannot be written, before it is drawn."""
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


def _remesh(chosen: argparse.Namespace) -> None:
    if not check_writable(chosen.output).suffix.lower() == ".npz":
        raise OptionError(f"{chosen.output}: a geometry image is written as .npz; end the name "
                          "in .npz")
    spread = parametrise(chosen.scene, chosen.size, chosen.cuts)
    image = GeometryImage([spread.image])
    image.save(chosen.output)
    found = {"output": chosen.output, "charts": image.shapes, "triangles": len(image.faces),
             "largest_distance": spread.largest_distance()}
    if chosen.json:
        return print_json(found)
    print(f"wrote {chosen.output}: {chosen.size + 1} x {chosen.size + 1} positions, "
          f"{found['triangles']:,} triangles; the distance of a vertex of the mesh from the "
          f"geometry image's surface is at most {found['largest_distance']:.2%} of the mesh's "
          "extent; render the image with -m geometry-image")


# What commands share -------------------------------------------------------------------------


def _tracer(chosen: argparse.Namespace, scene: Scene | None = None) -> Tracer:
    """Return the tracer that the arguments describe; ``scene``, if given, replaces their scene."""
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
    """Return a clause with the error bounds that the tracer's settings keep; "" without bounds."""
    promise = tracer.choices.of(tracer.taken).promise
    return "" if not promise else (f": share of wrong rays at most {promise['max_wrong']:g}, "
                                   f"relative error of t at most {promise['max_t_error']:g}")


def _report(chosen: argparse.Namespace, tracer: Tracer, line: str,
            plan: Plan | None = None, on_card: dict[str, Any] | None = None) -> None:
    statistics = tracer.statistics
    if chosen.json:
        print_json({**tracer.scene.facts(), "method": tracer.method.name,
                    "gpu": tracer.gpu.info(),
                    "options": {k: v for k, v in tracer.options.items() if k != "context"},
                    "statistics": statistics.to_dict(),
                    **({} if plan is None else {"plan": plan.to_dict()}),
                    **({"on_card": on_card} if on_card else {})})
        return
    print_stand_in(tracer.scene)
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
    for line in card_time_lines(on_card or {}, tracer):
        print(line)


def _read_rays(path: str) -> dict[str, np.ndarray]:
    rays = read_npz(path, "rays", names=("origins", "directions", "t_min", "t_max"))
    missing = {"origins", "directions"} - set(rays)
    if missing:
        raise Error(f"{path} has no {' and no '.join(sorted(missing))}; a ray file is an .npz "
                    "with origins and directions, (n, 3) each, and optionally t_min and t_max")
    return rays


# The parser ----------------------------------------------------------------------------------


def _add_methods_from(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--methods-from", metavar="FOLDER", action="append", default=[],
                        help="load your own methods from this folder, too (see CONTRIBUTING.md); "
                        "the environment variable GPGPU_RT_METHODS can name several folders")


def _take_methods(arguments: Sequence[str]) -> list[str]:
    """Load the folders of every --methods-from and return the other arguments."""
    first = Parser(prog="gpgpu-rt", add_help=False, allow_abbrev=False)
    _add_methods_from(first)
    chosen, others = first.parse_known_args(list(arguments))
    for folder in chosen.methods_from:
        load_methods(folder)
    return others


def _parser() -> argparse.ArgumentParser:
    parser = Parser(prog="gpgpu-rt", description="Ray tracing by fragment programs, as on the "
                    "graphics hardware of 2002-2007.")
    _add_methods_from(parser)
    parser.add_argument("--version", action="version",
                        version=f"gpgpu-rt {importlib.metadata.version('gpgpu_rt')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(name: str, run: Callable[[argparse.Namespace], None],
                text: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=text, description=text)
        sub.set_defaults(run=run, parser=sub)
        sub.add_argument("--json", action="store_true", help="print JSON instead of text")
        return sub

    def add_choice(sub: argparse.ArgumentParser) -> None:
        add_method(sub, "a method's name, or auto: the settings that `tune` saved for this scene, "
                   f"else a safe default; default {DEFAULT_METHOD}")
        sub.add_argument("--settings", metavar="FILE", help="read method and options from a file "
                         "that `tune` wrote")
        sub.add_argument("--force", action="store_true", help="use the settings even if they were "
                         "made for another scene or renderer")

    command("info", _info, "list the OpenGL contexts of this machine, their renderers and limits")
    sub = command("methods", _methods, "list the methods, or a method's options and files")
    sub.add_argument("names", nargs="*", metavar="NAME", help="list the options and files of "
                     "these methods")
    scenes.add_command(command)
    sub = command("render", _render, "render a scene to an image file")
    sub.add_argument("scene", help="a scene's name, a mesh file or a scene file (.json)")
    add_choice(sub)
    sub.add_argument("-o", "--output", required=True, metavar="IMAGE.png",
                     help="the file to write")
    sub.add_argument("--size", type=size_word, default=(512, 512), metavar="WIDTHxHEIGHT",
                     help="size of the picture in pixels; default 512x512")
    sub.add_argument("--first-hits", choices=FIRST_HITS, default=FIRST_HITS[0],
                     help="how to find the hits of eye rays. traced: by the method. rasterised: "
                     "by the rasteriser, with proof that each hit equals the traced hit to the "
                     "bit. verified: by the rasteriser, with a check that each hit is a hit of "
                     "its ray, but not that it is the nearest; default %(default)s")
    add_camera(sub)
    add_picture(sub)
    add_floor(sub)
    add_frames(sub)
    add_scheduler(sub, "the picture's tiles, or the frames,")
    add_options(sub)
    sub = command("trace", _trace, "trace the rays of a file and write their hits to a file")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    sub.add_argument("rays", metavar="RAYS.npz", help="arrays origins and directions, (n, 3) "
                     "each, and optionally t_min and t_max")
    add_choice(sub)
    sub.add_argument("-o", "--output", required=True, metavar="HITS.npz",
                     help="the file to write")
    sub.add_argument("--invalid", choices=("raise", "miss"), default="raise",
                     help="treat a ray with NaN, infinity or a zero direction as an error, or as "
                     "a miss; default %(default)s")
    add_scheduler(sub, "the rays")
    add_options(sub)
    sub = command("remesh", _remesh, "parametrise a surface over a square, as a geometry image")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    sub.add_argument("-o", "--output", required=True, metavar="IMAGE.npz",
                     help="the file to write")
    sub.add_argument("--size", type=int, default=128,
                     help="number of cells along each side of the square; default %(default)s")
    sub.add_argument("--cuts", type=int, default=CUTS, help="largest number of cuts towards "
                     "regions that the parametrisation shrinks too much; default %(default)s")
    benching.add_command(command)
    conforming.add_command(command)
    hardware.add_command(command)
    looking.add_commands(command)
    program.add_command(command)
    tuning.add_commands(command)
    teaching.add_command(command)
    view.add_command(command)
    web.add_command(command)
    return parser
