"""Makes the pictures and films of docs/tour anew, by the commands that the tour's pages show."""
from __future__ import annotations

import argparse
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

WIDTH = 1200        # largest width of a figure, in pixels
TOUR = Path(__file__).parents[1] / "docs" / "tour"
# Picture (its name begins with the number of its page) -> file that a command of this page writes.
PICTURES = {
    "1-brute-force.gif": "brute/passes.gif",
    "1-pass-30.png": "brute/pass_0030.png",
    "2-grid.gif": "grid/passes.gif",
    "2-cells.png": "cells.png",
    "3-figure-11.png": "figures/out/fig11.png",
    "3-restarts.png": "restarts.png",
    "3-restart.gif": "restart/passes.gif",
    "4-threads.gif": "threads/passes.gif",
    "4-threaded.png": "threaded.png",
    "5-choice.png": "choice.png",
    "5-packets.gif": "packets/passes.gif",
    "6-rays.png": "rays.png",
    "6-classes.gif": "classes/passes.gif",
    "7-era.gif": "era-kd/passes.gif",
    "7-lost.png": "lost.png",
    "8-fp24.png": "fp24.png",
    "8-stuck.gif": "stuck/passes.gif",
}


def page_of(picture: str) -> Path:
    page, = TOUR.glob(f"{picture.partition('-')[0]}-*.md")
    return page


def command_of(picture: str) -> str:
    """Return the command that writes a picture, from the picture's page."""
    path = Path(PICTURES[picture])
    line = (rf"python -m gpgpu_rt\.figures --only {path.stem}" if path.parts[0] == "figures"
            else rf"gpgpu-rt .* -o {re.escape(path.parts[0])}")
    command, = re.findall(rf"(?m)^{line}$", page_of(picture).read_text(encoding="utf-8"))
    return command


def make(picture: str, folder: Path = TOUR) -> None:
    words = shlex.split(command_of(picture))
    words = words[1:] if words[0] == "python" else ["-m", "gpgpu_rt", *words[1:]]
    with tempfile.TemporaryDirectory() as made:
        subprocess.run([sys.executable, *words], cwd=made, check=True)
        source = Path(made) / PICTURES[picture]
        if source.parts[-3:-1] != ("figures", "out"):
            shutil.copyfile(source, folder / picture)
            return
        with Image.open(source) as figure:      # figures are wider than a page shows
            figure.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
            figure.convert("RGB").save(folder / picture, optimize=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("pictures", nargs="*", metavar="PICTURE", default=list(PICTURES),
                        help=f"make only these, out of {', '.join(PICTURES)}")
    chosen = parser.parse_args()
    unknown = set(chosen.pictures) - set(PICTURES)
    if unknown:
        parser.error(f"no picture of the tour: {', '.join(sorted(unknown))}")
    for picture in chosen.pictures:
        make(picture)


if __name__ == "__main__":
    main()
