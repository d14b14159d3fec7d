"""``gpgpu-rt web``: write pages that trace a scene in a browser, by the tracer's programs."""
from __future__ import annotations

import argparse
from pathlib import Path

from ..disk.files import check_writable
from ..scene.loading import load_scene
from ..text_format import counted
from ..web.export import web_names
from ..web.gallery import INDEX, write_gallery
from ..web.page import write_page
from .shared import Command, add_methods, print_json, print_stand_in, say


def add_commands(command: Command) -> None:
    sub = command("web", _web, "write pages that trace a scene in a browser")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    add_methods(sub, "kd-restart, grid and bvh-threaded; 'all' for every method that runs in a "
                "browser")
    sub.add_argument("-o", "--output", required=True, metavar="PAGE.html|FOLDER",
                     help="the page to write; or, if the name does not end in .html, a folder for "
                     "a gallery: an index, a page for each method, and, for some figures of the "
                     "survey, a page on which the reader can try the figure's methods")


def _web(chosen: argparse.Namespace) -> None:
    named = chosen.methods or ["kd-restart", "grid", "bvh-threaded"]
    every, left_out = named == ["all"], dict[str, str]()
    names = web_names(None if every else named)
    lenient = left_out if every else None   # with None, a method that cannot run is an error
    scene = load_scene(chosen.scene)
    folder = not chosen.output.lower().endswith((".html", ".htm"))
    if folder:
        made = write_gallery(scene, names, chosen.output, lenient, say)
        methods, written, size = made.methods, made.pages, made.bytes
    else:
        check_writable(chosen.output)
        methods = tuple(write_page(scene, names, chosen.output, lenient))
        written, size = (chosen.output,), Path(chosen.output).stat().st_size
    shown = [one.name for one in methods]
    without_steps = {one.name: one.no_path for one in methods if not one.has_steps}
    print_stand_in(scene, chosen.json)
    if chosen.json:
        return print_json({**scene.facts(), "methods": shown, "left_out": left_out,
                           "without_steps": without_steps, "output": chosen.output,
                           "pages": written, "bytes": size})
    print(f"wrote {chosen.output}: {', '.join(shown)}; "
          f"{counted(len(written), 'page')}, {size / 1e6:.1f} MB")
    for name, reason in without_steps.items():
        print(f"the page shows no steps and no path of {name}: {reason}")
    for reason in left_out.values():
        print(f"left out: {reason}")
    if folder:
        print(f"open {Path(chosen.output) / INDEX} in a browser")
