"""``gpgpu-rt remesh``: make a geometry image of a surface."""
from __future__ import annotations

import argparse

from ..disk.files import check_writable
from ..errors import OptionError
from ..scene.surfaces.geometry_image import GeometryImage
from ..scene.surfaces.parametrise import CUTS, parametrise
from .shared import Command, print_json


def add_commands(command: Command) -> None:
    sub = command("remesh", _remesh, "parametrise a surface over a square, as a geometry image")
    sub.add_argument("scene", help="a scene's name or a mesh file")
    sub.add_argument("-o", "--output", required=True, metavar="IMAGE.npz",
                     help="the file to write")
    sub.add_argument("--size", type=int, default=128,
                     help="number of cells along each side of the square; default %(default)s")
    sub.add_argument("--cuts", type=int, default=CUTS, help="largest number of additional "
                     "cuts; each cut reaches a part of the surface that the parametrisation "
                     "shrinks too much; default %(default)s")


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
