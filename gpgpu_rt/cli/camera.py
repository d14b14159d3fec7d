"""``--eye --target --up --fov``: change the scene's own camera."""
from __future__ import annotations

import argparse
from dataclasses import replace
from typing import Any

from ..scene.camera import Camera, Vector
from .parser import Parser

PLACES = {"eye": "position of the camera, as in --eye=-1,0,2",
          "target": "point at the centre of the picture",
          "up": "direction that points up in the picture"}


def add_camera(sub: Parser) -> None:
    group = sub.add_argument_group("camera (default: the scene's own)")
    for name, text in PLACES.items():
        (sub.rare if name == "up" else group).add_argument(
            f"--{name}", type=_vector, metavar="X,Y,Z",
            help=f"{text}; world units")
    group.add_argument("--fov", type=float, metavar="DEGREES",
                       help="vertical field of view, from edge to edge")


def given_camera(chosen: argparse.Namespace) -> dict[str, Any]:
    """Return the options that the user gave: attribute of `Camera` -> value."""
    return {name: value for name in (*PLACES, "fov")
            if (value := getattr(chosen, name)) is not None}


def camera_of(chosen: argparse.Namespace, own: Camera) -> Camera:
    """Return the scene's own camera, changed by the options."""
    return replace(own, **given_camera(chosen))


def _vector(text: str) -> Vector:
    try:
        x, y, z = map(float, text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a vector; give X,Y,Z, as in 0,1.5,2"
                                         ) from None
    return x, y, z
