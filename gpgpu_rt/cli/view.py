"""``gpgpu-rt view``: open a window that shows a scene by any method."""
from __future__ import annotations

import argparse
import os
from collections.abc import Callable

from ..errors import Error, OptionError, how_to_install
from ..methods import find_method
from ..render.integrators import find_integrator
from ..tracer import AUTO, DEFAULT_METHOD
from ..viewer.selection import DECIDED, Selection
from .camera import add_camera, camera_of
from .picture import add_picture, picture_options
from .shared import add_method, add_options, options_for, print_json, size_word


def add_commands(command: Callable[..., argparse.ArgumentParser]) -> None:
    sub = command("view", _view, "open a window: look around, change method and options, see "
                  "every pass and the cost of rays")
    sub.add_argument("scene", nargs="?", default="bunny", help="a scene's name, a mesh file or a "
                     "scene file (.json); default %(default)s")
    add_method(sub, f"a method's name; default {DEFAULT_METHOD}")
    sub.add_argument("--size", type=size_word, default=(1000, 700), metavar="WIDTHxHEIGHT",
                     help="size of the window in pixels; default 1000x700")
    sub.add_argument("--folder", default=".",
                     help="folder for saved pictures; default: the current folder")
    add_camera(sub)
    add_picture(sub)
    add_options(sub)


def _view(chosen: argparse.Namespace) -> None:
    if chosen.method == AUTO:
        raise OptionError("the viewer cannot use the settings of tune, because the user of "
                          "the viewer changes settings; give a method's name")
    if not os.path.isdir(chosen.folder):
        raise OptionError(f"--folder {chosen.folder}: there is no such folder; create it first")
    method = find_method(chosen.method or DEFAULT_METHOD)
    selection = Selection(chosen.scene, method.name)
    for name, value in options_for(chosen, method.name).items():
        if name in DECIDED:
            raise OptionError(f"the viewer sets {name} itself; leave the option out")
        selection = selection.with_option(name, value)
    light = picture_options(chosen)
    selection = selection.with_integrator(find_integrator(light.pop("integrator")).name)
    for name, value in light.items():
        selection = selection.with_light(name, value)
    try:
        from ..viewer.window import run
    except ImportError as failure:
        raise Error(f"the viewer needs {failure.name}; {how_to_install('view')}, or run `make "
                    "view`") from failure
    found = run(selection, chosen.size, chosen.folder, lambda own: camera_of(chosen, own))
    if chosen.json:
        print_json(found)
