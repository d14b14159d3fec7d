"""Figures on the page: converts the files NAME.md and NAME.png of ``make figures`` to HTML."""
from __future__ import annotations

import html
import re
from collections.abc import Collection
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from ..errors import Error, how_to_install
from ..inspect.data_uris import description_of, image_tag, png_uri
from .verdict_badges import JudgedFigure, judged_figure, verdict_line

SHORT = 3000     # a text of at most this many characters is shown expanded
# HTML attributes of a box that scrolls sideways. The keyboard can scroll the box, too.
_WIDE = 'class="wide" tabindex="0"'


@dataclass(frozen=True)
class Figure:
    """A figure that ``make figures`` has written.

    Attributes
    ----------
    name : the name for ``python -m gpgpu_rt.figures --only``
    folder : the folder with the figure's files
    """

    name: str
    folder: Path

    @cached_property
    def text(self) -> str:
        """The text of the figure in Markdown."""
        try:
            return (self.folder / f"{self.name}.md").read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as failure:
            raise Error(f"cannot read {self.folder / self.name}.md: {failure}") from failure

    @cached_property
    def title(self) -> str:
        """The title, or the name if the text has no title."""
        first = self.text.lstrip().partition("\n")[0]
        return first[2:].strip() if first.startswith("# ") else self.name

    @cached_property
    def judged(self) -> JudgedFigure | None:
        """The verdict, or None for a figure without a verdict."""
        return judged_figure(self.name, self.title, self.folder)

    def section(self, width: int, known: Collection[str]) -> str:
        """Return HTML with the title, the verdict, the chart, and the text with its tables.

        Parameters
        ----------
        width : largest width of pictures in pixels
        known : the figures of the page; links to these figures are kept
        """
        body = self.text.strip()
        if body.startswith("# "):
            body = body.partition("\n")[2]
        text = to_html(body, self.folder, width, known)
        chart = self.folder / f"{self.name}.png"
        drawn = "" if f"({chart.name})" in body else _picture(
            chart, f"The chart of the figure {self.name}, whose numbers are in the tables below",
            width)
        opened = " open" if len(body) <= SHORT else ""
        said = verdict_line(self.judged) if self.judged else ""
        return (f'<section class="figure" id="{html.escape(self.name)}">'
                f"<h3>{html.escape(self.title)}</h3>{said}{drawn}"
                f"<details{opened}><summary>Tables and remarks</summary>{text}</details>"
                "</section>")


def to_html(text: str, folder: Path, width: int, known: Collection[str] = ()) -> str:
    """Convert Markdown to HTML that loads nothing from the network or the disk.

    Embed the pictures of ``folder``. Point links to ``known`` figures into the page, and turn
    other links into plain text.
    """
    try:
        from markdown_it import MarkdownIt
    except ImportError:
        raise Error(f"the report needs markdown-it-py; {how_to_install('report')}") from None
    reader = MarkdownIt("commonmark", {"html": False}).enable("table")
    tokens = reader.parse(text)
    for token in tokens:
        if token.type in ("heading_open", "heading_close"):
            token.tag = f"h{min(6, int(token.tag[1]) + 2)}"
        for child in token.children or ():
            _within(child, folder, known)
    made = reader.renderer.render(tokens, reader.options, {})
    made = re.sub(r'<img src="([^"]*)" alt="([^"]*)"[^>]*>', lambda match: _embedded(
        folder, html.unescape(match[1]), html.unescape(match[2]), width), made)
    return made.replace("<table>", f"<div {_WIDE}><table>").replace("</table>", "</table></div>")


def _within(token: Any, folder: Path, known: Collection[str]) -> None:
    if token.type != "link_open":
        return
    name = Path(str(token.attrGet("href"))).stem
    if name in known:
        token.attrSet("href", f"#{name}")
    else:
        token.tag, token.attrs = "span", {}


def _embedded(folder: Path, url: str, text: str, width: int) -> str:
    """Return HTML with the picture at ``url``. A path outside the folder of the figures counts as
    missing: the page may be published, and such a file may be private."""
    name = unquote(url)
    try:
        path = (folder / name).resolve()
        if path.is_relative_to(folder.resolve()):
            return _picture(path, text, width)
    except (OSError, ValueError):       # the name is not valid for a file
        pass
    return _lacking(name)


def _lacking(name: str) -> str:
    return f'<p class="missing">The picture {html.escape(name)} is missing.</p>'


def _picture(path: Path, text: str, width: int) -> str:
    """Return HTML with a picture in a box that scrolls sideways on a narrow screen. ``text``
    describes the picture if its file has no description."""
    try:
        tag = image_tag(png_uri(path, width), description_of(path) or text)
        return f"<span {_WIDE}>{tag}</span>"
    except (OSError, ValueError):
        return _lacking(path.name)
