"""``gpgpu-rt report``: write one page with every figure, for reading offline."""
from __future__ import annotations

import argparse
from collections.abc import Callable

from ..report import write_report
from .shared import print_json, say, size_word


def add_command(command: Callable[..., argparse.ArgumentParser]) -> None:
    """Declare the command; ``command(name, run, text)`` returns a parser."""
    sub = command("report", _report, "one self-contained page: every figure beside what was "
                  "published, heat maps, and passes as films")
    sub.add_argument("-o", "--output", required=True, metavar="REPORT.html")
    sub.add_argument("--figures", default="figures/out", metavar="FOLDER", help="where `make "
                     "figures` wrote; default %(default)s")
    sub.add_argument("--scene", default="bunny",
                     help="of films and heat maps; default %(default)s")
    sub.add_argument("--size", type=size_word, default=(64, 64), metavar="WIDTHxHEIGHT",
                     help="rays of them; default 64x64")
    sub.add_argument("--still", action="store_true", help="leave them out")


def _report(chosen: argparse.Namespace) -> None:
    found = write_report(chosen.output, chosen.figures, chosen.scene, chosen.size,
                         not chosen.still, say)
    if chosen.json:
        return print_json(found.to_dict())
    print(f"wrote {found.output}: {len(found.figures)} figures, {found.bytes / 1e6:.1f} MB")
    if not found.figures:
        print(f"no figures in {chosen.figures}: make them by `make figures` in the checkout, or "
              "name their folder by --figures")
    elif found.missing:
        print(f"not there yet: {', '.join(found.missing)}; `make figures` measures them")
