"""The commands that show the inside of a traversal: ``passes`` and ``heat``."""
from __future__ import annotations

import argparse
import os
from pathlib import Path

from ..disk.files import check_writable, replacing
from ..errors import OptionError
from ..inspect.heat import BY_PASS, KINDS, draw_heat, heat
from ..inspect.pass_pictures import MOST_PICTURES, write_passes
from ..methods import find_method
from ..scene.loading import load_scene
from ..text_format import counted
from ..tracer import Tracer
from .camera import add_camera, camera_of
from .frames import IMAGES
from .progress import show_progress, tenths
from .shared import (
    Command, add_method, add_methods, add_options, options_for, print_json, print_stand_in,
    print_table, size_word
)


def add_commands(command: Command) -> None:
    sub = command("passes", _passes, "write the state of every ray after every pass, as pictures, "
                  "a GIF and JSON")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    add_method(sub, "a method's name", required=True)
    sub.add_argument("-o", "--output", required=True, metavar="FOLDER",
                     help="the folder to write into, created if it is missing")
    sub.add_argument("--size", type=size_word, default=(256, 256), metavar="WIDTHxHEIGHT",
                     help="size of the grid of eye rays; default 256x256")
    sub.add_argument("--every", type=int, metavar="N", help="write a picture every N passes; "
                     f"default: an N that gives about {MOST_PICTURES} pictures")
    sub.add_argument("--states", action="store_true",
                     help="write the states and hits as .npz files, too")
    add_camera(sub)
    add_options(sub, schedule="step")
    sub = command("heat", _heat, "draw the cost of each pixel's ray as heat maps, with several "
                  "methods on one scale")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    add_methods(sub)
    sub.add_argument("--what", choices=tuple(KINDS), default="steps",
                     help="the quantity to count; default %(default)s")
    sub.add_argument("-o", "--output", required=True, metavar="IMAGE.png",
                     help="the file to write")
    sub.add_argument("--size", type=size_word, default=(256, 256), metavar="WIDTHxHEIGHT",
                     help="size of the grid of eye rays; default 256x256")
    sub.add_argument("--max", type=float, dest="highest", metavar="N", help="upper end of the "
                     "scale; default: at least 99 %% of each method's rays are on the scale")
    add_camera(sub)
    add_options(sub)


def _passes(chosen: argparse.Namespace) -> None:
    if chosen.every is not None and chosen.every < 1:
        raise OptionError(f"--every {chosen.every} must be at least 1")
    options = options_for(chosen, chosen.method)
    with Tracer(load_scene(chosen.scene), chosen.method,
                **_in_passes(chosen.method, options)) as tracer, show_progress(
                    "pass", tenths("pass")) as progress:
        found = write_passes(tracer, Path(chosen.output), chosen.size, chosen.every,
                             chosen.states, camera_of(chosen, tracer.scene.camera),
                             progress=progress)
    print_stand_in(tracer.scene, chosen.json)
    if chosen.json:
        return print_json(found)
    rows = found["passes"]
    pictures = sum("picture" in row for row in rows)
    print(f"wrote {counted(pictures, 'picture')}, passes.gif and passes.json to {chosen.output}")
    served = sum(sum(row["served"].values()) for row in rows)
    print(f"{found['method']}, {found['options']['schedule']}: {counted(len(rows), 'pass')}, "
          f"{counted(served, 'kernel run')} for {counted(found['rays'], 'ray')}; "
          f"{found['rays_hit']:,} rays hit")


def _heat(chosen: argparse.Namespace) -> None:
    check_writable(chosen.output)
    if os.path.splitext(chosen.output)[1].lower() not in IMAGES:
        raise OptionError(f"{chosen.output} names no image format; end the name in .png")
    if chosen.highest is not None and not chosen.highest > 0:
        raise OptionError(f"--max {chosen.highest:g} must be above 0")
    scene, maps, packets = load_scene(chosen.scene), [], []
    for method in chosen.methods:
        options = options_for(chosen, method)
        if options.get("era") and chosen.what != "passes":
            raise OptionError("kernels in the era form count nothing; with --era, give "
                              "--what passes")
        options = (_in_passes(method, options) if chosen.what in BY_PASS
                   else {**options, "statistics": True})
        with Tracer(scene, method, **options) as tracer:
            maps.append(heat(tracer, chosen.what, chosen.size, camera_of(chosen, scene.camera)))
            packets.append(tracer.options.get("packet"))
    with replacing(chosen.output) as path:
        draw_heat(maps, chosen.what, scene.title, chosen.highest).save(path)
    rows = [{"method": method, "map": one.title, "packet": packet, **one.summary()}
            for method, one, packet in zip(chosen.methods, maps, packets)]
    print_stand_in(scene, chosen.json)
    if chosen.json:
        return print_json({**scene.facts(), "what": chosen.what, "size": chosen.size,
                           "output": chosen.output, "methods": rows})
    print(f"wrote {chosen.output}: {KINDS[chosen.what]}")
    print_table(("method", "mean", "median", "99 %", "maximum"),
                [(row["map"], f"{row['mean']:.2f}", f"{row['median']:g}",
                  f"{row['quantile_99']:g}", f"{row['max']:g}") for row in rows])
    for row in rows:
        if row["packet"] not in (None, (1, 1)):
            print(f"{row['map']}: each pixel shows the work of its packet of "
                  f"{row['packet'][0]}x{row['packet'][1]} rays")


def _in_passes(method: str, options: dict) -> dict:
    """Return the options with a schedule of many passes, unless the user chose a schedule. The
    default ``loop`` runs a single pass, which would show nothing."""
    return options if "schedule" in options else find_method(method).in_passes(options)
