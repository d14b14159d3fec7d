"""``gpgpu-rt report``: write one page with every figure, for reading offline."""
from __future__ import annotations

import argparse
from collections.abc import Callable

from ..report import write_report
from .shared import print_json, say, size_word


def add_commands(command: Callable[..., argparse.ArgumentParser]) -> None:
    sub = command("report", _report, "write one self-contained page: every figure beside the "
                  "published numbers, heat maps, and films of passes")
    sub.add_argument("-o", "--output", required=True, metavar="REPORT.html",
                     help="the file to write")
    sub.add_argument("--figures", default="figures/out", metavar="FOLDER",
                     help="the folder that `make figures` wrote; default %(default)s")
    sub.add_argument("--scene", default="bunny",
                     help="scene of the films and heat maps; default %(default)s")
    sub.add_argument("--size", type=size_word, default=(64, 64), metavar="WIDTHxHEIGHT",
                     help="size of the grid of rays in the films and heat maps; default 64x64")
    sub.add_argument("--web", default="web", metavar="FOLDER", help="the folder that `make web` "
                     "wrote; the report links to its pages. Default %(default)s")
    sub.add_argument("--still", action="store_true", help="leave out the films and heat maps")


def _report(chosen: argparse.Namespace) -> None:
    found = write_report(chosen.output, chosen.figures, chosen.scene, chosen.size,
                         not chosen.still, say, chosen.web)
    if chosen.json:
        return print_json(found.to_dict())
    print(f"wrote {found.output}: {len(found.figures)} figures, {found.bytes / 1e6:.1f} MB")
    if not found.figures:
        print(f"no figures in {chosen.figures}: run `make figures` in the checkout, or name the "
              "folder of the figures by --figures")
    elif found.missing:
        print(f"missing figures: {', '.join(found.missing)}; `make figures` makes them")
