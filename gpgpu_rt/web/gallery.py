"""Gallery: writes a folder of pages that trace rays in a browser, and an index of the pages."""
from __future__ import annotations

import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

from ..disk.files import check_writable, replacing
from ..errors import Error, LimitError, OptionError
from ..inspect.data_uris import image_tag, png_uri
from ..inspect.heat import Heat, draw_heat, heat
from ..methods import Method, find_method, methods
from ..scene.loading import load_scene
from ..scene.scene import Scene
from ..tracer import Tracer
from .about import about
from .export import WebMethod, web_names, why_not_in_browser
from .page import write_page
from .twins import TWINS, Twin

INDEX = "index.html"
SIDE = 128      # side of the heat maps in rays


@dataclass(frozen=True)
class Gallery:
    """The files of a gallery.

    Attributes
    ----------
    methods : the methods that have a page each
    pages : names of the files in the folder, the index last
    bytes : size of all files
    """

    methods: tuple[WebMethod, ...]
    pages: tuple[str, ...]
    bytes: int


def write_gallery(scene: Scene, names: Sequence[str], folder: str,
                  left_out: dict[str, str] | None = None,
                  say: Callable[[str], None] = lambda line: None) -> Gallery:
    """Write a page per method, pages for figures of the survey (twins.py), and an index.

    Parameters
    ----------
    scene : the scene of the methods' pages
    names : the methods that get a page each. The figures' pages have their own methods
    folder : the folder, created if it is missing. Other files in the folder stay, but the earlier
        page of a method that does not run is deleted
    left_out : receives name -> reason for each method that does not run on this scene and is left
        out
    say : called with each line of progress

    Raises
    ------
    Error
        if the folder or a file cannot be written
    OptionError
        if a method cannot run in a browser, or if ``left_out`` is None and a method does not run
        on this scene
    """
    web_names(list(names))
    path = _made(folder)
    shown, reasons = list[WebMethod](), dict[str, str]()
    for name in names:
        say(f"{name} on {scene.title}")
        try:
            shown += write_page(scene, [name], str(path / f"{name}.html"), index=INDEX)
        except (OptionError, LimitError) as reason:
            # Raise the error only after the other pages and the index are written.
            reasons[name] = str(reason)
            (path / f"{name}.html").unlink(missing_ok=True)     # page of an earlier gallery
    twins = {twin: load_scene(twin.scene) for twin in TWINS}
    for twin, its_scene in twins.items():
        say(f"{twin.figure}: {', '.join(twin.methods)} on {twin.scene}")
        write_page(its_scene, list(twin.methods), str(path / twin.file),
                   title=f"{_figure_title(twin.figure)}: {its_scene.title} by "
                         f"{', '.join(twin.methods)}", caption=twin.shows, index=INDEX)
    maps = {one.name: _map(scene, one.name) for one in shown}
    with replacing(path / INDEX) as file:
        file.write_text(_index(scene, maps, twins, reasons), encoding="utf-8")
    if left_out is not None:
        left_out.update(reasons)
    elif reasons:
        raise OptionError("; ".join(reasons.values()))
    pages = *(f"{name}.html" for name in maps), *(twin.file for twin in TWINS), INDEX
    return Gallery(tuple(shown), pages, sum((path / page).stat().st_size for page in pages))


def _made(folder: str) -> Path:
    """Make the folder if needed, and check that it can be written."""
    if not folder:
        raise Error("the name of the gallery's folder is empty; give -o FOLDER")
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as failure:
        raise Error(f"cannot make the folder {folder}: {failure.strerror}") from failure
    check_writable(path / INDEX)
    return path


def _map(scene: Scene, name: str) -> Heat:
    with Tracer(scene, name, statistics=True) as tracer:
        return heat(tracer, "steps", (SIDE, SIDE))


def _index(scene: Scene, maps: Mapping[str, Heat], twins: Mapping[Twin, Scene],
           left_out: Mapping[str, str]) -> str:
    # The common scale ends at the median of the maps' 99 % quantiles. If the scale ended at the
    # largest quantile, the many steps of brute force would make all other maps dark.
    ends = [one.summary()["quantile_99"] for one in maps.values()] or [1.0]
    highest = max(1.0, statistics.median(ends))
    cards = [_card(find_method(name), one, scene, highest) for name, one in maps.items()]
    listed = [f'<li><a href="{twin.file}">{_figure_title(twin.figure)}</a>: '
              f"{escape(twin.shows)} ({', '.join(twin.methods)} on "
              f"{escape(its_scene.title)})</li>" for twin, its_scene in twins.items()]
    others = {**{row.name: why_not_in_browser(row) for row in methods()}, **left_out}
    absent = [f"<li>{name}: {escape(why)}.</li>" for name, why in others.items() if why]
    return _INDEX.format(title=escape(f"Ray tracing by fragment programs: {scene.title}"),
                         cards="".join(cards), twins="".join(listed), absent="".join(absent))


def _figure_title(name: str) -> str:
    return f"Figure {int(name.removeprefix('fig'))}"


def _card(row: Method, costs: Heat, scene: Scene, highest: float) -> str:
    mean = costs.summary()["mean"]
    picture: Any = draw_heat([costs], "steps", scene.title, highest)
    said = f"Steps per ray of {row.name} on {scene.title}; mean {mean:.1f}"
    paragraphs = "".join(f"<p>{escape(part)}</p>" for part in about(row))
    return (f'<article id="{row.name}"><h2><a href="{row.name}.html">{row.name}</a></h2>'
            f"<p>{escape(row.summary[:1].upper() + row.summary[1:])} "
            f"({escape(row.citation)}).</p>"
            f'<a href="{row.name}.html">{image_tag(png_uri(picture, 480), said)}</a>'
            f"<p>{mean:.1f} steps per ray.</p><details><summary>How it works</summary>"
            f"{paragraphs}</details></article>")


_INDEX = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; img-src data:; \
style-src 'unsafe-inline'">
<link rel="icon" href="data:,">
<title>{title}</title><style>
body {{ font: 16px/1.5 system-ui, sans-serif; color: #20242b; margin: 0 auto; max-width: 74rem;
       padding: 1rem }}
.cards {{ display: grid; gap: 1.5rem;
         grid-template-columns: repeat(auto-fill, minmax(20rem, 1fr)) }}
article {{ border: 1px solid #c9ced6; padding: 0 1rem 1rem }} h2 {{ font-size: 1.15rem }}
img {{ width: 100%; height: auto; border: 1px solid #c9ced6 }} summary {{ cursor: pointer }}
</style></head><body>
<h1>{title}</h1>
<p>Each page traces rays in your browser, on your own graphics card, by the fragment programs of
2002-2007. The pages need no server and load nothing. The pictures show the number of steps per
ray, all on one scale; numbers beyond the end of the scale have the last colour.</p>
<div class="cards">{cards}</div>
<h2>Beside the survey's figures</h2><ul>{twins}</ul>
<h2>Methods that do not run in a browser</h2><ul>{absent}</ul>
</body></html>
"""
