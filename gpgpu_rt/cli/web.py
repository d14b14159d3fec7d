"""``gpgpu-rt web``: a page that traces a scene in a browser, by the same programs."""
from __future__ import annotations

import argparse
from pathlib import Path

from ..disk.files import check_writable
from ..scene.loading import load_scene
from ..web.export import web_names
from ..web.page import write_page
from .shared import Command, add_methods, print_json, print_stand_in


def add_command(command: Command) -> None:
    """Declare the command. ``command(name, run, text)`` returns its parser."""
    sub = command("web", _web, "write a page that traces a scene in a browser")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    add_methods(sub, "kd-restart, grid and bvh-threaded; 'all' for every method that runs in a "
                "browser")
    sub.add_argument("-o", "--output", required=True, metavar="PAGE.html",
                     help="the file to write")


def _web(chosen: argparse.Namespace) -> None:
    named = chosen.methods or ["kd-restart", "grid", "bvh-threaded"]
    every, left_out = named == ["all"], dict[str, str]()
    names = web_names(None if every else named)
    check_writable(chosen.output)
    scene = load_scene(chosen.scene)
    found = [one.name for one in write_page(scene, names, chosen.output,
                                            left_out if every else None)]
    size = Path(chosen.output).stat().st_size
    if chosen.json:
        return print_json({**scene.facts(), "methods": found, "left_out": left_out,
                           "output": chosen.output, "bytes": size})
    print_stand_in(scene)
    print(f"wrote {chosen.output}: {', '.join(found)}; {size / 1e6:.1f} MB")
    for reason in left_out.values():
        print(f"left out: {reason}")
