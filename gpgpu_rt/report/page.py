"""The page: chapters, figures and films in one file that needs no network."""
from __future__ import annotations

import base64
import hashlib
import html
import importlib.resources
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ..disk.files import check_writable, replacing
from ..errors import Error
from ..scene.loading import load_scene
from ..scene.scene import Scene
from ..web.twins import TWINS, Twin
from .chapters import CHAPTERS, Chapter
from .figure import Figure, to_html
from .films import film, heat_maps, or_why_not
from .verdict_badges import BADGE_STYLE, overview

LIMIT = 15_000_000      # bytes
# Widths in pixels to which wider pictures are shrunk. The first width is used that keeps the file
# within LIMIT.
WIDTHS = (1400, 1000, 700, 450)

PARTS = importlib.resources.files(__package__)
STYLE, SCRIPT = (PARTS.joinpath(name).read_text(encoding="utf-8")
                 for name in ("page.css", "page.js"))
# The content security policy forbids all requests, so even a faulty page cannot contact a server.
# The policy allows only the page's own script, whose digest it names.
_DIGEST = base64.b64encode(hashlib.sha256(SCRIPT.encode()).digest()).decode()
_HEAD = f"""<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; \
style-src 'unsafe-inline'; script-src 'sha256-{_DIGEST}'">
<meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,">
<title>Ray tracing by fragment programs</title>
<style>
{STYLE}{BADGE_STYLE}
</style></head><body>
"""
_FOOT = f"</main><script>{SCRIPT}</script></body></html>\n"


@dataclass
class Report:
    """The result of writing a page.

    Attributes
    ----------
    output : the file
    bytes : the size of the file
    figures : names of the figures on the page
    missing : names of the figures that are not yet measured
    """

    output: str
    bytes: int
    figures: list[str]
    missing: list[str]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        return dict(vars(self))


def write_report(output: str | os.PathLike[str], figures: str | os.PathLike[str] = "figures/out",
                 scene: Scene | str = "bunny", size: tuple[int, int] = (64, 64),
                 films: bool = True, say: Callable[[str], None] = lambda line: None,
                 web: str | os.PathLike[str] = "web") -> Report:
    """Write the teaching page.

    Parameters
    ----------
    output : the HTML file to write, at most LIMIT bytes
    figures : the folder that ``python -m gpgpu_rt.figures`` writes; the page lists missing figures
    scene : the scene of the films and heat maps
    size : (width, height) in rays of the films and heat maps
    films : whether to make films and heat maps, which takes a minute and needs an OpenGL context
    say : called with each line about progress
    web : the folder that ``make web`` writes. A figure links to its interactive pages in this
        folder. The links are relative, so publish the report and the folder together

    Raises
    ------
    Error
        if the file cannot be written, or is too large even with small pictures
    """
    path, folder = check_writable(output), Path(figures)
    there = sorted(one.stem for one in folder.glob("*.md") if one.stem != "index")
    named = {name for chapter in CHAPTERS for name in chapter.figures}
    other = tuple(name for name in there if name not in named)
    chapters = CHAPTERS + ((Chapter("Further figures", "", other),) if other else ())
    scene = load_scene(scene) if films else scene
    made: dict[tuple[Any, ...], str] = {}

    def once(make: Callable[..., str], *arguments: Any) -> str:
        """Return the HTML of a film or of heat maps. Make the HTML once, and keep it for further
        calls of `put_together`."""
        key = make, arguments
        if key not in made:
            what = arguments[0] if isinstance(arguments[0], str) else ", ".join(arguments[0])
            say(f"{make.__name__.replace('_', ' ')}: {what}")
            made[key] = or_why_not(lambda: make(scene, *arguments))
        return made[key]

    def put_together(width: int) -> str:
        parts = [_HEAD, _contents(chapters), _opening(there, named), overview(
            one for name in there if (one := Figure(name, folder).judged) is not None)]
        for k, chapter in enumerate(chapters):
            parts.append(f'<h2 id="chapter{k}">{html.escape(chapter.title)}</h2>'
                         + to_html(chapter.text, folder, width))
            if films:
                parts += [once(film, method, size) for method in chapter.passes]
                parts += [once(heat_maps, chapter.heat, size)] if chapter.heat else []
            for name in chapter.figures:
                parts.append(Figure(name, folder).section(width, there) if name in there
                             else _missing(name))
                parts += [_link(twin, Path(web), path) for twin in TWINS if twin.figure == name]
        return "\n".join([*parts, _FOOT])

    for width in WIDTHS:
        content = put_together(width).encode()
        if len(content) <= LIMIT:
            break
        say(f"{len(content):,} bytes with pictures of {width} pixels: trying smaller pictures")
    else:
        raise Error(f"the page has {len(content):,} bytes, more than {LIMIT:,}; remove figures "
                    "from the folder, or use --still")
    with replacing(path) as temporary:
        temporary.write_bytes(content)
    return Report(str(path), len(content), there,
                  [name for chapter in CHAPTERS for name in chapter.figures if name not in there])


def _contents(chapters: tuple[Chapter, ...]) -> str:
    """Return the list of chapters, which stays in view."""
    items = "".join(f'<li><a href="#chapter{k}">{html.escape(one.title)}</a></li>'
                    for k, one in enumerate(chapters))
    return ('<nav id="contents" aria-label="Contents"><details open><summary>Contents</summary>'
            f'<ol><li><a href="#verdicts">What came out</a></li>{items}</ol></details></nav>')


def _opening(there: list[str], named: set[str]) -> str:
    lacking = len(named - set(there))
    note = "" if not lacking else (f'<p class="missing">{lacking} of {len(named)} figures are '
                                   "missing: <code>make figures</code> measures them.</p>")
    return ("<main><h1>Ray tracing by fragment programs, 2002 to 2007</h1><p>A companion to "
            "Toshiya Hachisuka’s survey <em>Ray Tracing on Graphics Hardware</em>. The survey’s "
            "methods run again, and the page compares measured with published numbers.</p>"
            + note)


def _link(twin: Twin, web: Path, output: Path) -> str:
    """Return a link to a figure's interactive page; "" if the page was not written."""
    if not (web / twin.file).is_file():
        return ""
    place = quote(Path(os.path.relpath(web / twin.file, output.parent)).as_posix())
    return (f'<p>{html.escape(twin.shows)} <a href="{html.escape(place)}">Try '
            f"{html.escape(', '.join(twin.methods))} in your browser</a>.</p>")


def _missing(name: str) -> str:
    return (f'<section class="figure" id="{html.escape(name)}"><p class="missing">'
            "Not measured yet: "
            f"<code>python -m gpgpu_rt.figures --only {name}</code></p></section>")
