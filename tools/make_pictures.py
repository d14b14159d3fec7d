"""Makes the pictures of README.md in docs/readme/ anew, by the project's own commands.

No meshes of this machine are used, so every machine makes the same pictures, in about two minutes
on two cores. The picture of the web page needs Chromium.
"""
from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

ROOT = Path(__file__).parents[1]
WIDTH = 300         # pixels of the small pictures
Box = tuple[int, int, int, int]     # left, top, right and bottom in pixels
# README.md shows only these parts of wide pictures. In whole pictures, text would be too small to
# read.
VIEWER: Box = (400, 0, 1100, 514)
TREE: Box = (730, 60, 1310, 430)
DRAWING: Box = (549, 194, 955, 494)
FILM = ("passes", "kitchen", "-m", "kd-restart", "--size", "128x128")
FRAMES = 110        # largest number of frames of the film
FRAME_MS, LAST_MS = 90, 2500    # milliseconds per frame, and for the last frame


def run(folder: Path, *words: str) -> None:
    """Runs a command of gpgpu-rt in a folder, without this machine's meshes."""
    print("gpgpu-rt", *words, flush=True)
    bare = {**os.environ, "GPGPU_RT_SCENES": "", "XDG_DATA_HOME": str(folder)}
    subprocess.run([sys.executable, "-m", "gpgpu_rt", *words], cwd=folder, check=True, env=bare,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def small(source: Path, target: Path, box: Box | None = None) -> None:
    """Writes a picture, or its part in ``box``, at most WIDTH pixels wide."""
    with Image.open(source) as image:
        picture = image.convert("RGB").crop(box)
        picture.thumbnail((WIDTH, 10 * WIDTH), Image.Resampling.LANCZOS)
        picture.save(target, optimize=True)


def film(folder: Path, target: Path) -> None:
    """Writes the passes of a traversal as a film.

    Half of the rays end in the first passes. So the film shows most of the first passes, and ever
    fewer of the later passes: the numbers of the shown passes form a geometric series.
    """
    run(folder, *FILM, "--every", "2", "-o", "passes")
    pictures = sorted(folder.glob("passes/pass_*.png"))
    chosen = np.unique(np.geomspace(1, len(pictures), FRAMES).astype(int) - 1)
    frames = [Image.open(pictures[at]).convert("RGB") for at in chosen]
    # All frames share a palette, which is made from three frames. Without dithering, areas stay
    # flat and the file is small.
    sheet = Image.new("RGB", (frames[0].width, 3 * frames[0].height))
    for k, at in enumerate((len(frames) // 4, len(frames) // 2, len(frames) - 1)):
        sheet.paste(frames[at], (0, k * frames[0].height))
    palette = sheet.quantize(256)
    flat = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    flat[0].save(target, save_all=True, append_images=flat[1:], loop=0, optimize=True,
                 duration=[FRAME_MS] * (len(flat) - 1) + [LAST_MS])


def viewer(folder: Path, target: Path) -> None:
    small(ROOT / "docs" / "viewer.png", target, VIEWER)


def heat(folder: Path, target: Path) -> None:
    run(folder, "heat", "kitchen", "-m", "kd-restart", "-m", "bvh-threaded", "-o", "heat.png")
    small(folder / "heat.png", target)


def figure(folder: Path, target: Path) -> None:
    print("python -m gpgpu_rt.figures --only fig19", flush=True)
    subprocess.run([sys.executable, "-m", "gpgpu_rt.figures", "--only", "fig19", "--data",
                    str(folder / "data"), "--out", str(folder / "out")], cwd=folder, check=True,
                   stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    small(folder / "out" / "fig19.png", target, TREE)


def page(folder: Path, target: Path) -> None:
    """Writes the web page's drawing of a ray, as a browser shows it."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        print("SKIPPED: the picture of the page needs Chromium")
        return
    run(folder, "web", "teapot", "-m", "kd-restart", "-o", "page.html")
    subprocess.run([chromium, "--headless=new", "--no-sandbox", "--use-gl=angle",
                    "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                    "--window-size=1085,745", "--virtual-time-budget=20000",
                    f"--user-data-dir={folder / 'profile'}",
                    f"--screenshot={folder / 'page.png'}", (folder / "page.html").as_uri()],
                   check=True, stderr=subprocess.DEVNULL)
    small(folder / "page.png", target, DRAWING)


def light(folder: Path, target: Path) -> None:
    run(folder, "render", "cornell-light", "--integrator", "path", "--samples", "256", "--size",
        "180", "-o", "light.png")
    small(folder / "light.png", target)


PICTURES: dict[str, Callable[[Path, Path], None]] = {
    "film.gif": film, "viewer.png": viewer, "heat.png": heat, "figure.png": figure,
    "page.png": page, "light.png": light}


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("pictures", nargs="*", metavar="NAME", help="make only these pictures: "
                        + ", ".join(PICTURES))
    parser.add_argument("-o", "--output", default=str(ROOT / "docs" / "readme"), metavar="FOLDER",
                        help="folder of the pictures; default docs/readme")
    chosen = parser.parse_args()
    unknown = [name for name in chosen.pictures if name not in PICTURES]
    if unknown:
        parser.error(f"there is no picture {unknown[0]}; the pictures are {', '.join(PICTURES)}")
    output = Path(chosen.output)
    output.mkdir(parents=True, exist_ok=True)
    for name in chosen.pictures or PICTURES:
        with tempfile.TemporaryDirectory(prefix="gpgpu_rt_picture") as folder:
            PICTURES[name](Path(folder), output / name)
        if (output / name).exists():
            print(f"{name}: {(output / name).stat().st_size / 1000:.0f} kB", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
